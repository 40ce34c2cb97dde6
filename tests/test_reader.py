"""Reading: values, places, every refusal, and that nothing ever gets out but findings."""

from __future__ import annotations

import gc
import math
import os
import re
import unicodedata
from pathlib import Path

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from neurovis_spec.diagnostics import Diagnostic, Findings, show_text
from neurovis_spec.language.yaml.characters import Lines
from neurovis_spec.language.yaml.reader import read_any, read_file, read_text
from neurovis_spec.language.yaml.scalars import NumberRangeError, resolve
from neurovis_spec.language.yaml.source import Mapping, Node, Packed, Scalar, ScalarValue, Sequence, SourceDocument


def read(text: str) -> tuple[SourceDocument | None, tuple[Diagnostic, ...]]:
    findings = Findings()
    document = read_text(text, "net.yaml", findings)
    return document, findings.sorted()


def root(text: str) -> Mapping:
    document, found = read(text)
    assert found == ()
    assert document is not None
    return document.root


def places(text: str) -> list[str]:
    return [f"{d.span.line}:{d.span.column} {d.code}" for d in read(text)[1]]


Plain = ScalarValue | list["Plain"] | dict[str, "Plain"]


def plain(node: Node | None) -> Plain:
    match node:
        case Scalar(value=value):
            return value
        case Mapping(entries=entries):
            return {entry.name: plain(entry.value) for entry in entries}
        case Sequence() | Packed():
            return [plain(item) for item in node.items]
        case _:
            raise AssertionError


def written(text: str, node: Node) -> str:
    """What stands at a node's place."""
    lines = Lines(text)
    span = node.span
    start = lines.starts[span.line - 1] + span.column - 1
    return text[start : lines.starts[span.end_line - 1] + span.end_column - 1]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        *((word, None) for word in ("", "~", "null", "Null", "NULL")),
        *((word, True) for word in ("true", "True", "TRUE")),
        *((word, False) for word in ("false", "False", "FALSE")),
        *((word, word) for word in ("010", "-010", "00", "0o7", "0x1f", "0b1", "on", "off", "yes", "no", "y", "Yes")),
        *((word, word) for word in ("190:20:30", "2001-01-01", "2001-12-14T21:59Z", "1_000", "1,5", "nan", "inf")),
        *((word, word) for word in ("tRUE", "nULL", ".", "-", "+", "e5", "1e", "1e+", ".e1", "1.2.3", "١", "<<")),
        ("0", 0),
        ("-0", 0),
        ("+12", 12),
        ("9223372036854775807", 2**63 - 1),
        ("-9223372036854775808", -(2**63)),
        ("1e5", 1e5),
        ("1E-5", 1e-5),
        ("1.", 1.0),
        (".5", 0.5),
        ("-.5e+3", -500.0),
        ("010.5", 10.5),
        (".inf", math.inf),
        ("-.INF", -math.inf),
    ],
)
def test_plain_scalars(text: str, value: ScalarValue) -> None:
    got = resolve(text)
    assert got == value
    assert type(got) is type(value)


def test_nan_is_read_for_later_stages_to_refuse() -> None:
    got = resolve(".NaN")
    assert isinstance(got, float)
    assert math.isnan(got)


@pytest.mark.parametrize(
    ("text", "code", "nearest"),
    [
        ("9223372036854775808", "integer-range", 2**63 - 1),
        ("-9223372036854775809", "integer-range", -(2**63)),
        ("1" * 100_000, "integer-range", 2**63 - 1),
        ("1e999", "number-range", 1.7976931348623157e308),
        ("-" + "1" * 5000 + ".0", "number-range", -1.7976931348623157e308),
    ],
)
def test_numbers_beyond_their_range(text: str, code: str, nearest: float) -> None:
    with pytest.raises(NumberRangeError) as caught:
        resolve(text)
    assert (caught.value.code, caught.value.nearest) == (code, nearest)
    assert len(str(caught.value)) < 100


