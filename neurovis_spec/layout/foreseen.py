"""Foreseen: what laying out a network would refuse, or not draw as it is meant, found without an engine at work.

In: a network, what makes its LayoutProblem. Out: the LayoutRefusalError that ``arrange`` would raise before the engine
begins; a warning where instances will not be drawn alike. What an engine finds out while it draws is not foreseen.
"""

from __future__ import annotations

from collections.abc import Callable

from neurovis_spec.compiler.network import Network
from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.located import Located
from neurovis_spec.layout.engines import engine_of, engines_that, they_can
from neurovis_spec.layout.model import LayoutProblem, LayoutRefusalError
from neurovis_spec.layout.refusals import asked_of, refuse
from neurovis_spec.plugins import PluginError


def foreseen(network: Network, problem: Callable[[], LayoutProblem], *, memory: bool) -> LayoutRefusalError | None:
    """What would be refused, by the engine of the spec, or by the one that ``auto`` stands for."""
    settings, name = network.layout, network.layout.engine
    if name == "auto":
        if not (settings.arrange or settings.mirrors or settings.align or settings.plan):
            return None  # it stands for none that cannot do the rest
        from neurovis_spec.layout.choose import choose_engine

        name = choose_engine(problem())[0]
    try:
        refuse(asked_of(network, memory), name, engine_of(name).capabilities)
    except LayoutRefusalError as refusal:
        return refusal
    except PluginError:  # reported when it is called
        return None
    return None


def foresee_frames(engine: Located[str], network: Network, findings: Findings) -> None:
    """Warn (``engine-without-frames``) where instances will not be drawn alike. Not of an engine that only draws what
    is pinned, and not of one that cannot be loaded, which is an error when it is called."""
    name = engine.value
    if not network.instances or name == "auto":
        return
    try:
        can = engine_of(name).capabilities
    except (LayoutRefusalError, PluginError):
        return
    if can.free and not can.modules:
        message = f"the engine '{name}' draws no frames: instances of a module are not drawn alike"
        hint = they_can(engines_that(lambda other: other.modules))
        findings.warning("engine-without-frames", engine.span, message, hint)
