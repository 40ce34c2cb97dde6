"""Programs in C, written by hand from the paper and from the literature, as oracles that share no line with ours."""

from __future__ import annotations

import hashlib
import subprocess
from pathlib import Path

import numpy as np
import pytest

import neurovis_spec as nv
from neurovis_spec.compiler.values.draws import Stream

HERE = Path(__file__).parent
pytestmark = pytest.mark.compiler


def built(name: str, folder: Path) -> Path:
    program = folder / name
    source = HERE / "oracles" / f"{name}.c"
    command: list[str | Path] = [
        "cc",
        "-std=c99",
        "-O2",
        "-ffp-contract=off",
        "-Wall",
        "-Werror",
        "-o",
        program,
        source,
        "-lm",
    ]
    subprocess.run(command, check=True)
    return program


def test_use_case_1_is_what_a_program_by_hand_computes(tmp_path: Path) -> None:
    specs = HERE.parent / "specs"
    centres = (specs / "data" / "centres.csv").read_text(encoding="utf-8").replace(",", " ")
    program = built("cpg_rbf", tmp_path)
    printed = subprocess.run([program, "12000"], input=centres, capture_output=True, text=True, check=True).stdout
    table = np.array([line.split() for line in printed.splitlines()], dtype=np.float64)
    recording = nv.compile(specs / "cpg_rbf.yaml").run()
    assert table.shape == (12_000, 20)
    # Not chaotic, so the last bits of tanh and exp do not grow.
    np.testing.assert_allclose(recording.activity, table[:, :12], rtol=0, atol=1e-11)
    np.testing.assert_allclose(recording.weights, table[:, 12:], rtol=0, atol=1e-11)


def test_draws_are_those_of_a_philox_by_hand(tmp_path: Path) -> None:
    stream = Stream(7, "weight", "K -> O")
    digest = hashlib.sha256(b"7/weight/K -> O").digest()
    key = (int.from_bytes(digest[:4], "little"), int.from_bytes(digest[4:8], "little"))
    counters = np.random.default_rng(1).integers(0, 2**31, size=(500, 4))
    lines = "".join(f"{a} {b} {c} {d} {key[0]} {key[1]}\n" for a, b, c, d in counters.tolist())
    program = built("philox", tmp_path)
    printed = subprocess.run([program], input=lines, capture_output=True, text=True, check=True).stdout
    words = np.array([line.split() for line in printed.splitlines()], dtype=np.uint64)
    high, low = words[:, 0] >> np.uint64(5), words[:, 1] >> np.uint64(6)
    expected = (high.astype(np.float64) * 2**26 + low.astype(np.float64)) / 2**53
    drawn = stream.uniform(counters[:, 0], counters[:, 1], counters[:, 2], counters[:, 3])
    np.testing.assert_array_equal(drawn, expected)
