"""A scope: the spec itself or an instance of a module, with what the names in it mean; what its last sections may name.

In: nothing; these are the values that ``expand`` makes and that everything which resolves a name reads.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from neurovis_spec.compiler.names.references import Section, home_of
from neurovis_spec.compiler.network import Input, Output
from neurovis_spec.compiler.values.constants import Constants
from neurovis_spec.compiler.values.data_files import Files
from neurovis_spec.compiler.values.definitions import Definitions
from neurovis_spec.diagnostics import Undeclared
from neurovis_spec.language.spec import Spec
from neurovis_spec.language.unknown import UNKNOWN, Names, Unknown
from neurovis_spec.language.values import Written


class GivenMatrix(NamedTuple):
    """A matrix of a module, as it is written there or where an instance sets it, and what its formulas and its path
    mean at that place."""

    written: Written
    constants: Constants
    files: Files


@dataclass(frozen=True)
class Scope:
    """The spec (its ``path`` is empty) or one instance (``left1``, ``left1.knee``).

    ``inputs`` are those that its names may mean, those of instances within it by their dotted names. ``children`` are
    the places of the instances within it, by name: ``left`` means all of a counted one, ``left1`` the first of them.
    ``settings`` are the parameters that ``set`` gives, each with the names that its formula uses in the scope around;
    ``matrices`` those of the module, as they are there or as ``set`` gives them.
    """

    path: str
    section: Section
    constants: Constants
    definitions: Definitions
    files: Files
    inputs: Names[Input]
    module: str | None = None
    parent: int = -1
    declared: str = ""
    number: int = 0
    children: Names[tuple[int, ...]] = field(default_factory=Names)
    settings: Mapping[str, frozenset[str]] = field(default_factory=dict)
    matrices: Names[GivenMatrix] = field(default_factory=Names)

    def input(self, name: str) -> Input | Unknown | None:
        """The input that is called so, here or in an instance; None where there is none."""
        head, dot, _ = name.partition(".")
        return UNKNOWN if dot and self.children.may_make(head) else self.inputs.get(name)

    def undeclared(self, name: str) -> Undeclared | None:
        """An input that is not declared here; None where it may be one of an instance, as modules declare these."""
        return None if "." in name else Undeclared(name, home_of(self.module))

    def called(self, name: str) -> str:
        """The name that something of this scope has in the whole network."""
        return f"{self.path}.{name}" if self.path else name

    def declares(self, entry: str) -> str:
        """The name by which an entry of ``connections`` of this scope draws: ``left1/K -> O`` within the instance
        left1. It is another one than that of the entry ``left1.K -> O`` around it, as no name and no path has a
        slash."""
        return f"{self.path}/{entry}" if self.path else entry


class Expansion(NamedTuple):
    """All scopes, and the inputs of the network in the order of their places in the vector of all inputs."""

    scopes: tuple[Scope, ...]
    inputs: tuple[Input, ...]

    def depend(self) -> None:
        """What is structural in an instance is so for the parameters, of the scope around it, that it was set from."""
        for scope in reversed(self.scopes):
            for name, used in scope.settings.items():
                if name in scope.constants.structural:
                    self.scopes[scope.parent].constants.depend(used)


class Surroundings(NamedTuple):
    """What the sections may name that say how a network meets the world, ``body`` and ``ros``: the inputs of the
    network, or of the spec itself, and its outputs."""

    spec: Spec
    scope: Scope
    inputs: tuple[Input, ...]
    outputs: tuple[Output, ...]
