"""Modules and instances; the shape as written.

In: nodes. Out: frozen models whose leaves know their places. A module is a network that is used several times: it has
the sections of a spec that say what there is, and none that says how it is run, drawn or connected to the world.
"""

from __future__ import annotations

from collections.abc import Container
from collections.abc import Mapping as AnyMapping
from typing import Annotated, ClassVar

from pydantic import Field

from neurovis_spec.language.drawing import ModuleLayoutModel
from neurovis_spec.language.grammar import GROUP, declaring, naming
from neurovis_spec.language.located import Formula, FormulaField, IdentifierField, Located, TextField
from neurovis_spec.language.model import Model, Named
from neurovis_spec.language.sections import ConnectionsField, GroupsField, InputsField, ListedNamesField
from neurovis_spec.language.values import GivenField, ParametersField, WrittenField

#: the sections of an included file
INCLUDED = ("modules", "activations", "models", "rules", "synapses")


class InstanceModel(Model):
    """A use of a module, or several of them."""

    PLACE: ClassVar[str] = "an instance"
    BARE: ClassVar[str] = "module"
    ELSEWHERE: ClassVar[AnyMapping[str, str]] = {
        **dict.fromkeys(("parameters", "params", "with"), "set"),
        **dict.fromkeys(("type", "of"), "module"),
        **dict.fromkeys(("n", "number"), "count"),
    }

    module: Annotated[IdentifierField, naming("module")] = Field(description="The module that it is an instance of.")
    count: FormulaField | None = Field(
        None, description="How many instances; left with count 3 makes left1, left2, left3."
    )
    names: Annotated[ListedNamesField, declaring("instance")] | None = Field(
        None, description="The names of the instances, one by one, or {file: …, column: …}."
    )
    set: Annotated[Named[Annotated[GivenField, GROUP]], naming("parameter")] = Field(
        default_factory=dict,
        description="{parameter of the module: value}; may use i (0-based) and n (count). {matrix of it: rows}, or "
        "{file: …}, or a matrix out here.",
    )
    inputs: Annotated[Named[Annotated[TextField, naming("input")]], naming("input")] = Field(
        default_factory=dict,
        description="{input of the module: input out here}; one of count × size is shared out in order.",
    )
    description: TextField | None = Field(None, description="What it is.")

    def formulas(self, matrices: Container[str]) -> dict[str, Formula]:
        """What it sets but for the ``matrices`` of its module, as far as that is formulas."""
        given = self.set.items()
        return {name: value for name, value in given if isinstance(value, Located) and name not in matrices}


InstancesField = Annotated[Named[InstanceModel], declaring("instance")]


class ModuleModel(Model):
    """A network that is used several times, with parameters and inputs of its own."""

    PLACE: ClassVar[str] = "a module"

    title: TextField | None = Field(None, description="A title.")
    description: TextField | None = Field(None, description="What this is.")
    parameters: ParametersField = Field(
        default_factory=dict, description="Constants of its own, in order; an instance may set them."
    )
    matrices: Named[WrittenField] = Field(
        default_factory=dict,
        description="Matrices that its connections name: {name: rows}, {name: {file: …}}; an instance may set others.",
    )
    inputs: InputsField = Field(
        default_factory=dict,
        description="Signals from outside the module; those that an instance does not name are inputs of the network.",
    )
    neurons: GroupsField = Field(default_factory=dict, description="Groups of neurons.")
    instances: InstancesField = Field(default_factory=dict, description="Uses of other modules.")
    connections: ConnectionsField = Field(default=(), description="FROM -> TO: a weight or a body.")
    layout: ModuleLayoutModel | None = Field(None, description="How every instance is laid out.")


ModulesField = Annotated[Named[ModuleModel], declaring("module")]
