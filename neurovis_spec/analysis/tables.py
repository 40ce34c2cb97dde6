"""Tables as files: CSV for spreadsheets, JSON for programs.

In: a NamedArray. Out: texts. Numbers are written so that they read back exactly; what is no number is empty in CSV and
null in JSON.
"""

from __future__ import annotations

import csv
import io
import json
import math

from neurovis_spec.analysis.named import NamedArray


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


def json_of(table: NamedArray) -> str:
    """An object: ``name``, ``unit``, ``rows`` and ``columns`` ({name, labels}), ``values`` row by row."""
    content = {
        "name": table.name,
        "unit": table.unit,
        "rows": {"name": table.rows.name, "labels": table.rows.labels},
        "columns": {"name": table.columns.name, "labels": table.columns.labels},
        "values": [[value if math.isfinite(value) else None for value in row] for row in table.values.tolist()],
    }
    return json.dumps(content, ensure_ascii=False, allow_nan=False) + "\n"
