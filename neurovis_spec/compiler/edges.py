"""Edge lists: ``[from, to, weight, delay]`` rows, from the spec or from a file.

In: rows as written or a file, the neurons of both ends. Out: positions within the ends, weights and delays (−1 where
an edge names none), in the order written. Long plain lists go from the reader's packed arrays straight into arrays.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from neurovis_spec.compiler.constants import Constants, Randomness
from neurovis_spec.compiler.draws import Stream
from neurovis_spec.compiler.network import FloatArray, IntArray
from neurovis_spec.compiler.tables import Files
from neurovis_spec.diagnostics import Span, suggest
from neurovis_spec.language.located import formula_of
from neurovis_spec.language.source import NUMBER, TEXT, Node, Packed, Scalar, Sequence
from neurovis_spec.language.values import EdgeRows, FileReference


@dataclass(frozen=True)
class EdgeList:
    """Edges: positions within the ends, weights, delays (−1: the entry's)."""

    i: IntArray
    j: IntArray
    weights: FloatArray
    delays: IntArray


@dataclass(frozen=True)
class EdgeReader:
    """Reads the edges of one entry. ``sources`` and ``targets`` map the names that belong to its ends to positions."""

    sources: Mapping[str, int]
    targets: Mapping[str, int]
    constants: Constants
    files: Files
    stream: Stream

    def read(self, edges: EdgeRows | FileReference) -> EdgeList | None:
        """All edges; None where one is at fault."""
        if isinstance(edges, FileReference):
            return self._from_file(edges)
        if len(edges.node) == 0:
            self.constants.findings.error("wrong-size", edges.node.span, "there is no edge in this list")
            return None
        return self._packed(edges.node) or self._written(edges.node)

    def _packed(self, node: Sequence | Packed) -> EdgeList | None:
        """Rows ``from, to, number`` that are all in order; whatever else goes the way that explains it."""
        if not isinstance(node, Packed) or node.rows is None:
            return None
        starts = np.array(node.rows, dtype=np.int64)
        if not (np.diff(starts) == 3).all():
            return None
        kinds = np.array(node.kinds, dtype=np.int64).reshape(-1, 3)
        if not (kinds == (TEXT, TEXT, NUMBER)).all():
            return None
        numbers = np.array(node.numbers, dtype=np.float64).reshape(-1, 3)
        sources = np.array([self.sources.get(text, -1) for text in node.texts], dtype=np.int64)
        targets = np.array([self.targets.get(text, -1) for text in node.texts], dtype=np.int64)
        i, j = sources[numbers[:, 0].astype(np.int64)], targets[numbers[:, 1].astype(np.int64)]
        weights = np.ascontiguousarray(numbers[:, 2])
        if (i < 0).any() or (j < 0).any() or not np.isfinite(weights).all():
            return None
        return EdgeList(i, j, weights, np.full(len(i), -1, dtype=np.int64))

    def _written(self, node: Sequence | Packed) -> EdgeList | None:
        rows = [self._edge(row) for row in node.items]
        if any(row is None for row in rows):
            return None
        return _gathered([row for row in rows if row is not None])

    def _edge(self, row: Node) -> tuple[int, int, float, int] | None:
        findings = self.constants.findings
        if not isinstance(row, (Sequence, Packed)) or not 2 <= len(row) <= 4:
            findings.error(
                "wrong-type", row.span, "an edge is [from, to], [from, to, weight] or [from, to, weight, delay]"
            )
            return None
        items = row.items
        i = self._end(items[0], self.sources, "source")
        j = self._end(items[1], self.targets, "target")
        weight: float | None = 1.0
        if i is not None and j is not None and len(items) > 2:
            weight = self._weight(items[2], i, j)
        delay: int | None = -1
        if len(items) > 3:
            formula = formula_of(items[3], findings)
            delay = None if formula is None else self.constants.integer(formula, "a delay", 0)
        if i is None or j is None or weight is None or delay is None:
            return None
        return (i, j, weight, delay)

    def _weight(self, node: Node, i: int, j: int) -> float | None:
        formula = formula_of(node, self.constants.findings)
        if formula is None:
            return None
        value = self.constants.value(formula, {"i": float(i), "j": float(j)}, Randomness(self.stream, i, j))
        return None if value is None else float(value)

    def _end(self, node: Node, known: Mapping[str, int], what: str) -> int | None:
        findings = self.constants.findings
        if not isinstance(node, Scalar) or not isinstance(node.value, str):
            findings.error("wrong-type", node.span, f"the {what} of an edge is the name of a neuron")
            return None
        return self._lookup(node.value, node.span, known, what)

    def _lookup(self, name: str, span: Span, known: Mapping[str, int], what: str) -> int | None:
        position = known.get(name)
        if position is None:
            hint = suggest(name, known, f"{what}s of this entry")
            message = f"'{name}' is not among the {what}s of this entry"
            self.constants.findings.error("edge-outside", span, message, hint)
        return position

    def _from_file(self, reference: FileReference) -> EdgeList | None:
        table = self.files.edges(reference.path)
        if table is None:
            return None
        span = reference.path.span
        rows: list[tuple[int, int, float, int]] = []
        failed = False
        for source, target, weight, delay in zip(
            table.sources, table.targets, table.weights.tolist(), table.delays, strict=True
        ):
            i = self._lookup(source, span, self.sources, "source")
            j = self._lookup(target, span, self.targets, "target")
            if i is None or j is None:
                failed = True
                continue
            rows.append((i, j, weight, -1 if delay is None else delay))
        if failed:
            return None
        if not rows:
            self.constants.findings.error("wrong-size", span, "there is no edge in this file")
            return None
        return _gathered(rows)


def _gathered(rows: list[tuple[int, int, float, int]]) -> EdgeList:
    return EdgeList(
        np.array([row[0] for row in rows], dtype=np.int64),
        np.array([row[1] for row in rows], dtype=np.int64),
        np.array([row[2] for row in rows], dtype=np.float64),
        np.array([row[3] for row in rows], dtype=np.int64),
    )
