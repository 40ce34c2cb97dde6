"""Values put into a spec: they stand where their keys lead, and every comment stays with what it was about."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import yaml

import neurovis_spec as nv
from neurovis_spec.language.format.canonical import format_read
from neurovis_spec.language.format.edit import put

SPECS = Path(__file__).parents[1] / "specs"
PIN, OTHER = ("layout", "positions", "O"), ("layout", "positions", "Q")


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("a: 1\n", "a: 1\nlayout:\n  positions:\n    O: [5, 0.5]\n"),
        (
            "a: 1  # a\n\nb: 2  # b\n# end\n",
            "a: 1  # a\n\nb: 2  # b\n\nlayout:\n  positions:\n    O: [5, 0.5]\n# end\n",
        ),
        ("layout: {b: 1}  # why\n", "layout:  # why\n  b: 1\n  positions:\n    O: [5, 0.5]\n"),
        ("layout: # c\n  {b: 1}  # d\n", "layout:  # c\n  # d\n  b: 1\n  positions:\n    O: [5, 0.5]\n"),
        ("layout:  # none yet\nx: 1\n", "layout:  # none yet\n  positions:\n    O: [5, 0.5]\nx: 1\n"),
        (
            "layout:\n  b: 2  # why\n  # of the layout\nx: 1  # x\n",
            "layout:\n  b: 2  # why\n  positions:\n    O: [5, 0.5]\n  # of the layout\nx: 1  # x\n",
        ),
        (
            "layout:\n  positions:\n    # of A\n    A: [1, 2]  # A\n\n# of x\nx: 1\n",
            "layout:\n  positions:\n    # of A\n    A: [1, 2]  # A\n    O: [5, 0.5]\n\n# of x\nx: 1\n",
        ),
        (
            "layout: {positions: {A: [1, 2], # one\n   B: [2, 3]}} # two\n",
            "layout: {positions: {A: [1, 2],  # one\n                     B: [2, 3],\n"
            "                     O: [5, 0.5]}}  # two\n",
        ),
        ("layout: {positions: {'O': [1, 2]}}\n", "layout:\n  positions:\n    'O': [5, 0.5]\n"),
        (
            "layout:\n  positions:\n    O: [1, # across\n        2]\n",
            "layout:\n  positions:\n    O: [5,  # across\n        0.5]\n",
        ),
        (
            "layout:\n  positions:\n    O: # why\n    - 1 # across\n    - 2\n",
            "layout:\n  positions:\n    O:  # why\n      - 5  # across\n      - 0.5\n",
        ),
        ("{a: 1}\n", "{a: 1, layout: {positions: {O: [5, 0.5]}}}\n"),
        ("---\r\na: 1", "---\na: 1\nlayout:\n  positions:\n    O: [5, 0.5]\n"),
    ],
)
def test_a_value_is_put_where_its_keys_lead(before: str, after: str) -> None:
    written = put(before, {PIN: ("5", "0.5")})
    assert written == after
    assert yaml.safe_load(written)["layout"]["positions"]["O"] == [5, 0.5]
    assert format_read(written) == written


def test_several_values_are_put_in_their_order() -> None:
    text = put("a: 1\n", {PIN: ("1", "2"), OTHER: ("3", "4"), ("layout", "file"): "x.layout.yaml"})
    assert text == "a: 1\nlayout:\n  positions:\n    O: [1, 2]\n    Q: [3, 4]\n  file: x.layout.yaml\n"


@pytest.mark.parametrize("spec", sorted(SPECS.rglob("*.yaml")), ids=lambda path: path.name)
def test_no_comment_of_an_example_is_lost(spec: Path) -> None:
    text = spec.read_text()
    written = put(text, {PIN: ("5", "0.5")})
    assert re.findall("#.*", written) == re.findall("#.*", text)
    before, after = yaml.safe_load(text), yaml.safe_load(written)
    layout = before.pop("layout", None) or {}
    assert after.pop("layout") == layout | {"positions": layout.get("positions", {}) | {"O": [5, 0.5]}}
    assert after == before


def test_a_pin_put_into_a_spec_is_its_pin() -> None:
    text = (SPECS / "mlp.yaml").read_text()
    compiled = nv.compile_text(put(text, {PIN: ("5", "0.5")}), folder=SPECS)
    assert compiled.hash == nv.compile(SPECS / "mlp.yaml").hash
    assert compiled.layout().positions["O"] == (5, 0.5)
