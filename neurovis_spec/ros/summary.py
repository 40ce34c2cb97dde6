"""The summary of a command that meets ROS: how long, how many steps, and what became of the messages of each topic.

In: one message after the other. Out: counts; once a second at most a line about what was rejected or lost; at the end
one line of JSON, or lines of text.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from time import monotonic
from typing import Final, Literal, TypeAlias

from neurovis_spec.ros.middleware import Ros

#: Why a message is rejected, the first that applies.
Reason: TypeAlias = Literal["type", "parse", "hash", "length", "names", "publisher"]
REASONS: Final[Mapping[Reason, str]] = {
    "type": "of another type",
    "parse": "that cannot be read",
    "hash": "of another network, or another version of its spec,",
    "length": "of another length",
    "names": "without a name that is picked",
    "publisher": "of another publisher",
}


@dataclass(slots=True)
class Counts:
    """Of one topic. ``lost`` are gaps in its sequence numbers, and what a full queue or disk did not take."""

    received: int = 0
    recorded: int = 0
    lost: int = 0
    unlabelled: int = 0
    not_finite: int = 0
    rejected: dict[Reason, int] = field(default_factory=lambda: dict.fromkeys(REASONS, 0))

    def summary(self) -> dict[str, object]:
        """As the summary of a command has it."""
        return {
            "received": self.received,
            "recorded": self.recorded,
            "lost": self.lost,
            "unlabelled": self.unlabelled,
            "not_finite": self.not_finite,
            "rejected": dict(self.rejected),
        }


class Teller:
    """Tells of what is rejected and lost, once a second at most."""

    def __init__(self, tell: Callable[[str], None], clock: Callable[[], float] = monotonic) -> None:
        self._tell, self._clock = tell, clock
        self._told = -1.0
        self._news: dict[str, int] = {}

    def note(self, news: str, count: int = 1) -> None:
        """So many messages more, of which ``news`` says what became."""
        self._news[news] = self._news.get(news, 0) + count
        self.look()

    def say(self, line: str) -> None:
        """Tell something that is told once."""
        self._tell(line)

    def look(self) -> None:
        """Tell what there is, unless a line was just told."""
        now = self._clock()
        if self._news and now - self._told >= 1:
            self._told = now
            self.rest()

    def rest(self) -> None:
        """Tell what has not been told yet."""
        if self._news:
            some = [f"{count} {news}" for news, count in self._news.items()]
            self._news.clear()
            self._tell("; ".join(some))


@dataclass(frozen=True, slots=True)
class Summary:
    """How a command has gone. ``shown`` and ``skipped`` are messages of the display."""

    network: str
    hash: str
    ros: Ros
    seconds: float
    steps: int = 0
    late: int = 0
    reconnects: int = 0
    shown: int = 0
    skipped: int = 0
    files: tuple[str, ...] = ()
    topics: Mapping[str, Counts] = field(default_factory=dict)

    def json(self) -> str:
        """One object on one line."""
        return json.dumps(
            {
                "network": self.network,
                "hash": self.hash,
                "ros": self.ros,
                "seconds": round(self.seconds, 3),
                "steps": self.steps,
                "late": self.late,
                "reconnects": self.reconnects,
                "shown": self.shown,
                "skipped": self.skipped,
                "files": list(self.files),
                "topics": {name: counts.summary() for name, counts in self.topics.items()},
            }
        )

    def text(self) -> str:
        """For a reader."""
        parts = [f"{self.network}: {self.seconds:.1f} s"]
        if self.steps:
            parts.append(f"{self.steps} steps, {self.late} late")
        if self.shown or self.skipped:
            parts.append(f"{self.shown} shown, {self.skipped} skipped")
        if self.reconnects:
            parts.append(f"{self.reconnects} reconnects")
        lines = [", ".join(parts)]
        for name, counts in self.topics.items():
            said = ", ".join(f"{value} {key.replace('_', ' ')}" for key, value in numbers(counts).items() if value)
            if said:
                lines.append(f"{name}: {said}")
        return "\n".join([*lines, *self.files])


def numbers(counts: Counts) -> dict[str, int]:
    """All counts of a topic, by what they count."""
    rejected = {f"rejected for their {reason}": count for reason, count in counts.rejected.items()}
    told = {name: getattr(counts, name) for name in ("received", "recorded", "lost", "unlabelled", "not_finite")}
    return {**told, **rejected}
