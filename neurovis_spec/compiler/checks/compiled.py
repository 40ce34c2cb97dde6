"""The input of all warnings: a spec without errors, with the network and the tables that were compiled from it.

In: nothing; this is the value that ``compile`` makes when the network is complete.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import NamedTuple

from neurovis_spec.compiler.connections.entries import Bundle
from neurovis_spec.compiler.names.modules import Library
from neurovis_spec.compiler.names.references import Section
from neurovis_spec.compiler.names.scope import Scope
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.neurons.populate import Population
from neurovis_spec.diagnostics import Span
from neurovis_spec.language.library import Library as Definitions
from neurovis_spec.language.located import Located
from neurovis_spec.language.sections import ConnectionModel
from neurovis_spec.language.spec import Spec


class Compiled(NamedTuple):
    """A spec without errors, what it became, which modules are used in it, and the files that it includes."""

    spec: Spec
    scopes: tuple[Scope, ...]
    library: Library
    used: Collection[str]
    network: Network
    bundles: tuple[Bundle, ...]
    population: Population
    included: tuple[Definitions, ...]

    def sections(self) -> Iterator[tuple[Section, list[Scope]]]:
        """The spec, and every module that is used, with the scopes that were made of it."""
        made: dict[str | None, list[Scope]] = {}
        for scope in self.scopes:
            made.setdefault(scope.module, []).append(scope)
        for scopes in made.values():
            yield scopes[0].section, scopes

    def entries(self) -> Iterator[tuple[Located[str], ConnectionModel, list[Bundle]]]:
        """Every entry of the connections as it is written, with what was made of it in each scope."""
        made: dict[Span, list[Bundle]] = {}
        for bundle in self.bundles:
            made.setdefault(bundle.key, []).append(bundle)
        for section, _ in self.sections():
            for key, body in section.connections:
                yield key, body, made.get(key.span, [])
