"""Laws of the live view: whatever is done to a source in whatever order, it stands where the same events lead from the
start, bit for bit; and nothing that is raised ends it."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from queue import SimpleQueue
from threading import Event
from typing import Any, cast

import numpy as np
import pytest
import toy_bodies
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from toy_bodies import carted, registered

import neurovis_spec as nv
from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.live import simulated
from neurovis_spec.live.carry import carried
from neurovis_spec.live.commands import REQUESTS, Branch, Command, Pause, Play, Restart, Seek, Step
from neurovis_spec.live.commands import Event as ToEvent
from neurovis_spec.live.desk import Desk
from neurovis_spec.live.hub import Client, Hub, Reception
from neurovis_spec.live.live import Edited, Edits
from neurovis_spec.live.run import Run, Shown
from neurovis_spec.live.saving import told_by
from neurovis_spec.live.show import Show
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.live.source import Seen, Source, SourceError
from neurovis_spec.live.turns import (
    Feed,
    Hold,
    Learn,
    Lesion,
    Mend,
    Release,
    Set,
    Turn,
    Turned,
    Weigh,
    feed,
    rules,
    taken,
    turn,
)
from neurovis_spec.live.view import View, view_of
from neurovis_spec.notebook import widget as notebook
from neurovis_spec.runtime.recording import Snapshot
from neurovis_spec.runtime.simulation import ParameterError, Simulation

SPEC = """neurovis: 1
name: lawful
time: {dt: 0.05, steps: 40}
parameters: {mix: 0.5, pull: {value: 0.1, min: 0, max: 1}, twice: 2 * pull}
inputs: {push: {}}
neurons:
  A: {count: 3, activation: tanh, noise: "normal(0, 0.05)"}
  B: {activation: tanh, input: push, bias: twice}
  S: {model: integrate_and_fire, bias: 0.4}
connections:
  A -> A: {pattern: all_to_all, weight: "uniform(-1, 1)", delay: 2}
  A -> B: {weight: mix, plasticity: {hebbian: {rate: 0.05}}}
  B -> B: pull
  S -> A: twice
events:
  - {at: 6, lesion: [A2]}
  - {at: 9, mend: [A2]}
  - {at: 9, set: {pull: pull + 0.2}}
  - {from: 4, to: 12, clamp: {A1: pull}}
  - {at: 11, learning: {A -> B: false}}
  - {at: 5, feed: {push: 0.3}}
  - {at: 10, feed: {push: null}}
outputs: {drive: B, charge: S.v}
"""
PARTS = """neurovis: 1
name: parted
time: {dt: 0.05, steps: 40, episode: 10}
parameters: {gain: 0.7}
modules:
  leg:
    parameters: {strength: 1}
    neurons: {K: {count: 2, activation: tanh, bias: 0.3}, O: {activation: tanh}}
    connections: {K -> O: {weight: strength * 0.5, plasticity: {oja: {rate: 0.1}}}, O -> K: {weight: -0.4, delay: 3}}
neurons: {C: {activation: tanh, bias: 0.2}}
instances: {left: {module: leg, count: 2, set: {strength: gain}}, right: {module: leg}}
connections:
  C -> left1.K: {pattern: all_to_all, weight: gain}
  right.O -> C: 0.5
"""
FLOWS = """neurovis: 1
name: flowing
time: {dt: 10 ms, steps: 40, episode: 15, integrate: {method: exponential, substeps: 2}}
parameters: {gain: 0.7, pull: {value: 60, unit: ms}}
inputs: {push: {}, wave: {expression: sin(t) if t >= 0.05 else pull/100}}
models:
  rate:
    time: ms
    parameters: {tau: {value: 50, unit: ms}}
    ports: [gate]
    let: {leak: -v}
    state:
      v: {initial: 0.1, derivative: (leak + f(drive)*(1 - gate))/tau, noise: 0.02}
      w: {derivative: (v - w)/(2*tau), each_step: "clip(w, -1, 1)", each_episode: w/2}
    outputs: {both: v - w}
    activity: f(v + drive)
    send: both
modules:
  half:
    parameters: {tau: {value: 50, unit: ms}}
    neurons: {K: {count: 2, model: {rate: {tau: [tau, 2*tau]}}, activation: tanh}, O: {model: {rate: {tau: tau}}}}
    connections: {K -> O: {weight: 0.8, port: {drive: 1, gate: 0.4}, plasticity: {oja: {rate: 0.1}}}}
