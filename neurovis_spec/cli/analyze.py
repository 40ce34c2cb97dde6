"""``neurovis analyze``: what a run tells, as tables, pictures and a page."""

from __future__ import annotations

import csv
import json
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from neurovis_spec.cli.completion import paths
from neurovis_spec.cli.failure import fault
from neurovis_spec.cli.files import (
    check_files,
    check_folder,
    check_target,
    count,
    files_of,
    network_of,
    recording_of,
    tables,
    writing,
)
from neurovis_spec.cli.options import (
    FirstStep,
    as_one,
    body_options,
    examples,
    finite,
    input_option,
    need_run,
    run_option,
    set_option,
    spec_argument,
    theme_option,
)
from neurovis_spec.cli.progress import progress

if TYPE_CHECKING:
    from neurovis_spec.analysis.report import Measured, ReportOptions
    from neurovis_spec.arrays import FloatArray

#: groups that spike are printed up to so many
_MOST_GROUPS: Final = 20


@dataclass(frozen=True)
class Measuring:
    """What of a run is measured, and how that is printed (``form``), as the command line says it."""

    of: tuple[str, ...]
    start: int | None
    stop: int | None
    threshold: float
    bins: int
    trials: bool
    form: str
    theme: str | None


measuring_options: Final = as_one(
    "measuring",
    Measuring,
    click.option(
        "--of", metavar="REFS", multiple=True, help="The neurons to measure, such as K or 'C + K'; default: all."
    ),
    click.option("--from", "start", type=FirstStep(0, 2**53), metavar="STEP", help="The first step to measure."),
    click.option("--to", "stop", type=click.IntRange(1, 2**53), metavar="STEP", help="The step to end before."),
    click.option(
        "--threshold",
        type=click.FloatRange(min=0),
        callback=finite,
        default=0.05,
        metavar="X",
        help="A neuron is active while its absolute activity is above X; default: 0.05.",
    ),
    click.option(
        "--bins", type=click.IntRange(2, 1000), default=20, metavar="N", help="Bins of mutual information; default: 20."
    ),
    click.option(
        "--trials/--no-trials",
        default=True,
        help="Make the further runs that importance and sensitivity need (default), or leave these out.",
    ),
    click.option(
        "--format", "form", type=click.Choice(["text", "json"]), default="text", help="text (default) or a JSON object."
    ),
    theme_option,
)


@click.command(
    epilog=examples(
        "neurovis analyze first.yaml -o readings",
        "neurovis analyze first.yaml --of K --from 9428 -o readings",
        "neurovis analyze first.yaml --recording first.npz --no-trials -o readings",
        "neurovis analyze first.yaml -o readings --format json | jq .measures[].notes",
        "neurovis analyze hexapod.yaml --of left.CF+right.CF --threshold 0.5 --from 120 --to 360 -o gait",
    )
)
@spec_argument
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    metavar="FOLDER",
    required=True,
    help="The folder for the tables, the pictures and the page (index.html); it is made if it is not there.",
)
@click.option("--recording", metavar="FILE", shell_complete=paths, help="Measure this; without it the network is run.")
@run_option
@measuring_options
@set_option
@input_option
@body_options
def command(
    spec: str,
    output: Path,
    recording: str | None,
    run: int | None,
    measuring: Measuring,
    settings: dict[str, float | str],
    inputs: dict[str, str],
) -> None:
    """Measure a run, into tables, pictures and a page.

    The page says what each measure means. The measures are those of the NeuroVis paper: connection matrix, traces,
    topography, cross-correlation, mutual information, co-activation, weights and their updates, the gait diagram, and
    what the outputs lose and gain with each part; where neurons spike their rates, intervals and cross-correlograms,
    and rates over episodes. What cannot be measured is left out, and the page says why. With --format json the tables
    and what is said of them are printed, too, as an object: measures, each with its notes, tables and the names of its
    pictures, and the files.
    """
    need_run(inputs, recording)
    start, stop = measuring.start, measuring.stop
    if start is not None and stop is not None and stop <= start:
        raise click.UsageError(f"--to {stop} is not behind --from {start}: there is no step to measure")
    if find_spec("jinja2") is None:
        raise fault("the page needs jinja2, which is not installed", "pip install 'neurovis-spec[analyze]'")
    from neurovis_spec.analysis.report import file_names, measure

    check_folder(output)
    read = [("the spec itself", spec), ("the recording that is measured", recording), *files_of(inputs)]
    if output.is_dir():
        for name in file_names():
            check_target(output / name, read)
    network = network_of(spec, settings)
    for name in file_names():
        check_files(output / name, network)
    record, options = recording_of(recording, run), _options(measuring, tables(inputs, network.network))
    with progress("measuring") as bar, writing(output):
        made = measure(network, record, options, bar)
        files = made.write(output)
    if measuring.form == "json":
        _print_json(made, output, files)
        return
    _print_firing(files)
    click.echo(f"{output}: {count(len(files), 'file')}; open {output / 'index.html'}")


def _options(measuring: Measuring, inputs: dict[str, FloatArray]) -> ReportOptions:
    from neurovis_spec.analysis.report import ReportOptions

    return ReportOptions(
        of=measuring.of or None,
        start=measuring.start,
        stop=measuring.stop,
        threshold=measuring.threshold,
        bins=measuring.bins,
        trials=measuring.trials,
        theme=measuring.theme,
        inputs=inputs,
    )


def _print_json(made: Measured, output: Path, files: Sequence[Path]) -> None:
    """What was measured, and the files that have it, as an object."""
    written = {"folder": str(output), "files": [file.name for file in files]}
    click.echo(json.dumps({**made.plain, **written}, indent=2, ensure_ascii=False, allow_nan=False))


def _print_firing(files: Sequence[Path]) -> None:
    """How the groups fire, where they do."""
    from neurovis_spec.cli.tables import table

    path = next((path for path in files if path.name == "group_firing.csv"), None)
    if path is not None:
        header, *rows = csv.reader(path.read_text(encoding="utf-8").splitlines())
        told = [(name, *(f"{float(value):.4g}" if value else "–" for value in values)) for name, *values in rows]
        units = {"rate": "rate (1/s)", "interval": "interval (s)"}
        click.echo(table(told[:_MOST_GROUPS], ("", *(units.get(name, name) for name in header[1:]))))
