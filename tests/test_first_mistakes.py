"""What those get wrong who write their first specs: each mistake is one finding, which says what to do."""

from __future__ import annotations

import unicodedata

import pytest

import neurovis_spec as nv
from neurovis_spec.diagnostics import Diagnostic

HEAD = "neurovis: 1\nname: x\n"
AB = "neurons: {A: {}, B: {}}\n"
TWO = "neurons: {A: {count: 2}}\n"


def findings(text: str) -> tuple[Diagnostic, ...]:
    """What is said of a text; a head is put before one that has none."""
    try:
        return nv.compile_text(text if text.startswith("neurovis") else HEAD + text).warnings
    except nv.SpecError as error:
        return error.diagnostics


def hold(text: str, place: str, *words: str) -> None:
    """There is one finding, at this place, which says these words."""
    found = findings(text)
    assert [f"{item.span.line}:{item.span.column}" for item in found] == [place], found
    for word in words:
        assert word in f"{found[0].message} | {found[0].hint or ''}"


@pytest.mark.parametrize(
    ("text", "place", "words"),
    [
        ("neurons:\n  A {bias: 1}\n", "4:3", "':' is missing after 'A' | write A: {bias: 1}"),
        ("neurons:\n  A {bias:1}\n", "4:3", "':' is missing after 'A'"),
        ("neurons:\n  A:{bias: 1}\n", "4:3", "a blank is missing after 'A:' | write A: {bias: 1}"),
        ("neurons:\n  A: {bias:1}\n", "4:7", "a blank is missing after 'bias:': write bias: 1"),
        ("neurons:\n  A: {bias 1}\n", "4:7", "':' is missing after 'bias': write bias: 1"),
        ("neurons:\n  A: {bias: 1, count 2}\n", "4:16", "':' is missing after 'count': write count: 2"),
        ("neurons:\n  A: {count 2, bias: 1}\n", "4:7", "':' is missing after 'count'"),
        ("neurons: {A {bias: 1}, B: {}}\n", "3:11", "':' is missing after 'A' | write A: {…}"),
        ("neurons: {A: {bias: 1}, B {}}\n", "3:25", "':' is missing after 'B'"),
        ("neurons {A: {bias: 1}}\n", "3:1", "':' is missing after 'neurons'"),
        ("neurons:\n  A\n    bias: 1\n", "4:3", "':' is missing after 'A'"),
        (AB + "connections:\n  A -> B {weight: 1}\n", "5:3", "':' is missing after 'A -> B'"),
        (AB + "connections:\n  A -> B 1\n", "5:3", "':' is missing after 'A -> B': write A -> B: 1"),
        (AB + "connections:\n  A -> B [1]\n", "5:3", "':' is missing after 'A -> B'"),
        (AB + "connections: {A -> B [[1]]}\n", "4:15", "':' is missing after 'A -> B'"),
        (AB + "connections:\n  A -> B:\n    weight 2\n", "6:5", "':' is missing after 'weight': write weight: 2"),
        (TWO + "connections:\n  A -> A:\n    matrix\n      - [1, 2]\n", "6:5", "':' is missing after 'matrix'"),
        (TWO + "connections:\n  A -> A:\n    matrix [[1, 2], [1, 2]]\n", "6:5", "':' is missing after 'matrix'"),
        (TWO + "connections:\n  A -> A: {matrix [[1, 2], [1, 2]]}\n", "5:12", "':' is missing after 'matrix'"),
        (AB + "time {dt: 0.1}\n", "4:1", "':' is missing after 'time' | write time: {dt: 0.1}"),
        ("neurons:\n  A:\n    count 2\n    bias: 1\n", "5:5", "':' is missing after 'count' | write count: 2"),
        ("neurons:\n  A:\n    bias:1\n", "5:5", "a blank is missing after 'bias:': write bias: 1"),
        ("neurons:\n  A: bias: 1\n", "4:10", "a second ':' in one line | keys below a key stand in braces"),
        ("neurons:\n  A: {activation {gaussian: {sigma: 4}}}\n", "4:7", "':' is missing after 'activation'"),
        ("neurons:\n  A: {activation: gaussian {sigma: 4}}\n", "4:28", "is written {gaussian: {…}}"),
        ("neurons:\n  A: {activation: {gaussian: sigma: 4}}\n", "4:35", "a second ':'"),
        ("neurons:\n  A:\n    activation tanh\n", "5:5", "write activation: tanh"),
        ("neurons:\n  A:\n    names\n      - a\n      - b\n", "5:5", "':' is missing after 'names'"),
        ("neurons:\n  A: {names [a, b]}\n", "4:7", "':' is missing after 'names' | write names: […]"),
        (AB + "outputs: {y A}\n", "4:11", "':' is missing after 'y': write y: A"),
        (AB + "parameters:\n  a = 1\n", "5:3", "write a: 1"),
        (AB + "events:\n  - {at 5, clamp: {A: 1}}\n", "5:6", "':' is missing after 'at': write at: 5"),
        ("neurovis 1\nname: x\nneurons: {A: {}}\n", "1:1", "write neurovis: 1"),
    ],
)
def test_a_colon_that_is_missing(text: str, place: str, words: str) -> None:
    hold(text, place, words)


