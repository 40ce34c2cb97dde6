"""From the tree of a spec to its canonical text.

In: a Document. Out: a text. Blocks are indented by two blanks, lists below their key as well; line breaks inside
brackets stay where the author has them, and what follows one is indented by two, or stands below the first item where
that follows its bracket on the same line. A comment on a line of its own belongs to the block in whose column, or
behind it, it begins.
"""

from __future__ import annotations

from typing import Final, NamedTuple

from neurovis_spec.language.format.align import aligned
from neurovis_spec.language.format.between import Comment, Gap
from neurovis_spec.language.format.connection_keys import is_connections, names_connections, normal, normal_all
from neurovis_spec.language.format.lines import LineWriter
from neurovis_spec.language.format.tree import (
    Block,
    Dash,
    Document,
    Entry,
    Flow,
    Item,
    Lines,
    Listing,
    Mapping,
    Node,
    Row,
)

_STEP: Final = 2
_WIDEST: Final = 120  # a value that the author has put below its key comes up beside it if the line is no longer
_LONGEST_KEY: Final = 1000  # a longer one has to be announced by a question mark

#: The keys on the way to a node; items of lists leave no trace in it.
_Path = tuple[str, ...]


class _Level(NamedTuple):
    """A block: the column in which it stood, and that in which it is written."""

    column: int
    indent: int


def print_document(document: Document) -> str:
    """The canonical text."""
    return _Printer().document(document)


class _Printer:
    def __init__(self) -> None:
        self._out = LineWriter()
        self._ended: list[_Level] = []  # the blocks that end where the pen is, innermost first

    def document(self, document: Document) -> str:
        top = _Level(0, 0)
        out = self._out
        first = True
        if document.prologue is not None:
            self._before(document.prologue, top, first=True)
            out.write("---")
        if isinstance(document.root, Mapping | Listing):
            self._block(document.root, 0, (), beside=False)
        else:
            self._before(document.gap, top, first=first)
            self._node(document.root, 0, ())
        self._comments(document.end, top, first=False)
        return out.text()

    # What stands before a token

    def _comments(self, gap: Gap, level: _Level, *, first: bool) -> bool:
        """The comments of a gap. ``first``: at a block's begin, where no blank line is kept. Returns whether it is
        still the begin."""
        self._out.behind(gap.trailing)
        for comment in gap.own:
            if comment.blank and not first:
                self._out.blank()
            self._out.own(comment, self._level_of(comment, level).indent)
            first = False
        return first

    def _before(self, gap: Gap, level: _Level, *, first: bool) -> None:
        """All of a gap, and the begin of the next line."""
        first = self._comments(gap, level, first=first)
        if gap.blank and not first:
            self._out.blank()
        self._out.begin(level.indent)
        self._ended.clear()

    def _level_of(self, comment: Comment, level: _Level) -> _Level:
        """The innermost of the blocks that a comment may belong to: that which goes on, and those that have ended."""
        best = level
        for ended in reversed(self._ended):
            if best.column < ended.column <= comment.column:
                best = ended
        return best

    # Blocks

    def _block(self, node: Mapping | Listing, indent: int, path: _Path, *, beside: bool) -> None:
        """A block; ``beside``: its first line may go on behind a dash."""
        level = _Level(node.column, indent)
        if isinstance(node, Mapping):
            self._mapping(node, level, path, beside=beside)
        else:
            self._listing(node, level, path, beside=beside)
        self._ended.append(level)

    def _begin_entry(self, gap: Gap, level: _Level, *, first: bool, beside: bool) -> None:
        if first and beside and not gap.comments:
            self._out.write(" ")
        else:
            self._before(gap, level, first=first)

    def _mapping(self, node: Mapping, level: _Level, path: _Path, *, beside: bool) -> None:
        names = _names([entry.key for entry in node.entries], path)
        for index, (entry, name) in enumerate(zip(node.entries, names, strict=True)):
            self._begin_entry(entry.gap, level, first=index == 0, beside=beside)
            below = (*path, _bare(name))
            if isinstance(name, str) and len(name) <= _LONGEST_KEY:
                self._out.write(name + ":")
            else:
                self._out.write("? ")
                self._node(name, level.indent, path)
                self._out.begin(level.indent)
                self._out.write(":")
            self._value(entry, level, below, beside=False)

    def _listing(self, node: Listing, level: _Level, path: _Path, *, beside: bool) -> None:
        rows = [item.value for item in node.items if isinstance(item.value, Row)]
        matrix = aligned([row.cells for row in rows]) if len(rows) == len(node.items) > 1 else []
        for index, item in enumerate(node.items):
            self._begin_entry(item.gap, level, first=index == 0, beside=beside)
            self._out.write("-")
            self._value(item._replace(value=matrix[index]) if matrix else item, level, path, beside=True)

    def _value(self, entry: Entry | Dash, level: _Level, path: _Path, *, beside: bool) -> None:
        """What stands behind a colon or a dash."""
        node = entry.value
        indent = level.indent + _STEP
        if isinstance(node, Mapping | Listing):
            self._block(node, indent, path, beside=beside)
            return
        if node == "":  # a comment below that is indented further speaks of what is left out here
            self._ended.append(_Level(level.column + 1, indent))
            return
        gap = entry.inner
        if gap.comments or (gap.broken and self._stays_below(node)):
            self._before(gap, _Level(0, indent), first=True)
        else:
            self._out.write(" ")
        self._node(node, indent if beside and isinstance(node, Flow) else level.indent, path)

    def _stays_below(self, node: Node) -> bool:
        if isinstance(node, Lines):
            return True
        written = _on_one_line(node)
        return written is not None and self._out.width + 1 + len(written) > _WIDEST

    # Scalars and flow collections

    def _node(self, node: Node, base: int, path: _Path) -> None:
        """A scalar or flow collection; ``base`` is the column that lines behind the first are indented from."""
        match node:
            case str():
                self._out.write(normal(node) if names_connections(path) else node)
            case Row():
                self._out.write(_row(Row(tuple(map(normal, node.cells))) if names_connections(path) else node))
            case Lines():
                self._lines(node.lines, base + _STEP)
            case Block():
                self._out.write(node.header)
                self._out.behind(node.comment)
                for line in node.lines:
                    self._out.raw(" " * (base + _STEP) + line if line else "")
            case Flow():
                self._flow(node, base, path)

    def _lines(self, lines: tuple[str, ...], indent: int) -> None:
        self._out.write(lines[0])
        for line in lines[1:]:
            if line:
                self._out.begin(indent)
                self._out.write(line)
            else:
                self._out.blank()

    def _flow(self, node: Flow, base: int, path: _Path) -> None:
        out = self._out
        opening, closing = node.brackets
        out.write(opening)
        below = node.items[0].gap.broken if node.items else bool(node.end.comments)
        column = base + _STEP if below else out.width
        names = _names([item.key or "" for item in node.items], path)
        matrix = _matrix(node)
        for index, (item, name) in enumerate(zip(node.items, names, strict=True)):
            if index:
                out.write(",")
            if item.gap.broken:
                self._before(item.gap, _Level(0, column), first=index == 0)
            elif index:
                out.write(" ")
            self._item(item._replace(value=matrix[index]) if matrix else item, name, column, path)
        if below or node.end.comments:
            self._comments(node.end, _Level(0, column), first=False)
            out.begin(base if below else column - 1)
        out.write(closing)

    def _item(self, item: Item, name: str | Lines | Block, column: int, path: _Path) -> None:
        if item.key is None:
            self._node(item.value, column, path)
            return
        if item.announced or not isinstance(name, str) or len(name) > _LONGEST_KEY:
            self._out.write("? ")
        self._node(name, column, path)
        if item.value != "":
            self._out.write(": ")
            self._node(item.value, column, (*path, _bare(name)))
        elif item.colon:
            self._out.write(": ")


