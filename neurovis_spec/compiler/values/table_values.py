"""Values from tables: a number, a text or a position for each neuron of a group, from columns of a file.

In: what is written of the file, its columns and its rows; the neurons' names. Out: one value a neuron, in their order,
or findings at the path, the column or the name by which rows are found.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final

import numpy as np

from neurovis_spec.arrays import BoolArray, FloatArray, IntArray
from neurovis_spec.compiler.limits import PATIENCE, plural
from neurovis_spec.compiler.names.references import few
from neurovis_spec.compiler.values.data_files import Files, OpenSheet
from neurovis_spec.diagnostics import Findings, shorten
from neurovis_spec.language.located import Located
from neurovis_spec.language.tables import TableColumn, number_of_default
from neurovis_spec.language.unknown import UNKNOWN, Unknown
from neurovis_spec.language.yaml.source import Scalar
from neurovis_spec.likeness import suggest

_IN_ORDER: Final = "by: COLUMN finds rows by the names of neurons, where: {COLUMN: VALUE} picks some"


@dataclass(frozen=True)
class TableReader:
    """Reads values of some neurons, whose names in their scope these are, behind the ``path`` of the scope; UNKNOWN
    where it is not known which neurons there are. ``ids`` are what tables call them, "" for nothing else, if any are
    called otherwise; UNKNOWN where that is invalid."""

    files: Files
    names: tuple[str, ...] | Unknown
    path: str
    ids: tuple[str, ...] | Unknown = ()

    @property
    def _findings(self) -> Findings:
        return self.files.findings

    def numbers(self, wanted: TableColumn) -> FloatArray | Unknown:
        """A number for each neuron."""
        default = None if wanted.default is None else number_of_default(wanted.default, self._findings)
        (column,) = wanted.columns
        return UNKNOWN if default is UNKNOWN else self._column(wanted, column, default)

    def positions(self, wanted: TableColumn) -> FloatArray | Unknown:
        """Some numbers for each neuron, one from each column."""
        found = [self._column(wanted, column, None) for column in wanted.columns]
        known = [one for one in found if one is not UNKNOWN]
        return np.stack(known, axis=1) if len(known) == len(found) else UNKNOWN

    def texts(self, wanted: TableColumn, *, gaps: bool = False) -> tuple[str, ...] | Unknown:
        """A text for each neuron; "" where a cell is empty, if there may be ``gaps``."""
        sheet = self.files.sheet(wanted.file, wanted.where)
        (column,) = wanted.columns
        texts = UNKNOWN if sheet is UNKNOWN else sheet.texts(column)
        rows = UNKNOWN if sheet is UNKNOWN else self._rows(wanted, sheet)
        if sheet is UNKNOWN or texts is UNKNOWN or rows is UNKNOWN:
            return UNKNOWN
        default = wanted.default.value if isinstance(wanted.default, Scalar) else None
        found = [texts[row] if row >= 0 else "" for row in rows.tolist()]
        empty = np.array([not text for text in found], dtype=np.bool_)
        if default is None and not gaps and self._report_empty(sheet, column, rows, empty):
            return UNKNOWN
        return tuple(text or str(default or "") for text in found)

    def all_texts(self, wanted: TableColumn) -> tuple[tuple[str, int], ...] | Unknown:
        """The texts of all rows that count, none of which is empty, and which rows of the file these are."""
        sheet = self.files.sheet(wanted.file, wanted.where)
        (column,) = wanted.columns
        texts = UNKNOWN if sheet is UNKNOWN else sheet.texts(column)
        if sheet is UNKNOWN or texts is UNKNOWN:
            return UNKNOWN
        empty = np.array([not text for text in texts], dtype=np.bool_)
        if self._report_empty(sheet, column, np.arange(len(texts)), empty):
            return UNKNOWN
        return tuple((text, sheet.sheet.where(row)) for row, text in enumerate(texts))

    def _column(self, wanted: TableColumn, column: Located[str], default: float | None) -> FloatArray | Unknown:
        sheet = self.files.sheet(wanted.file, wanted.where)
        numbers = UNKNOWN if sheet is UNKNOWN else sheet.numbers(column)
        rows = UNKNOWN if sheet is UNKNOWN else self._rows(wanted, sheet)
        if sheet is UNKNOWN or numbers is UNKNOWN or rows is UNKNOWN:
            return UNKNOWN
        values = np.full(len(rows), np.nan)
        values[rows >= 0] = numbers[rows[rows >= 0]]
        empty = np.isnan(values)
        if default is None and self._report_empty(sheet, column, rows, empty):
            return UNKNOWN
        return np.where(empty, np.nan if default is None else default, values)

    def _report_empty(self, sheet: OpenSheet, column: Located[str], rows: IntArray, empty: BoolArray) -> bool:
        """Report the neurons whose cells are empty; whether there are any."""
        places = np.flatnonzero(empty)
        for place in places[:PATIENCE].tolist():
            row, at = sheet.sheet.where(int(rows[place])), sheet.sheet.header.index(column.value) + 1
            hint = "fill it in, or write a 'default' beside the column"
            self._findings.error(
                "file-format", column.span, f"row {row}, column {at} of the table is empty", hint, key=row
            )
        return bool(len(places))

    def _rows(self, wanted: TableColumn, sheet: OpenSheet) -> IntArray | Unknown:
        """The row of each neuron, −1 where there is none and a default takes its place."""
        if self.names is UNKNOWN:
            return UNKNOWN
        if wanted.by is not None:
            called = sheet.texts(wanted.by)
            return UNKNOWN if called is UNKNOWN else self._rows_by_name(wanted, wanted.by, sheet, called, self.names)
        count, there = len(self.names), len(sheet.sheet)
        if there != count:
            counted = "rows that count" if wanted.where else "rows"
            are = "is" if count == 1 else "are"
            message = f"the table has {there:,} {counted}, and there {are} {plural(count, 'neuron')}"
            self._findings.error("wrong-size", wanted.file.path.span, message, _IN_ORDER, key=count)
            return UNKNOWN
        return np.arange(count, dtype=np.int64)

    def _rows_by_name(
        self, wanted: TableColumn, by: Located[str], sheet: OpenSheet, called: Sequence[str], names: tuple[str, ...]
    ) -> IntArray | Unknown:
        """The rows that name the neurons: as they are called in the network, else as they are in their scope."""
        findings, before = self._findings, self._findings.errors
        row_of: dict[str, int] = {}
        twice: dict[str, int] = {}
        for row, name in enumerate(called):
            if row_of.setdefault(name, row) != row:
                twice.setdefault(name, row)
        rows = np.full(len(names), -1, dtype=np.int64)
        for neuron, name in enumerate(names):
            own = self.path + name if self.path + name in row_of else name
            if own not in row_of:
                if self.ids is UNKNOWN:
                    return UNKNOWN
                own = (self.ids[neuron] if self.ids else "") or own
            rows[neuron] = row_of.get(own, -1)
            if own in twice:
                pair = f"rows {sheet.sheet.where(row_of[own])} and {sheet.sheet.where(twice[own])}"
                findings.error("file-format", by.span, f"{pair} of the table are both of '{shorten(own)}'", key=own)
            elif rows[neuron] < 0 and wanted.default is None:
                message = f"no row of the table is of '{shorten(self.path + name)}'"
                hint = partial(suggest, name, few(name, called), "there are")
                findings.error("file-format", by.span, message, hint, key=name)
            if findings.errors - before >= PATIENCE:
                break
        return UNKNOWN if findings.errors > before else rows
