"""Turns of a network that runs as a node: what somebody changes in the live page while it runs.

In: turns, by the thread of the page. Out: a Simulation that is turned between two of its steps, where it runs here.
Where it runs elsewhere, parameters of its node, and a look at them once a second by another thread; what cannot be set
is refused here, as it would be there: the network is the same.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from threading import Lock

import numpy as np

from neurovis_spec.compiler.network import Network
from neurovis_spec.live.source import Mask, SourceError
from neurovis_spec.live.turns import TURNS, Feed, Set, Turn, Weigh, carried_out, fed_by, rules, turn
from neurovis_spec.ros.middleware import Node
from neurovis_spec.runtime.simulation import ParameterError, Simulation


class RunSteering:
    """Turns a run; ``lock`` is held while a step is made."""

    #: who looks on is told the weights that rules and events change, and no others
    takes = TURNS - {"weigh"}

    def __init__(self, simulation: Simulation, lock: Lock) -> None:
        self._simulation, self._lock = simulation, lock
        self._rules = rules(simulation.network)
        self._fed: dict[str, tuple[float, ...]] = {}

    @property
    def parameters(self) -> Mapping[str, float]:
        """The parameters that can be set, as they are now."""
        with self._lock:
            now = self._simulation.parameters
        return {name: value for name, value in now.items() if name not in self._simulation.network.structural}

    @property
    def fed(self) -> Mapping[str, tuple[float, ...]]:
        """What inputs are given by hand, in place of what comes for them."""
        return self._fed

    @property
    def learning(self) -> Mapping[str, bool | None]:
        """Whether the rules are carried out, by their connections; None where some are."""
        with self._lock:
            stopped = self._simulation.stopped
        return carried_out(self._rules, stopped)

    @property
    def touched(self) -> tuple[Mask, Mask, Mask]:
        """Which neurons and connections are lesioned, and which neurons are clamped."""
        with self._lock:
            return *self._simulation.lesioned, self._simulation.held

    def turn(self, what: Turn) -> None:
        """Take a turn, from the next step on. Raises SourceError, also for one that gives a weight."""
        if isinstance(what, Weigh):
            raise SourceError("weights are not set by hand here")
        with self._lock:
            try:
                if isinstance(what, Feed):
                    self._fed = fed_by(self._simulation.network, self._fed, what)
                else:
                    turn(self._simulation, what)
            except (ValueError, KeyError) as error:
                raise SourceError(str(error)) from None


class ViewSteering:
    """Sets the parameters of a network that a node of this ``name`` runs."""

    takes = frozenset(("set",))

    def __init__(self, network: Network, node: Node, name: str) -> None:
        self._node, self._name = node, name
        #: knows which values can be
        self._like = Simulation(replace(network, body=None), "reference")
        self._settable = tuple(name for name in network.parameters if name not in network.structural)
        self._learning = carried_out(rules(network), np.zeros(len(network.connections), bool))
        neurons, connections = np.zeros(len(network.neurons), bool), np.zeros(len(network.connections), bool)
        self.touched: tuple[Mask, Mask, Mask] = neurons, connections, neurons
        self._lock = Lock()
        self._now: Mapping[str, float] = {}

    def look(self) -> bool:
        """See what the parameters are now; False where there are none to be set."""
        if not self._settable:
            return False
        with self._lock:
            found = self._node.parameters_of(self._name, self._settable)
            if found:
                self._now = dict(found)
        return bool(found)

    @property
    def parameters(self) -> Mapping[str, float]:
        """The parameters that can be set, as they were lately."""
        return self._now

    @property
    def fed(self) -> Mapping[str, tuple[float, ...]]:
        """Nothing is given by hand."""
        return {}

    @property
    def learning(self) -> Mapping[str, bool | None]:
        """Rules cannot be stopped from here."""
        return self._learning

    def turn(self, what: Turn) -> None:
        """Set parameters. Raises SourceError, also for all other turns."""
        if not isinstance(what, Set):
            raise SourceError("the network runs elsewhere: its parameters can be set, and nothing else")
        with self._lock:
            self._check(what.values)
            why = self._node.set_parameters_of(self._name, what.values)
            if why is not None:
                raise SourceError(why)
            self._now = {**self._now, **what.values}

    def _check(self, values: Mapping[str, float]) -> None:
        with suppress(ParameterError):  # the other network goes its own way
            self._like.set(self._now)
        try:
            self._like.set(values)
        except (ValueError, KeyError) as error:
            raise SourceError(str(error)) from None
        absent = [name for name in values if name not in self._now]
        if absent:
            raise SourceError(f"{self._name} does not offer '{absent[0]}'")
