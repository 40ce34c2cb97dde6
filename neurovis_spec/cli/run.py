"""``neurovis run``: a run of a network, recorded or summed up."""

from __future__ import annotations

from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Literal, TypedDict

import click

from neurovis_spec.cli.completion import paths
from neurovis_spec.cli.files import count, network_of, recording_of, tables, writing
from neurovis_spec.cli.options import (
    backend_option,
    body_options,
    compile_options,
    examples,
    input_option,
    output_option,
    set_option,
)
from neurovis_spec.cli.progress import progress
from neurovis_spec.cli.targets import check_files, check_target, files_of

if TYPE_CHECKING:
    from neurovis_spec.compiled import CompiledNetwork
    from neurovis_spec.runtime.recording import Recording
    from neurovis_spec.runtime.until import Until

#: activities shown where nothing is written to a file
_MOST_SHOWN = 20


class Chosen(TypedDict):
    """How the network runs, what of a step is recorded, and where a run goes on."""

    backend: str | None
    every: int
    start: Recording | None
    until: Until | None
    states: tuple[str, ...]
    neurons: tuple[str, ...]
    weights: Literal["plastic", "none"]
    checkpoint: Path | None


@click.command(
    epilog=examples(
        "neurovis run first.yaml",
        "neurovis run first.yaml --steps 4000 --set gain=0.5 -o first.npz",
        "neurovis run first.yaml --input touch=touch.csv --every 10 -o first.csv",
        "neurovis run first.yaml --from first.npz -o second.npz",
        'neurovis run first.yaml --steps 100000 --until "rms(O, last=100) < 0.01"',
        "neurovis run --backend list",
    )
)
@click.argument("spec", metavar="SPEC", shell_complete=paths)
@click.option(
    "--steps", type=click.IntRange(1, 2**53), metavar="N", help="Steps to run; default: the spec's time.steps."
)
@set_option
@input_option
@backend_option
@click.option(
    "--every", type=click.IntRange(1, 2**53), default=1, metavar="K", help="Record every K-th step only; default 1."
)
@click.option(
    "--from",
    "start",
    metavar="RECORDING",
    shell_complete=paths,
    help="Begin with the last weights and activities of this recording; states of models begin anew.",
)
@click.option(
    "--states",
    metavar="REF",
    multiple=True,
    help="Record a state of models (K.v) or rules ('(K -> O).eligibility') as well. Repeatable.",
)
@click.option(
    "--neurons", metavar="REFS", multiple=True, help="Record these neurons only, such as 'O + K'; default: all."
)
@click.option(
    "--weights",
    type=click.Choice(["plastic", "none"]),
    default="plastic",
    help="Record the weights that can change, the default, or none.",
)
@click.option(
    "--until",
    metavar="EXPR",
    help="End at the first step after which this is true: an expression of neurons, outputs, parameters, k and t, with "
    "rms, mean, min and max over the last N steps. Steps are the most there are.",
)
@click.option(
    "--checkpoint",
    type=click.Path(path_type=Path),
    metavar="FILE",
    shell_complete=paths,
    help="Go on exactly from FILE, if it is there; write the run's state to it at the end, also after Ctrl-C.",
)
@output_option("Write the recording here (.npz, .csv, .mcap); without it a summary is printed.")
@body_options
@compile_options
def command(
    spec: str,
    steps: int | None,
    settings: dict[str, float],
    inputs: dict[str, str],
    backend: str | None,
    every: int,
    start: str | None,
    until: str | None,
    states: tuple[str, ...],
    neurons: tuple[str, ...],
    weights: Literal["plastic", "none"],
    checkpoint: Path | None,
    output: Path | None,
) -> None:
    """Run a network and write a recording.

    A recording holds the activity of every neuron and every weight that can change, at every step, or what of it
    --every, --neurons and --weights choose; and the states that the outputs of the spec or --states name. Without -o
    nothing is written, and the last step's values are printed. Ctrl-C ends a run, as do SIGTERM, SIGHUP and SIGQUIT;
    its recording holds the steps until then. If a run is killed, a part beside the file holds them (.x.npz.part), which
    is read where the file is not there.

    With --checkpoint a run is made in parts: each goes on exactly where the last one ended, --steps counts the steps to
    be made now, and the parts together are bit for bit the run in one go, as they are made by one backend.
    """
    read = files_of(inputs)
    check_target(output, [("the spec itself", spec), ("the recording that the run goes on from", start), *read])
    others = [("the spec itself", spec), ("the recording that the run goes on from", start), *read]
    check_target(checkpoint, [*others, ("the recording", None if output is None else str(output))], "--checkpoint")
    _check_format(output)
    network = network_of(spec, settings)
    check_files(output, network)
    check_files(checkpoint, network, "--checkpoint")
    arrays, before = tables(inputs, network.network), recording_of(start)
    ends = None if until is None else network.until(until)
    chosen: Chosen = {
        "backend": backend,
        "every": every,
        "start": before,
        "until": ends,
        "states": states,
        "neurons": neurons,
        "weights": weights,
        "checkpoint": checkpoint,
    }
    begun = perf_counter()
    if output is not None:
        with writing(output), progress("running") as bar:
            by = network.run_to(output, steps, arrays, progress=bar, **chosen)
        _tell(ends)
        click.echo(f"{output}: {_summary(network, steps, perf_counter() - begun, by, ends)}")
        return
    with progress("running") as bar:
        recording = network.run(steps, arrays, progress=bar, last=ends is not None, **chosen)
    _tell(ends)
    _print(network, recording, _summary(network, steps, perf_counter() - begun, recording.backend, ends), states)


def _tell(until: Until | None) -> None:
    """How a run ended that was to end early."""
    if until is not None and until.ending is not None:
        click.echo(f"until {until.measure.text}: {until.ending}", err=True)


def _summary(network: CompiledNetwork, steps: int | None, seconds: float, backend: str, until: Until | None) -> str:
    steps = network.network.steps if steps is None else steps
    if until is not None and until.ending is not None:
        steps = until.ending.made
    return f"{count(steps, 'step')} in {seconds:.2f} s, backend {backend}"


def _check_format(output: Path | None) -> None:
    """Refuse a suffix that no format has before anything is run."""
    if output is not None:
        from neurovis_spec.runtime.recording import for_path

        for_path(output)


def _print(network: CompiledNetwork, recording: Recording, summary: str, asked: tuple[str, ...]) -> None:
    """The outputs at the last step recorded, or the activities where the spec names none."""
    from neurovis_spec.cli.tables import number, table

    click.echo(f"{network.name}: {summary}")
    names = [output.name for output in network.network.outputs if output.name in recording]
    what = "outputs" if names else "activities"
    rows = []
    for name in [*(names or recording.columns[:_MOST_SHOWN]), *asked]:
        values = recording[name][-1:].ravel().tolist()
        rows.append((name, " ".join(number(value) for value in values[:_MOST_SHOWN])))
    click.echo(f"{what} at step {recording.step[-1]}:")
    click.echo(table(rows))
    if recording.weights.shape[1]:
        least, most = recording.weights[-1].min(), recording.weights[-1].max()
        click.echo(f"{count(recording.weights.shape[1], 'changing weight')}: {number(least)} to {number(most)}")
