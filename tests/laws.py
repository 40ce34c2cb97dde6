"""How many examples a law has: few in each run, which are the same each time; many more where new ones are looked for,
with ``--hypothesis-profile=explore``."""

from __future__ import annotations

from typing import Final

from hypothesis import settings

EXPLORING: Final = not settings().derandomize
#: examples with explore, for one of each run
_EXPLORED: Final = 20


def examples(count: int) -> settings:
    """So many examples in each run."""
    return settings(max_examples=_EXPLORED * count if EXPLORING else count)


def one_in(share: int) -> int:
    """Of all there is to try one in so many is tried in each run."""
    return 1 if EXPLORING else share
