"""Undefined: which activity is no finite number, and since when.

In: what is shown of a step, and its source. Out: the neuron that was the first of those that are not finite
now, and from which step on; it is looked for once, and stays as long as nothing else can be true.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from neurovis_spec.live.history import Bins
from neurovis_spec.live.source import Source
from neurovis_spec.live.view import UNDEFINED, Glance, View

#: So many of those that are not finite are looked at, and so many steps back; and so many steps are made again.
_LOOKED_AT: Final = 64
_BACK: Final = 10_000
_EXACTLY: Final = 256


@dataclass(frozen=True, slots=True)
class Undefined:
    """``count`` neurons, or groups that are drawn as one, are not finite, the first of which is ``item`` (``n3``), from
    step ``since`` on, or from an earlier one where the steps before are not ``known``."""

    item: str
    since: int
    known: bool
    count: int


def undefined_in(view: View, glance: Glance, source: Source, before: Undefined | None) -> Undefined | None:
    """What is not finite at the step of a source; ``before`` is what was not, in the same run, at a step that was shown
    before."""
    discs = np.flatnonzero(glance.kinds[len(glance.lines) :] & UNDEFINED)
    if not len(discs):
        return None
    if before is not None and before.since <= glance.step and int(before.item[1:]) in discs:
        return replace(before, count=len(discs))
    first = max(source.reach.first, glance.step + 1 - _BACK)
    since = {f"n{disc}": _since(view, source, f"n{disc}", first, glance.step) for disc in discs[:_LOOKED_AT].tolist()}
    item = min(since, key=lambda one: since[one])
    exact = _exactly(view, source, item, since[item], glance.step)
    return Undefined(item, exact, exact > first or first == 0, len(discs))


def _since(view: View, source: Source, item: str, first: int, last: int) -> int:
    """The step after the last one at which it was finite, as the history has it, whose numbers have 32 bits."""
    members = view.members(item)
    if members is None:
        return last
    values = source.history.read(members, Bins(first, 1, last + 1 - first))[:, 0]
    finite = np.flatnonzero(np.isfinite(values[:-1]))
    return first + int(finite[-1]) + 1 if len(finite) else first


def _exactly(view: View, source: Source, item: str, since: int, last: int) -> int:
    """The step since when it is not finite; what has grown beyond 32 bits may have been finite for a while."""
    if last + 1 - since > _EXACTLY:
        return since
    values = [view.values(seen, (item,))[item] for seen in source.recall(last + 1 - since)]
    finite = [at for at, value in enumerate(values) if math.isfinite(value)]
    return last + 1 - len(values) + (finite[-1] + 1 if finite else 0)
