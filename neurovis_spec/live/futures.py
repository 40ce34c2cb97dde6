"""Futures: what a run did behind a step at which somebody had it go on differently, kept so that it can be gone to.

In: the states, the turns and the history of a run. Out: Futures, as a tree: within each those that branch off from it.
They take bounded memory: of what is too much the oldest are forgotten.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from neurovis_spec.live.history import Ring
from neurovis_spec.live.past import Kept
from neurovis_spec.live.turns import Turned

#: The most futures, and the most bytes that their states and histories take together.
MOST: Final = 16
ROOM: Final = 128 << 20


@dataclass(frozen=True, slots=True, eq=False)
class Future:
    """Behind step ``at`` it goes on to step ``last``, with all that was ``turned`` until then, by the states ``kept``;
    ``history`` is that of its steps alone. ``within`` are the futures that branch off from it. Its run ``started`` at a
    step. It is asked for by its ``number``."""

    number: int
    at: int
    last: int
    started: int
    turned: tuple[Turned, ...]
    kept: tuple[Kept, ...]
    history: Ring
    within: tuple[Future, ...] = ()

    @property
    def size(self) -> int:
        """About how many bytes it takes, without those within it."""
        return sum(kept.size for kept in self.kept) + self.history.size


@dataclass(frozen=True, slots=True)
class Futures:
    """Those that branch off from the run as it goes, in the order in which they were left."""

    all: tuple[Future, ...] = ()
    #: how many there were
    made: int = 0

    @property
    def left(self) -> Future | None:
        """The one that was left last."""
        return max(self.all, key=lambda one: one.number, default=None)

    def leave(self, left: Future) -> Futures:
        """With a future that is left, as the run goes on differently behind its step ``at``: it gets the next number,
        and what branched off from it later is within it."""
        within = tuple(one for one in self.all if one.at > left.at)
        made = replace(left, number=self.made, within=within)
        rest = (*(one for one in self.all if one.at <= left.at), made)
        return Futures(rest, self.made + 1)

    def left_at(self, at: int, turned: Sequence[Turned]) -> Future | None:
        """The one that was left last behind a step until which it was ``turned`` in this way."""
        numbers = [entry.number for entry in turned]
        found = [
            one
            for one in self.all
            if one.at == at and [entry.number for entry in one.turned if entry.step <= at] == numbers
        ]
        return max(found, key=lambda one: one.number, default=None)

    def bounded(self, room: int = ROOM) -> Futures:
        """Without the oldest, where they are too many or take too much room."""
        return replace(self, all=_bounded(self.all, room))

    def path(self, number: int) -> tuple[Future, ...]:
        """The futures that lead to one, from outside; none where there is none of this number."""
        return _path(self.all, number)

    def without(self, number: int) -> Futures:
        """Without one of these, and with what is within it."""
        (taken,) = [one for one in self.all if one.number == number]
        return replace(self, all=tuple(one for one in (*self.all, *taken.within) if one is not taken))


def _path(futures: Sequence[Future], number: int) -> tuple[Future, ...]:
    for one in futures:
        if one.number == number:
            return (one,)
        if inner := _path(one.within, number):
            return one, *inner
    return ()


def _every(futures: Sequence[Future]) -> list[Future]:
    return [found for one in futures for found in (one, *_every(one.within))]


def _bounded(futures: tuple[Future, ...], room: int) -> tuple[Future, ...]:
    """Without the oldest, where they are too many or take too much room; one with others within it goes with these."""
    found = _every(futures)
    while len(found) > MOST or sum(one.size for one in found) > room:
        oldest = min(found, key=lambda one: one.number)
        futures = _pruned(futures, oldest.number)
        found = _every(futures)
    return futures


def _pruned(futures: tuple[Future, ...], number: int) -> tuple[Future, ...]:
    return tuple(replace(one, within=_pruned(one.within, number)) for one in futures if one.number != number)
