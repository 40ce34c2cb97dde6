"""Data files of a spec: where they may lie, and that each is read once.

In: the folder of the spec and the root that no path may leave. Out: tables of numbers and lists of edges.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.data_files import EdgeTable, Table, read_edges, read_table
from neurovis_spec.language.located import Located
from neurovis_spec.language.values import FileReference


@dataclass
class Files:
    """The data files that a spec names. What is at fault in one is noted once, where it is named first."""

    base: Path
    root: Path
    findings: Findings
    _tables: dict[tuple[str, str | None, bool], Table | None] = field(default_factory=dict)
    _edges: dict[tuple[str, str | None], EdgeTable | None] = field(default_factory=dict)

    def table(self, reference: FileReference) -> Table | None:
        """The numbers of a file, and where it has none; None where it is at fault."""
        return self._table(reference.path, reference.key, keyed=True)

    def table_at(self, path: Located[str]) -> Table | None:
        """The same of a path alone, beside which no ``key`` can stand."""
        return self._table(path, None, keyed=False)

    def edges(self, reference: FileReference) -> EdgeTable | None:
        """The edges of a ``.csv`` file; None where it is at fault."""
        path, key = reference.path, reference.key
        known = (path.value, None if key is None else key.value)
        if known not in self._edges:
            self._edges[known] = read_edges(path.value, self.root, self.base, path.span, self.findings, key)
        return self._edges[known]

    def _table(self, path: Located[str], key: Located[str] | None, *, keyed: bool) -> Table | None:
        known = (path.value, None if key is None else key.value, keyed)
        if known not in self._tables:
            self._tables[known] = read_table(
                path.value, self.root, self.base, path.span, self.findings, key, keyed=keyed
            )
        return self._tables[known]
