"""The command line: what each command prints and writes, how it ends, and that bad input never ends in a traceback."""

from __future__ import annotations

import json
import os
import pty
import signal
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result
from small_specs import SMALL

import neurovis_spec as nv
from neurovis_spec.cli import inspect
from neurovis_spec.cli.commands import COMMANDS, neurovis
from neurovis_spec.cli.tables import table
from neurovis_spec.version import __version__

ROOT = Path(__file__).parents[1]
SPECS = ROOT / "specs"
HEXAPOD = SPECS / "hexapod" / "hexapod.yaml"
WALK = SPECS / "walk" / "walk.yaml"
IN_FOLDERS = [HEXAPOD, SPECS / "stick_insect" / "stick_insect.yaml", WALK, SPECS / "worm" / "worm.yaml"]
ERRORS = sorted((ROOT / "tests" / "errors").glob("*.yaml"))
PULL = np.array([[1.0, 2.0], [3.0, 4.0]])


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty working folder with ``small.yaml``."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "small.yaml").write_text(SMALL, encoding="utf-8")
    return tmp_path


def call(*arguments: object, stdin: str | bytes | None = None) -> Result:
    """A command in this process. An exception that is no exit is raised."""
    result = CliRunner().invoke(neurovis, [str(argument) for argument in arguments], input=stdin)
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


def good(*arguments: object, stdin: str | None = None) -> str:
    """The standard output of a command that succeeds and has nothing to complain about."""
    result = call(*arguments, stdin=stdin)
    assert (result.exit_code, result.stderr) == (0, "")
    return result.stdout


# Help


def test_help_names_every_command_in_its_own_words() -> None:
    shown = good("--help")
    for name, line in COMMANDS.items():
        assert f"{name} " in shown
        assert line in shown
        assert line.rstrip(".") in " ".join(good(name, "--help").split()), "the command says the same of itself"


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_examples_that_name_it(name: str) -> None:
    examples = good(name, "--help").partition("Examples:")[2].strip().splitlines()
    assert examples
    assert all(f"neurovis {name}" in line for line in examples)


def test_version_is_one_line() -> None:
    assert good("--version") == f"neurovis {__version__}\n"


# Wrong usage


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("validat x.yaml", "no command 'validat'; did you mean 'validate'?"),
        ("ros vew", "no command 'vew'; did you mean 'view'?"),
        ("zzz", "the commands are: new, validate"),
        ("run small.yaml --stpes 3", "--steps"),
        ("run", "SPEC"),
        ("analyze small.yaml --from q1.csv -o x", "no number of a step: did you mean --recording q1.csv?"),
        ("animate small.yaml --from q1.npz -o x.svg", "no number of a step: did you mean --recording q1.npz?"),
        ("analyze small.yaml --from q1 -o x", "'q1' is no number of a step\n"),
        ("run small.yaml --steps 0", "--steps"),
        ("run small.yaml --every 0", "--every"),
        ("run small.yaml --set gain", "name=value"),
        ("run small.yaml --set gain=much", "'much' is not a finite number"),
        ("run small.yaml --set gain=inf", "'inf' is not a finite number"),
        ("run small.yaml --set gain=1_0", "'1_0' is not a finite number"),
        ("run small.yaml --set =3", "name=value"),
        ("run small.yaml --input push", "name=FILE"),
        ("run small.yaml --set gain=1 --set gain=1", "'gain' is given twice, as '1' and as '1'"),
        ("inspect small.yaml --set gain=1 --set other=1 --set gain=2", "'gain' is given twice, as '1' and as '2'"),
        ("run small.yaml --input pull=x.csv --input pull=y.csv", "'pull' is given twice, as 'x.csv' and as 'y.csv'"),
        ("run small.yaml --backend numpi", "did you mean 'numpy'?"),
        ("layout small.yaml --engine layred", "did you mean 'layered'?"),
        ("render small.yaml", "-o"),
        ("render small.yaml -o x.svg --theme drak", "did you mean 'dark'?"),
        ("render small.yaml -o x.svg --step -1", "--step"),
        ("animate small.yaml -o x.svg --fps 0", "--fps"),
        ("validate", "SPEC"),
        ("validate - -", "only once"),
        ("validate small.yaml --format xml", "--format"),
        ("new x --from cpg_rfb", "did you mean 'cpg_rbf'?"),
    ],
)
def test_wrong_usage_is_status_2_and_says_what_was_meant(folder: Path, arguments: str, words: str) -> None:
    result = call(*arguments.split())
    assert (result.exit_code, result.stdout) == (2, "")
    assert words in result.stderr
    assert sorted(folder.iterdir()) == [folder / "small.yaml"], "nothing was written"


