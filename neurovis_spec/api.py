"""What users call (the top layer, under the command line).

In: a path, a text or a mapping. Out: a CompiledNetwork, or SpecError with every finding.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from neurovis_spec import arguments, pipeline
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.compiler.compile import Request
from neurovis_spec.compiler.limits import Limits
from neurovis_spec.diagnostics import Diagnostic, Findings, Span, SpecError
from neurovis_spec.language.units import measured

if TYPE_CHECKING:
    from neurovis_spec.runtime.recording import Recording


#: A seed is an integer that a spec can hold: of 64 bits, signed.
_SEEDS = 1 << 63


def compile(
    source: str | Path | Mapping[str, object],
    *,
    parameters: Mapping[str, float | str] | None = None,
    seed: int | None = None,
    root: str | Path | None = None,
    limit: int | None = None,
    body: str | Path | bool = True,
    **more: float | str,
) -> CompiledNetwork:
    """Compile a spec: a path, or a mapping with the content of one.

    ``parameters`` (and further keywords) replace the values of the spec's parameters, ``seed`` its seed. Data files
    may not lie outside ``root`` (default: the folder of the spec). ``limit`` is the most connections. The network has
    the ``body`` of its spec; that of another YAML file in its place; none with ``body=False``. Raises SpecError with
    all findings; TypeError or ValueError for an argument that cannot be meant.
    """
    if isinstance(source, Mapping):
        from neurovis_spec.plain import text_of

        request = _request(Path(), root, parameters, more, seed, limit, body)
        return _compiled(text_of(source), "<mapping>", request)
    path = arguments.path("source", source)
    request = _request(path.parent, root, parameters, more, seed, limit, body)
    return _compiled(path, str(source), request)


def compile_text(
    text: str,
    *,
    file: str = "<text>",
    folder: str | Path | None = None,
    parameters: Mapping[str, float | str] | None = None,
    seed: int | None = None,
    root: str | Path | None = None,
    limit: int | None = None,
    body: str | Path | bool = True,
    **more: float | str,
) -> CompiledNetwork:
    """Compile the text of a spec; its data files are looked for in ``folder`` (default: the working one).

    >>> network = compile_text("neurovis: 1\\nname: x\\nneurons: {A: {activation: tanh}}")
    >>> network.network.neurons.names
    ('A',)
    """
    arguments.text("text", text)
    base = arguments.path("folder", "." if folder is None else folder)
    request = _request(base, root, parameters, more, seed, limit, body)
    return _compiled(text, arguments.text("file", file), request)


def load(path: str | Path, *, run: int | None = None) -> Recording:
    """Read a recording; of one in which the network began anew the run with this number, from 1, by default the last.
    Raises RecordingError for a file that is none, or that cannot be read."""
    from neurovis_spec.runtime import formats

    return formats.load(arguments.path("path", path), None if run is None else arguments.integer("run", run, 1))


def schema(*, included: bool = False) -> dict[str, object]:
    """The JSON Schema (2020-12) of the language, for editors: of a spec, or of a file that specs include."""
    from neurovis_spec.language.spec import json_schema

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
    parameters: Mapping[str, float | str] | None,
    more: Mapping[str, float | str],
    seed: int | None,
    limit: int | None,
    body: str | Path | bool,
) -> Request:
    limits = Limits.of(None if limit is None else arguments.integer("limit", limit, least=0))
    given = {**arguments.mapping("parameters", parameters), **more}
    values = {name: setting(name, value) for name, value in given.items()}
    whole = None if seed is None else arguments.integer("seed", seed, -_SEEDS, _SEEDS - 1)
    inside = folder if root is None else arguments.path("root", root)
    return Request(folder, inside, values, whole, limits, body=arguments.body(body))


def setting(name: str, value: object) -> float | str:
    """A number, or a text that is one with a unit."""
    return value if isinstance(value, str) and measured(value) is not None else arguments.number(name, value)


def _compiled(source: str | Path, file: str, request: Request) -> CompiledNetwork:
    findings = Findings()
    spec, request, network, memory = pipeline.compile(source, file, request, findings)
    findings.check()
    if spec is None or network is None:
        span = Span(file, 1, 1, 1, 2)
        raise SpecError((Diagnostic("internal", "no network came out, and no finding says why", span),))
    return CompiledNetwork(
        network, spec, request, findings.sorted(), dict(findings.sources), memory, dict(findings.files)
    )
