"""``neurovis inspect``: what a spec has become."""

from __future__ import annotations

import click

from neurovis_spec.cli.files import network_of
from neurovis_spec.cli.options import body_options, examples, set_option, spec_argument


@click.command(
    epilog=examples(
        "neurovis inspect first.yaml",
        "neurovis inspect first.yaml --set gain=2",
        "neurovis inspect first.yaml --format json | jq .hash",
    )
)
@spec_argument
@click.option(
    "--format", "form", type=click.Choice(["text", "json"]), default="text", help="text (default) or a JSON object."
)
@set_option
@body_options
def command(spec: str, form: str, settings: dict[str, float | str]) -> None:
    """Show groups, connections, delays, rules and choices.

    The connection matrix C has a row for each source and a column for each target.
    """
    network = network_of(spec, settings)
    if form == "json":
        import json

        click.echo(json.dumps(network.describe(), indent=2))
        return
    from neurovis_spec.cli.overview import overview

    click.echo(overview(network))
