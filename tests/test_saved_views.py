"""Saved views: what is saved is read again, by whoever has edited the file meanwhile, and mistakes have their place."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from queue import SimpleQueue
from typing import get_args

import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st

import neurovis_spec as nv
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.diagnostics import Findings, SpecError
from neurovis_spec.live.clock import SPEEDS
from neurovis_spec.live.commands import Keep, Rekeep, Rename, Unkeep
from neurovis_spec.live.desk import Desk, Written
from neurovis_spec.live.protocol import ProtocolError, command_of, views_message
from neurovis_spec.live.run import Run
from neurovis_spec.live.saved_views import SHOWN, SavedView, call, file_beside, forget, keep, restore, views_in
from neurovis_spec.live.show import Show
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.live.view import view_of
from neurovis_spec.live.windows import Window

TEXT = """neurovis: 1
name: x
neurons: {A: {count: 2}, B: {}}
connections: {A -> B: 0.5}
inputs: {push: {expression: 0.1*k}}
"""
NETWORK = nv.compile_text(TEXT).network
CURVES = ("A1", "A1 -> B", "B over A1 with A2", "A1 against B", "rms(A1 - B, last=9)", "push", "A")

texts = st.text(st.characters(exclude_categories=["Cs"]).filter(str.isprintable), min_size=1, max_size=12)
numbers = st.floats(-1e6, 1e6)
views = st.builds(
    SavedView,
    step=st.integers(0, 1 << 53).map(lambda step: step - 1 if step else step),
    speed=st.sampled_from([*SPEEDS]),
    camera=st.sampled_from([None, "whole"]) | st.tuples(st.floats(0.01, 64), numbers, numbers),
    curves=st.lists(st.sampled_from(CURVES), max_size=4).map(tuple),
    theme=st.sampled_from(["", "dark", "default", "print"]),
    closed=st.lists(texts, max_size=3).map(tuple),
    shows=st.none() | st.sampled_from(SHOWN),
    window=st.sampled_from([None, *get_args(Window)]),
)


@given(st.lists(st.tuples(texts, views), min_size=1, max_size=4))
@settings(max_examples=15, deadline=None)
def test_what_is_saved_is_read_again_and_comments_stay(
    tmp_path_factory: pytest.TempPathFactory, saved: list[tuple[str, SavedView]]
) -> None:
    path = tmp_path_factory.mktemp("views") / "x.neurovis-view.yaml"
    own = "neurovis_view: 1 # first\nviews:\n  # of mine\n  mine: {step: 3} # why\n# last\n"
    path.write_text(own)
    wanted: dict[str, SavedView] = {"mine": SavedView(3)}
    for name, view in saved:
        keep(path, name, view)
        wanted[name] = view
    findings = Findings()
    assert views_in(path, NETWORK, findings) == wanted
    assert findings.sorted() == ()
    text = path.read_text(encoding="utf-8")
    assert all(comment in text for comment in ("# first", "# of mine", "# why", "# last"))


STYLES = {
    "block": "neurovis_view: 1\nviews:\n  # of mine\n  mine: {step: 3} # why\n  other:\n    step: 4 # four\n# last\n",
    "braces": "neurovis_view: 1\nviews: {mine: {step: 3}, other: {step: 4}} # last\n",
    "lines": "neurovis_view: 1\nviews: {\n  # of mine\n  mine: {step: 3}, # why\n  other: {step: 4},\n}\n# last\n",
    "commas": "neurovis_view: 1\nviews: {\n  mine: {step: 3} # a, b\n  , other: {step: 4} # c, d\n}\n# last, too\n",
}


@given(
    style=st.sampled_from(sorted(STYLES)),
    more=st.lists(st.tuples(texts, views), max_size=2),
    taken=st.lists(st.tuples(st.sampled_from(["mine", "other", ""]), texts | st.just("")), min_size=1, max_size=4),
)
@settings(max_examples=30, deadline=None)
def test_a_view_is_called_otherwise_or_taken_out_and_all_else_stays(
    tmp_path_factory: pytest.TempPathFactory,
    style: str,
    more: list[tuple[str, SavedView]],
    taken: list[tuple[str, str]],
) -> None:
    """As a dict does it. No name is that of the view that was saved last, and to be called nothing to be taken out."""
    path = tmp_path_factory.mktemp("views") / "x.neurovis-view.yaml"
    path.write_text(STYLES[style], encoding="utf-8")
    wanted = {"mine": SavedView(3), "other": SavedView(4)}
    for name, view in more:
        keep(path, name, view)
        wanted[name] = view
    for name, to in taken:
        of = name or (more[-1][0] if more else "mine")
        before = path.read_bytes()
        if of not in wanted or (to != of and to in wanted):
            with pytest.raises((KeyError, ValueError)):
                call(path, of, to) if to else forget(path, of)
            assert path.read_bytes() == before
        elif to:
            call(path, of, to)
            wanted[to] = wanted.pop(of)
        else:
            forget(path, of)
            del wanted[of]
        findings = Findings()
        assert views_in(path, NETWORK, findings) == wanted
        assert findings.sorted() == ()
    text = path.read_text(encoding="utf-8")
    assert "# last" in text
    assert style != "commas" or ("# a, b" in text and "# c, d" in text)


def test_a_view_that_is_put_back_stands_where_it_was_and_as_it_was(tmp_path: Path) -> None:
    """With what was said of it, and what nobody knows; not where the file was edited meanwhile."""
    spec, told = tmp_path / "x.yaml", SimpleQueue[str]()
    spec.write_text(TEXT)
    network = nv.compile(spec)
    run = Run(SimulatedSource(network.simulator()), view_of(network, network.gains), lambda _: None)
    desk = Desk(network, None, Show().view, run, told.put, Written(spec, nv.compile_text))
    path = file_beside(spec)
    before = "neurovis_view: 1\nviews:\n  a: {step: 3, curves: [A1, gone], more: 1} # why\n  b: {step: 4}\n"
    path.write_text(before)
    desk.start()

    def asked(request: Unkeep | Keep) -> None:
        desk.ask(request, lambda reason: pytest.fail(str(reason)))
        known = None
        while known is None or ("a" in known) != isinstance(request, Keep):
            message = json.loads(told.get(timeout=30))
            known = message.get("views")

    try:
        asked(Unkeep("a"))
        assert "why" not in path.read_text()
        asked(Keep("a", SavedView(3, curves=("A1",))))
        assert path.read_text() == before
        asked(Unkeep("a"))
        path.write_text(path.read_text().replace("step: 4", "step: 5"))
        asked(Keep("a", SavedView(3, curves=("A1",))))
        assert path.read_text().splitlines()[2:] == ["  b: {step: 5}", "  a:", "    step: 3", "    curves: [A1]"]
    finally:
        desk.end()


def test_a_view_without_some_keys_is_put_back_without_them(tmp_path: Path) -> None:
    path = tmp_path / "x.neurovis-view.yaml"
    path.write_text("neurovis_view: 1\nviews:\n  a: {step: 3}\n  b: {theme: dark} # mine\n")
    forget(path, "a")
    keep(path, "a", SavedView(3))
    keep(path, "b", SavedView(4))
    keep(path, "c", SavedView())
    assert path.read_text().splitlines()[2:] == [
        "  b:  # mine", "    theme: null", "    step: 4", "  a:", "    step: 3", "  c: {}"
    ]  # fmt: skip


def test_blanks_in_a_name_stay_as_they_were_typed(tmp_path: Path) -> None:
    path, view = tmp_path / "x.neurovis-view.yaml", SavedView(3)

    def names() -> list[str]:
        findings = Findings()
        found = list(views_in(path, NETWORK, findings))
        assert not findings.sorted()
        return found

    for name in ("my view", "my  view", "my: view", "my:  view"):
        keep(path, name, view)
    keep(path, "my  view", SavedView(4))
    assert names() == ["my view", "my  view", "my: view", "my:  view"]
    assert restore(path, forget(path, "my  view"))
    call(path, "my view", "a   view")
    call(path, "my  view", "my view")
    assert names() == ["a   view", "my view", "my: view", "my:  view"]
    forget(path, "a   view")
    assert views_in(path, NETWORK, Findings())["my view"] == SavedView(4)


WRONG = """\
neurovis_view: 1
views:
  a: {step: -1, camra: [1, 0, 0], curves: [A9, B], speed: fast, theme: drak, closed: 3}
  b: 7
