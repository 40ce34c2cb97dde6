"""Where nothing changes a weight, connections share what their source has sent: the bits are those of signals that
each connection has of its own, whatever happens to what is under way."""

from __future__ import annotations

import warnings
from collections import deque
from collections.abc import Iterator, Sequence
from functools import cache
from math import sqrt
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from random_flows import flowing_specs
from random_specs import Spec
from test_flow_conformance import STEPS, arrays, compiled

import neurovis_spec as nv
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.live.carry import carried
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.runtime import signals
from neurovis_spec.runtime.checkpoint import load_state, save_state
from neurovis_spec.runtime.resume import resumed_state
from neurovis_spec.runtime.signals import signal_layout
from neurovis_spec.runtime.simulation import Simulation
from neurovis_spec.runtime.state import State, have_own_signals, initial_state, signals_of_each

GOLDEN = Path(__file__).parent / "golden"
BACKENDS = ["reference", "numpy", pytest.param("c", marks=pytest.mark.compiler)]
#: A and B reach each other and the rest, C sums squares, D multiplies; w can be set, the last entry is as it is read
#: with other weights. An identity and additions alone: every backend gives the same bits.
TEXT = """\
neurovis: 1
name: shared
parameters: {{w: 0.5}}
neurons:
  A: {{count: 3, bias: "0.5*i - 0.7"}}
  B: {{count: 2, bias: "0.4 - 0.3*i"}}
  C: {{combine: distance}}
  D: {{combine: product}}
connections:
  - A -> B: {{weight: "0.3*(i - j) + 0.1", pattern: all_to_all, delay: {0}}}
  - B -> A: {{weight: -0.4, pattern: all_to_all, delay: {1}}}
  - A1 -> A2: {{weight: w, delay: {1}}}
  - A -> C: {{weight: 0.3, centre: 0.2, delay: {2}}}
  - B -> D: {{weight: -1.5, delay: {2}}}
  - A -> D: {{weight: 0.9, delay: {1}}}
"""
#: the same of neurons in which something flows, and of which several things are taken, at several ports
FLOWING = """\
neurovis: 1
name: shared
time: {{dt: 0.25, integrate: {{method: heun, substeps: 2}}}}
parameters: {{w: 0.5}}
models:
  relaxing:
    ports: {{slow: {{}}, far: {{combine: distance}}}}
    state:
      v: {{initial: 0.5, derivative: "drive - v + 0.2*slow"}}
      n: {{initial: 0.25, each_step: "0.5*n + 0.1*drive - 0.1*far"}}
    outputs: {{both: v - n}}
    activity: v + n
    send: both
neurons:
  A: {{count: 3, model: relaxing, bias: "0.5*i - 0.7"}}
  B: {{count: 2, model: relaxing, bias: {{drive: "0.4 - 0.3*i", slow: 0.1}}}}
  C: {{combine: distance}}
  D: {{combine: product}}
connections:
  - A -> B: {{weight: "0.3*(i - j) + 0.1", pattern: all_to_all, delay: {1}}}
  - B -> A: {{weight: -0.4, pattern: all_to_all, delay: {2}, send: activity, port: {{drive: 0.5, slow: -1.5}}}}
  - A1 -> A2: {{weight: w, delay: {1}, send: v}}
  - A -> B: {{weight: -0.2, pattern: all_to_all, delay: {1}, send: v, port: far}}
  - A -> C: {{weight: 0.3, centre: 0.2, delay: {1}, send: v}}
  - B -> C: {{weight: 0.7, delay: {0}}}
  - B -> D: {{weight: -1.5, delay: {2}, send: n}}
"""
DELAYS = st.tuples(st.integers(0, 3), st.integers(1, 4), st.integers(1, 3))
PARTS = ["A1", "B2", "C", "A2 -> B1", "A -> B", "B -> A", "A3 -> C", "B1 -> D", "A1 -> A2"]


