"""Runs that end early: at the first step after which a measure is true.

In: the text of a measure, a Network. Out: Until, which a Course takes; after the run it says how the run ended.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.diagnostics import Span
from neurovis_spec.runtime.embodied import Embodied
from neurovis_spec.runtime.measures import Measure, Meter, findings_of, measure_of, sensed_columns
from neurovis_spec.runtime.rows import Rows, RowSink
from neurovis_spec.runtime.spikes import SpikeLog
from neurovis_spec.runtime.state import State

LABEL = "<until>"


@dataclass(frozen=True)
class Ending:
    """How a run ended: after ``step``, when ``made`` steps were made; whether the measure was true then (``met``), and
    the values of its windows by their text."""

    step: int
    made: int
    met: bool
    values: Mapping[str, float] = field(default_factory=dict)

    def __str__(self) -> str:
        values = ", ".join(f"{text} is {value:.6g}" for text, value in self.values.items())
        head = f"ended at step {self.step}" if self.met else f"still false at the last step, {self.step}"
        return f"{head}: {values}" if values else head


class Until:
    """A measure that ends a run; ``ending`` is how the last run ended, None before one has. Raises SpecError."""

    def __init__(self, text: str, network: Network) -> None:
        self.measure: Measure = measure_of(text, network, LABEL, bounded=True)
        if self.measure.probe.forms:
            findings = findings_of(text, LABEL)
            message = "a signal of a synapse is formed where it is recorded, not at each step"
            findings.error("unknown-name", Span(LABEL, 1, 1, 1, len(text) + 1), message, "ask for what it is made of")
            findings.check()
        self.ending: Ending | None = None

    def watch(self, rows: RowSink, state: State, steps: int, body: Embodied | None) -> Watched:
        """Rows that ask after each step whether the run is to end. Raises SpecError where there are fewer steps than a
        window has, BodyError where the ``body`` has not a sensor of the measure."""
        self.measure.check_steps(steps)
        self.ending = None
        return Watched(self, rows, state, body)


class Watched:
    """Rows as they are handed on, and the meter: it is asked after each step (``due``), or behind many (``made``)."""

    def __init__(self, until: Until, rows: RowSink, state: State, body: Embodied | None) -> None:
        self._until, self._rows, self._state, self._body = until, rows, state, body
        self._sensed = sensed_columns(until.measure, None if body is None else body.sensor_names)
        self._meter = Meter(until.measure, state.k)
        self._met = False

    @property
    def fired(self) -> SpikeLog | None:
        """Where spikes go."""
        return self._rows.fired

    def begin(self, count: int) -> Rows:
        """Arrays for the next rows."""
        return self._rows.begin(count)

    def end(self, count: int) -> None:
        """So many are filled."""
        self._rows.end(count)
        self._until.ending = self._ending()

    def made(self, activity: FloatArray) -> int:
        """Evaluate the measure after each of these steps, of which these are the activities (steps, n): how many of
        them the run has, all unless it ends among them. Only where the measure is ``together``."""
        conditions = self._state.conditions
        meter_before = self._meter.copy()
        values = self._meter.rows(activity, conditions, np.zeros((len(activity), 0)))
        true = np.flatnonzero((values == values) & (values != 0))  # NaN is not true
        if not len(true):
            return len(activity)
        self._met, count = True, int(true[0]) + 1
        self._meter = meter_before  # without the steps behind the end
        self._meter.rows(activity[:count], conditions, np.zeros((count, 0)))
        return count

    def asked(self) -> bool:
        """Whether rows are to be handed on now, the measure apart."""
        return self._rows.due() or self._met

    def due(self) -> bool:
        """Whether rows are to be handed on now, asked after each step."""
        state, probe = self._state, self._until.measure.probe
        states = probe.now(state)
        if self._body is not None:
            states = np.concatenate((states, self._body.sensed[self._sensed]))
        value = self._meter.step(state.activity, state.conditions, states)
        self._met = value == value and value != 0
        return self._rows.due() or self._met

    def over(self) -> bool:
        """Whether the run is to end here."""
        return self._met or self._rows.over()

    def _ending(self) -> Ending | None:
        formula, made = self._until.measure.formula, self._meter.made
        if not made:
            return None
        texts = [formula.text[window.start : window.end] for window in formula.windows]
        return Ending(self._meter.first + made - 1, made, self._met, dict(zip(texts, self._meter.values, strict=True)))
