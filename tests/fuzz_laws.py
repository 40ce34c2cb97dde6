"""What holds for every text, however broken: the laws that fuzzing looks for a breach of.

In: a text, or an expression. Out: what became of it; AssertionError, or whatever escaped, where a law is broken.

- Nothing but SpecError comes out, and a SpecError holds an error.
- Each finding has a code of the catalogue, a place inside the text it names, and words without Python in them.
- A byte-order mark and the line ends of Windows change neither the network nor the findings.
- What compiles is formatted, once and for all, into the same network; its schema takes it; and it runs.
"""

from __future__ import annotations

import json
import math
import re
import warnings
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import fuzz_expressions

import neurovis_spec as nv
from neurovis_spec.codes import catalogue
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.diagnostics import Diagnostic, Findings, SpecError, show_text
from neurovis_spec.findings_formats import to_json
from neurovis_spec.language.expressions.emit import emit
from neurovis_spec.language.expressions.evaluate import evaluate, evaluate_array
from neurovis_spec.language.expressions.parser import ExpressionError, parse
from neurovis_spec.language.expressions.tree import Binary, Call, Conditional, Draw, Tree, names, walk
from neurovis_spec.language.format.canonical import format_read, format_text
from neurovis_spec.language.yaml.characters import Lines
from neurovis_spec.language.yaml.reader import read_text
from neurovis_spec.language.yaml.source import Mapping, Node, Packed, Scalar, Sequence

if TYPE_CHECKING:
    from jsonschema import Draft202012Validator

