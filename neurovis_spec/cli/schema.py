"""``neurovis schema``: the JSON Schema of the language."""

from __future__ import annotations

import click

from neurovis_spec.cli.options import examples


@click.command(
    epilog=examples(
        "neurovis schema > neurovis.schema.json",
        "neurovis schema --included > included.schema.json",
    )
)
@click.option("--included", is_flag=True, help="That of files that specs include: modules and definitions alone.")
def command(included: bool) -> None:
    """Print the JSON Schema of the language, for editors.

    An editor that knows JSON Schema completes and checks specs with it.
    """
    import json

    from neurovis_spec import api

    click.echo(json.dumps(api.schema(included=included), indent=2))