LOOKALIKES = {"\u0410": "A", "\u0391": "A", "\uff21": "A"}
UNSEEN = ("\u200b", "\u00a0", "\u2060", "\u3000", "\u00ad")


@pytest.mark.parametrize("character", [*LOOKALIKES, *UNSEEN])
def test_a_character_that_looks_like_another_is_named(character: str) -> None:
    """As a name, a reference, a key, a word, in an expression."""
    name = f"U+{ord(character):04X} ({unicodedata.name(character).lower()})"
    seen = f"{LOOKALIKES[character]}" if character in LOOKALIKES else f"{character}A"
    wrong = character if character in LOOKALIKES else seen
    for text, place in (
        (f"neurons: {{{wrong}: {{}}}}\nconnections: {{A -> A: 1}}\n", "3:11"),
        (f"{AB}connections: {{{wrong} -> B: 1}}\n", "4:15"),
        (f"{AB}outputs: {{y: B + {wrong}}}\n", "4:18"),
        (f"neurons: {{A: {{bias: 2*{wrong}}}}}\nparameters: {{A: 1}}\n", "3:23"),
        (f"{AB}parameters: {{{wrong}: 1, b: 2 * A}}\n", "4:14"),
    ):
        if (
            place not in ("4:15", "4:18") or unicodedata.category(character) != "Zs"
        ):  # blanks of all kinds part references
            hold(text, place, name)


def test_words_and_keys_that_look_right_are_told_apart() -> None:
    hold("neurons: {A: {b\u0456as: 1}}\n", "3:15", "did you mean 'bias'?", "U+0456")
    hold("neurons: {A: {activation: t\u0430nh}}\n", "3:27", "did you mean 'tanh'?", "U+0430 (cyrillic small letter a)")
    hold("neurons: {A: {combine: \u0455um}}\n", "3:24", "did you mean 'sum'?", "U+0455")
    hold(AB + "connections: {A \u2192 B: 1}\n", "4:15", "U+2192 (rightwards arrow), not '->'")
    hold("neurons: {A: {bias\uff1a 1}}\n", "3:15", "U+FF1A (fullwidth colon), not ':'")
    hold("neurons: {A: {bias: 1\uff0c count: 2}}\n", "3:29", "U+FF0C (fullwidth comma), not ','")
    hold("neurons: {M\u00fcller: {}}\n", "3:11", "U+00FC (latin small letter u with diaeresis)")


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("neurons:\n  A{0} {{bias: 1}}\n", "4:3"),
        ("neurons:\n  A{0} {{bias: 1}}\n  B: {{}}\n", "4:3"),
        ("neurons:\n  A{0}\n    bias: 1\n", "4:3"),
        ("neurons:\n  A:\n    bias{0} 1\n", "5:5"),
        ("neurons:\n  A:\n    bias{0} 1\n    count: 2\n", "5:5"),
        ("neurons: {{A: {{bias{0} 1}}}}\n", "3:15"),
        ("neurons{0} {{A: {{}}}}\n", "3:1"),
        ("neurons{0} {{A: {{bias: 1, count: 2, activation: tanh}}, B: {{bias: 3, count: 8}}}}\n", "3:1"),
        ("neurons{0}\n  A: {{bias: 1}}\n", "3:1"),
    ],
)
def test_what_stands_behind_a_key_is_one_finding(text: str, place: str) -> None:
    """A colon of another kind, and behind a colon a blank of another kind."""
    hold(text.format("\uff1a"), place, "stands U+FF1A (fullwidth colon), not ':'")
    hold(text.replace("{0} ", "{0}").format(":\u00a0"), place, "stands U+00A0 (no-break space), which is no blank")


def test_keys_on_lines_below_each_other_are_each_told_of() -> None:
    found = findings("neurons:\n  A: {bias\uff1a 1}\n  B: {bias\uff1a 2}\n  C: {bias:\u00a02}\n")
    assert [(item.span.line, item.span.column) for item in found] == [(4, 7), (5, 7), (6, 7)]
    assert all("behind 'bias" in item.message for item in found)


