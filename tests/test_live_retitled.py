"""A spec of which the title alone was edited: what is shown is as if all were compiled anew, and nothing was."""

from __future__ import annotations

from pathlib import Path

import pytest
from examples import SPECS

import neurovis_spec as nv
from neurovis_spec.live.commands import AS_IT_IS, Appearance
from neurovis_spec.live.desk import Desk
from neurovis_spec.live.live import Edited, Edits
from neurovis_spec.live.retitled import retitled
from neurovis_spec.live.run import Run
from neurovis_spec.live.show import Show

SPEC = """neurovis: 1
name: x
title: One title # of two
neurons: {A: {count: 3, activation: tanh, bias: 0.4}, B: {}}
connections: {A -> B: {weight: 1, delay: 2}}
"""
LONG = "A title that is so long that it has more than one line " * 4


@pytest.mark.parametrize(
    ("title", "again"),
    [
        ("title: Another title # of two", True),
        ('title: "λ → C_m" # of two', True),
        (f"title: {LONG}# of two", True),
        ("title: [One, other] # of two", True),
        ("title: One title # of three", False),
        ("title: One title\ndescription: more", False),
        ("title:\n  One title # of two", False),
        ("title: {No: title} # of two", False),
        ("# no title", False),
    ],
)
def test_what_has_another_title_is_what_is_compiled(tmp_path: Path, title: str, again: bool) -> None:
    file, text = tmp_path / "x.yaml", SPEC.replace("title: One title # of two", title)
    file.write_text(SPEC)
    shown = nv.compile(file)
    view = Show().view(shown)
    file.write_text(text)
    made = retitled(shown, file)
    assert (made is not None) is again
    if made is not None:
        fresh = nv.compile(file)
        assert (made.network.title, made.hash, made.text()) == (fresh.network.title, fresh.hash, fresh.text())
        content = Show().view(fresh).content
        assert Show().view(made, AS_IT_IS, view.layout, view).content == content
        assert Show().view(made).content == content


def test_pictures_of_another_title_are_the_same_in_each_appearance(tmp_path: Path) -> None:
    text, file = (SPECS / "reward.yaml").read_text(encoding="utf-8"), tmp_path / "x.yaml"
    file.write_text(text, encoding="utf-8")
    shown = nv.compile(file)
    layout = shown.placed()
    file.write_text(text.replace("title: A leg that learns to push", "title: Another"), encoding="utf-8")
    made, fresh = retitled(shown, file), nv.compile(file)
    assert made is not None
    assert made.placed() is layout
    for appearance in (AS_IT_IS, Appearance(pathways=True), Appearance(activity=2.0)):
        view = Show().view(made, appearance, layout, Show().view(shown, appearance))
        other = Show().view(fresh, appearance, layout)
        assert view.content == other.content
        assert view.dressed("dark").content == other.dressed("dark").content


def test_an_edit_of_the_title_keeps_the_run_and_compiles_nothing(tmp_path: Path) -> None:
    file, table = tmp_path / "x.yaml", tmp_path / "w.csv"
    text = SPEC.replace("weight: 1,", "matrix: {file: w.csv},")
    file.write_text(text)
    table.write_text("1\n1\n1\n")
    shown, show, told = nv.compile(file), Show(), list[str]()
    compiled: list[nv.CompiledNetwork] = []

    def anew() -> nv.CompiledNetwork:
        compiled.append(nv.compile(file))
        return compiled[-1]

    source, view = show.stage(shown)
    run = Run(source, view, lambda _: None, lambda: False, playing=False)
    desk = Desk(shown, None, show.view, run, told.append)
    edits = Edits(show, Edited(file, anew), run, told.append, desk)
    run.start()
    try:

        def edit(of: str) -> str:
            file.write_text(of)
            edits._edited()
            return run.view.plan.title

        assert edit(text.replace("One title", "Another")) == "Another"
        assert (compiled, source.network) == ([], shown.network)
        table.write_text("2\n2\n2\n")
        assert edit(text.replace("One title", "A third one")) == "A third one"
        assert len(compiled) == 1
        assert edit(text.replace("One title", "title: {")) == "A third one"
        assert edit(text) == "One title"
        assert desk.placed.compiled.network.connections.weights.whole().tolist() == [2.0, 2.0, 2.0]
    finally:
        run.end()