def _names(keys: list[str | Lines | Block], path: _Path) -> list[str | Lines | Block]:
    """The keys of a mapping as they are to be written."""
    texts = [key for key in keys if isinstance(key, str)]
    if is_connections(path) and len(texts) == len(keys):
        return list(normal_all(texts))
    return keys


def _bare(key: str | Lines | Block) -> str:
    return key.strip("'\"") if isinstance(key, str) else ""


def _matrix(node: Flow) -> list[str]:
    """The rows of a matrix in brackets, each on a line of its own; empty for anything else."""
    rows = [item.value for item in node.items if isinstance(item.value, Row) and item.key is None]
    if len(rows) != len(node.items) or len(rows) < 2 or not all(item.gap.broken for item in node.items[1:]):
        return []
    return aligned([row.cells for row in rows])


def _row(row: Row) -> str:
    return "[" + ", ".join(row.cells) + "]"


def _on_one_line(node: Node) -> str | None:
    """A node that takes one line, as it is written there; None for any other."""
    match node:
        case str():
            return node
        case Row():
            return _row(node)
        case Flow():
            parts = [_item_on_one_line(item) for item in node.items]
            whole = [part for part in parts if part is not None]
            if len(whole) < len(parts) or node.end.comments:
                return None
            return node.brackets[0] + ", ".join(whole) + node.brackets[1]
    return None


def _item_on_one_line(item: Item) -> str | None:
    value = _on_one_line(item.value)
    if item.gap.broken or value is None or isinstance(item.key, Lines):
        return None
    if item.key is None:
        return value
    return ("? " if item.announced else "") + item.key + (": " if item.colon else "") + value
