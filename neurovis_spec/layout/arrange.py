"""From a network to its layout: call an engine, hold it to what it declares, check and tidy what it gives back.

In: a Network or a LayoutProblem, and perhaps an engine's name. Out: a Layout. What an engine cannot do is refused
before it starts; what it gives back is checked, put on the grid of 1/1024 and moved to the origin.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import cast

from neurovis_spec import plugins
from neurovis_spec.compiler.network import Network
from neurovis_spec.diagnostics import suggest
from neurovis_spec.garbage import uncollected
from neurovis_spec.layout.choose import choose_engine
from neurovis_spec.layout.geometry import distance, snap
from neurovis_spec.layout.model import (
    RADIUS,
    Capabilities,
    Layout,
    LayoutEngine,
    LayoutProblem,
    LayoutRefusalError,
    Point,
    ReportingEngine,
    Route,
)
from neurovis_spec.layout.problem import problem_of
from neurovis_spec.progress import Progress

#: Rounding in the last bit does not make two pins overlap.
_SLACK = 1e-9


def lay_out(
    network: Network, engine: str | None = None, memory: Layout | None = None, progress: Progress | None = None
) -> Layout:
    """The layout of a network, by the engine named here, else by the spec's; what an earlier one (``memory``) knew
    stays where it was. Raises LayoutRefusalError."""
    return lay_out_problem(problem_of(network, memory), engine or network.layout.engine, progress)


def lay_out_problem(problem: LayoutProblem, engine: str = "auto", progress: Progress | None = None) -> Layout:
    """The layout of a problem: positions on the grid (pins exact), one route for every edge.

    Raises LayoutRefusalError where the engine is unknown, or cannot do what the problem asks for.
    """
    name = choose_engine(problem)[0] if engine == "auto" else engine
    chosen = _engine(name)
    refuse_what_it_cannot(problem, name, chosen.capabilities)
    _refuse_close_pins(problem)
    with uncollected():
        if progress is not None and chosen.capabilities.progress:
            result = cast(ReportingEngine, chosen).lay_out(problem, progress)
        else:
            result = chosen.lay_out(problem)
        _check(problem, name, result)
        return _tidy(problem, name, result)


def _engine(name: str) -> LayoutEngine:
    try:
        made: object = plugins.load(plugins.LAYOUTS, name)
    except KeyError:
        known = plugins.names(plugins.LAYOUTS)
        hint = suggest(name, ("auto", *known), "known engines")
        raise LayoutRefusalError("unknown-engine", f"there is no layout engine '{name}' here", hint) from None
    if not isinstance(made, LayoutEngine) or not isinstance(made.capabilities, Capabilities):
        raise LayoutRefusalError("broken-engine", f"what is installed as layout engine '{name}' is none")
    return made


def refuse_what_it_cannot(problem: LayoutProblem, name: str, can: Capabilities) -> None:
    """Raise LayoutRefusalError for the first thing that the problem asks for beyond the capabilities."""
    neurons, edges = len(problem.neurons), len(problem.edges)
    if neurons > can.neurons or edges > can.edges:
        raise LayoutRefusalError(
            "layout-too-large",
            f"the engine '{name}' draws at most {can.neurons} neurons and {can.edges} connections; "
            f"this network has {neurons} and {edges}",
        )
    if not can.free and len(problem.pins) < neurons:
        free = [n for i, n in enumerate(problem.neurons) if i not in problem.pins]
        more = f" and {len(free) - 1} more" if len(free) > 1 else ""
        raise LayoutRefusalError(
            "position-missing",
            f"the engine '{name}' needs a position for every neuron; '{free[0]}'{more} has none",
            "give it one in layout.positions, or choose the layered engine, which arranges the rest around the pins",
            tuple(free),
        )
    asked: Mapping[str, tuple[bool, bool, str]] = {
        "layout-pins-unsupported": (bool(problem.pins), can.pins, "keep pinned positions (layout.positions)"),
        "layout-arrange-unsupported": (bool(problem.arrange), can.arrange, "arrange groups (layout.arrange)"),
        "layout-boxes-unsupported": (bool(problem.boxes), can.boxes, "keep the members of a box together"),
        "layout-mirror-unsupported": (bool(problem.mirrors), can.mirrors, "draw mirror images (layout.mirror)"),
        "layout-align-unsupported": (bool(problem.align), can.align, "put neurons on one line (layout.align)"),
        "layout-memory-unsupported": (problem.memory is not None, can.memory, "remember a layout (layout.file)"),
        "layout-direction-unsupported": (problem.direction != "down", can.direction, "draw in another direction"),
    }
    for code, (wanted, possible, what) in asked.items():
        if wanted and not possible:
            raise LayoutRefusalError(code, f"the engine '{name}' cannot {what}", "the engine 'layered' can")


def _refuse_close_pins(problem: LayoutProblem) -> None:
    """Two pins whose discs would overlap, found through cells as wide as a disc."""
    cells: dict[tuple[int, int], list[int]] = {}
    for index, (x, y) in sorted(problem.pins.items()):
        if not (math.isfinite(x) and math.isfinite(y)):
            name = problem.neurons[index]
            raise LayoutRefusalError("pin-not-finite", f"the pin of '{name}' is not finite", about=(name,))
        column, row = math.floor(x / (2 * RADIUS)), math.floor(y / (2 * RADIUS))
        for near in ((column + i, row + j) for i in (-1, 0, 1) for j in (-1, 0, 1)):
            for other in cells.get(near, ()):
                if distance(problem.pins[other], (x, y)) < 2 * RADIUS - _SLACK:
                    raise LayoutRefusalError(
                        "pins-too-close",
                        f"the pins of '{problem.neurons[other]}' and '{problem.neurons[index]}' are closer than "
                        f"{2 * RADIUS:g}: their discs would overlap",
                        about=(problem.neurons[other], problem.neurons[index]),
                    )
        cells.setdefault((column, row), []).append(index)


def _check(problem: LayoutProblem, name: str, result: Layout) -> None:
    """Hold an engine, ours or anybody's, to its promise."""

    def fault(what: str) -> LayoutRefusalError:
        return LayoutRefusalError("broken-engine", f"the engine '{name}' {what}")

    if set(result.positions) != set(problem.neurons):
        raise fault("did not place every neuron of the network, and no other, once")
    if set(result.routes) != {edge.name for edge in problem.edges}:
        raise fault("did not route every connection of the network, and no other, once")
    for placed, position in result.positions.items():
        if not all(math.isfinite(c) for c in position):
            raise fault(f"gave '{placed}' a position that is not finite")
    for edge in problem.edges:
        route = result.routes[edge.name]
        if len(route) < 4 or len(route) % 3 != 1 or not all(math.isfinite(c) for point in route for c in point):
            raise fault(f"gave '{edge.name}' a route that is no cubic spline")
        for point, neuron in ((route[0], edge.source), (route[-1], edge.target)):
            if distance(point, result.positions[problem.neurons[neuron]]) > 0.01:
                raise fault(f"gave '{edge.name}' a route that does not lead from centre to centre")