SPEC = """\
# a comment
neurovis: 1
"quoted key": 'it''s'
名前: "日本 \\u00e9"
'x': "plain"
neurons:
  C: {count: 2, initial: [0.1, 0],   "box" : rhythm}
  K:
    combine: distance
    empty:
connections:
  C -> K:
    matrix:
    - [alpha*cos(phi), -1]
    - - 1
      - null
description: |
  first

  second
title: >-
  folded
  text

plain: goes on
  here
last: [
  1,
]
"""


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_places_of_keys_and_values(end: str) -> None:
    text = SPEC.replace("\n", end)
    top = root(text)
    found = {entry.name: (written(text, entry.key), written(text, entry.value)) for entry in top.entries}
    assert found == {
        "neurovis": ("neurovis", "1"),
        "quoted key": ('"quoted key"', "'it''s'"),
        "名前": ("名前", '"日本 \\u00e9"'),
        "x": ("'x'", '"plain"'),
        "neurons": ("neurons", text[text.index("C: {") : text.index(end + "connections")]),
        "connections": ("connections", text[text.index("C -> K") : text.index(end + "description")]),
        "description": ("description", f"|{end}  first{end}{end}  second"),
        "title": ("title", f">-{end}  folded{end}  text"),
        "plain": ("plain", f"goes on{end}  here"),
        "last": ("last", f"[{end}  1,{end}]"),
    }
    assert plain(top) == {
        "neurovis": 1,
        "quoted key": "it's",
        "名前": "日本 é",
        "x": "plain",
        "neurons": {
            "C": {"count": 2, "initial": [0.1, 0], "box": "rhythm"},
            "K": {"combine": "distance", "empty": None},
        },
        "connections": {"C -> K": {"matrix": [["alpha*cos(phi)", -1], [1, None]]}},
        "description": "first\n\nsecond\n",
        "title": "folded text",
        "plain": "goes on here",
        "last": [1],
    }


def test_columns_count_code_points_behind_a_byte_order_mark() -> None:
    top = root("\ufeffa𝄞é: {b: 1}")
    assert [entry.key.span.end_column for entry in top.entries] == [4]
    inner = top.get("a𝄞é")
    assert inner is not None
    assert (inner.span.line, inner.span.column) == (1, 6)


def test_where_characters_of_a_value_stand() -> None:
    text = "a: x + y\nb: 'x + y'\nc: \"x + y\"\nd: \"x \\x2b y\"\ne: 'x ''y'\nf: |\n  x + y\ng: x\n  + y\n"
    got = {}
    for entry in root(text).entries:
        assert isinstance(entry.value, Scalar)
        span = entry.value.at(4, 5)
        got[entry.name] = (entry.value.inner, span.line, span.column)
    assert got == {
        "a": (0, 1, 8),
        "b": (1, 2, 9),
        "c": (1, 3, 9),
        "d": (None, 4, 12),
        "e": (None, 5, 9),
        "f": (None, 7, 7),
        "g": (None, 9, 5),
    }


def test_an_empty_value_stands_behind_its_colon() -> None:
    top = root("a:   # c\nb: {c: , d: }\n")
    inner = top.get("b")
    assert isinstance(inner, Mapping)
    spans = [entry.value.span for entry in (*top.entries[:1], *inner.entries)]
    assert [(span.line, span.column, span.end_column) for span in spans] == [(1, 3, 3), (2, 7, 7), (2, 12, 12)]


@pytest.mark.parametrize(
    ("text", "places"),
    [
        ("? a\n: ? b", [(2, 6)]),
        ("? a\n: ? b   # no colon:\n     # here either\n", [(2, 6)]),
        ("? a\n:\n  ? b\n  ? c\n", [(3, 6), (4, 6)]),
        ("? a\n:\n  ? b\n  : # nothing\n", [(4, 4)]),
    ],
)
def test_a_value_without_a_colon_stands_behind_its_key(text: str, places: list[tuple[int, int]]) -> None:
    inner = root(text).get("a")
    assert isinstance(inner, Mapping)
    spans = [entry.value.span for entry in inner.entries]
    assert [(span.line, span.column) for span in spans] == places
    assert [(span.end_line, span.end_column) for span in spans] == places


