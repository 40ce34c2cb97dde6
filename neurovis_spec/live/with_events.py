"""The spec with what was turned in a run as its events, in the words and blanks of its author.

In: the text of a spec's file, the network that is shown, what was turned. Out: the text with these as events, tried
out. Where they were written before, a run that goes on has them once: what it was turned to by then is in their place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import takewhile

from neurovis_spec.language.format.append import append
from neurovis_spec.live.as_events import as_events
from neurovis_spec.live.pins import Compile, SavingError
from neurovis_spec.live.turns import Turned


@dataclass(frozen=True, slots=True)
class WithEvents:
    """A spec without and with the events that do what was ``turned``."""

    before: str
    after: str
    turned: tuple[Turned, ...]


def with_events(
    text: str, shown: str, turned: Sequence[Turned], compile: Compile, last: WithEvents | None = None
) -> WithEvents:
    """The spec with what was turned in a run of the network of this hash (``shown``); ``last`` is what was written
    before. Raises SavingError, SpecError."""
    base, more = text, tuple(turned)
    now = compile(_plain(text)).hash
    if last is not None:
        plain = without(text, last)
        if plain is not None:
            before = compile(_plain(plain)).hash
            is_before = now != shown and before == shown
            if is_before or (shown in (now, before) and all(one in turned for one in last.turned)):
                base, now = plain, shown
            else:  # the spec that runs by now has events of its own, which this run was not turned to by hand
                more = tuple(one for one in turned if one not in last.turned)
        elif any(one in turned for one in last.turned) and _remains(text, last):
            raise SavingError(
                "the events that were saved before have been edited since: take them out of the file, "
                "or begin the run anew"
            )
    if now != shown:
        raise SavingError("the file of the spec is another network by now than the one that is shown: use --watch")
    found = as_events(more)
    if not (found.entries or found.comments) and base == text:
        raise SavingError("nothing was turned in this run: it has no events to be saved")
    after = append(base, "events", found.entries, found.comments)
    compile(_plain(after))
    return WithEvents(base, after, tuple(turned))


def without(text: str, last: WithEvents) -> str | None:
    """A text without what was written before, wherever that stands in it by now; None where it does not, as it was."""
    was, written = _changed(last)
    return text.replace(written, was) if text.count(written) == 1 else None


def _remains(text: str, last: WithEvents) -> bool:
    """Whether some of the events that were written before stand in a text."""
    events = (line.strip(" -,[]") for line in _changed(last)[1].splitlines())
    return any(event in text for event in events if event.startswith("{"))


def _changed(last: WithEvents) -> tuple[str, str]:
    """What there was, and what was written in its place."""
    begin = _alike(last.before, last.after)
    end = _alike(last.before[begin:][::-1], last.after[begin:][::-1])
    was, written = (one[begin : len(one) - end] for one in (last.before, last.after))
    return was, written


def _alike(one: str, other: str) -> int:
    """How many characters two texts have in common, from their beginning on."""
    return sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], zip(one, other, strict=False)))


def _plain(text: str) -> str:
    return text.removeprefix("\ufeff")