# Input at fault


@pytest.mark.parametrize(
    ("content", "found"),
    [
        (b"1,2\n,3\n4,\n", ["x.csv:2:1: error[cell-empty]", "x.csv:3:3: error[cell-empty]"]),
        (b"a,b\r\n1,2\r\n3, nan\r\n 4x,5\r\n", ["x.csv:3:4: error[not-finite]", "x.csv:4:2: error[file-format]"]),
        (b"\xef\xbb\xbf1,2\n3,4,5\n6\n", ["x.csv:2:5: error[file-format]", "x.csv:3:1: error[file-format]"]),
        (b'"a, b","c"\n"1",inf\n', ["x.csv:2:5: error[not-finite]"]),
        (b"1,2\n3,\xff\n", ["x.csv:2:1: error[invalid-utf8]"]),
        (b"", ["x.csv:1:1: error[file-format]"]),
    ],
)
def test_a_finding_in_a_file_of_an_input_stands_at_the_cell(folder: Path, content: bytes, found: list[str]) -> None:
    (folder / "x.csv").write_bytes(content)
    result = call("run", "small.yaml", "--input", "pull=x.csv")
    assert result.exit_code == 1
    assert [line.partition("]")[0] + "]" for line in result.stderr.splitlines() if "error[" in line] == found
    assert "an empty cell" not in result.stderr, "what is advised would be refused as well"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("validate nothing.yaml", "nothing.yaml:1:1: error[file-missing]"),
        ("inspect .", "error[file-kind]"),
        ("render nothing.yaml -o x.svg", "error[file-missing]"),
        ("run small.yaml --set gian=1", "did you mean 'gain'?"),
        ("run small.yaml --set gain=-1", "small.yaml:4:"),
        ("run small.yaml --input push=push.csv", "file-missing"),
        ("run small.yaml --input pusch=push.csv", "did you mean 'push'?"),
        ("run small.yaml --input push=x.csv --input pusch=push.csv", "did you mean 'push'?"),
        ("run small.yaml --input pusch=one.csv", "did you mean 'push'?"),
        ("run small.yaml --input pull=one.csv", "(steps, 2)"),
        ("run small.yaml --input pull=gap.csv", "a cell is empty"),
        ("run small.yaml --input push=small.yaml", "file-format"),
        ("run small.yaml --input push=broken.npz", "known: .csv, .npy"),
        ("run small.yaml -o nowhere/x.npz", "there is no folder 'nowhere'"),
        ("run small.yaml -o .", "is a folder"),
        ("run small.yaml --from nothing.npz", "nothing.npz"),
        ("run small.yaml --from one.csv", "one.csv"),
        ("run small.yaml --from broken.npz", "broken.npz"),
        ("validate broken.npz", "broken.npz:1:"),
        ("layout small.yaml --engine manual", "error[position-missing]"),
        ("layout small.yaml --update broken.npz", "broken.npz"),
        ("layout small.yaml -o nowhere/x.yaml", "there is no folder 'nowhere'"),
        ("render small.yaml -o x", "suffix"),
        ("render small.yaml -o x.svg --recording nothing.npz", "nothing.npz"),
        ("animate small.yaml -o x.svg --recording broken.npz", "broken.npz"),
        ("new small", "small.yaml is already there"),
        ("new 1st", "error[invalid-name]"),
        ("new nowhere/x", "nowhere"),
    ],
)
def test_input_at_fault_is_status_1_and_one_clear_message(folder: Path, arguments: str, words: str) -> None:
    (folder / "one.csv").write_text("1\n2\n", encoding="utf-8")
    (folder / "gap.csv").write_text("1,2\n,3\n", encoding="utf-8")
    (folder / "broken.npz").write_bytes(b"PK\x03\x04 and then nothing")
    before = sorted(folder.rglob("*"))
    result = call(*arguments.split())
    assert (result.exit_code, result.stdout) == (1, "")
    assert words in result.stderr
    assert "Traceback" not in result.stderr
    assert sorted(folder.rglob("*")) == before, "nothing was written"


