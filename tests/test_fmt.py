"""Formatting: golden pairs, and the laws: twice changes nothing more, values and hash stay, no comment is lost."""

from __future__ import annotations

import random
import re
import stat
import subprocess
from collections import Counter
from pathlib import Path
from typing import TypeAlias, cast

import pytest
import yaml
from click.testing import CliRunner, Result
from hypothesis import given, settings
from hypothesis import strategies as st
from laws import examples
from random_specs import Plain, Spec, section, specs

import neurovis_spec as nv
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.diagnostics import Findings
from neurovis_spec.differences import difference
from neurovis_spec.language.format.canonical import FormattingError, format_read, format_text
from neurovis_spec.language.format.printer import normal
from neurovis_spec.language.yaml.reader import read_text
from neurovis_spec.language.yaml.source import Mapping, Node, Scalar

ROOT = Path(__file__).parents[1]
CANONICAL = sorted(
    [
        *(ROOT / "specs").glob("**/*.yaml"),
        *(ROOT / "neurovis_spec" / "library").glob("*.yaml"),
        ROOT / "neurovis_spec" / "cli" / "starter.yaml",
    ]
)
DEFECTIVE = sorted((ROOT / "tests" / "errors").glob("*.yaml"))


def formatted(text: str) -> str:
    """The canonical text, which formatting again leaves as it is."""
    findings = Findings()
    written = format_text(text, "x.yaml", findings)
    assert written is not None, findings.sorted()
    assert format_read(written) == written
    return written


Value: TypeAlias = "bool | int | float | str | list[Value] | list[tuple[str, Value]] | None"


def values(text: str) -> Value:
    """What the reader makes of a text, places left out; keys with single blanks around an arrow."""
    findings = Findings()
    document = read_text(text, "x.yaml", findings)
    assert document is not None
    assert findings.sorted() == ()
    return _value(document.root)


def _value(node: Node) -> Value:
    if isinstance(node, Scalar):
        return normal(node.value) if isinstance(node.value, str) else node.value
    if isinstance(node, Mapping):
        return [(normal(entry.name), _value(entry.value)) for entry in node.entries]
    return [_value(item) for item in node.items]


def test_the_blanks_of_a_lesion_do_not_show_in_the_hash() -> None:
    text = (
        "neurovis: 1\nname: x\nneurons: {A: {count: 2, bias: 1}, B: {}}\nconnections: {A -> B: 1}\n"
        "events: [{at: 1, lesion: [A1, A2->B]}, {at: 2, lesion: A1+A2->B}]\n"
    )
    assert formatted(text) != text
    assert nv.compile_text(formatted(text)).hash == nv.compile_text(text).hash


# ---- golden pairs ------------------------------------------------------------------------------------------------

