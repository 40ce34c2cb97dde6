"""The JSON Schema of the language, from its models.

In: the pydantic models. Out: a JSON Schema 2020-12 as plain data, with the descriptions that an editor shows.
"""

from __future__ import annotations

from neurovis_spec.language.model import Model
from neurovis_spec.language.spec import IncludedModel, Spec

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def json_schema(included: bool = False) -> dict[str, object]:
    """The schema of a whole spec, or of a file that specs include. Keys that no model knows are refused in it as they
    are by the compiler."""
    model: type[Model] = IncludedModel if included else Spec
    schema: dict[str, object] = model.model_json_schema(by_alias=True)
    closed = {"$schema": DIALECT, **_closed(schema)}
    closed["title"] = "NeuroVis file to be included, version 1" if included else "NeuroVis spec, version 1"
    return closed


def _closed(value: dict[str, object]) -> dict[str, object]:
    """The same schema with every model closed (``additionalProperties: false`` where properties are listed), and with
    no null where a key may be left out: a key without a value is a finding."""
    result: dict[str, object] = {}
    for key, item in value.items():
        if isinstance(item, dict):
            result[key] = _closed(item)
        elif isinstance(item, list):
            result[key] = [_closed(one) if isinstance(one, dict) else one for one in item]
        else:
            result[key] = item
    properties = result.get("properties")
    if isinstance(properties, dict) and value.get("type") == "object":
        result["properties"] = {name: _without_null(one) for name, one in properties.items()}
        result.setdefault("additionalProperties", False)
    return result


def _without_null(field: dict[str, object]) -> dict[str, object]:
    """The schema of an optional field without the ``null`` that pydantic adds; of a single type left, that alone."""
    choices = field.get("anyOf")
    if "default" in field and field["default"] is None:
        field = {key: item for key, item in field.items() if key != "default"}
    if not isinstance(choices, list) or choices[-1] != {"type": "null"}:
        return field
    if len(choices) > 2:
        return {**field, "anyOf": choices[:-1]}
    return {**choices[0], **{key: item for key, item in field.items() if key != "anyOf"}}
