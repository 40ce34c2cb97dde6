"""Who sees a spike when, and what becomes of whom: random networks against a step written out by itself, neuron by
neuron, as the contract has it. All numbers are short in base 2, so that each is exact and equal."""

from __future__ import annotations

import random
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from random_specs import Plain, Spec

import neurovis_spec as nv
from neurovis_spec.cli.overview import overview

STEPS = 24
DT, BOUND = 0.5, 1.5
#: what a spike block may say of v
SETS: dict[str, Callable[[float], float]] = {"v - 1": lambda v: v - 1, "0.25": lambda v: 0.25}
#: refractory times, and how many steps they are: rounded, and at least 1
RESTS = {0.0: 0, 0.1: 1, 0.5: 1, 0.7: 1, 0.75: 2, 1.0: 2, 1.5: 3}


@dataclass(frozen=True)
class Link:
    """A connection: "plain", by a "synapse" or with rules ("pair", "count" or both)."""

    source: int
    target: int
    delay: int
    weight: float
    kind: str
    rules: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        return f"N{self.source + 1} -> N{self.target + 1}"


@dataclass(frozen=True)
class Case:
    """A network and what is done to it: ``held`` is a first and a last step, a neuron and a value; ``gone`` two steps
    and a neuron (a number) or a connection."""

    bias: list[float]
    start: list[float]
    set_to: str | None
    rest: float
    hold: tuple[str, ...]
    links: list[Link]
    held: tuple[int, int, int, float] | None = None
    gone: tuple[int, int, int | Link] | None = None
    paused: tuple[int, Link] | None = None

    def spec(self) -> Spec:
        block: dict[str, Plain] = {"when": "v >= 1", "refractory": self.rest, "hold": [*self.hold]}
        if self.set_to is not None:
            block["set"] = {"v": self.set_to, "w": "w + v/4"}
        return {
            "neurovis": 1,
            "name": "laws",
            "time": {"dt": DT, "integrate": "euler"},
            "models": {
                "cell": {
                    "ports": ["kick"],
                    "state": {
                        "v": {"initial": 0, "derivative": "drive - v/2", "jump": "kick", "each_step": "v - w/8"},
                        "w": {"jump": "kick/2", "each_step": "w/2 + v/8"},
                    },
                    "spike": block,
                }
            },
            "synapses": {"slow": {"state": {"g": {"each_step": "g/2", "on_pre": "g + weight"}}, "signal": "g"}},
            "rules": {
                "pair": {
                    "state": {
                        "a": {"each_step": "a/2", "on_pre": "a + 1/4"},
                        "b": {"each_step": "b/2", "on_post": "b + 1/8"},
                    },
                    "weight": {"on_pre": "weight - b", "on_post": "weight + a"},
                },
                "count": {
                    "state": {"n": {"on_pre": "n + 1", "on_post": "n + 2"}},
                    "weight": {"on_pre": "weight + 1/16", "on_post": "weight/2", "each_step": "weight + n/64"},
                },
            },
            "neurons": {
                f"N{number + 1}": {"model": "cell", "bias": bias, "initial": {"v": start}}
                for number, (bias, start) in enumerate(zip(self.bias, self.start, strict=True))
            },
            "connections": {link.name: _body(link) for link in self.links},
            "events": [*self._events()],
        }  # fmt: skip

    def _events(self) -> list[Plain]:
        found: list[Plain] = []
        if self.held is not None:
            first, last, neuron, value = self.held
            found.append({"from": first, "to": last, "clamp": {f"N{neuron + 1}": value}})
        if self.gone is not None:
            lost, back, what = self.gone
            name = f"N{what + 1}" if isinstance(what, int) else what.name
            found += [{"at": lost, "lesion": name}, {"at": back, "mend": name}]
        if self.paused is not None:
            found.append({"at": self.paused[0], "learning": {self.paused[1].name: False}})
        return found


