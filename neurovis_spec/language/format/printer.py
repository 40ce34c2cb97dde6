"""From the values of a spec and its text to its canonical text.

In: the root, whose values know where they stand, and the text, with LF line ends. Out: a text; each scalar is as it is
written, quotes and all. Blocks are indented by two blanks, lists below their key as well; line breaks inside brackets
stay where the author has them, and what follows one is indented by two, or stands below the first item where that
follows its bracket on the same line. A comment on a line of its own belongs to the block in whose column, or behind it,
it begins. References to connections have single blanks: ``K1+K3->O`` becomes ``K1 + K3 -> O``.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from typing import Final, NamedTuple, TypeAlias

from neurovis_spec.language.format.gaps import NONE, Comment, Gap, joined, read_gap
from neurovis_spec.language.format.lines import Block, Lines, LineWriter, aligned, read_block, read_lines
from neurovis_spec.language.places import Path, role_of
from neurovis_spec.language.references import Arrow, parse
from neurovis_spec.language.yaml.characters import Lines as Places
from neurovis_spec.language.yaml.source import AnyList, Mapping, Node, Packed, Scalar

_STEP: Final = 2
_WIDEST: Final = 120  # a value that the author has put below its key comes up beside it if the line is no longer
_LONGEST_KEY: Final = 1000  # a longer one has to be announced by a question mark
_COLON: Final = re.compile(r"(?:[ \t\n]+|#[^\n]*)*:")
_DASH: Final = re.compile(r"(?:[ \t\n]+|#[^\n]*)*-")
_START: Final = re.compile(r"(?<![^\n])---(?=[ \t\n])")

#: A scalar as it is written: on one line, over several, or behind | or >.
_Written: TypeAlias = str | Lines | Block

_NAMES: Final = re.compile(r"[A-Za-z0-9_.]+")


class _Level(NamedTuple):
    """A block: the column in which it stood, and that in which it is written."""

    column: int
    indent: int


class Item(NamedTuple):
    """An item of a list in brackets, where ``key`` is None, or an entry of a mapping in braces, or the single pair in
    ``[a: 1]``. ``gap`` is what stands before it; ``colon`` says whether there is one."""

    gap: Gap
    key: Scalar | None
    colon: bool
    value: Node

    @property
    def empty(self) -> bool:
        """Whether the value is left out."""
        return is_empty(self.value)


class Flow(NamedTuple):
    """A list or a mapping in brackets; ``end`` is what stands before the closing one."""

    brackets: str
    items: tuple[Item, ...]
    end: Gap


def is_empty(node: Node) -> bool:
    """Whether a value is left out."""
    return isinstance(node, Scalar) and node.span[1:3] == node.span[3:]


class Source:
    """A text, and where the values in it stand."""

    def __init__(self, text: str) -> None:
        self.text = text
        self._starts = Places(text).starts

    def begin(self, node: Node) -> int:
        """The index of a value's first character."""
        return self._starts[node.span.line - 1] + node.span.column - 1

    def end(self, node: Node) -> int:
        """The index behind a value's last character."""
        return self._starts[node.span.end_line - 1] + node.span.end_column - 1

    def is_block(self, node: Node) -> bool:
        """Whether a collection is written without brackets."""
        return not isinstance(node, Scalar) and self.text[self.begin(node)] not in "[{"

    def written(self, node: Node) -> str:
        """The text of a value as the author wrote it."""
        return self.text[self.begin(node) : self.end(node)]

    def colon(self, key: Scalar) -> int | None:
        """The index behind the colon of a key, None where there is none."""
        match = _COLON.match(self.text, self.end(key))
        return None if match is None else match.end()

    def flow(self, node: Mapping | AnyList) -> Flow:
        """What stands between two brackets."""
        begin, stop = self.begin(node), self.end(node) - 1
        broken = self.text.find("\n", begin, stop) >= 0
        items: list[Item] = []
        at = begin + 1
        if isinstance(node, Mapping):
            for entry in node.entries:
                item = self._pair(entry.key, entry.value, at)
                items.append(item)
                at = self.end(item.key if item.empty and not item.colon and item.key else item.value)
        else:
            for value in node.items:
                item = Item(read_gap(self.text, at, self.begin(value)) if broken else NONE, None, False, value)
                if isinstance(value, Mapping) and self.is_block(value):
                    item = self._pair(value.entries[0].key, value.entries[0].value, at)
                items.append(item)
                at = self.end(value)
        return Flow(self.text[begin] + self.text[stop], tuple(items), read_gap(self.text, at, stop))

    def _pair(self, key: Scalar, value: Node, at: int) -> Item:
        gap = read_gap(self.text, at, self.begin(key))
        behind, begin = self.end(key), self.begin(value)
        if begin == behind:
            return Item(gap, key, False, value)
        return Item(joined(gap, read_gap(self.text, behind, begin)), key, True, value)

    def row(self, node: Node) -> list[str] | None:
        """The cells of a list of scalars in brackets that takes one line; None for anything else."""
        if not isinstance(node, AnyList) or self.is_block(node) or (isinstance(node, Packed) and node.rows):
            return None
        flow = self.flow(node)
        cells = [self.written(item.value) for item in flow.items if isinstance(item.value, Scalar)]
        simple = len(cells) == len(flow.items) and not any(item.gap.broken or item.key for item in flow.items)
        return cells if simple and not flow.end.comments and not any("\n" in cell for cell in cells) else None

    def matrix(self, nodes: Collection[Node]) -> list[str]:
        """The rows of a matrix, cell under cell; empty for anything else."""
        rows = [row for node in nodes if (row := self.row(node)) is not None]
        return aligned(rows) if len(rows) == len(nodes) > 1 else []


