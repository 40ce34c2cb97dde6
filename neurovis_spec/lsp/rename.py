"""Renaming what a document declares, with everything that leads to it.

In: a Document, a place, the new name. Out: edits; ``K`` renamed to ``L`` makes ``K3..K5`` into ``L3..L5``. A new name
that is none, or that is taken, is refused with a sentence, and so is a rename that would leave an error behind.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from neurovis_spec.compiler.constants import RESERVED
from neurovis_spec.diagnostics import Span
from neurovis_spec.language.located import IDENTIFIER, NAME_RULE, bad_name
from neurovis_spec.language.scalars import resolve
from neurovis_spec.lsp.document import Document, check
from neurovis_spec.lsp.index import SHARED, Found, Index
from neurovis_spec.lsp.names import Name
from neurovis_spec.lsp.roles import role_of
from neurovis_spec.lsp.text import Place
from neurovis_spec.lsp.words import GIVEN

_NOTHING = "there is no name here that this document declares"


class RenameError(Exception):
    """Why something is not renamed, in a sentence."""


@dataclass(frozen=True, slots=True)
class Edit:
    """A text in the place of another."""

    span: Span
    text: str


def prepare(document: Document, place: Place) -> tuple[Span, str]:
    """What would be renamed at a place: the ``K`` of ``K3``, and its name. Raises RenameError."""
    found = _found(document, place)
    return found.part, found.declaration.text


def rename(document: Document, place: Place, new: str) -> tuple[Edit, ...]:
    """The edits that give another name to what stands at a place. Raises RenameError."""
    found = _found(document, place)
    declaration, index = found.declaration, document.whole
    if new == declaration.text:
        return ()
    _check_name(declaration, new, index)
    uses = list(index.uses(declaration))
    for name, _ in uses:
        if not name.exact:
            where = f"'{declaration.text}' stands in line {name.span.line} in a text with escapes"
            raise RenameError(f"{where}: write it without them, or rename it by hand")
        role, _ = role_of(name.item.path, name.item.is_key)
        if role is not None and new in role.given:
            raise RenameError(f"'{new}' means something else in line {name.span.line}: {GIVEN[new]}")
    edits = tuple(dict.fromkeys(Edit(span, new) for _, span in uses))
    _check_result(document, edits, new)
    return edits


def apply(document: Document, edits: Iterable[Edit]) -> Document:
    """The document after the edits."""
    text = document.text
    result = text.text
    for edit in sorted(edits, key=lambda edit: edit.span, reverse=True):
        start = text.index(edit.span.line, edit.span.column)
        end = text.index(edit.span.end_line, edit.span.end_column)
        result = result[:start] + edit.text + result[end:]
    return replace(document, source=result)


def _found(document: Document, place: Place) -> Found:
    name = document.name_at(place)
    if name is None:
        raise RenameError(_NOTHING)
    found = document.whole.find(name)
    if found is None:
        if name.kind in ("activation", "model", "rule") or name.kind == "local":
            raise RenameError(f"'{name.text}' is not declared in this document")
        raise RenameError(_NOTHING)
    return found


def _check_name(declaration: Name, new: str, index: Index) -> None:
    if not IDENTIFIER.fullmatch(new):
        raise RenameError(f"{bad_name(new)}: {NAME_RULE}")
    if not isinstance(resolve(new), str):
        word = "null" if resolve(new) is None else str(resolve(new)).lower()
        raise RenameError(f"'{new}' is no name in YAML, which reads it as {word}")
    if declaration.kind == "parameter" and new in RESERVED:
        raise RenameError(f"a parameter may not be called '{new}': the language gives this name a meaning of its own")
    kinds = SHARED if declaration.kind in SHARED else (declaration.kind,)
    for other in index.declarations:
        if other is declaration or other.scope != declaration.scope or other.kind not in kinds:
            continue
        if other.text == new:
            raise RenameError(f"'{new}' is declared already, in line {other.span.line}")
        common = _common_neuron(declaration, new, other, index)
        if common is not None:
            raise RenameError(f"'{common}' is a neuron already, declared in line {other.span.line}")


def _common_neuron(declaration: Name, new: str, other: Name, index: Index) -> str | None:
    """A neuron that would be declared twice."""
    mine, theirs = index.numbers(declaration), index.numbers(other)
    if mine is not None and _numbered(other.text, new, mine):
        return other.text
    if theirs is not None and _numbered(new, other.text, theirs):
        return new
    if mine and theirs:
        for number in mine[:1000]:
            if _numbered(f"{new}{number}", other.text, theirs):
                return f"{new}{number}"
    return None


def _numbered(name: str, group: str, numbers: range) -> bool:
    """Whether a name is that of a neuron of a counted group.

    >>> _numbered("K3", "K", range(1, 4)), _numbered("K03", "K", range(1, 4))
    (True, False)
    """
    number = name.removeprefix(group)
    return (
        name.startswith(group)
        and number.isascii()
        and number.isdigit()
        and str(int(number)) == number
        and (int(number) in numbers)
    )


def _check_result(document: Document, edits: Iterable[Edit], new: str) -> None:
    """Compile the document as it would be: what goes wrong only then is the new name's doing."""
    before = [finding for finding in check(document).findings if finding.severity == "error"]
    after = [finding for finding in check(apply(document, edits)).findings if finding.severity == "error"]
    if len(after) > len(before):
        known = {(finding.code, finding.span.line) for finding in before}
        first = next((finding for finding in after if (finding.code, finding.span.line) not in known), after[0])
        raise RenameError(f"with the name '{new}' there would be an error in line {first.span.line}: {first.message}")