def _body(link: Link) -> Plain:
    body: dict[str, Plain] = {"weight": link.weight, "delay": link.delay, "port": "kick"}
    if link.kind == "synapse":
        body["synapse"] = "slow"
    if link.rules:
        body |= {"plasticity": [*link.rules], "bounds": [-BOUND, BOUND]}
    return body


@dataclass
class Cell:
    """A neuron: its states, whether it is armed, the last step in which it rests; what others see of its spikes."""

    v: float
    w: float = 0.0
    armed: bool = True
    rests_to: int = 0
    fired: bool = False
    seen: list[float] = field(default_factory=list)


class ByHand:
    """A run of a case, step by step, as the contract has it."""

    def __init__(self, case: Case) -> None:
        self.case, self.k = case, 0
        self.cells = [Cell(start) for start in case.start]
        self.weights = [link.weight for link in case.links]
        self.g = [0.0] * len(case.links)
        self.a, self.b, self.n = ([0.0] * len(case.links) for _ in range(3))
        #: by connections the first step of which something may still arrive
        self.since = [0] * len(case.links)
        #: w·spike as it left, by connections
        self.left: list[list[float]] = [[] for _ in case.links]

    def step(self) -> None:
        """A step: integration, arrivals, jumps, each_step, thresholds, what acts behind them, learning."""
        if self.k > 0:
            for cell, bias in zip(self.cells, self.case.bias, strict=True):
                self.flow(cell, bias)
            for number in range(len(self.case.links)):
                self.receive(number, late=False)
            signals = self.arriving()
            for cell, kick in zip(self.cells, signals, strict=True):
                self.jump(cell, kick, rests=self.k <= cell.rests_to)
                self.each_step(cell)
            resting = [self.k <= cell.rests_to for cell in self.cells]
            for cell in self.cells:
                self.fire(cell)
        self.show()
        if self.k > 0:
            for number in range(len(self.case.links)):
                self.receive(number, late=True)
            for cell, rests, kick in zip(self.cells, resting, self.kicks_now(), strict=True):
                self.jump(cell, kick, rests)
        for number, link in enumerate(self.case.links):
            self.left[number].append(self.weights[number] * self.cells[link.source].seen[self.k])
        self.learn()
        self.k += 1

    def flow(self, cell: Cell, bias: float) -> None:
        if not (self.k <= cell.rests_to and "v" in self.case.hold):
            cell.v += DT * (bias - cell.v / 2)

    def jump(self, cell: Cell, kick: float, rests: bool) -> None:
        if not (rests and "v" in self.case.hold):
            cell.v += kick
        if not (rests and "w" in self.case.hold):
            cell.w += kick / 2

    def each_step(self, cell: Cell) -> None:
        v, w = cell.v, cell.w
        if not (self.k <= cell.rests_to and "v" in self.case.hold):
            cell.v = v - w / 8
        if not (self.k <= cell.rests_to and "w" in self.case.hold):
            cell.w = w / 2 + v / 8

    def fire(self, cell: Cell) -> None:
        cell.fired = cell.v >= 1 and cell.armed and self.k > cell.rests_to
        if cell.fired:
            cell.rests_to = self.k + RESTS[self.case.rest]
            if self.case.set_to is not None:
                cell.v, cell.w = SETS[self.case.set_to](cell.v), cell.w + cell.v / 4
        cell.armed = cell.v < 1 or (cell.armed and not cell.fired)

    def show(self) -> None:
        """What others see of each: a neuron that is clamped fires in each step, or is silent."""
        for number, cell in enumerate(self.cells):
            spike = float(cell.fired)
            if self.case.held is not None:
                first, last, held, value = self.case.held
                if held == number and first <= self.k < last:
                    spike = float(value != 0)
            cell.seen.append(0.0 if self.lost(number) else spike)

    def lost(self, what: int | Link) -> bool:
        """Whether a neuron, or a connection or anything at its ends, is lesioned."""
        if self.case.gone is None:
            return False
        first, last, gone = self.case.gone
        if not first <= self.k < last:
            return False
        return what == gone or (isinstance(what, Link) and gone in (what.source, what.target))

    def came(self, number: int) -> float:
        """The spike that arrives at the end of a connection in this step."""
        link = self.case.links[number]
        sent = self.k - link.delay
        if self.lost(link) or sent < 0:
            return 0.0
        if self.case.gone is not None:
            _, back, gone = self.case.gone
            if sent < back <= self.k and gone in (link, link.source, link.target):
                return 0.0  # what was under way when it was lost is lost
        return self.cells[link.source].seen[sent]

    def receive(self, number: int, late: bool) -> None:
        """What spikes do to a synapse, in a step: those that have a delay before what each step does, others behind."""
        link = self.case.links[number]
        if link.kind != "synapse" or self.lost(link):
            return
        if (link.delay == 0) == late and self.came(number):
            self.g[number] += self.weights[number]
        if not late:
            self.g[number] /= 2

    def arriving(self) -> list[float]:
        """What each neuron is given at its port, behind what spikes with a delay do, before those without one."""
        given = [0.0] * len(self.cells)
        for number, link in enumerate(self.case.links):
            if link.kind == "synapse":
                given[link.target] += 0.0 if self.lost(link) else self.g[number]
            elif link.delay > 0 and self.came(number):
                given[link.target] += self.left[number][self.k - link.delay]
        return given

    def kicks_now(self) -> list[float]:
        """What the spikes of this step bring without delay."""
        given = [0.0] * len(self.cells)
        for number, link in enumerate(self.case.links):
            if link.kind != "synapse" and link.delay == 0:
                given[link.target] += self.weights[number] * self.came(number)
        return given

    def learn(self) -> None:
        """Phase by phase, in each the rules of a connection in their order, each from what was there before it."""
        for number, link in enumerate(self.case.links):
            paused, which = self.case.paused or (STEPS, None)
            if self.lost(link) or (which == link and self.k >= paused):
                continue
            for phase in ("on_pre", "on_post", "each_step"):
                for rule in link.rules:
                    if phase == "on_pre" and not self.came(number):
                        continue
                    if phase == "on_post" and not self.cells[link.target].seen[self.k]:
                        continue
                    getattr(self, f"{rule}_{phase}")(number)
                    self.weights[number] = min(max(self.weights[number], -BOUND), BOUND)

    def pair_on_pre(self, number: int) -> None:
        self.weights[number] -= self.b[number]
        self.a[number] += 1 / 4

    def pair_on_post(self, number: int) -> None:
        self.weights[number] += self.a[number]
        self.b[number] += 1 / 8

    def pair_each_step(self, number: int) -> None:
        self.a[number] /= 2
        self.b[number] /= 2

    def count_on_pre(self, number: int) -> None:
        self.weights[number] += 1 / 16
        self.n[number] += 1

    def count_on_post(self, number: int) -> None:
        self.weights[number] /= 2
        self.n[number] += 2

    def count_each_step(self, number: int) -> None:
        self.weights[number] += self.n[number] / 64


