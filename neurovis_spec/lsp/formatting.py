"""Formatting as ``neurovis fmt`` does it.

In: a Document. Out: one edit of the whole text; none where the text cannot be read, or is canonical already.
"""

from __future__ import annotations

from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.format.canonical import format_text
from neurovis_spec.lsp.document import Document
from neurovis_spec.lsp.rename import Edit


def formatting(document: Document) -> tuple[Edit, ...]:
    """The edit that makes a document canonical. Raises FormattingError where that would change what it says."""
    text = document.text
    written = format_text(text.text, document.file, Findings())
    if written is None or written == text.text:
        return ()
    return (Edit(text.span(document.file, 0, len(text.text)), written),)
