"""``neurovis docs``: what a built-in, a key, a function, a pattern or a network to start from is."""

from __future__ import annotations

from collections.abc import Iterable

import click

from neurovis_spec.cli.completion import one_of
from neurovis_spec.cli.options import examples


def _names() -> Iterable[str]:
    from neurovis_spec.manual.topics import topics

    return topics()


@click.command(
    epilog=examples(
        "neurovis docs",
        "neurovis docs izhikevich",
        "neurovis docs connections.delay",
        "neurovis docs tanh",
        "neurovis docs force",
    )
)
@click.argument("name", metavar="[NAME]", required=False, shell_complete=one_of(_names))
def command(name: str | None) -> None:
    """Explain a built-in, a key of the language, a function or a pattern, or show a network to start from.

    NAME is an activation, a model, a rule, a synapse, a pattern, a function or name of expressions, a network to start
    from, or a key, with its section (connections.delay) or without (delay). What several things are called is explained
    for all of them. Without NAME there is a table of contents.
    """
    from neurovis_spec.cli.topics import contents, text_of
    from neurovis_spec.manual.topics import find, near

    if name is None:
        click.echo(contents())
        return
    found = find(name)
    if not found:
        from neurovis_spec.cli.failure import fault
        from neurovis_spec.codes import catalogue
        from neurovis_spec.diagnostics import shorten

        hint = f"it is the code of a finding: neurovis explain {name}" if name in catalogue() else near(name)
        raise fault(f"there is nothing about '{shorten(name)}'", hint, "unknown-name")
    click.echo(text_of(found))