FILE = "fuzzed.yaml"
#: What a sentence for an author never holds, unless the author wrote it.
_PYTHON = re.compile(
    r"<class |object at 0x|Traceback|pydantic|numpy|np\.|dtype|NoneType|\[Errno|"
    r"\b(?:Located|Scalar|Mapping|Sequence|Packed|Span|Entry|Formula|Number|Binary|array)\(|"
    r"\b(?:None|True|False|nan|inf|[A-Z]\w+(?:Error|Exception))\b"
)
_QUOTED = re.compile(r"'[^']*' is not finite")
_UNSEEN = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")
#: Networks that are run are no larger.
_MOST_NEURONS, _MOST_CONNECTIONS, _MOST_SIGNALS = 100, 2000, 10_000


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a text: whether it compiled, and the codes of its findings."""

    compiled: bool
    codes: tuple[str, ...]


def check_input(data: bytes, folder: Path) -> Outcome:
    """The laws for what may be no text: a file of bytes that are no UTF-8, a text with half a surrogate pair."""
    outcome: Outcome | None = None
    try:
        data.decode("utf-8")
    except UnicodeDecodeError:
        outcome = _check_bytes(data)
    try:
        return check_text(data.decode("utf-8", "surrogatepass"), folder)
    except UnicodeDecodeError:
        assert outcome is not None
        return outcome


def _check_bytes(data: bytes) -> Outcome:
    with TemporaryDirectory() as folder:
        path = Path(folder) / FILE
        path.write_bytes(data)
        try:
            nv.compile(path)
        except SpecError as error:
            refusal = error
        else:
            raise AssertionError("bytes that are no UTF-8 are a spec")
    _check_findings(refusal.diagnostics, dict(refusal.sources))
    return Outcome(False, tuple(item.code for item in refusal.diagnostics))


def check_text(text: str, folder: Path, *, everything: bool = True) -> Outcome:
    """The laws for a text; ``everything`` asks for those of formatting, schema and running as well."""
    network, found = _compiled(text, folder)
    _check_other_ends(text, folder, network, found)
    if network is not None and everything:
        _check_formatting(text, folder, network)
        _check_schema(text)
        _check_run(network)
    return Outcome(network is not None, tuple(item.code for item in found))


def _compiled(text: str, folder: Path) -> tuple[CompiledNetwork | None, tuple[Diagnostic, ...]]:
    try:
        network = nv.compile_text(text, file=FILE, folder=folder, limit=20_000)
    except SpecError as error:
        refusal = error
    else:
        _check_findings(network.warnings, dict(network.sources))
        assert all(item.severity == "warning" for item in network.warnings), "errors, and a network all the same"
        return network, network.warnings
    _check_findings(refusal.diagnostics, dict(refusal.sources))
    assert any(item.severity == "error" for item in refusal.diagnostics), "a SpecError without an error"
    return None, refusal.diagnostics


def _check_findings(found: tuple[Diagnostic, ...], sources: dict[str, str]) -> None:
    for item in found:
        span = item.span
        assert span.file in sources, item
        lines = Lines(sources[span.file])
        count = len(lines.starts)
        assert 1 <= span.line <= span.end_line <= count, (item, count)
        assert 1 <= span.column <= len(lines.line(span.line)) + 1, item
        assert 1 <= span.end_column <= len(lines.line(span.end_line)) + 1, item
        assert (span.line, span.column) <= (span.end_line, span.end_column), item
        assert item.code in catalogue(), item
        assert catalogue()[item.code].severity == item.severity, item
        for words in (item.message, item.hint):
            if words is not None:
                assert 0 < len(words.strip()) < 400, item
                for match in _PYTHON.finditer(_QUOTED.sub("", words)):  # what a data file says is the author's
                    assert match.group().strip("<( ") in sources[span.file], item
    shown = show_text(found, sources)
    assert not _UNSEEN.search(shown), "a terminal would be sent what it obeys"
    assert [item["code"] for item in json.loads(to_json(found))] == [item.code for item in found]
    to_json(found).encode()
    shown.encode()


def _check_other_ends(text: str, folder: Path, network: CompiledNetwork | None, found: tuple[Diagnostic, ...]) -> None:
    """A byte-order mark changes nothing, nor do other line ends."""
    if "\r" in text or text.startswith("\ufeff"):
        return
    other, same = _compiled("\ufeff" + text.replace("\n", "\r\n"), folder)
    assert _places(found) == _places(same), "line ends of Windows change the findings"
    assert (network is None) == (other is None)
    if network is not None and other is not None:
        assert network.hash == other.hash, "line ends of Windows change the network"


def _places(found: tuple[Diagnostic, ...]) -> list[tuple[str, int, int]]:
    return [(item.code, item.span.line, item.span.column) for item in found]


def _check_formatting(text: str, folder: Path, network: CompiledNetwork) -> None:
    written = format_text(text, FILE, Findings())
    assert written is not None, "what compiles can be formatted"
    assert format_read(written) == written, "formatting twice changes something again"
    again, found = _compiled(written, folder)
    assert again is not None, f"formatting brought errors: {found}"
    assert again.hash == network.hash, "formatting changed the network"


@cache
def _validator() -> Draft202012Validator:
    from jsonschema import Draft202012Validator

    return Draft202012Validator(nv.api.schema())


def _check_schema(text: str) -> None:
    """Editors underline nothing in what compiles."""
    document = read_text(text, FILE, Findings())
    assert document is not None
    wrong = next(_validator().iter_errors(_plain(document.root)), None)
    assert wrong is None, f"the schema refuses what compiles: {wrong.json_path}: {wrong.message}"


def _plain(node: Node) -> object:
    match node:
        case Scalar(value=value):
            return value
        case Mapping(entries=entries):
            return {entry.name: _plain(entry.value) for entry in entries}
        case Sequence() | Packed():
            return [_plain(item) for item in node.items]


def _check_run(compiled: CompiledNetwork) -> None:
    """Two backends give the same three steps."""
    network = compiled.network
    small = len(network.neurons) <= _MOST_NEURONS and len(network.connections) <= _MOST_CONNECTIONS
    if not small or int(network.connections.delays.whole().sum()) > _MOST_SIGNALS:
        return
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        first, second = (compiled.run(3, backend=backend) for backend in ("reference", "numpy"))
    for one, other in zip(first.activity.flat, second.activity.flat, strict=True):
        assert _close(float(one), float(other)), "backends differ"


def _close(one: float, other: float) -> bool:
    if math.isnan(one) or math.isnan(other):
        return math.isnan(one) and math.isnan(other)
    return one == other or abs(one - other) <= 1e-9 * max(1.0, abs(one), abs(other)) or max(abs(one), abs(other)) > 1e15


# Expressions


def check_expression(text: str) -> Outcome:
    """The laws for an expression: refused at a place inside it, or of one value however it is computed; and a spec that
    holds it says the same at the same place."""
    error: ExpressionError | None = None
    tree: Tree | None = None
    try:
        tree = parse(text, random=True)
    except ExpressionError as caught:
        error = caught
    if error is not None:
        assert 0 <= error.start <= error.end <= len(text), (error.start, error.end)
        assert error.code in catalogue(), error.code
        assert error.message.strip()
    if tree is not None:
        _check_values(tree, text)
    _check_in_spec(text, error)
    return Outcome(error is None, () if error is None else (error.code,))


def _check_values(tree: Tree, text: str) -> None:
    assert all(0 <= node.start < node.end <= len(text) for node in walk(tree)), "a part stands outside the text"
    emit(tree, {**{name: name for name in fuzz_expressions.NAMES}, "pi": "pi", "e": "e"} | _names(tree), draw=_emitted)
    around = parse(f" ( {text} ) ", random=True) if len(text) < 900 and _depth(text) < 60 else tree
    given = {**_numbers(tree), **{name: 0.5 + index for index, name in enumerate(fuzz_expressions.NAMES)}}
    one = evaluate(tree, given, draw=_drawn)
    assert _same(one, evaluate(around, given, draw=_drawn)), "parentheses around the whole change its value"
    many = evaluate_array(tree, given, draw=lambda _, first, second: first + 0.25 * second)
    assert isinstance(many, float)
    assert _close(one, many) or _touchy(tree), (one, many)


def _depth(text: str) -> int:
    return sum(text.count(mark) for mark in ("(", "-", "+", "^", "**", "not", "else"))


def _same(one: float, other: float) -> bool:
    return one == other or (math.isnan(one) and math.isnan(other))


def _names(tree: Tree) -> dict[str, str]:
    return {name: name for name in names(tree)}


def _numbers(tree: Tree) -> dict[str, float]:
    return dict.fromkeys(_names(tree), 1.5)


def _drawn(_: Draw, first: float, second: float) -> float:
    return first + 0.25 * second


def _emitted(_: Draw, first: str, second: str) -> str:
    return f"({first}) + 0.25*({second})"


#: Where the last bit decides: NumPy and libm may differ in it, and what follows magnifies that.
_JUMPS = frozenset(
    {"floor", "ceil", "round", "sign", "step", "tan", "sin", "cos", "exp", "expm1", "exprel", "sinh", "cosh", "pow"}
)


def _touchy(tree: Tree) -> bool:
    return any(
        isinstance(node, Conditional)
        or (isinstance(node, Call) and node.function in _JUMPS)
        or (isinstance(node, Binary) and node.operator not in ("+", "-", "*"))
        for node in walk(tree)
    )


_BEFORE = 'neurovis: 1\nname: x\nparameters: {x: 0.5, y: 1.5, z: 2.5}\nneurons:\n  A: {bias: "'


def _check_in_spec(text: str, error: ExpressionError | None) -> None:
    quoted = json.dumps(text, ensure_ascii=False)[1:-1]
    if quoted != text or not text.strip() or _UNSEEN.search(text) or re.search("[\ud800-\udfff\u2028\u2029]", text):
        return
    _, found = _compiled(_BEFORE + text + '"}\n', Path())
    if error is None:
        return
    column = len(_BEFORE) - _BEFORE.rindex("\n") + error.start
    assert (error.code, 5, column) in _places(found), (_places(found), error.code, column)
