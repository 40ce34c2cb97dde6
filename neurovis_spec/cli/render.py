"""``neurovis render``: a picture of one step."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from neurovis_spec.cli.drawing import Drawing, drawing_options, show_warnings
from neurovis_spec.cli.files import count, writing
from neurovis_spec.cli.options import effort_option, examples, finite, output_option
from neurovis_spec.cli.progress import on_terminal, progress

if TYPE_CHECKING:
    from neurovis_spec.compiled import CompiledNetwork
    from neurovis_spec.keywords import StillKeywords


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
@output_option("The picture; the suffix says what kind: .svg, .pdf, .png, .webp or .gif.", required=True)
@click.option("--step", type=click.IntRange(min=0), metavar="N", help="The step to show; default: the last.")
@click.option(
    "--window",
    type=click.IntRange(min=1),
    metavar="N",
    help="Views over time show N steps around the one that is drawn; default: the spec's, else all.",
)
@effort_option
@click.option(
    "--dpi",
    type=click.FloatRange(1, 9600),
    callback=finite,
    metavar="N",
    help="Pixels of an inch, such as 300 for print; a picture has 96 to 384 by itself.",
)
@drawing_options
def command(
    output: Path, step: int | None, window: int | None, effort: str | None, dpi: float | None, drawing: Drawing
) -> None:
    """Draw one step as a picture.

    Colours show activities and signals, thickness shows weights, glow shows how weights change (the legend gives the
    scales).
    """
    network, given = drawing.made_for(output)
    steps = network.steps_to_draw(step, given["recording"], given["inputs"], given["view"])
    if steps and on_terminal():
        why = "" if given["view"] or network.network.render.figure else _why(network, step, steps)
        click.echo(f"running {count(steps, 'step')}{why}", err=True)
    options: StillKeywords = {**given, "step": step, "effort": effort, "window": window, "dpi": dpi}
    with progress("drawing") as bar, writing(output):
        network.render(output, **(options | {"progress": bar}))
    show_warnings(network, given, effort)
    click.echo(str(output))
