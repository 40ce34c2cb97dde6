"""What is left of YAML (§2): what a finding says and where, all at once; and that reading is linear in the size."""

from __future__ import annotations

import sys
from types import FrameType

import pytest

import neurovis_spec as nv
from neurovis_spec.diagnostics import Diagnostic, Findings
from neurovis_spec.language.yaml.reader import read_text

HEAD = "neurovis: 1\nname: x\n"


def findings(text: str) -> tuple[Diagnostic, ...]:
    with pytest.raises(nv.SpecError) as caught:
        nv.compile_text(HEAD + text)
    return caught.value.diagnostics


def test_all_that_is_refused_is_found_at_once() -> None:
    """One document with a bit of everything."""
    text = "title: !!str a\ndescription: &d b\nlicense: *d\nneurons:\n  A: {bias: .inf, <<: {}}\n  A: {bias: 1e999}\n"
    found = [(item.span.line, item.code) for item in findings(text)]
    assert found == [(3, "tag"), (4, "anchor"), (5, "alias"), (7, "not-finite"), (7, "merge-key"), (8, "duplicate-key"),
                     (8, "number-range")]  # fmt: skip


def test_nan_is_no_number_but_a_text_may_say_it() -> None:
    """``.nan`` is refused where a number is wanted; quoted it is a text like others."""
    network = nv.compile_text(HEAD + "neurons: {A: {label: '.nan', box: '.inf'}}\n")
    assert network.network.neurons.labels == (".nan",)
    assert [item.code for item in findings("neurons: {A: {count: .nan}}\n")] == ["not-finite"]
    assert [item.code for item in findings("layout: {positions: {A: [.inf, 0]}}\nneurons: {A: {}}\n")] == ["not-finite"]


def test_a_name_that_yaml_reads_as_something_else_is_refused_with_that_said() -> None:
    """In the words null, true or false, a number."""
    for name, word in (("null", "null"), ("~", "null"), ("true", "true or false"), ("12", "number"), ("1e3", "number")):
        (found,) = findings(f"neurons: {{{name}: {{}}}}\n")
        assert found.code == "key-not-text"
        assert f"YAML reads '{name}' as" in found.message
        assert word in found.message
    for name, word in (("null", "null"), ("true", "true"), ("3", "number 3")):
        (found,) = findings(f"neurons: {{A: {{names: [a, {name}]}}}}\n")
        assert found.code == "wrong-type"
        assert word in f"{found.message} {found.hint}"


def steps(text: str) -> int:
    """How many calls reading a text takes."""
    count = 0

    def counting(frame: FrameType, event: str, argument: object) -> None:
        nonlocal count
        count += event in ("call", "c_call")

    found = Findings()
    sys.setprofile(counting)
    try:
        read_text(text, "net.yaml", found)
    finally:
        sys.setprofile(None)
    return count


LINEAR = {
    "groups": "  N{0}: {{count: 3, bias: {0}}}\n",
    "edges": "  - [A{0}, B{0}, {0}.5]\n",
    "texts": "  t{0}: 'a text, with commas (and parentheses'\n",
    "flow": "  f{0}: {{a: [1, 2, {{b: {0}}}]}}\n",
    "refused": "  d{0}: !x &y 1\n  d{0}: 2\n",
    "comments": "  # {0}\n  c{0}: 1   # here\n",
    "unclosed": "  u{0}: [1, 2\n",
    "quotes": "  q{0}: ['it''s {0}', \"\\\\ {0}\\n\"]\n",
    "long": "  l{0}: a:b c#d  e, f: g\n      :h #i\n",
}


@pytest.mark.parametrize("kind", LINEAR)
def test_loading_is_linear_in_the_size_of_the_file(kind: str) -> None:
    """Twice the lines take twice the calls, whatever stands on them."""
    short, long = ("a:\n" + "".join(LINEAR[kind].format(i) for i in range(n)) for n in (300, 600))
    assert steps(long) <= 2.1 * steps(short) + 2000
