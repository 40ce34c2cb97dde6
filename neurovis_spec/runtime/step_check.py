"""The check of a step's length: the same run with half and with a quarter of the step, and what that changes.

In: a network, the Course of a run. Out: for each group and each state that flows how far the runs are apart at the
times that they share, and the order that this shows: of a method of order p it falls by 2^p when the step is halved.

In a run with shorter steps all that is counted in steps is stretched: delays, events, episodes, rows of tables and of
inputs that are given. What is held over a step is held over as many of these.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray, integers, reals
from neurovis_spec.compiler.network import Input, Network
from neurovis_spec.compiler.program import Definition
from neurovis_spec.language.expressions.tree import names
from neurovis_spec.progress import Progress
from neurovis_spec.runtime.columns import Keep
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.inputs import InputError
from neurovis_spec.runtime.record import record
from neurovis_spec.runtime.recording import Recording

#: what is less than this share of the largest value is rounding, and says nothing of an order
_ROUNDING = 1e-13
#: an order below this shows no convergence at all: the lowest of a method is 1
_LEAST_ORDER = 0.5
#: so many names are told
_MOST_TOLD = 3


@dataclass(frozen=True)
class StepError:
    """How far runs are apart in ``name``, the activity of a group or a state of it: that with the step from that with
    half of it (``first``), and this one from that with a quarter (``second``), the largest |Δ| at any common time.
    ``order`` is log2 of their ratio, None where there is none, and ``why`` says why."""

    name: str
    first: float
    second: float
    order: float | None
    why: str = ""


@dataclass(frozen=True)
class StepCheck:
    """What halving the step twice changes. ``dt`` is the step in seconds, ``steps`` how many the first run has,
    ``backend`` what made them."""

    dt: float
    steps: int
    backend: str
    errors: tuple[StepError, ...]

    @property
    def hint(self) -> str:
        """What an order says that is no method's, as shorter steps bring the runs no nearer to each other, and what to
        do; empty where there is none."""
        apart = [one.name for one in self.errors if one.order is not None and one.order < _LEAST_ORDER]
        if not apart:
            return ""
        more = f" and {len(apart) - _MOST_TOLD} more" if len(apart) > _MOST_TOLD else ""
        told = ", ".join(apart[:_MOST_TOLD]) + more
        return (
            f"an order below {_LEAST_ORDER} ({told}) says that shorter steps bring the runs no nearer to each other. "
            "Either the step is too long for what is fastest: take a shorter dt, or a method for stiff equations "
            "(integrate: exponential). Or the run is chaotic, so that any difference grows until it is as large as the "
            f"values: check fewer steps, such as {max(2, self.steps // 10)}, in which it stays small"
        )


def check_step(network: Network, course: Course, progress: Progress | None = None) -> StepCheck:
    """Make the run of a course with its step, half and a quarter of it, and compare them. Raises InputError for a
    network with a body, whose steps are its own, and what ``record`` raises."""
    if network.body is not None:
        raise InputError("a body has steps of its own, so that a check needs a network without: --no-body, body=False")
    groups = network.neurons.groups
    models = {index: one.model.definition for one in network.populations for index in one.members.tolist()}
    states = [(group, one.name) for group in groups for one in models[group.start].flows]
    course = replace(course, keep=Keep(weights=False, states=tuple(f"{group.name}.{name}" for group, name in states)))
    runs = [_run(network, course, parts, progress) for parts in (1, 2, 4)]
    why = _without_order(network, models)
    errors = []
    for group in groups:
        reason = next((why[index] for index in group.indices if index in why), "")
        found = [run.activity[:, group.start : group.start + group.count] for run in runs]
        errors.append(_compared(group.name, found, reason))
        for _, name in (one for one in states if one[0] is group):
            state = f"{group.name}.{name}"
            errors.append(_compared(state, [run[state] for run in runs], reason))
    return StepCheck(network.dt, course.length(network), runs[0].backend, tuple(errors))


def stretched(network: Network, parts: int) -> Network:
    """The network with so many steps in place of one. What happens at a step happens to the time that ends with it, and
    so from the first of these on."""
    changes = tuple(change._replace(at=_begins(change.at, parts)) for change in network.changes)
    made = network.connections
    connections = replace(made, delays=integers(made.delays.whole() * parts))
    if made.lags is not None:  # rounded anew to the shorter steps where the map sees them
        lags = made.lags.whole() * parts
        delays = np.where(np.isnan(lags), made.delays.whole() * parts, np.maximum(np.rint(np.nan_to_num(lags)), 1))
        connections = replace(made, delays=integers(delays.astype(np.int64)), lags=reals(lags))
    return replace(
        network,
        dt=network.dt / parts,
        steps=_begins(network.steps, parts),
        episode=None if network.episode is None else network.episode * parts,
        connections=connections,
        changes=changes,
    )


def _begins(step: int, parts: int) -> int:
    """The first of the steps that stand for one: those of step k end at k·dt."""
    return max(0, (step - 1) * parts + 1)


def _run(network: Network, course: Course, parts: int, progress: Progress | None) -> Recording:
    finer = stretched(network, parts)
    steps = _begins(course.length(network), parts)
    sizes = {entry.name: entry.size for entry in network.inputs}
    held = _held(network, course.inputs)
    given = {name: _repeated(values, sizes.get(name, 1), parts) for name, values in held.items()}
    run = replace(course, steps=steps, every=course.every * parts, inputs=given or None)
    return record(finer, run if parts > 1 else course, progress)


def _held(network: Network, given: Mapping[str, npt.ArrayLike] | None) -> dict[str, npt.ArrayLike]:
    """The inputs that have a row for each step: what is given, and tables."""
    found: dict[str, npt.ArrayLike] = dict(given or {})
    events = any(change.parameters for change in network.changes)
    for entry in network.inputs:
        if entry.table is None or entry.name in found:
            continue
        if entry.parts and events:
            raise InputError(f"the table of the input '{entry.name}' follows parameters, and events set some")
        table: FloatArray = entry.table
        found[entry.name] = table
    return found


def _repeated(values: npt.ArrayLike, size: int, parts: int) -> npt.ArrayLike:
    """Rows of an input of this size for shorter steps: that of step k for all whose time ends after (k − 1)·dt, and by
    k·dt. What is given for all steps at once has no rows."""
    rows = np.asarray(values)
    if rows.ndim < (2 if size > 1 else 1) or not len(rows):
        return values
    return rows[-(-np.arange((len(rows) - 1) * parts + 1) // parts)]


def _compared(name: str, runs: list[FloatArray], why: str) -> StepError:
    """The values of three runs, each (rows, members), or (rows,) of a single one."""
    with np.errstate(invalid="ignore", over="ignore"):
        first, second = (float(np.abs(one - other).max(initial=0.0)) for one, other in pairwise(runs))
        largest = float(np.abs(runs[-1]).max(initial=0.0))
    if why:
        return StepError(name, first, second, None, why)
    if not np.isfinite([first, second, largest]).all():
        return StepError(name, first, second, None, "not finite")
    if max(first, second) == 0:
        return StepError(name, first, second, None, "equal")
    if second <= _ROUNDING * largest:
        return StepError(name, first, second, None, "rounding")
    return StepError(name, first, second, float(np.log2(first / second)) if first else -np.inf)


def _input_per_step(entry: Input) -> str:
    """Why what an input gives in a step does not follow its length; "" where it does."""
    if entry.spikes is not None or entry.is_drawn:
        return "an input that counts"
    return "an input that reads k" if entry.expression is not None and "k" in names(entry.expression) else ""


def _without_order(network: Network, models: Mapping[int, Definition]) -> dict[int, str]:
    """The neurons whose values do not follow the length of a step as those of a method do, and why: they, or one that
    reaches them, have something that is per step, or random."""
    connections = network.connections
    sources, targets = connections.sources.whole().tolist(), connections.targets.whole().tolist()
    why = {index: told for index, model in models.items() if (told := _per_step(model))}
    for noise in network.noises:
        why.update(dict.fromkeys(noise.members.tolist(), "noise"))
    stepped = {index: told for one in network.inputs if (told := _input_per_step(one))
               for index in range(one.start, one.start + one.size)}  # fmt: skip
    for port in dict.fromkeys(port.name for one in network.populations for port in one.ports):
        given = network.neurons.input_at(port).tolist()
        why.update({neuron: stepped[index] for neuron, index in enumerate(given) if index in stepped})
    following: dict[int, list[int]] = {}
    delays = connections.delays.whole()
    if connections.lags is not None:  # what is read between steps follows their length
        delays = np.where(np.isnan(connections.lags.whole()), delays, 0)
    rows = zip(sources, targets, delays.tolist(), connections.rules.tolist(), strict=True)
    for source, target, delay, rule in rows:
        following.setdefault(source, []).append(target)
        if rule >= 0:
            why.setdefault(target, "learning")
        elif delay >= 1 and models[source].flows and models[target].flows:
            why.setdefault(target, f"delay {delay}")
    called = {index: group.name for group in network.neurons.groups for index in group.indices}
    waiting = list(why)
    while waiting:
        source = waiting.pop()
        for target in following.get(source, ()):
            if target not in why:
                told = why[source]
                why[target] = told if " of " in told else f"{told} of {called[source]}"
                waiting.append(target)
    return why


def _per_step(model: Definition) -> str:
    """What of a model is per step, or random."""
    if any(one.noise is not None for one in model.state):
        return "noise"
    if any(one.each_step is not None for one in model.state):
        return "each_step"
    if any(one.each_episode is not None for one in model.state):
        return "each_episode"
    return "k" if "k" in model.read else ""