PAIRS: dict[str, tuple[str, str]] = {
    "spacing": ("a:   {b:1, c : [ 1,2 ,3 ], }\nd:  x   \n", "a: {b:1, c: [1, 2, 3]}\nd: x\n"),
    "empty collections": ("a: [ ]\nb: {\n}\n", "a: []\nb: {}\n"),
    "left out values": ("a:\nb: {c: , d}\ne:\n  -\n  - 1\n", "a:\nb: {c: , d}\ne:\n  -\n  - 1\n"),
    "indentation": (
        "a:\n    b:\n      c: 1\n    d:\n    - 1\n    -   2\n",
        "a:\n  b:\n    c: 1\n  d:\n    - 1\n    - 2\n",
    ),
    "lists of mappings": ("a:\n-   b: 1\n    c: 2\n-\n  d: 3\n", "a:\n  - b: 1\n    c: 2\n  - d: 3\n"),
    "lists of lists": ("a:\n- - 1\n  - 2\n-\n  - 3\n", "a:\n  - - 1\n    - 2\n  - - 3\n"),
    "quotes are the author's": ("a: 'x'\nb: \"y\"\n'c': z\n", "a: 'x'\nb: \"y\"\n'c': z\n"),
    "blank lines": ("\n\na: 1\n\n\n\nb:\n\n  c: 1\n\n  d: 2\n\n\n", "a: 1\n\nb:\n  c: 1\n\n  d: 2\n"),
    "a value below its key": ("a:\n  1\nb:\n  [1, 2]\nc:\n  x\n  y\n", "a: 1\nb: [1, 2]\nc:\n  x\n  y\n"),
    "line ends": ("\ufeffa: 1\r\nb:\r\n  - 2\r\n# c\r\n", "a: 1\nb:\n  - 2\n# c\n"),
    "old line ends": ("a: 1\rb: 2", "a: 1\nb: 2\n"),
    "tabs": ("a:\t1\t# c\nb: [1,\t2]\n", "a: 1  # c\nb: [1, 2]\n"),
    "connections": (
        'connections:\n  A->B: 1\n  K1+K3..K5  ->O: 2\n  "C->D": 3\nlayout: {boxes: {a->b: [A]}}\n',
        'connections:\n  A -> B: 1\n  K1 + K3..K5 -> O: 2\n  "C -> D": 3\nlayout: {boxes: {a->b: [A]}}\n',
    ),
    "gains of connections": (
        "render:\n  gain: {signal: {A->B: 1, 'A+B->B': 2}}\n",
        "render:\n  gain: {signal: {A -> B: 1, 'A + B -> B': 2}}\n",
    ),
    "connections that are lesioned": (
        "events:\n- {at: 1, lesion: [A1,A2->B , 'C+D->E']}\n- at: 2\n  lesion: A->B\n"
        "- at: 3\n  lesion:\n  - A  ->B  # c\n  - |\n    A->B\nlayout: {boxes: {b: a->b, lesion: [a->b]}}\n",
        "events:\n  - {at: 1, lesion: [A1, A2 -> B, 'C + D -> E']}\n  - at: 2\n    lesion: A -> B\n"
        "  - at: 3\n    lesion:\n      - A -> B  # c\n      - |\n        A->B\n"
        "layout: {boxes: {b: a->b, lesion: [a->b]}}\n",
    ),
    "connections in other places": (
        "connections: [{A->B: 1}, {A->B: 2}]\nmodules: {m: {connections: {S->K: 1}}}\n",
        "connections: [{A -> B: 1}, {A -> B: 2}]\nmodules: {m: {connections: {S -> K: 1}}}\n",
    ),
    "modules": (
        "modules:\n   leg:   # one\n\n      parameters:   {gain:1 ,slow : 2}\n      neurons:\n"
        "        S:   {input: load}  # two\n"
        "        # three\n      connections:\n        S->K1+K3..K5:   gain\n        knee.J  ->K:\n          matrix:\n"
        "          - [1, -2.5,3]\n          - [-10,0.25 ,null]\n",
        "modules:\n  leg:    # one\n    parameters: {gain:1, slow: 2}\n    neurons:\n      S: {input: load}  # two\n"
        "      # three\n    connections:\n      S -> K1 + K3..K5: gain\n      knee.J -> K:\n        matrix:\n"
        "          - [  1, -2.5,     3]\n          - [-10,  0.25, null]\n",
    ),
    "instances and layout": (
        "instances:\n    left:  {module: leg,count: 3 , set: {gain: 0.8*i}, inputs: {load:  torque}} # one\n"
        "connections:\n  left1.K+left2.K1..left2.K3->right.knee.S: 1\n"
        "layout:\n   mirror: [[ left,right ]]\n   align:\n   - [left1.K,left2.K]\n   - [A, B]\n",
        "instances:\n  left: {module: leg, count: 3, set: {gain: 0.8*i}, inputs: {load: torque}}  # one\n"
        "connections:\n  left1.K + left2.K1..left2.K3 -> right.knee.S: 1\n"
        "layout:\n  mirror: [[left, right]]\n  align:\n    - [left1.K, left2.K]\n    - [A,       B]\n",
    ),
    "a file to be included": (
        "# legs\ninclude:\n- more.yaml   # one\n- [ ]\nmodules: {leg: {neurons: {K: {}},connections: {K->K: 1}}}\n"
        "rules:\n     mine:   {weight: {each_step:   weight}}\n",
        "# legs\ninclude:\n  - more.yaml  # one\n  - []\n"
        "modules: {leg: {neurons: {K: {}}, connections: {K -> K: 1}}}\n"
        "rules:\n  mine: {weight: {each_step: weight}}\n",
    ),
    "keys that would become the same": ("connections: {A->B: 1, A -> B: 2}\n", "connections: {A->B: 1, A -> B: 2}\n"),
    "a matrix of expressions": (
        "m:\n  - [alpha*cos(phi), -alpha*sin(phi)]\n  - [alpha*sin(phi), alpha]  # c\n",
        "m:\n  - [alpha*cos(phi), -alpha*sin(phi)]\n  - [alpha*sin(phi),           alpha]  # c\n",
    ),
    "a matrix of numbers": (
        "m:\n- [1.5, 2, null]\n# between\n- [-10, 0.25, 3]\n\n- [1e3, 4, -1]\n",
        "m:\n  - [  1.5, 2,    null]\n  # between\n  - [-10,   0.25,    3]\n\n  - [  1e3, 4,      -1]\n",
    ),
    "edges": (
        "e:\n  - [K1, O, 0.5]\n  - [K12, O1, -0.25, 3]\n",
        "e:\n  - [K1,  O,   0.5]\n  - [K12, O1, -0.25, 3]\n",
    ),
    "a matrix in brackets": ("m: [[1, -2],\n  [-3, 4]]\n", "m: [[ 1, -2],\n    [-3,  4]]\n"),
    "brackets over several lines": (
        "a: [1, 2, # one\n3,\n\n\n  # two\n  4]\nb: {\n  c: 1, d: 2,\n      e: [\n 1]}\n",
        "a: [1, 2,  # one\n    3,\n\n    # two\n    4]\nb: {\n  c: 1, d: 2,\n  e: [\n    1\n  ]\n}\n",
    ),
    "comments in brackets": (
        "a: [ # one\n  1 # two\n  , 2 # three\n  # four\n]\nb: {c: # five\n  1}\n",
        "a: [  # one\n  1,  # two\n  2  # three\n  # four\n]\nb: {\n  # five\n  c: 1\n}\n",
    ),
    "comments beside dashes and colons": (
        "a: # one\n  # two\n  1\nb:\n- # three\n  c: 1\n- # four\n  2\n",
        "a:  # one\n  # two\n  1\nb:\n  -  # three\n    c: 1\n  -  # four\n    2\n",
    ),
    "comments at the end of a block": (
        "a:\n    b:\n        c: 1\n        # in b\n    # in a\n# at the top\nd:\n  # nothing yet\ne: 1\n  # below\n",
        "a:\n  b:\n    c: 1\n    # in b\n  # in a\n# at the top\nd:\n  # nothing yet\ne: 1\n# below\n",
    ),
    "comments below a list without indentation": ("a:\n- 1\n# of b\nb: 1\n", "a:\n  - 1\n# of b\nb: 1\n"),
    "comments in a column": (
        "a: {b:   1}   # one\nlong: 1       # two\n              # and on\nc: 1 # three\n",
        "a: {b:   1}   # one\nlong: 1       # two\n              # and on\nc: 1  # three\n".replace(
            "{b:   1}", "{b: 1}  "
        ),
    ),
    "comments in a column that is too narrow": (
        "a: [1,2,3] # one\nbc: 1      # two\n",
        "a: [1, 2, 3]  # one\nbc: 1         # two\n",
    ),
    "block texts": (
        "a: |-   # c\n     one\n       two\n\n\nb:\n - >2\n     x\n - |+\n   y\n\nc: 1\n",
        "a: |-   # c\n  one\n    two\n\nb:\n  - >2\n      x\n  - |+\n    y\n\nc: 1\n",
    ),
    "texts over several lines": (
        'a: one\n   two\n\n   three\nb: "x \\\n      y\\  \n      z"\n',
        'a: one\n  two\n\n  three\nb: "x \\\n  y\\ \n  z"\n',
    ),
    "announced keys": ("? a\n: 1\n? b\nc: 2\n", "a: 1\nb:\nc: 2\n"),
    "pairs in a list": ("a: [b: 1, ? c : 2]\n", "a: [b: 1, c: 2]\n"),
    "prologue": (
        "# one\n%YAML 1.2\n--- # two\n\n# three\na: 1\n...\n# four\n",
        "# one\n%YAML 1.2\n---  # two\n# three\na: 1\n# four\n",
    ),
    "a root in brackets": ("# c\n{a: 1,b: 2} # d\n", "# c\n{a: 1, b: 2}  # d\n"),
}


