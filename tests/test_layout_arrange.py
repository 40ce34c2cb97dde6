from __future__ import annotations

import gc
from dataclasses import dataclass, field, replace

import layout_conformance as suite
import pytest

from neurovis_spec import plugins
from neurovis_spec.layout import Capabilities, Layout, LayoutProblem, LayoutRefusalError, Point
from neurovis_spec.layout.arrange import lay_out_problem
from neurovis_spec.layout.choose import choose_engine
from neurovis_spec.layout.engines import engine_of, refuse
from neurovis_spec.layout.geometry import straight
from neurovis_spec.layout.model import LayoutMirror, LayoutModule
from neurovis_spec.layout.problem import NamedProblem

PAIR = NamedProblem("pair", ["A", "B"], [("A", ["A"]), ("B", ["B"])], suite.named([("A", "B")])).canonical()


def test_auto_is_manual_where_everything_is_pinned() -> None:
    pinned = NamedProblem("pair", ["A", "B"], pins={"A": (0.0, 0.0), "B": (1.0, 0.0)}).canonical()
    assert choose_engine(pinned)[0] == "manual"
    assert lay_out_problem(pinned).engine == "manual"
    assert choose_engine(PAIR)[0] == "layered"
    assert lay_out_problem(PAIR).engine == "layered"
    mirrored = replace(pinned, mirrors=(LayoutMirror(-1, ((0, 1),)),))
    assert lay_out_problem(mirrored).engine == "layered", "'manual' draws no mirror images"


def tangle(count: int, steps: tuple[int, ...] = (1, 7, 11)) -> LayoutProblem:
    """Every neuron drives those ``steps`` after it, round a circle."""
    names = [f"N{i}" for i in range(count)]
    pairs = [(names[i], names[(i + step) % count]) for i in range(count) for step in steps]
    return NamedProblem("tangle", names, [("N", names)], suite.named(pairs)).canonical()


def test_auto_draws_tangles_as_clusters_and_complete_ones_on_a_ring() -> None:
    assert choose_engine(tangle(60))[0] == "organic"
    assert "densely" in choose_engine(tangle(300))[1]
    assert choose_engine(tangle(60, tuple(range(1, 60))))[0] == "circular"
    assert choose_engine(tangle(600))[0] == "organic"
    for ordinary in (tangle(20), tangle(60, (1,)), PAIR):
        assert choose_engine(ordinary)[0] == "layered"
    forward = tangle(60)
    acyclic = replace(forward, edges=tuple(e for e in forward.edges if e.target > e.source))
    assert choose_engine(acyclic)[0] == "layered"
    layers = [(f"{a}{i}", f"{b}{j}") for a, b in ("AB", "BC", "CA") for i in range(20) for j in range(0, 20, 4)]
    assert choose_engine(grouped("ABC", 20, layers))[0] == "layered"


