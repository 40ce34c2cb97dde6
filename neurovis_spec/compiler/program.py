"""The update program: what a step does, and by which definitions.

In: nothing; these are values of a Network. Definitions (activations, models, rules) are typed expressions; blocks and
plasticities say which neurons and connections they are for; operations are what a step does, in order.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TypeAlias

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.language.expressions.tree import Call, Tree, walk
from neurovis_spec.language.words import Combine


@dataclass(frozen=True, slots=True)
class Quantity:
    """A state of a model or rule; the expressions see the definition's names. Without ``each_step`` it stays."""

    name: str
    initial: Tree
    each_step: Tree | None = None
    each_episode: Tree | None = None


@dataclass(frozen=True, slots=True)
class Check(Quantity):
    """A state of ours, which nothing reads: an infinity after a step in which something undefined was computed that no
    other number shows (``compiler/run_checks.py``), else 0. ``name`` says it: ``the model 'm' divides by 0``."""


#: The function of a model's checks that says whether the neuron's activation is undefined for an argument.
UNDEFINED_F = "f is undefined"


@dataclass(frozen=True, slots=True)
class Activation:
    """``value`` is an expression of ``x``, the combined input, and the parameters."""

    name: str
    parameters: tuple[str, ...]
    value: Tree

    @property
    def functions(self) -> Mapping[str, Tree]:
        """What a model may call in its formulas, each with its formula, of x."""
        return {"f": self.value}


@dataclass(frozen=True, slots=True)
class CheckedActivation(Activation):
    """An activation that a model checks: ``undefined`` is true where it computes something undefined that its value
    does not show."""

    undefined: Tree

    @property
    def functions(self) -> Mapping[str, Tree]:
        """Beside ``f`` whether it is undefined."""
        return {"f": self.value, UNDEFINED_F: self.undefined}


@dataclass(frozen=True, slots=True)
class Model:
    """How the activity follows from ``drive`` (u[t]); ``f`` in ``activity`` is the neuron's activation (a Call of
    ``f`` with one argument)."""

    name: str
    parameters: tuple[str, ...]
    let: tuple[tuple[str, Tree], ...]
    state: tuple[Quantity, ...]
    activity: Tree
    #: whether its activity, of a step as the activation where it depends on one, is a spike or nothing
    spikes: bool = False

    @property
    def formulas(self) -> Iterator[Tree]:
        """All that is computed in a run."""
        yield self.activity
        yield from (tree for _, tree in self.let)
        for state in self.state:
            yield from (tree for tree in (state.each_step, state.each_episode) if tree is not None)

    @property
    def reads_activation(self) -> bool:
        """Whether its activity depends on the neuron's activation."""
        return any(map(is_activation, walk(self.activity)))


def is_activation(node: Tree) -> bool:
    """Whether a node of a formula of a model is the neuron's activation of something."""
    return isinstance(node, Call) and node.function == "f"


@dataclass(frozen=True, slots=True)
class Rule:
    """How a weight changes. The expressions see pre, sent, post, weight, k, t, dt, parameters, state, let, signals."""

    name: str
    parameters: tuple[str, ...]
    signals: tuple[str, ...]
    let: tuple[tuple[str, Tree], ...]
    state: tuple[Quantity, ...]
    each_step: Tree | None
    each_episode: Tree | None


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """Neurons that are updated together: the same activation, model, combination and level.

    ``members`` are neuron indices, ascending. ``incoming`` are the connections into them, in the order of the
    connections, and ``slots`` says which member (position in ``members``) each of them goes to.
    Parameters are arrays as long as ``members``.
    """

    level: int
    members: IntArray
    combine: Combine
    activation: Activation
    activation_parameters: Mapping[str, FloatArray]
    model: Model
    model_parameters: Mapping[str, FloatArray]
    incoming: IntArray
    slots: IntArray


@dataclass(frozen=True, slots=True, eq=False)
class Plasticity:
    """Connections that learn by one rule. ``signals`` gives, for each signal of the rule, one index a
    connection into the activities of all neurons followed by the vector of all inputs. Parameters are as long as
    ``members``."""

    rule: Rule
    members: IntArray
    parameters: Mapping[str, FloatArray]
    signals: Mapping[str, IntArray]


# The update program: operations in the order of §5. Each sees what those before it have made in the same step.


@dataclass(frozen=True, slots=True)
class ReadInputs:
    """s[t]: expressions, tables and what the caller supplied, into the vector of all inputs."""


@dataclass(frozen=True, slots=True)
class Gather:
    """u[t] of a block: what arrives, combined, + bias + input. Delay 0 reads activities of this step, the rest the
    signals under way."""

    block: int


@dataclass(frozen=True, slots=True)
class Update:
    """The states and the activity of a block, from its drive; at step 0 neurons with ``initial`` take it instead."""

    block: int


@dataclass(frozen=True, slots=True)
class Send:
    """w[t]·a[t] of every delayed connection leaves its source; a[t] is remembered for ``pre``."""


@dataclass(frozen=True, slots=True)
class Learn:
    """The rule of a plasticity, step and (where it has them) episode: w[t+1] and its states, from old values."""

    plasticity: int


Operation: TypeAlias = ReadInputs | Gather | Update | Send | Learn
