"""``neurovis explain``: what the code of a finding means, with examples."""

from __future__ import annotations

from collections.abc import Iterable

import click

from neurovis_spec.cli.completion import one_of
from neurovis_spec.cli.failure import fault
from neurovis_spec.cli.options import examples


def _codes() -> Iterable[str]:
    from neurovis_spec.codes import catalogue

    return ("list", *catalogue())


@click.command(epilog=examples("neurovis explain delay-0-cycle", "neurovis explain list"))
@click.argument("code", metavar="CODE", shell_complete=one_of(_codes))
def command(code: str) -> None:
    """Explain the code of a finding, with examples.

    CODE is what stands in brackets behind the word error or warning; with 'list' all codes are printed.
    """
    from neurovis_spec.codes import catalogue
    from neurovis_spec.likeness import suggest

    codes = catalogue()
    if code == "list":
        click.echo("\n".join(f"{entry.severity}[{name}]: {entry.meaning}" for name, entry in codes.items()))
        return
    name = code.strip().removeprefix("error").removeprefix("warning").strip("[]").casefold()
    if name not in codes:
        hint = suggest(name, codes, "codes") if len(name) <= 100 else None
        raise fault(f"there is no code '{code[:100]}'", f"{hint}" if hint else "neurovis explain list")
    click.echo(codes[name].text())
