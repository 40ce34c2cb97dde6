"""Futures: what a run did behind a step at which somebody had it go on differently, kept so that it can be gone to.

In: the states, the turns and the history of a run. Out: Futures, as a tree: within each those that branch off from it.
They take bounded memory: of what is too much the oldest are forgotten, and counted. Those of an older spec keep their
histories alone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import Final, TypeAlias

import numpy as np

from neurovis_spec.arrays import IntArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.live.beside import Beside
from neurovis_spec.live.history import History, Of, Renamed, Ring, Spliced
from neurovis_spec.live.past import Kept
from neurovis_spec.live.turns import Turned
from neurovis_spec.runtime.quantities import Quantities

#: The most futures, and the most bytes that their states and histories take together.
MOST: Final = 16
ROOM: Final = 128 << 20


#: The history of a run, or that of one of an older spec.
Steps: TypeAlias = Ring | Renamed


@dataclass(frozen=True, slots=True, eq=False)
class Future:
    """Behind step ``at`` it goes on to step ``last``, with all that was ``turned`` until then, by the states ``kept``;
    ``history`` is that of its steps alone. ``within`` are the futures that branch off from it. Its run ``started`` at a
    step. It is asked for by its ``number``, which stays the same, also while the run goes on in it, and has a ``name``
    where somebody gave it one; ``place`` counts in which order they were left. One of an ``older`` spec cannot be gone
    to. ``by`` is the number of the turn that it was left by, if it was by one: without that the run goes on in it."""

    number: int
    at: int
    last: int
    started: int
    turned: tuple[Turned, ...]
    kept: tuple[Kept, ...]
    history: Steps
    within: tuple[Future, ...] = ()
    name: str = ""
    older: bool = False
    by: int | None = None
    place: int = 0

    @property
    def size(self) -> int:
        """About how many bytes it takes, without those within it."""
        return sum(kept.size for kept in self.kept) + self.history.size


@dataclass(frozen=True, slots=True)
class Futures:
    """Those that branch off from the run as it goes, in the order in which they were left."""

    all: tuple[Future, ...] = ()
    #: how many were left
    made: int = 0
    #: the number of the run as it goes, and the next one that no branch has had
    now: int = 0
    fresh: int = 1
    #: how many of these were forgotten as there was no room
    dropped: int = 0
    #: what was deleted last, with the number of what it was within (None: of nothing), until the tree is another
    deleted: tuple[Future, int | None] | None = None

    @property
    def left(self) -> Future | None:
        """The one that was left last."""
        return max(self.all, key=attrgetter("place"), default=None)

    def leave(self, left: Future) -> Futures:
        """With a future that is left, as the run goes on differently behind its step ``at``: it keeps the number of the
        run, which gets a fresh one, and what branched off from it later is within it."""
        within = tuple(one for one in self.all if one.at > left.at)
        made = replace(left, number=self.now, place=self.made, within=within)
        rest = (*(one for one in self.all if one.at <= left.at), made)
        return replace(self, all=rest, made=self.made + 1, now=self.fresh, fresh=self.fresh + 1, deleted=None)

    def left_by(self, number: int, at: int, turned: Sequence[Turned]) -> Future | None:
        """The one that was left by a turn of this number, behind a step until which it was ``turned`` in this way."""
        wanted = [(entry.number, entry.turn) for entry in turned]  # one in place of another has its number
        found = [
            one
            for one in self.all
            if one.at == at and one.by == number and not one.older
            if [(entry.number, entry.turn) for entry in one.turned if entry.step <= at] == wanted
        ]
        return max(found, key=attrgetter("place"), default=None)

    def bounded(self, room: int | None = None) -> Futures:
        """Without the oldest, where they are too many or take too much room, by default that of ROOM."""
        room = ROOM if room is None else room
        spare = 0 if self.deleted is None else self.deleted[0].size
        kept = _bounded(self.all, room)
        fewer = len(_every(self.all)) - len(_every(kept))
        more = sum(one.size for one in _every(kept)) + spare > room
        return replace(self, all=kept, dropped=self.dropped + fewer, deleted=None if fewer or more else self.deleted)

    def path(self, number: int) -> tuple[Future, ...]:
        """The futures that lead to one, from outside; none where there is none of this number."""
        return _path(self.all, number)

    def taken_up(self, number: int) -> Futures:
        """With the run going on as one of these, and with what is within it."""
        (taken,) = [one for one in self.all if one.number == number]
        rest = _in_order(one for one in (*self.all, *taken.within) if one is not taken)
        return replace(self, all=rest, now=number, deleted=None)

    def renamed(self, number: int, name: str) -> Futures:
        """With another name of one."""
        return replace(self, all=_changed(self.all, number, lambda one: replace(one, name=name)))

    def forgotten(self, number: int) -> Futures:
        """Without one, and without what is within it; until the tree is another one it can be ``restored``."""
        path = self.path(number)
        within = path[-2].number if len(path) > 1 else None
        return replace(self, all=_pruned(self.all, number), deleted=(path[-1], within))

    def restored(self) -> Futures | None:
        """With what was deleted last, where it was; None where that is no longer kept."""
        if self.deleted is None:
            return None
        one, within = self.deleted
        if within is None:
            return replace(self, all=_in_order((*self.all, one)), deleted=None)
        put = _changed(self.all, within, lambda outer: replace(outer, within=_in_order((*outer.within, one))))
        return replace(self, all=put, deleted=None)

    @property
    def histories(self) -> Iterator[History]:
        """Those of all, also within each other."""
        return (one.history for one in _every(self.all))

    def history(self, number: int | None = None) -> History | None:
        """How the run went in one, from where it branched off from the run as it goes; by default in the one that was
        left last. None where there is none."""
        if number is None:
            left = self.left
            return None if left is None else left.history
        path = self.path(number)
        ends = [*(one.at for one in path[1:]), path[-1].last] if path else []
        return Spliced(tuple((one.history, end) for one, end in zip(path, ends, strict=True))) if path else None

    def of_older_spec(self, network: Network, now: Network) -> Futures:
        """All of them, of one network, as those of an older spec of another."""
        return replace(self, all=_older(self.all, _places(network, now)), deleted=None)


def _path(futures: Sequence[Future], number: int) -> tuple[Future, ...]:
    for one in futures:
        if one.number == number:
            return (one,)
        if inner := _path(one.within, number):
            return one, *inner
    return ()


def _every(futures: Sequence[Future]) -> list[Future]:
    return [found for one in futures for found in (one, *_every(one.within))]


def _in_order(futures: Iterable[Future]) -> tuple[Future, ...]:
    """In the order in which they were left."""
    return tuple(sorted(futures, key=attrgetter("place")))


def _bounded(futures: tuple[Future, ...], room: int) -> tuple[Future, ...]:
    """Without the oldest, where they are too many or take too much room, but before these without what has no room by
    itself; one with others within it goes with these."""
    for one in _every(futures):
        if one.size > room:
            futures = _pruned(futures, one.number)
    found = _every(futures)
    while len(found) > MOST or sum(one.size for one in found) > room:
        oldest = min(found, key=attrgetter("place"))
        futures = _pruned(futures, oldest.number)
        found = _every(futures)
    return futures


def _changed(futures: tuple[Future, ...], number: int, change: Callable[[Future], Future]) -> tuple[Future, ...]:
    """With a change of one of them, wherever it is."""
    return tuple(
        change(one) if one.number == number else replace(one, within=_changed(one.within, number, change))
        for one in futures
    )


def _older(futures: tuple[Future, ...], places: Mapping[Of, IntArray]) -> tuple[Future, ...]:
    """With no states, and by the places that things have by now."""
    return tuple(
        replace(
            one,
            kept=(),
            history=Renamed(one.history, places),
            within=_older(one.within, places),
            older=True,
        )
        for one in futures
    )


def _places(network: Network, now: Network) -> dict[Of, IntArray]:
    """Where in a network stands what there is by now, by its name; −1 for nothing."""

    def of(names: Sequence[str], others: Sequence[str]) -> IntArray:
        known = {name: place for place, name in enumerate(names)}
        return np.array([known.get(name, -1) for name in others], np.int64)

    return {
        "neurons": of(network.neurons.names, now.neurons.names),
        "connections": of(network.connection_names, now.connection_names),
        "quantities": of(called(network), called(now)),
    }


def called(network: Network) -> tuple[str, ...]:
    """How quantities are called, and behind them inputs and sensors, as no quantity is."""
    quantities = Quantities(network).names
    beside = Beside(network, len(quantities))
    inputs, sensors = (
        (f"input {name}" for name in beside.input_names),
        (f"sensor {name}" for name in beside.sensor_names),
    )
    return (*quantities, *inputs, *sensors)


def _pruned(futures: tuple[Future, ...], number: int) -> tuple[Future, ...]:
    return tuple(replace(one, within=_pruned(one.within, number)) for one in futures if one.number != number)
