"""The spec with what was turned in a run as its events, in the words and blanks of its author.

In: the text of a spec's file, the network that is shown, what was turned. Out: the text with these as events, tried
out. Where they were written before, a run that goes on has them once: what it was turned to by then is in their place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

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
    if last is not None and text == last.after:
        is_before = now != shown and compile(_plain(last.before)).hash == shown
        if is_before or all(one in turned for one in last.turned):
            base, now = last.before, shown
        else:  # the spec that runs by now has events of its own, which this run was not turned to by hand
            more = tuple(one for one in turned if one not in last.turned)
    if now != shown:
        raise SavingError("the file of the spec is another network by now than the one that is shown: use --watch")
    found = as_events(more)
    if not (found.entries or found.comments) and base == text:
        raise SavingError("nothing was turned in this run: it has no events to be saved")
    after = append(base, "events", found.entries, found.comments)
    compile(_plain(after))
    return WithEvents(base, after, tuple(turned))


def _plain(text: str) -> str:
    return text.removeprefix("\ufeff")
