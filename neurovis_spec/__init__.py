"""NeuroVis: a declarative network-spec and layout compiler.

Everything public is imported on first use (PEP 562), so that ``import neurovis_spec`` stays quick.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from neurovis_spec.version import __version__

if TYPE_CHECKING:
    from neurovis_spec.api import compile, compile_text, load
    from neurovis_spec.compiled import CompiledNetwork
    from neurovis_spec.diagnostics import Diagnostic, SpecError
    from neurovis_spec.sweeps.sweep import sweep

__all__ = ["CompiledNetwork", "Diagnostic", "SpecError", "__version__", "compile", "compile_text", "load", "sweep"]

_HOMES = {
    "CompiledNetwork": "neurovis_spec.compiled",
    "compile": "neurovis_spec.api",
    "compile_text": "neurovis_spec.api",
    "load": "neurovis_spec.api",
    "Diagnostic": "neurovis_spec.diagnostics",
    "SpecError": "neurovis_spec.diagnostics",
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
