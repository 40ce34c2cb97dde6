"""References as they are written: ``left.K3..K5 + O``, ``A -> B``, ``K.v``, ``(K -> O).eligibility``.

In: a text. Out: a tree of its parts, each with its characters and where these begin in the text; what is no reference
is a NoReference, with the words for it. What the names mean is for those to say who have tables of names: the
compiler, a recording, a layout, the language server.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple, TypeAlias

from neurovis_spec.diagnostics import shorten

_MARK = re.compile(r"->|[+()]")
_STATE = re.compile(r"(?P<owner>[^()>]*[^()>.\s])\s*\.\s*(?P<state>[A-Za-z_]\w*)", re.ASCII)
_STATE_OF_RULE = re.compile(r"\((?P<ends>.*)\)\s*\.\s*(?P<state>[A-Za-z_]\w*)", re.ASCII | re.DOTALL)
#: A neuron of a counted group: its number is written without leading zeros.
_NUMBERED = re.compile(r"(?P<stem>.*?\D)(?P<number>0|[1-9][0-9]{0,63})", re.ASCII)


@dataclass(frozen=True, slots=True)
class Characters:
    """Some characters of a reference, without the blanks around them, and where they begin."""

    text: str
    start: int

    @property
    def end(self) -> int:
        """Where they end."""
        return self.start + len(self.text)

    @property
    def normal(self) -> str:
        """The same with single blanks around ``+`` and ``->``."""
        return self.text


@dataclass(frozen=True, slots=True)
class DottedName(Characters):
    """``K``, ``K3``, ``left1.K3``: a group, a neuron, an instance; or ``K.v``, a state: who has tables of names can
    tell."""

    @property
    def steps(self) -> tuple[Characters, ...]:
        """What stands between the dots, in order, without the number of one of several (``touch[2]``)."""
        result, start = [], self.start
        for step in self.text.split("."):
            result.append(Characters(step.partition("[")[0], start))
            start += len(step) + 1
        return tuple(result)


@dataclass(frozen=True, slots=True)
class NeuronRange(Characters):
    """``left1.K3..left1.K5``, or shorter ``left1.K3..K5``."""

    low: DottedName
    high: DottedName

    @property
    def last(self) -> DottedName:
        """The high end without the instances that the low one names as well."""
        way = self.low.text.split(".")[:-1]
        for skip in range(len(way)):
            front = ".".join(way[skip:]) + "."
            if self.high.text.startswith(front):
                return DottedName(self.high.text[len(front) :], self.high.start + len(front))
        return self.high

    @property
    def numbers(self) -> tuple[str, range] | None:
        """The name of the group and its numbers, as far as the text tells: None where it is no range of one."""
        way, dot, first = self.low.text.rpartition(".")
        low, high = _NUMBERED.fullmatch(first), _NUMBERED.fullmatch(self.last.text)
        if low is None or high is None or low["stem"] != high["stem"]:
            return None
        return f"{way}{dot}{low['stem']}", range(int(low["number"]), int(high["number"]) + 1)


@dataclass(frozen=True, slots=True)
class RuleState(Characters):
    """``(K -> O).eligibility``: a state of the rule of connections."""

    ends: Arrow
    state: str


@dataclass(frozen=True, slots=True)
class NoReference(Characters):
    """Characters that are no reference, and why."""

    code: str
    message: str
    hint: str


Part: TypeAlias = DottedName | NeuronRange | RuleState | NoReference


@dataclass(frozen=True, slots=True)
class Sum(Characters):
    """References that are joined with ``+``; often it is one."""

    parts: tuple[Part, ...]

    @property
    def normal(self) -> str:
        """``K1 + K3``."""
        return " + ".join(part.text for part in self.parts)


@dataclass(frozen=True, slots=True)
class Arrow(Characters):
    """``FROM -> TO``: the connections from any of some neurons to any of others."""

    sources: Sum
    targets: Sum

    @property
    def normal(self) -> str:
        """``K1 + K3 -> O``."""
        return f"{self.sources.normal} -> {self.targets.normal}"


class StateName(NamedTuple):
    """A state, and what has it: neurons, or connections."""

    owner: DottedName | NeuronRange | Arrow
    state: str

    @property
    def of_rule(self) -> bool:
        """Whether it is one of the rule of connections."""
        return isinstance(self.owner, Arrow)


def parse(text: str) -> Sum | Arrow | NoReference:
    """The tree of a reference.

    >>> parse("K1 + K3..K5 -> O").normal, [part.start for part in parse("K1 + (K -> O).e").parts]
    ('K1 + K3..K5 -> O', [0, 5])
    """
    return _parse(text, 0, len(text))


def parse_sum(text: str) -> tuple[Part, ...]:
    """The references that are joined with ``+``, where neurons are meant: an arrow there is part of a name."""
    found = parse(text)
    return found.parts if isinstance(found, Sum) else (DottedName(found.text, found.start),)


def state_of(part: Part) -> StateName | None:
    """A reference to a state, taken apart; None where it cannot be one.

    >>> names = [state_of(part) for part in parse_sum("left1.K.v + (K -> O).e + K1..K3")]
    >>> [None if name is None else (name.owner.text, name.state) for name in names]
    [('left1.K', 'v'), ('K -> O', 'e'), None]
    """
    if isinstance(part, RuleState):
        return StateName(part.ends, part.state)
    if isinstance(part, NoReference):
        return None
    written = part.last if isinstance(part, NeuronRange) else part
    match = _STATE.fullmatch(written.text)
    if match is None:
        return None
    behind = len(written.text) - match.end("owner")
    owner = part.text[:-behind]
    if isinstance(part, NeuronRange):
        high = DottedName(part.high.text[:-behind], part.high.start)
        return StateName(NeuronRange(owner, part.start, part.low, high), match["state"])
    return StateName(DottedName(owner, part.start), match["state"])


def _parse(text: str, start: int, end: int) -> Sum | Arrow | NoReference:
    arrows: list[int] = []
    pluses: list[int] = []
    depth = 0
    for mark in _MARK.finditer(text, start, end):
        if mark[0] in "()":
            depth += 1 if mark[0] == "(" else -1
        elif depth <= 0:
            (pluses if mark[0] == "+" else arrows).append(mark.start())
    if not arrows:
        return _sum(text, start, end, pluses)
    first, last = _stripped(text, start, end)
    whole = text[first:last]
    both = text[: arrows[0]].endswith("<")
    if len(arrows) > 1 or both:
        return NoReference(whole, first, "bad-connection", f"'{shorten(whole)}' is no connection", _steps(whole, both))
    (arrow,) = arrows
    source, target = text[start:arrow].rstrip(), text[arrow + 2 : end].lstrip()
    if source.endswith("-") or target.startswith(">"):
        plain = source.rstrip("- ").strip(), target.lstrip("> ").strip()
        hint = f"write {shorten(f'{plain[0]} -> {plain[1]}', 200)}"
        return NoReference(whole, first, "bad-connection", f"'{shorten(whole)}' is no connection", hint)
    sources = _sum(text, start, arrow, [plus for plus in pluses if plus < arrow])
    return Arrow(whole, first, sources, _sum(text, arrow + 2, end, [plus for plus in pluses if plus > arrow]))


def _steps(whole: str, both: bool) -> str:
    """How to write what has several arrows, or (``both``) one that goes both ways."""
    names = [part.strip() for part in whole.replace("<->", "->").split("->")]
    steps = [*pairwise(names), *(pairwise(reversed(names)) if both else ())]
    if both and names[0] and len({*names}) == 1:
        return f"write {shorten(f'{names[0]} -> {names[0]}', 200)}, with symmetric: true for both ways"
    written = ", ".join(f"{one} -> {other}" for one, other in steps)
    return f"write each by itself: {shorten(written, 200)}" if all(names) else "write FROM -> TO"


def _sum(text: str, start: int, end: int, pluses: list[int]) -> Sum:
    if not pluses:
        part = _part(text, start, end)
        return Sum(part.text, part.start, (part,))
    begins, ends = [start, *(plus + 1 for plus in pluses)], [*pluses, end]
    parts = tuple(_part(text, begin, stop) for begin, stop in zip(begins, ends, strict=True))
    first, last = _stripped(text, start, end)
    return Sum(text[first:last], first, parts)


def _part(text: str, start: int, end: int) -> Part:
    start, end = _stripped(text, start, end)
    piece = text[start:end]
    if not piece:
        return NoReference(
            "", start, "empty-reference", "a reference is missing here", "name a group, a neuron or a range"
        )
    rule = _STATE_OF_RULE.fullmatch(piece) if piece[0] == "(" else None
    if rule is not None:
        ends = _parse(text, start + 1, start + rule.end("ends"))
        if isinstance(ends, Arrow):
            return RuleState(piece, start, ends, rule["state"])
    elif ".." in piece:
        low, _, high = piece.partition("..")
        far = end - len(high.lstrip())
        return NeuronRange(piece, start, DottedName(low.rstrip(), start), DottedName(high.lstrip(), far))
    return DottedName(piece, start)


def _stripped(text: str, start: int, end: int) -> tuple[int, int]:
    """The same stretch without the blanks around it."""
    start = end - len(text[start:end].lstrip())
    return start, start + len(text[start:end].rstrip())