neurons:
  A: {count: 2, model: rate, activation: tanh, bias: {gate: gain}, input: wave}
  B: {input: push, activation: tanh}
instances: {left: {module: half, set: {tau: pull}}, right: {module: half, count: 2, set: {tau: 1.5*pull}}}
connections:
  A -> left.K: {weight: gain, pattern: all_to_all, send: v}
  left.O -> A: {weight: -gain, pattern: all_to_all, delay: 2}
  right.O -> B: 0.4
  B -> A: {weight: gain, port: gate}
events:
  - {from: 4, to: 12, clamp: {A1.v: gain}}
  - {at: 9, set: {pull: 2*pull}}
  - {at: 11, lesion: [left.O]}
  - {at: 14, mend: [left.O]}
outputs: {seen: A.w}
render: {show: {A: both}}
"""


SPIKES = """neurovis: 1
name: firing
time: {dt: 1 ms, steps: 40, episode: 15}
parameters: {gain: 1.4, rest: {value: 2, unit: ms}, rate: {value: 150, min: 0, max: 900}}
inputs: {rain: {size: 2, poisson: rate}, train: {spikes: {times: [[0.002, 0.005, 0.006]]}}, push: {}}
models:
  cell:
    time: ms
    parameters: {tau: {value: 8, unit: ms}, rest: 2}
    ports: [kick]
    let: {high: 1 + 0.01*drive}
    state:
      v: {initial: 0.4, derivative: (drive - v)/tau, noise: 0.05, jump: kick}
      w: {each_step: 0.9*w + spike}
    spike: {when: v >= high, set: {v: v - 1}, refractory: rest, hold: v}
    send: spike
modules:
  leg:
    parameters: {w: 0.3}
    inputs: {load: {}}
    neurons: {S: {model: spike_source, input: load}, C: {count: 2, model: cell, bias: 1.2}}
    connections:
      S -> C: {weight: w, pattern: all_to_all, port: kick, plasticity: stdp}
      C -> C: {weight: -w, pattern: ring, port: kick, synapse: exponential}
neurons:
  R: {count: 2, model: spike_source, input: rain}
  A: {count: 2, model: {cell: {rest: rest}}, bias: gain, input: push}
instances: {left: {module: leg, count: 2, inputs: {load: train}}, right: {module: leg, set: {w: gain/2}}}
connections:
  R -> A: {weight: 0.5, pattern: all_to_all, port: kick, delay: 2 ms, plasticity: stdp_triplet}
  A -> left.C: {weight: 0.4, pattern: all_to_all, port: kick, delay: 0}
  right.C -> A: {weight: 0.5, pattern: one_to_one, synapse: tsodyks_markram, port: kick, delay: 3}
events:
  - {from: 4, to: 12, clamp: {A1.v: gain}}
  - {from: 6, to: 9, clamp: {left1.C2: 1}}
  - {at: 9, set: {rest: 2*rest, rate: 3*rate}}
  - {at: 11, lesion: [A2]}
  - {at: 14, mend: [A2]}
