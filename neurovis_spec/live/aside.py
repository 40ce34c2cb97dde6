"""Aside: another branch of a run, shown beside it at the same step.

In: a source, and the number of one of its futures. Out: what a picture of that branch is made from, at the step that
the source is at; before its first step and behind its last one it stands still.
"""

from __future__ import annotations

from dataclasses import dataclass

from neurovis_spec.live.source import Reach, Seen, Source
from neurovis_spec.live.view import Glance, View


@dataclass(frozen=True, slots=True, eq=False)
class Compared:
    """What is seen of another branch, by its number, beside the run."""

    number: int
    seen: Seen
    glance: Glance
    reach: Reach


class Aside:
    """A future of a source, by its number. Raises SourceError."""

    def __init__(self, source: Source, number: int) -> None:
        self._source, self._number, self._twin = source, number, source.twin(number)

    def compared(self, source: Source, view: View) -> Compared | None:
        """What is seen of it at the step that a source is at; None where it is no future of that source any more, as
        the run has gone there, or it was deleted. Raises SourceError."""
        if source is not self._source or not source.futures.path(self._number):
            return None
        reach = self._twin.reach
        self._twin.go(min(max(source.step, reach.first), reach.last))
        seen = self._twin.seen()
        return Compared(self._number, seen, view.glance(seen), reach)