def test_what_looks_like_a_key_in_a_text_is_not_blamed() -> None:
    hold("description: |\n  note\uff1a this\nneurons: {A: {bais: 1}}\n", "5:15", "did you mean 'bias'?")
    hold("description: |\n  note\uff1a this\nneurons {A: {bias: 1}}\n", "5:1", "':' is missing after 'neurons'")


@pytest.mark.parametrize("character", ["\u00a0", "\u3000", "\u2003", "\u200b"])
def test_indentation_that_is_no_blank_is_named(character: str) -> None:
    name = f"the line begins with U+{ord(character):04X} ({unicodedata.name(character).lower()})"
    hold(f"neurons:\n{character}{character}A: {{}}\n", "4:1", name, "indent with ordinary blanks")
    hold(f"neurons:\n  A: {{}}\n{character}{character}B: {{}}\nconnections: {{A -> B: 1}}\n", "5:1", name)
    hold(f"neurons:\n  A:\n    bias: 1\n{character * 4}count: 2\n", "6:1", name)


@pytest.mark.parametrize(
    ("text", "place", "words"),
    [
        ("time: {steps: 10,000}\n", "3:15", "'10,000' is not one number | write 10000"),
        ("time: {steps: 1,000,000}\n", "3:15", "write 1000000"),
        ("models: {m: {description: 10,000, activity: drive}}\n", "3:27", "write 10000"),
        ("time:\n  steps: 10,000\n", "4:10", "nothing stands between thousands | write 10000"),
        ("time:\n  steps: 1,000,000\n", "4:10", "write 1000000"),
        ("time:\n  steps: 10_000\n", "4:10", "write 10000"),
        ("time:\n  steps: 10 000\n", "4:10", "write 10000"),
        ("time:\n  steps: 1.000.000\n", "4:10", "write 1000000"),
        ("time:\n  steps: 10'000\n", "4:10", "write 10000"),
        ("time:\n  steps: 10\u00a0000\n", "4:10", "write 10000"),
        ("seed: 1,000\n", "3:7", "'1,000' is no number: nothing stands between thousands | write 1000"),
        ("parameters: {a: 'max(10,000)'}\n", "3:25", "if 10,000 is one number, write 10000: nothing stands between"),
        ("parameters:\n  a: max(1,000,000, 2)\n", "4:12", "if 1,000 is one number, write 1000"),
        (
            "inputs: {g: {values: [[1,000,0]]}}\n",
            "3:26",
            "a comma before it that sets thousands apart is to be left out",
        ),
        ("parameters: {a: “1”}\n", "3:17", "'“' is U+201C (left double quotation mark)"),
        ("parameters: {a: ‘1.5’}\n", "3:17", "leave the quotes out: write 1.5"),
        ("seed: 1,234\n", "3:7", "write 1234; if the comma is a decimal one, 1.234"),
        ("parameters: {a: 0,5}\n", "3:17", "numbers have a decimal point: 0.5"),
        ("parameters: {a: 2 * 1_000}\n", "3:21", "write 1000"),
        ("time: {dt: 0.1 msec}\n", "3:12", "'msec' is no unit of time | write ms"),
        (
            "time: {dt: 0.1ms}\n",
            "3:12",
            "'0.1ms' is no number: it has a unit | a blank stands before a unit: write 0.1 ms",
        ),
        ("time: {dt: 0.1*ms}\n", "3:16", "write 0.0001 where seconds are wanted"),
        ("time: {dt: 20 \u00b5s}\n", "3:12", "is no unit of time | write us"),
        ("time: {steps: 1 hour}\n", "3:15", "'steps' counts steps: write 3600/dt"),
        ("parameters: {tau: 20 ms}\n", "3:19", "0.02/dt where steps are, 20 in a model with time: ms"),
        ("events: [{at: 5 ms, lesion: A}]\n", "3:15", "a whole number of steps, this is 0.005 | a step is 1 s long"),
        (
            "events: [{from: 1, to: 1 h, clamp: {A: 1}}]\n",
            "3:24",
            "'h' is no unit of time | units of time: s, ms, us, min",
        ),
        ("connections: {A -> A: {weight: 1, delay: 5 mV}}\n", "3:42", "'mV' is no unit of time"),
        ("connections: {A -> A: {weight: 2 s}}\n", "3:32", "numbers have no units: write 2"),
        ("parameters: {a: 1e400 s}\n", "3:17", "numbers have no units, and end near 1.8e308"),
        ("parameters: {a: 1e400 mV}\n", "3:17", "numbers have no units, and end near 1.8e308"),
        ("parameters: {tau: 10*ms}\n", "3:22", "write 0.01 where seconds are wanted, 0.01/dt where steps are"),
        ("parameters: {a: -65 mV}\n", "3:17", "it has a unit | numbers have no units: write -65"),
        ("parameters: {a: -65*mV}\n", "3:21", "numbers have no units: write -65"),
        ("parameters: {a: 2 + 5 nS}\n", "3:23", "a unit, 'nS', stands behind the number 5"),
        ("parameters: {a: 1e999999999 s}\n", "3:17", "it has a unit"),
        ("parameters: {a: 50%}\n", "3:17", "write 0.5"),
        ("parameters: {a: 90 deg}\n", "3:17", "angles are in radians: write 90*pi/180"),
        ("parameters: {a: 90\u00b0}\n", "3:17", "angles are in radians: write 90*pi/180"),
    ],
)
def test_numbers_as_they_are_written_elsewhere(text: str, place: str, words: str) -> None:
    hold(text + "neurons: {A: {bias: 1}}\n", place, words)