@pytest.mark.parametrize(
    "text", ["", "\0", "- 1", "neurovis: 1", "a: {b: [", "neurovis: 1\nname: x\nneurons: 3", "é: ö"]
)
@pytest.mark.parametrize("command", ["validate", "inspect", "layout", "run"])
def test_a_text_that_is_no_spec_gets_a_finding_from_every_command(folder: Path, command: str, text: str) -> None:
    result = call(command, "-", stdin=text)
    assert (result.exit_code, result.stdout) == (1, "")
    assert "<stdin>:" in result.stderr
    assert "error[" in result.stderr


def test_bytes_that_are_no_text_get_a_finding_at_their_place(folder: Path) -> None:
    result = call("validate", "-", stdin=b"neurovis: 1\nname: \xc3\xa9\xff\n")
    assert result.exit_code == 1
    assert "<stdin>:2:8: error[invalid-utf8]: the byte 0xff" in result.stderr


# validate


def test_validate_says_ok_for_each_spec_of_several() -> None:
    specs = [*sorted(SPECS.glob("*.yaml")), *IN_FOLDERS]
    lines = good("validate", *specs).splitlines()
    assert [line.split(": ok (")[0] for line in lines] == [str(spec) for spec in specs]
    assert f"{SPECS / 'cpg_rbf.yaml'}: ok (12 neurons, 28 connections)" in lines


def test_validate_goes_on_after_a_spec_at_fault(folder: Path) -> None:
    (folder / "bad.yaml").write_text("neurovis: 1\nname: x\nneurons: {A: {activation: tahn}}\n", encoding="utf-8")
    result = call("validate", "bad.yaml", "small.yaml")
    assert (result.exit_code, result.stdout) == (1, "small.yaml: ok (3 neurons, 4 connections)\n")
    assert "bad.yaml:3:27: error[unknown-activation]" in result.stderr
    assert "help: did you mean 'tanh'?" in result.stderr
    assert result.stderr.splitlines()[2].endswith("^^^^"), "carets stand under the name"


def test_validate_prints_one_json_array_of_all_findings_in_order() -> None:
    result = call("validate", "--format", "json", *ERRORS)
    assert (result.exit_code, result.stderr) == (1, "")
    found = json.loads(result.stdout)
    keys = ["code", "severity", "message", "file", "line", "column", "end_line", "end_column", "hint"]
    assert all(list(finding) == keys for finding in found)
    included = {str(path) for path in (ERRORS[0].parent / "include").glob("*.yaml")}
    files = {finding["file"] for finding in found}
    assert files <= {str(path) for path in ERRORS} | included
    assert files >= {str(path) for path in ERRORS if not path.stem.startswith("include_")}
    assert len(found) >= len(ERRORS)
    assert json.loads(good("validate", "--format", "json", SPECS / "ring.yaml")) == []


def test_validate_limit_and_root(folder: Path) -> None:
    result = call("validate", "small.yaml", "--limit", "2")
    assert result.exit_code == 1
    assert "error[" in result.stderr
    (folder / "data").mkdir()
    (folder / "data" / "w.csv").write_text("1,2\n", encoding="utf-8")
    (folder / "below").mkdir()
    spec = "neurovis: 1\nname: x\nneurons: {A: {bias: 1}, B: {count: 2}}\n"
    spec += "connections: {A -> B: {matrix: {file: ../data/w.csv}}}\n"
    (folder / "below" / "x.yaml").write_text(spec, encoding="utf-8")
    assert "path-outside" in call("validate", "below/x.yaml").stderr
    assert good("validate", "below/x.yaml", "--root", ".") == "below/x.yaml: ok (3 neurons, 2 connections)\n"


