"""A body in a file of its own, which takes the place of that of a spec.

In: a path. Out: the ``body`` section of the file, whatever else it holds: it may be another spec.
"""

from __future__ import annotations

from pathlib import Path

from pydantic import Field

from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.body import BodyModel
from neurovis_spec.language.model import Model, opening
from neurovis_spec.language.shape import read_shape
from neurovis_spec.language.yaml.reader import read_file
from neurovis_spec.language.yaml.source import Mapping, SourceDocument


class BodyFile(Model):
    """A file with a body."""

    body: BodyModel = Field(description="The body.")


def read_body(path: Path, findings: Findings) -> BodyModel | None:
    """The body in a file. What is invalid in it is reported; None where that is too much."""
    findings.files.add(path.resolve())
    document = read_file(path, str(path), findings)
    if document is None:
        return None
    entry = document.root.entry("body")
    if entry is None:
        where = opening(document.root)
        findings.error("missing-key", where, "the file names no body", "write body: {mujoco: FILE, …}")
        return None
    alone = SourceDocument(document.file, Mapping((entry,), document.root.span))
    found = read_shape(alone, BodyFile, findings)
    return None if found is None else found.body
