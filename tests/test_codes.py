"""The catalogue of findings: it holds what the source can say and nothing else, and its examples earn their codes."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

import neurovis_spec as nv
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.codes import CHAPTERS, VALIDATE, Code, catalogue, page
from neurovis_spec.diagnostics import Diagnostic, Findings
from neurovis_spec.layout.file import parse

ROOT = Path(__file__).parents[1]
SOURCES = [
    path for folder in ("neurovis_spec", "layouts", "renderers") for path in sorted((ROOT / folder).rglob("*.py"))
]
CODES = list(catalogue().values())
WITH_EXAMPLE = [code for code in CODES if code.bad is not None]

#: Who notes a finding or raises one, and the place of the code among the arguments.
EMITTERS = {
    "error": 0,
    "warning": 0,
    "_error": 0,
    "_at": 0,
    "Diagnostic": 0,
    "ExpressionError": 0,
    "LayoutRefusalError": 0,
    "CellError": 0,
    "in_cell": 4,
    "in_row": 3,
    "_in_line": 2,
    "FileFault": 0,
    "NumberRangeError": 0,
    "NotWith": 3,
    "Needs": 3,
    "OneOf": 3,
    "Syntax": 4,
    "fault": 2,
    "refuse": 4,
    "report": 0,
    "CodedWarning": 0,
}
#: Codes that are put together, and codes that stand in a table or a default.
MADE = {"f'unknown-{what}'": {"unknown-activation", "unknown-model", "unknown-rule", "unknown-synapse"}}
ELSEWHERE = {"wrong-type", "conflicting-keys", "yaml-syntax", "no-comprehensions", "foreign-operator", "useless-allow"}
SHAPE = re.compile(r"[a-z][a-z0-9]*(-[a-z0-9]+)+|alias|anchor|directive|internal|tag|transposed|unit")


@cache
def nodes() -> tuple[tuple[str, ast.Call | ast.Constant], ...]:
    """The calls and constants of the source, each with the name of its file."""
    return tuple(
        (path.name, node)
        for path in SOURCES
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call | ast.Constant)
    )


def emitted() -> Iterator[tuple[str, str]]:
    """Code and place of every finding that the source can note. A name in place of the code passes one on."""
    for file, node in nodes():
        if isinstance(node, ast.Constant):
            continue
        function = node.func
        name = function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", "")
        place = EMITTERS.get(name)
        if place is None:
            continue
        given = [keyword.value for keyword in node.keywords if keyword.arg == "code"]
        given += node.args[place : place + 1]
        for value in given[:1]:
            for part in ast.walk(value):
                if isinstance(part, ast.Constant) and isinstance(part.value, str) and SHAPE.fullmatch(part.value):
                    yield part.value, f"{file}:{node.lineno}"
            if isinstance(value, ast.JoinedStr) and SHAPE.match(ast.unparse(value)[2:].replace("{", "x")):
                for made in MADE[ast.unparse(value)]:
                    yield made, f"{file}:{node.lineno}"


def texts() -> frozenset[str]:
    """Every text constant of the source."""
    return frozenset(
        node.value for _, node in nodes() if isinstance(node, ast.Constant) and isinstance(node.value, str)
    )


def test_every_code_of_the_source_is_in_the_catalogue() -> None:
    found = dict(emitted())
    assert len(found) > 90, "the search has gone blind"
    assert {code: place for code, place in found.items() if code not in catalogue()} == {}


def test_every_code_of_the_catalogue_is_in_the_source() -> None:
    there = texts().union(*MADE.values())
    assert [code for code in catalogue() if code not in there] == []
    passed_on = set(catalogue()) - dict(emitted()).keys() - ELSEWHERE
    assert {code for code in passed_on if not code.startswith("layout-")} == set()


def test_the_catalogue_is_a_reference() -> None:
    assert len({code.meaning for code in CODES}) == len(CODES)
    for code in CODES:
        assert code.chapter in CHAPTERS
        assert re.fullmatch(r"[A-Z].*\.", code.meaning), code.name
        assert (code.bad is None) == (code.rare is not None), f"{code.name}: examples, or why there are none"


def spec_folder(code: Code, text: str, folder: Path) -> Path:
    """A folder with the files of a code's example; the spec is ``spec.yaml``."""
    inner = folder / "inner"
    for name, content in {**code.files, "spec.yaml": text}.items():
        path = inner / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(content, encoding=code.encoding)
    return inner