def made_case(chooser: random.Random) -> Case:
    """A case in which neurons fire."""
    size = chooser.randint(1, 3)
    links = []
    for source in range(size):
        for target in range(size):
            if chooser.random() < 0.6:
                kind = chooser.choice(["plain", "plain", "synapse"])
                rules = chooser.choice([(), (), ("pair",), ("count",), ("pair", "count"), ("count", "pair")])
                delay, weight = chooser.choice([0, 1, 1, 2]), chooser.choice([0.5, 1, 1.25, -0.5])
                links.append(Link(source, target, delay, weight, kind, rules))
    first = chooser.randint(1, 10)
    span = first, first + chooser.randint(1, 6)
    held = (*span, chooser.randrange(size), chooser.choice([1.0, 0.0, 0.5])) if chooser.random() < 0.4 else None
    gone = None
    if chooser.random() < 0.4:
        gone = (*span, chooser.choice([*range(size), *links]))
    learning = [link for link in links if link.rules]
    paused = (first, chooser.choice(learning)) if learning and chooser.random() < 0.2 else None
    return Case(
        [chooser.choice([0.0, 0.25, 0.75, 1.5]) for _ in range(size)],
        [chooser.choice([0.0, 0.5, 1.0, 1.75]) for _ in range(size)],
        chooser.choice([None, *SETS]),
        chooser.choice([*RESTS]),
        chooser.choice([(), ("v",), ("w",), ("v", "w")]),
        links, held, gone, paused,
    )  # fmt: skip


