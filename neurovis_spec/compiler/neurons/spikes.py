"""Spikes at given times, from a table or from lists in the spec.

In: the ``spikes`` of an input. Out: the input with Spikes; findings at the times, or at the cells of the file, that are
none.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from fractions import Fraction

import numpy as np

from neurovis_spec.arrays import BoolArray, FloatArray, IntArray, frozen
from neurovis_spec.compiler.limits import PATIENCE, plural
from neurovis_spec.compiler.network import Input, Spikes
from neurovis_spec.compiler.values.cells import Cells, cells_of, values_of
from neurovis_spec.compiler.values.constants import Constants
from neurovis_spec.compiler.values.data_files import Files, OpenSheet
from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.data.cells import is_number
from neurovis_spec.language.data.columns import no_column
from neurovis_spec.language.data.table import MOST_CELLS
from neurovis_spec.language.located import Located
from neurovis_spec.language.sections import InputModel, SpikesModel
from neurovis_spec.language.tables import FileReference
from neurovis_spec.language.units import TIMES
from neurovis_spec.language.unknown import UNKNOWN, Unknown
from neurovis_spec.language.yaml.source import AnyList

_NEGATIVE = "a spike is at 0 or later, this is at {:.15g}"


def by_spikes(
    bare: Input, sized: Input | Unknown, model: InputModel, spikes: SpikesModel, constants: Constants, files: Files
) -> Input | Unknown:
    """The input with its spikes: that of its size, for a file, or ``bare``, which has a number for each list."""
    findings = constants.findings
    unit = None if "time" in spikes.unknown else "s" if spikes.time is None else spikes.time.value
    if spikes.table is not None:
        if model.size is None and "size" not in model.unknown:
            message = "how many numbers the input has, no file of spikes says, as some may have none"
            findings.error("missing-key", spikes.table.span, message, "write size: N beside 'spikes'")
            sized = UNKNOWN
        found = _from_file(spikes.table, spikes, sized, files)
        size = UNKNOWN if sized is UNKNOWN else sized.size
    elif spikes.times is not None:
        found, size = _from_lists(spikes.times, constants), len(spikes.times)
        if model.size is not None and sized is not UNKNOWN and sized.size != size:
            message = f"{plural(size, 'list')} of times for {plural(sized.size, 'number')}"
            findings.error("wrong-size", spikes.times.span, message, "remove 'size', or give a list for each")
            return UNKNOWN
    else:
        if spikes.unknown.isdisjoint(("file", "csv", "times")):
            hint = "write {file: PATH} or {times: [[0.1, 0.2], []]}"
            findings.error("missing-key", spikes.source.span, "'spikes' needs a 'file' or 'times'", hint)
        return UNKNOWN
    if found is UNKNOWN or size is UNKNOWN or unit is None or spikes.contradictory:
        return UNKNOWN
    return replace(bare, size=size, spikes=_sorted(_in_seconds(found[0], TIMES[unit]), found[1]))


def _in_seconds(times: FloatArray, factor: Fraction) -> FloatArray:
    """Times in seconds, each rounded once."""
    return times * factor.numerator if factor >= 1 else times / factor.denominator


def _sorted(times: FloatArray, indices: IntArray) -> Spikes:
    order = np.lexsort((indices, times))
    return Spikes(frozen(times[order]), frozen(indices[order]))


def _from_lists(node: AnyList, constants: Constants) -> tuple[FloatArray, IntArray] | Unknown:
    """The times in lists, and of which list each is."""
    findings = constants.findings
    if not len(node):
        findings.error("wrong-size", node.span, "an input needs at least one list of times, which may be empty")
        return UNKNOWN
    cells = cells_of(node, findings, "expected a list of times, as in [0.1, 0.2]", gaps=False)
    if cells is UNKNOWN:
        return UNKNOWN
    with constants.following() as parts:
        times = values_of(cells, np.arange(len(cells.kinds)), constants)
    constants.depend_on(parts)  # when spikes come cannot change in a run
    if times is UNKNOWN or cells.failed or _negative_in_lists(cells, times, findings):
        return UNKNOWN
    return times, cells.rows()


def _negative_in_lists(cells: Cells, times: FloatArray, findings: Findings) -> bool:
    wrong = np.flatnonzero(times < 0).tolist()
    for cell in wrong[:PATIENCE]:
        findings.error("out-of-range", cells.node(cell).span, _NEGATIVE.format(times[cell]))
    return bool(wrong)


def _from_file(
    file: FileReference, spikes: SpikesModel, sized: Input | Unknown, files: Files
) -> tuple[FloatArray, IntArray] | Unknown:
    """The times of a table, and of which number of the input each is."""
    sheet, findings, path = files.sheet(file, most=MOST_CELLS), files.findings, file.path
    if sheet is UNKNOWN or not _has_header(sheet.sheet.header, path, findings):
        return UNKNOWN
    columns = spikes.columns
    names = [(key, None if columns is None else getattr(columns, key)) for key in ("time", "index")]
    read = [_column(sheet, path, key, written) for key, written in names]
    found = [one for one in read if one is not UNKNOWN]
    if len(found) < len(read) or (columns is not None and columns.unknown) or "columns" in spikes.unknown:
        return UNKNOWN
    (time, times), (index, indices) = found
    within = np.inf if sized is UNKNOWN else sized.size

    def is_index(value: float) -> str:
        if not value.is_integer() or value < 0:
            return f"numbers of the input are counted 0, 1, 2, …, this is {value:.15g}"
        return f"the input has {plural(int(within), 'number')}, counted from 0; this is {value:.15g}"

    checks: tuple[tuple[int, BoolArray, Callable[[float], str], FloatArray], ...] = (
        (time, times < 0, _NEGATIVE.format, times),
        (index, (indices < 0) | (indices != np.floor(indices)) | (indices >= within), is_index, indices),
    )
    for column, wrong, told, values in checks:
        for place in np.flatnonzero(wrong)[:PATIENCE].tolist():
            row = sheet.sheet.where(place)
            message = f"row {row}, column {column} of the file: {told(float(values[place]))}"
            findings.error("out-of-range", path.span, message, key=(row, column))
    if any(wrong.any() for _, wrong, _, _ in checks):
        return UNKNOWN
    return times, indices.astype(np.int64)


def _has_header(header: Sequence[str], path: Located[str], findings: Findings) -> bool:
    """Whether the columns of a table have names; a finding where its first row is one of numbers."""
    if not all(map(is_number, header)):
        return True
    message = "the first row of a file of spikes names its columns: time,index"
    findings.error("file-format", path.span, message)
    return False


def _column(
    sheet: OpenSheet, path: Located[str], key: str, written: Located[str] | None
) -> tuple[int, FloatArray] | Unknown:
    """Where the column of the times, or of the indices, stands in a table, from 1, and its numbers."""
    header, findings = sheet.sheet.header, sheet.findings
    wanted = key if written is None else written.value
    if wanted not in header:
        error = no_column(header, wanted, path if written is None else written)
        findings.error(error.code, path.span if error.span is None else error.span, str(error), error.hint)
        return UNKNOWN
    values = sheet.numbers(Located(wanted, path.node), gaps=False)
    if values is UNKNOWN:
        return UNKNOWN
    column, empty = header.index(wanted) + 1, np.flatnonzero(np.isnan(values))
    for place in empty[:PATIENCE].tolist():
        row = sheet.sheet.where(place)
        message = f"row {row}, column {column} of the file is empty; a spike needs a number everywhere"
        findings.error("file-format", path.span, message, key=(row, column))
    return UNKNOWN if len(empty) else (column, values)