REFUSALS = [
    ("a: 1\nb: 2\na: 3\nb: 4\n", ["3:1 duplicate-key", "4:1 duplicate-key"]),
    ("x: {a: 1, 'a': 2}\n", ["1:11 duplicate-key"]),
    ("a: !!str 5\nb: ! x\nc: !<tag:x> [1]\n", ["1:4 tag", "2:4 tag", "3:4 tag"]),
    ("!x\na: 1\n", ["1:1 tag"]),
    ("a: !foo!bar 1\n", ["1:4 tag"]),
    ("a: &x 1\nb: *x\n<<: *y\n", ["1:4 anchor", "2:4 alias", "3:1 merge-key", "3:5 alias"]),
    ("a: &x !y {b: 1}\n", ["1:4 anchor", "1:7 tag"]),
    ("a: 1\n---\nb: 1\n", ["2:1 several-documents"]),
    ("%YAML 1.1\n---\na: 1\n", ["1:1 directive"]),
    ("# c\n%TAG ! x\n%FOO\n---\na: 1\na: 2\n", ["2:1 directive", "3:1 directive", "6:1 duplicate-key"]),
    ("a: \x00\nb: x\u202ey\nc: \x85\n", ["1:4 control-character", "2:5 control-character", "3:4 control-character"]),
    ('a: "x\\0y"\nb: "\\u202e"\n', ["1:4 control-character", "2:4 control-character"]),
    ("a: \ud800\n", ["1:4 control-character"]),
    ("a: 9223372036854775808\nb: [1e999]\n", ["1:4 integer-range", "2:5 number-range"]),
    ("null: 1\ntrue: 1\n12: 1\n1.5: 1\n~: 1\n", [f"{line}:1 key-not-text" for line in range(1, 6)]),
    ("? [a]\n: 1\n{b: c}: 2\n", ["1:3 key-not-text", "3:1 key-not-text"]),
    ("", ["1:1 not-a-mapping"]),
    ("# nothing\n", ["1:1 not-a-mapping"]),
    ("---\n# nothing", ["1:1 not-a-mapping"]),
    ("- a\n", ["1:1 not-a-mapping"]),
    ("text\n", ["1:1 not-a-mapping"]),
    ("a: 1\na: 2\nb: [\n", ["2:1 duplicate-key", "3:4 yaml-syntax"]),
]


@pytest.mark.parametrize(("text", "expected"), REFUSALS)
def test_refusals(text: str, expected: list[str]) -> None:
    assert places(text) == expected


@pytest.mark.parametrize("text", ["%YAML 1.2\n---\na: 1\n", "---\na: 1\n...\n", "a: '<<'\n'<<': 1\n'1': 2\n"])
def test_what_is_allowed(text: str) -> None:
    root(text)


def test_a_duplicate_cites_both_places_and_the_first_stays() -> None:
    document, (finding,) = read("a: 1\nb: {a: 5}\na: 2\n")
    assert "first at 1:1, again at 3:1" in finding.message
    assert document is not None
    assert plain(document.root) == {"a": 1, "b": {"a": 5}}


def test_reading_goes_on_behind_refusals() -> None:
    document, _ = read("a: !x 1\nb: &y 2\nc: *y\n<<: 3\ntrue: 4\nd: 5\n")
    assert document is not None
    assert plain(document.root) == {"a": 1, "b": 2, "c": True, "true": 4, "d": 5}  # what an alias stands for is unknown


def nested(depth: int) -> str:
    return "a: " + "[" * (depth - 1) + "]" * (depth - 1)