@pytest.mark.parametrize("name", PAIRS)
def test_what_is_written_and_what_becomes_of_it(name: str) -> None:
    before, after = PAIRS[name]
    assert formatted(before) == after
    assert values(after) == values(before)


def test_tabs_on_lines_without_values_become_blanks() -> None:
    text = "neurovis: 1\nname: x\n\t\nneurons:\n  A:\n    bias: 1\n  \t # c\n\t\n\t# d\n  B: {bias: 1}\n\t"
    assert formatted(text) == (
        "neurovis: 1\nname: x\n\nneurons:\n  A:\n    bias: 1\n    # c\n\n  # d\n  B: {bias: 1}\n"
    )


def test_the_deepest_and_the_longest() -> None:
    deep = "a: " + "[" * 63 + "]" * 63 + "\n"
    assert formatted(deep) == deep
    blocks = "".join("   " * depth + "a:\n" for depth in range(64))
    assert formatted(blocks) == "".join("  " * depth + "a:\n" for depth in range(64))
    key = "k" * 1100
    assert formatted(f"?   {key}\n:   - 1\nb: {{?  {key} :  1}}\n") == f"? {key}\n:\n  - 1\nb: {{? {key}: 1}}\n"
    wide = "x" * 120
    assert formatted(f"a:\n  {wide}\nb:\n    [{wide}]\nc: [{wide}]\n") == (
        f"a:\n  {wide}\nb:\n  [{wide}]\nc: [{wide}]\n"
    )
    assert formatted(f"m:\n  - [1, {wide}]\n  - [10, 1]\n") == f"m:\n  - [ 1, {wide}]\n  - [10, 1]\n"