# inspect, schema


def test_inspect_text_shows_the_tables_and_the_matrix(folder: Path) -> None:
    lines = good("inspect", "small.yaml").splitlines()
    assert lines[:3] == ["small", "3 neurons, 4 connections, 2 of them learning", "dt 0.5 s, 10 steps (5 s), seed 0"]
    assert "  B      B1 … B2  2     identity    static  sum      0     pull" in lines
    assert "  A -> B  2       0.5     2" in lines
    assert "  B -> B  2       0.1     1      hebbian(rate=0.01)  -1 … 1" in lines
    start = lines.index("connection matrix C (from row to column)")
    assert lines[start + 1 : start + 5] == ["      A  B1  B2", "  A   ·   1   1", "  B1  ·   ·   1", "  B2  ·   1   ·"]
    assert lines[-1] == f"hash {nv.compile('small.yaml').hash}"
    assert any(line.startswith("  backend") and "numpy" in line for line in lines)


def test_a_title_cannot_steer_the_terminal() -> None:
    shown = table([("\x1b[31mred", "‮x")])
    assert "\x1b" not in shown
    assert "‮" not in shown


# layout


def test_layout_goes_to_standard_output_or_into_a_file(folder: Path) -> None:
    shown = good("layout", "small.yaml")
    assert good("layout", "small.yaml", "-o", "small.layout.yaml") == (
        "small.layout.yaml: 3 neurons, 4 connections, engine layered\n"
    )
    assert (folder / "small.layout.yaml").read_text(encoding="utf-8") == shown
    assert shown.startswith("neurovis_layout: 1\nnetwork: small\nengine: layered\n")
    assert "engine: circular" in good("layout", "small.yaml", "--engine", "circular")


def test_effort_is_one_of_three(folder: Path) -> None:
    assert good("layout", "small.yaml", "--effort", "quick") == good("layout", "small.yaml")
    assert good("render", "small.yaml", "-o", "x.svg", "--effort", "best") == "x.svg\n"
    result = call("layout", "small.yaml", "--effort", "most")
    assert (result.exit_code, result.stdout) == (2, "")
    with pytest.raises(ValueError, match="'effort' is quick, normal or best, not 'most'"):
        nv.compile(folder / "small.yaml").layout(effort="most")


def test_layout_metrics_are_one_object_also_beside_a_file(folder: Path) -> None:
    measured = json.loads(good("layout", "small.yaml", "--metrics", "-o", "x.yaml"))
    assert list(measured) == [
        "neurons", "edges", "crossings", "overlaps", "edges_over_neurons", "flow",
        "symmetry", "area", "pins_moved", "seconds",
    ]  # fmt: skip
    assert (measured["neurons"], measured["edges"], measured["overlaps"]) == (3, 4, 0)
    assert measured["seconds"] > 0
    assert (folder / "x.yaml").is_file()


# run


def test_run_writes_what_the_api_gives(folder: Path) -> None:
    np.save(folder / "pull.npy", PULL)
    shown = good("run", "small.yaml", "--steps", 7, "--set", "gain=2", "--input", "pull=pull.npy", "-o", "x.npz")
    assert shown.startswith("x.npz: 7 steps in ")
    expected = nv.compile("small.yaml", gain=2).run(7, {"pull": PULL})
    with np.load(folder / "x.npz") as file:
        np.testing.assert_array_equal(file["activity"], expected.activity)
        np.testing.assert_array_equal(file["weights"], expected.weights)
        assert file["step"].tolist() == list(range(7))


def test_run_warns_of_an_input_that_begins_with_the_numbers_of_its_columns(folder: Path) -> None:
    (folder / "pull.csv").write_text("0,1\n0.5,0.25\n0.75,0.125\n", encoding="utf-8")
    result = CliRunner().invoke(neurovis, ["run", "small.yaml", "--input", "pull=pull.csv", "-o", "x.npz"])
    assert result.exit_code == 0
    assert "pull.csv:1:1: warning[numbered-columns]: the first row, 0, 1, …" in result.stderr