more: 1
"""


def test_what_is_wrong_has_its_place_and_the_rest_is_there(tmp_path: Path) -> None:
    path = tmp_path / "x.neurovis-view.yaml"
    assert views_in(path, NETWORK, Findings()) == {}, "there is none yet"
    path.write_text(WRONG)
    findings = Findings()
    assert views_in(path, NETWORK, findings) == {"a": SavedView(curves=("B",)), "b": SavedView()}
    found = [(one.span.line, one.span.column, one.code, one.severity) for one in findings.sorted()]
    assert found == [
        (3, 13, "wrong-type", "error"),
        (3, 17, "unknown-key", "error"),
        (3, 44, "forgotten-neuron", "warning"),
        (3, 59, "wrong-type", "error"),
        (3, 72, "wrong-type", "error"),
        (3, 86, "wrong-type", "error"),
        (4, 6, "wrong-type", "error"),
        (5, 1, "unknown-key", "error"),
    ]
    for broken, code in (
        ("a: [", "yaml-syntax"),
        ("views: {}", "missing-key"),
        ("neurovis_view: 2\nviews: 3", "wrong-type"),
    ):
        path.write_text(broken + "\n")
        findings = Findings()
        assert views_in(path, NETWORK, findings) == {}
        assert code in {one.code for one in findings.sorted()}
    before = path.read_bytes()
    with pytest.raises(SpecError, match="a mapping of names"):
        keep(path, "a", SavedView(1))
    with pytest.raises(ValueError, match="cannot be seen"):
        keep(path, "a\u200b", SavedView(1))
    assert path.read_bytes() == before


def test_a_page_sends_all_of_a_view_and_is_told_all_of_them() -> None:
    view = {"step": 3, "speed": "max", "camera": [1.5, 0, -2], "curves": ["A1"], "theme": "", "closed": []}
    view["shows"] = "matrix"
    wanted = SavedView(3, "max", (1.5, 0.0, -2.0), ("A1",), "", (), "matrix")

    def message(**more: object) -> str:
        return json.dumps({"type": "keep", "name": " a  b", "view": {**view, **more}})

    assert command_of(message()) == Keep("a  b", wanted)
    assert command_of(message(**dict.fromkeys(view))) == Keep("a  b", SavedView())
    assert command_of('{"type": "unkeep", "name": "a  b"}') == Unkeep("a  b")
    assert command_of('{"type": "rekeep", "name": "a  b", "to": " c  d"}') == Rekeep("a  b", "c  d")
    assert command_of('{"type": "rekeep", "name": "a", "to": "c\\t\\u00a0d "}') == Rekeep("a", "c  d"), "blanks"
    assert command_of('{"type": "rename", "number": 0, "name": " a  b "}') == Rename(0, "a  b"), "a branch, too"
    assert json.loads(views_message("x", {"a": wanted}, ""))["views"] == {"a": {**view, "window": None}}
    for wrong in (
        {"step": -1}, {"speed": "3"}, {"camera": [0, 1, 2]}, {"camera": [1, 2]}, {"curves": [3]}, {"theme": "x"},
        {"closed": "a"}, {"shows": "body"}, {"more": 1}, {"camera": [1, 2, 1e301]}, {"curves": ["x"] * 2000},
    ):  # fmt: skip
        with pytest.raises(ProtocolError):
            command_of(message(**wrong))
    with pytest.raises(ProtocolError):
        command_of(json.dumps({"type": "keep", "name": " ", "view": view}))
    assert command_of(message(camera="whole")) == Keep("a  b", replace(wanted, camera="whole"))
    long = json.dumps({"type": "keep", "name": 200 * "x", "view": view})
    assert command_of(long) == Keep(200 * "x", wanted), "an author may write a longer name than a page has typed"


def test_a_view_that_is_not_there_or_a_file_that_is_wrong_is_told_before_anything_is_served(tmp_path: Path) -> None:
    spec = tmp_path / "x.yaml"
    spec.write_text(TEXT)

    def told(*arguments: str) -> str:
        result = CliRunner().invoke(neurovis, ["live", *arguments])
        assert result.exit_code in (1, 2)
        return result.stderr

    keep(file_beside(spec), "lesioned", SavedView(1))
    assert "there is no view 'lesoined' in" in told(str(spec), "--view", "lesoined")
    assert "did you mean 'lesioned'?" in told(str(spec), "--view", "lesoined")
    file_beside(spec).write_text(WRONG)
    assert "x.neurovis-view.yaml:3:13: error[wrong-type]" in told(str(spec), "--view", "a")
    assert "--view is of a spec" in told("--view", "a")
