"""The ``body`` section, as written: which body, what the network senses of it and what it moves.

In: nodes. Out: a frozen model whose leaves know their places. Which kinds of bodies there are is known by entry points,
so a key may name one that nobody here knows of; its names are checked by the compiler, against the body itself.
"""

from __future__ import annotations

from collections.abc import Collection
from functools import cache
from typing import Annotated, ClassVar

from pydantic import ConfigDict, Field, GetJsonSchemaHandler
from pydantic.fields import FieldInfo
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import core_schema

from neurovis_spec import plugins
from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.grammar import COMMAND, Role, naming
from neurovis_spec.language.located import FormulaField, Located, TextField, TextsField, words
from neurovis_spec.language.model import Keyed, Model, opening
from neurovis_spec.language.yaml.source import Mapping

#: Keys that say nothing of the kind.
_REST = ("substeps", "sensors", "actuators", "reset")


class BodyModel(Model):
    """The body that the network senses and moves."""

    model_config = ConfigDict(extra="allow")

    PLACE: ClassVar[str] = "'body'"

    #: kinds of others, by the names of their entry points
    __pydantic_extra__: dict[str, TextField]

    mujoco: TextField | None = Field(None, description="A model of MuJoCo: a file in MJCF beside the spec.")
    gymnasium: TextField | None = Field(None, description="An environment of Gymnasium, by its id.")
    substeps: FormulaField | None = Field(
        None, description="Steps of the body that are one of the network (default those that make dt)."
    )
    sensors: Annotated[Keyed[Annotated[TextsField, Role("sensor")]], naming("input")] = Field(
        default_factory=dict, description="{input: sensor, or a list of sensors}; one number of several is name[i]."
    )
    actuators: Annotated[Keyed[Annotated[FormulaField, COMMAND]], Role("actuator")] = Field(
        default_factory=dict, description="{actuator: an expression of outputs and parameters}."
    )
    reset: Annotated[Located[str], words("each_episode", "never")] | None = Field(
        None, description="Whether it begins anew where an episode of the run ends (default never)."
    )

    @property
    def kinds(self) -> dict[str, Located[str]]:
        """What is given for each kind of body that is named: a sound section names one."""
        own = {"mujoco": self.mujoco, "gymnasium": self.gymnasium}
        given = {name: value for name, value in own.items() if value is not None}
        return {**given, **(self.__pydantic_extra__ or {})}

    @classmethod
    @cache
    def _fields(cls) -> dict[str, FieldInfo]:
        """The keys, those of kinds that are registered among them."""
        own = super()._fields()
        others = (name for name in plugins.names(plugins.BODIES) if name not in own)
        return {**own, **{name: FieldInfo(annotation=None, default=None) for name in others}}

    @classmethod
    def _kinds(cls) -> tuple[str, ...]:
        """The keys of which a section has one."""
        return tuple(name for name in cls._fields() if name not in _REST)

    @classmethod
    def __get_pydantic_json_schema__(
        cls, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """The schema of the keys, of which one names the kind."""
        result = super().__get_pydantic_json_schema__(schema, handler)
        others = {name: {"type": "string"} for name in cls._kinds() if name not in result["properties"]}
        result["properties"] = {**result["properties"], **others}
        kinds = [{"required": [name]} for name in cls._kinds()]
        return {**result, "additionalProperties": False, "oneOf": kinds}

    @classmethod
    def _check_rules(cls, data: Mapping, unknown: Collection[str], findings: Findings) -> None:
        kinds = cls._kinds()
        given = [entry for entry in data.entries if entry.name in kinds]
        for entry in given[1:]:
            message = f"'{entry.name}' beside '{given[0].name}': a network has one body"
            findings.error("conflicting-keys", entry.key.span, message, f"remove '{entry.name}'")
        if (
            not given
            and not any(kind in unknown for kind in kinds)
            and all(entry.name in _REST for entry in data.entries)
        ):
            message = "which body? its kind is missing"
            findings.error("missing-key", opening(data), message, f"give it one of {', '.join(kinds)}")


class BodyFile(Model):
    """A file with a body, which takes the place of that of a spec."""

    body: BodyModel = Field(description="The body.")
