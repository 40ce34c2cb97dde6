"""``neurovis inspect``: what a spec has become."""

from __future__ import annotations

import click

from neurovis_spec.cli.files import network_of
from neurovis_spec.cli.options import body_options, examples, set_option, spec_argument
from neurovis_spec.diagnostics import printable


@click.command(
    epilog=examples(
        "neurovis inspect first.yaml",
        "neurovis inspect first.yaml --set gain=2",
        "neurovis inspect first.yaml --pathways",
        "neurovis inspect first.yaml --format json | jq .hash",
    )
)
@spec_argument
@click.option(
    "--format", "form", type=click.Choice(["text", "json"]), default="text", help="text (default) or a JSON object."
)
@click.option("--pathways", is_flag=True, help="What runs from group to group alone, a sentence each.")
@set_option
@body_options
def command(spec: str, form: str, pathways: bool, settings: dict[str, float | str]) -> None:
    """Show groups, connections, delays, rules and choices.

    The connection matrix C has a row for each source and a column for each target.
    """
    network = network_of(spec, settings)
    if form == "json":
        import json

        click.echo(json.dumps(network.pathways() if pathways else network.describe(), indent=2))
        return
    if pathways:
        for sentence in network.pathways():
            click.echo(printable(sentence))
        return
    from neurovis_spec.cli.overview import overview

    click.echo(overview(network))
