"""What warnings look at: a spec without errors, and what it became.

In: nothing; this is the value that ``compile`` makes once the network stands.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import NamedTuple

from neurovis_spec.compiler.entries import Bundle
from neurovis_spec.compiler.modules import Library
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.populate import Population
from neurovis_spec.compiler.references import Section
from neurovis_spec.compiler.unit import Unit
from neurovis_spec.diagnostics import Span
from neurovis_spec.language.library import Library as Definitions
from neurovis_spec.language.located import Located
from neurovis_spec.language.sections import ConnectionModel
from neurovis_spec.language.spec import Spec


class Compiled(NamedTuple):
    """A spec without errors, what it became, which modules are used in it, and the files that it includes."""

    spec: Spec
    units: tuple[Unit, ...]
    library: Library
    used: Collection[str]
    network: Network
    bundles: tuple[Bundle, ...]
    population: Population
    included: tuple[Definitions, ...]

    def sections(self) -> Iterator[tuple[Section, list[Unit]]]:
        """The spec, and every module that is used, with the units that were made of it."""
        made: dict[str | None, list[Unit]] = {}
        for unit in self.units:
            made.setdefault(unit.module, []).append(unit)
        for units in made.values():
            yield units[0].section, units

    def entries(self) -> Iterator[tuple[Located[str], ConnectionModel, list[Bundle]]]:
        """Every entry of the connections as it is written, with what was made of it in each unit."""
        made: dict[Span, list[Bundle]] = {}
        for bundle in self.bundles:
            made.setdefault(bundle.key, []).append(bundle)
        for section, _ in self.sections():
            for key, body in section.connections:
                yield key, body, made.get(key.span, [])