def test_run_reads_inputs_from_csv_with_and_without_a_header(folder: Path) -> None:
    (folder / "a.csv").write_text("1,2\n3,4\n", encoding="utf-8")
    (folder / "b.csv").write_text("left,right\n1,2\n3,4\n", encoding="utf-8")
    for name in "ab":
        good("run", "small.yaml", "--input", f"pull={folder / name}.csv", "-o", f"{name}.csv.npz")
    expected = nv.compile("small.yaml").run(inputs={"pull": PULL})
    for name in "ab":
        np.testing.assert_array_equal(nv.load(f"{name}.csv.npz").activity, expected.activity)


def test_run_records_every_kth_step_and_csv(folder: Path) -> None:
    good("run", "small.yaml", "--every", 4, "-o", "x.csv")
    lines = (folder / "x.csv").read_text(encoding="utf-8").splitlines()
    assert lines[0] == "step,t,A,B1,B2,B1 -> B2,B2 -> B1"
    assert [line.split(",")[0] for line in lines[1:]] == ["0", "4", "8"]


def test_run_goes_on_from_a_recording(folder: Path) -> None:
    good("run", "small.yaml", "--steps", 30, "-o", "first.npz")
    good("run", "small.yaml", "--steps", 5, "--from", "first.npz", "-o", "second.npz")
    compiled = nv.compile("small.yaml")
    first = compiled.run(30)
    expected = compiled.run(5, start=first)
    np.testing.assert_array_equal(nv.load("second.npz").weights, expected.weights)
    assert not np.array_equal(expected.weights[0], compiled.run(1).weights[0])


def test_run_without_a_file_prints_the_last_values(folder: Path) -> None:
    lines = good("run", "small.yaml", "--backend", "reference").splitlines()
    last = nv.compile("small.yaml").run().activity[-1]
    assert lines[0].startswith("small: 10 steps in ")
    assert lines[0].endswith(" s, backend reference")
    assert lines[1] == "outputs at step 9:"
    assert lines[2] == f"  last  {last[2]:.6g}"
    assert lines[3] == f"  both  {last[1]:.6g} {last[2]:.6g}"
    assert lines[4].startswith("2 changing weights: ")
    assert sorted(folder.iterdir()) == [folder / "small.yaml"]


def test_run_warns_in_a_line_where_numbers_overflow(folder: Path) -> None:
    text = "neurovis: 1\nname: boom\nneurons: {A: {bias: 1}}\nconnections: {A -> A: 1e300}\n"
    result = call("run", "-", "--steps", 9, stdin=text)
    assert result.exit_code == 0
    assert result.stderr == "warning: the activity of A is inf at step 2, in 'boom'\n"


# render, animate


def test_render_draws_what_the_api_draws(folder: Path) -> None:
    assert good("render", "small.yaml", "-o", "x.svg", "--step", 3, "--theme", "dark", "--set", "gain=2") == "x.svg\n"
    nv.compile("small.yaml", gain=2).render("y.svg", step=3, theme="dark")
    content = (folder / "x.svg").read_text(encoding="utf-8")
    assert content == (folder / "y.svg").read_text(encoding="utf-8")
    assert content.count("data-neuron=") == 3
    assert content.count("data-connection=") == 4


@pytest.mark.parametrize("recording", ["x.npz", "x.csv"])
def test_render_with_and_without_a_recording_is_the_same_picture(folder: Path, recording: str) -> None:
    """A table holds the changing connections alone; the others are those of the spec."""
    good("run", "small.yaml", "-o", recording)
    good("render", "small.yaml", "-o", "a.svg", "--step", 4, "--recording", recording)
    good("render", "small.yaml", "-o", "b.svg", "--step", 4)
    assert (folder / "a.svg").read_bytes() == (folder / "b.svg").read_bytes()
    result = call("render", "small.yaml", "-o", "c.svg", "--step", 400, "--recording", recording)
    assert result.exit_code == 1
    assert "step 400 is not in the recording" in result.stderr


