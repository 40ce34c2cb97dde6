"""The summary of a command that meets ROS: how long, how many steps, and what became of the messages of each topic.

In: counts. Out: one line of JSON, or lines of text.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field

from neurovis_spec.ros.counts import Counts
from neurovis_spec.ros.middleware import Ros


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
