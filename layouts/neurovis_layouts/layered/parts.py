"""Parts: the outermost frames of a problem, instances and boxes, and who is whose mirror image among them.

In: a problem, and which of its boxes are to be frames. Out: parts: disjoint, each with its neurons; the neurons in none
stand between them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, replace

from neurovis_spec.layout.model import LayoutProblem


@dataclass(frozen=True, slots=True)
class Part:
    """A frame: its neurons (in the order in which its drawing counts them), the kind of instance that it is or the
    box, what instances declared together have in common, and the part that it is the mirror image of."""

    members: tuple[int, ...]
    kind: int = -1
    box: int = -1
    module: int = -1
    family: str = ""
    image_of: int = -1

    @property
    def framed(self) -> bool:
        """Whether a line is drawn around it."""
        return self.module >= 0 or self.box >= 0


def parts_of(problem: LayoutProblem, boxes: AbstractSet[int], pair: Mapping[int, int]) -> list[Part]:
    """The parts in the order of their first neurons; those of which the second is a mirror image come first.

    ``boxes`` are the places of boxes to be frames; ``pair`` says whose mirror image a neuron is, both ways.
    """
    found = [part_of_module(problem, i) for i, m in enumerate(problem.modules) if m.parent < 0]
    chosen = [Part(problem.boxes[i][1], box=i) for i in sorted(boxes)]
    # of frames in frames the outermost; of a box that is an instance, the instance
    parts: list[Part] = []
    taken: set[int] = set()
    for part in sorted([*found, *chosen], key=lambda p: (-len(p.members), p.module < 0, p.members)):
        if not taken.intersection(part.members):
            parts.append(part)
            taken.update(part.members)
    parts.sort(key=lambda p: min(p.members))
    return imaged(parts, pair)


def part_of_module(problem: LayoutProblem, module: int) -> Part:
    """The part that an instance is, by its number."""
    one = problem.modules[module]
    return Part(one.members, int(one.template), module=module, family=f"{one.module} {one.path.rstrip('0123456789')}")


def imaged(parts: Sequence[Part], pair: Mapping[int, int]) -> list[Part]:
    """Mirror images marked as such; a box that has no box for its image gets one without a line."""
    by_members = {frozenset(part.members): part for part in parts}
    first: list[Part] = []
    images: list[Part] = []
    for part in parts:
        others = images_in(part, pair)
        if others and set(others) != set(part.members):
            if min(others) < min(part.members):
                continue
            other = by_members.get(frozenset(others), Part(others))
            images.append(replace(other, members=others, kind=part.kind, image_of=len(first)))
        first.append(part)
    return first + images


def images_in(part: Part, pair: Mapping[int, int]) -> tuple[int, ...]:
    """The mirror images of a part's neurons in its order, none if not all have one."""
    images = tuple(pair[m] for m in part.members if m in pair)
    return images if len(images) == len(part.members) else ()


def symmetric(members: Sequence[int], pair: Mapping[int, int]) -> bool:
    """Whether some of these neurons are mirror images of others of them."""
    own = set(members)
    return any(pair.get(m) in own for m in own)


def holds_instance(problem: LayoutProblem, box: int) -> bool:
    """Whether a box is around a whole instance, so that it has to be a frame from the start."""
    own = set(problem.boxes[box][1])
    return any(own.issuperset(m.members) for m in problem.modules if m.parent < 0)


def may_be_frame(problem: LayoutProblem, box: int, pair: Mapping[int, int]) -> bool:
    """Whether a box can be a frame here: it cuts through no instance, is in none, and mirrors as a whole."""
    own = set(problem.boxes[box][1])
    if len(own) == len(problem.neurons):
        return False
    if any(own & set(m.members) and not set(m.members) <= own for m in problem.modules if m.parent < 0):
        return False
    images = {pair[m] for m in own if m in pair}
    return images <= own or (len(images) == len(own) and not images & own)


def columns_of(problem: LayoutProblem, parts: Sequence[Part], boxes: AbstractSet[int]) -> frozenset[int]:
    """Those of the boxes that can be columns: they share no neuron with each other or with a part."""
    taken = {m for part in parts for m in part.members}
    found: set[int] = set()
    for box in sorted(boxes, key=lambda b: (-len(problem.boxes[b][1]), b)):
        own = set(problem.boxes[box][1])
        if not own & taken:
            found.add(box)
            taken |= own
    return frozenset(found)
