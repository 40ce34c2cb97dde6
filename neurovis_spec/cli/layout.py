"""``neurovis layout``: where every neuron is and how every connection runs."""

from __future__ import annotations

import json
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

import click

from neurovis_spec.cli.files import check_files, check_target, count, earlier_layout, network_of, show, writing
from neurovis_spec.cli.options import effort_option, engine_option, examples, output_option, set_option, spec_argument
from neurovis_spec.cli.progress import progress

if TYPE_CHECKING:
    from neurovis_spec.compiled import NetworkLayout
    from neurovis_spec.layout import Layout


@click.command(
    epilog=examples(
        "neurovis layout first.yaml",
        "neurovis layout first.yaml --engine circular -o first.layout.yaml",
        "neurovis layout first.yaml --update first.layout.yaml",
        "neurovis layout first.yaml --metrics",
    )
)
@spec_argument
@output_option("Write the layout file here; without it, or for -, to standard output.")
@engine_option
@effort_option
@click.option(
    "--update",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="Keep what this layout file says, lay out what is new, and write it back; made if it is not there.",
)
@click.option(
    "--metrics",
    is_flag=True,
    help="Print crossings, overlaps, flow and more as JSON instead; 'sampled' routes, where crossings are estimated.",
)
@set_option
def command(
    spec: str,
    output: Path | None,
    engine: str | None,
    effort: str | None,
    update: Path | None,
    metrics: bool,
    settings: dict[str, float | str],
) -> None:
    """Compute and write the layout.

    The layout file holds a position for every neuron and a spline for every connection; x grows right, y grows down,
    one unit is the distance between neighbours.

    With --update the file is a memory that can be committed and reviewed line by line: neurons that it knows stay
    exactly where they are, new ones find a place beside them. A spec that names it (layout: {file: FILE}) is drawn so.
    """
    if update is not None and output is not None:
        raise click.UsageError("--update writes FILE itself: leave out -o, or --update")
    if output == Path("-"):
        output = None
    check_target(output, [("the spec itself", spec)])
    check_target(update, [("the spec itself", spec)], "--update")
    network = network_of(spec, settings)
    check_files(output, network, layout=True)
    check_files(update, network, "--update", layout=True)
    earlier = None if update is None else earlier_layout(update)
    begun = perf_counter()
    with progress("laying out") as bar:
        layout = network.layout(engine, effort=effort, earlier=earlier, progress=bar)
    seconds = perf_counter() - begun
    show(layout.warnings, network.sources)
    if output is not None:
        with writing(output):
            layout.save(output)
    if update is not None:
        changed = _update(update, layout, earlier)
        if not metrics:
            click.echo(f"{update}: {changed}")
    if metrics:
        with progress("measuring"):
            measured = layout.metrics()
        click.echo(json.dumps({**measured, "seconds": round(seconds, 6)}, indent=2))
    elif update is not None:
        return
    elif output is None:
        click.echo(layout.dump(), nl=False)
    else:
        what = f"{count(len(layout.positions), 'neuron')}, {count(len(layout.routes), 'connection')}"
        click.echo(f"{output}: {what}, engine {layout.engine}")


def _update(path: Path, layout: NetworkLayout, earlier: Layout | None) -> str:
    """Write the file, if there is anything new in it; what has changed, in words."""
    text = layout.dump().encode()
    before = {} if earlier is None else dict(earlier.positions)
    new = sum(name not in before for name in layout.positions)
    stay = sum(before.get(name) == point for name, point in layout.positions.items())
    moved = len(layout.positions) - new - stay
    gone = sum(name not in layout.positions for name in before)
    if not path.exists() or path.read_bytes() != text:
        with writing(path):
            layout.save(path)
    words = [f"{count(stay, 'neuron')} where they were", f"{new} new"]
    words += [f"{moved} moved"] if moved else []
    words += [f"{gone} gone"] if gone else []
    return ", ".join(words)
