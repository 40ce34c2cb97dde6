"""Tied weights: entries that have the weights of others, in every backend and in exported C."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from exported import exported

import neurovis_spec as nv
from neurovis_spec.compiled import CompiledNetwork

AUTOENCODER = """
neurovis: 1
name: autoencoder
time: {episode: 7}
parameters: {g: 0.1}
inputs: {wave: {size: 3, expression: (k + i) % 4 - 1}}
neurons:
  X: {count: 3, input: wave}
  H: {count: 2, activation: clip}
  Y: {count: 3}
  Z: {count: 3}
connections:
  H -> Y: {weight: {transpose: X -> H}, delay: 2}
  Y -> H: {weight: {same_as: Z -> H}}
  X -> H: {weight: "0.1 + 0.1*i - 0.05*j", where: i + j < 4, plasticity: {oja: {rate: 0.1}}, bounds: [-0.5, 0.4]}
  Z -> H: {weight: "g*(1 + i + j)", pattern: {random: {probability: 0.8}}}
events:
  - {at: 4, set: {g: 0.2}}
  - {at: 6, set: {H -> Y: 0.25}}
  - {at: 8, set: {Y2 -> H1: 0.75}}
  - {at: 9, lesion: X1 -> H}
  - {at: 12, mend: X1 -> H}
"""


def weights(network: CompiledNetwork, every: np.ndarray, entry: str) -> dict[tuple[int, int], float]:
    """Those of an entry by the positions of source and target."""
    made = network.network.connections
    number = made.entries.index(entry)
    own = np.flatnonzero(made.entry.whole() == number)
    ends = made.sources.whole()[own], made.targets.whole()[own]
    i, j = (end - {"X": 0, "H": 3, "Y": 5, "Z": 8}[name] for end, name in zip(ends, entry.split(" -> "), strict=True))
    return dict(zip(zip(i.tolist(), j.tolist(), strict=True), every[own].tolist(), strict=True))


def test_both_have_one_set_of_numbers() -> None:
    network = nv.compile_text(AUTOENCODER)
    sim = network.simulator(backend="reference")
    for step in range(20):
        sim.step()
        own, other = (weights(network, sim.connection_weights, one) for one in ("X -> H", "H -> Y"))
        assert other == {(j, i): weight for (i, j), weight in own.items()}
        assert max(own.values()) <= 0.4
        same = weights(network, sim.connection_weights, "Y -> H")
        assert same == weights(network, sim.connection_weights, "Z -> H")
        if step >= 7:
            assert same[1, 0] == 0.75
        assert (step >= 3) == (min(same.values()) >= 0.2)


def test_what_is_lesioned_is_so_on_its_own_way_alone() -> None:
    network = nv.compile_text(AUTOENCODER.partition("events")[0])
    plain, cut = (network.simulator(backend="numpy") for _ in range(2))
    cut.lesion("X -> H")
    for _ in range(4):
        plain.step()
        cut.step()
    assert plain.connection_weights[0] != cut.connection_weights[0]  # it learns no more
    assert np.array_equal(cut.connection_weights, network.simulator().connection_weights)
    cut.lesion("H -> Y")
    with pytest.raises(KeyError, match="no rule at 'H -> Y'"):
        plain.learning("H -> Y", on=False)


@pytest.mark.parametrize("backend", ["numpy", pytest.param("c", marks=pytest.mark.compiler)])
def test_every_backend_gives_the_same_bits(backend: str) -> None:
    network = nv.compile_text(AUTOENCODER)
    expected, found = (network.run(steps=24, backend=one) for one in ("reference", backend))
    np.testing.assert_array_equal(found.activity, expected.activity)
    np.testing.assert_array_equal(found.weights, expected.weights)


@pytest.mark.compiler
def test_exported_c_gives_the_same_bits(tmp_path: Path) -> None:
    network = nv.compile_text(AUTOENCODER)
    expected, controller = network.run(steps=24, backend="reference").activity, exported(network, tmp_path)
    for row in expected:
        controller.step()
        np.testing.assert_array_equal(controller.activity, row)


def test_a_recording_has_the_weights_of_both_and_goes_on(tmp_path: Path) -> None:
    network = nv.compile_text(AUTOENCODER)
    recording = network.run(steps=10, checkpoint=tmp_path / "x.npz")
    assert {"X1 -> H1", "H1 -> Y1"} <= {recording.connection_names[one] for one in recording.plastic.tolist()}
    again, whole = network.run(steps=6, checkpoint=tmp_path / "x.npz"), network.run(steps=16)
    np.testing.assert_array_equal(again.activity, whole.activity[10:])
    np.testing.assert_array_equal(again.weights, whole.weights[10:])


def test_the_hash_knows_what_is_tied() -> None:
    own = AUTOENCODER.replace("{transpose: X -> H}", '"0.1 - 0.05*i + 0.1*j"').replace("delay: 2", "where: i + j < 4")
    assert nv.compile_text(own).network.hash != nv.compile_text(AUTOENCODER).network.hash


def test_instances_of_a_module_are_tied_each_within_itself() -> None:
    spec = """
neurovis: 1
name: x
modules:
  m:
    neurons: {A: {count: 2, bias: 1}, B: {count: 2}}
    connections:
      B -> A: {weight: {transpose: A -> B}}
      A -> B: {weight: "normal(0, 1)", pattern: all_to_all}
instances: {m: {module: m, count: 2}}
"""
    made = nv.compile_text(spec).network.connections
    first, second = made.weights.whole().reshape(2, 2, 4)
    for back, there in (first, second):
        assert back.tolist() == there.reshape(2, 2).T.ravel().tolist()
    assert first.tolist() != second.tolist()
