"""What a layout costs grows with the network and hardly faster: the work is counted, in calls of functions."""

from __future__ import annotations

import random
import sys
import tracemalloc
from collections.abc import Callable
from types import FrameType, ModuleType
from typing import TYPE_CHECKING

import layout_conformance as suite
import pytest
from neurovis_layouts.layered import flips
from neurovis_layouts.layered.levels import Levels, Node, Segment
from neurovis_layouts.routing import obstacles, route_all
from neurovis_layouts.routing.detours import Detours
from neurovis_layouts.routing.obstacles import Obstacles, Walls

import neurovis_spec as nv
from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.layout.geometry import straight
from neurovis_spec.layout.problem import problem_of

if TYPE_CHECKING:
    from _typeshed import TraceFunction

HEAD = "neurovis: 1\nname: many\n"


def calls(network: nv.CompiledNetwork) -> int:
    """How many functions are called while a network is laid out."""
    count = 0

    def note(_frame: object, event: str, _given: object) -> None:
        nonlocal count
        count += event in ("call", "c_call")

    sys.setprofile(note)
    try:
        network.layout()
    finally:
        sys.setprofile(None)
    return count


def loops(count: int) -> nv.CompiledNetwork:
    return nv.compile_text(HEAD + "neurons: {A: {bias: 1}}\nconnections:\n" + "  - A -> A: 1\n" * count)


def parallel(count: int) -> nv.CompiledNetwork:
    return nv.compile_text(HEAD + "neurons: {A: {bias: 1}, B: {}}\nconnections:\n" + "  - A -> B: 1\n" * count)


def legs(count: int, engine: str = "grid") -> nv.CompiledNetwork:
    """Instances, a quarter of them connected with another anywhere."""
    draw = random.Random(3)
    text = HEAD + "modules: {leg: {neurons: {S: {bias: 1}, K: {}}, connections: {S -> K: 1}}}\n"
    text += f"instances: {{l: {{module: leg, count: {count}}}}}\nlayout: {{engine: {engine}}}\nconnections:\n"
    ends = [(draw.randint(1, count), draw.randint(1, count)) for _ in range(count // 4)]
    return nv.compile_text(text + "".join(f"  - l{a}.K -> l{b}.S: 1\n" for a, b in ends))


@pytest.mark.parametrize(("make", "small"), [(loops, 20), (parallel, 20)])
def test_twice_as_many_cost_little_more_than_twice_as_much(
    make: Callable[[int], nv.CompiledNetwork], small: int
) -> None:
    calls(make(2))  # whatever is imported
    assert calls(make(2 * small)) < 2.6 * calls(make(small))


def test_a_way_round_many_frames_meets_few_of_them(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 400 frames no search compares its lines with more than some, however many ways it tries."""
    compared: list[int] = []

    def counted(a: FloatArray, b: FloatArray, rects: FloatArray) -> tuple[IntArray, IntArray]:
        compared.append(len(a) * len(rects))
        return meetings(a, b, rects)

    meetings = obstacles.meetings
    monkeypatch.setattr(obstacles, "meetings", counted)
    centres = [(4.0 * i, 4.0 * j) for i in range(20) for j in range(20)]
    frames = [(frozenset({k}), (x - 1.5, y - 1.5, x + 1.5, y + 1.5)) for k, (x, y) in enumerate(centres)]
    detours = Detours(Walls(frames, len(centres)), centres, None)
    draw = random.Random(1)
    ways = [tuple(draw.sample(range(400), 2)) for _ in range(200)]
    assert all(detours.route(a, b, True) for a, b in ways)
    assert sum(compared) / len(ways) < 80_000


@pytest.mark.parametrize("engine", ["grid", "circular"])
def test_among_many_frames_no_route_enters_a_foreign_one(engine: str) -> None:
    network = legs(150, engine)
    layout = network.layout()
    assert suite.through_frames(layout.value, problem_of(network.network)) == []
    assert layout.metrics()["edges_over_neurons"] == 0


def test_what_stands_in_the_way_of_many_long_routes_is_found_in_little_memory() -> None:
    """1,500 routes of 60 units across a grid, of half a million points: looked at all at once they took 80 MB."""
    centres = [(1.5 * i, 1.5 * j) for i in range(40) for j in range(40)]
    discs = Obstacles(centres)
    walls = Walls([(frozenset({1}), (10.0, 10.0, 12.0, 12.0))], len(centres))
    own = [(0, k) for k in range(100, len(centres))]
    routes = [straight((0.0, 0.0), (60.0, 0.04 * k)) for _, k in own]
    tracemalloc.start()
    try:
        discs.clearances(routes, own)
        walls.entered(routes, own)
        assert tracemalloc.get_traced_memory()[1] < 15e6
    finally:
        tracemalloc.stop()


def lines_run(task: Callable[[], object], module: ModuleType) -> int:
    """How many lines of a module are run by a task."""
    count = 0

    def note(frame: FrameType, event: str, _given: object) -> TraceFunction | None:
        nonlocal count
        count += event == "line"
        return note if frame.f_code.co_filename == module.__file__ else None

    sys.settrace(note)
    try:
        task()
    finally:
        sys.settrace(None)
    return count


def test_what_reflecting_a_frame_costs_grows_with_its_connections() -> None:
    """Two frames, one below the other, their neurons connected in the opposite order: not every connection with every
    other, one by one."""

    def reflected(count: int) -> set[int]:
        across = [float(i) for i in range(count)]
        nodes = [
            Node(
                rank, tuple((rank * count + i, x, 0.0) for i, x in enumerate(across)), (float(count), 0.0), framed=True
            )
            for rank in (0, 1)
        ]
        segments = [Segment(0, x, 1, -x, 1.0) for x in across]
        return flips.reflected(Levels(nodes, [[0], [1]], [segments]), [[0], [1]], {0})[2]

    assert reflected(20) == {0}
    assert lines_run(lambda: reflected(400), flips) < 3 * lines_run(lambda: reflected(200), flips)


def test_what_is_boxed_is_routed_once() -> None:
    """A box that others would stand in becomes a frame, before any connection is drawn beside it; and each is drawn
    once, however many become frames after it."""
    routed = 0

    def note(frame: FrameType, event: str, _given: object) -> None:
        nonlocal routed
        if event == "call" and frame.f_code is route_all.__code__:
            routed += len(frame.f_locals["edges"])

    draw = random.Random(2)
    pairs = sorted({(draw.randrange(24), draw.randrange(24)) for _ in range(60)})
    text = HEAD + "neurons:\n" + "".join(f"  A{i}: {{bias: 1, box: box {i % 3}}}\n" for i in range(24))
    text += "layout: {engine: layered}\nconnections:\n" + "".join(f"  - A{a} -> A{b}: 1\n" for a, b in pairs)
    network = nv.compile_text(text)
    sys.setprofile(note)
    try:
        network.layout()
    finally:
        sys.setprofile(None)
    assert routed == len(pairs)