@pytest.fixture(scope="module", autouse=True)
def shared() -> Iterator[None]:
    """However little that saves."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(signals, "LEAST_SAVED", 0)
        yield


class Turn(NamedTuple):
    """Something that is done by hand before a step."""

    at: int
    what: str
    part: str = ""
    value: float = 0.0

    def do(self, one: Simulation) -> None:
        match self.what:
            case "set":
                one.set(w=self.value)
            case "clamp":
                one.clamp(self.part, self.value)
            case "release":
                one.release(self.part)
            case "lesion":
                one.lesion(self.part)
            case "mend":
                one.mend(self.part)


TURNS = st.lists(
    st.one_of(
        st.builds(Turn, st.integers(0, 11), st.sampled_from(["lesion", "mend"]), st.sampled_from(PARTS)),
        st.builds(Turn, st.integers(0, 11), st.just("set"), value=st.sampled_from([-1.0, 0.0, 0.3])),
        st.builds(
            Turn, st.integers(0, 11), st.sampled_from(["clamp", "release"]), st.sampled_from(["A1", "B"]), st.just(0.6)
        ),
    ),
    max_size=7,
)


class Plain:
    """The same network in plain loops: each connection has its own line of signals."""

    def __init__(self, network: CompiledNetwork) -> None:
        made = network.network
        self.network, connections = made, made.connections
        self.ends = list(zip(connections.sources.tolist(), connections.targets.tolist(), strict=True))
        self.weights, self.delays = connections.weights.tolist(), connections.delays.tolist()
        self.lines = [deque([0.0] * delay) for delay in self.delays]
        self.activity = [0.0] * len(made.neurons)
        self.combine = [group.combine for group in made.neurons.groups for _ in group.indices]
        self.silent: set[str] = set()
        self.gone_before: set[int] = set()
        self.held: dict[int, float] = {}

    def gone(self) -> set[int]:
        names = self.network.neurons.names
        parts = [
            {name, *(names[end] for end in self.ends[at])} for at, name in enumerate(self.network.connection_names)
        ]
        return {at for at, own in enumerate(parts) if own & self.silent}

    def turn(self, turn: Turn, names: Sequence[str]) -> None:
        index = self.network.neuron_index
        match turn.what:
            case "set":
                self.weights[self.network.connection_index["A1 -> A2"]] = turn.value
            case "lesion":
                self.silent |= set(names)
            case "mend":
                before = self.gone()
                self.silent -= set(names)
                for at in (before - self.gone()) & self.gone_before:
                    self.lines[at] = deque([0.0] * self.delays[at])
            case "clamp":
                self.held |= {index[name]: turn.value for name in names}
            case "release":
                self.held = {
                    neuron: value for neuron, value in self.held.items() if neuron not in map(index.get, names)
                }

    def step(self) -> list[float]:
        gone, arriving = self.gone(), [line.popleft() if line else None for line in self.lines]
        for neuron in range(len(self.activity)):  # A before B, which it may reach at once
            total = 1.0 if self.combine[neuron] == "product" else 0.0
            for at, (source, target) in enumerate(self.ends):
                if target != neuron or at in gone:
                    continue
                signal = arriving[at]
                signal = self.weights[at] * self.activity[source] if signal is None else signal
                if self.combine[neuron] == "product":
                    total *= signal
                elif self.combine[neuron] == "distance":
                    total += (signal - 0.2) * (signal - 0.2)
                else:
                    total += signal
            total = sqrt(total) if self.combine[neuron] == "distance" else total
            self.activity[neuron] = total + float(self.network.neurons.bias[neuron])
            if self.network.neurons.names[neuron] in self.silent:
                self.activity[neuron] = 0.0
            elif neuron in self.held:
                self.activity[neuron] = self.held[neuron]
        for at, (source, _) in enumerate(self.ends):
            if self.delays[at]:
                self.lines[at].append(self.weights[at] * self.activity[source])
        self.gone_before = gone
        return list(self.activity)


@cache
def network_of(delays: tuple[int, ...] = (2, 3, 1), text: str = TEXT) -> CompiledNetwork:
    return nv.compile_text(text.format(*delays))


def rows(one: Simulation, turns: Sequence[Turn], steps: range) -> list[bytes]:
    """The bits of all activities at each step."""
    made = []
    for k in steps:
        for turn in turns:
            if turn.at == k:
                turn.do(one)
        one.step()
        made.append(one.state().activity.tobytes())
    return made


def with_own(network: CompiledNetwork, state: State) -> State:
    state = state.copy()
    have_own_signals(network.network, state)
    return state


def members(network: CompiledNetwork, part: str) -> list[str]:
    """The names of what a part is."""
    made = network.network
    groups = made.group_index
    if " -> " not in part:
        return [made.neurons.names[at] for at in groups[part].indices] if part in groups else [part]
    ends = [set(members(network, end)) for end in part.split(" -> ")]
    return [
        name for name in made.connection_names if all(e in own for e, own in zip(name.split(" -> "), ends, strict=True))
    ]


@settings(max_examples=40)
@given(delays=DELAYS, turns=TURNS)
def test_the_reference_is_plain_loops(delays: tuple[int, ...], turns: list[Turn]) -> None:
    network = network_of(delays)
    plain, expected = Plain(network), []
    for k in range(14):
        for turn in turns:
            if turn.at == k:
                plain.turn(turn, members(network, turn.part) if turn.part else ())
        expected.append(np.array(plain.step()).tobytes())
    assert rows(network.simulator(backend="reference"), turns, range(14)) == expected


@settings(max_examples=40)
@given(text=st.sampled_from([TEXT, FLOWING]), delays=DELAYS, turns=TURNS, cut=st.integers(1, 12), old=st.booleans())
def test_what_is_shared_is_what_each_would_have(
    text: str, delays: tuple[int, ...], turns: list[Turn], cut: int, old: bool, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """NumPy's bits are the reference's with signals of their own; so they are on from a file, also from one of before,
    in which each connection has its own."""
    network = network_of(delays, text)
    own = network.simulator(backend="reference")
    own.restore(initial_state(network.network, own_signals=True))
    expected = rows(own, turns, range(14))
    one = network.simulator(backend="numpy")
    assert rows(one, turns, range(cut)) == expected[:cut]
    path = tmp_path_factory.mktemp("shared") / "x.state"
    state = one.state()
    save_state(with_own(network, state) if old else state, path)
    again = load_state(network.network, path)
    assert again.own_signals == old
    assert np.array_equal(signals_of_each(network.network, again), signals_of_each(network.network, state))
    assert again.conditions.structure.has_lost == state.conditions.structure.has_lost
    one.restore(again)
    assert rows(one, turns, range(cut, 14)) == expected[cut:]


@settings(max_examples=25, deadline=None)
@given(spec=flowing_specs(synapses=False), backend=st.sampled_from(["reference", "numpy"]))
def test_in_any_network_in_which_something_flows(spec: Spec, backend: str) -> None:
    """The bits of each step, whatever is sent, to whichever ports, and lost by events."""
    network = compiled(spec)
    each = initial_state(network, own_signals=True)
    assume(len(initial_state(network).signals) < len(each.signals))
    one, other = Simulation(network, backend), Simulation(network, backend)
    other.restore(each)
    for _ in range(STEPS):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # some grow out of all bounds
            one.step()
            other.step()
        shared, own = one.state(), other.state()
        assert (shared.own_signals, own.own_signals) == (False, True)
        np.testing.assert_array_equal(signals_of_each(network, shared), own.signals)
        shared.signals = own.signals
        for found, expected in zip(arrays(shared).values(), arrays(own).values(), strict=True):
            assert found.tobytes() == expected.tobytes()


ALL_TURNS = [
    Turn(3, "lesion", "A2 -> B1"),
    Turn(3, "lesion", "B2"),
    Turn(4, "set", value=-0.7),
    Turn(5, "mend", "A2 -> B1"),
    Turn(6, "mend", "B2"),
    Turn(7, "lesion", "A -> C"),
    Turn(8, "mend", "A -> C"),
    Turn(9, "clamp", "A1", 0.6),
    Turn(11, "release", "A1"),
]


@pytest.mark.compiler
@pytest.mark.usefixtures("small")
@pytest.mark.parametrize(("text", "delays"), [(TEXT, (2, 3, 1)), (TEXT, (0, 1, 2)), (FLOWING, (2, 3, 1))])
def test_in_c_as_well(text: str, delays: tuple[int, ...], tmp_path: Path) -> None:
    """In steps and in whole runs, from states of both kinds."""
    network = network_of(delays, text)
    expected = rows(network.simulator(backend="reference"), ALL_TURNS, range(24))
    one = network.simulator(backend="c")
    assert rows(one, ALL_TURNS, range(7)) == expected[:7]
    kept = one.state()
    for state in (kept, with_own(network, kept)):
        one.restore(state)
        assert rows(one, ALL_TURNS, range(7, 12)) == expected[7:12]
        one.save_state(tmp_path / "x.state")
        whole = network.run(12, backend="c", checkpoint=tmp_path / "x.state")
        assert [row.tobytes() for row in whole.activity] == expected[12:]


@pytest.mark.compiler
@pytest.mark.usefixtures("small")
@pytest.mark.parametrize("delay", [1, 3])
@pytest.mark.parametrize("probability", [1, 0.8])
def test_full_matrices_and_many_connections_in_c(delay: int, probability: float, tmp_path: Path) -> None:
    """Each way in which sums are written; behind steps of either kind of state."""
    network = nv.compile_text(
        "neurovis: 1\nname: x\nneurons: {S: {count: 20, bias: 0.1*i - 1}, T: {count: 30, activation: tanh}}\n"
        "connections:\n"
        f"  S -> T: {{weight: 'normal(0, 1)', delay: {delay}, pattern: {{random: {{probability: {probability}}}}}}}\n"
        "  T -> S: {weight: 0.3, pattern: {random: {probability: 0.9}}}\n"
    )
    expected = network.run(24, backend="reference").activity
    begin = initial_state(network.network)
    assert not begin.own_signals
    for state in (begin, with_own(network, begin)):
        save_state(state, tmp_path / "x.state")
        runs = [network.run(12, backend="c", checkpoint=tmp_path / "x.state").activity for _ in range(2)]
        assert np.concatenate(runs).tobytes() == expected.tobytes()


@pytest.mark.parametrize("text", [TEXT, FLOWING])
def test_exported_c_has_signals_of_each(text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is the text of a network in which nothing is shared, also behind a recording."""
    network = network_of(text=text)
    recording = network.run(9, backend="numpy", states="all")
    folders = [tmp_path / name for name in ("shared", "shared on", "own", "own on")]
    for folder, start in zip(folders, (None, recording) * 2, strict=True):
        if folder.name == "own":
            monkeypatch.setattr(signals, "LEAST_SAVED", 1 << 15)
        network.export(folder, start=start)
    shared, shared_on, own, own_on = ({path.name: path.read_text() for path in one.iterdir()} for one in folders)
    assert (shared, shared_on) == (own, own_on)