@pytest.mark.parametrize("recording", ["x.npz", "x.csv", "y.csv"])
def test_render_refuses_the_recording_of_another_network(folder: Path, recording: str) -> None:
    """Also of one with the same neurons, in which no connection changes: its table could be that of a run whose weights
    were left out."""
    text = Path("small.yaml").read_text()
    Path("other.yaml").write_text(text.replace(", plasticity: {hebbian: {rate: 0.01}}, bounds: [-1, 1]", ""))
    assert Path("other.yaml").read_text() != text
    good("run", "other.yaml" if recording == "y.csv" else SPECS / "mlp.yaml", "-o", recording)
    result = call("render", "small.yaml", "-o", "a.svg", "--recording", recording)
    assert result.exit_code == 1
    assert ("another network" if recording != "y.csv" else "it lacks the changing weights") in result.stderr
    assert not (folder / "a.svg").exists()


def test_render_makes_png(folder: Path) -> None:
    good("render", "small.yaml", "-o", "x.png", "--engine", "circular")
    assert (folder / "x.png").read_bytes().startswith(b"\x89PNG\r\n\x1a\n")


def test_animate_has_one_frame_a_step(folder: Path) -> None:
    good("animate", "small.yaml", "-o", "x.svg", "--steps", 4, "--from", 2, "--fps", 5)
    nv.compile("small.yaml").animate("y.svg", steps=4, start=2, fps=5)
    assert (folder / "x.svg").read_bytes() == (folder / "y.svg").read_bytes()
    assert b"<script" not in (folder / "x.svg").read_bytes()


def test_animate_says_where_a_recording_has_fewer_steps_than_are_wanted(folder: Path) -> None:
    good("run", "small.yaml", "--steps", 10, "-o", "x.npz")
    result = call("animate", "small.yaml", "--recording", "x.npz", "-o", "x.svg", "--from", 5, "--steps", 50)
    assert (result.exit_code, result.stdout) == (0, "x.svg\n")
    words = "the recording holds no more than 5 frames instead of 50 from step 5 on"
    assert result.stderr == f"warning: {words}\n"
    good("animate", "small.yaml", "--recording", "x.npz", "-o", "x.svg", "--from", 5, "--steps", 5)
    result = call("animate", "small.yaml", "--recording", "x.npz", "-o", "x.svg", "--from", 10, "--steps", 5)
    assert (result.exit_code, result.stderr) == (1, "error: the recording holds no step from 10 on\n")


# new


def test_new_writes_a_spec_that_goes_all_the_way(folder: Path) -> None:
    assert good("new", "first") == "first.yaml\n"
    assert good("validate", "first.yaml", "--strict") == "first.yaml: ok (4 neurons, 6 connections)\n"
    text = (folder / "first.yaml").read_text(encoding="utf-8")
    assert "starter" not in text.replace("A starter spec", "")
    assert text.count("#") > 10, "it is commented"
    run = nv.compile("first.yaml").run()
    error = np.abs(run["T"] - run["O"])
    assert error[-200:].max() < 0.2 * error[:200].max(), "it learns"
    good("render", "first.yaml", "-o", "first.svg")


@pytest.mark.parametrize("example", [*sorted(SPECS.glob("*.yaml")), *IN_FOLDERS], ids=lambda path: path.stem)
def test_new_from_an_example_is_that_example_under_another_name(folder: Path, example: Path) -> None:
    good("new", "mine", "--from", example.stem)
    mine = nv.compile("mine/mine.yaml" if example.parent.name == example.stem else "mine.yaml")
    theirs = nv.compile(example)
    assert mine.name == "mine"
    np.testing.assert_array_equal(mine.run(50).activity, theirs.run(50).activity)


@pytest.mark.parametrize("start", ["force", "som"])
def test_new_from_a_network_of_the_manual_is_that_network(folder: Path, start: str) -> None:
    assert good("new", "mine", "--from", start) == "mine.yaml\n"
    assert good("validate", "mine.yaml").startswith("mine.yaml: ok (")
    assert "name: mine\n" in (folder / "mine.yaml").read_text(encoding="utf-8")


