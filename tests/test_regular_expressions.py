"""Regular expressions hold nothing that a supported Python gets wrong.

Possessive quantifiers and atomic groups came with Python 3.11; up to 3.11.4 (Debian 12 has 3.11.2) these keep what does
not match: ``re.match(r"(?:a|b(?!c))*+", "abc")`` matches all of it.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
SOURCES = sorted(
    path for folder in ("neurovis_spec", "layouts", "renderers", "bodies") for path in (ROOT / folder).rglob("*.py")
)
#: What in a pattern says nothing about a quantifier behind it: an escaped character, and a set of characters.
_SINGLE = re.compile(r"\\.|\[\^?\]?(?:\\.|[^\]\\])*\]", re.DOTALL)
_REFUSED = re.compile(r"[*+?}]\+|\(\?>")


def refused(pattern: str) -> bool:
    return _REFUSED.search(_SINGLE.sub("x", pattern)) is not None


@pytest.mark.parametrize("pattern", [r"(?:a|b(?!c))*+", "a++", "a?+", "[a]{2}+", "(?>a)", r"\\*+", "*+", "[]a]*+"])
def test_what_is_refused(pattern: str) -> None:
    assert refused(pattern)


@pytest.mark.parametrize("pattern", [r"[*+]", r"\*+", r"a+[+]", r"[^]*+]", r"\{2\}+"])
def test_what_is_not(pattern: str) -> None:
    re.compile(pattern)
    assert not refused(pattern)


def texts_of_patterns(sources: Iterable[tuple[str, str]]) -> Iterator[tuple[str, str]]:
    """The texts that patterns are made of, each with its place: those in calls of ``re``, and those of the constants
    named there, whichever module has them."""
    constants: dict[str, list[tuple[str, ast.AST]]] = {}
    todo: list[tuple[str, ast.AST]] = []
    for file, source in sources:
        tree = ast.parse(source)
        for statement in tree.body:
            for name, value in assigned(statement):
                constants.setdefault(name, []).append((file, value))
        if "import re\n" in source:
            todo += [(file, node) for node in ast.walk(tree) if is_call_of_re(node)]
    while todo:
        file, root = todo.pop()
        for node in ast.walk(root):
            if isinstance(node, ast.Constant) and isinstance(node.value, str | bytes):
                text = node.value if isinstance(node.value, str) else node.value.decode("latin-1")
                yield f"{file}:{node.lineno}", text
            elif isinstance(node, ast.Name):
                todo += constants.pop(node.id, [])


def assigned(statement: ast.stmt) -> Iterator[tuple[str, ast.expr]]:
    """The names, with their values, that a statement gives to constants."""
    if isinstance(statement, ast.Assign | ast.AnnAssign) and statement.value is not None:
        for target in statement.targets if isinstance(statement, ast.Assign) else [statement.target]:
            if isinstance(target, ast.Name) and target.id.isupper():
                yield target.id, statement.value


def is_call_of_re(node: ast.AST) -> bool:
    if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)):
        return False
    return isinstance(node.func.value, ast.Name) and node.func.value.id == "re"


def test_texts_of_patterns_are_found_where_they_have_a_name() -> None:
    one, other = 'A: str = "x" + "*+"\n', 'import re\nB = re.compile(rf"{A}y")\nC = "++"\n'
    assert sorted(texts_of_patterns([("one", one), ("other", other)])) == [
        ("one:1", "*+"),
        ("one:1", "x"),
        ("other:2", "y"),
    ]


def test_no_pattern_holds_what_a_supported_python_gets_wrong() -> None:
    texts = list(texts_of_patterns((str(path.relative_to(ROOT)), path.read_text(encoding="utf-8")) for path in SOURCES))
    assert [found for found in texts if refused(found[1])] == []
    assert len(texts) > 200
