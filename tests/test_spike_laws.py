"""What a step with spikes is, against an interpreter of its own: who sees a spike when, what comes before what, who can
fire and who is held."""

from __future__ import annotations

import random
from dataclasses import dataclass, field

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

import neurovis_spec as nv
from neurovis_spec.cli.overview import overview
from neurovis_spec.runtime.columns import Keep
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.record import record

STEPS = 25


@dataclass
class Joined:
    """A connection; one that learns doubles its weight when a spike arrives, takes it by 0.75 where its target fires,
    and subtracts a little at each step."""

    source: int
    target: int
    weight: float
    delay: int
    learns: bool
    sent: dict[int, float] = field(default_factory=dict)

    def learn(self, arrives: bool, fires: bool) -> None:
        self.weight = within(2 * self.weight) if arrives else self.weight
        self.weight = within(0.75 * self.weight) if fires else self.weight
        self.weight = within(self.weight - 0.0625)


def within(weight: float) -> float:
    return min(max(weight, -1.5), 1.5)


@dataclass
class Cell:
    """A neuron: it decays towards its drive, jumps, is cut, fires. ``rest``: for how many steps it cannot fire."""

    v: float
    drive: float
    resets: bool
    rest: int
    holds: bool
    armed: bool = True
    fired: list[int] = field(default_factory=list)

    def rests(self, k: int) -> bool:
        return bool(self.fired) and k <= self.fired[-1] + self.rest

    def held(self, k: int) -> bool:
        return self.holds and bool(self.fired) and self.fired[-1] < k <= self.fired[-1] + self.rest

    def advance(self, k: int, kick: float) -> None:
        """To the end of step k, before what acts now: integrated, kicked, cut, tested, reset."""
        if not self.held(k):
            self.v += 1.0 * (0.25 * (self.drive - self.v))
            self.v += kick
            self.v = min(self.v, 3.0)
        fires = self.v >= 1 and self.armed and not self.rests(k)
        if fires:
            self.fired.append(k)
            if self.resets:
                self.v = self.v - 1
        self.armed = self.v < 1 or (self.armed and not fires)


@dataclass
class Case:
    cells: list[Cell]
    joined: list[Joined]
    #: who is held, at what, from when on, until when
    clamp: tuple[int, float, int, int]

    def run(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What is seen of each neuron, v and the weights of all connections, at each step."""
        seen: list[list[bool]] = []
        voltages, weights = [], []
        who, value, first, end = self.clamp
        for k in range(STEPS):
            if k > 0:
                for number, cell in enumerate(self.cells):
                    cell.advance(
                        k, sum((one.sent.get(k - one.delay, 0.0) for one in self._into(number) if one.delay), 0.0)
                    )
            fires = [k in cell.fired for cell in self.cells]
            if first <= k < end:
                fires[who] = value != 0
            for one in self.joined:
                one.sent[k] = one.weight if fires[one.source] else 0.0
            for number, cell in enumerate(self.cells if k > 0 else ()):
                # one that fires in this step is held from the next one on
                if not cell.held(k):
                    cell.v += sum((one.sent[k] for one in self._into(number) if not one.delay), 0.0)
            seen.append(fires)
            voltages.append([cell.v for cell in self.cells])
            weights.append([one.weight for one in self.joined if one.learns])
            for one in self.joined:
                if one.learns:
                    then = k - one.delay
                    one.learn(then >= 0 and seen[then][one.source], fires[one.target])
        return np.array(seen, dtype=float), np.array(voltages), np.array(weights)

    def _into(self, target: int) -> list[Joined]:
        return [one for one in self.joined if one.target == target]

    @property
    def text(self) -> str:
        """The same as a spec."""
        lines = [HEAD]
        models = {(cell.resets, cell.rest, cell.holds) for cell in self.cells}
        lines.append("models:")
        for resets, rest, holds in sorted(models):
            block = ["when: v >= 1", f"refractory: {rest}"]
            block += ["set: {v: v - 1}"] if resets else []
            block += ["hold: v"] if holds else []
            lines.append(f"  {named(resets, rest, holds)}:\n{MODEL}\n    spike: {{{', '.join(block)}}}")
        lines.append("neurons:")
        for number, cell in enumerate(self.cells):
            model = named(cell.resets, cell.rest, cell.holds)
            lines.append(f"  N{number}: {{model: {model}, bias: {cell.drive}, initial: {{v: {cell.v}}}}}")
        lines.append("connections:")
        for one in self.joined:
            learns = ", plasticity: rule, bounds: [-1.5, 1.5]" if one.learns else ""
            ends = f"N{one.source} -> N{one.target}"
            lines.append(f"  - {ends}: {{weight: {one.weight}, delay: {one.delay}, port: kick{learns}}}")
        who, value, first, end = self.clamp
        return "\n".join([*lines, f"events: [{{from: {first}, to: {end}, clamp: {{N{who}: {value}}}}}]"])


HEAD = """neurovis: 1
name: law
time: {dt: 1, integrate: euler}
rules: {rule: {weight: {on_pre: 2*weight, on_post: 0.75*weight, each_step: weight - 0.0625}}}"""
MODEL = """    ports: [kick]
    state: {v: {derivative: 0.25*(drive - v), jump: kick, each_step: "min(v, 3)"}}"""


def named(resets: bool, rest: int, holds: bool) -> str:
    return f"m{resets:d}{rest}{holds:d}"


@st.composite
def cases(draw: st.DrawFn) -> Case:
    chooser = random.Random(draw(st.integers(0, 2**32)))
    count = draw(st.integers(1, 4))
    cells = [
        Cell(
            chooser.choice([0.0, 0.5, 0.9, 1.5]), chooser.choice([0.0, 0.5, 1.2, 2.5]),
            chooser.random() < 0.7, chooser.choice([0, 0, 1, 2, 4]), chooser.random() < 0.5,
        )
        for _ in range(count)
    ]  # fmt: skip
    joined = [
        Joined(
            source, target, chooser.choice([0.25, -0.5, 0.75]), chooser.choice([0, 0, 1, 2, 3]), chooser.random() < 0.4
        )
        for source in range(count)
        for target in range(count)
        if chooser.random() < 0.7
    ]
    joined = joined or [Joined(0, 0, 0.5, 1, False)]
    first = chooser.randint(1, STEPS)
    clamp = chooser.randrange(count), chooser.choice([0.0, 1.0, 0.5]), first, first + chooser.randint(1, 6)
    return Case(cells, joined, clamp)


@settings(max_examples=60, deadline=None)
@given(case=cases())
def test_a_step_is_what_the_contract_says(case: Case) -> None:
    compiled = nv.compile_text(case.text)
    run = record(compiled.network, Course(STEPS, backend="reference", keep=Keep(states=("all",))))
    seen, voltages, weights = case.run()
    np.testing.assert_array_equal(run.activity, seen)
    np.testing.assert_array_equal(np.stack([run[f"N{i}.v"] for i in range(len(case.cells))], axis=1), voltages)
    if any(one.learns for one in case.joined):
        np.testing.assert_array_equal(run.weights, weights)


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
