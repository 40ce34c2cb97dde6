"""``neurovis schema``: the JSON Schema of the language."""

from __future__ import annotations

import click

from neurovis_spec.cli.options import examples


@click.command(epilog=examples("neurovis schema > neurovis.schema.json"))
def command() -> None:
    """Print the JSON Schema of the language, for editors.

    An editor that knows JSON Schema completes and checks specs with it.
    """
    import json

    from neurovis_spec import api

    click.echo(json.dumps(api.schema(), indent=2))
