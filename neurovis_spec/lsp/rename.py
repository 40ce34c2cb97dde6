"""Renaming what a document declares, with everything that leads to it.

In: a Document, a place, the new name. Out: edits; ``K`` renamed to ``L`` makes ``K3..K5`` into ``L3..L5``, and
``left1.K`` into ``left1.L``. Modules and definitions are renamed in all files that share them. A new name that is none,
or that is taken, is refused with a sentence, and so is a rename that would leave an error behind.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from neurovis_spec.diagnostics import Diagnostic, Span
from neurovis_spec.language.expressions.functions import GIVEN, RESERVED
from neurovis_spec.language.located import IDENTIFIER, NAME_RULE, bad_name
from neurovis_spec.language.places import role_of
from neurovis_spec.language.yaml.scalars import resolve
from neurovis_spec.lsp.check import check
from neurovis_spec.lsp.document import Document
from neurovis_spec.lsp.files import CrowdedError, Page
from neurovis_spec.lsp.index import SHARED, Found, Index, is_common
from neurovis_spec.lsp.names import SECTIONS, Name
from neurovis_spec.lsp.text import Place, Text

#: How many specs that share a declaration are compiled to see whether a rename does harm; each takes its time.
_MOST_CHECKED = 8
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
    declaration = found.declaration
    if new == declaration.text:
        return ()
    _check_name(document, declaration, new)
    families = _families(document, declaration)
    edits: dict[Edit, None] = {}
    for index in _indices(families):
        for name, span in index.uses(declaration):
            _check_use(document, declaration, name, new)
            edits[Edit(span, new)] = None
    result = tuple(edits)
    _check_files(document, result)
    _check_result(document, families, result, new)
    return result


def apply(document: Document, edits: Iterable[Edit]) -> Document:
    """The document after those of the edits that are its own."""
    own = (edit for edit in edits if edit.span.file == document.file)
    return replace(document, source=_applied(document.text, own))


def _applied(text: Text, edits: Iterable[Edit]) -> str:
    result = text.text
    for edit in sorted(edits, key=lambda edit: edit.span, reverse=True):
        start = text.index(edit.span.line, edit.span.column)
        end = text.index(edit.span.end_line, edit.span.end_column)
        result = result[:start] + edit.text + result[end:]
    return result


def _families(document: Document, declaration: Name) -> list[tuple[Page, ...]]:
    """The files that share a declaration: a spec, or a file that none includes, first, then what it includes."""
    if not is_common(declaration):
        return [(document.page,)]
    families = {document.file: (document.page, *document.included)}
    page = document.page_of(declaration.span.file)
    if page.library:
        path = document.path if page is document.page else Path(page.file)
        try:
            users = list(document.files.users(path, everywhere=True))
        except CrowdedError:
            message = f"the workspace holds too many files to find all that include '{path.name}': rename it by hand"
            raise RenameError(message) from None
        for user, included in users:
            family = (document.page if Path(one.file) == document.path else one for one in (user, *included))
            families.setdefault(user.file, tuple(family))
    return list(families.values())


def _indices(families: Iterable[tuple[Page, ...]]) -> Iterator[Index]:
    """All names of each file of each family, as they lead to what the others declare."""
    for family in families:
        for page in family:
            yield page.index((other.alone for other in family if other is not page), whole=True)


def sharing(document: Document, declaration: Name) -> Iterator[Index]:
    """All names of each file that shares a declaration; of the document alone where these cannot be found."""
    try:
        families = _families(document, declaration)
    except RenameError:
        families = [(document.page, *document.included)]
    return _indices(families)


def _check_use(document: Document, declaration: Name, name: Name, new: str) -> None:
    place = _line(document, name.span)
    if not name.exact:
        where = f"'{declaration.text}' stands in {place} in a text with escapes"
        raise RenameError(f"{where}: write it without them, or rename it by hand")
    role = role_of(name.item.path, name.item.is_key)
    if role is not None and new in role.sees:
        raise RenameError(f"'{new}' means something else in {place}: {GIVEN[new]}")


def _line(document: Document, span: Span) -> str:
    return f"line {span.line}" + ("" if span.file == document.file else f" of {Path(span.file).name}")


def _check_files(document: Document, edits: Iterable[Edit]) -> None:
    """Files beyond the workspace are not changed."""
    for file in dict.fromkeys(edit.span.file for edit in edits):
        if file != document.file and not document.files.has(Path(file)):
            name = Path(file).name
            raise RenameError(f"'{name}', which has this name too, is not in the workspace: open it, or rename by hand")


def _found(document: Document, place: Place) -> Found:
    name = document.name_at(place)
    if name is None:
        raise RenameError(_NOTHING)
    found = document.index.find(name)
    if found is None:
        if name.kind in SECTIONS or name.kind == "local":
            raise RenameError(f"'{name.text}' is not declared in this document")
        raise RenameError(_NOTHING)
    return found


def _check_name(document: Document, declaration: Name, new: str) -> None:
    index = document.index
    if not IDENTIFIER.fullmatch(new):
        raise RenameError(f"{bad_name(new)}: {NAME_RULE}")
    if not isinstance(resolve(new), str):
        word = "null" if resolve(new) is None else str(resolve(new)).lower()
        raise RenameError(f"'{new}' is no name in YAML, which reads it as {word}")
    if declaration.kind == "parameter" and new in RESERVED:
        raise RenameError(f"a parameter may not be called '{new}': the language gives this name a meaning of its own")
    kinds = SHARED if declaration.kind in SHARED else (declaration.kind,)
    homes = (index, *index.others) if is_common(declaration) else (index,)
    for other in (other for home in homes for other in home.declarations):
        if other.span == declaration.span or other.scope != declaration.scope or other.kind not in kinds:
            continue
        if other.text == new:
            raise RenameError(f"'{new}' is declared already, in {_line(document, other.span)}")
        common = _common_neuron(declaration, new, other, index)
        if common is not None:
            raise RenameError(f"'{common}' is a neuron already, declared in {_line(document, other.span)}")


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


def _check_result(document: Document, families: list[tuple[Page, ...]], edits: tuple[Edit, ...], new: str) -> None:
    """Compile what would be, of many specs some: what goes wrong only then is the new name's doing."""
    pages = {page.file: page for family in families for page in family}
    texts: dict[Path, str] = {}
    for page in pages.values():
        own = [edit for edit in edits if edit.span.file == page.file]
        if own:
            texts[document.path if page is document.page else Path(page.file)] = _applied(page.text, own)
    after = document.files.holding(texts)
    for head, *_ in families[:_MOST_CHECKED]:
        before = document
        if head is not document.page:
            path = Path(head.file)
            before = Document(head.text.text, head.file, path.parent, files=document.files)
        changed = replace(before, source=texts.get(before.path, before.text.text), files=after, network=None)
        first = _first_new(before, changed)
        if first is not None:
            place = _line(document, first.span)
            raise RenameError(f"with the name '{new}' there would be an error in {place}: {first.message}")


def _first_new(before: Document, after: Document) -> Diagnostic | None:
    """The first error of a document that there was not, where there are more than before."""
    old = [finding for finding in check(before).findings if finding.severity == "error"]
    errors = [finding for finding in check(after).findings if finding.severity == "error"]
    if len(errors) <= len(old):
        return None
    known = {(finding.code, finding.span.file, finding.span.line) for finding in old}
    return next((one for one in errors if (one.code, one.span.file, one.span.line) not in known), errors[0])