@pytest.mark.filterwarnings("ignore:the backend")
@pytest.mark.parametrize("backend", BACKENDS)
def test_a_checkpoint_of_before_goes_on_exactly(backend: str) -> None:
    """``earlier.state`` was written when each connection had its own signals, behind ten of the turns' steps."""
    network = network_of()
    whole = rows(network.simulator(backend=backend), ALL_TURNS, range(24))
    one = network.simulator(backend=backend)
    one.restore(GOLDEN / "earlier.state")
    assert one.state().own_signals
    assert rows(one, ALL_TURNS[8:], range(10, 24)) == whole[10:]


LESS = TEXT.format(2, 3, 1).replace("  - A1 -> A2: {weight: w, delay: 3}\n", "")
EDITS = {
    "nothing": TEXT.format(2, 3, 1),
    "a weight": TEXT.format(2, 3, 1).replace("weight: -0.4", "weight: 0.35"),
    "a delay": TEXT.format(2, 1, 1),
    "what is set": TEXT.format(2, 3, 1).replace("weight: w", "weight: 0.5").replace("weight: 0.3,", "weight: 0.6*w,"),
    "a connection more": TEXT.format(2, 3, 1) + "  - C -> B: {weight: 0.1, delay: 4}\n",
    "a connection less": LESS,
    "a lesion before": TEXT.format(2, 3, 1) + "events: [{at: 4, lesion: A1}, {at: 8, mend: A1}]\n",
    "what flows": FLOWING.format(2, 3, 1).replace("0.2*slow", "0.3*slow"),
    "what is sent": FLOWING.format(2, 3, 1).replace("0.2, delay: 3, send: v", "0.2, delay: 3"),
}


