"""The input of all warnings: a spec without errors, with the network and the tables that were compiled from it.

In: nothing; this is the value that ``compile`` makes when the network is complete.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

from neurovis_spec.compiler.connections.entries import Bundle
from neurovis_spec.compiler.connections.plasticity import Learning
from neurovis_spec.compiler.names.modules import Library
from neurovis_spec.compiler.names.references import Section
from neurovis_spec.compiler.names.scope import Scope
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.neurons.groups import NeuronType
from neurovis_spec.compiler.neurons.populate import Census
from neurovis_spec.diagnostics import Span
from neurovis_spec.language.library import Library as Definitions
from neurovis_spec.language.located import Located
from neurovis_spec.language.sections import ConnectionModel, GroupModel
from neurovis_spec.language.spec import Spec
from neurovis_spec.language.values import Choice


class WrittenEntry(NamedTuple):
    """An entry of the connections as it is written, with what was made of it in each scope."""

    key: Located[str]
    body: ConnectionModel
    bundles: list[Bundle]

    @property
    def rules(self) -> tuple[tuple[Choice, Learning], ...]:
        """What it learns by, in the first scope that has connections, beside what is written."""
        made = next((bundle.rules for bundle in self.bundles if bundle.rules), ())
        return tuple(zip(self.body.plasticity, made, strict=False))


@dataclass(frozen=True)
class Compiled:
    """A spec without errors, what it became, which modules are used in it, and the files that it includes."""

    spec: Spec
    scopes: tuple[Scope, ...]
    library: Library
    used: Collection[str]
    network: Network
    bundles: tuple[Bundle, ...]
    census: Census
    included: tuple[Definitions, ...]

    @cached_property
    def sections(self) -> tuple[tuple[Section, list[Scope]], ...]:
        """The spec, and every module that is used, with the scopes that were made of it."""
        made: dict[str | None, list[Scope]] = {}
        for scope in self.scopes:
            made.setdefault(scope.module, []).append(scope)
        return tuple((scopes[0].section, scopes) for scopes in made.values())

    @cached_property
    def keys(self) -> frozenset[str]:
        """The keys of the spec, of every module that is used, and of the files that it includes."""
        parts = (*(section for section, _ in self.sections), *self.included)
        return frozenset(entry.name for part in parts for entry in part.source.entries)

    @cached_property
    def entries(self) -> Mapping[Span, WrittenEntry]:
        """Every entry of the connections, by the place of its key."""
        made: dict[Span, list[Bundle]] = {}
        for bundle in self.bundles:
            made.setdefault(bundle.key, []).append(bundle)
        return {
            key.span: WrittenEntry(key, body, made.get(key.span, []))
            for section, _ in self.sections
            for key, body in section.connections
        }

    @property
    def models(self) -> Iterator[tuple[NeuronType, GroupModel]]:
        """Every group of every scope: what its neurons are, and how it is written."""
        return ((one.kind, one.model) for one in self.census.groups)

    @property
    def libraries(self) -> tuple[Definitions, ...]:
        """The spec and the files that it includes, as far as they define something."""
        return (*self.included, self.spec)