@pytest.mark.parametrize("path", CANONICAL, ids=lambda path: path.stem)
def test_what_we_ship_is_canonical(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert formatted(text) == text


def test_the_example_of_the_readme_is_canonical() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    examples = re.findall(r"^```yaml\n(.*?)^```$", readme, re.MULTILINE | re.DOTALL)
    assert examples
    for text in examples:
        assert formatted(text) == text


@pytest.mark.parametrize("path", DEFECTIVE, ids=lambda path: path.stem)
def test_a_defective_spec_is_refused_by_the_reader_or_formatted(path: Path) -> None:
    text = path.read_bytes().decode("utf-8", "replace")
    findings, again = Findings(), Findings()
    read_text(text, "x.yaml", again)
    written = format_text(text, "x.yaml", findings)
    assert (written is None) == again.failed
    assert findings.sorted() == again.sorted()
    if written is not None:
        assert values(written) == values(text)
        assert comments(written) == comments(text)
        assert format_read(written) == written


# ---- laws --------------------------------------------------------------------------------------------------------


def comments(text: str) -> Counter[str]:
    """The comments of a text: what stands between its tokens, as another scanner sees them, and behind | and >."""
    text = re.sub("\r\n?", "\n", text.removeprefix("\ufeff")) + "\n"
    found: list[str] = []
    at = 0
    for token in yaml.scan(text, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader)):
        found += re.findall("#[^\n]*", text[at : token.start_mark.index])
        at = token.end_mark.index
        if isinstance(token, yaml.ScalarToken) and token.style in ("|", ">"):
            found += re.findall("#[^\n]*", text[token.start_mark.index : at].partition("\n")[0])
    return Counter(comment.rstrip() for comment in found)


