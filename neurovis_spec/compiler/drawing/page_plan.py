"""The plan of the page: what stands in which row and column (``layout.plan``).

In: rows of names as written, who is called what, the boxes, mirrors and lines. Out: cells: the same name in
neighbouring cells is one cell that spans them. Mirror images stand in cells that are mirror images.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from neurovis_spec.compiler.drawing.drawing_settings import Cell, Mirror, Seat
from neurovis_spec.compiler.limits import plural
from neurovis_spec.compiler.names.references import Directory, home_of
from neurovis_spec.diagnostics import Findings, Span, Undeclared, shorten
from neurovis_spec.language.drawing import PlanRow
from neurovis_spec.language.located import Located
from neurovis_spec.likeness import suggest

Place = tuple[int, int]


@dataclass(frozen=True, slots=True)
class WrittenPlan:
    """A plan as written, of the instance whose path ``scope`` is or of the page; ``names`` are those of all neurons."""

    scope: str
    rows: tuple[PlanRow, ...]
    names: tuple[str, ...]

    def called(self, neuron: int) -> str:
        """What a neuron is called within the instance."""
        return self.names[neuron][len(self.scope) + 1 if self.scope else 0 :]

    def span(self, cell: Cell) -> Span:
        """Where a cell is written."""
        found = self.rows[cell.seat.row].cells[cell.seat.column]
        assert found is not None
        return found.span


def plan_of(
    plan: WrittenPlan, directory: Directory, boxes: Mapping[str, tuple[int, ...]], findings: Findings
) -> tuple[Cell, ...]:
    """The cells of a plan; none where a name in it is invalid."""
    rows, before = plan.rows, findings.errors
    for number, row in enumerate(rows[1:], 2):
        if len(row.cells) != len(rows[0].cells):
            message = f"row {number} has {plural(len(row.cells), 'cell')}, the first has {len(rows[0].cells)}"
            findings.error("wrong-size", row.span, message, "write ~ for an empty cell")
    places: dict[str, dict[Place, Located[str]]] = {}
    for r, row in enumerate(rows):
        for c, cell in enumerate(row.cells):
            if cell is not None:
                places.setdefault(cell.value.strip(), {})[r, c] = cell
    if rows and not places:
        findings.warning(
            "no-effect", rows[0].span, "this plan names nothing", "name an instance, a group or a box in it"
        )
    taken: dict[int, str] = {}
    cells: list[Cell] = []
    for name, at in places.items():
        first = next(iter(at.values()))
        members = _members(name, first, directory, boxes, findings)
        if not members:
            continue
        low, high = (min(r for r, _ in at), min(c for _, c in at)), (max(r for r, _ in at), max(c for _, c in at))
        size = high[0] - low[0] + 1, high[1] - low[1] + 1
        if len(at) != size[0] * size[1]:
            message = f"'{shorten(name)}' is in {len(at)} cells that are no rectangle"
            findings.error("plan-cells", list(at.values())[-1].span, message, "cells with one name are neighbours")
            continue
        other = next((taken[m] for m in members if m in taken), None)
        if other is not None:
            twice = next(m for m in members if m in taken)
            message = f"'{plan.called(twice)}' is in the cell '{shorten(other)}' already"
            findings.error("plan-cells", first.span, message, "a neuron stands in one cell")
            continue
        taken.update(dict.fromkeys(members, name))
        cells.append(Cell(plan.scope, tuple(sorted(members)), Seat(*low, *size, len(rows), len(rows[0].cells))))
    return tuple(cells) if findings.errors == before else ()


def _members(
    name: str, cell: Located[str], directory: Directory, boxes: Mapping[str, tuple[int, ...]], findings: Findings
) -> tuple[int, ...]:
    """The neurons of an instance, else of a group, else of a box."""
    inside = directory.instance(name)
    if inside:
        return tuple(index for one in inside for index in one.members)
    found = directory.find(name)
    if not directory.holds(name):
        found = boxes.get(name, found)
    if found is None:
        known = [*directory.instances, *directory.groups, *boxes]
        message = f"there is no instance, group or box '{shorten(name)}'"
        home = home_of(directory.module)
        lost = Undeclared(name, home._replace(parts=(*home.parts, "layout.boxes")))
        findings.error("unknown-cell", cell.span, message, lambda: suggest(name, known, "known here"), undeclared=lost)
    return found if isinstance(found, tuple) else ()


def check_plan(
    plan: WrittenPlan,
    cells: tuple[Cell, ...],
    mirrors: tuple[Mirror, ...],
    lines: tuple[tuple[int, ...], ...],
    direction: Literal["down", "up", "right", "left"],
    findings: Findings,
) -> None:
    """Mirror images that do not stand in mirrored cells, and lines from cell to cell, are findings."""
    if not cells:
        return
    where = {m: cell for cell in cells for m in cell.members}
    own = [mirror for mirror in mirrors if mirror.scope == plan.scope]
    image = {b: a for mirror in own for pair in mirror.pairs for a, b in (pair, pair[::-1])}
    told: set[tuple[Seat, Seat]] = set()
    for mirror in own:
        for a, b in mirror.pairs:
            one, other = where.get(a), where.get(b)
            if one is not None and other is not None:
                if (one.seat, other.seat) in told:
                    continue
                told.update(((one.seat, other.seat), (other.seat, one.seat)))
                if one.seat.image(direction) == other.seat:
                    if one is not other:
                        _check_images(plan, one, other, image, findings)
                    continue
            known = one or other
            if known is None:
                continue
            message = f"'{plan.called(a)}' and '{plan.called(b)}' are mirror images and do not stand in mirrored cells"
            hint = "as far to the left as to the right of the middle, in one row"
            if direction in ("left", "right"):
                hint = "as far above the middle as below it, in one column"
            findings.error("plan-mirror", plan.span(known), message, hint)
            break
    for line in lines:
        _check_line(plan, line, where, findings)


def _check_line(plan: WrittenPlan, line: tuple[int, ...], where: Mapping[int, Cell], findings: Findings) -> None:
    """A line from one cell to another, or out of one, is a finding."""
    held = {where[m] for m in line if m in where}
    if len(held) > 1 or (held and any(m not in where for m in line)):
        cell = min(held, key=lambda one: (one.seat.row, one.seat.column))
        first = next(m for m in line if where.get(m) is cell)
        odd = next(m for m in line if where.get(m) is not cell)
        message = f"'{plan.called(first)}' and '{plan.called(odd)}' are aligned and stand in different cells"
        findings.error("plan-align", plan.span(cell), message, "the plan says where cells are; align within one")


def _check_images(plan: WrittenPlan, one: Cell, other: Cell, image: Mapping[int, int], findings: Findings) -> None:
    """Two cells are mirror images as wholes: a neuron in one of them whose image is not in the other is a finding."""
    for cell, mate in ((one, other), (other, one)):
        odd = next((m for m in cell.members if image.get(m) not in mate.members), None)
        if odd is not None:
            message = f"'{plan.called(odd)}' has no mirror image in the cell that is the image of its own"
            hint = "mirror all that these cells hold, or nothing of it"
            findings.error("plan-mirror", plan.span(cell), message, hint)
            return
