"""An open document: its text, what can be said of it at this moment, and what was known when it last was sound.

In: a text, the name that findings call it by, its folder, and the files around it. Out: the Items and Names of the
text, which may lead to what other files declare: those that it includes and, of a file to be included, those that are
open and include it; and the sensors and actuators of its body, found as the compiler finds them.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Literal

from neurovis_spec import plugins
from neurovis_spec.body import Port
from neurovis_spec.compiler.body import Clock, find_body
from neurovis_spec.compiler.body import Place as BodyPlace
from neurovis_spec.compiler.limits import plural
from neurovis_spec.compiler.network import Network
from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.located import Located
from neurovis_spec.lsp.files import Files, Page
from neurovis_spec.lsp.index import Index
from neurovis_spec.lsp.names import Name
from neurovis_spec.lsp.outline import Item
from neurovis_spec.lsp.text import Place, Text, holds
from neurovis_spec.real_paths import real_path


@dataclass(frozen=True)
class Document:
    """A text and its place; ``network`` is what it last compiled to, which may be some edits ago; the
    positions of the protocol count units of ``encoding``."""

    source: str
    file: str = "<document>"
    folder: Path = field(default_factory=Path)
    network: Network | None = None
    encoding: str = "utf-16"
    files: Files = field(default_factory=Files)

    @cached_property
    def page(self) -> Page:
        """The text by itself."""
        return Page(self.source, self.file, self.encoding)

    @property
    def text(self) -> Text:
        """The text, with its lines."""
        return self.page.text

    @property
    def items(self) -> tuple[Item, ...]:
        """All keys and texts, but those in lists of edges."""
        return self.page.items

    @cached_property
    def path(self) -> Path:
        """Where the file is, or would be."""
        try:
            return real_path(self.folder / Path(self.file).name)
        except ValueError:  # no name of a file
            return self.folder / "document"

    @property
    def root(self) -> Path:
        """The folder that what it names may not leave."""
        return self.files.root(self.path, self.page)

    @cached_property
    def included(self) -> tuple[Page, ...]:
        """The files that it includes, directly or through others."""
        return self.files.included(self.path, self.page)

    @cached_property
    def reach(self) -> tuple[Page, ...]:
        """The other files whose modules and definitions it may use."""
        found = {page.file: page for page in self.included}
        if self.page.library:
            for user, included in self.files.users(self.path, everywhere=False):
                found.update({page.file: page for page in (user, *included)})
        return tuple(page for page in found.values() if Path(page.file) != self.path)

    @cached_property
    def index(self) -> Index:
        """All that is declared, and the names outside of lists of edges."""
        return self.page.index(self._others(), self._sizes)

    @cached_property
    def whole(self) -> Index:
        """All names of the document."""
        return self.page.index(self._others(), self._sizes, whole=True)

    def _others(self) -> Iterable[Index]:
        return (page.alone for page in self.reach)

    @property
    def _sizes(self) -> dict[str, int]:
        return {} if self.network is None else {group.name: group.count for group in self.network.neurons.groups}

    def page_of(self, file: str) -> Page:
        """The page of a file in reach by its name; the document's own for any other."""
        return next((page for page in self.reach if page.file == file), self.page)

    def name_at(self, place: Place) -> Name | None:
        """The name at a place; of two that touch there the second."""
        item = self.item_at(place)
        found = () if item is None else self.index.names_in(item)
        return max(
            (name for name in found if name.exact and holds(name.span, place)), key=lambda n: n.span, default=None
        )

    def item_at(self, place: Place) -> Item | None:
        """The key or the text at a place."""
        return self.page.item_at(place)


def ports_of(document: Document, use: Literal["sensor", "actuator"]) -> Sequence[Port]:
    """The sensors, or the actuators, of the body that a document names; none where it cannot be opened as the text
    stands."""
    values = document.index.values
    for kind in plugins.names(plugins.BODIES):
        given = values.get(("body", kind))
        if given is not None and given.text:
            dt = values.get(("time", "dt"))
            seconds = None if dt is None else dt.scalar.value
            clock = Clock(float(seconds) if isinstance(seconds, (int, float)) and seconds > 0 else 1.0)
            place = BodyPlace(document.path.parent, document.root)
            _, body = find_body(kind, Located(given.text, given.scalar), place, clock, Findings())
            return () if body is None else body.sensors if use == "sensor" else body.actuators
    return ()


def described(port: Port) -> str:
    """How many numbers a port is, of what, and from where to where."""
    size = plural(port.size, "number")
    unit = f", {port.unit}" if port.unit else ""
    limited = port.low > float("-inf") and port.high < float("inf")
    return size + unit + (f", {port.low:g} … {port.high:g}" if limited else "")
