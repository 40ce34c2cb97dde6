"""What the language says of the command line (§12): findings, statuses, the hash, the keys of JSON."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

import neurovis_spec as nv
from neurovis_spec.cli.commands import COMMANDS, neurovis

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


def digest(text: str) -> str:
    """The hash as ``inspect`` prints it."""
    found = json.loads(call("inspect", "-", "--format", "json", stdin=HEAD + text).stdout)["hash"]
    assert isinstance(found, str)
    return found


def test_what_the_hash_does_not_see() -> None:
    """Formatting, titles, ``time.steps``, ``layout``, ``render``, ``ros`` and definitions that nobody uses."""
    same = [
        "title: hi\n" + SPEC,
        "# a comment\n" + SPEC.replace("{A: {bias: g}, B: {}}", "\n  A: {bias: g}\n  B: {}"),
        SPEC.replace("9", "99"),
        SPEC + "layout: {engine: grid}\n",
        SPEC + "render: {theme: dark}\n",
        SPEC + "ros: {rate: 3}\n",
        SPEC + "activations: {unused: {value: x}}\n",
    ]
    assert {digest(text) for text in same} == {digest(SPEC)}


def test_what_the_hash_sees() -> None:
    """All that changes a run."""
    others = [
        SPEC.replace("g: 1", "g: 2"),
        SPEC.replace("0.1", "0.2"),
        SPEC.replace("weight: 1,", "weight: 1, bounds: [0, 9],"),
        SPEC.replace("weight: 1,", "weight: 1, delay: 2,"),
        SPEC.replace("steps: 9", "steps: 9, dt: 0.5"),
        SPEC.replace("steps: 9", "steps: 9, episode: 5"),
        "seed: 3\n" + SPEC,
        SPEC + "events: [{at: 3, set: {g: 2}}]\n",
        SPEC + "rules: {hebbian: {parameters: {rate: 1}, weight: {each_step: weight + 2*rate*pre*post}}}\n",
    ]
    assert len({digest(text) for text in [SPEC, *others]}) == len(others) + 1


def test_the_hash_sees_a_data_file(spec: Path) -> None:
    """Data files in use are part of the network."""
    spec.write_text(HEAD + "neurons: {A: {bias: 1}, B: {}}\nconnections: {A -> B: {matrix: {file: w.csv}}}\n")
    found = set()
    for number in (1, 2):
        (spec.parent / "w.csv").write_text(f"{number}\n")
        found.add(nv.compile(spec).network.hash)
    assert len(found) == 2


def test_twenty_findings_in_text_and_all_elsewhere(tmp_path: Path) -> None:
    """All are found at once; text shows 20."""
    path = tmp_path / "many.yaml"
    path.write_text(HEAD + "neurons:\n" + "".join(f"  A{i}: {{bia: 1}}\n" for i in range(50)))
    shown = call("validate", path)
    assert (shown.exit_code, shown.stdout, shown.stderr.count("error[")) == (1, "", 20)
    assert "50 errors" in shown.stderr
    result = call("validate", path, "--format", "json")
    assert (len(json.loads(result.stdout)), result.stderr) == (50, "")


@pytest.mark.parametrize("command", sorted(COMMANDS))
def test_every_command_helps(command: str) -> None:
    """``--help`` is success and prints on standard output."""
    result = call(command, "--help")
    assert result.exit_code == 0
    assert result.stdout.startswith("Usage: ")
    assert result.stderr == ""


READERS = ("validate", "inspect", "layout", "run", "render", "animate", "fmt")


@pytest.mark.parametrize("command", READERS)
@pytest.mark.parametrize("text", ["", "neurovis: 1\nname: x\nneurons: {A: {bia: \n", "\x00", "[" * 100])
def test_bad_input_is_status_1_and_wrong_usage_2(command: str, text: str, spec: Path) -> None:
    """Whoever reads a spec says what is wrong with it on standard error, and shows no traceback."""
    spec.write_text(text)
    target = ["-o", "x.svg"] if command in ("render", "animate") else []
    for result in (call(command, spec, *target), call(command, "missing.yaml", *target)):
        assert result.exit_code == 1
        assert "error" in result.stderr
        assert "Traceback" not in result.output
    assert call(command, spec, *target, "--no-such-option").exit_code == 2
    assert call(command, *target).exit_code == 2


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
