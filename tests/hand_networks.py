"""Networks, layouts and runs made by hand, for tests of scenes and pictures.

``use_case_1()`` is the paper's function approximation (two rhythm neurons, eight kernels, an output that learns a
target), with its real dynamics; ``network()`` builds anything small from names and connections.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from networks_by_hand import Learns, Link, Unit, build, rule

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.drawing.drawing_settings import LayoutSettings, RenderSettings, StatedGain
from neurovis_spec.compiler.network import Group, Network
from neurovis_spec.layout.model import Layout, Point, Route
from neurovis_spec.runtime.recording import Snapshot
from neurovis_spec.scene.gains import Gains, choose_gains
from neurovis_spec.scene.reached import Reached, nothing, reached_by


@dataclass(frozen=True)
class G:
    """A group: its name, its neurons' names, and what it looks like."""

    name: str
    names: tuple[str, ...]
    activation: str = "identity"
    parameters: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    box: str | None = None
    labels: tuple[str, ...] | None = None


@dataclass(frozen=True)
class C:
    """A connection by names."""

    source: str
    target: str
    weight: float = 1.0
    delay: int = 1
    rule: int = -1
    entry: int = 0


def numbered(name: str, count: int, **more: object) -> G:
    return replace(G(name, tuple(f"{name}{i + 1}" for i in range(count))), **more)  # type: ignore[arg-type]


def network(
    groups: Sequence[G],
    wires: Sequence[C],
    *,
    name: str = "made_by_hand",
    title: str = "",
    entries: Sequence[str] = ("all",),
    rules: Sequence[tuple[str, Mapping[str, str]]] = (),
    boxes: Sequence[tuple[str, tuple[int, ...]]] = (),
    dt: float | None = None,
) -> Network:
    """A Network as a picture needs it. ``rules``: the rule's name and its signals' neurons."""
    names = [neuron for group in groups for neuron in group.names]
    index = {neuron: place for place, neuron in enumerate(names)}
    made, start = [], 0
    for group in groups:
        made.append(
            Group(group.name, start, len(group.names), group.activation, "static", "sum", group.parameters, {},
                  box=group.box)
        )  # fmt: skip
        start += len(group.names)
    links = [Link(index[c.source], index[c.target], c.weight, c.delay, learns=c.rule, entry=c.entry) for c in wires]
    uses = [
        Learns(
            rule(name=called, signals=tuple(signals)), signals={key: index[neuron] for key, neuron in signals.items()}
        )
        for called, signals in rules
    ]
    whole = build([Unit(neuron) for neuron in names], links, uses, groups=made, dt=1.0 if dt is None else dt)
    learned = {c.entry: f"{rules[c.rule][0]}(rate=0.01)" for c in wires if c.rule >= 0}
    connections = replace(
        whole.connections,
        entries=tuple(entries),
        descriptions=(None,) * len(entries),
        learns=tuple(learned.get(entry) for entry in range(len(entries))),
        labels=(None,) * len(entries),
    )
    labels = tuple(label for group in groups for label in (group.labels or group.names))
    return replace(
        whole,
        name=name,
        title=title,
        dt_given=dt is not None,
        steps=1000,
        neurons=replace(whole.neurons, labels=labels),
        connections=connections,
        layout=LayoutSettings(boxes=tuple(boxes)),
    )


def downward(start: Point, end: Point, spread: float = 0.0) -> Route:
    """A route that leaves downward and arrives from above, a little from its own side."""
    (x0, y0), (x1, y1) = start, end
    reach = 0.5 * (y1 - y0)
    lean = 0.35 * (x1 - x0)
    return start, (x0 + 0.12 * (x1 - x0), y0 + reach), (x1 - lean, y1 - 0.9 * reach + 0.16 * abs(lean)), end


def straight(start: Point, end: Point, bend: float = 0.0) -> Route:
    (x0, y0), (x1, y1) = start, end
    dx, dy = x1 - x0, y1 - y0
    aside = (dy * bend, -dx * bend)
    one = (x0 + dx / 3 + aside[0], y0 + dy / 3 + aside[1])
    two = (x0 + 2 * dx / 3 + aside[0], y0 + 2 * dy / 3 + aside[1])
    return start, one, two, end


def loop(centre: Point, side: float) -> Route:
    x, y = centre
    return (x, y), (x + side * 1.35, y - 0.75), (x + side * 1.35, y + 0.75), (x, y)


def straight_layout(made: Network, positions: Mapping[str, Point]) -> Layout:
    """Straight routes; loops to the right; the second of a pair bends."""
    routes: dict[str, Route] = {}
    names = made.neurons.names
    for name, s, t in zip(
        made.connection_names, made.connections.sources.tolist(), made.connections.targets.tolist(), strict=True
    ):
        start, end = positions[names[s]], positions[names[t]]
        bend = 0.12 * (1 + name.count("(")) if name.count("(") else 0.08
        routes[name] = loop(start, 1.0) if s == t else straight(start, end, bend)
    return Layout(made.name, "by hand", dict(positions), routes)


