"""Definitions of message types, also those that somebody has made up to do harm: each type in them is resolved once."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import suppress
from types import FrameType

import pytest

from neurovis_spec.ros.convert import ConversionError, Converter
from neurovis_spec.ros.definitions import SEPARATOR, Definition, Field, length_of, md5sum
from neurovis_spec.ros.fields import numbers_at
from neurovis_spec.runtime.wire import WireError


def text_of(*types: str) -> str:
    """The text of a type, and of others in it, as ``NAME: fields``."""
    first, *others = types
    return "\n".join([first, *(f"{SEPARATOR}\nMSG: a/{one.replace(': ', chr(10), 1)}" for one in others)])


def doubling(levels: int) -> str:
    """A type that has two of the next, and so on: 2 ** levels values."""
    inner = [f"A{k}: A{k + 1} x\nA{k + 1} y" for k in range(1, levels)]
    return text_of("A1 x\nA1 y", *inner, f"A{levels}: float64 x")


def calls(work: Callable[[], object]) -> int:
    """How many functions of Python are called."""
    count = 0

    def note(frame: FrameType, event: str, argument: object) -> None:
        nonlocal count
        count += event == "call"

    sys.setprofile(note)
    try:
        with suppress(WireError, ConversionError):
            work()
    finally:
        sys.setprofile(None)
    return count


@pytest.mark.parametrize(
    "work",
    [
        lambda text: Definition.parse("a/A", text).least,
        lambda text: md5sum("a/A", text),
        lambda text: Converter("a/A", text, "ros1", text),
    ],
)
def test_a_definition_that_doubles_is_resolved_in_steps_not_in_doublings(work: Callable[[str], object]) -> None:
    few, many = (calls(lambda levels=levels: work(doubling(levels))) for levels in (4, 11))  # type: ignore[misc]
    assert many < 4 * few


def test_a_definition_of_more_fields_than_a_message_has_is_refused() -> None:
    with pytest.raises(WireError, match="a/A has too many fields"):
        Definition.parse("a/A", doubling(30))
    with pytest.raises(WireError, match="refers to itself"):
        Definition.parse("a/A", doubling(33))
    chain = text_of("A0 x", *(f"A{k}: A{k + 1} x" for k in range(5000)), "A5000: float64 x")
    with pytest.raises(WireError, match="refers to itself"):
        Definition.parse("a/A", chain)
    assert md5sum("a/A", chain) == "*"


def test_types_that_nobody_refers_to_are_not_resolved() -> None:
    text = text_of("float64 x", "Loop: Loop again", "Open: b/Unknown what")
    definition = Definition.parse("a/A", text)
    assert definition.types == {"a/A": (Field("x", "float64"),)}
    assert definition.least["a/A"] == 8


def test_a_length_of_too_many_digits_is_refused() -> None:
    assert length_of("[999999999]") == 999_999_999
    for digits in (10, 5000):
        with pytest.raises(WireError, match=f"{digits} digits"):
            Definition.parse("a/A", f"float64[{'9' * digits}] x")
        with pytest.raises(ConversionError):
            Converter("a/A", f"float64[{'9' * digits}] x", "ros1")


def test_an_empty_message_within_another_has_its_byte_in_ros_2() -> None:
    text = text_of("Around around\nuint8 x", "Around: Nothing nothing", "Nothing: ")
    read = numbers_at(Definition.parse("a/A", text), "x", "cdr")
    assert list(read(b"\0\1\0\0\0\7")) == [7]
    assert Converter("a/A", text, "cdr").convert(b"\0\1\0\0\0\7") == b"\7"


def test_lists_of_nothing_within_each_other_are_refused() -> None:
    text = text_of("B[60] b", "B: C[60] c", "C: D[60] d", "D: ")
    with pytest.raises(WireError, match="more values than bytes"):
        Converter("a/A", text, "ros1").convert(bytes(60))
