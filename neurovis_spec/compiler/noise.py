"""Noise: what a group's neurons are given at random, anew at each step.

In: the ``noise`` of the groups. Out: Noises, each with its place in the vector that a step is given.
"""

from __future__ import annotations

import numpy as np

from neurovis_spec.compiler.network import Noise, frozen
from neurovis_spec.compiler.populate import Population
from neurovis_spec.compiler.units import Unit
from neurovis_spec.language.expressions.tree import draws


def make_noises(units: tuple[Unit, ...], population: Population, inputs: int) -> tuple[Noise, ...]:
    """The noise of every group that has some; ``inputs`` is the length of the vector of all inputs."""
    result: list[Noise] = []
    start = inputs
    for group, model, owner in zip(population.neurons.groups, population.models, population.owners, strict=True):
        formula, constants = model.noise, units[owner].constants
        if formula is None:
            continue
        tree = constants.tree(formula, ("k", "t", "i", "n"), random=True)
        if tree is None:
            continue
        if not draws(tree):
            message = "this noise draws nothing: it is the same at each run"
            hint = "use normal(mean, deviation) or uniform(low, high); a constant belongs to 'bias'"
            constants.findings.error("no-draw", formula.span, message, hint)
            continue
        members = np.arange(group.start, group.start + group.count, dtype=np.int64)
        frozen(members)
        result.append(Noise(group.name, members, start, tree, dict(constants.parameters)))
        start += group.count
    return tuple(result)
