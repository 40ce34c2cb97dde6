"""A spec as it is written: the nodes that formatting works on, with every gap in its place.

In: nothing; these are the types alone. A scalar on one line is the text as written, quotes and all, and the empty
text where a value is left out. So nothing of an author's spelling is ever made anew.
"""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

from neurovis_spec.language.format.between import Comment, Gap


class Lines(NamedTuple):
    """A plain or quoted text over several lines, each without the blanks around it; a blank line is empty."""

    lines: tuple[str, ...]


class Block(NamedTuple):
    """A text behind | or >: the header, a comment on its line, and the lines without their common indentation."""

    header: str
    comment: Comment | None
    lines: tuple[str, ...]


class Row(NamedTuple):
    """A flow list of scalars on one line."""

    cells: tuple[str, ...]


class Item(NamedTuple):
    """An item of a flow list, where ``key`` is None, or an entry of a flow mapping. ``colon`` says whether there is
    one: a key without a value need not have it, but is then ``announced`` by ? where there are no braces. ``gap`` is
    what stands before it."""

    gap: Gap
    key: str | Lines | None
    colon: bool
    value: Node
    announced: bool = False


class Flow(NamedTuple):
    """A flow list or mapping between its brackets, which are empty for the single pair in ``[a: 1]``; ``end`` is what
    stands before the closing one."""

    brackets: tuple[str, str]
    items: tuple[Item, ...]
    end: Gap


class Entry(NamedTuple):
    """An entry of a block mapping. ``gap`` stands before it, ``inner`` between its colon and its value where that is
    no block collection, which has the gap itself."""

    gap: Gap
    key: str | Lines | Block
    inner: Gap
    value: Node


class Mapping(NamedTuple):
    """A block mapping, whose keys stood in a column (from 0)."""

    column: int
    entries: tuple[Entry, ...]


class Dash(NamedTuple):
    """An item of a block list, with the same gaps as an Entry."""

    gap: Gap
    inner: Gap
    value: Node


class Listing(NamedTuple):
    """A block list, whose dashes stood in a column (from 0)."""

    column: int
    items: tuple[Dash, ...]


Node: TypeAlias = str | Lines | Block | Row | Flow | Mapping | Listing


class Document(NamedTuple):
    """A whole text: what stands before ``---`` (None without one), the root, the gap before a root in brackets, and
    what stands behind the root."""

    prologue: Gap | None
    gap: Gap
    root: Node
    end: Gap