def test_new_overwrites_nothing(folder: Path) -> None:
    (folder / "data").mkdir()
    (folder / "data" / "centres.csv").write_text("mine\n", encoding="utf-8")
    result = call("new", "walk", "--from", "cpg_rbf")
    assert result.exit_code == 1
    assert "centres.csv is already there" in result.stderr
    assert not (folder / "walk.yaml").exists()
    assert (folder / "data" / "centres.csv").read_text(encoding="utf-8") == "mine\n"


def test_new_may_share_the_data_of_an_example(folder: Path) -> None:
    assert good("new", "one", "--from", "cpg_rbf").split() == ["one.yaml", str(Path("data", "centres.csv"))]
    assert good("new", "two", "--from", "cpg_rbf").split() == ["two.yaml"]


LISTS = {
    ("new", "--from"): {"cpg_rbf", "hexapod", "force"},
    ("run", "--backend"): {"c", "numpy", "reference"},
    ("sweep", "--backend"): {"c", "numpy", "reference"},
    ("live", "--backend"): {"c", "numpy", "reference"},
    ("ros", "run", "--backend"): {"c", "numpy", "reference"},
}


@pytest.mark.parametrize("option", LISTS)
def test_what_is_there_is_listed_whatever_else_is_given(folder: Path, option: tuple[str, ...]) -> None:
    shown = good(*option, "list")
    assert LISTS[option] <= {line.split()[0] for line in shown.splitlines()}
    assert good(*option[:-1], "absent", option[-1], "list") == shown
    assert not (folder / "absent.yaml").exists()


def test_new_copies_what_an_example_includes(folder: Path) -> None:
    tables = [str(Path("data", f"{name}.csv")) for name in ("obstacle", "floor_left", "floor_right")]
    one = [str(Path("one", name)) for name in ("one.yaml", str(Path("modules", "leg.yaml")), *tables)]
    assert good("new", "one", "--from", "hexapod").split() == one
    assert good("new", "two", "--from", "hexapod").split() == [name.replace("one", "two") for name in one]


# The process


def start(*arguments: object, stdout: int, stderr: int) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "neurovis_spec", *map(str, arguments)]
    return subprocess.Popen(command, stdout=stdout, stderr=stderr)


def finished(*arguments: object, env: Mapping[str, str] | None = None) -> subprocess.CompletedProcess[bytes]:
    return subprocess.run([sys.executable, "-m", "neurovis_spec", *map(str, arguments)], capture_output=True, env=env)


def test_python_m_is_the_command() -> None:
    done = finished("--version")
    assert (done.returncode, done.stdout.decode(), done.stderr) == (0, f"neurovis {__version__}\n", b"")


@pytest.mark.parametrize("arguments", [("validate", "-"), ("lsp",)])
def test_a_closed_standard_input_is_one_message(arguments: tuple[str, ...]) -> None:
    command = [sys.executable, "-m", "neurovis_spec", *arguments]
    done = subprocess.run(["sh", "-c", 'exec "$@" <&-', "sh", *command], capture_output=True, check=False)
    assert (done.returncode, done.stdout) == (2, b"")
    assert b"Error: standard input is closed: " in done.stderr
    assert b"Traceback" not in done.stderr


