"""From our values to those of the protocol.

In: a Document's spans, findings, completions, symbols. Out: what ``lsprotocol`` writes as JSON. The only other module
that knows the protocol is ``server``.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final

from lsprotocol import types

from neurovis_spec.diagnostics import Diagnostic, Span
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


def diagnostics(document: Document, findings: Iterable[Diagnostic]) -> list[types.Diagnostic]:
    """Findings with their suggestions. Those of another file stand where it is included, with their place in words."""
    result = []
    for finding in findings:
        message, span = finding.message, finding.span
        if span.file != document.file:
            message = f"{span.file}:{span.line}:{span.column}: {message}"
            span = _inclusion(document, span.file)
        severity = types.DiagnosticSeverity.Error if finding.severity == "error" else types.DiagnosticSeverity.Warning
        told = message if finding.hint is None else f"{message}\nhelp: {finding.hint}"
        result.append(types.Diagnostic(range_of(document.text, span), told, severity, finding.code, source="neurovis"))
    return result


def _inclusion(document: Document, file: str) -> Span:
    """Where a file is included; the beginning of the document if that is done by another."""
    for item in document.items:
        if item.path[:1] == ("include",) and not item.is_key and item.text and file.endswith(item.text):
            return item.span
    return Span(document.file, 1, 1, 1, 1)


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


def workspace_edit(document: Document, uri: str, edits: Iterable[Edit]) -> types.WorkspaceEdit:
    """Edits of one document."""
    return types.WorkspaceEdit(changes={uri: text_edits(document, edits)})


def text_edits(document: Document, edits: Iterable[Edit]) -> list[types.TextEdit]:
    """Edits with their ranges."""
    return [types.TextEdit(range_of(document.text, edit.span), edit.text) for edit in edits]
