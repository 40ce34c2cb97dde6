"""Events of a spec that do what was turned by hand, for who copies them and for the spec that has them.

In: turns. Out: entries of ``events:``, as they are written, and comments on what no event does. Of what is turned twice
at one step the last counts. The spec with these events does the same, bit for bit.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from neurovis_spec.layout.file import number_text
from neurovis_spec.live.turns import Feed, Hold, Learn, Lesion, Mend, Release, Set, Turn, Turned, Weigh

#: Names and texts that braces hold without quotes.
_PLAIN: Final = re.compile(r"[\w. >()-]+", re.ASCII)
#: The second, third, … of several connections between the same ends is called so: an event names all of these.
_SEVERAL: Final = re.compile(r" \(\d+\)\Z")


@dataclass(frozen=True, slots=True)
class AsEvents:
    """Entries of a list in YAML, in order, and comments in one line each, with their #."""

    entries: tuple[str, ...]
    comments: tuple[str, ...]

    @property
    def text(self) -> str:
        """The section of a spec."""
        lines = ["events:", *(f"  - {entry}" for entry in self.entries)] if self.entries else []
        return "".join(f"{line}\n" for line in (*lines, *self.comments))


def as_events(turned: Sequence[Turned]) -> AsEvents:
    """The events that do what was turned, and, as comments, what none does."""
    last = _last_of(turned)
    entries, left, drags = list[str](), list[str](), list[str]()
    for place, one in enumerate(last):
        entry, why = _event(last, place)
        if entry:
            entries.append(entry)
        if why:
            left.append(_comment(f"step {one.step + 1}, {why}"))
        if one.since is not None:
            what = _known_by(one.turn)[1]
            drags.append(
                _comment(f"step {one.since + 1} to {one.step + 1}: what {what} was while it was dragged is left out")
            )
    return AsEvents((*entries,), (*left, *drags))


def _comment(words: str) -> str:
    """In one line, whatever names a client has given."""
    return f"# {' '.join(words.split())}"


def _last_of(turned: Sequence[Turned]) -> list[Turned]:
    """Turns that count at each step in the end, in the order in which they were taken last; of parameters each by
    itself."""
    last: dict[tuple[int, str, str], Turned] = {}
    for entry in turned:
        what = entry.turn
        turns = [Set({name: value}) for name, value in what.values.items()] if isinstance(what, Set) else [what]
        for one in turns:
            key = (entry.step, *_known_by(one))
            last.pop(key, None)
            last[key] = Turned(entry.step, one, since=entry.since)
    return [*last.values()]


def _known_by(what: Turn) -> tuple[str, str]:
    """What is turned: turns of which this is the same replace each other."""
    match what:
        case Set():
            return "set", ", ".join(what.values)
        case Feed():
            return "feed", what.name
        case Hold() | Release():
            return "clamp", what.neurons
        case Lesion() | Mend():
            return "part", what.part
        case Learn():
            return "learn", what.connections
        case Weigh():
            return "weigh", what.connections


def _event(turned: Sequence[Turned], place: int) -> tuple[str, str]:
    """A turn, by its place among all, as an event, or why there is none."""
    one = turned[place]
    at, what, (_, name) = one.step + 1, one.turn, _known_by(one.turn)
    named = _text(name)
    if isinstance(what, Lesion | Mend | Learn | Weigh) and _SEVERAL.search(name):
        kind = type(what).__name__.lower()
        return "", f"{kind} {name}: an event names all connections between the same ends"
    match what:
        case Set():
            return f"{{at: {at}, set: {{{named}: {number_text(what.values[name])}}}}}", ""
        case Weigh():
            return f"{{at: {at}, set: {{{named}: {number_text(what.value)}}}}}", ""
        case Feed():
            return f"{{at: {at}, feed: {{{named}: {_fed(what.values)}}}}}", ""
        case Learn():
            return f"{{at: {at}, learning: {{{named}: {str(what.on).lower()}}}}}", ""
        case Hold():
            end = next(
                (other.step + 1 for other in turned[place + 1 :] if _known_by(other.turn) == ("clamp", name)), None
            )
            to = "" if end is None else f"to: {end}, "
            return f"{{from: {at}, {to}clamp: {{{named}: {number_text(what.value)}}}}}", ""
        case Release():
            clamps = [other.turn for other in turned[:place] if _known_by(other.turn) == ("clamp", name)]
            ended = clamps and isinstance(clamps[-1], Hold)
            return "", "" if ended else f"release {name}: the clamp that ends says so itself (to: {at})"
        case Lesion():
            return f"{{at: {at}, lesion: {named}}}", ""
        case Mend():
            return f"{{at: {at}, mend: {named}}}", ""


def _text(text: str) -> str:
    return text if _PLAIN.fullmatch(text) else json.dumps(text)


def _fed(values: tuple[float, ...]) -> str:
    """What an input is fed: numbers, or its source again."""
    numbers = [number_text(value) for value in values]
    return f"[{', '.join(numbers)}]" if len(numbers) > 1 else (*numbers, "null")[0]
