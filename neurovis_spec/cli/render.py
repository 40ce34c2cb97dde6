"""``neurovis render``: a picture of one step."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from neurovis_spec.cli.files import count, network_of, recording_of, show_warnings, tables, writing
from neurovis_spec.cli.options import (
    body_options,
    effort_option,
    engine_option,
    examples,
    excerpt_options,
    finite,
    input_option,
    need_run,
    output_option,
    recording_option,
    run_option,
    set_option,
    spec_argument,
    theme_option,
    view_option,
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
        "neurovis render first.yaml -o first.svg --view network --view traces --window 300",
        "neurovis render worm.yaml -o worm.svg --focus AVAL --min-weight 0.2",
    )
)
@spec_argument
@output_option("The picture; the suffix says what kind: .svg, .pdf, .png, .webp or .gif.", required=True)
@click.option("--step", type=click.IntRange(min=0), metavar="N", help="The step to show; default: the last.")
@recording_option
@run_option
@input_option
@theme_option
@view_option
@click.option(
    "--window",
    type=click.IntRange(min=1),
    metavar="N",
    help="Views over time show N steps around the one that is drawn; default: the spec's, else all.",
)
@excerpt_options
@engine_option
@effort_option
@click.option(
    "--dpi",
    type=click.FloatRange(1, 9600),
    callback=finite,
    metavar="N",
    help="Pixels of an inch, such as 300 for print; a picture has 96 to 384 by itself.",
)
@set_option
@body_options
def command(
    spec: str,
    output: Path,
    step: int | None,
    recording: str | None,
    run: int | None,
    inputs: dict[str, str],
    theme: str | None,
    views: tuple[str, ...],
    window: int | None,
    engine: str | None,
    effort: str | None,
    dpi: float | None,
    settings: dict[str, float],
    collapse: tuple[str, ...],
    focus: str | None,
    path: str | None,
    min_weight: float | None,
    full: bool,
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
    record, arrays, view = recording_of(recording, run), tables(inputs, network.network) or None, views or None
    steps = network.steps_to_draw(step, record, arrays, view)
    if steps and on_terminal():
        why = "" if view or network.network.render.figure else _why(network, step, steps)
        click.echo(f"running {count(steps, 'step')}{why}", err=True)
    with progress("drawing") as bar, writing(output):
        network.render(
            output,
            step=step,
            recording=record,
            inputs=arrays,
            theme=theme,
            engine=engine,
            effort=effort,
            view=view,
            window=window,
            dpi=dpi,
            progress=bar,
            collapse=collapse,
            focus=focus,
            paths=path,
            min_weight=min_weight,
            full=full,
        )
    if network.needs_layout(view):
        show_warnings(network.drawn(engine, effort))
    click.echo(str(output))
