"""What outlives a version is written as it always was: hashes, exported C, checkpoints and recordings, to the byte.

``golden/written/spec.yaml`` has definitions of each kind, and each kind of number that can be set. ``--update-golden``
writes what is compared anew: a change there takes their hashes and checkpoints away from those who have some.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest

import neurovis_spec as nv
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.runtime.c_export import Exported

FOLDER = Path(__file__).parent / "golden" / "written"
STEPS = 25


@pytest.fixture(scope="module")
def network() -> CompiledNetwork:
    return nv.compile(FOLDER / "spec.yaml")


def compare(name: str, text: str, update: bool) -> None:
    if update:
        (FOLDER / name).write_text(text, encoding="utf-8")
    assert (FOLDER / name).read_text(encoding="utf-8") == text


def members(path: Path) -> dict[str, str]:
    """Each array of an archive by its name: its type, its shape, and a hash of its bytes."""
    with np.load(path) as found:
        arrays = {name: found[name] for name in found.files if name != "about"}  # which names the backend
    texts = {name: f"{array.dtype.str} {array.shape}" for name, array in arrays.items()}
    return {name: f"{texts[name]} {hashlib.sha256(array.tobytes()).hexdigest()}" for name, array in arrays.items()}


def test_hashes(network: CompiledNetwork, update_golden: bool) -> None:
    found = {"hash": network.network.hash, "mark": network.network.mark}
    compare("hashes.json", json.dumps(found, indent=1) + "\n", update_golden)


def test_exported_c(network: CompiledNetwork, update_golden: bool) -> None:
    made = Exported(network.network)
    compare("written.h", made.header(), update_golden)
    compare("written.c", made.source(), update_golden)


@pytest.mark.parametrize("backend", ["reference", "numpy"])
def test_checkpoint_and_recording(network: CompiledNetwork, backend: str, tmp_path: Path, update_golden: bool) -> None:
    kept = tmp_path / "run.state"
    network.run(STEPS, backend=backend, checkpoint=kept).save(tmp_path / "run.npz")
    found = {path.name: members(path) for path in (kept, tmp_path / "run.npz")}
    compare("arrays.json", json.dumps(found, indent=1) + "\n", update_golden)