def test_a_closed_pipe_ends_it_without_noise() -> None:
    process = start("inspect", SPECS / "ring.yaml", "--format", "json", stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert process.stdout is not None
    process.stdout.close()
    _, complaint = process.communicate(timeout=60)
    assert (process.returncode, complaint) == (141, b"")


if sys.platform == "linux":  # which has a device that is always full; elsewhere there is nothing to test this with

    @pytest.mark.parametrize(
        "arguments",
        ["--help", f"inspect {SPECS}/ring.yaml", f"run {SPECS}/ring.yaml"],
    )
    def test_a_full_disk_is_one_message(arguments: str) -> None:
        with Path("/dev/full").open("wb") as full:
            process = start(*arguments.split(), stdout=full.fileno(), stderr=subprocess.PIPE)
            _, complaint = process.communicate(timeout=60)
        assert process.returncode == 1
        assert complaint.decode() == "error: No space left on device\n"

    @pytest.mark.parametrize(("arguments", "status"), [("nosuch", 2), ("inspect missing.yaml", 1)])
    def test_where_no_message_fits_the_status_stays(arguments: str, status: int) -> None:
        with Path("/dev/full").open("wb") as full:
            process = start(*arguments.split(), stdout=full.fileno(), stderr=full.fileno())
        assert process.wait(60) == status


def test_a_terminal_without_utf_8_is_no_obstacle() -> None:
    done = finished("inspect", SPECS / "cpg_rbf.yaml", env={**os.environ, "PYTHONIOENCODING": "latin-1"})
    assert (done.returncode, done.stderr) == (0, b"")
    assert b"\\u2026" in done.stdout


def test_a_long_run_shows_a_bar_and_ends_cleanly_on_ctrl_c(folder: Path) -> None:
    terminal, child = pty.openpty()
    arguments = ("run", "small.yaml", "--steps", 10**9, "--every", 10**8, "-o", "x.npz")
    process = start(*arguments, stdout=subprocess.PIPE, stderr=child)
    os.close(child)
    shown = b""
    while b"running" not in shown:
        shown += os.read(terminal, 4096)
    process.send_signal(signal.SIGINT)
    shown += rest(terminal)
    output, _ = process.communicate(timeout=60)
    assert (process.returncode, output) == (130, b"")
    assert b"; x.npz holds step 0\r\n" in shown
    assert b"stopped at step " in shown
    assert b"Traceback" not in shown
    assert nv.load(folder / "x.npz").step.tolist() == [0]
    assert sorted(folder.iterdir()) == [folder / "small.yaml", folder / "x.npz"], "nothing half-written is left"


@pytest.mark.parametrize("suffix", ["npz", "csv"])
def test_a_disk_that_becomes_full_leaves_the_recording_that_was_there(folder: Path, suffix: str) -> None:
    """The system refuses files beyond a size as it refuses them on a full disk."""
    good("run", "small.yaml", "--steps", 9, "-o", f"x.{suffix}")
    before = Path(f"x.{suffix}").read_bytes()
    command = [sys.executable, "-m", "neurovis_spec", "run", "small.yaml", "--steps", "300000", "-o", f"x.{suffix}"]
    limited = ["sh", "-c", 'ulimit -f 4096; exec "$@"', "sh", *command]
    done = subprocess.run(limited, capture_output=True, check=False)
    assert (done.returncode, done.stdout) == (1, b"")
    kept = nv.load(f".x.{suffix}.part")
    held = f"x.{suffix}: what was recorded, up to step {len(kept) - 1}, is in .x.{suffix}.part"
    assert done.stderr.decode() == f"warning: {held}\nerror: x.{suffix} cannot be written: File too large\n"
    assert len(kept) > 200
    assert Path(f"x.{suffix}").read_bytes() == before
    assert sorted(folder.iterdir()) == [folder / f".x.{suffix}.part", folder / "small.yaml", folder / f"x.{suffix}"]


def rest(terminal: int) -> bytes:
    """What is written to a terminal until its other end closes."""
    shown = b""
    try:
        while part := os.read(terminal, 4096):
            shown += part
    except OSError:  # how the system says that the other end has gone
        pass
    finally:
        os.close(terminal)
    return shown


def test_ctrl_c_within_a_definition_of_a_class_is_ctrl_c(monkeypatch: pytest.MonkeyPatch) -> None:
    """Python 3.11 raises another error then, from it."""

    def asked(**_: object) -> None:
        raise RuntimeError("Error calling __set_name__") from KeyboardInterrupt()

    monkeypatch.setattr(inspect.command, "callback", asked)
    result = CliRunner().invoke(neurovis, ["inspect", str(SPECS / "cpg_rbf.yaml")])
    assert (result.exit_code, result.stderr) == (130, "\nstopped\n")
