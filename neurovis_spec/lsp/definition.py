"""Where something is declared, and where it is used.

In: a Document and a place in it. Out: the file and the span of the declaration: a group for ``K3`` or ``left1.K3``, a
parameter for its name in an expression, a definition or a module here or in an included file, the YAML of a built-in, a
file that is named; and every place that leads to it, in the document and in the files that share it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

from neurovis_spec import plugins
from neurovis_spec.diagnostics import Findings, Span
from neurovis_spec.language.data.files import NamedFile, locate
from neurovis_spec.language.unknown import UNKNOWN, Unknown
from neurovis_spec.language.yaml.reader import read_file
from neurovis_spec.lsp.document import Document
from neurovis_spec.lsp.names import SECTIONS, Name
from neurovis_spec.lsp.outline import Item, outline
from neurovis_spec.lsp.outline import Path as Keys
from neurovis_spec.lsp.rename import sharing
from neurovis_spec.lsp.text import Place


@dataclass(frozen=True, slots=True)
class Location:
    """A stretch of a file; ``path`` is None for the document itself."""

    path: Path | None
    span: Span


def definition(document: Document, place: Place) -> Location | None:
    """The declaration of what stands at a place; None where there is none that could be shown."""
    name = document.name_at(place)
    if name is None:
        item = document.item_at(place)
        return None if item is None else _file(document, item)
    found = document.index.find(name)
    if found is not None:
        span = found.declaration.span
        return Location(None if span.file == document.file else Path(span.file), span)
    return _shipped(name)


def references(document: Document, place: Place, *, declaration: bool = True) -> tuple[Span, ...]:
    """The places that lead to what stands at a place, with that of the ``declaration`` if it is wanted; none where
    nothing is declared there. ``K3`` and ``left1.K`` are uses of the group ``K``."""
    name = document.name_at(place)
    found = None if name is None else document.index.find(name)
    if found is None:
        return ()
    uses = (use for index in sharing(document, found.declaration) for use in index.uses(found.declaration))
    return tuple(dict.fromkeys(span for name, span in uses if declaration or not name.declares))


def _file(document: Document, item: Item) -> Location | None:
    """The beginning of a file that is named: data, or one that is included."""
    if item.is_key or not (item.path[-1:] == ("file",) or item.path[:1] == ("include",)):
        return None
    path = _located(document, item)
    return None if path is UNKNOWN or not path.is_file() else Location(path, Span(str(path), 1, 1, 1, 1))


def _located(document: Document, item: Item) -> Path | Unknown:
    return locate(NamedFile(item.text, document.root, document.folder, item.span), Findings())


def _shipped(name: Name) -> Location | None:
    """A definition of a library that ships, or a part of one."""
    wanted: list[Keys]
    if name.kind == "local" and name.scope.definition is not None:
        section, owner = name.scope.definition
        wanted = [(section, owner, part, name.text) for part in ("parameters", "state", "let")]
    elif name.kind in SECTIONS:
        wanted = [(SECTIONS[name.kind], name.text)]
    else:
        return None
    for path in _libraries():
        source = read_file(path, str(path), Findings())
        for item in () if source is None else outline(source.root):
            signal = not item.is_key and item.path[2:3] == ("signals",) and item.text == name.text
            if (item.is_key and item.path in wanted) or (signal and item.path[:2] == wanted[0][:2]):
                return Location(path, item.span)
    return None


def _libraries() -> Iterator[Path]:
    """The library files, where they are files that an editor can open."""
    for name in plugins.names(plugins.LIBRARIES):
        folder = files(plugins.package(plugins.LIBRARIES, name))
        if isinstance(folder, Path):
            yield from sorted(folder.glob("*.yaml"))
