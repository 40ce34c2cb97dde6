"""Units: neurons that share a rank, and blocks: units that are placed as one piece.

In: a LayoutProblem. Out: units in canonical order, each neuron in exactly one. A group shares a rank, unless
connections within it run forward (a chain), or only some of its neurons are on a line with others: then each of its
neurons finds its own, as if it were in no group. Neurons that drive each other in
a loop (a half-centre oscillator, a ring, a reservoir) are one block: a row or a column where they are a line, else a
ring, with the one neuron in its middle that all of it is connected with. Of a problem that is to be symmetric each
unit is its own mirror image, on the axis, or has one (``symmetric_units``).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, replace
from functools import partial

import networkx as nx

from neurovis_layouts.alike import mirror_images
from neurovis_layouts.formations import offsets
from neurovis_layouts.frame import from_picture
from neurovis_layouts.layered.parts import symmetric
from neurovis_spec.layout.geometry import distance, snap, turn
from neurovis_spec.layout.model import Arrangement, LayoutProblem, LayoutRefusalError, Point

#: Loops of more neurons than this are unrolled along the direction instead of drawn as a ring.
_MOST_IN_A_RING = 32
#: Of no more neurons in one box than this, which drive each other, none comes first: they are one population.
_FEW = 4
_PAIR = 2.0
_LINE = 1.6
_RING = 1.2


@dataclass(frozen=True, slots=True)
class Unit:
    """Neurons of one rank; with ``places`` (offsets from its middle, x across, y along) a rigid block."""

    members: tuple[int, ...]
    places: tuple[Point, ...] | None = None
    #: how far a frame reaches from its middle, across and along; None: as far as its neurons
    reach: Point | None = None
    #: frames of one ``kin`` keep their order; those that may be drawn as their mirror images ``turns``
    kin: int = -1
    turns: bool = False
    #: how far the middle stands behind the line of its rank
    lift: float = 0.0


def units_of(problem: LayoutProblem, frames: Sequence[Unit], absent: AbstractSet[int]) -> list[Unit]:
    """The units, ordered by their first neuron, ``frames`` among them as they are; ``absent`` neurons are in none."""
    framed = {member for unit in frames for member in unit.members} | absent
    asked = [*frames, *_arranged(problem, framed)]
    found = list(asked)
    taken = framed | {member for unit in found for member in unit.members}
    lone: list[int] = []
    for group in problem.groups:
        members = [member for member in group.members if member not in taken]
        taken.update(members)
        unit = _of_group(problem, members)
        if unit is None:
            lone += members
        else:
            found.append(unit)
    lone += [i for i in range(len(problem.neurons)) if i not in taken]
    found += _of_lone(problem, sorted(lone))
    lines = _lines(problem)
    found = asked + _on_lines(problem, found[len(asked) :], asked, lines)
    found = _with_hubs(problem, _without_needless_loops(problem, found, lines), lines)
    return sorted(found, key=lambda unit: min(unit.members))


def _arranged(problem: LayoutProblem, framed: AbstractSet[int]) -> list[Unit]:
    found: list[Unit] = []
    for whole, how in problem.arrange:
        members = tuple(member for member in whole if member not in framed)
        if members:
            found.append(Unit(members, formation(problem, members, how)))
    return found


def formation(problem: LayoutProblem, members: Sequence[int], how: Arrangement) -> tuple[Point, ...]:
    """Where neurons that are arranged stand about their middle: farther apart where something connects them."""
    wide = max(problem.neuron_spacing, 0.65) * (1.5 if _graph(problem, members).size() else 1.0)
    return tuple(from_picture(place, problem.direction) for place in offsets(how, len(members), wide))


def _graph(problem: LayoutProblem, members: Iterable[int]) -> nx.DiGraph[int]:
    """The connections among these neurons, loops of one neuron to itself left out; nodes and edges in canonical
    order."""
    graph: nx.DiGraph[int] = nx.DiGraph()
    graph.add_nodes_from(sorted(members))
    for edge in problem.edges:
        if edge.source != edge.target and edge.source in graph and edge.target in graph:
            graph.add_edges_from(edge.ways)
    return graph


def _of_group(problem: LayoutProblem, members: Sequence[int]) -> Unit | None:
    """Neurons that nothing connects with each other share a rank, those all of which are in loops are a block; any
    others are where they would be without the group: it only names them."""
    if len(members) < 2:
        return None
    graph = _graph(problem, members)
    if not graph.size():
        return Unit(tuple(members))
    inside = sum(len(loop) for loop in nx.strongly_connected_components(graph) if len(loop) > 1)
    return _block(problem, members) if inside == len(members) <= _MOST_IN_A_RING else None


def _of_lone(problem: LayoutProblem, lone: Sequence[int]) -> list[Unit]:
    """Neurons declared singly: those that drive each other both ways, by delays of the same kind, are one block, unless
    one of them comes first, as what leaves them comes back through others; few in one box are one all the same."""
    kinds: dict[tuple[int, int], set[bool]] = {}
    inside = set(lone)
    for edge in problem.edges:
        if edge.source in inside and edge.target in inside and edge.source != edge.target:
            for way in edge.ways:
                kinds.setdefault(way, set()).add(edge.delay == 0)
    pairs: nx.Graph[int] = nx.Graph()
    pairs.add_nodes_from(lone)
    pairs.add_edges_from((a, b) for (a, b), kind in kinds.items() if a < b and kinds.get((b, a)) == kind)
    found: list[Unit] = []
    whole = _graph(problem, range(len(problem.neurons)))
    boxes = [set(members) for _, members in problem.boxes]
    for component in sorted(sorted(part) for part in nx.connected_components(pairs)):
        boxed = len(component) <= _FEW and any(box.issuperset(component) for box in boxes)
        if 1 < len(component) <= _MOST_IN_A_RING and (boxed or not _returns(whole, component)):
            found.append(_block(problem, component))
        else:
            found += [Unit((member,)) for member in component]
    return found


def _returns(graph: nx.DiGraph[int], members: Sequence[int]) -> bool:
    """Whether what leaves these neurons comes back to them through others: then one of them comes first."""
    inside = set(members)
    met = {after for member in members for after in graph.successors(member) if after not in inside}
    waiting = sorted(met)
    while waiting:
        for after in graph.successors(waiting.pop()):
            if after in inside:
                return True
            if after not in met:
                met.add(after)
                waiting.append(after)
    return False


def _block(problem: LayoutProblem, members: Sequence[int]) -> Unit:
    """A row where the connections are a line of neighbours, a column beside that of its mirror image where the two are
    connected neuron by neuron, else a ring; along a line or circle in its own order, from the first of ``members`` on
    that can be."""
    spacing = max(problem.neuron_spacing, 0.65)
    graph = _graph(problem, members).to_undirected()
    degrees = [degree for _, degree in graph.degree()]
    how: Arrangement = "ring"
    order, wide = list(members), _RING
    ends = [node for node in graph if graph.degree(node) == 1]
    if max(degrees) <= 2 and nx.is_connected(graph):
        near = partial(sorted, key=members.index)
        order = list(nx.dfs_preorder_nodes(graph, near(ends or members)[0], sort_neighbors=near))
        if ends:
            how, wide = "row", _PAIR if len(members) == 2 else _LINE
            if len(members) > 2 and _beside_its_image(problem, members):
                how = "column"
    if how == "ring" and len(order) in (4, 6):
        # with a side on top, not a corner: connections from above and to below find their way between
        return Unit(tuple(order), tuple(_on_its_side(offsets("ring", len(order), spacing * wide))))
    return Unit(tuple(order), tuple(offsets(how, len(order), spacing * wide)))


def _beside_its_image(problem: LayoutProblem, members: Sequence[int]) -> bool:
    """Whether most of these neurons are connected with their mirror images, which are others."""
    image = mirror_images(problem)
    graph = _graph(problem, {*members, *(image[m] for m in members if m in image)}).to_undirected()
    across = [m for m in members if m in image and graph.has_edge(m, image[m])]
    return 2 * len(across) > len(members) and not {image[m] for m in across} & set(members)


def _with_hubs(problem: LayoutProblem, found: Sequence[Unit], lines: Mapping[int, int]) -> list[Unit]:
    """Rings, each with the one neuron in its middle that is connected both ways with all of it and of no other, as the
    inhibition of a ring attractor is: none that is pinned, on a line, in another box, or a mirror image where the ring
    is not."""
    blocks = [(unit, _centre(unit.places or ())) for unit in found if unit.reach is None]
    rings = [(unit, centre) for unit, centre in blocks if centre is not None]
    if not rings:
        return list(found)
    among = _among(problem, found, [unit for unit, _ in rings])
    times = Counter(m for some in among for m in some)
    hubs = [
        replace(unit, members=(*unit.members, some[0]), places=(*(unit.places or ()), centre))
        for (unit, centre), some in zip(rings, among, strict=True)
        if len(some) == 1 and times[some[0]] == 1 and some[0] not in lines and _may_be_hub(problem, unit, some[0])
    ]
    held = {member for unit in hubs for member in unit.members}
    return [*hubs, *(unit for unit in found if held.isdisjoint(unit.members))]


def _among(problem: LayoutProblem, found: Sequence[Unit], rings: Sequence[Unit]) -> list[list[int]]:
    """For each ring the single neurons that are connected both ways with all of it."""
    single = {unit.members[0] for unit in found if len(unit.members) == 1 and unit.places is None}
    near = _graph(problem, range(len(problem.neurons)))
    mates = {m: near.succ[m].keys() & near.pred[m].keys() for unit in rings for m in unit.members}
    return [sorted(single.intersection(*(mates[m] for m in unit.members))) for unit in rings]


def _may_be_hub(problem: LayoutProblem, ring: Unit, hub: int) -> bool:
    """Whether a neuron may stand in a ring: it is not pinned, in the same boxes, and mirrored as the ring is."""
    image, whole, first = mirror_images(problem), {*ring.members, hub}, ring.members[0]
    together = all(len(whole.intersection(own)) in (0, len(whole)) for _, own in problem.boxes)
    return together and hub not in problem.pins and (hub in image) == (image.get(first, first) not in whole)


def _centre(places: Sequence[Point]) -> Point | None:
    """The middle of a ring of more than four; None if this is none."""
    if len(places) <= 4:
        return None
    centre = snap(sum(x for x, _ in places) / len(places)), snap(sum(y for _, y in places) / len(places))
    far = [distance(centre, place) for place in places]
    return centre if max(far) - min(far) < 0.01 else None


def _on_its_side(places: Sequence[Point]) -> list[Point]:
    """A ring of four or six turned back by half a place."""
    cosine, sine = turn(0.5 / len(places))
    return [(snap(x * cosine + y * sine), snap(y * cosine - x * sine)) for x, y in places]


def _lines(problem: LayoutProblem) -> dict[int, int]:
    """For each neuron on a line the smallest of all that lines tie to it; a mirror image stands for its original."""
    original = {b: a for mirror in problem.mirrors for a, b in mirror.pairs}
    ties: nx.Graph[int] = nx.Graph()
    for line in problem.align:
        nx.add_path(ties, [original.get(member, member) for member in line])
    found = {member: min(tied) for tied in nx.connected_components(ties) for member in tied}
    found.update({b: found[a] for b, a in original.items() if a in found})
    return found


def _on_lines(
    problem: LayoutProblem, found: Sequence[Unit], asked: Sequence[Unit], lines: Mapping[int, int]
) -> list[Unit]:
    """Units that nobody ``asked`` for give way to lines that they would contradict: a loop whose neurons are all on one
    line is a row. Of others, and of a group of which only a part is on a line with others, those on one line share a
    rank, and the rest find their own: a line binds those that it names."""
    wired = {end for edge in problem.edges if edge.source != edge.target for end in (edge.source, edge.target)}
    reading = problem.reading()

    def apart(unit: Unit) -> list[Unit]:
        together: dict[int, list[int]] = {}
        for member in sorted(unit.members, key=reading.__getitem__):
            # what nothing is connected to has no rank to find, and stays together
            key = lines.get(member, -2 - member if member in wired else -1)
            together.setdefault(key, []).append(member)
        return [Unit(tuple(members)) for members in together.values()]

    touched = _touched([unit for unit in (*asked, *found) if unit.places is not None], lines)
    settled: list[Unit] = []
    for unit in found:
        if not _contradicts(unit, lines, touched):
            settled.append(unit)
        elif _on_one(unit, lines):
            wide = max(problem.neuron_spacing, 0.65) * _LINE
            settled.append(replace(unit, places=tuple(offsets("row", len(unit.members), wide))))
        else:
            settled += apart(unit)
    touched = _touched([*asked, *settled], lines)
    result: list[Unit] = []
    for unit in settled:
        alone = all(touched[lines[member]] == 1 for member in unit.members if member in lines)
        result += [unit] if unit.places is not None or alone or _on_one(unit, lines) else apart(unit)
    return result


def _contradicts(unit: Unit, lines: Mapping[int, int], touched: Mapping[int, int]) -> bool:
    """Whether a block holds neurons of one line apart, or several lines on which others are."""
    bound: dict[int, set[float]] = {}
    for member, (_, along) in zip(unit.members, unit.places or (), strict=False):
        if member in lines:
            bound.setdefault(lines[member], set()).add(along)
    return any(len(different) > 1 for different in bound.values()) or sum(touched[line] > 1 for line in bound) > 1


def _touched(units: Iterable[Unit], lines: Mapping[int, int]) -> Counter[int]:
    """How many units each line touches."""
    return Counter(line for unit in units for line in {lines[m] for m in unit.members if m in lines})


def _on_one(unit: Unit, lines: Mapping[int, int]) -> bool:
    """Whether all neurons of a unit are on one line."""
    return len({lines.get(member) for member in unit.members}) == 1 and unit.members[0] in lines


def _without_needless_loops(problem: LayoutProblem, found: list[Unit], lines: Mapping[int, int]) -> list[Unit]:
    """Split groups that would make a loop of ranks only because their neurons share one: a loop that what runs along
    makes, which is all that is in no loop of neurons and of rigid units."""
    owner = {member: i for i, unit in enumerate(found) for member in unit.members}
    # a rigid unit is drawn as one piece, as if it were a neuron
    piece = {m: m if found[i].places is None else -1 - i for m, i in owner.items()}
    row = _rows(owner, lines)
    wired = [way for e in problem.edges if {e.source, e.target} <= owner.keys() for way in e.ways]
    loop_of = _loops(piece.values(), ((piece[a], piece[b]) for a, b in wired))
    along = [(row[a], row[b]) for a, b in wired if loop_of[piece[a]] != loop_of[piece[b]] and row[a] != row[b]]
    loops = _loops(row.values(), along)
    size = Counter(loops.values())
    result: list[Unit] = []
    for unit in found:
        whole = unit.places is not None or size[loops[row[unit.members[0]]]] == 1
        result += [unit] if whole else [Unit((member,)) for member in unit.members]
    return result


def _rows(owner: Mapping[int, int], lines: Mapping[int, int]) -> dict[int, int]:
    """By neuron the first of the units that lines tie to its own, which is its ``owner``."""
    tied: nx.Graph[int] = nx.Graph()
    tied.add_nodes_from(owner.values())
    tied.add_edges_from((owner[line], owner[m]) for m, line in lines.items() if m in owner and line in owner)
    first = {i: min(part) for part in nx.connected_components(tied) for i in part}
    return {m: first[i] for m, i in owner.items()}


def _loops(nodes: Iterable[int], arcs: Iterable[tuple[int, int]]) -> dict[int, int]:
    """For each node the loop that it is in, alone or with others."""
    graph: nx.DiGraph[int] = nx.DiGraph()
    graph.add_nodes_from(nodes)
    graph.add_edges_from(arcs)
    return {node: number for number, loop in enumerate(nx.strongly_connected_components(graph)) for node in loop}


def symmetric_units(problem: LayoutProblem, frames: Sequence[Unit], pair: Mapping[int, int]) -> list[Unit]:
    """All units, in the order of their first neurons; ``frames`` are those of both sides.

    Raises LayoutRefusalError where an arrangement cannot be symmetric.
    """
    framed = {m for unit in frames for m in unit.members}
    second = {b for mirror in problem.mirrors for _, b in mirror.pairs} - framed
    blocks = arranged_on_axis(problem, pair, framed)
    solid = framed | {m for unit in blocks for m in unit.members}
    result: list[Unit] = []
    for unit in units_of(problem, [*frames, *blocks], second - solid):
        for piece in [unit] if unit.members[0] in solid else _pure(unit, pair):
            result.append(piece)
            if piece.members[0] in pair and piece.members[0] not in solid:
                result.append(_reflected(piece, pair))
    return sorted(result, key=lambda unit: min(unit.members))


def arranged_on_axis(problem: LayoutProblem, pair: Mapping[int, int], framed: AbstractSet[int]) -> list[Unit]:
    """The arrangements of neurons that are not ``framed`` in which mirror images stand opposite each other.

    Raises LayoutRefusalError where one cannot be symmetric.
    """
    return [block for members, how in problem.arrange if (block := _on_axis(problem, members, how, pair, framed))]


def _pure(unit: Unit, pair: Mapping[int, int]) -> Iterator[Unit]:
    """A unit as it is if all of its neurons have an image or none has, else in pieces."""
    with_image = tuple(m for m in unit.members if m in pair)
    if len(with_image) in (0, len(unit.members)):
        yield unit
    elif unit.places is None:
        yield Unit(with_image)
        yield Unit(tuple(m for m in unit.members if m not in pair))
    else:  # a block that is not symmetric in itself would pull its neurons off the axis
        yield from (Unit((m,)) for m in unit.members)


def _reflected(unit: Unit, pair: Mapping[int, int]) -> Unit:
    places = None if unit.places is None else tuple((-x + 0.0, y) for x, y in unit.places)
    return replace(unit, members=tuple(pair[m] for m in unit.members), places=places)


def _on_axis(
    problem: LayoutProblem, members: Sequence[int], how: Arrangement, pair: Mapping[int, int], framed: AbstractSet[int]
) -> Unit | None:
    """An arrangement that holds mirror images of each other: a block on the axis, in which these stand opposite."""
    own = set(members)
    if own & framed or not symmetric(members, pair):
        return None
    points = formation(problem, members, how)
    left = sorted((p for p in points if p[0] < 0), key=points.index)
    middle = [p for p in points if p[0] == 0]
    first = {a for mirror in problem.mirrors for a, _ in mirror.pairs}
    leads = [m for m in members if m in first and pair[m] in own]
    lone = [m for m in members if m not in pair]
    even = {(-x, y) for x, y in left} <= set(points)
    if not even or (len(leads), len(lone)) != (len(left), len(middle)):
        raise _refused(problem, members, how)
    places: dict[int, Point] = dict(zip(lone, middle, strict=True))
    for one, (x, y) in zip(leads, left, strict=True):
        places[one], places[pair[one]] = (x, y), (-x, y)
    return Unit(tuple(members), tuple(places[m] for m in members))


def _refused(problem: LayoutProblem, members: Sequence[int], how: Arrangement) -> LayoutRefusalError:
    """What is said of an arrangement that cannot be symmetric."""
    names = problem.neurons
    return LayoutRefusalError(
        "mirror-arrange",
        f"'{names[members[0]]}' and those arranged with it as {how} cannot be mirror images of each other in it",
        "arrange each side by itself",
        tuple(names[m] for m in members),
    )
