"""What is invalid in a document, by the same way that ``neurovis validate`` goes.

In: a Document. Out: its findings and those of the files that it includes, which are taken as the editor has them; the
network where there is one. A file to be included is checked within a spec that has one instance of each of its modules.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from neurovis_spec import pipeline
from neurovis_spec.compiler.compile import Request
from neurovis_spec.compiler.network import Network
from neurovis_spec.diagnostics import Diagnostic, Findings, Span
from neurovis_spec.lsp.document import Document
from neurovis_spec.lsp.files import Files
from neurovis_spec.real_paths import real_path

if TYPE_CHECKING:
    from neurovis_spec.layout.model import Layout, LayoutProblem

#: The spec within which a file to be included is checked; no file has such a name.
_STAND_IN = "<stand-in>"


@dataclass(frozen=True)
class Checked:
    """What compiling a document gave: all findings, the network where there is one, the other files that were read."""

    findings: tuple[Diagnostic, ...]
    network: Network | None
    files: frozenset[Path] = frozenset()


def check(document: Document) -> Checked:
    """Compile a document as ``neurovis validate`` does; files that it names are looked for in its folder."""
    if document.page.library:
        return _library(document)
    return _compiled(document.text.text, document.file, document.folder, document.root, document.files)


def stumbled(document: Document) -> Checked:
    """What there is to say where a check ended in a mistake of ours: that nothing is known."""
    message = "a mistake of NeuroVis, not of the spec: it could not be checked as it is now"
    span = Span(document.file, 1, 1, 1, 1)
    return Checked((Diagnostic("internal", message, span, hint="please report it with this text"),), None)


def _problem(network: Network, memory: Layout | None) -> LayoutProblem:
    from neurovis_spec.layout.problem import problem_of

    return problem_of(network, memory)


def _compiled(text: str, file: str, folder: Path, root: Path, files: Files) -> Checked:
    findings = Findings()
    asked = Request(folder, root, read=files.read)
    spec, request, network, memory = pipeline.compile(text, file, asked, findings)
    refusal = None
    if spec is not None and network is not None and not findings.failed:
        refusal = pipeline.refusal(spec, request, network, partial(_problem, network, memory))
    others = frozenset(place_of(name, folder) for name in findings.sources if name != file)
    found = findings.sorted()
    return Checked(found if refusal is None else (*found, refusal), None if findings.failed else network, others)


def place_of(file: str, folder: Path) -> Path:
    """The file that findings call by a name, which may be relative to a folder."""
    path = Path(file)
    return path if path.is_absolute() else real_path(folder / path)


def _library(document: Document) -> Checked:
    """The findings of a file to be included, without those of the spec that stands in for one."""
    path = document.path
    modules = [name.text for name in document.page.alone.declared("module")]
    group = next(name for number in range(len(modules) + 1) if (name := f"stand_in_{number}") not in modules)
    spec = {
        "neurovis": 1,
        "name": "stand_in",
        "include": path.name,
        "neurons": {group: {}},
        "instances": {name: {"module": name} for name in modules},
    }
    files = document.files.holding({path: document.text.text})
    name = str(path.parent / _STAND_IN)
    root = files.root(path, document.page)
    checked = _compiled(json.dumps(spec), name, path.parent, root, files)
    found = [item for item in checked.findings if item.span.file != name]
    return Checked(_renamed(found, path, document.file), None, checked.files - {path})


def _renamed(found: list[Diagnostic], path: Path, file: str) -> tuple[Diagnostic, ...]:
    """The findings with the document called as it is called everywhere else."""
    return tuple(
        replace(item, span=item.span._replace(file=file)) if place_of(item.span.file, path.parent) == path else item
        for item in found
    )