class Writer:
    """Writes a value as YAML in any style that chance has it, with comments at every place that takes one."""

    def __init__(self, seed: int) -> None:
        self.chance = random.Random(seed)
        self.count = 0
        self.behind_text = False  # where a comment that is indented further would be part of the text
        self.noise = self.chance.choice([0, 0.05, 0.3])

    def document(self, spec: Spec) -> str:
        return self.between(0) + self.block(spec, 0) + self.between(0)

    def comment(self) -> str:
        self.count += 1
        return f"#{self.chance.choice(['', ' '])}c{self.count}" + self.chance.choice([":", " [", " # x", "", " '"])

    def blanks(self, least: int = 0) -> str:
        return " " * self.chance.choice([least, least, 1, 1, 3])

    def end(self) -> str:
        """The end of a line."""
        comment = self.blanks(1) + self.comment() if self.chance.random() < self.noise else ""
        return comment + self.blanks() + "\n"

    def between(self, indent: int) -> str:
        """Lines of comments and blank lines."""
        lines = ""
        while self.chance.random() < self.noise:
            column = self.chance.choice([0, indent] if self.behind_text else [indent, 0, indent + 2, 7])
            lines += "\n" if self.chance.random() < 0.5 else " " * column + self.comment() + "\n"
        return lines

    def block(self, value: Plain, indent: int) -> str:
        """A collection as a block, its lines whole."""
        lines = ""
        if isinstance(value, dict):
            for key, item in value.items():
                lines += self.between(indent) + " " * indent + self.scalar(key) + ":" + self.value(item, indent)
        elif isinstance(value, list):
            for item in value:
                lines += self.between(indent) + " " * indent + "-" + self.value(item, indent)
        return lines

    def value(self, value: Plain, indent: int) -> str:
        """What stands behind a colon or a dash, to the end of its last line."""
        deeper = indent + self.chance.choice([1, 2, 2, 4])
        self.behind_text = False
        if isinstance(value, dict | list) and value and self.chance.random() < 0.5:
            return self.end() + self.block(value, deeper)
        if isinstance(value, str) and self.chance.random() < 0.2:
            header = self.chance.choice(["|-", ">-"]) + (" " + self.comment() if self.chance.random() < 0.3 else "")
            self.behind_text = True
            return f" {header}\n{' ' * deeper}{value}\n"
        start = self.end() + " " * deeper if self.chance.random() < self.noise else self.blanks(1)
        return start + self.flow(value, deeper) + self.end()

    def flow(self, value: Plain, indent: int) -> str:
        if isinstance(value, dict):
            entries = [
                self.scalar(key) + ":" + (self.gap(indent) or " ") + self.flow(item, indent)
                for key, item in value.items()
            ]
            return "{" + self.gap(indent) + self.commas(entries, indent) + "}"
        if isinstance(value, list):
            return "[" + self.gap(indent) + self.commas([self.flow(item, indent) for item in value], indent) + "]"
        return self.scalar(value)

    def commas(self, items: list[str], indent: int) -> str:
        written = ""
        for index, item in enumerate(items):
            last = index == len(items) - 1
            comma = self.chance.choice(["", "", ","]) if last else ","
            written += item + self.gap(indent) + comma + self.gap(indent)
        return written

    def gap(self, indent: int) -> str:
        if self.chance.random() < self.noise:
            return self.end() + self.between(indent) + " " * indent
        return self.blanks()

    def scalar(self, value: Plain) -> str:
        if not isinstance(value, str):
            return "null" if value is None else str(value).lower()
        arrow = value.replace(" -> ", self.chance.choice(["->", " -> ", "  ->"]))
        quote = self.chance.choice(["", "'", '"'])
        if re.search(r"[,\[\]{}#:]", value):
            quote = quote or "'"
        return quote + arrow + quote


@given(specs(), st.integers(0, 2**32), st.sampled_from(["\n", "\r\n"]))
@settings(max_examples=40, deadline=None)
def test_formatting_keeps_values_hash_and_comments(spec: Spec, seed: int, end: str) -> None:
    writer = Writer(seed)
    text = writer.document(spec).replace("\n", end)
    written = formatted(text)
    assert values(written) == values(text)
    assert comments(written) == comments(text)
    for number in range(1, writer.count + 1):
        assert len(re.findall(rf"#\s?c{number}\b", written)) == 1
    assert nv.compile_text(written).hash == nv.compile_text(text).hash == nv.compile(spec).hash
    assert "\r" not in written
    assert not re.search(r"[ \t]$", written, re.MULTILINE)
    assert not re.search(r"\n\n\n|\A\n|\n\n\Z", written)


