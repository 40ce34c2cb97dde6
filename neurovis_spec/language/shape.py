"""From a SourceDocument to a Spec: the shape is checked, nothing is resolved.

In: a SourceDocument and Findings. Out: the Spec, without what is invalid in it (the Findings say what that is), so
that the compiler can look at the rest; None where nothing can be said, as in another version of the language.
"""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import TypeVar

from pydantic import ValidationError

from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.body import BodyFile, BodyModel
from neurovis_spec.language.library import Library
from neurovis_spec.language.located import REPORTED
from neurovis_spec.language.model import Model, opening
from neurovis_spec.language.spec import IncludedModel, Spec
from neurovis_spec.language.yaml.reader import read_file
from neurovis_spec.language.yaml.source import Mapping, SourceDocument
from neurovis_spec.real_paths import real_path

M = TypeVar("M", bound=Model)


def read_shape(document: SourceDocument, model: type[M], findings: Findings) -> M | None:
    """Check a document against a model. All findings are reported; the result holds what could be read, None where that
    is too little to go on."""
    before = findings.errors
    if _foreign(document, findings):
        return None
    try:
        result = model.model_validate(document.root, context=findings)
    except ValidationError as error:
        for item in error.errors(include_url=False, include_context=False, include_input=False):
            if item["type"] != REPORTED and findings.errors == before:
                keys = ".".join(str(part) for part in item["loc"])
                findings.error("wrong-shape", opening(document.root), f"{keys}: {item['msg']}")
        return None
    return result


def _foreign(document: SourceDocument, findings: Findings) -> bool:
    """Whether the document is written in another version of the language, which is reported. Of its other keys nothing
    can be said then: they would all be follow-ups."""
    entry = document.root.entry("neurovis")
    if entry is None:
        return False
    head = Findings()
    with suppress(ValidationError):
        Library.model_validate(Mapping((entry,), document.root.span), context=head)
    for found in head.sorted():
        if found.code == "language-version":
            findings.error(found.code, found.span, found.message, found.hint)
    return any(found.code == "language-version" for found in head.sorted())


def read_spec(document: SourceDocument, findings: Findings) -> Spec | None:
    """The Spec of a document."""
    return read_shape(document, Spec, findings)


def read_included(document: SourceDocument, findings: Findings) -> IncludedModel | None:
    """The modules and definitions of an included file."""
    return read_shape(document, IncludedModel, findings)


def read_library(document: SourceDocument, findings: Findings) -> Library | None:
    """The definitions of a library file."""
    return read_shape(document, Library, findings)


def read_body(path: Path, findings: Findings) -> BodyModel | None:
    """The ``body`` section of a file, whatever else it holds: it may be another spec. What is invalid in it is
    reported; None where that is too much."""
    findings.files.setdefault(real_path(path), "")
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