def test_the_deepest_level() -> None:
    assert places(nested(64)) == []
    assert places(nested(65)) == ["1:67 too-deep"]


SYNTAX = [
    ("a: 1\n\tb: 2\n", "2:1", "a tab in the indentation"),
    ("a:\n  b: 1\n \tc: 2\n", "3:2", "a tab in the indentation"),
    ("name x\nfoo: 1\n", "1:1", "':' is missing after 'name'"),
    ("a: 1\nname x\nfoo: 1\n", "2:1", "':' is missing after 'name'"),
    ("a:\n  name:x\n  b: 1\n", "2:7", "a blank is missing after ':'"),
    ("K: [1, 2\nO: {}\n", "1:4", "'[' is not closed"),
    ("K: {count: 2\nO: {}\n", "1:4", "'{' is not closed"),
    ("K: {count: 2", "1:4", "'{' is not closed"),
    ("K: {a: [1, 2}\n", "1:13", "'}' closes what '[' opened"),
    ("K: {count: 2,\n    activation: tanh\n    bias: 1}\n", "3:9", "',' or '}' is missing before this"),
    ("a: {b: 1 c: 2}\n", "1:11", "',' or '}' is missing"),
    ('a: 1\nt: "abc\nb: 1\n', "2:4", 'no closing "'),
    ("t: 'abc\n", "1:4", "no closing '"),
    ("a:\n    b: 1\n  c: 2\n", "3:3", "indentation fits none"),
    ("a: b: c\n", "1:5", "a second ':' in one line"),
    ("a: 1\n b: 2\n", "2:2", "a key cannot stand here"),
    ("a: @x\n", "1:4", "cannot begin with '@'"),
    ("a: `x`\n", "1:4", "cannot begin with '`'"),
    ("a: %x\n", "1:4", "cannot begin with '%'"),
    ("a: *\n", "1:4", "cannot begin with '*'"),
    ('a: "x" y\n', "1:8", "unexpected text behind a value"),
    ("a: 1\n- b\n", "2:1", "a list item where"),
    ("a: [1]]\n", "1:7", "']' closes nothing"),
    ('a: "\\q"\n', "1:5", "'\\q' begins no escape"),
    ('a: "\\UFFFFFFFF"\n', "1:5", "'\\U' begins no escape"),
    ("a: {: 1}\n", "1:5", "no key before ':'"),
    ("a: [1,\n", "1:4", "'[' is not closed"),
    ("a: {b: [\n\n# c\n", "1:8", "'[' is not closed"),
    ("a: 1\n: 2\n", "2:1", "no key before ':'"),
    ("x" * 3000 + ": 1\n", "1:1", "longer than 1,000 characters"),
]


@pytest.mark.parametrize(("text", "place", "words"), SYNTAX)
def test_syntax_errors_in_words(text: str, place: str, words: str) -> None:
    _, (finding,) = read(text)
    assert finding.code == "yaml-syntax"
    assert f"{finding.span.line}:{finding.span.column}" == place
    assert words in finding.message


@pytest.mark.parametrize(
    ("text", "place", "hint", "value"),
    [
        ("{weight: normal(0, 1), delay: 0}", "1:13", '"normal(0, 1)"', {"weight": "normal(0, 1)", "delay": 0}),
        ("{w: clip(x, max(0, 1), 2)}", "1:8", '"clip(x, max(0, 1), 2)"', {"w": "clip(x, max(0, 1), 2)"}),
        ("[1, uniform(0, 1), b]", "1:8", '"uniform(0, 1)"', [1, "uniform(0, 1)", "b"]),
        ("{label: Hello, world, b: 1}", "1:12", '"Hello, world"', {"label": "Hello", "b": 1}),
        ("{w: 0,5}", "1:8", "0.5", {"w": 0}),
    ],
)
def test_a_comma_in_a_flow_text_is_explained(text: str, place: str, hint: str, value: Plain) -> None:
    document, (finding,) = read(f"a: {text}\n")
    assert f"{finding.span.line}:{finding.span.column}" == place
    assert finding.code == "flow-comma"
    assert hint in (finding.hint or "")
    assert document is not None
    assert plain(document.root.get("a")) == value


