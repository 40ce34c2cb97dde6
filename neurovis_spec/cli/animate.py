"""``neurovis animate``: a moving picture of a run."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from neurovis_spec.cli.drawing import Drawing, drawing_options, show_warnings
from neurovis_spec.cli.files import writing
from neurovis_spec.cli.options import FirstStep, examples, finite, output_option
from neurovis_spec.cli.progress import progress

if TYPE_CHECKING:
    from neurovis_spec.keywords import FilmKeywords


@click.command(
    epilog=examples(
        "neurovis animate first.yaml -o first.svg --steps 200",
        "neurovis animate first.yaml -o first.svg --from 1000 --steps 128 --fps 25",
        "neurovis animate first.yaml -o first.svg --recording first.npz",
        "neurovis animate first.yaml -o first.mp4 --steps 100000 --every 20",
        "neurovis animate first.yaml -o first.svg --view network --view 'traces: O' --steps 200",
    )
)
@output_option("The moving picture; the suffix says what kind: .svg, .mp4, .webm, .gif or .webp.", required=True)
@click.option("--steps", type=click.IntRange(min=1), metavar="N", help="Steps to show; default: to the end of the run.")
@click.option("--from", "start", type=FirstStep(min=0), default=0, metavar="N", help="The first step to show.")
@click.option(
    "--every",
    type=click.IntRange(min=1),
    metavar="K",
    help="A frame for one step in K; default: each, of more than 3,000 one in so many that no more frames come out.",
)
@click.option("--frames", type=click.IntRange(min=1), metavar="N", help="At most so many frames, one step in so many.")
@click.option(
    "--fps",
    type=click.FloatRange(min=0, min_open=True),
    metavar="F",
    callback=finite,
    help="Frames a second; default 1/dt, at most 60, and 25 where the spec writes no dt.",
)
@drawing_options
def command(
    output: Path,
    steps: int | None,
    start: int,
    every: int | None,
    frames: int | None,
    fps: float | None,
    drawing: Drawing,
) -> None:
    """Draw a run as a moving picture, a frame a step.

    A video (.mp4, .webm) needs ffmpeg, that of the system or of the extra 'video'. It can be played while it is made,
    from a part beside the file (.x.mp4.part), which stays if the command is killed.
    """
    if every is not None and frames is not None:
        raise click.UsageError("--every and --frames say the same in two ways: give one of them")
    network, given = drawing.made_for(output)
    options: FilmKeywords = {**given, "steps": steps, "start": start, "fps": fps, "every": every, "frames": frames}
    with progress("drawing") as bar, writing(output):
        network.animate(output, **(options | {"progress": bar}))
    show_warnings(network, given)
    click.echo(str(output))
