"""Where something is used.

In: a Document and a place in it. Out: every place that leads to what stands there, in the document and in the files
that it shares it with; ``K3`` and ``left1.K`` are uses of the group ``K``.
"""

from __future__ import annotations

from neurovis_spec.diagnostics import Span
from neurovis_spec.lsp.document import Document
from neurovis_spec.lsp.rename import sharing
from neurovis_spec.lsp.text import Place


def references(document: Document, place: Place, *, declaration: bool = True) -> tuple[Span, ...]:
    """The places, with that of the ``declaration`` if it is wanted; none where nothing is declared there."""
    name = document.name_at(place)
    found = None if name is None else document.index.find(name)
    if found is None:
        return ()
    uses = (use for index in sharing(document, found.declaration) for use in index.uses(found.declaration))
    return tuple(dict.fromkeys(span for name, span in uses if declaration or not name.declares))
