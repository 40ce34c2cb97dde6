"""Long work without the search for garbage.

In: a block that makes very many values without cycles among them. Out: the same, sooner: the search would walk over all
of them time and again, a quarter to a third of the whole. Where threads work at once, the last that began with it on
turns it on again.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def uncollected() -> Iterator[None]:
    """No search for reference cycles in this block."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()
