"""``neurovis layout``: where every neuron is and how every connection runs."""

from __future__ import annotations

import json
from pathlib import Path
from time import perf_counter

import click

from neurovis_spec.cli.files import check_target, count, network_of, writing
from neurovis_spec.cli.options import engine_option, examples, output_option, set_option, spec_argument
from neurovis_spec.cli.progress import progress


@click.command(
    epilog=examples(
        "neurovis layout first.yaml",
        "neurovis layout first.yaml --engine circular -o first.layout.yaml",
        "neurovis layout first.yaml --metrics",
    )
)
@spec_argument
@output_option("Write the layout file here; without it, to standard output.")
@engine_option
@click.option("--metrics", is_flag=True, help="Print crossings, overlaps, flow and more as JSON instead.")
@set_option
def command(spec: str, output: Path | None, engine: str | None, metrics: bool, settings: dict[str, float]) -> None:
    """Compute and write the layout.

    The layout file holds a position for every neuron and a spline for every connection; x grows right, y grows down,
    one unit is the distance between neighbours.
    """
    check_target(output)
    network = network_of(spec, settings)
    begun = perf_counter()
    with progress("laying out"):
        layout = network.layout(engine)
    seconds = perf_counter() - begun
    if output is not None:
        with writing(output):
            layout.save(output)
    if metrics:
        with progress("measuring"):
            measured = layout.metrics()
        click.echo(json.dumps({**measured, "seconds": round(seconds, 6)}, indent=2))
    elif output is None:
        click.echo(layout.dump(), nl=False)
    else:
        what = f"{count(len(layout.positions), 'neuron')}, {count(len(layout.routes), 'connection')}"
        click.echo(f"{output}: {what}, engine {layout.engine}")
