"""Data files as tests try them: bytes written to a file, read as a spec would have it read.

In: a folder, a name and the file's contents. Out: the table, or the one finding; archives made byte by byte.
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from neurovis_spec.diagnostics import Diagnostic, Findings, Span
from neurovis_spec.language.data.files import NamedFile, Table, read_table
from neurovis_spec.language.located import Located
from neurovis_spec.language.unknown import UNKNOWN, Unknown
from neurovis_spec.language.yaml.source import Scalar

#: where the path stands in the spec, and where the key does
HERE = Span("net.yaml", 4, 20, 4, 30)
THERE = Span("net.yaml", 4, 37, 4, 38)


def attempt(
    folder: Path, name: str, data: str | bytes, key: str | None = None
) -> tuple[Table | Unknown, tuple[Diagnostic, ...]]:
    """The table, if there is one, and all findings."""
    (folder / name).write_bytes(data.encode() if isinstance(data, str) else data)
    findings = Findings()
    located = None if key is None else Located(key, Scalar(key, THERE))
    return read_table(NamedFile(name, folder, folder, HERE, located), findings), findings.sorted()


def table(folder: Path, name: str, data: str | bytes, key: str | None = None) -> Table:
    """The table of a file that has no fault."""
    found, findings = attempt(folder, name, data, key)
    assert findings == ()
    assert found is not UNKNOWN
    np.testing.assert_array_equal(np.isnan(found.values), ~found.present)
    assert found.values.dtype == np.float64
    return found


def fault(folder: Path, name: str, data: str | bytes) -> Diagnostic:
    """The one finding of a file that has one, at its path."""
    found, findings = attempt(folder, name, data)
    assert found is UNKNOWN
    assert [finding.span for finding in findings] == [HERE]
    assert len(findings[0].message) < 300
    return findings[0]


def npy(array: np.ndarray, allow_pickle: bool = False) -> bytes:
    """An array as NumPy writes it."""
    stream = io.BytesIO()
    np.save(stream, array, allow_pickle=allow_pickle)
    return stream.getvalue()


def zipped(members: Mapping[str, bytes], method: int = zipfile.ZIP_DEFLATED) -> bytes:
    """An archive with these members."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", method) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return stream.getvalue()


def npz(compress: bool = False, /, **arrays: np.ndarray) -> bytes:
    """An archive as NumPy writes it: each member with the sizes of its header left to a field for large files."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED if compress else zipfile.ZIP_STORED) as archive:
        for name, array in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                member.write(npy(array))
    return stream.getvalue()
