"""Updating a layout: what was there stays, the promises hold, and a second update changes nothing."""

from __future__ import annotations

from dataclasses import dataclass, replace
from random import Random

import layout_conformance as suite
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_layout_pins import check_pins

import neurovis_spec as nv
from neurovis_spec.diagnostics import Findings
from neurovis_spec.layout import Direction, Layout, LayoutProblem, LayoutRefusalError, Point
from neurovis_spec.layout.arrange import lay_out_problem
from neurovis_spec.layout.file import dump, parse
from neurovis_spec.layout.problem import NamedProblem, problem_of


@dataclass(frozen=True)
class Walker:
    """Legs on two sides, perhaps mirror images, with knees in them, and neurons between them."""

    count: int
    own: tuple[str, ...]
    middle: int
    inner: tuple[tuple[str, str], ...]
    links: tuple[tuple[str, str], ...]
    pins: tuple[tuple[str, Point], ...] = ()
    mirror: bool = False
    pair: bool = False
    direction: Direction = "down"

    @property
    def legs(self) -> list[str]:
        return [f"{side}{i + 1}" for side in ("left", "right") for i in range(self.count)]

    @property
    def neurons(self) -> list[str]:
        return [f"{leg}.{name}" for leg in self.legs for name in self.own] + suite.members("C", self.middle)

    def problem(self, earlier: Layout | None = None) -> LayoutProblem:
        names = self.neurons
        pairs = [(f"{leg}.{a}", f"{leg}.{b}") for leg in self.legs for a, b in self.inner]
        pairs += [(a, b) for a, b in self.links if a in names and b in names]
        sides = [(f"left{i + 1}", f"right{i + 1}") for i in range(self.count)]
        images = [(f"{a}.{name}", f"{b}.{name}") for a, b in sides for name in self.own]
        mirrors = [("", images, sides)] if self.mirror and sides else []
        mirrors += [("", [("C1", "C2")], [])] if self.mirror and self.pair and self.middle > 1 else []
        knees = [(f"{leg}.knee", "knee") for leg in self.legs if "knee.K1" in self.own]
        return NamedProblem(
            "walker",
            names,
            [("C", suite.members("C", self.middle))],
            suite.named(pairs),
            {name: point for name, point in self.pins if name in names},
            self.direction,
            modules=[*((leg, "leg") for leg in self.legs), *knees],
            origins={name: point for name, point in self.pins if name in self.legs},
            mirrors=mirrors,
            memory=earlier,
        ).canonical()


def spot(draw: Random) -> Point:
    return 1.5 * draw.randint(-9, 9), 1.25 * draw.randint(-9, 9)


def walker(draw: Random) -> Walker:
    own = (*suite.members("S", draw.randint(1, 4)), *(("knee.K1", "knee.K2") if draw.random() < 0.4 else ()))
    bare = Walker(draw.randint(1, 3), own, draw.randint(1, 4), (), ())
    names = [*bare.neurons, *bare.legs]
    return replace(
        bare,
        inner=tuple((draw.choice(own), draw.choice(own)) for _ in range(draw.randint(0, 6))),
        links=tuple((draw.choice(bare.neurons), draw.choice(bare.neurons)) for _ in range(draw.randint(0, 10))),
        pins=tuple((name, spot(draw)) for name in draw.sample(names, draw.choice([0, 0, 1, 2]))),
        mirror=draw.random() < 0.6,
        pair=draw.random() < 0.5,
        direction=draw.choice(("down", "up", "right", "left")),
    )


def grown(draw: Random, one: Walker) -> Walker:
    """The same with something more, or pinned elsewhere."""
    match draw.choice(("middle", "own", "leg", "inner", "link", "pin", "origin", "unpin")):
        case "middle":
            new = f"C{one.middle + 1}"
            return replace(one, middle=one.middle + 1, links=(*one.links, (new, draw.choice(one.neurons))))
        case "own":
            new = f"N{len(one.own)}"
            return replace(one, own=(*one.own, new), inner=(*one.inner, (draw.choice(one.own), new)))
        case "leg":
            return replace(one, count=one.count + 1)
        case "inner":
            return replace(one, inner=(*one.inner, (draw.choice(one.own), draw.choice(one.own))))
        case "link":
            return replace(one, links=(*one.links, (draw.choice(one.neurons), draw.choice(one.neurons))))
        case "pin":
            return replace(one, pins=(*one.pins, (draw.choice(one.neurons), spot(draw))))
        case "origin":
            return replace(one, pins=(*one.pins, (draw.choice(one.legs), spot(draw))))
    return replace(one, pins=one.pins[1:])


