"""The patterns of connections as they are written: their names, and the settings that each of them needs.

In: nothing. Out: names and settings. What a pattern connects is for the compiler.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Final

from neurovis_spec.language.located import FORMULA, Leaf
from neurovis_spec.language.values import Choice, as_choice

#: The settings of each pattern, all of which have to be there.
SETTINGS: Final[Mapping[str, tuple[str, ...]]] = {
    "all_to_all": (),
    "one_to_one": (),
    "chain": (),
    "ring": (),
    "random": ("probability",),
    "fixed_indegree": ("count",),
    "fixed_outdegree": ("count",),
    "nearest": ("count",),
    "small_world": ("degree", "rewire"),
    "band": ("width",),
}


def _schema() -> dict[str, object]:
    """A name alone where nothing is to be set, else ``{name: {setting: value}}``."""
    plain = [name for name, settings in SETTINGS.items() if not settings]
    bodies = {
        name: {
            "type": "object" if settings else ["object", "null"],
            "properties": dict.fromkeys(settings, FORMULA),
            "required": list(settings),
            "additionalProperties": False,
        }
        for name, settings in SETTINGS.items()
    }
    named = {"type": "object", "properties": bodies, "minProperties": 1, "maxProperties": 1}
    return {"anyOf": [{"enum": plain}, {**named, "additionalProperties": False}]}


PatternField = Annotated[Choice, Leaf(as_choice, _schema())]
