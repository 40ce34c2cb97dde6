"""``neurovis animate``: a moving picture of a run."""

from __future__ import annotations

from pathlib import Path

import click

from neurovis_spec.cli.files import network_of, recording_of, show_warnings, tables, writing
from neurovis_spec.cli.options import (
    body_options,
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
from neurovis_spec.cli.progress import progress
from neurovis_spec.cli.targets import check_files, check_target, files_of


@click.command(
    epilog=examples(
        "neurovis animate first.yaml -o first.svg --steps 200",
        "neurovis animate first.yaml -o first.svg --from 1000 --steps 128 --fps 25",
        "neurovis animate first.yaml -o first.svg --recording first.npz",
        "neurovis animate first.yaml -o first.mp4 --steps 100000 --every 20",
        "neurovis animate first.yaml -o first.svg --view network --view 'traces: O' --steps 200",
    )
)
@spec_argument
@output_option("The moving picture; the suffix says what kind: .svg, .mp4, .webm, .gif or .webp.", required=True)
@click.option("--steps", type=click.IntRange(min=1), metavar="N", help="Steps to show; default: to the end of the run.")
@click.option("--from", "start", type=click.IntRange(min=0), default=0, metavar="N", help="The first step to show.")
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
@recording_option
@run_option
@input_option
@theme_option
@view_option
@engine_option
@excerpt_options
@set_option
@body_options
def command(
    spec: str,
    output: Path,
    steps: int | None,
    start: int,
    every: int | None,
    frames: int | None,
    fps: float | None,
    recording: str | None,
    run: int | None,
    inputs: dict[str, str],
    theme: str | None,
    views: tuple[str, ...],
    engine: str | None,
    settings: dict[str, float],
    collapse: tuple[str, ...],
    focus: str | None,
    path: str | None,
    min_weight: float | None,
    full: bool,
) -> None:
    """Draw a run as a moving picture, a frame a step.

    A video (.mp4, .webm) needs ffmpeg, that of the system or of the extra 'video'. It can be played while it is made,
    from a part beside the file (.x.mp4.part), which stays if the command is killed.
    """
    if every is not None and frames is not None:
        raise click.UsageError("--every and --frames say the same in two ways: give one of them")
    need_run(inputs, recording)
    read = [("the recording that is drawn", recording), *files_of(inputs)]
    check_target(output, [("the spec itself", spec), *read])
    network = network_of(spec, settings)
    check_files(output, network)
    record, arrays, view = recording_of(recording, run), tables(inputs, network.network) or None, views or None
    with progress("drawing") as bar, writing(output):
        network.animate(
            output,
            steps=steps,
            start=start,
            fps=fps,
            every=every,
            frames=frames,
            recording=record,
            inputs=arrays,
            theme=theme,
            engine=engine,
            view=view,
            progress=bar,
            collapse=collapse,
            focus=focus,
            paths=path,
            min_weight=min_weight,
            full=full,
        )
    if network.needs_layout(view):
        show_warnings(network.drawn(engine))
    click.echo(str(output))
