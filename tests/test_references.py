"""How references are read: text -> tree, with the place of each part."""

from __future__ import annotations

import pytest

import neurovis_spec as nv
from neurovis_spec.language.references import (
    Arrow,
    DottedName,
    NeuronRange,
    NoReference,
    RuleState,
    Sum,
    parse,
    parse_sum,
    state_of,
)
from neurovis_spec.scene.panels import curves_of


def test_a_sum_has_its_parts_and_where_they_stand() -> None:
    found = parse(" K1+left.K3 .. K5  + (K + L -> O).e")
    assert isinstance(found, Sum)
    assert (found.text, found.start) == ("K1+left.K3 .. K5  + (K + L -> O).e", 1)
    one, some, state = found.parts
    assert one == DottedName("K1", 1)
    assert some == NeuronRange("left.K3 .. K5", 4, DottedName("left.K3", 4), DottedName("K5", 15))
    assert isinstance(state, RuleState)
    assert (state.state, state.start) == ("e", 21)
    assert [part.start for part in state.ends.sources.parts] == [22, 26]
    assert state.ends.targets.parts == (DottedName("O", 31),)
    assert found.normal == "K1 + left.K3 .. K5 + (K + L -> O).e"


def test_an_arrow_has_two_ends() -> None:
    found = parse("K1+K3->left.O ")
    assert isinstance(found, Arrow)
    assert (found.normal, found.end) == ("K1 + K3 -> left.O", 13)
    assert found.targets.parts == (DottedName("left.O", 7),)
    (name,) = found.targets.parts
    assert isinstance(name, DottedName)
    assert [(step.text, step.start) for step in name.steps] == [("left", 7), ("O", 12)]


@pytest.mark.parametrize(
    ("text", "code", "start"),
    [
        ("A -> B -> C", "bad-connection", 0),
        ("", "empty-reference", 0),
        ("A + ", "empty-reference", 4),
        ("A + + B", "empty-reference", 4),
    ],
)
def test_what_is_no_reference_says_why_and_where(text: str, code: str, start: int) -> None:
    found = parse(text)
    faults = [part for part in (found.parts if isinstance(found, Sum) else (found,)) if isinstance(part, NoReference)]
    assert [(fault.code, fault.start) for fault in faults] == [(code, start)]
    assert all(fault.message and fault.hint for fault in faults)


@pytest.mark.parametrize(
    ("text", "last", "numbers"),
    [
        ("K3..K5", "K5", ("K", range(3, 6))),
        ("left1.K3..K5", "K5", ("left1.K", range(3, 6))),
        ("left1.K3..left1.K5", "K5", ("left1.K", range(3, 6))),
        ("left.knee.K3..knee.K5", "K5", ("left.knee.K", range(3, 6))),
        ("K03..K5", "K5", None),
        ("K3..L5", "L5", None),
        ("K..", "", None),
    ],
)
def test_the_second_end_of_a_range_may_leave_out_instances(
    text: str, last: str, numbers: tuple[str, range] | None
) -> None:
    (part,) = parse_sum(text)
    assert isinstance(part, NeuronRange)
    assert part.last.text == last
    assert text[part.last.start :] == last
    assert part.numbers == numbers


@pytest.mark.parametrize(
    ("text", "owner", "state"),
    [
        ("K.v", "K", "v"),
        ("left1.K.v", "left1.K", "v"),
        ("K1..K3.v", "K1..K3", "v"),
        ("left1.K1..left1.K3.v", "left1.K1..left1.K3", "v"),
        ("(K -> O).e", "K -> O", "e"),
        ("(K1 -> O (2)).e", "K1 -> O (2)", "e"),
    ],
)
def test_a_state_has_an_owner(text: str, owner: str, state: str) -> None:
    (part,) = parse_sum(text)
    name = state_of(part)
    assert name is not None
    assert (name.owner.text, name.state) == (owner, state)


@pytest.mark.parametrize(
    "text", ["K", "K1..K3", "left1.K1..left1.K3", "left1.K1..K3", ".v", "K.", "A -> B.v", "", "(K).v"]
)
def test_other_references_are_to_no_state(text: str) -> None:
    (part,) = parse_sum(text)
    assert state_of(part) is None


def test_states_of_rules_are_joined_in_views_as_in_outputs() -> None:
    network = nv.compile_text(
        "neurovis: 1\nname: x\nneurons: {A: {}, B: {}, O: {}}\n"
        "connections: {A -> O: {plasticity: bcm}, B -> O: {plasticity: bcm}}\n"
        "outputs: {both: (A -> O).theta + (B -> O).theta}\n"
        "render: {figure: [traces: (A -> O).theta + (B -> O).theta]}\n"
    ).network
    (panel,) = network.render.figure
    assert panel.shown is not None
    assert [(curve.index, curve.state) for curve in panel.shown] == [(0, "theta"), (1, "theta")]
    assert tuple(curves_of(network, "traces", "(A -> O).theta + (B -> O).theta")) == panel.shown