@given(specs(), specs(), st.integers(0, 2**32), st.booleans())
@examples(12)
def test_modules_and_included_files_keep_values_hash_and_comments(
    folder_of_specs: Path, one: Spec, other: Spec, seed: int, included: bool
) -> None:
    writer = Writer(seed)
    library: Spec = {"modules": {"leg": module(one), "arm": module(other)}}
    spec: Spec = {
        "neurovis": 1,
        "name": "modular",
        "inputs": {"wave": {"expression": "0.3*sin(k/3)"}},
        **({"include": ["library.yaml"]} if included else library),
        "instances": {
            "left": {"module": "leg", "count": 2, "set": {"shift": "0.1*i"}, "inputs": {"wave": "wave"}},
            "right": {"module": "arm"},
        },
        "connections": {"left1.Ga -> left2.Ga": {"weight": 0.1, "pattern": "one_to_one"}},
        "outputs": {"out": ["left.Ga", "right.Ga"]},
    }
    hashes = []
    texts = {"spec.yaml": writer.document(spec), "library.yaml": writer.document({"neurovis": 1, **library})}
    for text in texts.values():
        written = formatted(text)
        assert values(written) == values(text)
        assert comments(written) == comments(text)
    for form in (str, formatted):
        for name, text in texts.items():
            (folder_of_specs / name).write_text(form(text), encoding="utf-8")
        hashes.append(nv.compile(folder_of_specs / "spec.yaml").hash)
    assert len(set(hashes)) == 1


@pytest.fixture(scope="module")
def folder_of_specs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("modular")


def module(spec: Spec) -> dict[str, Plain]:
    """The network of a spec as a module, with a parameter and an input of its own."""
    groups = {name: dict(cast("dict[str, Plain]", group)) for name, group in section(spec, "neurons").items()}
    groups["Ga"]["bias"] = "shift"
    neurons: dict[str, Plain] = dict(groups)
    return {
        "parameters": {"shift": 0.5},
        "inputs": {"wave": {}},
        "neurons": neurons,
        "connections": spec["connections"],
    }


_KEYS = st.text(st.characters(codec="utf-8", exclude_categories=["C", "Z"]) | st.sampled_from(" \n#:,[]{}&*!|>'\"%@`-"))
_TREES = st.recursive(
    st.none() | st.booleans() | st.integers(-9, 9) | st.floats(allow_nan=False, allow_infinity=False) | _KEYS,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(_KEYS, inner, max_size=4),
    max_leaves=12,
)


@given(
    st.dictionaries(_KEYS, _TREES, min_size=1, max_size=4),
    st.sampled_from([True, False, None]),
    st.sampled_from([None, "'", '"', "|", ">"]),
    st.integers(2, 9),
    st.sampled_from([10, 80]),
)
@settings(max_examples=60, deadline=None)
def test_any_value_survives(
    tree: dict[str, object], flow: bool | None, style: str | None, indent: int, width: int
) -> None:
    text = yaml.safe_dump(
        tree, default_flow_style=flow, default_style=style, indent=indent, width=width, allow_unicode=True
    )
    findings = Findings()
    written = format_text(text, "x.yaml", findings)
    if written is None:
        assert findings.failed
        return
    assert values(written) == values(text)
    assert format_read(written) == written


_PIECES = [
    *"#-?:,[]{}'\"|>+ \n\t",
    " ",
    "  ",
    "\n",
    "\n  ",
    "# c\n",
    " # d\n",
    "- ",
    ": ",
    "? ",
    "x",
    "A->B",
    "|+\n  y\n",
    "...",
]


def _mutated(seed: int) -> str:
    """A text of the golden pairs with some pieces put in or taken out."""
    chance = random.Random(seed)
    text = chance.choice([text for pair in PAIRS.values() for text in pair])
    for _ in range(chance.randint(1, 4)):
        at = chance.randint(0, len(text))
        text = text[:at] + chance.choice(_PIECES) + text[at + chance.choice([0, 0, 0, 1, 3]) :]
    return text


@given(st.integers(0, 2**32))
@settings(max_examples=120, deadline=None)
def test_whatever_the_reader_takes_is_formatted(seed: int) -> None:
    text = _mutated(seed)
    findings = Findings()
    written = format_text(text, "x.yaml", findings)
    if written is None:
        return
    assert values(written) == values(text)
    assert comments(written) == comments(text)
    assert format_read(written) == written


