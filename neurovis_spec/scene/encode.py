"""Encode: a network's activities and weights at a step become colours and widths, and with a Plan a Scene (Eqs. 2–5).

In: a network, a Snapshot, gains, a Plan. Out: the Scene that a Film starts from. A disc that stands for several neurons
has a second ring, and the number of these under its name.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray, IntArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.scene import encoding, texts
from neurovis_spec.scene.ends import EndArray, ends_of
from neurovis_spec.scene.fading import seconds_of, told_times
from neurovis_spec.scene.gains import Gains
from neurovis_spec.scene.labels import COUNT_ROOM, as_count, size_of_count
from neurovis_spec.scene.lesions import FAINT
from neurovis_spec.scene.model import Disc, FlatSpline, Group, Point, Scene, Shape, Spline, Text, ended
from neurovis_spec.scene.pathways import group_of
from neurovis_spec.scene.plan import Plan
from neurovis_spec.scene.shown_states import ShownStates
from neurovis_spec.scene.signals import Signal, Signals
from neurovis_spec.scene.themes import colours, readable

if TYPE_CHECKING:
    from neurovis_spec.runtime.recording import Snapshot


CAPTION = "caption"
#: The second ring: its radius in radii, its width in rings.
_INNER, _WIDTH = 0.87, 0.6
#: The number beside the label in its sizes: how large it is, and how far below.
_SMALLER, _BELOW = 0.85, 0.95
#: Beneath a glyph that is too small for it, and has no label that says it, in page units.
_BENEATH = 8.5
#: A quarter of a circle as a cubic spline.
_QUARTER = 0.5522847498


@dataclass(frozen=True, slots=True)
class Looks:
    """Eqs. 2–5 at one step: colour values (n,) and (m,) in −1…1, widths and glow widths (m,) in user units; and how
    lines end (``scene/ends.py``)."""

    discs: FloatArray
    lines: FloatArray
    widths: FloatArray
    glows: FloatArray
    ends: EndArray


def looks(
    network: Network,
    snapshot: Snapshot,
    gains: Gains,
    widest: float,
    signals: Signal | None = None,
    ends: EndArray | None = None,
) -> Looks:
    """What a step looks like, with lines of at most this width; ``signals`` are what is sent along each, and ``ends``
    how they end, by default what the network sends, and as its connections do."""
    widths = encoding.line_width(snapshot.weights, gains.thickness, widest, gains.thickness_compressed)
    changes = encoding.glow(snapshot.weights, snapshot.previous_weights, gains.change, gains.least_change)
    seen = snapshot.activity if snapshot.seen is None else snapshot.seen
    sent, weight = Signals(network).at(snapshot) if signals is None else signals
    lines = encoding.connection_colour(sent, weight, gains.signal, gains.signal_compressed)
    if snapshot.shown is not None:
        states = ShownStates(network)
        seen = states.put(seen, snapshot.shown[states.neurons])
    return Looks(
        discs=encoding.neuron_colour(seen, gains.activity, gains.centre),
        lines=lines,
        widths=widths,
        glows=encoding.glow_width(widths, changes),
        ends=ends_of(network, snapshot.weights) if ends is None else ends,
    )


def paint(
    planned: Plan,
    seen: Looks,
    glowing: npt.NDArray[np.bool_],
    words: str,
    titles: tuple[list[str], list[str]],
    step: int,
) -> Scene:
    """A plan with colours and widths; connections that are ``glowing`` (m,) have a glow, if only of width 0. What is
    lesioned by ``step`` is faint."""
    caption_shape = planned.caption_shape(words)
    said = (Group((caption_shape,), id=CAPTION),) if caption_shape else ()
    return Scene(
        width=planned.frame.width,
        height=planned.frame.height,
        density=planned.frame.density,
        theme=planned.theme,
        title=f"{planned.title}, {words}",
        notes=planned.notes,
        groups=(
            *planned.back,
            *_fainter(_connections(planned, seen, glowing, titles[1]), lesions_by_id(planned), step),
            *planned.between,
            *_fainter(_neurons(planned, seen, titles[0]), lesions_by_id(planned), step),
            *planned.front,
            *said,
        ),
    )


def lesions_by_id(planned: Plan) -> dict[str, int]:
    """The step of its lesion, for each group of a scene that has one."""
    found = {f"n{index}": step for index, step in planned.lesions.neurons.items()}
    return found | {f"c{index}": step for index, step in planned.lesions.connections.items()}


def _fainter(groups: list[Group], lesions: dict[str, int], step: int) -> list[Group]:
    """Groups, of which those that are lesioned by a step are faint and say so."""
    if not lesions:
        return groups
    result = []
    for group in groups:
        since = lesions.get(group.id)
        if since is not None and since <= step:
            group = replace(group, opacity=FAINT, title=f"{group.title}\nlesioned at step {since}")
        result.append(group)
    return result


def _neurons(planned: Plan, seen: Looks, titles: list[str]) -> list[Group]:
    theme = planned.theme
    fills = colours(theme, seen.discs)
    groups, states = [], ShownStates(planned.network).called
    names, groups_of = planned.network.neurons.names, group_of(planned.network).tolist()
    for index in planned.depth or range(len(names)):
        name = names[index]
        disc = Disc(planned.centres[index], planned.radii[index], fills[index], theme.ring, planned.rings[index])
        label, data = planned.labels[index], {"neuron": name}
        if states[index]:
            data["state"] = states[index]
        if planned.between:  # which speaks of groups
            data["group"] = planned.network.neurons.groups[groups_of[index]].name
        shapes: tuple[Shape, ...] = (disc,)
        if index in planned.sizes:
            data["size"] = str(planned.sizes[index])
            shapes = (disc, *marks_of(planned, index, readable(theme, fills[index])))
        if label is not None:
            ink = readable(theme, fills[index]) if label.on_disc else theme.ink
            shapes = (*shapes, *label.shapes(ink, theme.box_fill))
        groups.append(Group(shapes, f"n{index}", data, titles[index]))
    return groups


def _connections(planned: Plan, seen: Looks, glowing: npt.NDArray[np.bool_], titles: list[str]) -> list[Group]:
    strokes = colours(planned.theme, seen.lines)
    widths, glows = seen.widths.tolist(), seen.glows.tolist()
    ends = planned.theme_ends(seen.ends).tolist()
    attributes = data_attributes(planned.network)
    for index, count in planned.counts.items():
        attributes[index]["size"] = str(count)
    groups = []
    for index in planned.order:
        line, width = planned.lines[index], widths[index]
        heads = (ended(end, width, strokes[index], ends[index]) for end in line.ends)
        kind = FlatSpline if line.dash else Spline
        shapes: tuple[Shape, ...] = (kind(line.points, strokes[index], width, line.dash), *heads)
        if glowing[index]:
            shapes = (Spline(line.points, planned.theme.glow, glows[index], glow=True), *shapes)
        if index in planned.beads:
            shapes = (*shapes, planned.beads[index])
        groups.append(Group(shapes, f"c{index}", attributes[index], titles[index]))
    return groups


def data_attributes(network: Network, some: Sequence[int] | None = None) -> list[dict[str, str]]:
    """``connection``, ``from``, ``to`` and ``delay`` of every connection, or of some; ``index`` where several share
    both ends, and ``style``, what its line is solid or dashed for."""
    names, connections = network.neurons.names, network.connections
    chosen = np.arange(len(connections)) if some is None else np.array(some, np.int64)
    pairs = connections.sources.whole() * len(names) + connections.targets.whole()
    _, which, sharing = np.unique(pairs, return_inverse=True, return_counts=True)
    ends = connections.sources[chosen].tolist(), connections.targets[chosen].tolist()
    columns = zip(*ends, connections.delays[chosen].tolist(), sharing[which[chosen]].tolist(), strict=True)
    result, styles = list[dict[str, str]](), connections.styles
    for index, (source, target, delay, alike) in zip(chosen.tolist(), columns, strict=True):
        plain = f"{names[source]} -> {names[target]}"
        data = {"connection": plain, "from": names[source], "to": names[target]}
        if alike > 1:
            data["index"] = network.connection_names[index][len(plain) + 2 : -1] or "1"
        data["delay"] = str(delay)
        if styles is not None and (style := styles.of(index)):
            data["style"] = style
        result.append(data)
    return result


def tooltips(network: Network, gains: Gains, activity: FloatArray, weights: FloatArray) -> tuple[list[str], list[str]]:
    """What a pointer shows of neurons and connections: name, activity, the state that it shows, or weight (from … to
    where there are several steps), rule, gains. ``activity`` (steps, n), ``weights`` (steps, m)."""
    neurons = network.neurons
    of_neurons = [""] * len(neurons)
    lows, highs = activity.min(axis=0).tolist(), activity.max(axis=0).tolist()
    traces, states = told_times(network, seconds_of(network)).tolist(), ShownStates(network).called
    for group in neurons.groups:
        kind = group.activation if group.model == "static" else f"{group.model}, {group.activation}"
        for index in group.indices:
            name, label = neurons.names[index], neurons.labels[index]
            first = name if label in (name, name.rsplit(".", 1)[-1]) else f"{name}: {label}"
            seen = _gain_of(float(gains.activity[index]), float(gains.centre[index]))
            fades = f"fades to 1/e in {texts.number(traces[index])} {network.dt_unit}" if traces[index] else ""
            told = f"{states[index] or 'activity'} {_range(lows[index], highs[index])}"
            parts = [first, told, kind, group.description or "", seen, fades]
            of_neurons[index] = "\n".join(part for part in parts if part)
    return of_neurons, connection_tooltips(network, gains, weights)


def connection_tooltips(
    network: Network, gains: Gains, weights: FloatArray, some: Sequence[int] | None = None
) -> list[str]:
    """What a pointer shows of every connection, or of some; ``weights`` (steps, m)."""
    connections = network.connections
    chosen = np.arange(len(connections)) if some is None else np.array(some, np.int64)
    of_connections, scaled = list[str](), _gains_of(network, gains, chosen)
    lows, highs = weights[:, chosen].min(axis=0).tolist(), weights[:, chosen].max(axis=0).tolist()
    twins, synapses = None if connections.twins is None else connections.twins[chosen].tolist(), connections.synapses
    rows = zip(chosen.tolist(), connections.delays[chosen].tolist(), connections.entry[chosen].tolist(), strict=True)
    own, styles = connections.own_labels, connections.styles
    for place, (index, delay, entry) in enumerate(rows):
        style = "" if styles is None else styles.of(index)
        parts = [
            network.connection_names[index].replace("->", "→" if twins is None or twins[place] < 0 else "↔")
            + (f": {called}" if (called := (own and own.of(index)) or connections.labels[entry]) else ""),
            f"weight {_range(lows[place], highs[place])}",
            f"synapse {synapses[entry]}" if synapses and synapses[entry] else "",
            connections.learns[entry] or "",
            f"delay {delay}" if delay != 1 else "",
            f"{network.render.style} {style}" if style else "",
            connections.descriptions[entry] or "",
            scaled[place],
        ]
        of_connections.append("\n".join(part for part in parts if part))
    return of_connections


def _gain_of(gain: float, centre: float) -> str:
    """The gain of a neuron, in words."""
    if centre and gain:
        return f"colours from {texts.number(centre - 1 / gain)} to {texts.number(centre + 1 / gain)}"
    return f"gain {texts.number(gain)}"


def _gains_of(network: Network, gains: Gains, some: IntArray) -> list[str]:
    """The gains of some connections, in words; that of changes where its weight can change. Most are said of many."""
    learns = np.isin(some, network.changing).tolist()
    signals, widths = gains.signal[some].tolist(), gains.thickness[some].tolist()
    roots = gains.signal_compressed[some].tolist(), gains.thickness_compressed[some].tolist()
    said: dict[tuple[float, float, float, bool, bool, bool], str] = {}
    result = []
    for key in zip(signals, widths, gains.change[some].tolist(), learns, *roots, strict=True):
        if key not in said:
            of = [" of the square root" if compressed else "" for compressed in key[4:]]
            told = [f"signal {texts.number(key[0])}{of[0]}", f"thickness {texts.number(key[1])}{of[1]}"]
            said[key] = "gain: " + ", ".join([*told, f"change {texts.number(key[2])}"] if key[3] else told)
        result.append(said[key])
    return result


def _range(low: float, high: float) -> str:
    if low == high or not (np.isfinite(low) and np.isfinite(high)):
        return texts.number(low, 4)
    return f"{texts.number(low, 4)} … {texts.number(high, 4)}"


def marks_of(planned: Plan, index: int, ink: str) -> tuple[Shape, ...]:
    """The second ring of a glyph, and how many neurons it stands for, unless it is too small and its label says so."""
    (x, y), radius = planned.centres[index], planned.radii[index]
    ring = Spline(circle((x, y), _INNER * radius), planned.theme.ring, _WIDTH * planned.rings[index])
    label, words = planned.labels[index], as_count(planned.sizes[index])
    if label is not None and label.on_disc:
        size, y = _SMALLER * label.size, label.point[1] + _BELOW * label.size
        size *= min(1.0, COUNT_ROOM * radius / texts.width(words, size))
        return ring, Text((x, y), words, size, ink, "middle", on_disc=True)
    size = size_of_count(planned.sizes[index], radius / planned.unit) * planned.unit
    if size:
        return ring, Text((x, y + 0.36 * size), words, size, ink, "middle", on_disc=True)
    if label is not None:
        return (ring,)
    size = _BENEATH * planned.unit
    return ring, Text((x, y + radius + size), words, size, planned.theme.ink, "middle", halo=planned.theme.background)


def circle(centre: Point, radius: float) -> tuple[Point, ...]:
    """A circle as a cubic spline."""
    x, y = centre
    corners = [(1, 0), (0, 1), (-1, 0), (0, -1), (1, 0)]
    points: list[Point] = [(x + radius, y)]
    for (ax, ay), (bx, by) in pairwise(corners):
        for px, py in ((ax + _QUARTER * bx, ay + _QUARTER * by), (bx + _QUARTER * ax, by + _QUARTER * ay), (bx, by)):
            points.append((x + radius * px, y + radius * py))
    return tuple(points)
