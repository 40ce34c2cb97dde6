"""The JSON Schema of the language, from its models.

In: the pydantic models. Out: a JSON Schema 2020-12 as plain data, with the descriptions that an editor shows.
"""

from __future__ import annotations

from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

from neurovis_spec.language.model import Model
from neurovis_spec.language.spec import IncludedModel, Spec

DIALECT = "https://json-schema.org/draft/2020-12/schema"


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
