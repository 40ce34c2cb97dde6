"""The command line (§12), command by command: what the table and the paragraphs below it promise."""

from __future__ import annotations

import json
import re
from pathlib import Path
from types import SimpleNamespace

import pytest
from click.testing import CliRunner, Result
from small_specs import SMALL

import neurovis_spec as nv
from neurovis_spec.cli import progress
from neurovis_spec.cli.commands import COMMANDS, neurovis


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with ``small.yaml``."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "small.yaml").write_text(SMALL, encoding="utf-8")
    return tmp_path


def call(words: str, stdin: str | None = None) -> Result:
    """A command line; nothing but an exit may leave it."""
    result = CliRunner().invoke(neurovis, words.split(), input=stdin)
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    assert "Traceback" not in result.output
    return result


def good(words: str, stdin: str | None = None) -> str:
    """What a command prints that succeeds without a diagnostic."""
    result = call(words, stdin)
    assert (result.exit_code, result.stderr) == (0, "")
    return result.stdout


# Every command

READS = {
    "validate": "", "inspect": "", "layout": "", "run": "--steps 3", "fmt": "", "render": "--step 2 -o x.svg",
    "animate": "--steps 3 -o y.svg", "analyze": "-o readings", "export": "--to c -o made",
}  # fmt: skip
OPTIONS = {
    "new": "--from", "validate": "--format --strict --limit --root", "fmt": "--check --diff", "inspect": "--format",
    "layout": "--output --engine --update --metrics", "render": "--output --step --recording --input --theme --engine",
    "run": "--steps --set --input --backend --every --from --until --output",
    "sweep": "--over --metric --steps --set --input --backend --jobs --scheduler --output",
    "animate": "--output --steps --from --fps --recording --input --theme --engine",
    "export": "--to --output --float --from --set",
    "live": "--recording --from --watch --host --port --viewers --open --view --theme --engine --backend --set",
    "analyze": "--output --recording --of --from --to --threshold --bins --trials --theme --set --input",
    "ros": "run view play legacy export", "explain": "", "docs": "", "lsp": "", "schema": "",
}  # fmt: skip


def test_there_are_these_commands_with_these_options() -> None:
    """Each option stands in the help of its command."""
    assert set(COMMANDS) == set(OPTIONS)
    for name, options in OPTIONS.items():
        shown = good(f"{name} --help")
        assert [option for option in options.split() if option not in shown] == []


