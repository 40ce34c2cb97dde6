"""Editing a spec as an author would: values are put where keys lead, and every comment stays.

In: the text of a spec and values by their keys. Out: the text, canonically formatted, in which they stand.
"""

from __future__ import annotations

from collections.abc import Mapping as Values
from typing import Final, TypeAlias

from neurovis_spec.language.format.between import NONE, Comment, Gap, joined
from neurovis_spec.language.format.layout import print_document
from neurovis_spec.language.format.parse import TreeReader
from neurovis_spec.language.format.tree import Entry, Flow, Item, Lines, Listing, Mapping, Node, Row
from neurovis_spec.language.yaml.reader import event_source

#: The keys that lead to a value.
Path: TypeAlias = tuple[str, ...]
#: A value as it is written: a scalar, or the cells of a list.
Value: TypeAlias = "str | tuple[str, ...]"

_BLANK: Final = Gap(None, (), True, True)
_STEP: Final = 2


def put(text: str, values: Values[Path, Value]) -> str:
    r"""The text of a spec, which the reader has accepted, with these values in place of what stood there. Mappings on
    the way are made where there are none; of those in braces that hold no comment blocks are made.

    >>> print(put("a: 1\nlayout: {b: 2}  # why\n", {("layout", "positions", "O"): ("1", "0.5")}), end="")
    a: 1
    layout:  # why
      b: 2
      positions:
        O: [1, 0.5]
    """
    plain = text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    plain += "" if plain.endswith("\n") else "\n"
    document = TreeReader(plain, event_source(plain)).document()
    for path, value in values.items():
        root, taken = _put(document.root, path, value, 0, document.end.trailing)
        document = document._replace(root=root, end=_without(document.end, taken))
    return print_document(document)


def _put(node: Node, path: Path, value: Value, column: int, behind: Comment | None) -> tuple[Node, bool]:
    """The node with the value; ``column`` is where a block in its place would stand, ``behind`` a comment behind it on
    its last line. Also gives whether that comment is now within the node, on the line that it was about."""
    if not path:
        return _replaced(node, value), False
    if isinstance(node, Mapping):
        return _put_in_block(node, path, value, behind)
    if isinstance(node, Flow) and node.brackets[0] == "{":
        if _commented(node) or column == 0:
            return _put_in_braces(node, path, value), False
        block, comment = _block(node, column), behind
    else:  # nothing, or what cannot be meant
        block, comment = Mapping(column, ()), behind
    found, _ = _put_in_block(block, path, value, None)
    first = found.entries[0]
    return found._replace(entries=(_after(first, comment), *found.entries[1:])), comment is not None


def _put_in_block(node: Mapping, path: Path, value: Value, behind: Comment | None) -> tuple[Mapping, bool]:
    entries, (key, *rest) = list(node.entries), path
    place = next((place for place, entry in enumerate(entries) if _bare(entry.key) == key), None)
    if place is None:
        gap = _BLANK if node.column == 0 and any(entry.gap.blank for entry in entries[1:]) else NONE
        made, _ = _put("", tuple(rest), value, node.column + _STEP, None)
        return node._replace(entries=(*entries, _after(Entry(gap, key, NONE, made), behind))), behind is not None
    last = place == len(entries) - 1
    after = behind if last else entries[place + 1].gap.trailing
    found, taken = _put(entries[place].value, tuple(rest), value, node.column + _STEP, after)
    inner = entries[place].inner
    if isinstance(found, Mapping) and inner.comments:  # a block has no gap before it
        first, *others = found.entries
        found = found._replace(entries=(first._replace(gap=joined(inner, first.gap)), *others))
        inner = NONE
    entries[place] = entries[place]._replace(inner=inner, value=found)
    if not last:
        entries[place + 1] = entries[place + 1]._replace(gap=_without(entries[place + 1].gap, taken))
    return node._replace(entries=tuple(entries)), taken and last


def _put_in_braces(node: Flow, path: Path, value: Value) -> Flow:
    items, (key, *rest) = list(node.items), path
    place = next((place for place, item in enumerate(items) if _bare(item.key) == key), None)
    if place is None:
        gap = Gap(None, (), False, bool(items) and items[-1].gap.broken)
        return node._replace(items=(*items, Item(gap, key, True, _in_braces("", tuple(rest), value))))
    items[place] = items[place]._replace(colon=True, value=_in_braces(items[place].value, tuple(rest), value))
    return node._replace(items=tuple(items))


def _in_braces(node: Node, path: Path, value: Value) -> Node:
    if not path:
        return _replaced(node, value)
    return _put_in_braces(node if isinstance(node, Flow) else Flow(("{", "}"), (), NONE), path, value)


def _replaced(node: Node, value: Value) -> Node:
    """A value in place of another; comments between the items of a list stay."""
    if isinstance(value, str):
        return value
    if isinstance(node, Flow) and len(node.items) == len(value) and node.brackets[0] == "[":
        items = zip(node.items, value, strict=True)
        return node._replace(items=tuple(item._replace(value=cell) for item, cell in items))
    if isinstance(node, Listing) and len(node.items) == len(value):
        dashes = zip(node.items, value, strict=True)
        return node._replace(items=tuple(dash._replace(value=cell) for dash, cell in dashes))
    return Row(value)


def _block(node: Flow, column: int) -> Mapping:
    """What stood in braces as a block."""
    return Mapping(column, tuple(Entry(NONE, item.key or "", NONE, item.value) for item in node.items))


def _commented(node: Node) -> bool:
    """Whether a comment stands within brackets."""
    if not isinstance(node, Flow):
        return False
    return bool(node.end.comments) or any(item.gap.comments or _commented(item.value) for item in node.items)


def _after(entry: Entry, comment: Comment | None) -> Entry:
    """An entry behind a comment on the line before."""
    if comment is None:
        return entry
    return entry._replace(gap=entry.gap._replace(trailing=comment, broken=True))


def _without(gap: Gap, taken: bool) -> Gap:
    return gap._replace(trailing=None) if taken else gap


def _bare(key: object) -> str:
    if isinstance(key, Lines):
        return " ".join(key.lines)
    return key.strip("'\"") if isinstance(key, str) else ""
