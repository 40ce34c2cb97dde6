"""Clashes: frames that lie on each other, and neurons in frames that are not theirs.

In: a problem and its layout. Out: what lies on what, outermost frames for those within them. Engines that draw frames
keep these apart; pins, a layout file edited by hand, or a box that cannot be a frame, can make that impossible. What is
pinned or was put somewhere by hand stays there all the same, and it is said.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.layout.engines import engines_that
from neurovis_spec.layout.frames import BOX_ACROSS, BOX_TIGHT, SLACK, Frames
from neurovis_spec.layout.model import Layout, LayoutProblem

#: With more frames than this nobody looks at one.
_MOST = 2000
#: So many neurons are looked for in a spec.
_MOST_ABOUT = 20


@dataclass(frozen=True, slots=True)
class Clash:
    """What lies on what, in words, and the neurons that the spec may speak of, those that are pinned first."""

    message: str
    about: tuple[str, ...]


def clashes(problem: LayoutProblem, layout: Layout) -> list[Clash]:
    """Pairs of frames, then frames with a neuron that is none of theirs; instances come before boxes, which are frames
    in the drawings of some engines alone: in others they are around what happens to stand there."""
    frames = Frames(problem, layout.labels, tight_boxes=True)
    boxed = layout.engine in engines_that(lambda can: can.frames)
    count = len(frames.members) if boxed else frames.instances
    if not 0 < count <= _MOST:
        return []
    placed = {i: layout.positions[name] for i, name in enumerate(problem.neurons)}
    routes = {i: layout.routes[edge.name] for i, edge in enumerate(problem.edges)}
    nowhere = (np.nan,) * 4
    rects: FloatArray = np.array([rect or nowhere for rect in frames.rects(placed, routes)[:count]], dtype=np.float64)
    names = [module.path for module in problem.modules] + [name for name, _ in problem.boxes]
    meeting = set(_meeting(frames, rects))
    result = [
        Clash(
            f"the frames of '{names[a]}' and '{names[b]}' lie on each other{_left_out(frames, names, a, b)}",
            _about(problem, frames, a, b),
        )
        for a, b in sorted(meeting)
        if not any(_around(frames, outer, (a, b)) for outer in meeting)
    ]
    for number, neuron in _strangers(frames, rects, np.array(list(placed.values()), dtype=np.float64)):
        if not any((min(number, own), max(number, own)) in meeting for own in frames.around.get(neuron, ())):
            stranger = problem.neurons[neuron]
            message = f"'{stranger}' stands in the frame of '{names[number]}', which is not drawn therefore"
            own = _about(problem, frames, number)
            result.append(Clash(message, (stranger, *own) if neuron in problem.pins else (*own, stranger)))
    return result


def _meeting(frames: Frames, rects: FloatArray) -> Iterator[tuple[int, int]]:
    """Frames without a neuron in common that share more than an edge; boxes are drawn tighter before they do."""
    rects = rects.copy()
    rects[frames.instances :] += np.array([1, 1, -1, -1]) * (BOX_ACROSS - BOX_TIGHT)
    for one in range(len(rects)):
        low = np.maximum(rects[one, :2], rects[one + 1 :, :2])
        high = np.minimum(rects[one, 2:], rects[one + 1 :, 2:])
        for other in np.flatnonzero(((high - low) > SLACK).all(axis=1)).tolist():
            if not frames.related(one, one + 1 + other):
                yield one, one + 1 + other


def _strangers(frames: Frames, rects: FloatArray, at: FloatArray) -> Iterator[tuple[int, int]]:
    """Frames, each with the first neuron in it that is none of its."""
    for number, rect in enumerate(rects):
        inside = ((at > rect[:2] + SLACK) & (at < rect[2:] - SLACK)).all(axis=1)
        for neuron in np.flatnonzero(inside).tolist():
            if neuron not in frames.members[number]:
                yield number, neuron
                break


def _around(frames: Frames, outer: tuple[int, int], inner: tuple[int, int]) -> bool:
    """Whether a pair of frames holds another pair."""
    if outer == inner:
        return False
    members = frames.members
    return any(members[outer[i]] >= members[inner[0]] and members[outer[1 - i]] >= members[inner[1]] for i in (0, 1))


def _left_out(frames: Frames, names: Sequence[str], *pair: int) -> str:
    """Which of two that lie on each other are boxes: these are not drawn then."""
    boxes = [f"'{names[number]}'" for number in pair if number >= frames.instances]
    if len(boxes) > 1:
        return "; therefore neither is drawn"
    return f"; therefore {boxes[0]} is not drawn" if boxes else ""


def _about(problem: LayoutProblem, frames: Frames, *numbers: int) -> tuple[str, ...]:
    own = [sorted(frames.members[number]) for number in numbers]
    pinned = [neuron for members in own for neuron in members if neuron in problem.pins]
    return tuple(problem.neurons[neuron] for neuron in [*pinned[:_MOST_ABOUT], *(members[0] for members in own)])