def test_what_looks_like_a_unit_may_be_a_name() -> None:
    text = "parameters: {ms: 0.001, tau: 10*ms, s: 2}\nneurons: {A: {bias: tau*s}}\n"
    assert not findings(text)
    assert not findings("neurons: {A: {bias: 10.000}}\n")


G = "inputs: {g: {values: [[1]]}}\n"
STATE = "models: {m: {state: {v: {initial: 0, each_step: v + drive}}, activity: f(v)}}\n"


@pytest.mark.parametrize(
    ("text", "place", "words"),
    [
        (G + AB + "connections: {A -> B: g}\n", "5:23", "'g' is an input"),
        (G + AB + "connections: {A -> B: {weight: 2*g}}\n", "5:34", "(combine: product), or a rule"),
        (G + "neurons: {A: {bias: g}}\n", "4:21", "neurons take in with input: g"),
        ("neurons: {A: {bias: 1}, B: {bias: A}}\n", "3:35", "what 'A' does arrives by a connection"),
        (
            STATE + "neurons: {A: {model: m}, B: {}}\nconnections: {A.v -> B: 1}\n",
            "5:15",
            "write 'A', and at a connection that takes v of it send: v",
        ),
        (
            STATE + "neurons: {A: {model: m}, B: {}}\nconnections: {B.v -> A: 1}\n",
            "5:15",
            "'B' is no instance, nothing",
        ),
        (STATE + "neurons: {A: {model: m}, B: {input: A.v}}\n", "4:37", "an input is declared under 'inputs'"),
        (
            "neurons: {A: {input: 1}}\n",
            "3:22",
            "the name of an input, found the number 1 | what is added at every step",
        ),
        ("neurons: {A: {input: [1, 2]}}\n", "3:22", "declare it under 'inputs', and name it here"),
        ("neurons: {A: {input: {expression: sin(t)}}}\n", "3:22", "declare it under 'inputs', and name it here"),
        ("inputs: {g: 1}\nneurons: {A: {input: g}}\n", "3:13", "write {expression: 1}"),
        ("inputs: {g: sin(t)}\nneurons: {A: {input: g}}\n", "3:13", "write {expression: sin(t)}"),
        ("inputs: {g: [1, 2]}\nneurons: {A: {input: g}}\n", "3:13", "write {values: …}, one row a step"),
        ("neurovis: 1\nname: NULL\n" + AB, "2:7", "found null | YAML reads this as null: put it in quotes"),
        ("neurovis: 1\nname: true\n" + AB, "2:7", "YAML reads this as true or false: put it in quotes"),
        ("neurovis: 1\nname: 3\n" + AB, "2:7", "expected a name, found the number 3 | a name is a letter"),
        ("neurons: {NULL: {bias: 1}}\n", "3:11", "YAML reads 'NULL' as null | take another name, or put it in quotes"),
        ("neurons: {A: {bias: 1, box: NULL}}\n", "3:24", "'box' has no value: YAML reads this as null"),
        ("neurons: {A: {names: [a, Null]}}\n", "3:26", "found null | YAML reads this as null"),
        (AB + "outputs: {y: ~}\n", "4:14", "found null | YAML reads this as null"),
    ],
)
def test_what_is_meant_by_it_is_said(text: str, place: str, words: str) -> None:
    hold(text, place, words)


