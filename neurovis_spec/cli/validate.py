"""``neurovis validate``: every finding of one or several specs, and the units that follow from their formulas."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import TYPE_CHECKING

import click

from neurovis_spec.cli.files import STDIN, compiled, count
from neurovis_spec.cli.options import body_options, compile_options, examples, specs_argument
from neurovis_spec.diagnostics import Diagnostic, SpecError, printable, show_text

if TYPE_CHECKING:
    from neurovis_spec.cli.unit_tables import UnitRow
    from neurovis_spec.compiled import CompiledNetwork

FORMATS = ("text", "json", "sarif", "github")


@click.command(
    epilog=examples(
        "neurovis validate first.yaml",
        "neurovis validate specs/*.yaml --strict",
        "cat first.yaml | neurovis validate - --format json",
        "neurovis validate first.yaml --format sarif > findings.sarif",
        "neurovis validate cells.yaml --units",
    )
)
@specs_argument
@click.option(
    "--format", "form", type=click.Choice(FORMATS), default="text", help="How findings are shown: text is the default."
)
@click.option("--strict", is_flag=True, help="Take warnings for errors.")
@click.option("--units", is_flag=True, help="Print the units of all that definitions name, declared and derived.")
@body_options
@compile_options
def command(specs: tuple[str, ...], form: str, strict: bool, units: bool) -> None:
    """Show all errors and warnings of specs at once.

    What the layout engine of a spec would refuse is an error here, too.

    Findings go to standard error, and a line for each spec without errors to standard output. The other formats go to
    standard output: json is an array, sarif is SARIF 2.1.0 for code scanning, github are workflow commands for GitHub
    Actions. The status is 1 if there is an error.

    With --units the definitions of each spec follow, with the unit of each parameter, port, intermediate value, state
    and output: as it is declared, or derived from formulas; any where these leave it open. As json that is an object
    with the findings and the units.
    """
    if specs.count("-") > 1:
        raise click.UsageError("standard input (-) can be read only once")
    if units and form not in ("text", "json"):
        raise click.UsageError(f"--units is shown as text or json, not as {form}")
    found: list[Diagnostic] = []
    sources: dict[str, str] = {}
    named: list[UnitRow] = []
    for spec in specs:
        try:
            network = compiled(spec)
        except SpecError as error:
            found += error.diagnostics
            sources |= error.sources
            continue
        refusal = network.refusal()
        found += network.warnings if refusal is None else (*network.warnings, refusal)
        sources |= network.sources
        if form == "text" and refusal is None and not (strict and network.warnings):
            arrays = network.network
            size = f"{count(len(arrays.neurons), 'neuron')}, {count(len(arrays.connections), 'connection')}"
            click.echo(f"{STDIN if spec == '-' else printable(spec)}: ok ({size})")
        if units:
            named += _told_units(network, STDIN if spec == "-" else spec, form)
    if strict:
        found = [replace(finding, severity="error") for finding in found]
    if units and form == "json":
        from neurovis_spec.cli.unit_tables import units_as_json

        click.echo(units_as_json(found, named))
    else:
        _show(found, sources, form)
    if any(finding.severity == "error" for finding in found):
        raise click.exceptions.Exit(1)


def _told_units(network: CompiledNetwork, file: str, form: str) -> list[UnitRow]:
    """The units of a spec, which are printed where that is text."""
    from neurovis_spec.cli.unit_tables import shown_units, unit_rows

    rows = [*unit_rows(network, file)]
    if form == "text" and rows:
        click.echo(shown_units(rows))
    return rows


def _show(found: Iterable[Diagnostic], sources: dict[str, str], form: str) -> None:
    if form == "text":
        if text := show_text(found, sources):
            click.echo(text, err=True)
        return
    if written := _writer(form)(found):
        click.echo(written)


def _writer(form: str) -> Callable[[Iterable[Diagnostic]], str]:
    from neurovis_spec.findings_formats import to_github, to_json, to_sarif

    return {"json": to_json, "github": to_github, "sarif": to_sarif}[form]
