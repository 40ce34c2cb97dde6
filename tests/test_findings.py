"""Findings as people and programs see them."""

from __future__ import annotations

import json

from hypothesis import given
from hypothesis import strategies as st

from neurovis_spec.diagnostics import Diagnostic, Findings, Span, printable, show_text
from neurovis_spec.findings_formats import to_json


def finding(line: int, column: int, end: int, message: str = "wrong", hint: str | None = None) -> Diagnostic:
    return Diagnostic("some-code", message, Span("net.yaml", line, column, line, end), "error", hint)


def shown(text: str, *diagnostics: Diagnostic) -> list[str]:
    return show_text(diagnostics, {"net.yaml": text}).split("\n")


def test_a_finding_with_its_line_carets_and_help() -> None:
    text = "neurovis: 1\nneurons:\n  C: {activation: tahn}\n"
    assert shown(text, finding(3, 19, 23, "no activation 'tahn'", "did you mean 'tanh'?")) == [
        "net.yaml:3:19: error[some-code]: no activation 'tahn'",
        " 3 |   C: {activation: tahn}",
        "   |                   ^^^^",
        "help: did you mean 'tanh'?",
        "",
        "1 error",
    ]


def test_several_findings_and_what_is_left_out() -> None:
    warning = Diagnostic("w", "odd", Span("net.yaml", 1, 1, 1, 2), "warning")
    many = [finding(1, 1, 2)] * 3 + [warning]
    lines = show_text(many, {"net.yaml": "a: 1"}, most=2).split("\n")
    assert lines[3] == ""
    assert lines[-3:] == ["… and 2 more", "", "3 errors, 1 warning"]
    assert show_text([warning] * 2, {}).endswith("2 warnings")
    assert show_text([], {}) == ""


def test_carets_line_up_behind_tabs_and_wide_characters() -> None:
    lines = shown("a:\t\tb: x\n", finding(1, 8, 9))
    assert lines[1:3] == [" 1 | a:        b: x", "   |              ^"]
    lines = shown("日本e\u0301: x\n", finding(1, 7, 8))
    assert lines[2] == "   | " + " " * 7 + "^"
    assert shown("日本: x\n", finding(1, 1, 3))[2] == "   | ^^^^"


def test_a_long_line_is_shown_around_the_place() -> None:
    text = "k" * 5000 + " bad " + "j" * 5000
    lines = shown(text, finding(1, 5002, 5005))
    assert len(lines[1]) < 120
    caret = lines[2].index("^")
    assert lines[1][caret : caret + 3] == "bad"
    assert lines[2].count("^") == 3
    assert lines[1].startswith(" 1 | …k")
    assert lines[1].endswith("j…")


def test_a_place_over_several_lines_and_one_at_the_end() -> None:
    whole = Diagnostic("c", "m", Span("net.yaml", 1, 4, 3, 2))
    assert shown("a: [1,\n  2\n]\n", whole)[1:3] == [" 1 | a: [1,", "   |    ^^^"]
    assert shown("a: 1\n", finding(2, 1, 1))[1:3] == [" 2 |", "   | ^"]
    assert shown("a: 1", finding(1, 5, 5))[2] == "   |     ^"


def test_a_finding_about_a_file_that_was_not_read_has_no_line() -> None:
    assert show_text([finding(1, 1, 1)], {}) == "net.yaml:1:1: error[some-code]: wrong\n\n1 error"


def test_control_characters_are_escaped() -> None:
    text = "a: \x1b[31m\u202ex\n"
    lines = shown(text, finding(1, 10, 11, "bad \x1b[2J\nname", "use \x07"))
    assert lines[0].endswith(r"bad \x1b[2J\x0aname")
    assert lines[1] == r" 1 | a: \x1b[31m\u202ex"
    assert lines[2].index("^") == lines[1].index("x", 18)
    assert lines[3] == r"help: use \x07"


@given(st.text(), st.integers(1, 5), st.integers(1, 300), st.integers(0, 300))
def test_nothing_raw_is_shown(text: str, line: int, column: int, width: int) -> None:
    place = Span("net.yaml", line, column, line, column + width)
    output = show_text([Diagnostic("c", text, place, hint=text)], {"net.yaml": text})
    assert not any((ord(c) < 32 and c != "\n") or 127 <= ord(c) < 160 or 0xD800 <= ord(c) < 0xE000 for c in output)
    assert not any(c in output for c in "\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069\u2028\u2029")
    output.encode()


@given(st.text(alphabet=st.characters(min_codepoint=32, max_codepoint=126)))
def test_what_is_harmless_stays(text: str) -> None:
    assert printable(text) == text


def test_json_holds_every_field() -> None:
    first = finding(3, 1, 4, "bad \x1b\x7fé", "help")
    second = Diagnostic("w", "odd", Span("b.yaml", 1, 2, 3, 4), "warning")
    written = to_json([first, second])
    assert written.isascii()
    assert written.replace("\n", " ").isprintable()
    assert json.loads(written) == [
        {
            "code": "some-code",
            "severity": "error",
            "message": "bad \x1b\x7fé",
            "file": "net.yaml",
            "line": 3,
            "column": 1,
            "end_line": 3,
            "end_column": 4,
            "hint": "help",
        },
        {
            "code": "w",
            "severity": "warning",
            "message": "odd",
            "file": "b.yaml",
            "line": 1,
            "column": 2,
            "end_line": 3,
            "end_column": 4,
            "hint": None,
        },
    ]
    assert json.loads(to_json([])) == []


def test_findings_merge_by_place_and_code() -> None:
    place, other = Span("net.yaml", 1, 1, 1, 5), Span("net.yaml", 2, 1, 2, 5)
    found = Findings()
    found.warning("odd", place, "it is odd")
    found.error("wrong-size", place, "7 where there are 3")
    found.error("wrong-size", place, "7 where there are 4 of 'another' make")  # of another instance
    found.error("unknown-name", place, "what follows from it")
    found.error("file-format", other, "row 7 is wrong", key=7)
    found.error("not-finite", other, "row 2 is infinite", key=2)
    assert found.errors == 5
    assert found.is_invalid(place)
    assert [item.message for item in found.sorted()] == ["7 where there are 3", "row 7 is wrong", "row 2 is infinite"]


def test_what_could_not_be_read_has_no_other_findings() -> None:
    place = Span("net.yaml", 1, 1, 1, 2)
    found = Findings()
    found.error("yaml-syntax", place, "cannot be read")
    found.unread(place)
    found.error("missing-key", place, "what follows", key="name")
    assert [item.message for item in found.sorted()] == ["cannot be read"]
