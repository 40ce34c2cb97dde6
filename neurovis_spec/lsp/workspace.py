"""What lies on the editor's desk: open documents, what they last compiled to, and what was found in which file.

In: the URIs and texts of open documents, checks that are done. Out: Documents, the same object until something changes;
the findings of a file, whoever includes it; who is to be checked again when a file changes. A file that an open spec
includes has the findings that it has there, and none of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from neurovis_spec.compiler.network import Network
from neurovis_spec.diagnostics import Diagnostic
from neurovis_spec.lsp.check import Checked, place_of
from neurovis_spec.lsp.document import Document
from neurovis_spec.lsp.files import Files, Page

_Found = Mapping[Path, tuple[Diagnostic, ...]]


@dataclass
class Desk:
    """The open documents by their URIs; ``path_of`` gives the resolved path of a URI, None where it names no file."""

    path_of: Callable[[str], Path | None]
    _files: Files = field(default_factory=Files)
    _documents: dict[str, Document] = field(default_factory=dict)
    _networks: dict[str, Network] = field(default_factory=dict)
    _found: dict[str, _Found] = field(default_factory=dict)
    _read: dict[str, frozenset[Path]] = field(default_factory=dict)
    _places: dict[str, Path | None] = field(default_factory=dict)

    def update(self, sources: Mapping[str, str], roots: tuple[Path, ...], encoding: str) -> None:
        """What is open now, and the folders of the workspace."""
        texts = {path: text for uri, text in sources.items() if (path := self.place(uri)) is not None}
        if self._files.open != texts or self._files.roots != roots or self._files.encoding != encoding:
            self._files = Files(texts, roots, encoding, self._files.kept)

    def place(self, uri: str) -> Path | None:
        """The file of a URI."""
        if uri not in self._places:
            self._places[uri] = self.path_of(uri)
        return self._places[uri]

    def document(self, uri: str, source: str) -> Document:
        """An open document as it is now."""
        known, network = self._documents.get(uri), self._networks.get(uri)
        if (
            known is None
            or (known.source, known.files) != (source, self._files)
            or known.network is not network
            or not self._files.unchanged(known.reach)
        ):
            path = self.place(uri)
            name, folder = (uri, Path.cwd()) if path is None else (str(path), path.parent)
            known = Document(source, name, folder, network, self._files.encoding, self._files)
            self._documents[uri] = known
        return known

    def refresh(self) -> None:
        """Look for included files anew: one that was missing may be there."""
        self._documents = {uri: replace(document) for uri, document in self._documents.items()}

    def close(self, uri: str) -> tuple[Path, ...]:
        """Forget a document; the files whose findings change by that."""
        self._documents.pop(uri, None)
        self._networks.pop(uri, None)
        self._read.pop(uri, None)
        return tuple(self._found.pop(uri, {}))

    def readers(self, path: Path | None) -> tuple[str, ...]:
        """The open documents that read a file when they were last checked."""
        return tuple(uri for uri, read in self._read.items() if path in read)

    def including(self) -> tuple[str, ...]:
        """The open documents that include files."""
        return tuple(uri for uri, document in self._documents.items() if document.page.includes)

    def libraries(self, read: frozenset[Path]) -> tuple[str, ...]:
        """The open documents among the files that were read."""
        return tuple(uri for uri, document in self._documents.items() if document.path in read)

    def read_by(self, uri: str) -> frozenset[Path]:
        """The files that a document read when it was last checked."""
        return self._read.get(uri, frozenset())

    def keep(self, uri: str, document: Document, checked: Checked) -> tuple[Path, ...]:
        """Store the result of a check; gives the other files whose findings change by it."""
        if checked.network is not None:
            self._networks[uri] = checked.network
        found: dict[Path, tuple[Diagnostic, ...]] = {document.path: ()}
        for finding in checked.findings:
            file = finding.span.file
            path = document.path if file == document.file else place_of(file, document.folder)
            found[path] = (*found.get(path, ()), finding)
        old = [self._found.get(uri, {})]
        self._found[uri] = found
        self._read[uri] = checked.files
        if not document.page.library:
            old += [self._found.pop(other) for other in self.libraries(checked.files) if other in self._found]
        paths = {path for one in (*old, found) for path in one}
        return tuple(sorted(path for path in paths - {document.path} if path))

    def findings(self, path: Path) -> tuple[Diagnostic, ...]:
        """All that was found in a file, each once: the same is found by each spec that includes it."""
        each: dict[tuple[object, ...], Diagnostic] = {}
        for found in self._found.values():
            for item in found.get(path, ()):
                span = item.span
                each.setdefault((span.line, span.column, span.end_line, span.end_column, item.code, item.message), item)
        return tuple(sorted(each.values(), key=lambda item: (item.span.line, item.span.column, item.code)))

    def around(self, uri: str, path: Path) -> dict[Path, tuple[Diagnostic, ...]]:
        """What the check of a document found in other files."""
        return {other: found for other, found in self._found.get(uri, {}).items() if other != path}

    def page(self, path: Path) -> Page | None:
        """A file as it is now."""
        return self._files.page(path)

    def uris(self, path: Path) -> Iterator[str]:
        """The URIs by which a file is open."""
        return (uri for uri, document in self._documents.items() if document.path == path)
