"""Small networks for tests, lowered here by hand: no compiler is needed, and none can be at fault.

In: neurons and links, one by one. Out: a Network whose populations and program follow the contract (delay-0
connections in topological order, then Send, then Learn).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from neurovis_spec.arrays import FloatArray, IntColumn, integers, reals
from neurovis_spec.compiler.drawing.drawing_settings import LayoutSettings, RenderSettings
from neurovis_spec.compiler.network import Connections, Group, Input, Network, Neurons, Output
from neurovis_spec.compiler.program import (
    ACTIVATION,
    MODEL,
    RULE,
    Definition,
    Gather,
    Learn,
    Operation,
    Owner,
    Population,
    Port,
    Projection,
    Quantity,
    ReadInputs,
    Send,
    Update,
    Use,
)
from neurovis_spec.language.expressions.parser import parse
from neurovis_spec.language.expressions.tree import Tree
from neurovis_spec.language.words import Combine

States = Mapping[str, tuple[str, str | None, str | None]]


def tree(text: str) -> Tree:
    """An expression, which may call f."""
    return parse(text, extra_functions={"f": 1})


def optional(text: str | None) -> Tree | None:
    return None if text is None else tree(text)


def quantities(states: States) -> tuple[Quantity, ...]:
    return tuple(
        Quantity(name, optional(step), optional(end), tree(initial)) for name, (initial, step, end) in states.items()
    )


def activation(value: str, **parameters: float) -> Definition:
    return Definition(ACTIVATION, value, tuple(parameters), (Quantity("f", tree(value)),))


def model(
    activity: str, states: States, parameters: Sequence[str] = (), let: Mapping[str, str] | None = None
) -> Definition:
    lets = tuple((name, tree(text)) for name, text in (let or {}).items())
    given = (Quantity("activity", tree(activity)),)
    return Definition(MODEL, activity + repr(states), tuple(parameters), given, lets, quantities(states))


def rule(
    step: str | None = None,
    end: str | None = None,
    states: States | None = None,
    parameters: Sequence[str] = (),
    signals: Sequence[str] = (),
    let: Mapping[str, str] | None = None,
    name: str = "rule",
) -> Definition:
    lets = tuple((name, tree(text)) for name, text in (let or {}).items())
    given = (Quantity("weight", optional(step), optional(end)),)
    return Definition(RULE, name, tuple(parameters), given, lets, quantities(states or {}), tuple(signals))


IDENTITY = activation("x")
TANH = activation("tanh(x)")
GAUSSIAN = activation("exp(-sigma * x^2)", sigma=1.0)
STATIC = model("f(drive)", {})
LEAKY = model("f(v)", {"v": ("0", "(1 - leak) * v + leak * drive", None)}, ["leak"])
DELTA = rule("weight + rate * pre * (target - post)", parameters=["rate"], signals=["target"])


@dataclass(frozen=True)
class Unit:
    """One neuron."""

    name: str
    activation: Definition = IDENTITY
    model: Definition = STATIC
    combine: Combine = "sum"
    bias: float = 0.0
    initial: float = float("nan")
    input: int = -1
    shape: Mapping[str, float] = field(default_factory=dict)
    parameters: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Link:
    """One connection; ``learns`` is the index of its Learns."""

    source: int
    target: int
    weight: float = 1.0
    delay: int = 1
    centre: float = 0.0
    learns: int = -1
    low: float = float("-inf")
    high: float = float("inf")
    entry: int = 0


@dataclass(frozen=True)
class Learns:
    """A rule in use; a signal is an index into the activities followed by the inputs."""

    rule: Definition
    parameters: Mapping[str, float] = field(default_factory=dict)
    signals: Mapping[str, int] = field(default_factory=dict)


def build(
    units: Sequence[Unit],
    links: Sequence[Link] = (),
    uses: Sequence[Learns] = (),
    inputs: Sequence[Input] = (),
    outputs: Sequence[Output] = (),
    groups: Sequence[Group] = (),
    dt: float = 1.0,
    episode: int | None = None,
    steps: int = 100,
    parameters: Mapping[str, float] | None = None,
    structural: Sequence[str] = (),
) -> Network:
    """Lower neurons and links to a Network."""
    populations = lowered(units, links)
    levels: list[Operation] = [ReadInputs()]
    for number in range(len(populations)):
        levels += [Gather(number), Update(number)]
    return Network(
        name="by_hand",
        title="By hand",
        description="",
        dt=dt,
        dt_given=dt != 1.0,
        steps=steps,
        episode=episode,
        seed=0,
        parameters=dict(parameters or {}),
        structural=frozenset(structural),
        neurons=neurons(units, groups),
        connections=connections(links),
        inputs=tuple(inputs),
        outputs=tuple(outputs),
        populations=populations,
        projections=tuple(learning(number, use, links) for number, use in enumerate(uses)),
        program=(*levels, Send(), *(Learn(number) for number in range(len(uses)))),
        layout=LayoutSettings(),
        render=RenderSettings(),
        hash="0" * 64,
    )


def neurons(units: Sequence[Unit], groups: Sequence[Group]) -> Neurons:
    names = tuple(unit.name for unit in units)
    return Neurons(
        names=names,
        labels=names,
        groups=tuple(groups),
        bias=floats([unit.bias for unit in units]),
        initial=floats([unit.initial for unit in units]),
        input=np.array([unit.input for unit in units], dtype=np.int64),
        position=np.full((len(units), 2), np.nan),
    )


def connections(links: Sequence[Link]) -> Connections:
    def whole(values: Sequence[int]) -> IntColumn:
        return integers(np.array(values, dtype=np.int64))

    return Connections(
        sources=whole([link.source for link in links]),
        targets=whole([link.target for link in links]),
        weights=reals(floats([link.weight for link in links])),
        centres=reals(floats([link.centre for link in links])),
        delays=whole([link.delay for link in links]),
        rules=whole([link.learns for link in links]),
        entry=whole([link.entry for link in links]),
        low=reals(floats([link.low for link in links])),
        high=reals(floats([link.high for link in links])),
        entries=("all",),
        descriptions=(None,),
        learns=("rule" if any(link.learns >= 0 for link in links) else None,),
        labels=(None,),
    )


def floats(values: Sequence[float]) -> FloatArray:
    return np.array(values, dtype=np.float64)


def level_of(index: int, links: Sequence[Link]) -> int:
    """The longest way to a neuron along delay-0 connections."""
    before = [link.source for link in links if link.delay == 0 and link.target == index]
    return 1 + max(level_of(source, links) for source in before) if before else 0


def lowered(units: Sequence[Unit], links: Sequence[Link]) -> tuple[Population, ...]:
    """Populations of equal level, combination, activation and model, level by level."""
    alike: dict[tuple[int, str, str, str], list[int]] = {}
    for index, unit in enumerate(units):
        key = (level_of(index, links), unit.combine, unit.activation.name, unit.model.name)
        alike.setdefault(key, []).append(index)
    return tuple(block(number, key[0], alike[key], units, links) for number, key in enumerate(sorted(alike)))


def block(number: int, level: int, members: list[int], units: Sequence[Unit], links: Sequence[Link]) -> Population:
    first = units[members[0]]
    incoming = [number for number, link in enumerate(links) if link.target in members]
    slots = np.array([members.index(links[c].target) for c in incoming], dtype=np.int64)
    return Population(
        level=level,
        members=np.array(members, dtype=np.int64),
        model=Use(
            Owner("model", number),
            first.model,
            {name: floats([units[i].parameters[name] for i in members]) for name in first.parameters},
        ),
        activation=Use(
            Owner("activation", number),
            first.activation,
            {name: floats([units[i].shape[name] for i in members]) for name in first.shape},
        ),
        ports=(Port("drive", first.combine, np.array(incoming, dtype=np.int64), slots),),
    )


def learning(number: int, use: Learns, links: Sequence[Link]) -> Projection:
    members = [index for index, link in enumerate(links) if link.learns == number]
    parameters = {name: np.full(len(members), value) for name, value in use.parameters.items()}
    return Projection(
        members=np.array(members, dtype=np.int64),
        uses=(Use(Owner("rule", number), use.rule, parameters),),
        signals={name: np.full(len(members), index, dtype=np.int64) for name, index in use.signals.items()},
    )


def rewired(network: Network, weights: Sequence[float], sources: Sequence[int], targets: Sequence[int]) -> Network:
    """A network of one population, all of its neurons alike, with these connections of delay 1 in place of its own."""
    links = connections([Link(0, 0, weight) for weight in weights])
    slots = np.array(targets, dtype=np.int64)
    links = replace(links, sources=integers(np.array(sources, dtype=np.int64)), targets=integers(slots))
    (one,) = network.populations
    one = replace(one, ports=(replace(one.drive, incoming=np.arange(len(links)), slots=slots),))
    return replace(network, connections=links, populations=(one,))


def all_learning(network: Network, by: Definition) -> Network:
    """A network whose connections are fixed, and now all learn by a rule without parameters and signals."""
    count = len(network.connections)
    links = replace(network.connections, rules=integers(np.zeros(count, dtype=np.int64)))
    projections = (Projection(np.arange(count), (Use(Owner("rule", 0), by, {}),), {}),)
    return replace(network, connections=links, projections=projections, program=(*network.program, Learn(0)))


def cpg_rbf(learns: bool = True) -> Network:
    """Use case 1 of the paper: 2 rhythm neurons, 8 kernels, an output, a teacher; 28 connections."""
    units = [Unit("C1", TANH, initial=0.1), Unit("C2", TANH, initial=0.0)]
    units += [Unit(f"K{i + 1}", GAUSSIAN, combine="distance", shape={"sigma": 40.0}) for i in range(8)]
    units += [Unit("O"), Unit("T", input=0)]
    phi, alpha = 0.049, 1.0094
    cosine, sine = alpha * np.cos(phi), alpha * np.sin(phi)
    links = [Link(0, 0, cosine), Link(0, 1, -sine), Link(1, 0, sine), Link(1, 1, cosine)]
    angles = np.pi - 2 * np.pi * np.arange(8) / 7  # from the minimum of C1 on, both ends included
    links += [Link(0, 2 + i, 1.0, 0, 0.192 * np.cos(angle)) for i, angle in enumerate(angles)]
    links += [Link(1, 2 + i, 1.0, 0, 0.192 * np.sin(angle)) for i, angle in enumerate(angles)]
    links += [Link(2 + i, 10, 0.0, 0, learns=0 if learns else -1) for i in range(8)]
    uses = [Learns(DELTA, {"rate": 0.01}, {"target": 11})] if learns else []
    target = Input("target", 0, 1, tree("0.5*sin(2*pi*(k + 24)/128.62) + 0.2*sin(4*pi*(k + 24)/128.62)"))
    groups = [
        Group("C", 0, 2, "tanh", "static", "sum", {}, {}),
        Group("K", 2, 8, "gaussian", "static", "distance", {}, {}),
        Group("O", 10, 1, "identity", "static", "sum", {}, {}),
        Group("T", 11, 1, "identity", "static", "sum", {}, {}),
    ]
    outputs = [Output("signal", np.array([10]), True), Output("kernels", np.arange(2, 10), False)]
    return build(units, links, uses, [target], outputs, groups, dt=0.05)
