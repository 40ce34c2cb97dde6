"""``neurovis lsp``: the language server for editors."""

from __future__ import annotations

import sys
from importlib.util import find_spec

import click

from neurovis_spec.cli.failure import fault
from neurovis_spec.cli.options import examples


@click.command(epilog=examples("neurovis lsp"))
@click.option("--stdio", is_flag=True, help="Accepted and not needed: many editors add it.")
def command(stdio: bool) -> None:
    """Answer an editor: findings while typing, completion, hover, rename.

    It also goes to definitions, lists symbols and formats, over standard input and output. An editor starts it;
    docs/editors.md says how to set it up.
    """
    if find_spec("pygls") is None:
        raise fault("the language server needs pygls; in a clone of the repository: pip install '.[lsp]'")
    from neurovis_spec.lsp.server import serve

    if sys.stdin is None:
        raise click.UsageError("standard input is closed: an editor sends its questions there")
    serve()
