"""``neurovis fmt``: canonical formatting that keeps comments."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Final

import click

from neurovis_spec.cli.failure import fault
from neurovis_spec.cli.files import STDIN, show, standard_input, writing
from neurovis_spec.cli.options import examples, specs_argument
from neurovis_spec.cli.progress import progress
from neurovis_spec.diagnostics import Diagnostic, Findings, SpecError, printable
from neurovis_spec.differences import difference

_BOM: Final = "\ufeff"


@click.command(
    epilog=examples(
        "neurovis fmt first.yaml",
        "neurovis fmt specs/*.yaml --check",
        "neurovis fmt first.yaml --diff",
        "cat first.yaml | neurovis fmt -",
    )
)
@specs_argument
@click.option("--check", is_flag=True, help="Write nothing; name the files that would change, and end with status 1.")
@click.option("--diff", is_flag=True, help="Write nothing; show what would change.")
def command(specs: tuple[str, ...], check: bool, diff: bool) -> None:
    """Format specs canonically, keeping comments.

    Files are rewritten where they stand, and those that have changed are named; standard input (-) goes to standard
    output. Comments, blank lines between groups, the order and the meaning stay. A file with syntax errors is left
    alone; its findings go to standard error, and the status is 1.
    """
    if specs.count("-") > 1:
        raise click.UsageError("standard input (-) can be read only once")
    found: list[Diagnostic] = []
    sources: dict[str, str] = {}
    changed = 0
    for spec in specs:
        try:
            with progress("formatting"):
                before = _read(spec)
                after = _formatted(spec, before)
        except SpecError as error:
            found += error.diagnostics
            sources |= error.sources
            continue
        changed += after != before
        _show(spec, before, after, check=check, diff=diff)
        if not (check or diff):
            _write(spec, before, after)
    show(found, sources)
    if found or (check and changed):
        raise click.exceptions.Exit(1)


def _read(spec: str) -> str:
    """The text of a spec with its byte-order mark. Raises SpecError where the reader refuses it."""
    from neurovis_spec.language.yaml.reader import read_file, read_text

    findings = Findings()
    if spec == "-":
        text = standard_input()
        read_text(text, STDIN, findings)
        findings.check()
        return text
    path = Path(spec)
    read_file(path, spec, findings)
    findings.check()
    with path.open("rb") as file:
        mark = file.read(len(_BOM.encode()))
    return (_BOM if mark == _BOM.encode() else "") + findings.sources[spec]


def _formatted(spec: str, text: str) -> str:
    from neurovis_spec.language.format.canonical import FormattingError, format_read

    try:
        return format_read(text)
    except FormattingError as error:
        raise fault(f"{_name(spec)}: {error}", "it is left alone; please report it with this spec") from error


def _show(spec: str, before: str, after: str, *, check: bool, diff: bool) -> None:
    if after == before:
        return
    if check:
        click.echo(f"{_name(spec)}: would change")
    if diff:
        click.echo(difference(before, after, _name(spec)), nl=False)


def _write(spec: str, before: str, after: str) -> None:
    if spec == "-":
        sys.stdout.buffer.write(after.encode())
    elif after != before:
        _replace(Path(spec), after)
        click.echo(f"{_name(spec)}: formatted")


def _replace(path: Path, text: str) -> None:
    """Write a file as a whole or not at all; its permissions stay."""
    from neurovis_spec.runtime.files import replacing

    with writing(path), replacing(path) as file:
        file.write(text.encode())


def _name(spec: str) -> str:
    return STDIN if spec == "-" else printable(spec)
