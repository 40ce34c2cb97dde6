"""Foreseen: what laying out a network would refuse, found without an engine at work.

In: a network, what makes its LayoutProblem. Out: the LayoutRefusalError that ``arrange`` would raise before
the engine begins. What an engine finds out while it draws is not foreseen.
"""

from __future__ import annotations

from collections.abc import Callable

from neurovis_spec.compiler.network import Network
from neurovis_spec.layout.engines import engine_of
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
    except PluginError:  # told of when it is called
        return None
    return None
