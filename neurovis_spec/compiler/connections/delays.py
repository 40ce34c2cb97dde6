"""Delays: how long the signals of an entry travel, from what is written to whole steps.

In: what is written, in steps or in seconds, and the pairs of the entry. Out: Delays. What is drawn or in seconds is
rounded to steps, of which there is one at least unless it is 0; how many steps it is exactly is kept where it is in
seconds, since what flows into a derivative is not rounded.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import BoolArray, FloatArray, Indices, IntArray, narrow
from neurovis_spec.compiler.limits import LONGEST_DELAY, plural
from neurovis_spec.compiler.values.constants import NEAR_INTEGER, Constants
from neurovis_spec.diagnostics import Findings, Span, shorten
from neurovis_spec.language.located import Formula
from neurovis_spec.language.unknown import UNKNOWN, Unknown


class Timed(NamedTuple):
    """A delay in seconds as it is written: where, as what if it is a single time, and the connections of the entry that
    have it; None: all of them."""

    span: Span
    text: str = ""
    places: IntArray | None = None

    def among(self, count: int) -> IntArray:
        """The connections, of so many in all."""
        return np.arange(count, dtype=np.int64) if self.places is None else self.places


class Delays(NamedTuple):
    """Delays, one a connection: in steps, −1 where none is given, and ``exact``, how many steps those in seconds are,
    NaN where they are not; None where none is."""

    steps: Indices
    exact: FloatArray | None = None
    timed: tuple[Timed, ...] = ()

    def at(self, places: IntArray) -> Delays:
        """Those of some connections, in this order."""
        if self.exact is None:
            return Delays(self.steps[places])
        count = len(self.steps)
        timed = (one._replace(places=_taken(one, places, count)) for one in self.timed)
        return Delays(self.steps[places], self.exact[places], tuple(timed))

    def over(self, otherwise: Delays) -> Delays:
        """These, and others where none is given here."""
        missing = np.asarray(self.steps < 0)
        if not missing.any():
            return self
        if missing.all():
            return otherwise
        steps = narrow(np.where(missing, otherwise.steps, self.steps))
        if self.exact is None and otherwise.exact is None:
            return Delays(steps)
        nothing = np.broadcast_to(np.nan, steps.shape)
        one, other = (nothing if exact is None else exact for exact in (self.exact, otherwise.exact))
        rest = tuple(timed._replace(places=_some(timed, missing)) for timed in otherwise.timed)
        return Delays(steps, np.where(missing, other, one), (*self.timed, *rest))


def _taken(timed: Timed, places: IntArray, count: int) -> IntArray | None:
    """Where the connections of a time stand among those at some places."""
    if timed.places is None:
        return None
    has = np.zeros(count, dtype=np.bool_)
    has[timed.places] = True
    return np.flatnonzero(has[places])


def _some(timed: Timed, which: BoolArray) -> IntArray:
    places = timed.among(len(which))
    return places[which[places]]


def nearest_steps(exact: FloatArray) -> FloatArray:
    """The same; what is within 1e-9 of a whole number of steps is that number."""
    near = np.rint(exact)
    return np.where(np.abs(exact - near) <= NEAR_INTEGER, near, exact)


def rounded(exact: FloatArray) -> IntArray:
    """Whole steps: one at least of what is above 0."""
    return np.maximum(np.rint(exact), np.minimum(1, np.ceil(exact))).astype(np.int64)


@dataclass(frozen=True)
class DelayReader:
    """Makes delays of numbers and formulas; what is wrong with them is reported where they stand."""

    constants: Constants

    def single(self, formula: Formula, in_seconds: bool) -> tuple[int, float] | Unknown:
        """A delay that is one number: in whole steps, and how many of them it is exactly, NaN where it is not in
        seconds. The structure depends on it."""
        constants = self.constants
        if not in_seconds:
            steps = constants.integer(formula, "a delay", 0, LONGEST_DELAY)
            return UNKNOWN if steps is UNKNOWN else (steps, np.nan)
        seconds = constants.scalar(formula, structural=True)
        if seconds is UNKNOWN or not constants.timed:
            return UNKNOWN
        exact = nearest_steps(np.array([seconds / constants.dt]))
        steps_of = self._within(exact, formula.span, in_seconds)
        return UNKNOWN if steps_of is UNKNOWN else (int(steps_of[0]), float(exact[0]))

    def each(
        self, values: FloatArray, span: Span, in_seconds: bool, drawn: bool, called: Callable[[int], str]
    ) -> Delays | Unknown:
        """The delays of connections that have these numbers, NaN where none is given. ``called`` gives the name of one,
        for a finding; those that are ``drawn`` need not be whole."""
        if in_seconds and not self.constants.timed:
            return UNKNOWN
        given = ~np.isnan(values)
        exact = nearest_steps(values / self.constants.dt) if in_seconds else nearest_steps(values)
        odd = np.flatnonzero(given & (exact != np.rint(exact)))
        if len(odd) and not in_seconds and not drawn:
            first = int(odd[0])
            message = f"a delay must be an integer, this is {values[first]:.15g}, of {called(first)}"
            hint = "write round(…), or a time: {seconds: …}"
            self.constants.findings.error("not-an-integer", span, message, hint)
            return UNKNOWN
        found = self._within(np.where(given, exact, 0.0), span, in_seconds, called)
        if found is UNKNOWN:
            return UNKNOWN
        steps = narrow(np.where(given, found, -1))
        return Delays(steps, exact, (Timed(span, "", np.flatnonzero(given)),)) if in_seconds else Delays(steps)

    def _within(
        self, exact: FloatArray, span: Span, in_seconds: bool, called: Callable[[int], str] | None = None
    ) -> IntArray | Unknown:
        """Whole steps; UNKNOWN where one is negative or too long, which is reported."""
        if not len(exact):
            return np.zeros(0, dtype=np.int64)
        for which, wrong, bound in (
            (int(np.argmin(exact)), exact.min() < 0, "at least 0"),
            (int(np.argmax(exact)), exact.max() > LONGEST_DELAY, f"at most {LONGEST_DELAY:,} steps"),
        ):
            if wrong:
                value = f"{exact[which] * self.constants.dt:.15g} s" if in_seconds else f"{exact[which]:.15g}"
                of = "" if called is None else f", of {called(which)}"
                self.constants.findings.error("out-of-range", span, f"a delay must be {bound}, this is {value}{of}")
                return UNKNOWN
        return rounded(exact)


def check_below_step(delays: Delays, into_flow: BoolArray, constants: Constants) -> None:
    """Report delays that are above 0 and below a step. Where a derivative reads what arrives (``into_flow``, of each
    connection) it is an error: held over a step it would be that of a step, and not held it would be none."""
    if delays.exact is None:
        return
    count, dt = len(delays.steps), f"{constants.dt:.12g} s"
    for timed in delays.timed:
        places = timed.among(count)
        exact = delays.exact[places]
        short = (exact > 0) & (exact < 1)
        if not short.any():
            continue
        least = f"'{timed.text}' is less than a step, which is {dt} long"
        if not timed.text:
            least = f"the least of these delays is {exact[short].min():.4g} of a step, which is {dt} long"
        if into_flow[places[short]].any():
            message, hint = f"{least}, and a derivative reads what arrives", "; or shorten 'dt'"
            hint = f"write delay: 0, so that it arrives within the step; delay: 1 holds it over one{hint}"
            constants.findings.error("out-of-range", timed.span, message, hint)
        else:
            made = "the delay is 1 step" if timed.text else f"{short.sum():,} of {len(places):,} delays are 1 step"
            hint = "shorten 'dt', or write delay: 1"
            constants.findings.warning("delay-below-step", timed.span, f"{least}: {made}", hint)


def warn_rounded(delays: Delays, held: BoolArray, dt: float, findings: Findings) -> None:
    """Warn of delays in seconds that are no whole numbers of steps, where these are what counts: of the connections
    that are ``held``."""
    if delays.exact is None:
        return
    for timed in delays.timed:
        places = timed.among(len(delays.steps))
        places = places[held[places]]
        exact, steps = delays.exact[places], delays.steps[places].astype(np.int64)
        off = np.flatnonzero((exact >= 1) & (exact != steps))
        if not len(off):
            continue
        first, made = off[0], plural(int(steps[off[0]]), "step")
        message = f"'{timed.text}' is {exact[first]:.12g} steps: the delay is {made}, {steps[first] * dt:.12g} s"
        hint = "write a whole number of steps"
        if not timed.text:
            low, high = int(steps[off].min()), int(steps[off].max())
            made = plural(high, "step") if low == high else f"{low} to {high} steps"
            apart = f"{np.abs(exact - steps)[off].max():.2g} of a step"
            message = f"rounded: {len(off):,} of {len(places):,} delays, to {made}, by up to {apart}"
            hint = "shorten 'dt', or write whole steps: delay: round(SECONDS/dt)"
        findings.warning("delay-rounded", timed.span, message, hint)


def text_of(formula: Formula) -> str:
    """How a single delay is written."""
    return shorten(str(formula.node.value).strip())
