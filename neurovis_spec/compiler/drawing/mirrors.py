"""Mirrors and lines: neurons that are mirror images of each other, and neurons on one line.

In: ``layout.mirror`` and ``layout.align`` of every scope. Out: pairs of neurons, and lists of neurons. Two sides of a
mirror are of equal make: as many neurons, in instances with the same names; how they are connected does not matter.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import takewhile

from neurovis_spec.compiler.drawing.drawing_settings import Mirror
from neurovis_spec.compiler.drawing.pins import Pins
from neurovis_spec.compiler.limits import plural
from neurovis_spec.compiler.names.references import Directory, resolve, resolve_end
from neurovis_spec.compiler.names.scope import Scope
from neurovis_spec.compiler.neurons.populate import Census
from neurovis_spec.diagnostics import Findings, shorten
from neurovis_spec.language.located import Located
from neurovis_spec.language.unknown import UNKNOWN, Unknown
from neurovis_spec.language.values import Reference
from neurovis_spec.language.words import Direction

#: Coordinates of pins that differ by less are the same.
_SLACK = 1e-9


def mirrors_of(scopes: tuple[Scope, ...], census: Census, findings: Findings) -> tuple[Mirror, ...]:
    """All mirrors. A neuron with two mirror images in one frame is a finding; in an instance it may have one, and in
    what is around the instance another."""
    paths = [scope.path for scope in scopes]
    result: list[Mirror] = []
    taken: set[tuple[str, int]] = set()
    for scope, directory in zip(scopes, census.directories, strict=True):
        layout = scope.section.layout
        for reference in () if layout is None else layout.mirror:
            mirror = _mirror(scope, reference, directory, census.neurons.names, paths, findings)
            if mirror is UNKNOWN:
                continue
            names = census.neurons.names
            sides = [(_frame(names[a], names[b]), m) for a, b in mirror.pairs for m in (a, b)]
            twice = next((m for frame, m in sides if (frame, m) in taken), None)
            itself = next((a for a, b in mirror.pairs if a == b), None)
            if itself is not None:
                name = names[itself]
                hint = "what stands on the axis needs no mirror"
                findings.error("bad-mirror", reference.span, f"'{name}' would be its own mirror image", hint)
                continue
            taken.update(sides)
            if twice is not None:
                name = names[twice]
                findings.error("bad-mirror", reference.span, f"'{name}' has a mirror image already")
            else:
                result.append(mirror)
    return tuple(result)


def _frame(one: str, other: str) -> str:
    """The path of the innermost instance that holds both neurons."""
    paths = one.split(".")[:-1], other.split(".")[:-1]
    return ".".join(a for a, _ in takewhile(lambda step: step[0] == step[1], zip(*paths, strict=False)))


def _mirror(
    scope: Scope,
    reference: Reference,
    directory: Directory,
    names: tuple[str, ...],
    paths: Sequence[str],
    findings: Findings,
) -> Mirror | Unknown:
    """The mirror that a reference to two sides means; UNKNOWN, and a finding, where they are not of equal make."""
    left, right = reference.parts
    sides = directory.instance(left.value), directory.instance(right.value)
    if bool(sides[0]) != bool(sides[1]) and directory.holds((right if sides[0] else left).value):
        message = "a mirror pairs instances with instances, and neurons with neurons"
        findings.error("bad-mirror", reference.span, message)
        return UNKNOWN
    if sides[0] and sides[1]:
        return _mirror_of_instances(scope, reference, sides, names, paths, findings)
    pair = _neurons_of_side(left, directory, findings), _neurons_of_side(right, directory, findings)
    if pair[0] is UNKNOWN or pair[1] is UNKNOWN:
        return UNKNOWN
    if len(pair[0]) != len(pair[1]):
        message = (
            f"'{shorten(left.value)}' is {plural(len(pair[0]), 'neuron')}, '{shorten(right.value)}' {len(pair[1])}"
        )
        findings.error("unequal-mirror", reference.span, f"{message}; a mirror needs sides of equal make")
        return UNKNOWN
    return Mirror(scope.path, tuple(zip(pair[0], pair[1], strict=True)))


def _neurons_of_side(side: Located[str], directory: Directory, findings: Findings) -> tuple[int, ...] | Unknown:
    """The neurons of a side; none where it is an instance."""
    return () if directory.instance(side.value) else resolve_end(side, directory, findings)


def _mirror_of_instances(
    scope: Scope,
    reference: Reference,
    sides: tuple[tuple[Directory, ...], tuple[Directory, ...]],
    names: tuple[str, ...],
    paths: Sequence[str],
    findings: Findings,
) -> Mirror | Unknown:
    """A mirror of instances, pair by pair: neurons of the same name in both are images of each other."""
    left, right = reference.parts
    if len(sides[0]) != len(sides[1]):
        message = (
            f"'{shorten(left.value)}' is {plural(len(sides[0]), 'instance')}, '{shorten(right.value)}' {len(sides[1])}"
        )
        findings.error("unequal-mirror", reference.span, f"{message}; instances pair by number")
        return UNKNOWN
    pairs: list[tuple[int, int]] = []
    instances: list[tuple[str, str]] = []
    for one, other in zip(*sides, strict=True):
        own, theirs = paths[one.scope], paths[other.scope]
        mates = {names[index][len(theirs) :]: index for index in other.members}
        there = {names[index][len(own) :]: index for index in one.members}
        if mates.keys() != there.keys():
            odd = min(mates.keys() ^ there.keys())
            message = f"'{own}' and '{theirs}' are not of equal make: only one of them has '{odd[1:]}'"
            findings.error("unequal-mirror", reference.span, message)
            return UNKNOWN
        pairs += [(index, mates[name]) for name, index in there.items()]
        instances.append((own, theirs))
    return Mirror(scope.path, tuple(pairs), tuple(instances))


def lines_of(scopes: tuple[Scope, ...], census: Census, findings: Findings) -> tuple[tuple[int, ...], ...]:
    """The neurons of each list of ``align``."""
    result: list[tuple[int, ...]] = []
    for scope, directory in zip(scopes, census.directories, strict=True):
        layout = scope.section.layout
        for reference in () if layout is None else layout.align:
            members = resolve(reference.parts, directory, findings)
            if members is not UNKNOWN and len(members) < 2:
                findings.error("wrong-size", reference.span, "a line needs at least two neurons")
            elif members is not UNKNOWN:
                result.append(members)
    return tuple(result)


def check_pins(
    mirrors: tuple[Mirror, ...],
    lines: tuple[tuple[int, ...], ...],
    pins: Pins,
    direction: Direction,
    names: tuple[str, ...],
    findings: Findings,
) -> None:
    """Pins that no mirror, or no line, can keep are a finding: those of the spec, and those of each instance that are
    relative to its origin."""
    across, along = (0, 1) if direction in ("down", "up") else (1, 0)
    for frame, places in (("", pins.places), *pins.relative):
        skip = len(frame) + 1 if frame else 0
        axes: dict[str, tuple[float, str]] = {}
        for mirror in mirrors:
            for a, b in mirror.pairs:
                if a not in places or b not in places:
                    continue
                shown_pair = f"'{names[a][skip:]}' and '{names[b][skip:]}'"
                middle = (places[a][across] + places[b][across]) / 2
                axis = axes.setdefault(mirror.scope, (middle, shown_pair))
                message = ""
                if abs(places[a][along] - places[b][along]) > _SLACK:
                    message = f"{shown_pair} are mirror images; their pins are not on one line across the axis"
                elif abs(axis[0] - middle) > _SLACK:
                    message = f"the pins of {shown_pair} put the mirror's axis at {middle:g}, "
                    message += f"those of {axis[1]} at {axis[0]:g}"
                if message:
                    findings.error("mirror-pins", max(pins.spans[a], pins.spans[b]), message)
        for line in lines:
            pinned = [index for index in line if index in places]
            for index in pinned[1:]:
                if abs(places[index][along] - places[pinned[0]][along]) > _SLACK:
                    shown_pair = f"'{names[pinned[0]][skip:]}' and '{names[index][skip:]}'"
                    message = f"{shown_pair} are aligned; their pins are not on one line"
                    findings.error("align-pins", max(pins.spans[pinned[0]], pins.spans[index]), message)
                    break
