"""The ``body`` section of a spec, resolved: what the network senses and what it moves.

In: nothing; these are values of the Network. Out: BodySettings, which ``compiler/body.py`` makes and a run opens.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from neurovis_spec.language.expressions.tree import Tree


@dataclass(frozen=True, slots=True)
class Sensed:
    """An input of the network (its index in ``Network.inputs``) and the sensors that are its components: their names,
    or ``name[i]`` for one number of a sensor that is several."""

    input: int
    sensors: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Moved:
    """An actuator (``name``, or ``name[i]``) and its command: an expression of outputs and parameters.

    ``outputs``: the names in it, each with the index of an output and of a number in that. ``parameters``: the names in
    it, each with a slot of ``Network.settable``. ``text`` is the expression as it is written.
    """

    actuator: str
    command: Tree
    outputs: tuple[tuple[str, int, int], ...]
    parameters: tuple[tuple[str, int], ...]
    text: str = ""


@dataclass(frozen=True, slots=True)
class BodySettings:
    """A body of a ``kind`` (an entry point's name), opened with what the spec gives (``given``, and ``path`` where that
    is a file). ``each_episode``: it is reset where an episode ends. ``sensors``: for each sensor what its numbers are
    called, ``name`` or ``name[i]``; none where the body could not be opened."""

    kind: str
    given: str
    path: Path | None
    substeps: int | None
    sensed: tuple[Sensed, ...]
    moved: tuple[Moved, ...]
    each_episode: bool
    sensors: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
