"""What users call (the top layer, under the command line).

In: a path, a text or a mapping. Out: a CompiledNetwork, or SpecError with every finding.
"""

from __future__ import annotations

import operator
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from neurovis_spec import pipeline
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.compiler.compile import Request
from neurovis_spec.compiler.limits import Limits
from neurovis_spec.diagnostics import Diagnostic, Findings, Span, SpecError
from neurovis_spec.language.source import SourceDocument

if TYPE_CHECKING:
    from neurovis_spec.runtime.recording import Recording

#: What findings call a spec that is given as a mapping.
MAPPING = "<mapping>"


def __getattr__(name: str) -> object:
    """``OutputError``, which what draws raises for a kind of file that nobody makes."""
    if name != "OutputError":
        raise AttributeError(f"module 'neurovis_spec.api' has no attribute {name!r}")
    from neurovis_spec.scene.renderers import RendererError

    return RendererError


def compile(
    source: str | Path | Mapping[str, object],
    *,
    parameters: Mapping[str, float] | None = None,
    seed: int | None = None,
    root: str | Path | None = None,
    limit: int | None = None,
    **more: float,
) -> CompiledNetwork:
    """Compile a spec: a path, or a mapping with the content of one.

    ``parameters`` (and further keywords) replace the values of the spec's parameters, ``seed`` its seed. Data files
    may not lie outside ``root`` (default: the folder of the spec). ``limit`` is the most connections. Raises
    SpecError with all findings.
    """
    given = {**(parameters or {}), **more}
    if isinstance(source, Mapping):
        return compile_text(text_of(source), file=MAPPING, parameters=given, seed=seed, root=root, limit=limit)
    path = Path(source)
    findings = Findings()
    document = pipeline.read(path, str(source), findings)
    request = _request(path.parent, root, given, seed, limit)
    return _finish(document, request, findings, str(source))


def compile_text(
    text: str,
    *,
    file: str = "<text>",
    folder: str | Path | None = None,
    parameters: Mapping[str, float] | None = None,
    seed: int | None = None,
    root: str | Path | None = None,
    limit: int | None = None,
    **more: float,
) -> CompiledNetwork:
    """Compile the text of a spec; its data files are looked for in ``folder`` (default: the working one).

    >>> network = compile_text("neurovis: 1\\nname: x\\nneurons: {A: {activation: tanh}}")
    >>> network.network.neurons.names
    ('A',)
    """
    findings = Findings()
    document = pipeline.read_string(text, file, findings)
    request = _request(Path(folder or "."), root, {**(parameters or {}), **more}, seed, limit)
    return _finish(document, request, findings, file)


def load(path: str | Path) -> Recording:
    """Read a recording. Raises RecordingError for a file that is none, OSError for one that cannot be read."""
    from neurovis_spec.runtime import formats

    return formats.load(path)


def schema(*, included: bool = False) -> dict[str, object]:
    """The JSON Schema (2020-12) of the language, for editors: of a spec, or of a file that specs include."""
    from neurovis_spec.language.schema import json_schema

    return json_schema(included)


def backends() -> list[tuple[str, bool, str]]:
    """Name, whether it is available, and a note, for each backend."""
    from neurovis_spec.runtime import backend

    result = []
    for name in backend.names():
        availability = backend.available(name)
        result.append((name, availability.available, availability.note))
    return result


def _request(
    folder: Path,
    root: str | Path | None,
    parameters: Mapping[str, float],
    seed: int | None,
    limit: int | None,
) -> Request:
    limits = Limits.of(limit)
    values = {name: float(value) for name, value in parameters.items()}
    whole = None if seed is None else operator.index(seed)
    return Request(folder, folder if root is None else Path(root), values, whole, limits)


def text_of(source: Mapping[str, object]) -> str:
    """A mapping with the content of a spec as a text."""
    import json

    return json.dumps(_plain(source), indent=1, ensure_ascii=False, allow_nan=True)


def _plain(value: object) -> object:
    """Mappings, sequences and numbers of any make as those that JSON knows."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, str | int | float) or value is None:
        return value
    if isinstance(value, Iterable):
        return [_plain(item) for item in value]
    raise TypeError(f"a spec holds mappings, lists, texts and numbers, not {type(value).__name__}")


def _finish(document: SourceDocument | None, request: Request, findings: Findings, file: str) -> CompiledNetwork:
    spec = None if document is None else pipeline.shape(document, findings)
    request = request if spec is None else pipeline.include(spec, request, findings)
    network = None if spec is None else pipeline.build(spec, request, findings)
    memory = None if spec is None or network is None else pipeline.remember(spec, request, network, findings)
    if spec is not None and network is not None:
        pipeline.foresee(spec, network, findings)
    pipeline.allow(findings)
    findings.check()
    if spec is None or network is None:
        span = Span(file, 1, 1, 1, 2)
        raise SpecError((Diagnostic("internal", "no network came out, and no finding says why", span),))
    return CompiledNetwork(
        network, spec, request, findings.sorted(), dict(findings.sources), memory, frozenset(findings.files)
    )