outputs: {seen: A.w}
"""


#: What can be turned: in order neurons, connections, rules, inputs, and parameters with the values that they are given.
@dataclass(frozen=True)
class Kind:
    compiled: Callable[[], CompiledNetwork]
    neurons: Sequence[str]
    connections: Sequence[str]
    rules: Sequence[str]
    inputs: Sequence[str]
    parameters: Sequence[str]

    def turns(self) -> st.SearchStrategy[Turn]:
        """Any turn, sensible or not."""
        value, moving = st.sampled_from([0.0, 0.25, 0.6, 1.5, -0.75]), st.booleans()
        neurons, parts = st.sampled_from([*self.neurons, "Q"]), st.sampled_from([*self.neurons, *self.connections])
        chosen: list[st.SearchStrategy[Turn]] = [st.builds(Hold, neurons, value, moving), st.builds(Release, neurons)]
        chosen += [st.builds(Lesion, parts), st.builds(Mend, parts)]
        chosen.append(st.builds(Weigh, st.sampled_from([*self.connections, "A1"]), value, moving))
        names = st.sampled_from([*self.parameters, "q"])
        chosen.append(st.builds(lambda name, one, drag: Set({name: one}, drag), names, value, moving))
        if self.rules:
            chosen.append(st.builds(Learn, st.sampled_from(self.rules), st.booleans()))
        if self.inputs:
            values = st.sampled_from([(), (0.5,), (0.1, 0.2)])
            chosen.append(st.builds(Feed, st.sampled_from(self.inputs), values, moving))
        return st.one_of(chosen)


_CART = toy_bodies.SPEC.replace("parameters: {gain: 0.8}", "parameters: {gain: 0.8, much: -0.7}").replace(
    "weight: -0.7", "weight: much"
).replace("episode: 40", "episode: 10")  # fmt: skip
_PLAIN = (
    ["A", "A2", "B", "S"],
    ["A -> B", "A1 -> A2", "S -> A"],
    ["A -> B", "A1 -> B"],
    ["push"],
    ["mix", "pull", "twice"],
)
_LEGS = (
    ["C", "left.K", "left1.K1", "right.O"], ["left.K -> left.O", "right.O -> C", "C -> left1.K"],
    ["left1.K -> left1.O"], (), ["gain"],
)  # fmt: skip
_FLOWING = (
    ["A", "A2", "B", "left.K", "right2.O"],
    ["A -> left.K", "left.K -> left.O", "B -> A", "left.O -> A"],
    ["left.K -> left.O"],
    ["push"],
    ["gain", "pull"],
)
_FIRING = (
    ["R", "A", "A2", "left.C", "left1.C2", "right.S"],
    ["R -> A", "A -> left.C", "right.C -> A", "left.C -> left.C"],
    ["R -> A", "left1.S -> left1.C"],
    ["push"],
    ["gain", "rest", "rate"],
)
_CARTED = (["P", "A1", "O"], ["P -> O", "W -> O"], ["W -> O"], ["place", "arms"], ["gain", "much"])
KINDS = {
    "plain": Kind(lambda: nv.compile_text(SPEC), *_PLAIN),
    "parts": Kind(lambda: nv.compile_text(PARTS), *_LEGS),
    "flows": Kind(lambda: nv.compile_text(FLOWS), *_FLOWING),
    "spikes": Kind(lambda: nv.compile_text(SPIKES), *_FIRING),
    "body": Kind(lambda: carted(spec=_CART), *_CARTED),
    "whole body": Kind(lambda: carted("whole", spec=_CART), *_CARTED),
    "short body": Kind(lambda: carted("short", spec=_CART, each_episode=False), *_CARTED),
}


@cache
def compiled_of(name: str) -> CompiledNetwork:
    """The network of a kind."""
    return KINDS[name].compiled()


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """States are kept more often, so that what takes long to happen happens soon."""
    registered(monkeypatch)
    monkeypatch.setattr(simulated, "EVERY", 8)


@dataclass(frozen=True, eq=False)
class Stand:
    """How a run stands behind a step."""

    seen: Seen
    parameters: Mapping[str, float]
    fed: Mapping[str, tuple[float, ...]]
    stopped: Sequence[bool]


class Fragile(Simulation):
    """One that raises once, before or behind a call of one of its methods: ``fails`` says of which, and how many calls
    from now."""

    fails: tuple[str, int] = "", 0

    def _call(self, name: str) -> None:
        which, left = self.fails
        if which == name:
            self.fails = ("", 0) if not left else (name, left - 1)
            if not left:
                raise RuntimeError(f"{name} is out of order")

    def step(self, *values: Any, **inputs: Any) -> Any:
        self._call("step")
        made = super().step(*values, **inputs)
        self._call("stepped")
        return made

    def restore(self, state: Any) -> None:
        self._call("restore")
        super().restore(state)
        self._call("restored")

    def state(self) -> Any:
        self._call("state")
        return super().state()

    def set(self, *values: Any, **parameters: Any) -> None:
        super().set(*values, **parameters)
        self._call("set")

    def lesion(self, *parts: str) -> None:
        super().lesion(*parts)
        self._call("lesion")


class Model:
    """What should be: of all turns each with its step, and from the start on."""

    def __init__(self, compiled: CompiledNetwork) -> None:
        self.compiled = compiled
        self.turns: list[tuple[int, Turn]] = []
        self._stands: list[Stand] = []

    def at(self, step: int) -> Stand:
        """A fresh simulator that is told the same, from the start."""
        if step >= len(self._stands):
            self._stands = list(self._from_start(step + 8))
        return self._stands[step]

    def _from_start(self, steps: int) -> Iterator[Stand]:
        run, fed, before = self.compiled.simulator(), dict[str, tuple[float, ...]](), None
        for step in range(steps):
            weights, pose, masks = run.connection_weights, run.pose, (*run.lesioned, run.held)
            with suppress(ParameterError):  # the events do not go with what was turned
                run.step({name: values if len(values) > 1 else values[0] for name, values in fed.items()})
            snapshot = Snapshot(step, run.activity, weights, before, None, pose, run.sensed)
            for what in (what for at, what in self.turns if at == step):
                if isinstance(what, Feed):
                    fed = feed(run, fed, what)
                else:
                    turn(run, what)
                masks = (*run.lesioned, run.held)
            before = weights
            yield Stand(Seen(snapshot, *masks), dict(run.parameters), {**run.fed, **fed}, run.stopped.tolist())

    def turned(self, step: int, what: Turn) -> None:
        """A turn was taken."""
        self.forget(step)
        before = [Turned(at, one) for at, one in self.turns]
        self.turns = [(entry.step, entry.turn) for entry in taken(before, Turned(step, what))]
        del self._stands[step:]

    def forget(self, step: int) -> None:
        """What came after a step is forgotten."""
        self.turns = [entry for entry in self.turns if entry[0] <= step]
        del self._stands[step + 1 :]


def bits(values: FloatArray | None) -> bytes | None:
    """All of an array."""
    return None if values is None else values.tobytes()


def compare(source: SimulatedSource, model: Model) -> None:
    """That it stands where it should."""
    wanted, seen = model.at(source.step), source.seen()
    one, other = seen.snapshot, wanted.seen.snapshot
    for name in ("activity", "weights", "pose", "sensors"):
        assert bits(getattr(one, name)) == bits(getattr(other, name)), name
    if one.previous_weights is not None:
        assert bits(one.previous_weights) == bits(other.previous_weights)
    for mask in ("lesioned_neurons", "lesioned_connections", "clamped"):
        assert np.array_equal(getattr(seen, mask), getattr(wanted.seen, mask)), mask
    structural = model.compiled.network.structural
    assert source.parameters == {n: value for n, value in wanted.parameters.items() if n not in structural}
    assert source.fed == wanted.fed
    for rule in rules(source.network):
        stopped = np.array(wanted.stopped)[rule.members]
        assert source.learning[rule.connections] == (None if stopped.any() != stopped.all() else not stopped.any())
    assert [entry.step for entry in source.turned] == sorted(entry.step for entry in source.turned)
    assert {entry.step for entry in source.turned} <= {step for step, _ in model.turns}


#: A command: its name and a number, or a turn.
Doing = tuple[str, int] | Turn


def doings(kind: Kind) -> st.SearchStrategy[list[Doing]]:
    """Sequences of what can be done."""
    often, seldom = ["advance", "back", "go", "go", "recall"], ["event", "branch", "restart", "edit", "undo"]
    moves, others = (st.tuples(st.sampled_from(names), st.integers(0, 12)) for names in (often, seldom))
    begun: Doing = ("advance", 9)
    return st.lists(st.one_of(moves, kind.turns(), moves, kind.turns(), others), max_size=14).map(
        lambda all: [begun, *all]
    )


def broken_doings(kind: Kind) -> st.SearchStrategy[list[Doing]]:
    """The same, with a simulation that raises on the way."""
    what = st.sampled_from(
        [f"fail {name}" for name in ("step", "stepped", "restore", "restored", "state", "set", "lesion")]
    )
    one = st.tuples(what, st.integers(0, 3))
    return st.lists(st.tuples(one, doings(kind)), max_size=3).map(
        lambda parts: [doing for fail, more in parts for doing in (*more[:4], fail, *more[4:])]
    )


def do(source: SimulatedSource, model: Model, doing: Doing) -> SimulatedSource:
    """Carry it out in both."""
    first, last = source.reach.first, source.reach.last
    match doing:
        case ("advance", by):
            for _ in range(by):
                source.advance()
        case ("back", by):
            source.go(source.number_after(-by))
        case ("go", share):
            source.go(first + (last - first) * share // 12)
        case ("event", _):
            source.go(min(max(first, 9), last))
        case ("recall", steps):
            here = source.step
            assert [one.snapshot.step for one in source.recall(steps + 1)] == list(
                range(max(first, here - steps), here + 1)
            )
        case ("branch", _):
            source.branch()
            model.forget(source.step)
        case (name, calls) if name.startswith("fail "):
            cast(Fragile, source._simulation).fails = name.removeprefix("fail "), calls
        case ("undo", which):
            if source._turned:
                number = source._turned[which % len(source._turned)].number
                with suppress(SourceError):
                    source.take_back(number)
                model.forget(-1)
                model.turns = [(entry.step, entry.turn) for entry in source._turned]
        case ("restart", _):
            source.restart()
            model.forget(-1)
        case ("edit", _):
            source = carried(source, Fragile(model.compiled.network))
            model.forget(source.step)
        case Set() | Feed() | Hold() | Release() | Lesion() | Mend() | Learn() | Weigh():
            with suppress(SourceError):
                source.turn(doing)
                model.turned(source.step, doing)
    return source


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("name", KINDS)
@given(data=st.data())
@settings(max_examples=16, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_whatever_is_done_it_stands_where_the_same_events_lead_from_the_start(name: str, data: st.DataObject) -> None:
    compiled = compiled_of(name)
    source, model = SimulatedSource(compiled.simulator()), Model(compiled)
    for doing in data.draw(doings(KINDS[name])):
        source = do(source, model, doing)
        compare(source, model)
    for step in (source.reach.first, source.reach.last):
        source.go(step)
        compare(source, model)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("name", ["plain", "body"])
@given(data=st.data())
@settings(max_examples=10, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_what_raises_on_the_way_changes_nothing(name: str, data: st.DataObject) -> None:
    compiled = compiled_of(name)
    source, model = SimulatedSource(Fragile(compiled.network)), Model(compiled)
    for doing in data.draw(broken_doings(KINDS[name])):
        with suppress(RuntimeError):
            source = do(source, model, doing)
        compare(source, model)


#: All of a Source that a run asks.
METHODS = ("advance", "go", "restart", "recall", "branch", "turn", "seen", "after", "number_after", "step",
           "reach", "turned", "parameters", "fed", "learning", "history", "capabilities")  # fmt: skip


class Broken:
    """A source one of whose members raises, as long as it is ``broken``."""

    def __init__(self, source: Source) -> None:
        self._source, self.broken = source, ""

    def __getattr__(self, name: str) -> object:
        if name == self.broken:
            raise RuntimeError(f"{name} is out of order")
        return getattr(self._source, name)


class Driven:
    """A run that stands still, and what it says."""

    def __init__(self, source: Source, view: View) -> None:
        self.shown: list[Shown] = []
        self.told: list[str] = []
        self.run = Run(source, view, self.shown.append, tell=self.told.append, playing=False)
        self.run.start()

    def ask(self, command: Command) -> str:
        """Why it is not done; nothing where it is."""
        answer: SimpleQueue[str] = SimpleQueue()
        self.run.ask(command, answer.put, lambda: answer.put(""))
        return answer.get(timeout=20)

    def inquire(self, what: Callable[[Source], object]) -> object:
        """What a function of the source gives."""
        answer: SimpleQueue[object] = SimpleQueue()
        self.run.inquire(lambda source: answer.put(what(source)), answer.put)
        return answer.get(timeout=20)


COMMANDS: Sequence[Command] = (
    Step(3), Step(-3), Seek(1), Seek(30), ToEvent(1), Branch(), Restart(), Set({"pull": 0.3}), Hold("A", 0.5),
    Lesion("B"), Feed("push", (1.0,)), Learn("A -> B", False), Play(), Pause(),
)  # fmt: skip


@pytest.mark.parametrize("member", METHODS)
def test_what_a_source_raises_is_told_and_the_run_goes_on_as_it_was(
    member: str, caplog: pytest.LogCaptureFixture
) -> None:
    compiled = compiled_of("plain")
    whole = SimulatedSource(compiled.simulator())
    source = Broken(whole)
    driven = Driven(cast(Source, source), view_of(compiled, compiled.gains))
    begun: Sequence[Command] = Step(5), Set({"pull": 0.6}), Step(5)
    for command in begun:
        assert driven.ask(command) == ""
    model = Model(compiled)
    model.turned(5, Set({"pull": 0.6}))
    for command in COMMANDS:
        source.broken = member
        refused = driven.ask(command)
        if (isinstance(command, Play) and member == "advance") or (command == Seek(30) and member == "step"):
            while not driven.told:
                time.sleep(0.001)
        told, driven.told[:] = [*driven.told], []
        source.broken = ""
        assert all(f"RuntimeError: {member} is out of order" in words for words in [refused, *told] if words)
        if not refused:  # it was done without that member
            driven.ask(Pause())
            driven.ask(Restart())
            for again in begun:
                assert driven.ask(again) == ""
        driven.inquire(lambda _: compare(whole, model))
        assert driven.inquire(lambda source: source.step) == 10
    source.broken = member
    answer = driven.inquire(lambda source: told_by(source, 3))
    source.broken = ""
    if isinstance(answer, str):
        assert f"RuntimeError: {member} is out of order" in answer
    assert driven.ask(Step(1)) == ""
    assert driven.shown[-1].glance.step == 11
    assert isinstance(driven.run.failure, RuntimeError)
    assert caplog.records
    driven.run.end()


def test_whoever_looks_on_may_fail_and_the_run_goes_on(caplog: pytest.LogCaptureFixture) -> None:
    compiled = compiled_of("plain")

    def gone(*given: object) -> None:
        raise RuntimeError("this loop is closed")

    source, answer = SimulatedSource(compiled.simulator()), SimpleQueue[int]()
    run = Run(source, view_of(compiled, compiled.gains), gone, tell=gone, playing=False)
    run.start()
    for command in (Step(2), Seek(-1), Step(3)):
        run.ask(command, gone, gone)
    run.inquire(lambda source: answer.put(source.step), gone)
    assert answer.get(timeout=20) == 5
    run.end()
    assert "this loop is closed" in caplog.text


MESSAGES = st.one_of(
    st.builds(lambda by: {"type": "step", "by": by}, st.integers(-20, 30)),
    st.builds(lambda step: {"type": "seek", "step": step}, st.integers(0, 40)),
    st.builds(lambda by: {"type": "event", "by": by}, st.sampled_from([-1, 1])),
    st.builds(lambda name, value: {"type": "set", "values": {name: value}}, st.sampled_from(["mix", "pull", "q"]),
              st.sampled_from([0, 0.25, 0.5, 7])),
    st.builds(lambda part, kind: {"type": kind, "part": part},
              st.sampled_from(["A", "B", "A -> B", "A1 -> A2", "->", "Q"]), st.sampled_from(["lesion", "mend"])),
    st.builds(lambda on: {"type": "learn", "connections": "A -> B", "on": on}, st.booleans()),
    st.builds(lambda value: {"type": "weigh", "connections": "A1 -> A2", "value": value}, st.sampled_from([0, 0.5])),
    st.builds(lambda value: {"type": "hold", "neurons": "A", "value": value}, st.sampled_from([0, 0.5])),
    st.builds(lambda values: {"type": "feed", "name": "push", "values": values}, st.sampled_from([[], [1], [1, 2]])),
    st.builds(lambda kind, number: {"type": kind, "number": number},
              st.sampled_from(["undo", "undo", "switch", "switch", "forget"]), st.integers(0, 3)),
    st.builds(lambda number: {"type": "rename", "number": number, "name": " a  b"}, st.integers(0, 3)),
    st.sampled_from([{"type": "release", "neurons": "A"}, {"type": "restore"}, {"type": "branch"},
                     {"type": "restart"}, {"type": "pause"},
                     {"type": "look", "items": ["n0", "c99"]},
                     {"type": "trace", "items": ["n0"], "rasters": ["n1", "n99"], "first": 0, "every": 2, "bins": 9},
                     {"type": "fit", "window": "tall"}, {"type": "fit", "window": "wide"},
                     {"type": "fetch", "what": "npz", "seconds": 1}]),
)  # fmt: skip


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@given(sent=st.lists(MESSAGES, max_size=25))
@settings(max_examples=10, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_messages_of_a_client_lead_where_the_turns_that_are_told_lead_from_the_start(
    sent: list[dict[str, object]],
) -> None:
    compiled = compiled_of("plain")
    source, view = SimulatedSource(compiled.simulator()), view_of(compiled, compiled.gains)

    async def talk() -> None:
        hub = Hub(asyncio.get_running_loop(), REQUESTS)
        run = Run(source, view, hub.show, lambda: hub.watched, playing=False)
        desk = Desk(compiled, None, lambda *_: view, run, lambda text: hub.tell_soon(text))
        reception, client = Reception(hub, run, desk), Client(owner=True)
        hub.join(client)
        run.start()
        desk.start()
        try:
            for message in sent:
                reception.take(client, json.dumps(message))
                await asyncio.sleep(0)
            reception.take(client, json.dumps({"type": "step", "by": 0}))
            answer: SimpleQueue[str] = SimpleQueue()
            run.ask(Pause(), answer.put, lambda: answer.put(""))
            assert await asyncio.to_thread(answer.get, True, 20) == ""
            told = [message for message in hub.messages(client) if isinstance(message, str)]
            assert run.failure is None
            assert not any("failed" in words for words in told)
        finally:
            desk.end()
            run.end()

    asyncio.run(talk())
    model = Model(compiled)
    model.turns = [(entry.step, entry.turn) for entry in source.turned]
    compare(source, model)


def test_an_edit_that_cannot_be_shown_is_told_and_neither_the_run_nor_the_desk_changes(
    caplog: pytest.LogCaptureFixture,
) -> None:
    compiled, other = compiled_of("plain"), nv.compile_text(SPEC.replace("count: 3", "count: 2").replace("A2", "A1"))
    whole = Broken(SimulatedSource(compiled.simulator()))
    driven = Driven(cast(Source, whole), view_of(compiled, compiled.gains))
    driven.ask(Step(5))
    told: list[dict[str, object]] = []
    show = Show()
    desk = Desk(compiled, None, show.view, driven.run, lambda text: None)
    edited = Edited(Path("x.yaml"), lambda: other)
    edits = Edits(show, edited, driven.run, lambda text: told.append(json.loads(text)), desk)
    before = desk.placed
    edits._edited()  # a source that is no simulator cannot be carried over: whatever that raises
    assert told[-1]["errors"] is True
    assert "AssertionError" in str(told[-1]["text"])
    assert desk.placed is before
    assert driven.ask(Step(1)) == ""
    assert driven.shown[-1].glance.step == 6
    assert len(driven.shown[-1].glance.discs) == 5
    assert caplog.records
    driven.run.end()


def test_in_a_notebook_what_a_source_raises_is_told_and_the_view_goes_on(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    widget = compiled_of("plain").live()
    sent: list[str] = []
    monkeypatch.setattr(widget, "send", lambda content, buffers=None: sent.append(content.get("text", "")))
    try:
        widget.go(5)
        widget.pull = 0.5
        widget.go(2)
        assert widget.pull == 0.1
        with monkeypatch.context() as broken:
            broken.setattr(SimulatedSource, "go", lambda *_: 1 / 0)
            with pytest.raises(ValueError, match="the run is as it was before: ZeroDivisionError"):
                widget.go(1)
        widget._take_message(widget, {"view": "a", "open": True}, ())
        with monkeypatch.context() as broken:
            broken.setattr(SimulatedSource, "advance", lambda *_: 1 / 0)
            widget.play()
            for _ in range(6000):
                if any("ZeroDivisionError" in text for text in sent) and not widget.playing:
                    break
                time.sleep(0.01)
            assert any('"type":"refused"' in text and "ZeroDivisionError" in text for text in sent)
            assert not widget.playing
        widget.go(3)
        assert widget.step == 3
        assert caplog.records
    finally:
        widget.close()


def test_in_a_notebook_a_run_that_is_long_at_work_is_told_in_words(monkeypatch: pytest.MonkeyPatch) -> None:
    view = compiled_of("plain").live()
    monkeypatch.setattr(notebook, "_PATIENCE", 0.05)
    until = Event()
    try:
        view._session._run.inquire(lambda source: until.wait(20))
        with pytest.raises(TimeoutError, match=r"the run has not come to 'seek' for 0\.05 s"):
            view.go(3)
    finally:
        until.set()
        view.close()
