"""Names that are listed one by one, in a spec or in a column of a table: of neurons, of instances.

In: what is written under ``names``. Out: the names; findings where one is none, is there twice, or there are not as
many as are counted.
"""

from __future__ import annotations

from typing import NamedTuple

from neurovis_spec.compiler.limits import PATIENCE, plural
from neurovis_spec.compiler.values.data_files import Files
from neurovis_spec.compiler.values.table_values import TableReader
from neurovis_spec.diagnostics import Findings, Span
from neurovis_spec.language.located import IDENTIFIER, Located, bad_name, name_hint
from neurovis_spec.language.tables import TableColumn
from neurovis_spec.language.unknown import UNKNOWN, Unknown
from neurovis_spec.language.yaml.source import Mapping


class ListedNames(NamedTuple):
    """Names as they are listed, the code of one that is there twice, and where a finding about all of them stands."""

    names: tuple[Located[str], ...]
    twice: str
    span: Span

    def checked(self, count: int | None, findings: Findings) -> tuple[str, ...] | Unknown:
        """The names, so many if a ``count`` says so; UNKNOWN where it is not known how many these are."""
        seen: dict[str, Located[str]] = {}
        before = findings.errors
        for item in self.names:
            if not IDENTIFIER.fullmatch(item.value):
                findings.error("bad-name", item.span, bad_name(item.value), name_hint(item.value))
            elif item.value in seen:
                line = seen[item.value].span.line
                findings.error(self.twice, item.span, f"'{item.value}' is named before (line {line})")
            seen[item.value] = item
            if findings.errors - before >= PATIENCE:
                break
        if findings.errors > before:  # how many they are is known
            return tuple(item.value for item in self.names)
        if not seen or (count is not None and count != len(seen)):
            wanted = "at least one is wanted" if count is None else f"'count' says {count}"
            findings.error("wrong-size", self.span, f"'names' has {plural(len(seen), 'name')}, {wanted}")
            return UNKNOWN
        return tuple(seen)


def listed_names(
    written: tuple[Located[str], ...] | TableColumn, source: Mapping, files: Files, twice: str
) -> ListedNames | Unknown:
    """The names that are written in the mapping ``source``; UNKNOWN where a table has others than names. ``twice`` is
    the code of one that is there twice."""
    if isinstance(written, TableColumn):
        names = _in_table(written, files, twice)
        return UNKNOWN if names is UNKNOWN else ListedNames(names, twice, written.columns[0].span)
    node = source.get("names")
    return ListedNames(written, twice, written[0].span if written else source.span if node is None else node.span)


def _in_table(wanted: TableColumn, files: Files, twice: str) -> tuple[Located[str], ...] | Unknown:
    """The names in a column of a table, each of which is a name, and none twice."""
    found = TableReader(files, UNKNOWN, "").all_texts(wanted)
    if found is UNKNOWN:
        return UNKNOWN
    (column,), findings, rows = wanted.columns, files.findings, dict[str, int]()
    before = findings.errors
    for name, row in found:
        if not IDENTIFIER.fullmatch(name):
            message = f"row {row} of the table: {bad_name(name)}"
            findings.error("bad-name", column.span, message, name_hint(name), key=row)
        elif rows.setdefault(name, row) != row:
            message = f"row {row} of the table: '{name}' is named before (row {rows[name]})"
            findings.error(twice, column.span, message, key=row)
        if findings.errors - before >= PATIENCE:
            break
    return UNKNOWN if findings.errors > before else tuple(Located(name, column.node) for name in rows)
