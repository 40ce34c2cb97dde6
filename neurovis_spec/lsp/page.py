"""A text by itself: what is written in it, sound or not, without what it includes.

In: a text and the name of its file. Out: the Items and Names. What other files declare is joined to it in ``document``.
"""

from __future__ import annotations

from collections.abc import Iterable
from collections.abc import Mapping as Values
from dataclasses import dataclass
from functools import cached_property

from neurovis_spec.language.places import LIBRARY_ALONE, SPEC_ALONE
from neurovis_spec.language.yaml.reader import read_any
from neurovis_spec.language.yaml.source import Mapping, Node
from neurovis_spec.lsp.definitions import builtin_signals
from neurovis_spec.lsp.index import Index
from neurovis_spec.lsp.outline import Item, item_at, outline
from neurovis_spec.lsp.text import Place, Text


@dataclass(frozen=True)
class Page:
    """A text and what it is called; the positions of the protocol count units of ``encoding``."""

    source: str
    file: str
    encoding: str = "utf-16"

    @cached_property
    def text(self) -> Text:
        """The text, with its lines."""
        return Text(self.source, self.encoding)

    @cached_property
    def root(self) -> Node | None:
        """The values that know their places, as far as the text can be read at this moment."""
        root = read_any(self.text.text, self.file)
        return root if isinstance(root, Mapping) else None

    @cached_property
    def items(self) -> tuple[Item, ...]:
        """All keys and texts, but those in lists of edges."""
        return () if self.root is None else tuple(outline(self.root, edges=False))

    @cached_property
    def whole(self) -> tuple[Item, ...]:
        """All keys and texts."""
        return () if self.root is None else tuple(outline(self.root))

    @cached_property
    def includes(self) -> tuple[Item, ...]:
        """The paths of the files that it includes."""
        return tuple(i for i in self.items if i.path[:1] == ("include",) and not i.is_key and i.text)

    @cached_property
    def library(self) -> bool:
        """Whether it is a file to be included: modules and definitions, and nothing that only a spec has."""
        keys = {item.text for item in self.items if item.is_key and len(item.path) == 1}
        return keys.isdisjoint(SPEC_ALONE) and not keys.isdisjoint(LIBRARY_ALONE)

    @cached_property
    def alone(self) -> Index:
        """What it declares, without other files: enough to look declarations up in it."""
        return self.index(())

    def index(self, others: Iterable[Index], sizes: Values[str, int] | None = None, *, whole: bool = False) -> Index:
        """All names of the text, which may lead to those of others; without ``whole`` not those in lists of edges."""
        items = self.whole if whole else self.items
        return Index(items, self.text, self.file, sizes or {}, builtin_signals(), tuple(others))

    def item_at(self, place: Place) -> Item | None:
        """The key or the text at a place."""
        return None if self.root is None else item_at(self.root, place)