def print_document(root: Node, text: str) -> str:
    """The canonical text."""
    return _Printer(Source(text)).document(root)


class _Printer:
    def __init__(self, source: Source) -> None:
        self._source = source
        self._text = source.text
        self._at = 0  # behind what is printed already
        self._out = LineWriter()
        self._ended: list[_Level] = []  # the blocks that end where the pen is, innermost first

    def document(self, root: Node) -> str:
        top = _Level(0, 0)
        start = _START.search(self._text, 0, self._source.begin(root))
        if start is not None:
            self._before(read_gap(self._text, 0, start.start(), prologue=True), top, first=True)
            self._out.write("---")
            self._at = start.end()
        if self._source.is_block(root):
            self._block(root, 0, (), beside=False)
        else:
            self._before(self._gap(self._source.begin(root)), top, first=True)
            self._node(root, 0, 0, ())
        self._comments(self._gap(len(self._text)), top, first=False)
        return self._out.text()

    # What stands before a value

    def _gap(self, stop: int) -> Gap:
        """What stands before an index, which is passed."""
        start, self._at = self._at, stop
        return read_gap(self._text, start, stop)

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

    def _block(self, node: Node, indent: int, path: Path, *, beside: bool) -> None:
        """A block; ``beside``: its first line may go on behind a dash."""
        level = _Level(node.span.column - 1, indent)
        if isinstance(node, Mapping):
            self._mapping(node, level, path, beside=beside)
        elif isinstance(node, AnyList):
            self._listing(node, level, path, beside=beside)
        self._ended.append(level)

    def _begin_entry(self, gap: Gap, level: _Level, *, first: bool, beside: bool) -> None:
        if first and beside and not gap.comments:
            self._out.write(" ")
        else:
            self._before(gap, level, first=first)

    def _mapping(self, node: Mapping, level: _Level, path: Path, *, beside: bool) -> None:
        names = self._names([entry.key for entry in node.entries], path)
        for index, (entry, name) in enumerate(zip(node.entries, names, strict=True)):
            gap = self._gap(self._source.begin(entry.key))
            self._at = self._source.end(entry.key)
            colon = self._source.colon(entry.key)
            if colon is not None:
                gap = joined(gap, self._gap(colon))
            self._begin_entry(gap, level, first=index == 0, beside=beside)
            if isinstance(name, str) and len(name) <= _LONGEST_KEY:
                self._out.write(name + ":")
            else:
                self._out.write("? ")
                self._scalar(name, level.indent)
                self._out.begin(level.indent)
                self._out.write(":")
            self._value(entry.value, None, level, (*path, _bare(name)), beside=False)

    def _listing(self, node: AnyList, level: _Level, path: Path, *, beside: bool) -> None:
        items = node.items
        matrix = self._source.matrix(items)
        for index, item in enumerate(items):
            dash = _DASH.match(self._text, self._at)
            assert dash is not None
            self._begin_entry(self._gap(dash.end()), level, first=index == 0, beside=beside)
            self._out.write("-")
            self._value(item, matrix[index] if matrix else None, level, (*path, 0), beside=True)

    def _value(self, node: Node, row: str | None, level: _Level, path: Path, *, beside: bool) -> None:
        """What stands behind a colon or a dash; ``row``: as it is written in a matrix."""
        indent = level.indent + _STEP
        if self._source.is_block(node):
            self._block(node, indent, path, beside=beside)
            return
        if is_empty(node):  # a comment below that is indented further speaks of what is left out here
            self._ended.append(_Level(level.column + 1, indent))
            return
        gap = self._gap(self._source.begin(node))
        if gap.comments or (gap.broken and self._stays_below(node)):
            self._before(gap, _Level(0, indent), first=True)
        else:
            self._out.write(" ")
        if row is not None:
            self._out.write(row)
            self._at = self._source.end(node)
        else:
            self._node(node, indent if beside and not isinstance(node, Scalar) else level.indent, level.column, path)

    def _stays_below(self, node: Node) -> bool:
        written = self._on_one_line(node)
        if written is None:
            return isinstance(node, Scalar) and self._text[self._source.begin(node)] not in "|>"
        return self._out.width + 1 + len(written) > _WIDEST

    # Scalars and collections in brackets

    def _node(self, node: Node, base: int, column: int, path: Path) -> None:
        """A scalar, or a collection in brackets, in a block that stood in ``column``; ``base`` is the column that lines
        behind the first are indented from."""
        end = self._source.end(node)
        if isinstance(node, Scalar):
            written = self._read(node, column)
            if isinstance(written, str) and names_connections(path, False):
                written = normal(written)
            self._scalar(written, base)
            end = written.end if isinstance(written, Block) else end
        elif (row := self._source.row(node)) is not None:
            self._out.write(_row(list(map(normal, row)) if names_connections((*path, 0), False) else row))
        else:
            self._flow(self._source.flow(node), base, path)
        self._at = end

    def _read(self, node: Scalar, column: int = 0) -> _Written:
        written = self._source.written(node)
        if written[:1] in ("|", ">"):
            return read_block(self._text, self._source.begin(node), self._source.end(node), column)
        return read_lines(written) if "\n" in written else written

    def _scalar(self, written: _Written, base: int) -> None:
        match written:
            case str():
                self._out.write(written)
            case Lines():
                self._lines(written.lines, base + _STEP)
            case Block():
                self._out.write(written.header)
                self._out.behind(written.comment)
                for line in written.lines:
                    self._out.raw(" " * (base + _STEP) + line if line else "")

    def _lines(self, lines: tuple[str, ...], indent: int) -> None:
        self._out.write(lines[0])
        for line in lines[1:]:
            if line:
                self._out.begin(indent)
                self._out.write(line)
            else:
                self._out.blank()

    def _flow(self, flow: Flow, base: int, path: Path) -> None:
        out = self._out
        opening, closing = flow.brackets[0], flow.brackets[1]
        out.write(opening)
        below = flow.items[0].gap.broken if flow.items else bool(flow.end.comments)
        column = base + _STEP if below else out.width
        keys = [item.key for item in flow.items if item.key is not None]
        inner = (*path, 0) if opening == "[" else path
        names = iter(self._names(keys, inner))
        matrix = self._matrix(flow)
        for index, item in enumerate(flow.items):
            if index:
                out.write(",")
            if item.gap.broken:
                self._before(item.gap, _Level(0, column), first=index == 0)
            elif index:
                out.write(" ")
            if matrix:
                out.write(matrix[index])
            else:
                lone = opening == "[" and not item.colon
                self._item(item, next(names) if item.key is not None else None, column, inner, announced=lone)
        if below or flow.end.comments:
            self._comments(flow.end, _Level(0, column), first=False)
            out.begin(base if below else column - 1)
        out.write(closing)

    def _item(self, item: Item, name: _Written | None, column: int, path: Path, *, announced: bool) -> None:
        """An item; ``announced`` by a question mark is a key without a colon that stands in a list."""
        if name is None:
            self._node(item.value, column, 0, path)
            return
        if not isinstance(name, str) or len(name) > _LONGEST_KEY or announced:
            self._out.write("? ")
        self._scalar(name, column)
        if item.colon:
            self._out.write(": ")
        if not item.empty:
            self._node(item.value, column, 0, (*path, _bare(name)))

    def _names(self, keys: list[Scalar], path: Path) -> list[_Written]:
        """The keys of a mapping as they are to be written."""
        written = [self._read(key) for key in keys]
        texts = [key for key in written if isinstance(key, str)]
        if texts and len(texts) == len(keys) and names_connections((*path, _bare(texts[0])), True):
            return list(normal_all(texts))
        return written

    def _matrix(self, flow: Flow) -> list[str]:
        """The rows of a matrix in brackets, each on a line of its own; empty for anything else."""
        if any(item.key is not None for item in flow.items) or not all(item.gap.broken for item in flow.items[1:]):
            return []
        return self._source.matrix([item.value for item in flow.items])

    def _on_one_line(self, node: Node) -> str | None:
        """A node that takes one line, as it is written there; None for any other."""
        if isinstance(node, Scalar):
            written = self._read(node)
            return written if isinstance(written, str) else None
        flow = self._source.flow(node)
        parts = [self._item_on_one_line(item, flow.brackets[0]) for item in flow.items]
        whole = [part for part in parts if part is not None]
        if len(whole) < len(parts) or flow.end.comments:
            return None
        return flow.brackets[0] + ", ".join(whole) + flow.brackets[1]

    def _item_on_one_line(self, item: Item, opening: str) -> str | None:
        value = "" if item.empty else self._on_one_line(item.value)
        if item.gap.broken or value is None:
            return None
        if item.key is None:
            return value
        key = self._on_one_line(item.key)
        announced = "? " if opening == "[" and not item.colon else ""
        return None if key is None else announced + key + (": " if item.colon else "") + value


