"""``/diagnostics``: once a second how a run goes, for the tools that watch robots.

In: summaries. Out: messages of ``diagnostic_msgs/DiagnosticArray``, none where that package is missing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from neurovis_spec.ros.definitions import Definition
from neurovis_spec.ros.fields import Value, encode
from neurovis_spec.ros.middleware import MiddlewareError, Node, Publisher, Quality
from neurovis_spec.ros.summary import Summary, numbers

TYPE = "diagnostic_msgs/DiagnosticArray"
_FINE, _WARN = 0, 1


@dataclass
class Diagnostics:
    """Says how a run of this name goes. What has gone wrong since it was last asked makes it a warning."""

    node: Node
    name: str
    definition: Definition | None = None
    publisher: Publisher | None = None
    _wrong: int = 0

    @classmethod
    def of(cls, node: Node, name: str) -> Diagnostics:
        """Diagnostics of a node, where the package is there."""
        try:
            type_ = Definition.parse(TYPE, node.definition(TYPE))
        except MiddlewareError:
            return cls(node, name)
        return cls(node, name, type_, node.publisher("/diagnostics", TYPE, Quality()))

    def say(self, summary: Summary, silent: Sequence[str], rate: float) -> None:
        """Send a message."""
        if self.definition is None or self.publisher is None:
            return
        counts = summary.topics.values()
        wrong = summary.late + sum(sum(one.rejected.values()) + one.not_finite + one.lost for one in counts)
        news, self._wrong = wrong - self._wrong, wrong
        said = [f"no messages for {name}" for name in silent] + ([f"{news} late or not usable"] if news else [])
        values: dict[str, object] = {"rate": f"{rate:g}", "seconds": f"{summary.seconds:.1f}"}
        values |= {name: getattr(summary, name) for name in ("steps", "late", "reconnects", "shown", "skipped")}
        for topic, one in summary.topics.items():
            values |= {f"{topic}: {key}": count for key, count in numbers(one).items()}
        seconds, rest = divmod(self.node.now(), 1_000_000_000)
        status: Value = {
            "level": _WARN if said else _FINE,
            "name": self.name,
            "message": "; ".join(said) or f"runs at {rate:g} Hz",
            "hardware_id": summary.network,
            "values": [{"key": key, "value": str(value)} for key, value in values.items()],
        }
        message: dict[str, Value] = {"header": {"stamp": {"sec": seconds, "nanosec": rest}}, "status": [status]}
        self.publisher.publish(encode(self.definition, message, self.node.encoding))