def test_auto_never_chooses_an_engine_that_takes_fewer_connections(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = tangle(60, tuple(range(1, 60)))
    assert choose_engine(problem)[0] == "circular"
    circular = engine_of("circular")
    few = replace(circular.capabilities, edges=len(problem.edges) - 1)
    monkeypatch.setattr(type(circular), "capabilities", few)
    engine, why = choose_engine(problem)
    assert (engine, why.partition("'")[2]) == ("organic", "circular' does not draw so many neurons and connections")
    refuse(problem, engine, engine_of(engine).capabilities)


@pytest.mark.parametrize("boxed", [False, True])
def test_auto_draws_large_tangles_by_an_engine_that_takes_them(boxed: bool) -> None:
    problem = tangle(400, tuple(range(1, 60)))
    if boxed:
        problem = replace(problem, boxes=(("half", tuple(range(200))),))
    engine, why = choose_engine(problem)
    assert engine == "organic"
    assert "densely" in why
    refuse(problem, engine, engine_of(engine).capabilities)


def test_auto_takes_the_engine_for_many_neurons_also_where_nothing_connects_them() -> None:
    names = [f"N{i:06}" for i in range(100_001)]
    engine, why = choose_engine(NamedProblem("many", names, [("N", names)]).canonical())
    assert engine == "organic"
    assert "'layered' does not draw so many" in why


def test_auto_keeps_boxes_whole_that_many_connections_run_between() -> None:
    halves = (("a", tuple(range(30))), ("b", tuple(range(30, 60))))
    for steps in ((1, 7, 11), tuple(range(1, 60))):  # a ring would tear them apart
        assert choose_engine(replace(tangle(60, steps), boxes=halves))[0] == "organic"
    pairs = [
        (f"{a}{i}", f"{b}{(7 * i + k) % 100}") for a, b in ("AB", "BC", "CA") for i in range(100) for k in range(4)
    ]
    loose = grouped("ABC", 100, pairs)
    assert choose_engine(replace(loose, boxes=(("one", tuple(range(100))),)))[0] == "organic"


def test_auto_draws_mirror_images_as_it_draws_what_has_none() -> None:
    names = [f"{side}{i}" for side in "LR" for i in range(150)]
    pairs = sorted(
        {(f"{a}{i}", f"{b}{(7 * i + 31 * k) % 150}") for i in range(150) for k in range(2) for a in "LR" for b in "LR"}
    )
    many = NamedProblem("worm", names, edges=suite.named(pairs)).canonical()
    mirror = (LayoutMirror(-1, tuple((i, i + 150) for i in range(150))),)
    assert choose_engine(many)[0] == choose_engine(replace(many, mirrors=mirror))[0] == "organic"
    few = replace(many, edges=many.edges[:100])
    assert choose_engine(few)[0] == choose_engine(replace(few, mirrors=mirror))[0] == "layered"
    # what others show best has no mirror images there
    placed = replace(few, places=tuple((float(i % 20), float(i // 20)) for i in range(300)))
    assert (choose_engine(placed)[0], choose_engine(replace(placed, mirrors=mirror))[0]) == ("spatial", "layered")


def grouped(groups: str, size: int, pairs: list[tuple[str, str]]) -> LayoutProblem:
    members = [(name, [f"{name}{i}" for i in range(size)]) for name in groups]
    return NamedProblem(
        "grouped", [neuron for _, of in members for neuron in of], members, suite.named(pairs)
    ).canonical()


def test_auto_keeps_the_flow_of_long_chains_and_of_trees() -> None:
    count = 1200

    def made(*pairs: tuple[int, int]) -> LayoutProblem:
        return grouped("A", count, [(f"A{a}", f"A{b}") for a, b in sorted(set(pairs))])

    chain = [(i, i + 1) for i in range(count - 1)]
    tree = [((i - 1) // 3, i) for i in range(1, count)]
    halves = [(i, i + 1) for i in range(count - 1) if i != count // 2]
    upwards, more = [(b, a) for a, b in tree], [*chain, (3, 9), (5, 7)]
    for branches in (chain, [*chain, (count - 1, 0)], tree[:900], halves, more, [*tree, (3, 9), (5, 7)]):
        assert choose_engine(made(*branches))[0] == "layered"
    for branches in (tree, upwards):
        assert "without a crossing" in choose_engine(made(*branches))[1]
    assert "chains or trees" in choose_engine(made(*chain))[1]
    # as many connections, but they merge everywhere, or all at one
    crossed = [(i, (7 * i + k) % count) if i % 2 else ((7 * i + k) % count, i) for i in range(count) for k in (1, 300)]
    for tangled in (crossed, [(0, i) for i in range(1, count)]):
        assert choose_engine(made(*tangled))[0] == "organic"
    for branches in (tree, [*tree, (3, 9), (5, 7)]):
        ranks = lay_out_problem(made(*branches)).positions
        # but for the few lines between bands, in which stands what would be much wider than a page
        assert sum(ranks[f"A{a}"][1] >= ranks[f"A{b}"][1] for a, b in branches) < 0.01 * len(branches)


def test_auto_draws_trees_to_and_fro_and_wide_stars_as_such() -> None:
    def made(*pairs: tuple[int, int]) -> LayoutProblem:
        return grouped("A", 150, [(f"A{a}", f"A{b}") for a, b in sorted(set(pairs))])

    tree = [((i - 1) // 3, i) for i in range(1, 150)]
    to_and_fro = made(*((a, b) if b % 2 else (b, a) for a, b in tree))
    for trees in (to_and_fro, made(*((0, i) for i in range(1, 150))), made(*((i, 0) for i in range(1, 150)))):
        engine, why = choose_engine(trees)
        assert engine == "organic"
        assert "trees" in why
    for others in (
        made(*tree),
        made(*((0, i) for i in range(1, 90))),
        made(*((i, i + 1) if i % 2 else (i + 1, i) for i in range(149))),
        made(*((0, i) for i in range(1, 150)), (1, 2)),
        replace(to_and_fro, pins={0: (0.0, 0.0)}),
        replace(to_and_fro, boxes=(("box", (0, 1)),)),
    ):
        assert choose_engine(others)[0] == "layered"


def test_auto_draws_clusters_where_connections_are_many_and_groups_no_layers() -> None:
    forward = [(f"{a}{i}", f"{b}{j}") for a, b in ("AB", "BC") for i in range(30) for j in range(30)]
    assert choose_engine(grouped("ABC", 30, forward))[0] == "layered"
    back = grouped("ABC", 30, [*forward, ("C1", "A1")])
    assert choose_engine(back)[0] == "organic"
    assert "1801 connections" in choose_engine(back)[1]
    assert choose_engine(replace(back, pins={0: (0.0, 0.0)}))[0] == "organic"
    for asked in ({"arrange": (((0, 1), "row"),)}, {"align": ((0, 1),)}):
        assert choose_engine(replace(back, **asked))[0] == "layered"
    within = replace(back, modules=(LayoutModule("m", "m", -1, (0, 1), "t"),))
    assert choose_engine(within)[0] == "layered"


def test_an_unknown_engine_is_answered_with_the_nearest() -> None:
    with pytest.raises(LayoutRefusalError, match="no layout engine 'layred'") as caught:
        lay_out_problem(PAIR, "layred")
    assert caught.value.code == "unknown-engine"
    assert caught.value.hint == "did you mean 'layered'?"


def test_manual_names_a_neuron_without_a_position() -> None:
    with pytest.raises(LayoutRefusalError, match="'A', 'B' have none") as caught:
        lay_out_problem(PAIR, "manual")
    assert caught.value.code == "position-missing"


@pytest.mark.parametrize("engine", suite.ENGINES)
def test_pins_closer_than_a_disc_are_refused_by_name(engine: str) -> None:
    pins = {"A": (0.0, 0.0), "B": (0.4, 0.4)}
    with pytest.raises(LayoutRefusalError, match=r"'A' and 'B' are closer than 0\.6") as caught:
        lay_out_problem(NamedProblem("close", ["A", "B"], pins=pins).canonical(), engine)
    assert caught.value.code == "pins-too-close"


def test_pins_just_a_disc_apart_are_fine() -> None:
    pins = {"A": (0.0, 0.0), "B": (0.6, 0.0), "C": (0.3, 0.6), "D": (1.2, 0.0)}
    assert lay_out_problem(NamedProblem("near", list(pins), pins=pins).canonical()).positions == pins


@pytest.mark.parametrize(
    ("problem", "code"),
    [
        (NamedProblem("p", ["A", "B"], pins={"A": (0.0, 0.0)}).canonical(), "layout-pins-unsupported"),
        (NamedProblem("p", ["A"], arrange=[(["A"], "row")]).canonical(), "layout-arrange-unsupported"),
        (NamedProblem("p", ["A"], boxes=[("frame", ["A"])]).canonical(), "layout-boxes-unsupported"),
        (NamedProblem("p", ["A"], direction="right").canonical(), "layout-direction-unsupported"),
        (NamedProblem("p", ["A", "B", "C"]).canonical(), "layout-too-large"),
    ],
)
def test_what_an_engine_cannot_do_is_refused(problem: LayoutProblem, code: str) -> None:
    with pytest.raises(LayoutRefusalError) as caught:
        refuse(problem, "poor", Capabilities(neurons=2))
    assert caught.value.code == code


def test_circular_and_grid_say_that_they_cannot_arrange() -> None:
    for engine in ("circular", "grid"):
        with pytest.raises(LayoutRefusalError, match=f"'{engine}' cannot arrange"):
            lay_out_problem(NamedProblem("p", ["A"], arrange=[(["A"], "row")]).canonical(), engine)


@dataclass
class Broken:
    """An engine of somebody else's that gives back whatever it was given."""

    layout: Layout
    name: str = "broken"
    capabilities: Capabilities = field(default_factory=Capabilities)

    def lay_out(self, problem: LayoutProblem) -> Layout:
        return self.layout


A, B = (0.0, 0.0), (3.0, 4.0)
ROUTE = {"A -> B": straight(A, B)}


@pytest.mark.parametrize(
    ("positions", "routes", "message"),
    [
        ({"A": A}, ROUTE, "place every neuron"),
        ({"A": A, "B": B, "C": B}, ROUTE, "place every neuron"),
        ({"A": A, "B": (float("nan"), 0.0)}, ROUTE, "'B' a position that is not finite"),
        ({"A": A, "B": B}, {}, "route every connection"),
        ({"A": A, "B": B}, {"A -> B": (A, A, B)}, "'A -> B' a route that is no cubic spline"),
        ({"A": A, "B": B}, {"A -> B": straight(B, A)}, "centre to centre"),
    ],
)
def test_what_an_engine_gives_back_is_checked(
    monkeypatch: pytest.MonkeyPatch,
    positions: dict[str, Point],
    routes: dict[str, tuple[Point, ...]],
    message: str,
) -> None:
    engine = Broken(Layout("pair", "broken", positions, routes))
    monkeypatch.setattr(plugins, "load", lambda group, name: engine)
    with pytest.raises(LayoutRefusalError, match=message) as caught:
        lay_out_problem(PAIR, "broken")
    assert caught.value.code == "broken-engine"


def test_results_are_put_on_the_grid_and_at_the_origin(monkeypatch: pytest.MonkeyPatch) -> None:
    a, b = (-7.30001, 2.0), (1.3, -1 / 3)
    engine = Broken(Layout("pair", "broken", {"B": b, "A": a}, {"A -> B": straight(a, b)}))
    monkeypatch.setattr(plugins, "load", lambda group, name: engine)
    layout = lay_out_problem(PAIR, "broken")
    assert list(layout.positions) == ["A", "B"]
    assert layout.positions["A"] == (0.0, (2048 + 341) / 1024)
    assert layout.positions["B"] == ((1331 + 7475) / 1024, 0.0)
    assert layout.routes["A -> B"][0] == layout.positions["A"]
    assert layout.routes["A -> B"][-1] == layout.positions["B"]


def test_the_search_for_garbage_goes_on_after_a_layout() -> None:
    assert gc.isenabled()
    lay_out_problem(PAIR, "layered")
    assert gc.isenabled()
    gc.disable()
    try:
        lay_out_problem(PAIR, "layered")
        assert not gc.isenabled()
    finally:
        gc.enable()