@pytest.mark.parametrize("text", ["{O, K}", "{a: f(x), b}", "{A -> B: eta, B -> A}", "[f(x), (y]", "{a: 1, b: 2}"])
def test_no_comma_is_suspected_where_none_is_at_fault(text: str) -> None:
    assert places(f"a: {text}\n") == ([] if "b}" not in text else ["1:8 flow-comma"])


def rows_text(rows: list[str]) -> str:
    return "a:\n" + "".join(f"  - {row}\n" for row in rows)


def test_long_lists_are_packed_with_their_places() -> None:
    rows = [f"[N{n % 7}, 'O {n}', {n}, {n}.5, null]" for n in range(200)]
    text = rows_text(rows)
    node = root(text).get("a")
    assert isinstance(node, Packed)
    assert len(node) == 200
    assert plain(node) == [[f"N{n % 7}", f"O {n}", n, n + 0.5, None] for n in range(200)]
    for row, source in zip(node.items, rows, strict=True):
        assert isinstance(row, Sequence)
        assert [written(text, cell) for cell in row.items] == source.strip("[]").split(", ")
        quoted = row.items[1]
        assert isinstance(quoted, Scalar)
        assert quoted.at(0, 1).column == quoted.span.column + 1
    row = next(iter(node))
    assert isinstance(row, Sequence)
    assert [type(plain(cell)) for cell in row.items[2:4]] == [int, float]
    assert written(text, node) == text[5:-1]


def test_a_long_list_of_numbers_is_packed() -> None:
    numbers = ", ".join(str(n) for n in range(1000))
    node = root(f"a: [{numbers}]\n").get("a")
    assert isinstance(node, Packed)
    assert node.rows is None
    assert plain(node) == list(range(1000))
    assert (node.span.column, node.span.end_column) == (4, 6 + len(numbers))


@pytest.mark.parametrize(
    "odd",
    [
        "true",
        "{b: 1}",
        "x",
        "[true]",
        "[1, [2]]",
        "[]",
        '["\\x41"]',
        "[9007199254740993]",
        "['it''s']",
        "[1, {b: 2}, 3]",
        "[.5,\n    two\n    lines]",
    ],
)
@pytest.mark.parametrize("at", [3, 64, 65, 66, 150])
def test_an_odd_item_in_a_long_list_is_kept_exactly(odd: str, at: int) -> None:
    rows = [f"[{n}, N{n}]" for n in range(150)]
    rows.insert(at, odd)
    text = rows_text(rows)
    node = root(text).get("a")
    assert isinstance(node, Sequence)
    items = node.items
    assert plain(items[at]) == plain(root(f"x: {odd}\n").get("x"))
    assert written(text, items[at]) == odd
    assert [plain(item) for i, item in enumerate(items) if i != at] == [[n, f"N{n}"] for n in range(150)]
    assert root(text) == root(text)


def test_refusals_inside_a_long_list() -> None:
    rows = [f"[N{n}, O{n}, {n}]" for n in range(100)]
    rows[80] = "[N1, !x O1, normal(0, 1)]"
    rows[90] = "[N1, O1, 99999999999999999999]"
    assert places(rows_text(rows)) == ["82:10 tag", "82:17 flow-comma", "92:14 integer-range"]


def test_packed_rows_of_different_lengths_and_long_rows() -> None:
    rows = [list(range(n % 5 + 1)) for n in range(70)] + [list(range(300))]
    node = root(rows_text([str(row) for row in rows])).get("a")
    assert isinstance(node, Packed)
    assert plain(node) == rows


