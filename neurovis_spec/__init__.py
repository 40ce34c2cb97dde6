"""NeuroVis: a declarative network-spec and layout compiler.

Everything public is imported on first use (PEP 562), so that ``import neurovis_spec`` stays quick.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from neurovis_spec.version import __version__

if TYPE_CHECKING:
    from neurovis_spec.api import compile, compile_text, load
    from neurovis_spec.body import BodyError
    from neurovis_spec.compiled import CompiledNetwork
    from neurovis_spec.diagnostics import Diagnostic, SpecError
    from neurovis_spec.layout.model import LayoutRefusalError
    from neurovis_spec.plugins import PluginError
    from neurovis_spec.runtime.backend import BackendError
    from neurovis_spec.runtime.c_settable import ExportError
    from neurovis_spec.runtime.errors import RecordingError
    from neurovis_spec.runtime.inputs import InputError
    from neurovis_spec.runtime.simulation import ParameterError
    from neurovis_spec.scene.renderers import RendererError
    from neurovis_spec.sweeps.grid import SweepError
    from neurovis_spec.sweeps.sweep import sweep

__all__ = [
    "BackendError",
    "BodyError",
    "CompiledNetwork",
    "Diagnostic",
    "ExportError",
    "InputError",
    "LayoutRefusalError",
    "ParameterError",
    "PluginError",
    "RecordingError",
    "RendererError",
    "SpecError",
    "SweepError",
    "__version__",
    "compile",
    "compile_text",
    "load",
    "sweep",
]

_HOMES = {
    "BackendError": "neurovis_spec.runtime.backend",
    "BodyError": "neurovis_spec.body",
    "CompiledNetwork": "neurovis_spec.compiled",
    "Diagnostic": "neurovis_spec.diagnostics",
    "ExportError": "neurovis_spec.runtime.c_settable",
    "InputError": "neurovis_spec.runtime.inputs",
    "LayoutRefusalError": "neurovis_spec.layout.model",
    "ParameterError": "neurovis_spec.runtime.simulation",
    "PluginError": "neurovis_spec.plugins",
    "RecordingError": "neurovis_spec.runtime.recording",
    "RendererError": "neurovis_spec.scene.renderers",
    "SpecError": "neurovis_spec.diagnostics",
    "SweepError": "neurovis_spec.sweeps.grid",
    "compile": "neurovis_spec.api",
    "compile_text": "neurovis_spec.api",
    "load": "neurovis_spec.api",
    "sweep": "neurovis_spec.sweeps.sweep",
}


def __getattr__(name: str) -> object:
    """Import a public name from its home the first time somebody asks for it."""
    if name not in _HOMES:
        raise AttributeError(f"module 'neurovis_spec' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
