"""Limits: how large a network may become, checked before memory is taken.

In: nothing; these are the numbers, and functions that put amounts into words. The findings of one list are limited as
well: a hundred thousand wrong cells are one mistake.
"""

from __future__ import annotations

from typing import NamedTuple

#: Findings in one list of values, after which the rest of the list is not checked.
PATIENCE = 20
#: The most instances of modules.
MOST_INSTANCES = 100_000
#: How deep instances may be nested.
DEEPEST = 64
#: How many pairs are looked at, at most, by a formula that says which there are, for each connection that there may be.
PAIRS_A_CONNECTION = 100
#: The longest delay, in steps.
LONGEST_DELAY = 1_000_000
#: The most signals under way at once: the delays of all connections, in steps, added up.
MOST_SIGNALS = 250_000_000

#: In how many parts a step may be integrated.
MOST_SUBSTEPS = 10_000


class Limits(NamedTuple):
    """Most neurons and most connections of a network; ``--limit`` raises them."""

    neurons: int = 1_000_000
    connections: int = 10_000_000

    @staticmethod
    def of(limit: int | None) -> Limits:
        """The limits where ``limit`` connections are allowed, and as many neurons if that is more than a million."""
        return Limits() if limit is None else Limits(max(Limits().neurons, limit), limit)


def amount(number: int) -> str:
    """A number of things, to read.

    >>> amount(1234567), amount(10**30)
    ('1,234,567', '1e+30')
    """
    return f"{number:,}" if number < 10**15 else f"{number:.3g}"


def plural(number: int, noun: str) -> str:
    """A number with its noun.

    >>> plural(1, "neuron"), plural(0, "neuron")
    ('1 neuron', '0 neurons')
    """
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
