"""``neurovis analyze``: the files that it writes, the page, and what it refuses."""

from __future__ import annotations

import base64
import csv
import json
import re
from html import unescape
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from click.testing import CliRunner, Result

import neurovis_spec as nv
from neurovis_spec.analysis import connection_matrix, cross_correlation, report
from neurovis_spec.analysis.catalogue import catalogue
from neurovis_spec.analysis.page import environment
from neurovis_spec.analysis.report import OF_SPIKES, ReportOptions, analyze, file_names
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.scene import THEMES

SPEC = """neurovis: 1
name: small
title: 'Two <b>waves</b> & "more"'
time: {steps: 900, dt: 0.1}
inputs: {wave: {expression: sin(2*pi*k/40)}}
neurons: {A: {input: wave}, K: {count: 3, activation: relu}, O: {role: output}}
connections:
  A -> K: {weight: j - 1.5}
  K -> O: {weight: 0, plasticity: {delta: {rate: 0.02, target: A}}}
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "small.yaml").write_text(SPEC, encoding="utf-8")
    return tmp_path


def call(words: str) -> Result:
    result = CliRunner().invoke(neurovis, words.split())
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result


class Seen(HTMLParser):
    """Which addresses a page asks for, and which places it has."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.asked: list[str] = []
        self.links: list[str] = []
        self.places: set[str] = set()
        self.tags: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        for name, value in attrs:
            if name == "src":
                self.asked.append(value or "")
            if name == "href":
                self.links.append(value or "")
            if name == "id":
                self.places.add(value or "")


def test_all_measures_become_tables_pictures_and_a_page(folder: Path) -> None:
    result = call("analyze small.yaml -o out")
    assert (result.exit_code, result.stderr) == (0, "")
    names = {path.name for path in (folder / "out").iterdir()}
    assert names <= set(file_names())
    for key in catalogue().keys() - OF_SPIKES:
        stem = "weight_changes" if key == "weights" else key
        assert {f"{stem}.csv", f"{stem}.json", f"{key}.svg"} <= names
    assert result.stdout == f"out: {len(names)} files; open out/index.html\n"
    for name in names:
        path = folder / "out" / name
        if path.suffix == ".svg":
            assert ET.fromstring(path.read_bytes()).tag.endswith("svg")
        if path.suffix == ".json":
            table = json.loads(path.read_text(encoding="utf-8"))
            assert np.array(table["values"]).shape == (len(table["rows"]["labels"]), len(table["columns"]["labels"]))


