"""How many examples a law has: few in each run, which are the same each time; many more where new ones are looked for,
with ``--hypothesis-profile=explore``."""

from __future__ import annotations

from typing import Final

from hypothesis import settings

#: examples with explore, for one of each run
_EXPLORED: Final = 20


def examples(count: int) -> settings:
    """So many examples in each run."""
    return settings(max_examples=count if settings().derandomize else _EXPLORED * count)
