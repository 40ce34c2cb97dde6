"""Data files of a spec: where they may lie, and that each is read once.

In: the folder of the spec and the root that no path may leave. Out: tables of numbers; ``digests`` says what was
read, for the content hash.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.data_files import EdgeTable, Table, read_edges, read_table
from neurovis_spec.language.located import Located


@dataclass
class Files:
    """The data files that a spec names."""

    base: Path
    root: Path
    findings: Findings
    _tables: dict[str, Table | None] = field(default_factory=dict)

    def table(self, path: Located[str]) -> Table | None:
        """The numbers of a ``.csv`` or ``.npy`` file; None where it is at fault, which is noted at the path."""
        if path.value not in self._tables:
            self._tables[path.value] = read_table(path.value, self.root, self.base, path.span, self.findings)
        return self._tables[path.value]

    def edges(self, path: Located[str]) -> EdgeTable | None:
        """The edges of a ``.csv`` file."""
        return read_edges(path.value, self.root, self.base, path.span, self.findings)
