"""Noise: what a group's neurons are given at random, anew at each step.

In: the ``noise`` of the groups, and of the states of their models. Out: Noises, each with its place in the vector that
a step is given.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from neurovis_spec.arrays import IntArray, frozen
from neurovis_spec.compiler.events.settable import ParameterFormula, slots_named
from neurovis_spec.compiler.network import Noise
from neurovis_spec.compiler.neurons.groups import Built
from neurovis_spec.compiler.neurons.populate import Census
from neurovis_spec.compiler.program import DRIVE
from neurovis_spec.compiler.values.constants import Constants, Value, width_of
from neurovis_spec.language.expressions.evaluate import evaluate_array
from neurovis_spec.language.expressions.functions import CONSTANTS
from neurovis_spec.language.expressions.tree import Chain, Conditional, Draw, Number, Tree, draws, names
from neurovis_spec.language.located import Formula
from neurovis_spec.language.places import formula_at
from neurovis_spec.language.sections import GroupModel

_NOISE = formula_at(GroupModel, "noise")
#: normal(0, 1)
_STANDARD = Draw("normal", Number(0.0), Number(1.0), 0)


def make_noises(census: Census, inputs: int) -> tuple[Noise, ...]:
    """The noise of every group that has some; ``inputs`` is the length of the vector of all inputs."""
    result: list[Noise] = []
    start = inputs
    for one in census.groups:
        members = frozen(np.arange(one.group.start, one.group.start + one.group.count, dtype=np.int64))
        for noise in (*_written(one, members), *_of_states(one, members)):
            result.append(replace(noise, start=start))
            start += len(members)
    return tuple(result)


def _written(one: Built, members: IntArray) -> Iterator[Noise]:
    """The noise that a group writes, by ports."""
    for port, formula, tree in one.noises:
        constants = one.constants
        widths = _check_deviations(tree, formula, one.group.count, constants)
        name = one.group.name if port == DRIVE else f"{one.group.name}.{port}"
        slots = slots_named(tree, constants.settable)
        yield Noise(name, members, 0, tree, dict(constants.parameters), slots, widths, port)


def _of_states(one: Built, members: IntArray) -> Iterator[Noise]:
    """The standard normal numbers that disturb states of a group's model, one after the other as they are declared."""
    for state in one.kind.model.definition.flows:
        if state.noise is not None:
            yield Noise(f"{one.group.name}.{state.name}", members, 0, _STANDARD, {}, port="", state=state.name)


def _check_deviations(tree: Tree, formula: Formula, count: int, constants: Constants) -> tuple[ParameterFormula, ...]:
    """A finding where a deviation, what ``uniform`` draws from, or a mean of ``poisson``, is known before the run and
    negative for any neuron. A deviation that depends on the step, or a draw in a branch, which may not be taken, gives
    NaN in the run, and its warning. Gives those of them that follow parameters of the run."""
    following = []
    known: dict[str, Value] = {**constants.parameters, **CONSTANTS, "dt": constants.dt}
    known |= {"i": np.arange(count, dtype=np.float64), "n": float(count)}
    for draw in _always_drawn(tree):
        parts = {"normal": (draw.second,), "poisson": (draw.first,)}.get(draw.kind, (draw.first, draw.second))
        if all(names(part) <= known.keys() and not draws(part) for part in parts):
            width = width_of(draw, *(evaluate_array(part, known) for part in (parts[0], parts[-1])))
            if np.less(width, 0).any():
                constants.refuse_draw(formula, draw, float(np.min(width)))
            tree = parts[0] if len(parts) == 1 else Chain(("-",), (draw.second, draw.first))
            bound = constants.bound(tree, {name: known[name] for name in _NOISE.sees if name in known})
            if bound.slots:
                following.append(bound)
    return tuple(following)


def _always_drawn(tree: Tree) -> Iterator[Draw]:
    """The draws of a formula that are in no branch of it."""
    waiting = [tree]
    while waiting:
        node = waiting.pop()
        if isinstance(node, Draw):
            yield node
        waiting.extend((node.condition,) if isinstance(node, Conditional) else node.parts)
