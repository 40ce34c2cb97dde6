"""From our values to those of the protocol.

In: spans, findings, completions, symbols of a text. Out: what ``lsprotocol`` writes as JSON. The only other module
that knows the protocol is ``server``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Final

from lsprotocol import types

from neurovis_spec.diagnostics import Diagnostic, Findings, Span
from neurovis_spec.language.data.files import NamedFile, locate
from neurovis_spec.lsp.completion import Completion
from neurovis_spec.lsp.document import Document
from neurovis_spec.lsp.hover import Hover
from neurovis_spec.lsp.rename import Edit
from neurovis_spec.lsp.symbols import Symbol
from neurovis_spec.lsp.text import Place, Text

_COMPLETIONS: Final[Mapping[str, types.CompletionItemKind]] = {
    "key": types.CompletionItemKind.Property,
    "neuron": types.CompletionItemKind.Class,
    "parameter": types.CompletionItemKind.Variable,
    "input": types.CompletionItemKind.Event,
    "function": types.CompletionItemKind.Function,
    "constant": types.CompletionItemKind.Constant,
    "definition": types.CompletionItemKind.Function,
    "word": types.CompletionItemKind.EnumMember,
    "module": types.CompletionItemKind.Module,
    "local": types.CompletionItemKind.Variable,
}
_SYMBOLS: Final[Mapping[str, types.SymbolKind]] = {
    "section": types.SymbolKind.Namespace,
    "neurons": types.SymbolKind.Class,
    "connection": types.SymbolKind.Interface,
    "constant": types.SymbolKind.Constant,
    "input": types.SymbolKind.Event,
    "output": types.SymbolKind.Field,
    "definition": types.SymbolKind.Function,
    "module": types.SymbolKind.Module,
    "instance": types.SymbolKind.Object,
}


def place_of(document: Document, position: types.Position) -> Place:
    """The place of a position."""
    return document.text.place(position.line, position.character)


def range_of(text: Text, span: Span) -> types.Range:
    """The range of a span of a text."""
    start, end = text.position(span.line, span.column), text.position(span.end_line, span.end_column)
    return types.Range(types.Position(*start), types.Position(*end))


def diagnostics(text: Text, findings: Iterable[Diagnostic]) -> list[types.Diagnostic]:
    """Findings of one text with their suggestions."""
    result = []
    for finding in findings:
        severity = types.DiagnosticSeverity.Error if finding.severity == "error" else types.DiagnosticSeverity.Warning
        told = finding.message if finding.hint is None else f"{finding.message}\nhelp: {finding.hint}"
        result.append(types.Diagnostic(range_of(text, finding.span), told, severity, finding.code, source="neurovis"))
    return result


def included_faults(document: Document, findings: Mapping[Path, Sequence[Diagnostic]]) -> list[types.Diagnostic]:
    """Where a document includes files that are invalid, directly or through others: one finding for each."""
    result = []
    for path, found in findings.items():
        errors = [finding for finding in found if finding.severity == "error"]
        if errors:
            many = f"{len(errors)} errors, the first" if len(errors) > 1 else "an error"
            told = f"'{path.name}' has {many} in line {errors[0].span.line}: {errors[0].message}"
            place = range_of(document.text, _inclusion(document, path))
            result.append(
                types.Diagnostic(place, told, types.DiagnosticSeverity.Error, errors[0].code, source="neurovis")
            )
    return result


def _inclusion(document: Document, path: Path) -> Span:
    """Where a document includes a file; the first of its includes if that is done by another file."""
    own = document.page.includes
    for item in own:
        if locate(NamedFile(item.text, document.root, document.path.parent, item.span), Findings()) == path:
            return item.span
    return own[0].span if own else Span(document.file, 1, 1, 1, 1)


def completion_list(document: Document, found: Iterable[Completion]) -> types.CompletionList:
    """Completions, in the order given."""
    items = []
    for number, completion in enumerate(found):
        documentation = types.MarkupContent(types.MarkupKind.Markdown, completion.documentation)
        items.append(
            types.CompletionItem(
                label=completion.label,
                kind=_COMPLETIONS[completion.sort],
                detail=completion.detail or None,
                documentation=documentation if completion.documentation else None,
                sort_text=f"{number:04d}",
                text_edit=types.TextEdit(range_of(document.text, completion.span), completion.insert),
            )
        )
    return types.CompletionList(is_incomplete=False, items=items)


def hover_of(document: Document, hover: Hover) -> types.Hover:
    """Markdown with its range."""
    content = types.MarkupContent(types.MarkupKind.Markdown, hover.markdown)
    return types.Hover(content, range_of(document.text, hover.span))


def symbol_of(document: Document, symbol: Symbol) -> types.DocumentSymbol:
    """A symbol with those below it."""
    return types.DocumentSymbol(
        name=symbol.name,
        kind=_SYMBOLS[symbol.sort],
        range=range_of(document.text, symbol.whole),
        selection_range=range_of(document.text, symbol.span),
        detail=symbol.detail or None,
        children=[symbol_of(document, child) for child in symbol.children],
    )


def workspace_edit(edits: Iterable[tuple[str, Text, Sequence[Edit]]]) -> types.WorkspaceEdit:
    """Edits of several texts, each with its URI."""
    return types.WorkspaceEdit(changes={uri: text_edits(text, own) for uri, text, own in edits})


_QUOTED: Final = re.compile(r"'([^']*)'")


def fixes(uri: str, text: Text, found: Iterable[types.Diagnostic]) -> list[types.CodeAction]:
    """For each finding that offers names an action for each of them, which puts it in the place of what is written; one
    that is offered alone is preferred."""
    result = []
    for finding in found:
        said, _, offered = finding.message.partition("\nhelp: did you mean ")
        place = _misspelt(text, finding.range, _QUOTED.findall(said))
        if place is None:
            continue
        names = _QUOTED.findall(offered.partition("?")[0])
        for name in names:
            result.append(
                types.CodeAction(
                    f"Write '{name}'",
                    types.CodeActionKind.QuickFix,
                    [finding],
                    is_preferred=len(names) == 1,
                    edit=types.WorkspaceEdit(changes={uri: text_edits(text, [Edit(place, name)])}),
                )
            )
    return result


def _misspelt(text: Text, where: types.Range, quoted: Sequence[str]) -> Span | None:
    """Where the name stands that a message says is unknown: of those that it quotes the last one that is written
    there."""
    start, end = text.place(where.start.line, where.start.character), text.place(where.end.line, where.end.character)
    whole = Span("", start.line, start.column, end.line, end.column)
    if start.line != end.line:
        return None
    written = text.part(whole)
    found = [(written.rfind(name), name) for name in quoted if name and name in written]
    return whole.within(found[-1][0], found[-1][0] + len(found[-1][1])) if found else None


def text_edits(text: Text, edits: Iterable[Edit]) -> list[types.TextEdit]:
    """Edits of a text with their ranges."""
    return [types.TextEdit(range_of(text, edit.span), edit.text) for edit in edits]
