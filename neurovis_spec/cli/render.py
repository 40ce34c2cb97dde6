"""``neurovis render``: a picture of one step."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from neurovis_spec.cli.files import count, network_of, recording_of, show_warnings, tables, writing
from neurovis_spec.cli.options import (
    engine_option,
    examples,
    input_option,
    need_run,
    output_option,
    recording_option,
    set_option,
    spec_argument,
    theme_option,
)
from neurovis_spec.cli.progress import on_terminal, progress
from neurovis_spec.cli.targets import check_files, check_target, files_of

if TYPE_CHECKING:
    from neurovis_spec.compiled import CompiledNetwork


def _why(network: CompiledNetwork, step: int | None, steps: int) -> str:
    """What a run is for, where it is not for the step that is drawn."""
    wanted = network.network.steps if step is None else step + 1
    return "" if steps <= wanted else ", which show the range of its values (render: {gain: …} in the spec states it)"


@click.command(
    epilog=examples(
        "neurovis render first.yaml -o first.svg",
        "neurovis render first.yaml -o first.png --step 120 --theme dark",
        "neurovis render first.yaml -o first.svg --recording first.npz",
    )
)
@spec_argument
@output_option("The picture; the suffix says what kind, such as .svg or .png.", required=True)
@click.option("--step", type=click.IntRange(min=0), metavar="N", help="The step to show; default: the last.")
@recording_option
@input_option
@theme_option
@engine_option
@set_option
def command(
    spec: str,
    output: Path,
    step: int | None,
    recording: str | None,
    inputs: dict[str, str],
    theme: str | None,
    engine: str | None,
    settings: dict[str, float],
) -> None:
    """Draw one step as a picture.

    Colours show activities and signals, thickness shows weights, glow shows how weights change (the legend gives the
    scales).
    """
    need_run(inputs, recording)
    read = [("the recording that is drawn", recording), *files_of(inputs)]
    check_target(output, [("the spec itself", spec), *read])
    network = network_of(spec, settings)
    check_files(output, network)
    record, arrays = recording_of(recording), tables(inputs, network.network) or None
    steps = network.steps_to_draw(step, record, arrays)
    if steps and on_terminal():
        click.echo(f"running {count(steps, 'step')}{_why(network, step, steps)}", err=True)
    with progress("drawing") as bar, writing(output):
        network.render(output, step=step, recording=record, inputs=arrays, theme=theme, engine=engine, progress=bar)
    show_warnings(network.drawn(engine))
    click.echo(str(output))
