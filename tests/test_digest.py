"""The content hash: a schema says what of each record is content, so that no hash moves by accident."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import pytest
from networks_by_hand import cpg_rbf

from neurovis_spec.compiler.canonical import SCHEMA, content_hash
from neurovis_spec.compiler.digest import TREES, Content, content, digest
from neurovis_spec.compiler.network import Neurons
from neurovis_spec.language.expressions.parser import parse


@dataclass(frozen=True, slots=True)
class Old:
    name: str
    start: int = 0


@dataclass(frozen=True, slots=True)
class New:
    """The same under another name, with a field more and one that is called otherwise."""

    extra: float
    called: str


def test_a_field_more_and_another_name_change_no_hash() -> None:
    schema = {Old: content("Old", "name"), New: Content("Old", {"name": "called"})}
    assert digest(New(0.5, "x"), schema=schema) == digest(Old("x"), schema=schema)
    assert digest(New(0.5, "y"), schema=schema) != digest(Old("x"), schema=schema)


def test_a_field_more_of_a_network_changes_no_hash() -> None:
    @dataclass(frozen=True, slots=True, eq=False)
    class Wider(Neurons):
        colour: str = "red"

    network = cpg_rbf()
    own = {field.name: getattr(network.neurons, field.name) for field in fields(Neurons)}
    schema = {**SCHEMA, Wider: SCHEMA[Neurons]}
    assert digest(Wider(**own), schema=schema) == digest(network.neurons, schema=schema)
    with pytest.raises(TypeError, match="no schema says what of a Wider is content"):
        content_hash(replace(network, neurons=Wider(**own)))


@pytest.mark.parametrize("kind", SCHEMA, ids=lambda kind: kind.__name__)
def test_each_field_is_content_or_is_said_to_be_none(kind: type) -> None:
    said = SCHEMA[kind]
    assert {field.name for field in fields(kind)} == {*said.fields.values(), *said.beside}


def test_what_no_schema_knows_is_an_error() -> None:
    with pytest.raises(TypeError, match="no schema says what of a Old is content"):
        digest([Old("x")])
    assert digest(parse("x + 1"), schema=TREES) == digest(parse("  x+1"), schema=TREES)
