"""From a network to its layout: call an engine, hold it to what it declares, check and tidy what it gives back.

In: a Network or a LayoutProblem, and perhaps an engine's name. Out: a Layout. What an engine cannot do is refused
before it starts; what it gives back is checked, put on the grid of 1/1024 and moved to the origin.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import cast

from neurovis_spec.gc_paused import uncollected
from neurovis_spec.layout.choose import choose_engine
from neurovis_spec.layout.engines import engine_of, refuse
from neurovis_spec.layout.geometry import distance, snap
from neurovis_spec.layout.model import (
    Capabilities,
    Layout,
    LayoutProblem,
    LayoutRefusalError,
    Point,
    ReportingEngine,
    Route,
)
from neurovis_spec.progress import Progress


def lay_out_problem(problem: LayoutProblem, engine: str = "auto", progress: Progress | None = None) -> Layout:
    """The layout of a problem: positions on the grid (pins exact), one route for every edge.

    Raises LayoutRefusalError where the engine is unknown, or cannot do what the problem asks for.
    """
    name = choose_engine(problem)[0] if engine == "auto" else engine
    chosen = engine_of(name)
    problem = _as_remembered(problem, chosen.capabilities)
    refuse(problem, name, chosen.capabilities)
    with uncollected():
        if progress is not None and chosen.capabilities.progress:
            result = cast(ReportingEngine, chosen).lay_out(problem, progress)
        else:
            result = chosen.lay_out(problem)
        _check(problem, name, result)
        return _tidy(problem, name, result)


def _as_remembered(problem: LayoutProblem, can: Capabilities) -> LayoutProblem:
    """A problem of whose earlier layout the page chose the direction, in this."""
    earlier = None if problem.memory is None else problem.memory.direction
    if earlier is None or not (problem.turnable and can.direction):
        return problem
    return replace(problem, direction=earlier)


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
    labelled = {neuron for neuron, room in zip(problem.neurons, problem.labels, strict=False) if room[0]}
    labels = {neuron: result.labels[neuron] for neuron in problem.neurons if neuron in labelled & result.labels.keys()}
    direction = result.direction
    if problem.turnable and problem.memory is not None and direction is None:
        direction = problem.memory.direction
    return Layout(problem.network, name, positions, routes, labels, direction)
