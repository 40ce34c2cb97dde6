"""Findings for programs: SARIF 2.1.0, the commands of GitHub, and what the command line does with them; completion."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from hypothesis import given
from hypothesis import strategies as st
from jsonschema import Draft202012Validator

import neurovis_spec as nv
from neurovis_spec.cli.commands import COMMANDS, neurovis
from neurovis_spec.diagnostics import Diagnostic, Severity, Span
from neurovis_spec.findings_formats import SCHEMA, to_github, to_json, to_sarif

BAD = "neurovis: 1\nname: x\nneurons:\n  A: {activation: tahn}\n  B: {bias: cos(fi)}\n"
ODD = "neurovis: 1\nname: x\nparameters: {gain: 2}\nneurons: {A: {}}\n"

TEXT = {"type": "object", "required": ["text"], "properties": {"text": {"type": "string", "minLength": 1}}}
LINE = {"type": "integer", "minimum": 1}
#: What the SARIF schema (OASIS, sarif-schema-2.1.0.json) demands of the parts that we write, and nothing beside them.
SARIF = {
    "type": "object",
    "required": ["version", "runs"],
    "additionalProperties": False,
    "properties": {
        "$schema": {"const": SCHEMA},
        "version": {"const": "2.1.0"},
        "runs": {"type": "array", "minItems": 1, "maxItems": 1, "items": {"$ref": "#/$defs/run"}},
    },
    "$defs": {
        "run": {
            "type": "object",
            "required": ["tool", "results"],
            "additionalProperties": False,
            "properties": {
                "tool": {
                    "type": "object",
                    "required": ["driver"],
                    "properties": {"driver": {"$ref": "#/$defs/driver"}},
                },
                "columnKind": {"enum": ["utf16CodeUnits", "unicodeCodePoints"]},
                "results": {"type": "array", "items": {"$ref": "#/$defs/result"}},
            },
        },
        "driver": {
            "type": "object",
            "required": ["name"],
            "additionalProperties": False,
            "properties": {
                "name": {"type": "string"},
                "version": {"type": "string"},
                "rules": {"type": "array", "uniqueItems": True, "items": {"$ref": "#/$defs/rule"}},
            },
        },
        "rule": {
            "type": "object",
            "required": ["id"],
            "additionalProperties": False,
            "properties": {
                "id": {"type": "string", "minLength": 1},
                "shortDescription": TEXT,
                "help": {**TEXT, "required": ["text", "markdown"]},
                "defaultConfiguration": {
                    "type": "object",
                    "properties": {"level": {"enum": ["none", "note", "warning", "error"]}},
                },
            },
        },
        "result": {
            "type": "object",
            "required": ["message", "ruleId", "ruleIndex", "level", "locations"],
            "additionalProperties": False,
            "properties": {
                "ruleId": {"type": "string", "minLength": 1},
                "ruleIndex": {"type": "integer", "minimum": 0},
                "level": {"enum": ["none", "note", "warning", "error"]},
                "message": TEXT,
                "locations": {
                    "type": "array",
                    "minItems": 1,
                    "items": {
                        "type": "object",
                        "required": ["physicalLocation"],
                        "properties": {"physicalLocation": {"$ref": "#/$defs/place"}},
                    },
                },
            },
        },
        "place": {
            "type": "object",
            "required": ["artifactLocation", "region"],
            "properties": {
                "artifactLocation": {
                    "type": "object",
                    "required": ["uri"],
                    "properties": {
                        "uri": {"type": "string", "pattern": r"^([A-Za-z0-9._~!$&'()*+,;=:@/-]|%[0-9A-F]{2})+$"}
                    },
                },
                "region": {
                    "type": "object",
                    "required": ["startLine", "startColumn", "endLine", "endColumn"],
                    "additionalProperties": False,
                    "properties": dict.fromkeys(("startLine", "startColumn", "endLine", "endColumn"), LINE),
                },
            },
        },
    },
}


def finding(message: str = "wrong", file: str = "net.yaml", hint: str | None = None, lines: int = 0) -> Diagnostic:
    return Diagnostic("unknown-name", message, Span(file, 3, 5, 3 + lines, 9), "error", hint)


def sarif(*found: Diagnostic) -> dict[str, object]:
    log = json.loads(to_sarif(found))
    Draft202012Validator(SARIF).validate(log)
    assert isinstance(log, dict)
    (run,) = log["runs"]
    assert isinstance(run, dict)
    return run


def results(*found: Diagnostic) -> list[dict[str, object]]:
    made = sarif(*found)["results"]
    assert isinstance(made, list)
    return made


def place(result: dict[str, object]) -> dict[str, object]:
    locations = result["locations"]
    assert isinstance(locations, list)
    (location,) = locations
    physical = location["physicalLocation"]
    assert isinstance(physical, dict)
    return physical


def call(*arguments: str) -> Result:
    return CliRunner().invoke(neurovis, list(arguments))


# SARIF


def test_a_run_names_the_program_and_its_rules() -> None:
    odd = Diagnostic("unused-parameter", "no use", Span("b.yaml", 1, 1, 1, 2), "warning")
    run = sarif(finding(), odd, finding("again"))
    tool = run["tool"]
    assert isinstance(tool, dict)
    driver = tool["driver"]
    assert (driver["name"], driver["version"]) == ("NeuroVis", nv.__version__)
    assert [rule["id"] for rule in driver["rules"]] == ["unknown-name", "unused-parameter"]
    assert [rule["defaultConfiguration"]["level"] for rule in driver["rules"]] == ["error", "warning"]
    assert "Right:" in driver["rules"][0]["help"]["text"]
    assert "```yaml\nneurovis: 1\n" in driver["rules"][0]["help"]["markdown"]
    assert [result["ruleIndex"] for result in results(finding(), odd, finding("again"))] == [0, 1, 0]


def test_a_region_counts_code_points_from_one() -> None:
    run = sarif(finding())
    assert run["columnKind"] == "unicodeCodePoints"
    (result,) = results(finding())
    assert place(result)["region"] == {"startLine": 3, "startColumn": 5, "endLine": 3, "endColumn": 9}


def test_the_hint_is_part_of_the_message() -> None:
    (result,) = results(finding("wrong", hint="write it right"))
    assert result["message"] == {"text": "wrong\nhelp: write it right"}


@pytest.mark.parametrize(
    ("file", "uri"),
    [
        ("nets/a b.yaml", "nets/a%20b.yaml"),
        ("/nets/ä#1.yaml", "file:///nets/%C3%A4%231.yaml"),
        ("<stdin>", "%3Cstdin%3E"),
        ("c:odd.yaml", "c%3Aodd.yaml"),
        ("100%.yaml", "100%25.yaml"),
    ],
)
def test_a_file_is_a_uri(file: str, uri: str) -> None:
    (result,) = results(finding(file=file))
    assert place(result)["artifactLocation"] == {"uri": uri}


def test_a_code_of_a_plug_in_is_a_rule_without_help() -> None:
    odd = Diagnostic("their-own", "wrong", Span("a.yaml", 1, 1, 1, 1))
    tool = sarif(odd)["tool"]
    assert isinstance(tool, dict)
    assert tool["driver"]["rules"] == [{"id": "their-own"}]


def test_nothing_found_is_a_run_without_results() -> None:
    assert sarif()["results"] == []


# GitHub


def test_a_command_for_each_finding() -> None:
    odd = Diagnostic("unused-parameter", "no use", Span("b.yaml", 7, 1, 7, 2), "warning")
    assert to_github([finding("wrong", hint="mend it"), odd]).split("\n") == [
        "::error file=net.yaml,line=3,col=5,endColumn=9,title=unknown-name::wrong%0Ahelp: mend it",
        "::warning file=b.yaml,line=7,col=1,endColumn=2,title=unused-parameter::no use",
    ]
    assert to_github([]) == ""


def test_several_lines_have_no_columns() -> None:
    assert to_github([finding(lines=2)]) == "::error file=net.yaml,line=3,endLine=5,title=unknown-name::wrong"


def test_what_would_end_a_part_is_escaped() -> None:
    line = to_github([finding("50% of a::b,\nc", file="a,b:c%.yaml")])
    assert line.endswith("::50%25 of a::b,\\x0ac")
    assert "file=a%2Cb%3Ac%25.yaml,line=" in line


def github_reads(line: str) -> tuple[str, dict[str, str], str]:
    """What a runner makes of a line (actions/runner, ActionCommand.TryParseV2)."""
    match = re.fullmatch(r"::(\w+) (.*?)::(.*)", line)
    assert match is not None
    unescaped = {"%0D": "\r", "%0A": "\n", "%3A": ":", "%2C": ",", "%25": "%"}

    def plain(text: str) -> str:
        return re.sub("%(0D|0A|3A|2C|25)", lambda found: unescaped[found.group()], text)

    pairs = (pair.partition("=") for pair in match[2].split(","))
    return match[1], {key: plain(value) for key, _, value in pairs}, plain(match[3])


@given(st.text(min_size=1, max_size=30), st.text(min_size=1, max_size=30), st.sampled_from(["error", "warning"]))
def test_any_text_survives_both_formats(message: str, file: str, severity: Severity) -> None:
    found = Diagnostic("unknown-name", message, Span(file, 1, 2, 1, 3), severity, "50%")
    written = to_github([found])
    assert "\n" not in written
    assert "\r" not in written
    command, properties, text = github_reads(written)
    assert command == severity
    assert (properties["line"], properties["title"]) == ("1", "unknown-name")
    assert text.endswith("help: 50%")
    if message.isprintable() and message.isascii():
        assert text == f"{message}\nhelp: 50%"
    if file.isprintable() and file.isascii():
        assert properties["file"] == file
    (result,) = results(found)
    assert result["message"] == {"text": f"{message}\nhelp: 50%"}


# The command line


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for name, text in (("bad.yaml", BAD), ("odd.yaml", ODD), ("good.yaml", ODD.replace("{gain: 2}", "{}"))):
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


def test_all_formats_show_the_same_findings(folder: Path) -> None:
    found = json.loads(call("validate", "bad.yaml", "odd.yaml", "--format", "json").stdout)
    assert [item["code"] for item in found] == ["unknown-activation", "unknown-name", "unused-parameter"]
    log = json.loads(call("validate", "bad.yaml", "odd.yaml", "--format", "sarif").stdout)
    Draft202012Validator(SARIF).validate(log)
    places = [result["locations"][0]["physicalLocation"] for result in log["runs"][0]["results"]]
    assert [(item["file"], item["line"], item["column"]) for item in found] == [
        (place["artifactLocation"]["uri"], place["region"]["startLine"], place["region"]["startColumn"])
        for place in places
    ]
    lines = call("validate", "bad.yaml", "odd.yaml", "--format", "github").stdout.splitlines()
    assert [github_reads(line)[1]["title"] for line in lines] == [item["code"] for item in found]
    shown = call("validate", "bad.yaml", "odd.yaml").stderr
    assert re.findall(r"^(\S+):(\d+):(\d+): \w+\[", shown, re.MULTILINE) == [
        (item["file"], str(item["line"]), str(item["column"])) for item in found
    ]


@pytest.mark.parametrize("form", ["json", "sarif", "github"])
def test_status_and_streams(folder: Path, form: str) -> None:
    for spec, strict, status in (
        ("bad.yaml", False, 1),
        ("odd.yaml", False, 0),
        ("odd.yaml", True, 1),
        ("good.yaml", True, 0),
    ):
        result = call("validate", spec, "--format", form, *(["--strict"] if strict else []))
        assert (result.exit_code, result.stderr) == (status, ""), (spec, strict)


def test_strict_makes_errors_of_warnings(folder: Path) -> None:
    log = json.loads(call("validate", "odd.yaml", "--format", "sarif", "--strict").stdout)
    assert [result["level"] for result in log["runs"][0]["results"]] == ["error"]
    assert call("validate", "odd.yaml", "--format", "github", "--strict").stdout.startswith("::error file=odd.yaml,")
    assert "error[unused-parameter]" in call("validate", "odd.yaml", "--strict").stderr


# The text


def test_line_ends_of_windows_are_fine(folder: Path) -> None:
    unix = nv.compile_text(ODD)
    (folder / "crlf.yaml").write_bytes(ODD.replace("\n", "\r\n").encode())
    windows = nv.compile(folder / "crlf.yaml")
    assert windows.hash == unix.hash
    assert [found.span.line for found in windows.warnings] == [3]
    (folder / "crlf.yaml").write_bytes(BAD.replace("\n", "\r\n").encode())
    (folder / "lf.yaml").write_text(BAD, encoding="utf-8")
    shown = call("validate", "crlf.yaml").stderr
    assert shown == call("validate", "lf.yaml").stderr.replace("lf.yaml", "crlf.yaml")
    assert "\r" not in shown
    assert "\\x0d" not in shown


def test_a_tab_is_shown_where_it_is(folder: Path) -> None:
    (folder / "tab.yaml").write_text("neurovis: 1\nname: x\nneurons:\n\tA: {}\n", encoding="utf-8")
    lines = call("validate", "tab.yaml").stderr.splitlines()
    assert lines[0].startswith("tab.yaml:4:1: error[yaml-syntax]: a tab in the indentation")
    assert lines[1:3] == [" 4 |     A: {}", "   | ^^^^"]


def test_carets_stand_under_what_is_behind_a_tab(folder: Path) -> None:
    (folder / "tab.yaml").write_text("neurovis: 1\nname: x\nneurons: {A: {bias:\tfi}}\n", encoding="utf-8")
    lines = call("validate", "tab.yaml").stderr.splitlines()
    assert lines[0].startswith("tab.yaml:3:21: error[unknown-name]")
    assert lines[1].index("fi") == lines[2].index("^^")


def test_another_version_is_answered_with_what_is_read() -> None:
    with pytest.raises(nv.SpecError) as caught:
        nv.compile_text("neurovis: 2\nname: x\nwhatever: [1, 2]\n")
    (found,) = caught.value.diagnostics
    assert (found.code, found.span.line, found.span.column) == ("language-version", 1, 11)
    assert "this program reads version 1" in found.message


# Completion


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_is_a_script(shell: str) -> None:
    script = completion({"_NEUROVIS_COMPLETE": f"{shell}_source"})
    assert f"_NEUROVIS_COMPLETE={shell}_complete" in script
    readme = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")
    assert "_NEUROVIS_COMPLETE=bash_source neurovis" in readme


def test_completion_knows_commands_and_options() -> None:
    words = {"_NEUROVIS_COMPLETE": "bash_complete", "COMP_WORDS": "neurovis ", "COMP_CWORD": "1"}
    assert completion(words).split() == [f"plain,{name}" for name in COMMANDS]
    words |= {"COMP_WORDS": "neurovis validate --format s", "COMP_CWORD": "3"}
    assert completion(words).split() == ["plain,sarif"]


def completion(environment: dict[str, str]) -> str:
    command = [sys.executable, "-c", "import sys; sys.argv[0] = 'neurovis'; from neurovis_spec.cli import main; main()"]
    ran = subprocess.run(
        command, env={"PATH": "/usr/bin:/bin", **path(), **environment}, capture_output=True, check=False
    )
    assert ran.stderr == b""
    return ran.stdout.decode()


def path() -> dict[str, str]:
    """Where this process finds its modules, for one that is called."""
    return {"PYTHONPATH": ":".join(entry for entry in sys.path if entry)}


def test_json_and_sarif_hold_no_control_character() -> None:
    odd = finding("a\x7fb\x1b[0m\u2028")
    for text in (to_json([odd]), to_sarif([odd])):
        assert all(character.isprintable() or character == "\n" for character in text)
