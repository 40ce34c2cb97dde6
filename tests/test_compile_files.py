"""Data files of every kind in every place of a spec that takes one (§3, §4)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from data_attempts import npz
from small_specs import compiled, network_of, wires

from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.data.files import NamedFile, Room, Table, read_table
from neurovis_spec.language.unknown import Unknown
from neurovis_spec.language.yaml.opening import FileFault, read_parts

NEURONS = "neurons: {A: {count: 2, bias: 1}, B: {count: 3}, D: {count: 3, combine: distance, activation: gaussian}}\n"
WEIGHTS = np.array([[1.0, 2, 3], [4, 5, 6]])
SPARSE = {
    "format": np.array("csr"),
    "shape": np.array([2, 3]),
    "indptr": np.array([0, 1, 3]),
    "indices": np.array([2, 0, 1]),
    "data": np.array([0.5, 0, -1]),
}
WIRES = [("A1", "B3", 0.5, 1), ("A2", "B1", 0.0, 1), ("A2", "B2", -1.0, 1)]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "w.npz").write_bytes(npz(True, weights=WEIGHTS, turned=WEIGHTS.T))
    (tmp_path / "sparse.npz").write_bytes(npz(True, **SPARSE))
    lines = "%%MatrixMarket matrix coordinate real general\n2 3 3\n2 2 -1\n1 3 0.5\n2 1 0\n"
    (tmp_path / "w.mtx").write_text(lines, encoding="utf-8")
    (tmp_path / "at.npz").write_bytes(npz(at=np.array([[0, 1], [2, 3], [4, 5]])))
    lines = "%%MatrixMarket matrix array integer general\n3 2\n0\n2\n4\n1\n3\n5\n"
    (tmp_path / "at.mtx").write_text(lines, encoding="utf-8")
    return tmp_path


def test_a_key_chooses_the_matrix(folder: Path) -> None:
    expected = [(f"A{i + 1}", f"B{j + 1}", WEIGHTS[i, j], 1) for i in range(2) for j in range(3)]
    for body in ("{file: w.npz, key: weights}}", "{file: w.npz, key: turned}, rows: to}"):
        assert wires(network_of(NEURONS + "connections: {A -> B: {matrix: " + body + "}", folder)) == expected


@pytest.mark.parametrize("name", ["sparse.npz", "w.mtx"])
def test_what_a_sparse_file_leaves_out_is_no_connection(folder: Path, name: str) -> None:
    text = NEURONS + "connections: {A -> B: {matrix: {file: NAME}}, A -> D: {centre: {file: NAME}}}".replace(
        "NAME", name
    )
    network = network_of(text, folder)
    assert wires(network)[:3] == WIRES
    assert network.connections.centres.tolist() == [0, 0, 0, 0.5, 0, -1]
    assert wires(network)[3:] == [(source, target.replace("B", "D"), 1, 1) for source, target, *_ in WIRES]


@pytest.mark.parametrize("place", ["{file: at.npz}", "{file: at.npz, key: at}", "{file: at.mtx}"])
def test_positions(folder: Path, place: str) -> None:
    network = network_of(f"neurons: {{A: {{count: 3, bias: 1, position: {place}}}}}", folder)
    assert network.neurons.position.tolist() == [[0, 1], [2, 3], [4, 5]]


@pytest.mark.parametrize("name", ["at.npz", "at.mtx"])
def test_inputs(folder: Path, name: str) -> None:
    text = f"inputs: {{s: {{file: {name}}}}}\nneurons: {{A: {{count: 2, input: s}}}}"
    run = compiled(text, folder).run(4)
    assert run["A"].tolist() == [[0, 1], [2, 3], [4, 5], [4, 5]]


def test_a_file_is_read_once_for_each_key(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[tuple[str, str | None]] = []

    def counting(file: NamedFile, findings: Findings, *, keyed: bool, gaps: bool, room: Room) -> Table | Unknown:
        read.append((file.path, None if file.key is None else file.key.value))
        return read_table(file, findings, keyed=keyed, gaps=gaps, room=room)

    monkeypatch.setattr("neurovis_spec.compiler.values.data_files.read_table", counting)
    bodies = ["{matrix: {file: w.npz, key: weights}}", "{matrix: {file: w.npz, key: turned}, rows: to}"]
    bodies += ["{matrix: {file: w.mtx}}"]
    entries = "".join(f"  - A -> B: {body}\n" for body in bodies * 2)
    network = network_of(NEURONS + "connections:\n" + entries, folder)
    assert network.connections.weights[:6].tolist() == [1, 2, 3, 4, 5, 6]
    assert read == [("w.npz", "weights"), ("w.npz", "turned"), ("w.mtx", None)]


def test_events_read_no_file_again(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What an event sets is no compilation of its own."""
    opened: list[str] = []

    def reading(path: Path, most: int, size: int | None) -> list[bytes] | FileFault:
        opened.append(path.name)
        return read_parts(path, most, size)

    monkeypatch.setattr("neurovis_spec.language.data.files.read_parts", reading)
    (folder / "s.csv").write_text("1\n2\n", encoding="utf-8")
    (folder / "e.csv").write_text("from,to,weight\nA1,B1,1\n", encoding="utf-8")
    text = "parameters: {gain: 1}\ninputs: {s: {file: s.csv}}\nmodules: {leg: {neurons: {M: {}}}}\n" + NEURONS
    text += "instances: {left: {module: leg, count: 2}}\n"
    text += "connections: [{A -> B: {matrix: {file: w.mtx}}}, {A -> B: {edges: {file: e.csv}}}, {A1 -> B1: gain}]\n"
    text += "events: [{at: 1, set: {gain: 2}}, {at: 2, set: {gain: 3}}, {at: 3, set: {gain: 4}}]\n"
    text = text.replace("bias: 1", "bias: 1, input: s")
    network = network_of(text, folder)
    assert [change.at for change in network.changes] == [1, 2, 3]
    assert sorted(opened) == ["e.csv", "s.csv", "w.mtx"]


def test_how_a_matrix_is_written_does_not_show_in_the_hash(folder: Path) -> None:
    start = NEURONS + "connections: {A -> B: {matrix: "
    (folder / "w.csv").write_text(",,0.5\n0,-1,\n", encoding="utf-8")
    hashes = {
        network_of(f"{start}{matrix}}}}}", folder).hash
        for matrix in ("{file: w.mtx}", "{file: sparse.npz}", "{file: w.csv}", "[[null, null, 0.5], [0, -1, null]]")
    }
    assert len(hashes) == 1
