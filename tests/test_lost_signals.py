"""``pre`` is what reaches the synapse: 0, where a lesion has lost what was sent, or nothing was sent (§7, §15)."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_export_c import runs_alike

import neurovis_spec as nv
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.live.carry import carried
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.runtime import c_export
from neurovis_spec.runtime.checkpoint import load_state, save_state
from neurovis_spec.runtime.signals import signal_layout
from neurovis_spec.runtime.simulation import Simulation

BACKENDS = ["reference", "numpy", pytest.param("c", marks=pytest.mark.compiler)]
#: a rule whose state is the sum of all that has reached the synapse, and whose weight says what does now
TEXT = """\
neurovis: 1
name: lost
time: {steps: 16}
inputs: {count: {expression: k + 1}}
rules:
  heard:
    state: {sum: {initial: 0, each_step: sum + pre}}
    weight: {each_step: 1 + pre / 1000}
neurons:
  A: {count: 2, input: count}
  Z: {input: count}
  B: {count: 2}
connections:
  - A -> B: {pattern: all_to_all, delay: 3, plasticity: heard}
  - A1 -> B1: {delay: 1, plasticity: heard}
  - Z -> B: {delay: 0, plasticity: heard}
"""


def network_of(events: str = "", text: str = TEXT) -> CompiledNetwork:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return nv.compile_text(text + events)


def heard(network: CompiledNetwork, connection: str, backend: str = "reference", steps: int = 16) -> list[float]:
    """What the rule of a connection read as ``pre`` at each step."""
    reference = f"({connection}).sum"
    recording = network.run(steps, backend=backend, states=[reference.replace(" (2)", "")])
    column = recording.state_names.index(reference)
    read: list[float] = np.diff(recording.states[:, column], prepend=0.0).tolist()
    return read


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("what", ["A1 -> B1", "A1", "B1", "A", "A -> B"])
def test_after_a_lesion_a_rule_reads_what_arrives(what: str, backend: str) -> None:
    """Sent at step k is k + 1; a lesion at 6 loses what is under way, and what a mended one sends arrives again."""
    network = network_of(f"events: [{{at: 6, lesion: {what}}}, {{at: 8, mend: {what}}}]\n")
    silent = [0.0, 0.0, 0.0, 1.0, 2.0, 3.0]  # until the lesion, after which a rule is not carried out
    assert heard(network, "A1 -> B1 (2)", backend) == [
        *silent, 0.0, 0.0, 0.0, 0.0, 0.0, 9.0, 10.0, 11.0, 12.0, 13.0
    ]  # fmt: skip
    one = heard(network, "A1 -> B1", backend)
    assert one == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 0.0, 0.0, 0.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0]
    untouched = [0.0, 0.0, 0.0, *(float(n) for n in range(1, 14))]
    assert (heard(network, "A2 -> B2", backend) == untouched) == (what not in ("A", "A -> B"))


@pytest.mark.parametrize("backend", BACKENDS)
def test_what_is_clamped_is_what_arrives(backend: str) -> None:
    network = network_of("events: [{from: 6, to: 8, clamp: {A1: -5}}]\n")
    assert heard(network, "A1 -> B1 (2)", backend)[8:13] == [6.0, -5.0, -5.0, 9.0, 10.0]


@pytest.mark.parametrize("backend", BACKENDS)
def test_without_a_delay_what_is_mended_arrives_at_once(backend: str) -> None:
    network = network_of("events: [{at: 6, lesion: Z -> B}, {at: 8, mend: Z -> B}]\n")
    assert heard(network, "Z -> B1", backend)[5:10] == [6.0, 0.0, 0.0, 9.0, 10.0]


LESIONS = st.lists(
    st.tuples(
        st.integers(1, 12),
        st.sampled_from(["A1", "A2", "B1", "A1 -> B1", "A -> B", "Z -> B", "A2 -> B", "B"]),
        st.booleans(),
    ),
    max_size=5,
    unique_by=lambda one: one[:2],
)


@settings(max_examples=25)
@given(lesions=LESIONS, backend=st.sampled_from(["reference", "numpy"]))
def test_a_rule_reads_something_exactly_where_something_arrives(
    lesions: list[tuple[int, str, bool]], backend: str
) -> None:
    """Of weight 1, all that arrives is what the rule has read: the activity that was sent."""
    rows = "".join(f"  - {{at: {at}, {'mend' if mend else 'lesion'}: {part}}}\n" for at, part, mend in lesions)
    network = network_of(f"events:\n{rows}" if rows else "", TEXT.replace("1 + pre / 1000", "1"))
    simulation = network.simulator(backend=backend)
    delays, offsets = network.network.connections.delays.whole(), signal_layout(network.network).offsets
    before = np.zeros(len(delays))
    for _ in range(16):
        kept = simulation.state()
        simulation.step()
        now = simulation.state()
        gone = now.conditions.structure.gone
        sums = np.zeros(len(before))
        for entry in network.network.projections:
            sums[entry.members] = next(iter(now.cells[entry.rule.owner].values()))
        for index in np.flatnonzero(~gone & (delays > 0)).tolist():
            # mended at this step: the state of before it has not lost yet what is under way
            lost = kept.conditions.structure.gone[index]
            arrives = kept.signals[offsets[index] + kept.k % delays[index]]
            assert sums[index] - before[index] == (0.0 if lost else arrives)
        before = sums


def controls(at: dict[int, Callable[[Simulation], None]], simulation: Simulation, steps: int) -> list[list[float]]:
    rows = []
    for k in range(steps):
        if k in at:
            at[k](simulation)
        simulation.step()
        rows.append([*simulation.state().activity, *simulation.state().weights])
    return rows


BY_HAND: dict[int, Callable[[Simulation], None]] = {
    6: lambda one: one.lesion("A1", "A2 -> B2"),
    8: lambda one: one.mend("A1", "A2 -> B2"),
}


@pytest.mark.parametrize("backend", BACKENDS)
def test_by_hand_as_by_events(backend: str) -> None:
    events = "events: [{at: 6, lesion: [A1, A2 -> B2]}, {at: 8, mend: [A1, A2 -> B2]}]\n"
    by_hand = controls(BY_HAND, network_of().simulator(backend=backend), 16)
    assert by_hand == controls({}, network_of(events).simulator(backend="reference"), 16)


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_state_remembers_what_is_lost(backend: str, tmp_path: Path) -> None:
    """Going back, and going on from a checkpoint between the mending and the first arrival."""
    network = network_of()
    whole = controls(BY_HAND, network.simulator(backend=backend), 16)
    simulation = network.simulator(backend=backend)
    controls(BY_HAND, simulation, 9)
    kept = simulation.state()
    save_state(kept, tmp_path / "x.ckpt")
    again = network.simulator(backend=backend)
    for state in (kept, load_state(network.network, tmp_path / "x.ckpt")):
        again.restore(state)
        assert controls({}, again, 7) == whole[9:]


def test_a_checkpoint_of_before_is_read(tmp_path: Path) -> None:
    """It does not say what is lost; without a mended lesion a file is as it was."""
    network = network_of()
    simulation = network.simulator()
    controls({6: BY_HAND[6]}, simulation, 7)
    save_state(simulation.state(), tmp_path / "x.ckpt")
    with np.load(tmp_path / "x.ckpt") as file:
        assert "lost" not in file
    again = network.simulator()
    again.restore(load_state(network.network, tmp_path / "x.ckpt"))
    assert controls({8: BY_HAND[8]}, again, 9)[1:] == controls({8: BY_HAND[8]}, simulation, 9)[1:]


@pytest.mark.compiler
@pytest.mark.parametrize("small", [0, 600], ids=["loops", "written out"])
def test_exported_c_reads_the_same(small: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(c_export, "SMALL", small)
    events = "events: [{at: 6, lesion: [A1, A2 -> B2]}, {at: 8, mend: [A1, A2 -> B2]}, {at: 12, lesion: B1}]\n"
    runs_alike(network_of(events), tmp_path, steps=24)


def test_a_run_that_goes_on_reads_nothing_of_before_a_lesion() -> None:
    first = network_of("events: [{at: 6, lesion: A1}]\n").run(9)
    simulation = network_of().simulator(start=first)
    rows = controls({0: lambda one: one.mend("A1")}, simulation, 6)
    column = len(first.neurons) + simulation.network.connection_index["A1 -> B1 (2)"]
    other = len(first.neurons) + simulation.network.connection_index["A2 -> B2"]
    assert [row[column] for row in rows] == [1.0, 1.0, 1.0, 1.001, 1.002, 1.003]
    assert [row[other] for row in rows] == [1.007, 1.008, 1.009, 1.001, 1.002, 1.003]


def test_a_connection_that_is_new_in_a_live_run_has_sent_nothing_yet() -> None:
    text = TEXT.replace("  - A1 -> B1: {delay: 1, plasticity: heard}\n", "")
    source = SimulatedSource(network_of(text=text).simulator())
    while source.step < 8:
        source.advance()
    edited = carried(source, network_of().simulator())
    names = network_of().network.connection_names
    new, old, shown = names.index("A1 -> B1 (2)"), names.index("A2 -> B2"), []
    for _ in range(5):
        edited.advance()
        weights = edited.seen().snapshot.weights
        shown.append((weights[new], weights[old]))
    # the weight of a step tells what was read at the one before; step 8 is made again in the edited network
    assert shown == [(1.0, 1.006), (1.0, 1.007), (1.0, 1.008), (1.009, 1.009), (1.01, 1.01)]