# ---- the command -------------------------------------------------------------------------------------------------

LOOSE = "# head\nneurovis:   1\nname: x\n"
NEAT = "# head\nneurovis: 1\nname: x\n"
BROKEN = "neurovis: [1\n"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty working folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def call(*arguments: str, stdin: bytes | None = None) -> Result:
    """``neurovis fmt`` in this process. An exception that is no exit is raised."""
    result = CliRunner().invoke(neurovis, ["fmt", *arguments], input=stdin)
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


def content_of(path: Path) -> tuple[int, int, int]:
    """What changes in a file's status where it is written: not the time at which it was read last."""
    status = path.stat()
    return status.st_mtime_ns, status.st_size, status.st_ino


def test_files_are_rewritten_and_named_if_they_change(folder: Path) -> None:
    (folder / "loose.yaml").write_text(LOOSE)
    (folder / "neat.yaml").write_text(NEAT)
    before = content_of(folder / "neat.yaml")
    result = call("loose.yaml", "neat.yaml")
    assert (result.exit_code, result.stdout, result.stderr) == (0, "loose.yaml: formatted\n", "")
    assert (folder / "loose.yaml").read_text() == NEAT
    assert content_of(folder / "neat.yaml") == before
    assert sorted(path.name for path in folder.iterdir()) == ["loose.yaml", "neat.yaml"]


def test_byte_order_marks_and_line_ends_change(folder: Path) -> None:
    (folder / "x.yaml").write_bytes(b"\xef\xbb\xbf" + NEAT.encode())
    (folder / "y.yaml").write_bytes(NEAT.replace("\n", "\r\n").encode())
    assert call("x.yaml", "y.yaml").stdout == "x.yaml: formatted\ny.yaml: formatted\n"
    assert (folder / "x.yaml").read_bytes() == (folder / "y.yaml").read_bytes() == NEAT.encode()


def test_permissions_and_links_stay(folder: Path) -> None:
    path = folder / "x.yaml"
    path.write_text(LOOSE)
    path.chmod(0o640)
    (folder / "link.yaml").symlink_to("x.yaml")
    assert call("link.yaml").exit_code == 0
    assert (folder / "link.yaml").is_symlink()
    assert path.read_text() == NEAT
    assert stat.S_IMODE(path.stat().st_mode) == 0o640


def test_check_names_what_would_change_and_writes_nothing(folder: Path) -> None:
    (folder / "loose.yaml").write_text(LOOSE)
    (folder / "neat.yaml").write_text(NEAT)
    result = call("--check", "neat.yaml", "loose.yaml")
    assert (result.exit_code, result.stdout, result.stderr) == (1, "loose.yaml: would change\n", "")
    assert (folder / "loose.yaml").read_text() == LOOSE
    assert call("--check", "neat.yaml").exit_code == 0


@pytest.mark.parametrize("text", [LOOSE, LOOSE.replace("\n", "\r\n"), LOOSE.removesuffix("\n"), "\ufeff" + LOOSE])
def test_the_difference_is_one_that_can_be_applied(folder: Path, text: str) -> None:
    path = folder / "loose.yaml"
    path.write_bytes(text.encode())
    result = call("--diff", "loose.yaml")
    assert (result.exit_code, result.stderr) == (0, "")
    assert path.read_bytes() == text.encode()
    command = ["git", "apply", "--unidiff-zero", "-"]
    subprocess.run(command, cwd=folder, input=result.stdout_bytes, check=True, env={"GIT_CEILING_DIRECTORIES": "/"})
    assert path.read_bytes() == NEAT.encode()


_SOME_LINES = st.lists(st.sampled_from(["a\n", "b\n", "\n", " a\n", *(f"{n}\n" for n in range(30))]), max_size=40)


@given(_SOME_LINES, _SOME_LINES, st.booleans(), st.sampled_from([1, 10, 300]))
@settings(max_examples=60, deadline=None)
def test_a_difference_says_how_one_text_becomes_the_other(
    old: list[str], new: list[str], bare: bool, copies: int
) -> None:
    before, after = "".join(old * copies).removesuffix("\n" if bare else ""), "".join(new)
    shown = difference(before, after, "x")
    assert bool(shown) == (before != after)
    assert applied(before, shown) == after


