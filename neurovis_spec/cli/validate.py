"""``neurovis validate``: every finding of one or several specs."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

import click

from neurovis_spec.cli.files import STDIN, compiled, count
from neurovis_spec.cli.options import body_options, compile_options, examples, specs_argument
from neurovis_spec.diagnostics import Diagnostic, SpecError, printable, show_text

FORMATS = ("text", "json", "sarif", "github")


@click.command(
    epilog=examples(
        "neurovis validate first.yaml",
        "neurovis validate specs/*.yaml --strict",
        "cat first.yaml | neurovis validate - --format json",
        "neurovis validate first.yaml --format sarif > findings.sarif",
    )
)
@specs_argument
@click.option(
    "--format", "form", type=click.Choice(FORMATS), default="text", help="How findings are shown: text is the default."
)
@click.option("--strict", is_flag=True, help="Take warnings for errors.")
@body_options
@compile_options
def command(specs: tuple[str, ...], form: str, strict: bool) -> None:
    """Show all errors and warnings of specs at once.

    What the layout engine of a spec would refuse is an error here, too.

    Findings go to standard error, and a line for each spec without errors to standard output. The other formats go to
    standard output: json is an array, sarif is SARIF 2.1.0 for code scanning, github are workflow commands for GitHub
    Actions. The status is 1 if there is an error.
    """
    if specs.count("-") > 1:
        raise click.UsageError("standard input (-) can be read only once")
    found: list[Diagnostic] = []
    sources: dict[str, str] = {}
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
    if strict:
        found = [replace(finding, severity="error") for finding in found]
    _show(found, sources, form)
    if any(finding.severity == "error" for finding in found):
        raise click.exceptions.Exit(1)


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