@settings(max_examples=60, deadline=None, phases=(Phase.explicit, Phase.generate))
@given(seed=st.integers(0, 2**32), backend=st.sampled_from(["reference", "numpy"]))
def test_a_network_that_spikes_does_what_the_contract_says(seed: int, backend: str) -> None:
    follow(made_case(random.Random(seed)), backend)


def follow(case: Case, backend: str) -> None:
    """Spikes, states and weights of each step, bit for bit."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        network = nv.compile(case.spec())
        run = network.run(STEPS, backend=backend, states="all")
    by_hand = ByHand(case)
    learned = [number for number, link in enumerate(case.links) if link.rules]
    for k in range(STEPS):
        np.testing.assert_array_equal(
            run.weights[k][: len(learned)], [by_hand.weights[number] for number in learned], f"w[{k}]"
        )
        by_hand.step()
        expected = [cell.seen[k] for cell in by_hand.cells]
        np.testing.assert_array_equal(run.activity[k], expected, f"spikes of step {k}")
        for name in ("v", "w"):
            found = [float(run[f"N{number + 1}.{name}"][k].item()) for number in range(len(by_hand.cells))]
            np.testing.assert_array_equal(found, [getattr(cell, name) for cell in by_hand.cells], f"{name} at {k}")


def test_inspect_says_when_a_spike_counts() -> None:
    """A spike that arrives makes its target jump before the threshold; one of the same step behind all, and so do
    synapses and rules that wait for it."""
    compiled = nv.compile_text("""
neurovis: 1
name: order
time: {dt: 0.1 ms}
models:
  cell:
    time: ms
    ports: [kicks]
    state: {v: {derivative: (drive - v)/20, jump: kicks}}
    spike: {when: v >= 1, set: {v: 0}}
synapses: {slow: {time: ms, state: {g: {derivative: -g/5, on_pre: g + weight}}, signal: g*(3 - post.v)}}
rules: {timing: {weight: {on_pre: weight + 0.01, on_post: weight - 0.01}}}
neurons: {A: {model: cell, bias: 2}, B: {model: cell}}
connections:
  A -> B: {weight: 0.1, port: kicks, plasticity: timing}
  B -> A: {weight: 0.2, port: kicks, delay: 0}
  A -> A: {weight: 0.1, synapse: slow}
""")
    shown = [" ".join(line.split()) for line in overview(compiled).splitlines()]
    order = ["integrate A B v (rk4)", "on_pre A -> A g", "jump A B v", "fire A B v, spike", "update A B"]
    order += ["jump, behind all spikes A B v", "on_pre A -> B weight", "on_post A -> B weight"]
    assert [line for line in shown if line in order] == order
    assert "spikes that arrive before the threshold is tested A -> B, A -> A" in shown
    assert "spikes that act behind all of their step B -> A" in shown


def test_inspect_says_nothing_of_rules_that_wait_for_no_spikes() -> None:
    """Several rules of a connection have an order, too, which their list says."""
    compiled = nv.compile_text("""
neurovis: 1
name: rules
time: {dt: 0.01}
models: {cell: {state: {v: {derivative: drive - v}}, activity: v}}
neurons: {A: {model: cell, bias: 1}, B: {model: cell}}
connections: {A -> B: {weight: 0.1, plasticity: [hebbian, decay]}}
""")
    assert "integrate  A B  v (rk4)\n  update     A B\n" in overview(compiled)
    assert "each_step" not in overview(compiled)
