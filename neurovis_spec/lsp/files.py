"""The files around a document: as an editor has them open, else as they are on disk.

In: the texts that are open, the folders of the workspace. Out: Pages, each a text by itself: the Items and Names that
are written in it, sound or not, without what it includes, which is joined to it in ``document``; which files one
includes, which include it. What has been read is kept until it changes.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Final, TypeAlias

from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.data.files import NamedFile, locate
from neurovis_spec.language.includes import MOST
from neurovis_spec.language.places import LIBRARY_ALONE, SPEC_ALONE
from neurovis_spec.language.unknown import UNKNOWN
from neurovis_spec.language.yaml.opening import FileFault, read_bytes
from neurovis_spec.language.yaml.reader import LARGEST, read_any
from neurovis_spec.language.yaml.source import Mapping as SourceMapping
from neurovis_spec.language.yaml.source import Node
from neurovis_spec.lsp.definitions import builtin_signals
from neurovis_spec.lsp.index import Index
from neurovis_spec.lsp.outline import Item, item_at, outline
from neurovis_spec.lsp.text import Place, Text
from neurovis_spec.real_paths import real_path

#: How many entries of the folders of a workspace are looked through for specs, and the largest of these.
_MOST_ENTRIES: Final = 20_000
_LARGEST_SPEC: Final = 4 << 20
_PASSED_OVER: Final = frozenset({"node_modules", "__pycache__", "venv", "build", "dist"})
#: What a file was when it was read: the text that is open, else time and size.
_Stamp: TypeAlias = str | tuple[int, int]


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
        return root if isinstance(root, SourceMapping) else None

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

    def index(self, others: Iterable[Index], sizes: Mapping[str, int] | None = None, *, whole: bool = False) -> Index:
        """All names of the text, which may lead to those of others; without ``whole`` not those in lists of edges."""
        items = self.whole if whole else self.items
        return Index(items, self.text, self.file, sizes or {}, builtin_signals(), tuple(others))

    def item_at(self, place: Place) -> Item | None:
        """The key or the text at a place."""
        return None if self.root is None else item_at(self.root, place)


class CrowdedError(Exception):
    """A workspace holds too many files to look through them."""


@dataclass(frozen=True)
class Files:
    """What the files of a workspace hold; ``open`` are the texts in the editor, by their resolved paths."""

    open: Mapping[Path, str] = field(default_factory=dict)
    roots: tuple[Path, ...] = ()
    encoding: str = "utf-16"
    kept: dict[Path, tuple[_Stamp, Page]] = field(default_factory=dict, compare=False, repr=False)

    def holding(self, texts: Mapping[Path, str]) -> Files:
        """The same with other texts in the place of some files."""
        return replace(self, open={**self.open, **texts})

    def read(self, path: Path, most: int) -> bytes | FileFault:
        """The bytes of a file, as ``read_bytes`` gives those on disk."""
        text = self.open.get(path)
        return read_bytes(path, most) if text is None else text.encode("utf-8", "replace")

    def page(self, path: Path) -> Page | None:
        """A file as it is now, the same object until it changes; None where it cannot be read."""
        stamp = self._stamp(path)
        if stamp is None:
            return None
        known = self.kept.get(path)
        if known is not None and known[0] == stamp and known[1].encoding == self.encoding:
            return known[1]
        data = self.read(path, LARGEST)
        if isinstance(data, FileFault):
            return None
        page = Page(data.decode("utf-8", "replace"), str(path), self.encoding)
        self.kept[path] = (stamp, page)
        return page

    def _stamp(self, path: Path) -> _Stamp | None:
        text = self.open.get(path)
        if text is not None:
            return text
        try:
            status = path.stat()
        except (OSError, ValueError):
            return None
        return status.st_mtime_ns, status.st_size

    def unchanged(self, pages: tuple[Page, ...]) -> bool:
        """Whether these pages of files are as they are now."""
        return all(self.page(Path(page.file)) is page for page in pages)

    def root(self, path: Path, page: Page) -> Path:
        """The folder that what a file names may not leave: that of a spec; for a file to be included the folder of the
        workspace, since the spec may lie above it."""
        around = self._around(path) if page.library else None
        return path.parent if around is None else around

    def _around(self, path: Path) -> Path | None:
        return next((root for root in self.roots if path.is_relative_to(root)), None)

    def has(self, path: Path) -> bool:
        """Whether a file belongs to the workspace, or is open."""
        return path in self.open or self._around(path) is not None

    def included(self, path: Path, page: Page) -> tuple[Page, ...]:
        """The files that a file includes, and those that they include, each once, without itself."""
        root = self.root(path, page)
        found: dict[Path, Page] = {}
        waiting = deque((path.parent, item) for item in page.includes)
        while waiting and len(found) < MOST:
            folder, item = waiting.popleft()
            place = locate(NamedFile(item.text, root, folder, item.span), Findings())
            other = None if place is UNKNOWN or place in found or place == path else self.page(place)
            if place is not UNKNOWN and other is not None:
                found[place] = other
                waiting.extend((place.parent, below) for below in other.includes)
        return tuple(found.values())

    def users(self, path: Path, *, everywhere: bool) -> Iterator[tuple[Page, tuple[Page, ...]]]:
        """The files that include a file, directly or through others, each with all that it includes: the open ones, and
        ``everywhere`` in the workspace. Raises CrowdedError."""
        among = dict.fromkeys(self.open)
        if everywhere:
            among.update(dict.fromkeys(self._specs()))
        for other in among:
            page = None if other == path else self.page(other)
            if page is None or not page.includes:
                continue
            included = self.included(other, page)
            if any(Path(one.file) == path for one in included):
                yield page, included

    def _specs(self) -> Iterator[Path]:
        """The YAML files of the workspace that may include others."""
        seen = 0
        for root in self.roots:
            for folder, folders, names in os.walk(root):
                folders[:] = [name for name in folders if name not in _PASSED_OVER and not name.startswith(".")]
                seen += len(folders) + len(names)
                if seen > _MOST_ENTRIES:
                    raise CrowdedError
                for name in names:
                    if name.endswith((".yaml", ".yml")):
                        path = Path(folder, name)
                        data = read_bytes(path, _LARGEST_SPEC)
                        if not isinstance(data, FileFault) and b"include" in data:
                            yield real_path(path)