def call(command: str) -> Result:
    result = CliRunner().invoke(neurovis, command.split()[1:])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result


def answers(code: Code, text: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The codes of all findings that an example gets from its command."""
    inner = spec_folder(code, text, folder)
    monkeypatch.chdir(inner)
    if code.command == VALIDATE:
        return [found.code for found in diagnostics(inner / "spec.yaml")]
    if code.command == "layout file":
        findings = Findings()
        parse(text, "spec.yaml", findings)
        return [found.code for found in findings.sorted()]
    return re.findall(r"(?:error|warning)\[([\w-]+)\]", call(code.command).stderr)


def diagnostics(path: Path) -> tuple[Diagnostic, ...]:
    try:
        return nv.compile(path).warnings
    except nv.SpecError as error:
        return error.diagnostics


@pytest.mark.parametrize("code", WITH_EXAMPLE, ids=lambda code: code.name)
def test_the_bad_example_earns_the_code_and_nothing_else(
    code: Code, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert code.bad is not None
    assert answers(code, code.bad, tmp_path, monkeypatch) == [code.name]


@pytest.mark.parametrize("code", WITH_EXAMPLE, ids=lambda code: code.name)
def test_the_good_example_is_good(code: Code, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if code.good is None:
        assert code.command != VALIDATE, "an example on the command line may need another file, not another spec"
        return
    assert answers(code, code.good, tmp_path, monkeypatch) == []


def test_severity_is_what_the_example_gets(tmp_path: Path) -> None:
    for number, code in enumerate(WITH_EXAMPLE):
        if code.command == VALIDATE and code.bad is not None:
            inner = spec_folder(code, code.bad, tmp_path / str(number))
            (found,) = diagnostics(inner / "spec.yaml")
            assert found.severity == code.severity, code.name


@pytest.mark.parametrize(("name", "nearest"), [("unkown-name", "unknown-name"), ("delay-cycle", "delay-0-cycle")])
def test_explain_offers_the_nearest(name: str, nearest: str) -> None:
    result = call(f"neurovis explain {name}")
    assert (result.exit_code, result.stdout) == (1, "")
    assert f"there is no code '{name}'" in result.stderr
    assert f"did you mean '{nearest}'" in result.stderr


@pytest.mark.parametrize("code", CODES, ids=lambda code: code.name)
def test_explain_says_it_all(code: Code) -> None:
    result = call(f"neurovis explain {code.name}")
    assert (result.exit_code, result.stderr) == (0, "")
    assert result.stdout.startswith(f"{code.severity}[{code.name}]: {code.meaning}\n")
    for text in (code.bad, code.good):
        for line in (text or "").split("\n"):
            assert line.rstrip() in result.stdout or not line.isprintable()
    assert (code.rare or "") in result.stdout


def test_explain_takes_the_code_as_findings_show_it() -> None:
    shown = call("neurovis explain unknown-name").stdout
    assert call("neurovis explain error[unknown-name]").stdout == shown
    assert call("neurovis explain [Unknown-Name]").stdout == shown
    assert "warning[useless-allow]: " in call("neurovis explain list").stdout


def test_the_page_is_the_catalogue() -> None:
    """Made anew by: python -m neurovis_spec.codes > docs/errors.md"""
    written = (ROOT / "docs" / "errors.md").read_text(encoding="utf-8")
    assert written == page()
    assert re.findall(r"^### (.*)$", written, re.MULTILINE) == list(catalogue())


def test_the_page_is_printed() -> None:
    printed = subprocess.run([sys.executable, "-m", "neurovis_spec.codes"], capture_output=True, check=True)
    assert printed.stdout.decode() == page()
