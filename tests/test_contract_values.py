"""What the language says of YAML, names and positions (§2, §3): accepted, or refused by its own code."""

from __future__ import annotations

import pytest

import neurovis_spec as nv

HEAD = "neurovis: 1\nname: x\n"


def codes(text: str) -> list[str]:
    """The codes of the errors of a spec without its head."""
    try:
        nv.compile_text(HEAD + text)
    except nv.SpecError as error:
        return [found.code for found in error.diagnostics if found.severity == "error"]
    return []


@pytest.mark.parametrize(
    "word", ["010", "0o7", "0x1f", "on", "off", "yes", "no", "190:20:30", "2001-01-01", "Yes", "NO"]
)
def test_words_that_stay_texts(word: str) -> None:
    """What YAML 1.1 takes for numbers, truth values and dates is a text."""
    assert codes(f"neurons: {{A: {{label: {word}, bias: 1}}}}\n") == []


def test_an_exponent_alone_makes_a_number() -> None:
    """``1e5`` is a number."""
    assert nv.compile_text(HEAD + "neurons: {A: {bias: 1e5}}\n").network.neurons.bias.tolist() == [1e5]
    assert codes("title: 1e5\nneurons: {A: {bias: 1}}\n") == ["wrong-type"]


def test_a_byte_order_mark_counts_as_no_column() -> None:
    """It is accepted, and columns count code points, also beyond the basic plane."""
    text = "\ufeffneurovis: 1\nname: x\nneurons: {A: {label: '\U0001f600\U0001f600', bia: 1}}\n"
    with pytest.raises(nv.SpecError) as caught:
        nv.compile_text(text)
    found = caught.value.diagnostics[0]
    assert (found.code, found.span.line, found.span.column) == ("unknown-key", 3, 28)


def test_the_limits_of_integers_are_numbers() -> None:
    """Signed 64 bits, both ends included."""
    assert codes("neurons: {A: {bias: -9223372036854775808}, B: {bias: 9223372036854775807}}\n") == []


NEURONS = [
    ("{" + "a" * 65 + ": {}}", ["bad-name"]),
    ("{" + "a" * 64 + ": {}}", []),
    ("{n: {}, y: {}, e: {}, pi: {}, t: {}, sin: {}}", []),
]


@pytest.mark.parametrize(("neurons", "wanted"), NEURONS)
def test_names(neurons: str, wanted: list[str]) -> None:
    """A name has 64 characters at most, and may be one that YAML 1.1 or an expression reads as something else."""
    assert codes(f"neurons: {neurons}\n") == wanted


def test_reserved_names_of_parameters() -> None:
    """Functions bar no names, the given names do."""
    names = ["t", "k", "dt", "i", "j", "n", "pi", "e"]
    listed = ", ".join(f"{name}: 1" for name in names)
    assert codes(f"neurons: {{A: {{}}}}\nparameters: {{{listed}}}\n") == ["reserved-name"] * len(names)
    assert codes("neurons: {A: {bias: sin(sin)}}\nparameters: {sin: 2}\n") == []


def test_positions_may_be_expressions_over_the_index() -> None:
    """Any number in a group may use ``i`` and ``n``; one ``[x, y]`` with expressions does for the whole group."""
    ring = "A: {count: 4, bias: 1, position: [cos(2*pi*i/n), g*i]}"
    text = f"parameters: {{g: 2}}\nneurons: {{{ring}, B: {{count: 2, bias: 1, position: [[i, n], [n, i]]}}}}\n"
    places = nv.compile_text(HEAD + text).network.neurons.position
    assert places[:4].ravel() == pytest.approx([1, 0, 0, 2, -1, 4, 0, 6], abs=1e-15)
    assert places[4:].tolist() == [[0, 2], [2, 1]]
    assert codes("neurons: {A: {count: 3, bias: 1, position: [1, 2]}}\n") == ["wrong-size"]
    assert codes("neurons: {A: {count: 3, bias: 1, position: [i, z]}}\n") == ["unknown-name"]
    assert codes("neurons: {A: {count: 3, bias: 1, position: [1/i, 0]}}\n") == ["not-finite"]
