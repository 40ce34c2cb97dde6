"""What the language says of the command line (§12): how many findings are shown, and what a recording holds."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from neurovis_spec.cli.commands import neurovis

HEAD = "neurovis: 1\nname: x\n"
SPEC = """\
time: {steps: 9}
parameters: {g: 1}
neurons: {A: {bias: g}, B: {}}
connections: {A -> B: {weight: 1, plasticity: {hebbian: {rate: 0.1}}}}
"""


def call(*arguments: object, stdin: str | None = None) -> Result:
    """A command in this process; nothing but an exit may leave it."""
    result = CliRunner().invoke(neurovis, [str(argument) for argument in arguments], input=stdin)
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result


@pytest.fixture
def spec(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """``x.yaml`` in an empty working folder."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "x.yaml"
    path.write_text(HEAD + SPEC, encoding="utf-8")
    return path


def test_twenty_findings_in_text_and_all_elsewhere(tmp_path: Path) -> None:
    """All are found at once; text shows 20."""
    path = tmp_path / "many.yaml"
    path.write_text(HEAD + "neurons:\n" + "".join(f"  A{i}: {{bia: 1}}\n" for i in range(50)))
    shown = call("validate", path)
    assert (shown.exit_code, shown.stdout, shown.stderr.count("error[")) == (1, "", 20)
    assert "50 errors" in shown.stderr
    result = call("validate", path, "--format", "json")
    assert (len(json.loads(result.stdout)), result.stderr) == (50, "")


def test_what_a_recording_holds(spec: Path) -> None:
    """Every array of the list, in its shape; ``weights`` those that can change, by a rule or an event."""
    spec.write_text(
        HEAD + SPEC.replace("1, plasticity: {hebbian: {rate: 0.1}}", "g") + "events: [{at: 99, set: {g: 2}}]\n"
    )
    assert call("run", spec, "-o", "x.npz").exit_code == 0
    with np.load(spec.parent / "x.npz") as file:
        shapes = {name: file[name].shape for name in file.files if name != "about"}
        assert file["activity"].dtype == np.float64
        assert file["step"].tolist() == list(range(9))
        assert file["neurons"].tolist() == ["A", "B"]
    assert shapes == {
        "activity": (9, 2), "neurons": (2,), "weights": (9, 1), "weights_static": (0,), "plastic": (1,),
        "sources": (1,), "targets": (1,), "delays": (1,), "dt": (), "step": (9,), "weights_after": (1,), "reached": (),
        "lesioned_neurons": (0,), "lesioned_connections": (0,),
    }  # fmt: skip
