"""The table of contents of a document: its sections, and what they declare.

In: a Document. Out: Symbols, nested: sections, and in them groups, connections, parameters, modules with their own.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

from neurovis_spec.diagnostics import Span
from neurovis_spec.lsp.document import Document
from neurovis_spec.lsp.outline import Item, Path

Sort = Literal["section", "neurons", "connection", "constant", "input", "output", "definition", "module", "instance"]

_SORTS: Final[dict[str, Sort]] = {
    "parameters": "constant",
    "inputs": "input",
    "neurons": "neurons",
    "connections": "connection",
    "outputs": "output",
    "activations": "definition",
    "models": "definition",
    "rules": "definition",
    "synapses": "definition",
    "modules": "module",
    "instances": "instance",
}


@dataclass(frozen=True, slots=True)
class Symbol:
    """A declaration or a section; ``whole`` spans it with its value, ``span`` its name."""

    name: str
    sort: Sort
    detail: str
    whole: Span
    span: Span
    children: tuple[Symbol, ...] = ()


def symbols(document: Document) -> tuple[Symbol, ...]:
    """The sections in the order written."""
    below: dict[Path, list[Item]] = {}
    for item in document.items:
        if item.is_key:
            # the entries of a list of mappings belong to the section, as those of one mapping do
            parent = tuple(part for part in item.path[:-1] if isinstance(part, str))
            below.setdefault(parent, []).append(item)
    return _sections(document, (), below)


def _sections(document: Document, path: Path, below: dict[Path, list[Item]]) -> tuple[Symbol, ...]:
    result = []
    for item in below.get(path, ()):
        name = item.text or "?"
        entries = below.get((*path, name), []) if name in _SORTS else []
        children = tuple(_entry(document, entry, _SORTS[name], below) for entry in entries)
        value = document.index.values.get(item.path)
        detail = "" if value is None else _short(value.text)
        result.append(Symbol(name, "section", detail, _around(item, children), item.span, children))
    return tuple(result)


def _entry(document: Document, item: Item, sort: Sort, below: dict[Path, list[Item]]) -> Symbol:
    index = document.index
    value = index.values.get(item.path)
    detail = "" if value is None else _short(value.text)
    if sort == "neurons":
        count = index.values.get((*item.path, "count"))
        detail = "" if count is None else f"count {count.text}"
    elif sort == "instance":
        module = index.values.get((*item.path, "module"))
        detail = "" if module is None else module.text
    children = _sections(document, item.path, below) if sort == "module" else ()
    return Symbol(item.text or "?", sort, detail, _around(item, children), item.span, children)


def _around(item: Item, children: tuple[Symbol, ...]) -> Span:
    """The whole of an item; where that is guessed it may end before its children do."""
    ends = [item.whole, *(child.whole for child in children)]
    end = max((span.end_line, span.end_column) for span in ends)
    return Span(item.span.file, item.span.line, item.span.column, *end)


def _short(text: str) -> str:
    line = " ".join(text.split())
    return line if len(line) <= 60 else line[:59] + "…"