def test_reading_a_file(tmp_path: Path) -> None:
    path = tmp_path / "net.yaml"
    path.write_bytes(b"\xef\xbb\xbfa: \xc3\xa9\r\nb: 1\r\n")
    findings = Findings()
    document = read_file(path, "net.yaml", findings)
    assert document is not None
    assert plain(document.root) == {"a": "é", "b": 1}
    assert findings.sources["net.yaml"].startswith("a: é")


def test_files_that_cannot_be_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "open", lambda *arguments: pytest.fail("opened"))
    (tmp_path / "folder").mkdir()
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "device").symlink_to("/dev/zero")
    with (tmp_path / "huge").open("wb") as stream:
        stream.truncate((64 << 20) + 1)
    codes = {}
    for name in ("folder", "pipe", "device", "huge", "none", "none/none", "x\0y", "x" * 5000):
        findings = Findings()
        assert read_file(tmp_path / name, "net.yaml", findings) is None
        (finding,) = findings.sorted()
        codes[name[:4]] = finding.code
        span = finding.span
        assert (span.file, span.line, span.column) == ("net.yaml", 1, 1)
    assert codes == {
        "fold": "file-kind",
        "pipe": "file-kind",
        "devi": "file-kind",
        "huge": "too-large",
        "none": "file-missing",
        "x\0y": "file-unreadable",
        "xxxx": "file-unreadable",
    }


def test_bytes_that_are_no_utf_8(tmp_path: Path) -> None:
    path = tmp_path / "net.yaml"
    for data, place, hint in (
        (b"a: 1\nb: x\xff\n", (2, 5), "UTF-8"),
        ("a: é".encode("utf-16"), (1, 1), "UTF-16"),
        ("a: é".encode("latin-1"), (1, 4), "UTF-8"),
    ):
        path.write_bytes(data)
        findings = Findings()
        assert read_file(path, "net.yaml", findings) is None
        (finding,) = findings.sorted()
        assert finding.code == "invalid-utf8"
        assert (finding.span.line, finding.span.column) == place
        assert hint in (finding.hint or "")


def test_a_text_that_is_too_large() -> None:
    assert places("a" * ((64 << 20) + 1)) == ["1:1 too-large"]


BOMBS = {
    "lists": "[" * 100_000,
    "mappings": "{a: " * 100_000,
    "items": "- " * 100_000,
    "keys": "? " * 100_000,
    "aliases": "a: &a [x,x]\n" + "".join(f"{c}: &{c} [*a,*a,*a,*a,*a,*a,*a,*a]\n" for c in "bcdefghij"),
    "tags": "a: [" + "!b c," * 10_000,
    "anchors": "&a " * 10_000 + "x",
    "digits": "a: " + "1" * 1_000_000,
    "decimals": "a: ." + "1" * 1_000_000,
    "parentheses": "a: [" + "f(a," * 20_000 + "]",
    "directives": "%\n" * 50_000,
    "controls": "\x00" * 100_000,
    "quote": "a: '" + "x" * 1_000_000,
    "newlines": "\n" * 500_000,
    "duplicates": "a: {" + "b, " * 20_000,
}


@pytest.mark.parametrize("name", BOMBS)
def test_bombs_end_in_findings(name: str) -> None:
    _, found = read(BOMBS[name])
    assert 1 <= len(found) <= 1100


def holds(text: str) -> None:
    """Reading ends without an exception, and every finding stands within the text or at its end."""
    findings = Findings()
    document = read_text(text, "net.yaml", findings)
    found = findings.sorted()
    assert document is not None or found
    lines = Lines(findings.sources["net.yaml"])
    for finding in found:
        span = finding.span
        assert 1 <= span.line <= len(lines.starts)
        assert 1 <= span.column <= len(lines.line(span.line)) + 1
        assert (span.line, span.column) <= (span.end_line, span.end_column)
        assert finding.message
    shown = show_text(found, findings.sources)
    assert not any(
        unicodedata.category(character) in ("Cc", "Cs", "Zl", "Zp") for character in shown if character != "\n"
    )