@dataclass(frozen=True)
class Case:
    """A network, its layout, and a run: ``activity`` (steps, n), ``weights`` (steps, m)."""

    network: Network
    layout: Layout
    activity: FloatArray
    weights: FloatArray

    def snapshot(self, step: int) -> Snapshot:
        previous = self.weights[step - 1] if step else None
        return Snapshot(step, self.activity[step], self.weights[step], previous)

    @property
    def reached(self) -> Reached:
        changing = self.network.changing
        fixed = self.network.connections.weights.whole().copy()
        fixed[changing] = 0.0
        return reached_by(
            self.network.connections.sources.whole(), fixed, self.activity, self.weights[:, changing], changing
        )


ALPHA, PHI, PERIOD, RATE, SIGMA = 1.0094, 0.049, 128.62, 0.01, 40.0


def use_case_1(steps: int = 1300) -> Case:
    """Paper, section 3.1: Eqs. 8–10 with a target of two harmonics."""
    groups = [
        numbered("C", 2, activation="tanh", box="rhythm"),
        numbered("K", 8, activation="gaussian", parameters={"sigma": (SIGMA,) * 8}, box="kernels"),
        G("O", ("O",)),
        G("T", ("T",)),
    ]
    matrix = [
        [ALPHA * math.cos(PHI), -ALPHA * math.sin(PHI)],
        [ALPHA * math.sin(PHI), ALPHA * math.cos(PHI)],
    ]
    wires = [C(f"C{i + 1}", f"C{j + 1}", matrix[i][j], entry=0) for i in range(2) for j in range(2)]
    wires += [C(f"C{i + 1}", f"K{j + 1}", 1.0, 0, entry=1) for i in range(2) for j in range(8)]
    wires += [C(f"K{j + 1}", "O", 0.0, 0, rule=0, entry=2) for j in range(8)]
    made = network(
        groups, wires, name="cpg_rbf", title="Function approximation", dt=0.05,
        entries=("C -> C", "C -> K", "K -> O"), rules=[("delta", {"target": "T"})],
    )  # fmt: skip
    activity, weights = _run(np.array(matrix), made.connections.weights.whole(), steps)
    return Case(made, _layout_1(made), activity, weights)


def _run(matrix: FloatArray, initial: FloatArray, steps: int) -> tuple[FloatArray, FloatArray]:
    rhythm = np.array([0.1, 0.0])
    orbit = []
    for _ in range(3000):
        rhythm = np.tanh(rhythm @ matrix)
        orbit.append(rhythm)
    round_ = np.array(orbit[-258:])
    first = int(np.argmin(round_[:129, 0]))
    centres = round_[first + (np.arange(8) * PERIOD / 7).round().astype(int)]
    activity, weights = np.zeros((steps, 12)), np.tile(initial, (steps, 1))
    rhythm, learned = np.array([0.1, 0.0]), np.zeros(8)
    for k in range(steps):
        rhythm = np.array([0.1, 0.0]) if k == 0 else np.tanh(rhythm @ matrix)
        kernels = np.exp(-SIGMA * ((rhythm - centres) ** 2).sum(axis=1))
        turn = 2 * math.pi * (k + 24) / PERIOD
        aim = 0.5 * math.sin(turn) + 0.2 * math.sin(2 * turn)
        out = float(kernels @ learned)
        activity[k] = [*rhythm, *kernels, out, aim]
        weights[k, 20:] = learned
        learned = learned + RATE * kernels * (aim - out)
    return activity, weights


def _layout_1(made: Network) -> Layout:
    positions: dict[str, Point] = {"C1": (2.5, 0.0), "C2": (4.5, 0.0), "O": (3.5, 4.3), "T": (5.6, 4.3)}
    positions |= {f"K{i + 1}": (float(i), 2.1) for i in range(8)}
    routes: dict[str, Route] = {
        "C1 -> C1": loop(positions["C1"], -1.0),
        "C2 -> C2": loop(positions["C2"], 1.0),
        "C1 -> C2": straight(positions["C1"], positions["C2"], 0.13),
        "C2 -> C1": straight(positions["C2"], positions["C1"], 0.13),
    }
    for i in range(8):
        kernel = f"K{i + 1}"
        for rhythm in ("C1", "C2"):
            routes[f"{rhythm} -> {kernel}"] = downward(positions[rhythm], positions[kernel])
        routes[f"{kernel} -> O"] = downward(positions[kernel], positions["O"])
    return Layout(made.name, "by hand", positions, routes)


def plain_gains(network: Network, activity: float, signal: float, thickness: float, change: float) -> Gains:
    """One gain of each sort for all."""
    stated = RenderSettings(
        activity=(StatedGain(activity),),
        signal=(StatedGain(signal),),
        thickness=(StatedGain(thickness),),
        change=(StatedGain(change),),
    )
    return choose_gains(network, stated, nothing(network))
