"""A text with a mark where the pointer is: ``¦`` for tests of what an editor asks."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from neurovis_spec.lsp.check import check
from neurovis_spec.lsp.document import Document
from neurovis_spec.lsp.text import Place, Text

MARK = "¦"


def marked(text: str, folder: Path = Path(), compiled: bool = False) -> tuple[Document, Place]:
    """The document without the mark, and the place of the mark. ``compiled``: with the network of the document."""
    at = text.index(MARK)
    source = text.replace(MARK, "", 1)
    document = Document(source, "spec.yaml", folder)
    if compiled:
        checked = check(document)
        assert checked.network is not None, checked.findings
        document = replace(document, network=checked.network)
    return document, Place(*Text(source).lines.place(at))
