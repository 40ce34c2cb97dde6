"""Turns of a network that runs as a node: what somebody changes in the live page while it runs.

In: turns, by the thread of the page. Out: a Simulation that is turned between two of its steps.
"""

from __future__ import annotations

from collections.abc import Mapping
from threading import Lock

from neurovis_spec.live.source import Mask, SourceError
from neurovis_spec.live.turns import TURNS, Feed, Turn, carried_out, fed_by, rules, turn
from neurovis_spec.runtime.simulation import Simulation


class RunSteering:
    """Turns a run; ``lock`` is held while a step is made."""

    takes = TURNS

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
        """Take a turn, from the next step on. Raises SourceError."""
        with self._lock:
            try:
                if isinstance(what, Feed):
                    self._fed = fed_by(self._simulation.network, self._fed, what)
                else:
                    turn(self._simulation, what)
            except (ValueError, KeyError) as error:
                raise SourceError(str(error)) from None
