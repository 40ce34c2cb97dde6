"""An open document: its text, what can be said of it at this moment, and what was known when it last was sound.

In: a text, the name that findings call it by, and its folder. Out: the Items and Names, exact where the text can be
read, guessed where it cannot; findings and the network, by the same way that ``neurovis validate`` goes.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from neurovis_spec import api
from neurovis_spec.compiler.network import Network
from neurovis_spec.diagnostics import Diagnostic, Findings, SpecError
from neurovis_spec.language.reader import read_text
from neurovis_spec.language.source import SourceDocument
from neurovis_spec.lsp.definitions import builtin_signals
from neurovis_spec.lsp.index import Index
from neurovis_spec.lsp.names import Name
from neurovis_spec.lsp.outline import Item, item_at, outline
from neurovis_spec.lsp.text import Place, Text, holds
from neurovis_spec.lsp.tolerant import outline_of_text


@dataclass(frozen=True)
class Document:
    """A text and its place; ``network`` is what it last compiled to, which may be some edits ago; the
    positions of the protocol count units of ``encoding``."""

    source: str
    file: str = "<document>"
    folder: Path = field(default_factory=Path)
    network: Network | None = None
    encoding: str = "utf-16"

    @cached_property
    def text(self) -> Text:
        """The text, with its lines."""
        return Text(self.source, self.encoding)

    @cached_property
    def read(self) -> SourceDocument | None:
        """The values that know their places; None where the text cannot be read at this moment."""
        return read_text(self.text.text, self.file, Findings())

    @cached_property
    def items(self) -> tuple[Item, ...]:
        """All keys and texts, but those in lists of edges."""
        if self.read is None:
            return outline_of_text(self.text, self.file)
        return tuple(outline(self.read.root, edges=False))

    @cached_property
    def index(self) -> Index:
        """All that is declared, and the names outside of lists of edges."""
        return self._index(self.items)

    @cached_property
    def whole(self) -> Index:
        """All names of the document."""
        return self.index if self.read is None else self._index(tuple(outline(self.read.root)))

    def _index(self, items: tuple[Item, ...]) -> Index:
        groups = () if self.network is None else self.network.neurons.groups
        return Index(items, self.text, {group.name: group.count for group in groups}, builtin_signals())

    def name_at(self, place: Place) -> Name | None:
        """The name at a place; of two that touch there the second."""
        item = self.item_at(place)
        found = () if item is None else self.index.names_in(item)
        return max(
            (name for name in found if name.exact and holds(name.span, place)), key=lambda n: n.span, default=None
        )

    def item_at(self, place: Place) -> Item | None:
        """The key or the text at a place."""
        if self.read is not None:
            return item_at(self.read.root, place)
        return next((item for item in self.items if holds(item.span, place)), None)


@dataclass(frozen=True)
class Checked:
    """What compiling a document gave: all findings, and the network where there is one."""

    findings: tuple[Diagnostic, ...]
    network: Network | None


def check(document: Document) -> Checked:
    """Compile a document as ``neurovis validate`` does; data files are looked for in its folder."""
    try:
        compiled = api.compile_text(document.text.text, file=document.file, folder=document.folder)
    except SpecError as error:
        return Checked(error.diagnostics, None)
    return Checked(compiled.warnings, compiled.network)
