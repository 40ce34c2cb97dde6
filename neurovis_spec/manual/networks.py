"""Networks to start from: whole specs that the manual has, from ``networks.yaml`` beside this module.

In: that file. Out: a Start for each.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

from neurovis_spec.language.yaml.source import Mapping, Node, Scalar
from neurovis_spec.manual.keys import written_in


@dataclass(frozen=True, slots=True)
class Start:
    """A network to start from: its name, what the page calls it, other words by which it is found, what it does, and
    the spec."""

    name: str
    title: str
    called: tuple[str, ...]
    about: str
    spec: str


@cache
def starts() -> tuple[Start, ...]:
    """All of them, in the order of the page."""
    return tuple(_start(entry.name, entry.value) for entry in written_in("networks.yaml"))


def _start(name: str, said: Node) -> Start:
    assert isinstance(said, Mapping)
    about = {entry.name: str(entry.value.value) for entry in said.entries if isinstance(entry.value, Scalar)}
    called = about.get("called", "")
    return Start(name, about["title"], tuple(called.split(", ")) if called else (), about["about"], about["spec"])
