"""Suggestions: the right word first, and none where there are too many to suggest."""

from __future__ import annotations

import pytest

import neurovis_spec as nv
from neurovis_spec.diagnostics import MOST_HINTS
from neurovis_spec.language.allow import allows
from neurovis_spec.likeness import nearest

HEAD = "neurovis: 1\nname: x\n"


@pytest.mark.parametrize(
    ("wrong", "known", "right"),
    [
        ("isn", ["min", "sin"], "sin"),
        ("elak", ["e", "leak"], "leak"),
        ("moto1r", ["motor", "motor1", "motor2"], "motor1"),
        ("e", ["eta", "x"], "eta"),
        ("C3", ["C1", "K1"], "C1"),
    ],
)
def test_the_right_word_comes_first(wrong: str, known: list[str], right: str) -> None:
    assert nearest(wrong, known)[0] == right


def test_of_many_unknown_keys_the_first_are_answered_with_the_known_ones() -> None:
    keys = "".join(f"    bais{number}: 1\n" for number in range(2 * MOST_HINTS))
    with pytest.raises(nv.SpecError) as caught:
        nv.compile_text(HEAD + "neurons:\n  A:\n" + keys)
    hints = [item.hint for item in caught.value.diagnostics]
    assert len(hints) == 2 * MOST_HINTS
    assert None not in hints[:MOST_HINTS]
    assert hints[0] == "did you mean 'bias'?"
    assert set(hints[MOST_HINTS:]) == {None}


def test_of_many_allows_the_first_are_read() -> None:
    assert len(allows("# neurovis: allow " + "x, " * 5000, "f")) == 1000
    assert len(allows("# neurovis: allow x, y\n" * 5000, "f")) == 1000


LEGS = (
    HEAD
    + """
parameters: {drive: 1}
modules: {leg: {parameters: {gain: 1}, inputs: {load: {}}, neurons: {S: {input: load, bias: gain}}}}
instances: {left: {module: leg, count: 2, set: {gain: drive}}, right: {module: leg}}
"""
)


def test_an_input_of_several_instances_is_answered_with_those_of_each() -> None:
    network = nv.compile_text(LEGS)
    with pytest.raises(ValueError, match=r"'left' is several instances, each with its own: 'left1.load', 'left2"):
        network.run(steps=1, inputs={"left.load": 1.0})
    with pytest.raises(ValueError, match=r"did you mean 'right\.load'"):
        network.run(steps=1, inputs={"rihgt.load": 1.0})


def test_a_parameter_of_an_instance_is_set_at_the_instance() -> None:
    with pytest.raises(nv.SpecError) as caught:
        nv.compile_text(LEGS, parameters={"left1.gain": 2})
    (item,) = caught.value.diagnostics
    assert item.code == "unknown-parameter"
    where = "parameters of a module are set at its instance, as in left1: {set: {gain: …}}"
    assert item.hint == f"{where}; parameters of the spec: drive"
