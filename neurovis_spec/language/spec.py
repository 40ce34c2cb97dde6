"""The Spec: the pydantic models of the language, section by section; the shape as written, and the JSON Schema from it.

In: nodes (``shape.read_spec`` feeds them). Out: frozen models whose leaves know their places. No reference is resolved
and no expression is parsed here. The descriptions are what an editor shows, and what the reference page prints. The
schema (2020-12) is plain data.
"""

from __future__ import annotations

from collections.abc import Mapping as AnyMapping
from typing import Annotated, ClassVar

from pydantic import Field
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

from neurovis_spec.language.body import BodyModel
from neurovis_spec.language.drawing import LayoutModel, RenderModel
from neurovis_spec.language.grammar import declaring
from neurovis_spec.language.library import LANGUAGE_VERSION, VERSION, Library, version_field
from neurovis_spec.language.located import NAME, IntegerField, Leaf, Located, TextsField, as_identifier
from neurovis_spec.language.model import Model, Named
from neurovis_spec.language.modules import INCLUDED, InstancesField, ModulesField
from neurovis_spec.language.ros import RosModel
from neurovis_spec.language.sections import ConnectionsField, EventsField, GroupsField, InputsField, Time
from neurovis_spec.language.unknown import Unknown
from neurovis_spec.language.values import ParametersField, ReferenceField
from neurovis_spec.language.yaml.source import Mapping

DIALECT = "https://json-schema.org/draft/2020-12/schema"


class Spec(Library):
    """A whole spec."""

    PLACE: ClassVar[str] = "the top level"
    ELSEWHERE: ClassVar[AnyMapping[str, str]] = {
        **dict.fromkeys(("groups", "layers", "nodes", "populations", "cells", "units"), "neurons"),
        **dict.fromkeys(("edges", "links", "projections", "weights", "wiring"), "connections"),
        **dict.fromkeys(("params", "constants", "variables"), "parameters"),
        **dict.fromkeys(("stimuli", "stimulus", "signals"), "inputs"),
        **dict.fromkeys(("simulation", "clock"), "time"),
    }

    name: Annotated[Located[str | Unknown], Leaf(as_identifier, NAME, True)] = Field(
        description="The name of the network, an identifier."
    )
    authors: TextsField | None = Field(None, description="Who wrote it.")
    license: TextsField | None = Field(None, description="Under which licence.")
    references: TextsField | None = Field(None, description="What it goes back to.")
    time: Time | None = Field(None, description="The clock: dt, steps, episode.")
    seed: IntegerField | None = Field(None, description="The only source of randomness (default 0).")
    parameters: ParametersField = Field(default_factory=dict, description="Named constants, in order.")
    include: TextsField = Field(default=(), description="Files whose modules and definitions are used here.")
    modules: ModulesField = Field(default_factory=dict, description="Networks to be used several times.")
    inputs: InputsField = Field(default_factory=dict, description="Signals from outside the network.")
    neurons: GroupsField = Field(default_factory=dict, description="Groups of neurons.")
    instances: InstancesField = Field(default_factory=dict, description="Uses of modules.")
    connections: ConnectionsField = Field(
        default=(), description="FROM -> TO: a weight or a body. Rows are sources, columns are targets."
    )
    outputs: Annotated[Named[ReferenceField], declaring("output")] = Field(
        default_factory=dict, description="Names for what leaves the network."
    )
    events: EventsField = Field(
        default=(), description="What changes during a run: parameters set, neurons clamped, parts lesioned."
    )
    body: BodyModel | None = Field(None, description="The body that it senses and moves in a run.")
    layout: LayoutModel | None = Field(None, description="How it is laid out.")
    render: RenderModel | None = Field(None, description="How it is drawn.")
    ros: RosModel | None = Field(None, description="How it meets ROS.")

    @classmethod
    def _without(cls, name: str, data: Mapping) -> str:
        if name == "name" and is_library(data):
            return "this is a file to be included: a spec uses what it holds with include: [FILE]"
        if name == "neurovis":
            return f"add the version of the language: neurovis: {LANGUAGE_VERSION}"
        return super()._without(name, data)


class IncludedModel(Library):
    """A file that a spec includes: modules, definitions and metadata, nothing else."""

    PLACE: ClassVar[str] = "an included file"

    neurovis: Annotated[Located[int], Leaf(version_field, VERSION)] | None = Field(  # type: ignore[assignment]
        None, description="The version of the language: 1."
    )
    authors: TextsField | None = Field(None, description="Who wrote it.")
    license: TextsField | None = Field(None, description="Under which licence.")
    references: TextsField | None = Field(None, description="What it goes back to.")
    include: TextsField = Field(default=(), description="Files whose modules and definitions are used here.")
    modules: ModulesField = Field(default_factory=dict, description="Networks to be used several times.")

    @classmethod
    def _foreign(cls, name: str) -> tuple[str, str] | None:
        if name not in Spec.model_fields:
            return super()._foreign(name)
        message = f"'{name}' is of a network of its own; an included file holds modules and definitions"
        return message, "leave it to the specs that include this file, or make a module of it"


def is_library(data: Mapping) -> bool:
    """Whether this holds modules or definitions alone: then it is no spec, but may be a file that specs include."""
    there = {entry.name for entry in data.entries}
    return bool(there & set(INCLUDED)) and not there & {"neurons", "instances", "connections"}


class _Written(GenerateJsonSchema):
    """The schema of what is written: a key that may be left out is not null, which is a finding."""

    def nullable_schema(self, schema: core_schema.NullableSchema) -> JsonSchemaValue:
        """What may be written, without the null that stands for nothing."""
        return self.generate_inner(schema["schema"])

    def default_schema(self, schema: core_schema.WithDefaultSchema) -> JsonSchemaValue:
        """The same without null as its default."""
        inner = super().default_schema(schema)
        return inner if inner.get("default", ...) is not None else {k: v for k, v in inner.items() if k != "default"}


def json_schema(included: bool = False) -> dict[str, object]:
    """The schema of a whole spec, or of a file that specs include. Keys that no model knows are refused in it as they
    are by the compiler."""
    model: type[Model] = IncludedModel if included else Spec
    schema = model.model_json_schema(by_alias=True, schema_generator=_Written)
    title = "NeuroVis file to be included, version 1" if included else "NeuroVis spec, version 1"
    return {"$schema": DIALECT, **schema, "title": title}
