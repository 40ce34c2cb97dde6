"""What a recording answers to: every reference that a spec accepts (§8, §13)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import neurovis_spec as nv
from neurovis_spec.runtime.errors import UnknownNameError
from neurovis_spec.runtime.recording import Recording

SPEC = """\
neurovis: 1
name: legs
modules:
  toe: {neurons: {J: {bias: 0.5}, T: {count: 3, first: 0, bias: i}}}
  leg:
    neurons: {N: {bias: 1}, K: {count: 2, bias: 2*i}}
    instances: {toe: {module: toe, count: 2}, heel: {module: toe}}
instances: {p: {module: leg, count: 3}, q: {module: leg}, p4: {module: leg}}
neurons: {A: {count: 12, bias: i}, O: {bias: 7}, L: {names: [left, right], bias: i}}
outputs: {last: O, both: [A2, O]}
"""
#: References that a spec may use, as an output does.
REFERENCES = [
    *("O", "A", "A3", "A3..A5", "A9..A11", "A3..A3", "A2 + O", "A1+A3..A4 + O", "L", "left", "left + right"),
    *("q.N", "q.K", "q.K2", "q.K1..K2", "q.K1..q.K2", "p4.N", "p1.N", "p1.K", "p2.K1..K2", "p1.N + p3.N"),
    *("p.N", "p.K", "p.K2", "p.K1..K2", "p.K1..p.K2", "p.N + O", "p.N + q.N"),
    *("p1.toe1.T", "p1.toe.T0..T2", "p.toe1.J", "p.toe.J", "p.toe2.T2", "p.heel.J", "p.heel.T1..T2", "q.toe.T"),
]
REFUSED = [
    "p.M",
    "p.N.N",
    "p5.N",
    "A0..A3",
    "A3..A1",
    "A3..",
    "A3..O",
    "A3..B5",
    "A3 + A1..A4",
    "A +",
    "",
    "q",
    "p",
    "r.N",
]


@pytest.fixture(scope="module")
def recording() -> Recording:
    return nv.compile_text(SPEC).run(2)


def meant(reference: str) -> list[str]:
    """The neurons that the compiler finds behind a reference."""
    network = nv.compile_text(f"{SPEC.replace('outputs: {', f'outputs: {{wanted: {reference!r}, ')}").network
    (output,) = (one for one in network.outputs if one.name == "wanted")
    return [network.neurons.names[index] for index in output.neurons.tolist()]


@pytest.mark.parametrize("reference", REFERENCES)
def test_a_recording_takes_the_references_of_a_spec(reference: str, recording: Recording) -> None:
    names = meant(reference)
    expected = np.stack([recording[name] for name in names], axis=1)
    found = recording[reference]
    assert reference in recording
    assert found.shape == ((2,) if reference == names[0] else (2, len(names)))
    assert np.array_equal(found.reshape(expected.shape), expected)


@pytest.mark.parametrize("reference", REFUSED)
def test_what_a_spec_refuses_a_recording_refuses(reference: str, recording: Recording) -> None:
    with pytest.raises(nv.SpecError):
        meant(reference)
    assert reference not in recording
    with pytest.raises(UnknownNameError):
        recording[reference]


def test_a_single_output_is_a_line_and_a_counted_one_a_column_each(recording: Recording) -> None:
    assert recording["last"].shape == (2,)
    assert recording["both"].shape == (2, 2)
    assert recording["p.N"].shape == (2, 3), "p4 is another instance"


def test_a_file_knows_them_too(recording: Recording, tmp_path: Path) -> None:
    recording.save(tmp_path / "legs.npz")
    read = nv.load(tmp_path / "legs.npz")
    for reference in REFERENCES:
        assert np.array_equal(read[reference], recording[reference])


def test_a_table_knows_its_neurons_and_their_ranges(recording: Recording, tmp_path: Path) -> None:
    recording.save(tmp_path / "legs.csv")
    read = nv.load(tmp_path / "legs.csv")
    for reference in ("A3", "A3..A5", "A2 + O", "p1.K1..K2"):
        assert np.array_equal(read[reference], recording[reference])


def test_the_nearest_names_are_offered_and_what_is_named_twice_is_said(recording: Recording) -> None:
    with pytest.raises(UnknownNameError, match=r"no neuron, group or output 'p1\.M'; did you mean .*'p1\.N'"):
        recording["p1.M"]
    with pytest.raises(UnknownNameError, match=r"'A1\.\.A4' names neurons that are named before it"):
        recording["A3 + A1..A4"]


WEIGHTS = """\
neurovis: 1
name: x
time: {dt: 0.5}
neurons: {A: {count: 2, bias: 1}, K: {count: 3}, O: {}}
connections:
  - A -> K: {matrix: [[1, 2, ~], [4, ~, 6]], plasticity: {hebbian: {rate: 0.1}}}
  - A -> O: 7
  - A -> O: 8
"""


def test_weights_between_groups_are_a_matrix_a_row() -> None:
    network = nv.compile_text(WEIGHTS)
    recording = network.run(3)
    found = recording.weight("A -> K")
    assert found.shape == (3, 2, 3)
    np.testing.assert_array_equal(found[0], [[1, 2, np.nan], [4, np.nan, 6]])
    np.testing.assert_array_equal(found[:, 1, 2], recording.weight("A2 -> K3"))
    assert found[2, 0, 0] > 1
    np.testing.assert_array_equal(recording.weight("A2 -> K1 + K3")[0], [[4, 6]])
    assert recording.t.tolist() == [0, 0.5, 1]
    with pytest.raises(
        UnknownNameError, match=r"two connections with both ends in common: name them, as 'A1 -> O \(2\)'"
    ):
        recording.weight("A -> O")
    for wrong in ("K -> A", "A -> Q", "A", "A ->"):
        with pytest.raises(UnknownNameError):
            recording.weight(wrong)
