"""Layouts that are kept in the user's cache: the same to the bit, made once, and nothing where anything is wrong."""

from __future__ import annotations

import os
import stat
from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest
from neurovis_layouts.layered import LayeredEngine

import neurovis_spec as nv
from neurovis_spec import user_cache
from neurovis_spec.layout import kept
from neurovis_spec.layout.file import dump
from neurovis_spec.layout.model import Layout, LayoutProblem, LayoutRefusalError
from neurovis_spec.live.commands import Appearance, Draw, Restart
from neurovis_spec.live.desk import Desk
from neurovis_spec.live.run import Run
from neurovis_spec.live.show import Show

#: a title, pins that are off the grid, labels beside discs, a mirror, boxes, a symmetric pair, places of some neurons
SPEC = """neurovis: 1
name: x
title: a λ
modules: {leg: {neurons: {S: {bias: 1}, Knee: {count: 3}}, connections: {S -> Knee: 1, Knee -> S: 0.2}}}
instances: {left: {module: leg}, right: {module: leg}}
neurons:
  C: {count: 2, bias: 0.1, box: head}
  sensor_of_the_wall: {position: [0.1, 0.7]}
connections: {C1 -> left.S: {weight: 1, delay: 2}, C2 -> right.S: 1, C1 -> C2: {weight: 1, symmetric: true},
              sensor_of_the_wall -> C: 1}
layout: {mirror: [[left, right], [C1, C2]], positions: {sensor_of_the_wall: [0.1, -3.3]}}
"""
TINY = """neurovis: 1
name: tiny
neurons: {A: {}, B: {}}
connections: {A -> B: {weight: 1, delay: 2}}
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv(user_cache.ENVIRONMENT_VARIABLE, "")
    return user_cache.folder("layouts")


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> Counter[str]:
    """How often each network was laid out."""
    count, lay_out = Counter[str](), LayeredEngine.lay_out

    def counted(self: LayeredEngine, problem: LayoutProblem, *more: object) -> Layout:
        count[repr((problem.network, problem.neurons))] += 1
        return lay_out(self, problem)

    monkeypatch.setattr(LayeredEngine, "lay_out", counted)
    return count


def test_a_layout_that_is_kept_is_the_same_to_the_bit_and_made_once(folder: Path, made: Counter[str]) -> None:
    fresh = nv.compile_text(SPEC).arranged()
    first, second = (nv.compile_text(SPEC).placed() for _ in range(2))
    assert repr((first.positions, first.routes, first.labels)) == repr((fresh.positions, fresh.routes, fresh.labels))
    assert repr((second.positions, second.routes, second.labels)) == repr((fresh.positions, fresh.routes, fresh.labels))
    assert dump(second) == dump(fresh)
    assert list(made.values()) == [2]  # by itself, and for the first
    (file,) = folder.iterdir()
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    assert file.stat().st_size < user_cache.MOST_BYTES
    for engine in ("circular", "organic"):
        assert nv.compile_text(TINY).placed(engine) == nv.compile_text(TINY).arranged(engine)
        assert nv.compile_text(TINY).placed(engine) == nv.compile_text(TINY).arranged(engine)
    assert len(list(folder.iterdir())) == 3


def test_what_a_layout_follows_from_is_part_of_what_it_is_kept_by(monkeypatch: pytest.MonkeyPatch) -> None:
    others = [
        ("", ""),
        ("[0.1, -3.3]", "[0.1, -3.4]"),
        ("delay: 2", "delay: 3"),
        ("layout: {", "layout: {direction: right, "),
        ("box: head", "box: the_head"),
        ("symmetric: true", "symmetric: false"),
        ("[0.1, 0.7]", "[0.1, 0.8]"),
    ]
    problem, *more = (nv.compile_text(SPEC.replace(*other)).problem for other in others)
    more += [problem, replace(problem, effort="best"), replace(problem, memory=Layout("x", "", {"C1": (0.0, 0.0)}, {}))]
    keys = [kept.key_of(one, engine) for one in more for engine in ("auto", "layered")]
    monkeypatch.setattr(kept, "code", lambda: "another version")
    keys.append(kept.key_of(problem, "auto"))
    assert len(set(keys)) == len(keys)
    titled = nv.compile_text(SPEC.replace("title: a", "title: b")).problem
    assert kept.key_of(titled, "auto") == keys[-1]
    assert kept.key_of(problem, "that_of_somebody_else") is None


@pytest.mark.parametrize("harm", ["torn", "foreign", "empty", "of another", "a folder", "others may write"])
def test_a_cache_that_is_harmed_is_none(folder: Path, made: Counter[str], harm: str) -> None:
    fresh = nv.compile_text(TINY).placed()
    (file,) = folder.iterdir()
    data = file.read_bytes()
    if harm == "of another":
        nv.compile_text(TINY.replace("delay: 2", "delay: 4")).placed()
        data = next(other for other in folder.iterdir() if other != file).read_bytes()
    elif harm == "a folder":
        file.unlink()
        file.mkdir()
    elif harm == "others may write":
        folder.chmod(0o777)
    else:
        data = {"torn": data[:-7], "foreign": b"{}\n", "empty": b""}[harm]
    if file.is_file():
        file.write_bytes(data)
    made.clear()
    assert nv.compile_text(TINY).placed() == fresh
    assert sum(made.values()) == 1


def test_the_cache_is_bounded_and_the_oldest_goes(folder: Path) -> None:
    cache = user_cache.UserCache("layouts", most=1000)
    for number in range(9):
        cache.keep(str(number), os.urandom(120))
        for place, file in enumerate(sorted(folder.iterdir(), key=lambda file: file.stat().st_mtime_ns)):
            os.utime(file, (place, place))
    assert sum(file.stat().st_size for file in folder.iterdir()) <= 1000
    assert [cache.read(str(number)) is not None for number in (0, 8)] == [False, True]
    cache.keep("large", os.urandom(400))
    assert cache.read("large") is None


def test_nothing_is_kept_where_that_is_not_wanted_or_not_possible(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(user_cache.ENVIRONMENT_VARIABLE, "off")
    nv.compile_text(TINY).placed()
    assert not folder.exists()
    monkeypatch.setenv(user_cache.ENVIRONMENT_VARIABLE, "")
    folder.parent.parent.write_text("no folder")
    nv.compile_text(TINY).placed()
    with pytest.raises(LayoutRefusalError):
        nv.compile_text(TINY).placed("manual")


def test_a_start_lays_out_once_whatever_is_asked_then(folder: Path, made: Counter[str]) -> None:
    network, show = nv.compile_text(SPEC), Show()
    source, view = show.stage(network)
    run = Run(source, view, lambda shown: None, lambda: False)
    desk = Desk(network, show.engine, show.view, run, lambda text: None)
    for appearance in (Appearance(activity=2), Appearance(pathways=True), Appearance(pathways=True, activity=2)):
        view.otherwise(appearance).dressed("dark")
    run.ask(Draw(Appearance(signal=2)))
    run.ask(Restart())
    run.start()
    run.end()
    desk.renew(nv.compile_text(SPEC.replace("title: a", "title: b")))
    whole = {what: times for what, times in made.items() if "sensor" in what}
    assert list(whole.values()) == [1]