def _tidy(problem: LayoutProblem, name: str, result: Layout) -> Layout:
    """On the grid, at the origin where nothing is pinned, neurons in natural order, ends exactly at centres."""
    shift = (0.0, 0.0)
    free = not problem.pins and all(module.origin is None for module in problem.modules)
    if free and problem.memory is None and problem.neurons:
        shift = (
            min(snap(x) for x, _ in result.positions.values()),
            min(snap(y) for _, y in result.positions.values()),
        )

    def moved(point: Point) -> Point:
        return snap(point[0]) - shift[0] + 0.0, snap(point[1]) - shift[1] + 0.0

    given: dict[int, Point] = {}
    for a, b in (pair for mirror in problem.mirrors for pair in mirror.pairs):
        # where a pin is not on the grid its mirror image is not, either
        given.update({i: result.positions[problem.neurons[i]] for i, j in ((a, b), (b, a)) if j in problem.pins})
    given.update(problem.pins)
    positions = {
        neuron: given[i] if i in given else moved(result.positions[neuron]) for i, neuron in enumerate(problem.neurons)
    }
    routes: dict[str, Route] = {}
    for edge in problem.edges:
        start, end = positions[problem.neurons[edge.source]], positions[problem.neurons[edge.target]]
        routes[edge.name] = (start, *(moved(point) for point in result.routes[edge.name][1:-1]), end)
    return Layout(problem.network, name, positions, routes)