def test_tables_hold_the_numbers_that_python_gives(folder: Path) -> None:
    assert call("analyze small.yaml --of K+O --from 100 --to 500 --no-trials -o out").exit_code == 0
    expected = cross_correlation(nv.compile("small.yaml").run(), "K + O", 100, 500)
    with (folder / "out" / "correlation.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))
    assert rows[0] == ["neuron", "K1", "K2", "K3", "O"]
    assert [[float(cell) for cell in row[1:]] for row in rows[1:]] == expected.values.tolist()
    table = json.loads((folder / "out" / "correlation.json").read_text(encoding="utf-8"))
    assert table["values"] == expected.values.tolist()


def test_all_of_it_is_one_object_of_json(folder: Path) -> None:
    """The tables are those of the files; what is said is what the page says."""
    result = call("analyze small.yaml --no-trials -o out --format json")
    assert (result.exit_code, result.stderr) == (0, "")
    told = json.loads(result.stdout)
    out = folder / "out"
    assert sorted(told["files"]) == sorted(path.name for path in out.iterdir())
    assert (told["folder"], told["network"], told["hash"]) == ("out", "small", nv.compile("small.yaml").hash)
    assert [one["measure"] for one in told["measures"]] == [key for key in catalogue() if key not in OF_SPIKES]
    page = unescape((out / "index.html").read_text(encoding="utf-8"))
    for one in told["measures"]:
        assert one["title"] in page
        assert all(note in page for note in one["notes"])
        assert all((out / f"{name}.svg").is_file() for name in one["pictures"])
        for name, table in one["tables"].items():
            assert table == json.loads((out / f"{name}.json").read_text(encoding="utf-8"))
    assert told["measured"]["steps"] in page


def test_neurons_without_connections_among_them_are_shown_with_all_that_they_are_connected_to(folder: Path) -> None:
    assert call("analyze small.yaml --of K --no-trials -o out").exit_code == 0
    table = json.loads((folder / "out" / "connections.json").read_text(encoding="utf-8"))
    run = nv.compile("small.yaml").run()
    around = connection_matrix(run, ["A", "K", "O"])
    assert (table["rows"]["labels"], table["values"]) == (list(around.rows.labels), around.values.tolist())
    assert around.values.any()
    assert "No connection runs from one of these neurons to another" in (folder / "out" / "index.html").read_text()
    (folder / "alone.yaml").write_text(
        "neurovis: 1\nname: alone\nneurons: {A: {bias: 1}, B: {bias: 1}, C: {}}\nconnections: {A -> C: 1}\n"
    )
    assert call("analyze alone.yaml --of B --no-trials -o out2").exit_code == 0
    assert "Left out: nothing is connected to these neurons." in (folder / "out2" / "index.html").read_text()
    assert not (folder / "out2" / "connections.svg").exists()


@pytest.mark.parametrize("theme", sorted(THEMES))
def test_the_page_opens_offline_in_every_theme(folder: Path, theme: str) -> None:
    assert call(f"analyze small.yaml --no-trials --theme {theme} -o out").exit_code == 0
    text = (folder / "out" / "index.html").read_text(encoding="utf-8")
    seen = Seen(text)
    assert seen.asked
    assert all(address.startswith("data:image/svg+xml;base64,") for address in seen.asked)
    for link in seen.links:
        assert link[1:] in seen.places if link.startswith("#") else (folder / "out" / link).is_file(), link
    assert not seen.tags & {"script", "link", "iframe", "b"}
    assert "Two &lt;b&gt;waves&lt;/b&gt; &amp; &#34;more&#34;" in text
    assert THEMES[theme].background in text
    for one in [one for one in catalogue().values() if one.key not in OF_SPIKES]:
        assert f'<section id="{one.key}">' in text
    pictures = [base64.b64decode(address.partition(",")[2]).decode() for address in seen.asked]
    assert any(THEMES[theme].ink in picture for picture in pictures)


def test_a_recording_is_measured_and_what_it_lacks_is_said(folder: Path) -> None:
    call("run small.yaml --neurons K --weights none -o part.npz")
    result = call("analyze small.yaml --recording part.npz --no-trials -o out")
    assert result.exit_code == 0, result.stderr
    names = {path.name for path in (folder / "out").iterdir()}
    assert {"correlation.csv", "traces.svg"} <= names
    assert not names & {"weights.csv", "topography.csv", "importance.csv", "raster.svg"}
    text = (folder / "out" / "index.html").read_text(encoding="utf-8")
    notes = re.findall(r'<p class="note">(.*?)</p>', text)
    assert sum(note.startswith("Left out: ") for note in notes) == 5
    assert "no weights" in text


def test_what_is_run_beside_a_recording_is_told_from_it(folder: Path) -> None:
    call("run small.yaml --steps 300 -o some.npz")
    for words, said in (("", 0), (" --recording some.npz", 2)):
        assert call(f"analyze small.yaml{words} -o out").exit_code == 0
        text = (folder / "out" / "index.html").read_text(encoding="utf-8")
        assert text.count("runs of the spec, not of the recording") == said


def test_what_does_not_apply_is_left_out(folder: Path) -> None:
    (folder / "still.yaml").write_text("neurovis: 1\nname: x\nneurons: {A: {bias: 1}}\ntime: {steps: 5}\n", "utf-8")
    assert call("analyze still.yaml -o out").exit_code == 0
    text = (folder / "out" / "index.html").read_text(encoding="utf-8")
    for said in ("no weight can change", "have no period", "the network has no outputs"):
        assert said in text


def test_a_run_that_grows_without_bound_is_warned_of_once(folder: Path) -> None:
    wild = (
        "neurovis: 1\nname: wild\ntime: {steps: 2000}\nneurons: {A: {initial: 1}, O: {}}\n"
        "connections: {A -> A: 3, A -> O: {weight: 1, plasticity: {hebbian: {rate: 1}}}}\n"
    )
    (folder / "wild.yaml").write_text(wild, "utf-8")
    result = call("analyze wild.yaml -o out")
    assert (result.exit_code, "encountered" in result.stderr) == (0, False), result.stderr
    assert len(result.stderr.splitlines()) == 1
    assert "have no derivative" in (folder / "out" / "index.html").read_text(encoding="utf-8")
    assert ",inf" in (folder / "out" / "traces.csv").read_text(encoding="utf-8")


def test_without_dt_the_unit_is_a_step(folder: Path) -> None:
    (folder / "plain.yaml").write_text(SPEC.replace(", dt: 0.1", ""), "utf-8")
    units = []
    for name in ("small", "plain"):
        assert call(f"analyze {name}.yaml --no-trials -o {name}").exit_code == 0
        units.append(json.loads((folder / name / "coactivation.json").read_text(encoding="utf-8"))["unit"])
    assert units == ["s", "steps"]


def test_many_neurons_are_measured_without_pairs(folder: Path) -> None:
    many = "neurovis: 1\nname: x\nneurons: {N: {count: 450, bias: sin(i)}}\ntime: {steps: 5}\nlayout: {engine: grid}\n"
    (folder / "many.yaml").write_text(many, "utf-8")
    assert call("analyze many.yaml --no-trials -o out").exit_code == 0
    names = {path.name for path in (folder / "out").iterdir()}
    assert "correlation.csv" not in names
    assert {"traces.csv", "topography.svg", "gait.csv"} <= names
    assert "too many for a measure of pairs" in (folder / "out" / "index.html").read_text(encoding="utf-8")
    assert call("analyze many.yaml --no-trials --of N1..N100 -o out").exit_code == 0
    assert (folder / "out" / "correlation.svg").stat().st_size < 200_000


@pytest.mark.parametrize(
    ("words", "status", "said"),
    [
        ("analyze small.yaml", 2, "Missing option '-o'"),
        ("analyze small.yaml -o -", 2, "takes a folder"),
        ("analyze small.yaml -o small.yaml", 1, "is a file, not a folder"),
        ("analyze small.yaml -o no/where", 1, "there is no folder"),
        ("analyze small.yaml -o out --from 900", 1, "the recording has steps 0 to 899"),
        ("analyze small.yaml -o out --from 5 --to 5", 2, "--to 5 is not behind --from 5"),
        ("analyze small.yaml -o out --of L", 1, "'L'"),
        ("analyze small.yaml -o out --bins 1", 2, "--bins"),
        ("analyze small.yaml -o out --threshold nan", 2, "threshold"),
        ("analyze small.yaml -o out --theme darc", 2, "dark"),
        ("analyze small.yaml -o out --recording small.yaml", 1, "small.yaml"),
        ("analyze small.yaml -o out --recording none.npz", 1, "none.npz"),
        ("analyze small.yaml -o out --recording other.npz", 1, "another network"),
    ],
)
def test_what_is_refused_is_refused_before_anything_is_written(
    folder: Path, words: str, status: int, said: str
) -> None:
    other = nv.compile_text("neurovis: 1\nname: other\nneurons: {A: {}, B: {}}")
    other.run(5).save(folder / "other.npz")
    result = call(words)
    assert (result.exit_code, said in result.stderr) == (status, True), result.stderr
    assert "Traceback" not in result.stderr
    assert not (folder / "out").exists()


def test_neither_the_spec_nor_what_it_reads_is_written_over(folder: Path) -> None:
    (folder / "out").mkdir()
    (folder / "out" / "weights.csv").write_text("1,2,3\n", encoding="utf-8")
    spec = SPEC.replace("{weight: j - 1.5}", "{matrix: {file: weights.csv}}")
    (folder / "out" / "spec.yaml").write_text(spec, encoding="utf-8")
    result = call("analyze out/spec.yaml -o out")
    assert result.exit_code == 2
    assert "would be lost" in result.stderr
    (folder / "out" / "traces.csv").write_bytes((folder / "small.yaml").read_bytes())
    assert call("analyze out/traces.csv -o out").exit_code == 2
    assert (folder / "out" / "weights.csv").read_text(encoding="utf-8") == "1,2,3\n"


def test_what_was_in_the_folder_stays_until_all_is_made(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    call("analyze small.yaml --no-trials -o out")
    before = {path.name: path.read_bytes() for path in (folder / "out").iterdir()}

    def broken(*_: object) -> bytes:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(report, "page_of", broken)
    result = call("analyze small.yaml --no-trials --from 10 -o out")
    assert result.exit_code == 1
    assert {path.name: path.read_bytes() for path in (folder / "out").iterdir()} == before


def test_without_jinja2_it_says_what_to_install(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("neurovis_spec.cli.analyze.find_spec", lambda name: None)
    result = call("analyze small.yaml -o out")
    assert result.exit_code == 1
    assert "pip install 'neurovis-spec[analyze]'" in result.stderr
    monkeypatch.setitem(__import__("sys").modules, "jinja2", None)
    with pytest.raises(ImportError, match="neurovis-spec\\[analyze\\]"):
        environment()


def test_in_python_it_is_one_call(folder: Path) -> None:
    network = nv.compile("small.yaml")
    files = analyze(network, folder / "out", network.run(300), ReportOptions(of="K", trials=False))
    assert files == sorted(files, key=files.index)
    assert (folder / "out" / "index.html") in files
    assert {path.name for path in files} == {path.name for path in (folder / "out").iterdir()}


def test_trials_that_would_take_too_long_are_left_out(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 5 neurons, 6 connections and an input, 500 steps: 12 runs for importance, 28 for sensitivity."""
    for longest, expected in ((28 * 500 * 11, 2), (28 * 500 * 11 - 1, 1), (12 * 500 * 11 - 1, 0)):
        monkeypatch.setattr(report, "_LONGEST", longest)
        out = folder / f"out{expected}"
        assert call(f"analyze small.yaml -o {out.name}").exit_code == 0
        assert len([path for path in out.glob("*.csv") if path.stem in ("importance", "sensitivity")]) == expected
        text = (out / "index.html").read_text(encoding="utf-8")
        assert text.count("take too long") == 2 - expected
