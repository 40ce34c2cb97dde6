"""Foreseen: what laying out a network would refuse, or not draw as it is meant, found without a layout being made.

In: a network, what makes its LayoutProblem. Out: the LayoutRefusalError that ``arrange`` would raise before the engine
begins, or, of pins and mirror images, after; a warning where instances will not be drawn alike. What else an engine
finds out while it draws is not foreseen, nor are these in a network so large that this would take long.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Final, cast

from neurovis_spec.compiler.network import Network
from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.located import Located
from neurovis_spec.layout.engines import engine_of, engines_that, refuse, they_can
from neurovis_spec.layout.model import CheckingEngine, LayoutProblem, LayoutRefusalError
from neurovis_spec.plugins import PluginError

#: With more neurons or connections than this an engine takes too long to say what pins it refuses.
_MOST: Final = 1000


def foreseen(network: Network, problem_of: Callable[[], LayoutProblem]) -> LayoutRefusalError | None:
    """What would be refused, by the engine of the spec, or by the one that ``auto`` stands for."""
    settings, name = network.layout, network.layout.engine
    problem = cache(problem_of)
    if name == "auto":
        if not (settings.arrange or settings.mirrors or settings.align or settings.plan or _crowded(network)):
            return None  # it stands for none that cannot do the rest
        from neurovis_spec.layout.choose import choose_engine

        name = choose_engine(problem())[0]
    try:
        engine = engine_of(name)
        refuse(problem(), name, engine.capabilities)
        if engine.capabilities.checks and (_crowded(network) or _bound(network)):
            cast(CheckingEngine, engine).check(problem())
    except LayoutRefusalError as refusal:
        return refusal
    except PluginError:  # reported when it is called
        return None
    return None


def _bound(network: Network) -> bool:
    """Whether there are mirror images or lines, which frames, cells and arrangements may not allow."""
    return bool(network.layout.mirrors or network.layout.align) and not _too_large(network)


def _too_large(network: Network) -> bool:
    return max(len(network.neurons), len(network.connections)) > _MOST


def _crowded(network: Network) -> bool:
    """Whether pins may leave no room for something: a frame or a cell."""
    if _too_large(network):
        return False
    settings = network.layout
    if not (settings.positions or settings.origins or settings.relative):
        return False
    boxed = any(group.box is not None for group in network.neurons.groups)
    return boxed or bool(network.instances or settings.boxes or settings.plan)


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