PIECES = [
    *"  \n\t:,-?#'\"|>%@`&*!~\\()[]{}a1é\x00\u2028\ud800",
    ": ",
    "- ",
    "&a ",
    "*a",
    "!x ",
    "<<: ",
    "---\n",
    "...\n",
]
RAW = {"Cc", "Cs", "Zl", "Zp"}
fuzz = settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.too_slow])


@fuzz
@given(st.one_of(st.text(max_size=60), st.lists(st.sampled_from(PIECES), max_size=30).map("".join)))
def test_any_text_is_read_or_refused(text: str) -> None:
    holds(text)


@fuzz
@given(st.lists(st.tuples(st.integers(0, len(SPEC)), st.integers(0, 6), st.sampled_from(PIECES)), max_size=4))
def test_any_change_of_a_spec_is_read_or_refused(changes: list[tuple[int, int, str]]) -> None:
    text = SPEC
    for at, gone, new in changes:
        text = text[:at] + new + text[at + gone :]
    holds(text)
    holds(text)


def theirs(node: yaml.Node) -> object:
    """What another parser of YAML finds, and where."""
    begin, end = ((mark.line + 1, mark.column + 1) for mark in (node.start_mark, node.end_mark))
    if isinstance(node, yaml.ScalarNode):
        value = node.value if node.style else resolve(node.value)
        is_there = begin != end and node.style not in ("|", ">")
        return (repr(value), begin, end) if is_there else repr(value)
    if isinstance(node, yaml.MappingNode):
        return begin, [(theirs(key), theirs(value)) for key, value in node.value]
    return [theirs(item) for item in node.value]


def ours(node: Node, text: str) -> object:
    """The same of what we find."""
    begin, end = node.span[1:3], node.span[3:]
    if isinstance(node, Scalar):
        block = node.written is not None and text[node.written.begin] in "|>"
        return (repr(node.value), begin, end) if begin != end and not block else repr(node.value)
    if isinstance(node, Mapping):
        return begin, [(ours(entry.key, text), ours(entry.value, text)) for entry in node.entries]
    return [ours(item, text) for item in node.items]


def another(text: str) -> list[yaml.Node] | None:
    """The documents that another parser finds; None where it refuses the text."""
    try:
        return list(yaml.compose_all(text, yaml.CSafeLoader))
    except yaml.YAMLError:
        return None


ROOT = Path(__file__).parent.parent
TEXTS = [
    path.read_text(encoding="utf-8", errors="replace")
    for folder in ("specs", "tests/errors", "neurovis_spec")
    for path in sorted((ROOT / folder).rglob("*.yaml"))
]
SOUND = [path.read_text(encoding="utf-8") for path in sorted((ROOT / "specs").glob("*.yaml"))]
MIXED = [
    SPEC,
    *(text for text, *_ in SYNTAX),
    *(text for text, *_ in REFUSALS),
    *(text for text in TEXTS if len(text) < 1000),
]


def test_all_our_specs_say_the_same_to_another_parser() -> None:
    compared = 0
    for text in TEXTS:
        document, found = read(text)
        nodes = another(text)
        if all(item.code not in ("alias", "tag") for item in found):
            assert (nodes is None) == any(item.code == "yaml-syntax" for item in found), text
        if nodes is not None and document is not None and not found:
            assert ours(document.root, text) == theirs(nodes[0])
            compared += 1
    assert compared > 300


def scalars(node: Node) -> list[Scalar]:
    """The keys and values of a tree, in the order of the text."""
    match node:
        case Scalar():
            return [node]
        case Mapping(entries=entries):
            return [scalar for entry in entries for part in entry for scalar in scalars(part)]
    return [scalar for item in node.items for scalar in scalars(item)]