def applied(text: str, diff: str) -> str:
    """A text with a diff applied to it, each line of which has to fit."""
    lines, made, at = text.splitlines(keepends=True), [], 0
    diff = re.sub(r"\n\\ No newline at end of file\n", "\0", diff)
    for line in re.findall("[^\n\0]*[\n\0]", diff)[2:]:
        sign, content = line[0], line[1:].removesuffix("\0")
        if sign == "@":
            match = re.fullmatch(r"@@ -(\d+),(\d+) \+(\d+),(\d+) @@\n", line)
            assert match is not None
            first, count, there = (int(match.group(n)) for n in (1, 2, 3))
            first -= count > 0
            made += lines[at:first]
            at = first
            assert len(made) == there - (int(match.group(4)) > 0)
        else:
            if sign in " -":
                assert lines[at] == content
                at += 1
            if sign in " +":
                made.append(content)
    return "".join([*made, *lines[at:]])


def test_check_and_diff_together(folder: Path) -> None:
    (folder / "loose.yaml").write_text(LOOSE)
    result = call("--check", "--diff", "loose.yaml")
    assert result.exit_code == 1
    assert result.stdout.startswith("loose.yaml: would change\n--- a/loose.yaml\n+++ b/loose.yaml\n@@ ")
    assert "-neurovis:   1\n+neurovis: 1\n" in result.stdout


def test_a_broken_file_is_shown_and_left_alone_and_the_others_are_formatted(folder: Path) -> None:
    (folder / "broken.yaml").write_text(BROKEN)
    (folder / "loose.yaml").write_text(LOOSE)
    result = call("broken.yaml", "missing.yaml", "loose.yaml")
    assert (result.exit_code, result.stdout) == (1, "loose.yaml: formatted\n")
    assert "broken.yaml:1:11: error[yaml-syntax]" in result.stderr
    assert "missing.yaml:1:1: error[file-missing]" in result.stderr
    assert (folder / "broken.yaml").read_text() == BROKEN
    assert (folder / "loose.yaml").read_text() == NEAT


def test_standard_input_goes_to_standard_output(folder: Path) -> None:
    for text in (LOOSE, NEAT, "\ufeff" + LOOSE.replace("\n", "\r\n")):
        result = call("-", stdin=text.encode())
        assert (result.exit_code, result.stdout_bytes, result.stderr) == (0, NEAT.encode(), "")
    result = call("-", "--check", stdin=LOOSE.encode())
    assert (result.exit_code, result.stdout) == (1, "<stdin>: would change\n")
    result = call("-", stdin=BROKEN.encode())
    assert (result.exit_code, result.stdout) == (1, "")
    assert "<stdin>:1:11: error[yaml-syntax]" in result.stderr
    result = call("-", stdin=b"a: \xff\n")
    assert (result.exit_code, result.stdout) == (1, "")
    assert "<stdin>:1:4: error[invalid-utf8]" in result.stderr
    assert call("-", "-").exit_code == 2


def test_what_would_change_the_meaning_is_not_written(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("neurovis_spec.language.format.canonical.print_document", lambda root, text: "neurovis: 2\n")
    with pytest.raises(FormattingError):
        format_read(LOOSE)
    (folder / "loose.yaml").write_text(LOOSE)
    result = call("loose.yaml")
    assert result.exit_code == 1
    assert "loose.yaml: formatting would have changed what this says" in result.stderr
    assert (folder / "loose.yaml").read_text() == LOOSE


def test_a_folder_that_cannot_be_written_is_said(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*arguments: object) -> None:
        raise OSError(28, "No space left on device")

    (folder / "loose.yaml").write_text(LOOSE)
    monkeypatch.setattr("os.fsync", full)
    result = call("loose.yaml")
    assert (result.exit_code, result.stdout) == (1, "")
    assert "loose.yaml cannot be written: No space left on device" in result.stderr
    assert [path.name for path in folder.iterdir()] == ["loose.yaml"]
    assert (folder / "loose.yaml").read_text() == LOOSE