def _bare(key: _Written | None) -> str:
    return key.strip("'\"") if isinstance(key, str) else ""


def _row(cells: list[str]) -> str:
    return "[" + ", ".join(cells) + "]"


def names_connections(path: Path, is_key: bool) -> bool:
    """Whether the text at a path, a key or a value, may name connections."""
    role = role_of(path, is_key)
    return role is not None and role.use == "ends"


def normal(key: str) -> str:
    """A connection's name, quoted or not, with single blanks; anything else as it is.

    >>> normal("K1+K3..K5->O"), normal('"A->B"'), normal("a ->")
    ('K1 + K3..K5 -> O', '"A -> B"', 'a ->')
    """
    quote = key[:1] if key[:1] in ("'", '"') else ""
    bare = key[1:-1] if quote else key
    found = parse(bare)
    ends = (*found.sources.parts, *found.targets.parts) if isinstance(found, Arrow) else ()
    return quote + found.normal + quote if ends and all(_NAMES.fullmatch(part.text) for part in ends) else key


def normal_all(keys: Sequence[str]) -> list[str]:
    """The same for all keys of a mapping; none is changed where two would become the same."""
    changed = [normal(key) for key in keys]
    return changed if len({key.strip("'\"") for key in changed}) == len(keys) else list(keys)