def written(layout: Layout) -> Layout:
    """The layout as it is read again from its file."""
    found = parse(dump(layout), "x", Findings())
    assert found is not None
    return found


@given(draw=st.randoms(use_true_random=False))
@settings(max_examples=12, deadline=None, derandomize=True)
def test_a_second_update_changes_nothing_and_the_first_keeps_all_promises(draw: Random) -> None:
    before = walker(draw)
    after = grown(draw, grown(draw, before))
    try:
        first = lay_out_problem(before.problem(), "layered")
        problem = after.problem(written(first))
        once = lay_out_problem(problem, "layered")
    except LayoutRefusalError:
        return
    check_pins(problem, once)
    paired = after.mirror and after.pair and before.middle == 1  # what stood on the axis has an image now
    if not (before.pins or after.pins or paired):
        assert all(once.positions[name] == point for name, point in first.positions.items())
    assert dump(lay_out_problem(after.problem(written(once)), "layered")) == dump(once)


LEG = Walker(2, ("S1", "S2", "S3"), 2, (("S1", "S2"), ("S1", "S3")), (("C1", "left1.S1"), ("C1", "right1.S1")))


def shape(layout: Layout, leg: str) -> list[Point]:
    """The neurons of a leg in relation to its first one."""
    own = [layout.positions[f"{leg}.{name}"] for name in LEG.own]
    return [(x - own[0][0], y - own[0][1]) for x, y in own]


@pytest.mark.parametrize("mirror", [False, True])
@pytest.mark.parametrize("name", ["right2.S2", "left1.S1"])
def test_an_instance_that_is_pinned_in_an_update_is_drawn_like_its_copies(name: str, mirror: bool) -> None:
    """As far as there is room: here there is."""
    legs = replace(LEG, mirror=mirror)
    first = lay_out_problem(legs.problem(), "layered")
    at = (first.positions[name][0] + (30.0 if name.startswith("right") else -30.0), first.positions[name][1] - 4.5)
    once = lay_out_problem(replace(legs, pins=((name, at),)).problem(written(first)), "layered")
    assert once.positions[name] == at
    like = [shape(first, "left1"), [(-x + 0.0, y) for x, y in shape(first, "left1")]]
    assert all(shape(once, leg) in like for leg in legs.legs)


def test_a_new_instance_is_drawn_like_those_whose_module_has_grown() -> None:
    first = lay_out_problem(LEG.problem(), "layered")
    more = replace(LEG, count=3, own=(*LEG.own, "N"), inner=(*LEG.inner, ("S2", "N"), ("N", "S3")))
    once = lay_out_problem(more.problem(written(first)), "layered")
    check_pins(more.problem(), once)
    assert once.positions.items() >= first.positions.items()


#: two half-centres, each with a mirror of its own, about the mirror of the whole
PAIR = """
neurovis: 1
name: pair
modules: {hc: {neurons: {F: {}, E: {}, M: {}}, connections: {F -> M: 1, E -> M: 1}, layout: {mirror: [[F, E]]}}}
instances: {a: {module: hc}, b: {module: hc}}
layout: {mirror: [[a, b]]}
"""


@pytest.mark.parametrize("moved", ["a", "b"])
def test_the_image_of_what_was_moved_by_hand_takes_its_own_axis_along(moved: str) -> None:
    problem = problem_of(nv.compile_text(PAIR).network)
    first = lay_out_problem(problem, "layered")
    by = -3.0 if moved == min("ab", key=lambda side: first.positions[f"{side}.M"][0]) else 3.0
    edited = {n: (x + by if n.startswith(moved) else x, y) for n, (x, y) in first.positions.items()}
    once = lay_out_problem(replace(problem, memory=written(replace(first, positions=edited))), "layered")
    axis = first.positions["a.M"][0] + first.positions["b.M"][0]
    for own, image in (("F", "F"), ("E", "E"), ("M", "M")):
        x, y = once.positions[f"{moved}.{own}"]
        assert (x, y) == edited[f"{moved}.{own}"]
        assert once.positions[f"{'b' if moved == 'a' else 'a'}.{image}"] == (axis - x, y)
    assert dump(lay_out_problem(replace(problem, memory=written(once)), "layered")) == dump(once)