@pytest.mark.parametrize("text", [SPEC, *SOUND])
def test_nothing_but_blanks_comments_and_punctuation_lies_between_values(text: str) -> None:
    tree = read_any(text, "x")
    lines = Lines(text)
    between, at = "", 0
    for scalar in () if tree is None else scalars(tree):
        between += text[at : lines.starts[scalar.span.line - 1] + scalar.span.column - 1]
        at = lines.starts[scalar.span.end_line - 1] + scalar.span.end_column - 1
    assert re.fullmatch(r"([\s:,\[\]{}?]|-(?=\s)|---|#.*)*", between), between


def without_tabs(text: str, root: Node) -> str:
    """The text with blanks for tabs on the lines that hold nothing, or a comment alone."""
    held = {line for one in scalars(root) for line in range(one.span.line, one.span.end_line + 1)}
    lines = text.splitlines(keepends=True)
    for number, line in enumerate(lines, 1):
        if number not in held and re.fullmatch(r"[ \t]*(#.*)?\s*", line):
            lines[number - 1] = line.replace("\t", " ")
    return "".join(lines)


BARE = st.text("\t ", max_size=3).flatmap(lambda blanks: st.sampled_from(("", "# c", "#\tc")).map(blanks.__add__))


@given(st.lists(BARE, min_size=6, max_size=6))
def test_lines_without_values_may_hold_tabs(bare: list[str]) -> None:
    """YAML takes them for blanks there, and so may stand between lists, keys, a key and its value, and at the end."""
    parts = ("", "a:\n", "  b: 1\n", "  c:\n", "  - x\n", "  - [1,\n", "     2]\nd: 2\n")
    assert plain(root("".join(f"{part}{line}\n" for part, line in zip(parts, [*bare, ""], strict=True)))) == {
        "a": {"b": 1, "c": ["x", [1, 2]]},
        "d": 2,
    }


@fuzz
@given(
    st.sampled_from(MIXED),
    st.lists(st.tuples(st.integers(0, 10_000), st.integers(0, 4), st.sampled_from(PIECES)), max_size=4),
)
def test_what_we_accept_says_the_same_to_another_parser(text: str, changes: list[tuple[int, int, str]]) -> None:
    """But for ``{a:?b}``, which is a text to later versions of YAML alone, and tabs on lines without values."""
    for at, gone, new in changes:
        at %= len(text) + 1
        text = text[:at] + new + text[at + gone :]
    text += "\n"
    document, found = read(text)
    if document is not None and not found and ":?" not in text:
        nodes = another(text) or another(without_tabs(text, document.root))
        assert nodes is not None
        assert ours(document.root, text) == theirs(nodes[0])


@pytest.mark.parametrize("text", ["a: [{b: 1}]", "a: [", "a: " + "[" * 100], ids=["right", "wrong", "deep"])
def test_the_search_for_garbage_is_left_as_it_was(text: str) -> None:
    assert gc.isenabled()
    read(text)
    assert gc.isenabled()
    gc.disable()
    try:
        read(text)
        assert not gc.isenabled()
    finally:
        gc.enable()


@pytest.mark.parametrize(
    "braces",
    [
        *("{}", "{ }", "{a: 1}", "{ a: 1 , b: tanh }", "{a: 1,}", "{a: 1,b: -2}", "{A -> B: .5}", "{a: 1, a: 2}"),
        *("{a:1}", "{a: {b: 1}}", "{a: [1]}", "{a: 1e999}", "{a: 1} x", "{a: 1, b}", "{a: '1'}", "{true: 1}", "{a: 1]"),
    ],
)
@pytest.mark.parametrize("key", ["A", "A -> B", "yes", "true", "B", "A" * 70])
def test_braces_on_a_line_are_the_same_without_a_second_look(braces: str, key: str) -> None:
    def read(end: str) -> tuple[object, list[tuple[str, object, str]]]:
        findings = Findings()
        document = read_text(f"n:\n  B: 1\n  {key}: {braces}{end}\n  C: 2\n", "x", findings)
        return document, [(item.code, item.span, item.message) for item in findings.sorted()]

    assert read("") == read(" #")
