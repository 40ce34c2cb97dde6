"""Named arrays: tables of numbers whose rows and columns have names.

In: numbers, what their rows and columns are. Out: a frozen value that answers by names, and that NumPy takes as an
array; the same as a file: CSV for spreadsheets, JSON for programs. Numbers are written so that they read back exactly;
what is no number is empty in CSV and null in JSON.
"""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray, frozen
from neurovis_spec.likeness import suggest
from neurovis_spec.runtime.errors import UnknownNameError


class Axis(NamedTuple):
    """What rows or columns are, in a word, and their names."""

    name: str
    labels: tuple[str, ...]


@dataclass(frozen=True, eq=False, repr=False)
class NamedArray:
    """A table (rows, columns) of numbers: ``table["K2", "K3"]`` is one of them, ``table["K2"]`` a row by the names of
    the columns. ``unit`` is that of all numbers ('' for none, or where columns differ), ``name`` what they are."""

    name: str
    values: FloatArray
    rows: Axis
    columns: Axis
    unit: str = ""

    def __post_init__(self) -> None:
        shape = len(self.rows.labels), len(self.columns.labels)
        object.__setattr__(self, "values", np.asarray(self.values, dtype=np.float64).reshape(shape))
        frozen(self.values)

    def __array__(self, dtype: npt.DTypeLike | None = None, copy: bool | None = None) -> npt.NDArray[np.generic]:
        return np.array(self.values, dtype=dtype)

    def __repr__(self) -> str:
        rows, columns = (f"{len(axis.labels)} {axis.name}" for axis in (self.rows, self.columns))
        return f"<{self.name}: {rows} × {columns}{f', {self.unit}' if self.unit else ''}>"

    def __getitem__(self, names: tuple[str, str]) -> float:
        """The number of a row and a column. Raises KeyError with the nearest names."""
        row, column = (_place(axis, name) for axis, name in zip((self._row, self._column), names, strict=True))
        return float(self.values[row, column])

    def row(self, name: str) -> dict[str, float]:
        """The numbers of a row by the names of the columns. Raises KeyError."""
        return dict(zip(self.columns.labels, self.values[_place(self._row, name)].tolist(), strict=True))

    def column(self, name: str) -> FloatArray:
        """The numbers of a column, one a row. Raises KeyError."""
        return self.values[:, _place(self._column, name)]

    @cached_property
    def _row(self) -> Mapping[str, int]:
        return {label: place for place, label in enumerate(self.rows.labels)}

    @cached_property
    def _column(self) -> Mapping[str, int]:
        return {label: place for place, label in enumerate(self.columns.labels)}


def _place(known: Mapping[str, int], name: str) -> int:
    if name not in known:
        hint = suggest(name, known, "there are")
        raise UnknownNameError(f"there is no '{name}' in the table" + (f"; {hint}" if hint else ""))
    return known[name]


def csv_of(table: NamedArray) -> str:
    """A line with the names of the columns, then one for each row, which begins with its name."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([table.rows.name, *table.columns.labels])
    for label, row in zip(table.rows.labels, table.values.tolist(), strict=True):
        writer.writerow([label, *("" if math.isnan(value) else _written(value) for value in row)])
    return text.getvalue()


def _written(value: float) -> str:
    return str(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)


def plain_of(table: NamedArray) -> dict[str, object]:
    """``name``, ``unit``, ``rows`` and ``columns`` ({name, labels}), ``values`` row by row; None for no number."""
    return {
        "name": table.name,
        "unit": table.unit,
        "rows": {"name": table.rows.name, "labels": table.rows.labels},
        "columns": {"name": table.columns.name, "labels": table.columns.labels},
        "values": [[value if math.isfinite(value) else None for value in row] for row in table.values.tolist()],
    }


def json_of(table: NamedArray) -> str:
    """That as an object, in a line."""
    return json.dumps(plain_of(table), ensure_ascii=False, allow_nan=False) + "\n"
