"""What ``neurovis validate --units`` prints: the unit of all that definitions name.

In: a compiled network. Out: a row for each name in the definitions of its spec and of the files that this includes, as
text or JSON.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from typing import TYPE_CHECKING, Literal, NamedTuple, TypeAlias

from neurovis_spec.cli.tables import table
from neurovis_spec.diagnostics import Diagnostic, printable

if TYPE_CHECKING:
    from neurovis_spec.compiled import CompiledNetwork

#: Whether a unit is declared, and made of ours; declared, and but a label; derived from formulas; or left open.
How: TypeAlias = Literal["declared", "label", "derived", "any"]


class UnitRow(NamedTuple):
    """A name in a definition, and its unit: "" where that may be any."""

    file: str
    kind: str
    definition: str
    part: str
    name: str
    unit: str
    how: How


def unit_rows(network: CompiledNetwork, file: str) -> Iterator[UnitRow]:
    """All names of all definitions, in their order."""
    from neurovis_spec.compiler.checks.units import Sheets

    own = (*(included.model for included in network.request.includes.files), network.spec)
    sheets = Sheets(own, network.network)
    for kind, name in sheets.shown:
        sheet = sheets.used(kind, name)
        for part, one in sheet.names:
            found, written = sheet.known.get(one), sheet.written.get(one, "")
            unit = written or ("" if found is None else sheet.told(found))
            how: How = "any" if not unit else "derived" if not written else "label" if found is None else "declared"
            yield UnitRow(file, kind.name, name, part, one, unit, how)


_TOLD: dict[How, str] = {"declared": "", "label": "as a label, not checked", "derived": "derived", "any": ""}


def shown_units(rows: Sequence[UnitRow]) -> str:
    """The same as text, a paragraph for each definition."""
    return "\n\n".join(
        f"{kind} {printable(name)}\n" + table([(row.part, row.name, row.unit or "any", _TOLD[row.how]) for row in some])
        for (kind, name), some in groupby(rows, key=lambda row: (row.kind, row.definition))
    )


def units_as_json(findings: Iterable[Diagnostic], rows: Iterable[UnitRow]) -> str:
    """An object with the findings, as ``--format json`` has them, and the rows; a unit that may be any is null."""
    from neurovis_spec.findings_formats import to_json

    units = [{**row._asdict(), "unit": row.unit or None} for row in rows]
    return json.dumps({"findings": json.loads(to_json(findings)), "units": units}, indent=2)