@pytest.mark.parametrize(
    ("text", "place", "words"),
    [
        ("neurons: {A: 3}\n", "3:14", "write {count: 3} for so many neurons, {bias: 3} for a bias"),
        ("neurons: {A: tanh}\n", "3:14", "write {activation: tanh}"),
        ("groups: {A: {bias: 1}}\n", "3:1", "did you mean 'neurons'?"),
        ("neurons: {A: {n: 3}}\n", "3:15", "did you mean 'count'?"),
        ("neurons: {left leg: {}}\n", "3:11", "did you mean 'left_leg'?"),
        ("neurons: {A: {activation: logistic}}\n", "3:27", "did you mean 'sigmoid'?"),
        ("neurons: {A: {model: LIF}}\n", "3:22", "did you mean 'integrate_and_fire'?"),
        ("neurons: {A: {activation: [tanh, relu]}}\n", "3:27", "give each its own group"),
        ("neurons: {A: {activation: {name: gaussian, sigma: 4}}}\n", "3:44", "write {gaussian: {sigma: …}}"),
        ("neurons: {A: {activation: {gaussian: 4}}}\n", "3:38", "write {gaussian: {SETTING: 4}}"),
        ("neurons: {A: {initial: random}}\n", "3:24", "did you mean 'uniform(low, high)'?"),
        ("neurons:\n  A: {bias: 1}  // one\n", "4:17", "a comment begins with '#'"),
        ("// one\nneurons: {A: {bias: 1}}\n", "3:1", "a comment begins with '#'"),
        (AB + "connections: {A: B}\n", "4:15", "write A -> B: WEIGHT"),
        (AB + "connections: [A -> B]\n", "4:15", "write A -> B: WEIGHT"),
        (AB + "connections: [[A, B, 0.5]]\n", "4:15", "write A -> B: 0.5"),
        (AB + "connections: {A => B: 1}\n", "4:15", "write A -> B"),
        (AB + "connections: {A to B: 1}\n", "4:15", "write A -> B"),
        (AB + "connections: {A - > B: 1}\n", "4:15", "write A -> B"),
        (AB + "connections: {A --> B: 1}\n", "4:15", "'A --> B' is no connection | write A -> B"),
        (AB + "connections: {A ->> B: 1}\n", "4:15", "'A ->> B' is no connection | write A -> B"),
        (AB + "connections: {A —> B: 1}\n", "4:15", "write A -> B; '—' is U+2014 (em dash), not '-'"),
        (AB + "connections: {A <- B: 1}\n", "4:15", "write B -> A"),
        (AB + "connections: {A -> [A, B]: 1}\n", "4:20", "joined with '+', as in A -> B + C"),
        (AB + "connections: {A[1] -> B: 1}\n", "4:16", "has its number behind it, as in A1"),
        (TWO + "connections: {A1-A2 -> A: 1}\n", "4:15", "a range is written A1..A2"),
        (TWO + "connections: {A -> A: {pattern: full}}\n", "4:33", "did you mean 'all_to_all'?"),
        (AB + "connections: {A -> B: weights.csv}\n", "4:23", "write {matrix: {file: weights.csv}}"),
        (AB + "connections: {A -> B: {plasticity: hebbian, rate: 1}}\n", "4:45", "plasticity: {RULE: {rate: …}}"),
        (AB + "outputs: {y: 2*A}\n", "4:14", "a name is wanted here"),
        (AB + "time: 100\n", "4:7", "write {steps: 100}"),
        (AB + "time: {duration: 10}\n", "4:8", "steps: SECONDS/dt"),
        (AB + "layout: layered\n", "4:9", "write {engine: layered}"),
        (AB + "render: dark\n", "4:9", "write {theme: dark}"),
        ("modules: {leg: {neurons: {K: {}}}}\ninstances: {left: leg}\n", "4:19", "write {module: leg}"),
        ("activations: {f: tanh(x)}\n" + AB, "3:18", "write {value: tanh(x)}"),
        (AB + "events: [{at: 5, kill: A}]\n", "4:18", "did you mean 'lesion'?"),
        (AB + "events: [{at: 5, set: {A: 1}}]\n", "4:24", "neurons are clamped, with clamp: {A: …}"),
        (G + AB + "events: [{at: 5, set: {g: 1}}]\n", "5:24", "let its expression use a parameter"),
        (
            "modules: {leg: {neurons: {K: {}}}}\ninstances: {left: {module: leg}}\noutputs: {y: left/K}\n",
            "5:14",
            "parts of instances are named with points: left.K",
        ),
        (AB + "parameters: {a: {default: 1}}\n", "4:18", "did you mean 'value'?"),
    ],
)
def test_habits_from_elsewhere(text: str, place: str, words: str) -> None:
    hold(text, place, words)
