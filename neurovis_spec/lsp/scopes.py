"""Scopes: within which module and which definition the names of a text are looked up.

In: a path. Out: its Scope. What a text is for is in the models of the language (``language/places.py``).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from neurovis_spec.language.grammar import Kind
from neurovis_spec.lsp.outline import Path


@dataclass(frozen=True, slots=True)
class Scope:
    """Within which module (None: the spec itself) and which definition (section, name) a text stands."""

    module: str | None = None
    definition: tuple[str, str] | None = None


#: The kinds that definitions declare, by section.
DEFINITIONS: Final[Mapping[str, Kind]] = {"activations": "activation", "models": "model", "rules": "rule"}
SECTIONS: Final[Mapping[Kind, str]] = {kind: section for section, kind in DEFINITIONS.items()}


def scope_of(path: Path) -> Scope:
    """The scope of a key or a value.

    >>> scope_of(("modules", "leg", "parameters", "gain")).module
    'leg'
    """
    if len(path) > 2 and path[0] == "modules" and isinstance(path[1], str):
        return Scope(path[1])
    if len(path) > 2 and path[0] in DEFINITIONS:
        return Scope(None, (str(path[0]), str(path[1])))
    return Scope()