@pytest.mark.parametrize("edit", EDITS)
@pytest.mark.parametrize("turns", [[], ALL_TURNS], ids=["", "turned"])
def test_a_live_edit_carries_the_same(edit: str, turns: list[Turn]) -> None:
    """To an edited network, and back again."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # w is of no use where nothing reads it
        first, other = network_of(text=FLOWING if "models" in EDITS[edit] else TEXT), nv.compile_text(EDITS[edit])
    simulation = first.simulator(backend="numpy")
    rows(simulation, turns, range(9))
    futures = []
    for state in (simulation.state(), with_own(first, simulation.state())):
        source = SimulatedSource(first.simulator(backend="numpy"), state)
        seen = []
        for network in (other, first):
            source = carried(source, network.simulator(backend="numpy"))
            for _ in range(2):
                source.advance()
                seen.append(source.seen().snapshot.activity.tobytes())
        futures.append(seen)
    assert futures[0] == futures[1]


def test_after_an_edit_without_other_weights_signals_are_shared_still() -> None:
    network = network_of()
    source = SimulatedSource(network.simulator(backend="numpy"))
    for _ in range(5):
        source.advance()
    simulation = nv.compile_text(EDITS["a connection more"]).simulator()
    carried(source, simulation)
    assert not simulation.state().own_signals


@pytest.mark.parametrize(("weight", "own"), [("-0.4", False), ("0.35", True)])
@pytest.mark.parametrize(("text", "states"), [(TEXT, ()), (FLOWING, ("all",))])
def test_going_on_from_a_recording_sends_what_was_sent(
    text: str, states: tuple[str, ...], weight: str, own: bool
) -> None:
    """Also of a network with other weights, by which what is under way has left."""
    recording = network_of(text=text).run(9, backend="numpy", states=states)
    network = network_of(text=text.replace("weight: -0.4", f"weight: {weight}"))
    shared = resumed_state(network.network, recording)
    each = resumed_state(network.network, recording, own_signals=True)
    assert shared.own_signals == own
    assert np.array_equal(signals_of_each(network.network, shared), each.signals)
    one = network.simulator(backend="numpy")
    futures = []
    for state in (shared, each):
        one.restore(state)
        futures.append(rows(one, [], range(6)))
    assert futures[0] == futures[1]


@pytest.mark.parametrize(("delay", "shares"), [(13, False), (14, True)])
def test_a_source_keeps_what_it_has_sent_once_where_that_saves_enough(
    delay: int, shares: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of 50 neurons that all reach each other 50 numbers a step of delay, not 2,450."""
    monkeypatch.setattr(signals, "LEAST_SAVED", 1 << 15)
    network = nv.compile_text(
        "neurovis: 1\nname: x\nneurons: {N: {count: 50}}\n"
        f"connections: {{N -> N: {{weight: 0.01, delay: {delay}, pattern: all_to_all}}}}\n"
    ).network
    assert len(initial_state(network).signals) == (50 if shares else 2450) * delay
    assert signal_layout(network, own=True).size == 2450 * delay