@pytest.mark.parametrize("name", READS)
def test_a_spec_is_a_path_or_standard_input(folder: Path, name: str) -> None:
    """A dash is standard input; the results are the same."""
    by_path = good(f"{name} small.yaml {READS[name]}")
    written = {path.name: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    piped = good(f"{name} - {READS[name]}", SMALL)
    assert {path.name: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == written
    if name != "fmt":  # which rewrites a file, and prints what it reads from standard input
        assert re.sub(r"in [\d.]+ s", "", by_path) == re.sub(r"in [\d.]+ s", "", piped).replace("<stdin>", "small.yaml")


@pytest.mark.parametrize("name", READS)
def test_results_go_to_standard_output_and_diagnostics_to_standard_error(folder: Path, name: str) -> None:
    """A warning does not mix with a result, and an error leaves none."""
    (folder / "odd.yaml").write_text(SMALL.replace("gain: {", "spare: 1, gain: {"), encoding="utf-8")
    if name != "fmt":  # to which unused things are fine
        plain, odd = call(f"{name} small.yaml {READS[name]}"), call(f"{name} odd.yaml {READS[name]}")
        assert odd.exit_code == 0
        whole, line = "warning[unused-parameter]", "1 warning: neurovis validate odd.yaml\n"
        assert (whole in odd.stderr, line in odd.stderr) == ((True, False) if name == "validate" else (False, True))
        assert bool(odd.stdout) == bool(plain.stdout)
        assert "warning" not in odd.stdout
    (folder / "bad.yaml").write_text("neurovis: 1\nname: [\n", encoding="utf-8")
    bad = call(f"{name} bad.yaml {READS[name]}")
    assert (bad.exit_code, bad.stdout) == (1, "")
    assert "bad.yaml:2:7: error[yaml-syntax]" in bad.stderr


@pytest.mark.parametrize("name", READS)
def test_what_may_take_longer_than_a_second_shows_a_bar_on_a_terminal(
    folder: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each command begins to count when it begins to work, and takes the bar away at its end."""
    told: list[str] = []

    class Watched(progress.Bar):
        def start(self) -> None:
            told.append(f"{self._label} begins")

        def stop(self) -> None:
            told.append(f"{self._label} ends")

    monkeypatch.setattr(progress, "Bar", Watched)
    monkeypatch.setattr(progress, "sys", SimpleNamespace(stderr=SimpleNamespace(isatty=lambda: True)))
    result = call(f"{name} small.yaml {READS[name]}")
    said = [line for line in result.stderr.splitlines() if not line.startswith("running 10 steps")]
    assert (result.exit_code, said) == (0, [])
    assert progress.PATIENCE == 1
    work = {"layout": "laying out", "run": "running", "fmt": "formatting", "render": "drawing", "animate": "drawing"}
    assert f"{work.get(name, 'compiling')} begins" in told
    assert [line.replace("begins", "ends") for line in told[::2]] == told[1::2]


@pytest.mark.parametrize(
    "words",
    [
        "animate small.yaml -o x.svg --fps nan", "animate small.yaml -o x.svg --fps inf",
        "render small.yaml -o x.png --dpi nan", "render small.yaml -o x.png --size 800",
        "render small.yaml -o x.png --size 20000x3000", "validate small.yaml --limit 0",
        "validate small.yaml --root small.yaml", "run small.yaml --root nowhere", "run small.yaml --set gain=nan",
        "inspect small.yaml --format yaml", "schema more", "new", "docs a b", "fmt", "layout small.yaml --engine -",
    ],
)  # fmt: skip
def test_wrong_usage_is_status_2(folder: Path, words: str) -> None:
    """Whatever the option; nothing is written."""
    result = call(words)
    assert (result.exit_code, result.stdout) == (2, "")
    assert "Error: " in result.stderr
    assert [path.name for path in folder.iterdir()] == ["small.yaml"]


@pytest.mark.parametrize("name", ["import"])
def test_a_command_that_is_not_there_yet_is_answered_with_those_that_are(name: str) -> None:
    """Wrong usage, not a misspelling of another."""
    result = call(f"{name} x.yaml")
    assert (result.exit_code, result.stdout) == (2, "")
    assert f"this version has no command '{name}' yet" in result.stderr
    assert "did you mean" not in result.stderr
    assert "validate" in result.stderr


@pytest.mark.parametrize(
    ("words", "kinds"),
    [
        ("run small.yaml -o x.parquet", (".csv", ".npz", ".mcap")),
        ("render small.yaml -o x.bmp", (".webp",)),
        ("animate small.yaml -o x.avi", (".svg", ".gif", ".webp", ".mp4")),
    ],
)
def test_a_kind_of_file_that_is_not_made_yet_is_answered_with_those_that_are(
    folder: Path, words: str, kinds: tuple[str, ...]
) -> None:
    """Before anything is run or written."""
    result = call(words)
    assert result.exit_code == 1
    assert [kind for kind in kinds if kind not in result.stderr] == []
    assert [path.name for path in folder.iterdir()] == ["small.yaml"]


# validate

SHOWN = """\
bad.yaml:3:27: error[unknown-activation]: there is no activation 'tahn'
 3 | neurons: {A: {activation: tahn}, B: {bia: 1}}
   |                           ^^^^
help: did you mean 'tanh'?
"""


def test_a_finding_is_shown_with_its_line_a_caret_and_a_help(folder: Path) -> None:
    """As FILE:LINE:COLUMN: error[CODE]: MESSAGE."""
    text = "neurovis: 1\nname: x\nneurons: {A: {activation: tahn}, B: {bia: 1}}\n"
    (folder / "bad.yaml").write_text(text, encoding="utf-8")
    result = call("validate bad.yaml")
    assert result.stdout == ""
    assert result.stderr.startswith(SHOWN)
    assert "bad.yaml:3:38: error[unknown-key]" in result.stderr
    assert result.stderr.rstrip().endswith("2 errors")


def test_json_is_an_array_of_objects_with_lines_and_columns_from_1(folder: Path) -> None:
    """``hint`` may be null; the end is that of the text at fault."""
    text = "neurovis: 1\nname: x\nneurons: {A: {activation: tahn}, B: {count: -1}}\n"
    (folder / "bad.yaml").write_text(text, encoding="utf-8")
    result = call("validate bad.yaml --format json")
    assert (result.exit_code, result.stderr) == (1, "")
    first, second = json.loads(result.stdout)
    assert first == {
        "code": "unknown-activation", "severity": "error", "message": "there is no activation 'tahn'",
        "file": "bad.yaml", "line": 3, "column": 27, "end_line": 3, "end_column": 31, "hint": "did you mean 'tanh'?",
    }  # fmt: skip
    assert set(second) == set(first)
    assert second["hint"] is None or isinstance(second["hint"], str)


def test_a_finding_points_at_the_key_the_value_or_the_character_at_fault() -> None:
    """Each of the three."""
    groups = ["A: {bia: 1}", "B: {count: -1}", "C: {bias: 2 + * 3}", "D: {bias: 'cos(fi)'}"]
    text = "neurovis: 1\nname: x\nneurons:\n" + "".join(f"  {group}\n" for group in groups)
    found = json.loads(call("validate - --format json", text).stdout)
    assert [(item["line"], item["column"], item["end_column"]) for item in found] == [
        (4, 7, 10), (5, 14, 16), (6, 17, 18), (7, 18, 20),
    ]  # fmt: skip


def test_an_unknown_name_is_answered_with_one_that_fits_there() -> None:
    """A neuron where a neuron is wanted, an input where an input is: all these names are alike."""
    text = """\
neurovis: 1
name: x
parameters: {legs1: 1}
inputs: {legs2: {}}
activations: {legs3: {value: legs3_x}}
neurons: {legs4: {input: legs, bias: legs}, O: {activation: legs}}
connections: {legz -> O: 1}
outputs: {o: legx}
"""
    found = json.loads(call("validate - --format json", text.replace("legs3_x", "x")).stdout)
    hints = {(item["line"], item["code"]): item["hint"] for item in found}
    assert hints == {
        (6, "unknown-input"): "did you mean 'legs2'?",
        (6, "unknown-name"): "did you mean 'legs1'?",
        (6, "unknown-activation"): "did you mean 'legs3'?",
        (7, "unknown-neuron"): "did you mean 'legs4'?",
        (8, "unknown-neuron"): "did you mean 'legs4'?",
    }


# inspect


def test_inspect_prints_an_object_with_these_keys(folder: Path) -> None:
    """And no others; ``parameters`` are values, neurons and connections stand in order."""
    seen = json.loads(good("inspect small.yaml --format json"))
    assert set(seen) == {
        "name", "dt", "steps", "seed", "parameters", "neurons", "connections", "inputs", "outputs", "engine", "hash",
    }  # fmt: skip
    assert (seen["dt"], seen["steps"], seen["seed"], seen["parameters"]) == (0.5, 10, 0, {"gain": 0.5})
    assert [neuron["name"] for neuron in seen["neurons"]] == ["A", "B1", "B2"]
    assert all(
        set(neuron) == {"name", "group", "module", "activation", "model", "combine", "bias"}
        for neuron in seen["neurons"]
    )
    assert seen["connections"] == [
        {"from": "A", "to": "B1", "weight": 0.5, "delay": 2, "rule": None},
        {"from": "A", "to": "B2", "weight": 0.5, "delay": 2, "rule": None},
        {"from": "B1", "to": "B2", "weight": 0.1, "delay": 1, "rule": "hebbian"},
        {"from": "B2", "to": "B1", "weight": 0.1, "delay": 1, "rule": "hebbian"},
    ]
    assert seen["engine"]["name"] == "layered"
    assert seen["engine"]["reason"]
    assert re.fullmatch(r"[0-9a-f]{64}", seen["hash"])


# layout


def test_an_updated_layout_keeps_the_places_that_were_there(folder: Path) -> None:
    good("layout small.yaml --engine circular -o x.layout.yaml")
    text = (folder / "x.layout.yaml").read_text(encoding="utf-8")
    good("layout small.yaml --update x.layout.yaml")
    kept = (folder / "x.layout.yaml").read_text(encoding="utf-8")
    positions = re.findall(r"^  (\w+): (\[.*\])$", kept, re.MULTILINE)
    assert len(positions) == 3
    assert [f"  {name}: {place}\n" in text for name, place in positions] == [True] * 3


# run, render, animate


def test_a_backend_has_a_line_of_its_own() -> None:
    """``NAME available [note]`` or ``NAME unavailable: reason``."""
    for line in good("run --backend list").splitlines():
        assert re.fullmatch(r"\w+ available( .+)?|\w+ unavailable: .+", line)


def test_a_frame_is_a_step_and_frames_a_second_default_to_one_over_dt(folder: Path) -> None:
    """At most 60, and 25 where no dt is written."""

    def seconds(time: str, options: str = "") -> float:
        (folder / "x.yaml").write_text(SMALL.replace("time: {dt: 0.5, steps: 10}", f"time: {time}"), encoding="utf-8")
        good(f"animate x.yaml -o x.svg {options}")
        found = re.findall(r'dur="([\d.]+)s"', (folder / "x.svg").read_text(encoding="utf-8"))
        assert len(set(found)) == 1
        return float(found[0])

    assert seconds("{dt: 0.5, steps: 10}") == pytest.approx(10 / 2)
    assert seconds("{dt: 0.05, steps: 10}") == pytest.approx(10 / 20)
    assert seconds("{dt: 0.001, steps: 30}") == pytest.approx(30 / 60)
    assert seconds("{steps: 10}") == pytest.approx(10 / 25)
    assert seconds("{dt: 1, steps: 10}") == pytest.approx(10)
    assert seconds("{dt: 0.5, steps: 10}", "--steps 6") == pytest.approx(3)
    assert seconds("{dt: 0.5, steps: 10}", "--fps 4") == pytest.approx(2.5)
    assert seconds("{dt: 0.5, steps: 10}", "--from 4") == pytest.approx(3)


def test_pictures_and_films_take_inputs_and_are_those_of_a_run_with_them(folder: Path) -> None:
    """The same as of its recording, gains included; and with a recording there is no run that could take them."""
    (folder / "p.csv").write_text("1,2\n3,4\n5,6\n", encoding="utf-8")
    good("run small.yaml --input pull=p.csv -o x.npz")
    for words in ("render small.yaml --step 4", "animate small.yaml"):
        good(f"{words} -o a.svg --input pull=p.csv")
        good(f"{words} -o b.svg --recording x.npz")
        good(f"{words} -o c.svg")
        a, b, c = ((folder / f"{name}.svg").read_bytes() for name in "abc")
        assert a == b != c
        assert call(f"{words} -o a.svg --input pul=p.csv").exit_code == 1
        lost = call(f"{words} -o p.csv --input pull=p.csv")
        assert (lost.exit_code, "the file of the input 'pull'" in lost.stderr) == (2, True)
        both = call(f"{words} -o a.svg --input pull=p.csv --recording x.npz")
        assert (both.exit_code, "nothing is run" in both.stderr) == (2, True)
    with pytest.raises(ValueError, match="nothing is run"):
        nv.compile("small.yaml").render("a.svg", recording=nv.load("x.npz"), inputs={"pull": [1, 2]})


def test_pictures_and_films_are_laid_out_by_the_engine_that_is_asked_for(folder: Path) -> None:
    for words in ("render small.yaml --step 4", "animate small.yaml"):
        made = set()
        for engine in ("layered", "circular"):
            good(f"{words} -o {engine}.svg --engine {engine}")
            made.add((folder / f"{engine}.svg").read_bytes())
        assert len(made) == 2
        assert call(f"{words} -o x.svg --engine circle").exit_code == 2


def test_the_suffix_of_a_file_may_be_written_in_capitals(folder: Path) -> None:
    """And gives the same bytes as in small letters."""
    for words, suffixes in (("render --step 4", "svg png gif webp"), ("animate --steps 3", "svg gif webp")):
        command, *options = words.split()
        for suffix in suffixes.split():
            for name in (suffix, suffix.title()):
                good(f"{command} small.yaml -o x.{name} {' '.join(options)}")
            made = {(folder / f"x.{name}").read_bytes() for name in (suffix, suffix.title())}
            assert len(made) == 1, suffix
