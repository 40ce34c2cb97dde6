"""What no author means: wrong values everywhere, lines lost and doubled. All are answered, none ends in a traceback."""

from __future__ import annotations

import json
from pathlib import Path

import hostile
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from laws import one_in

import neurovis_spec as nv
from neurovis_spec.diagnostics import Diagnostic

SPECS = sorted((Path(__file__).parent.parent / "specs").glob("*.yaml"))
RICH: hostile.Data = yaml.safe_load(hostile.RICH)
PATHS = list(hostile.paths(RICH))
#: Values that have no business anywhere but in what is handed on unread.
NEVER = ("nan", "list of a mapping", "mapping of nothing")
#: Where almost any text will do.
FREE = ("title", "description", "authors", "license", "references", "label", "box", "namespace", "qos", "topic")


def findings(text: str, folder: Path | None = None) -> tuple[Diagnostic, ...]:
    """The findings of a text, checked for what holds for all: a place within the text, a message that can be read."""
    try:
        found = nv.compile_text(text, folder=folder).warnings
    except nv.SpecError as error:
        found = error.diagnostics
        assert any(item.severity == "error" for item in found)
    lines = text.removeprefix("\ufeff").splitlines() or [""]
    for item in found:
        span = item.span
        assert 1 <= span.line <= span.end_line <= len(lines) + 1, item
        assert (span.line, span.column) <= (span.end_line, span.end_column), item
        if span.line <= len(lines):
            assert 1 <= span.column <= len(lines[span.line - 1]) + 1, item
        assert 0 < len(item.message) < 400, item
        assert item.hint is None or 0 < len(item.hint) < 400, item
    return found


def test_the_rich_spec_is_right() -> None:
    assert findings(hostile.RICH) == ()
    assert findings(json.dumps(RICH)) == ()


@pytest.mark.parametrize("part", range(3))
def test_wrong_values_are_answered(part: int) -> None:
    """A sixteenth of all places and values; each place sees some values, each value many places."""
    share = one_in(16)
    for number, path in enumerate(PATHS):
        for other, (name, wrong) in enumerate(hostile.WRONG.items()):
            if (number + other) % (3 * share) != share * part:
                continue
            found = findings(hostile.replaced(RICH, path, wrong))
            if not found:
                assert name not in NEVER or "ros" in path, f"{hostile.shown(path)}: {name} is accepted"
            assert len(found) <= 45, f"{hostile.shown(path)}: {name} is answered {len(found)} times"


@pytest.mark.parametrize("name", NEVER)
def test_what_no_key_accepts(name: str) -> None:
    """Of these values each place sees one in each run."""
    for path in PATHS[NEVER.index(name) % one_in(len(NEVER)) :: one_in(len(NEVER))]:
        if "ros" not in path:
            found = findings(hostile.replaced(RICH, path, hostile.WRONG[name]))
            assert found, f"{hostile.shown(path)}: {name} is accepted"


@pytest.mark.parametrize(("name", "first"), [("text", 0), ("arrow", 1)])
def test_words_in_the_place_of_numbers(name: str, first: int) -> None:
    """A word is refused wherever a number, a name of something or a mapping is wanted; each place sees one of two."""
    for path in PATHS[first % one_in(2) :: one_in(2)]:
        free = any(part in FREE for part in path) or path in (("name",), ("render", "title"), ("ros", "rate"))
        if not free and not {"names", "ros", "lesion"}.intersection(path):
            assert findings(hostile.replaced(RICH, path, hostile.WRONG[name])), f"{hostile.shown(path)}: {name}"


@pytest.mark.parametrize("path", SPECS, ids=lambda path: path.stem)
@settings(max_examples=12, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_lines_lost_and_doubled(path: Path, data: st.DataObject) -> None:
    lines = path.read_text(encoding="utf-8").splitlines()
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(st.integers(0, len(lines) - 1))
        match data.draw(st.sampled_from(["lose", "double", "swap", "cut", "indent"])):
            case "lose":
                del lines[place]
            case "double":
                lines.insert(place, lines[place])
            case "swap":
                other = data.draw(st.integers(0, len(lines) - 1))
                lines[place], lines[other] = lines[other], lines[place]
            case "cut":
                lines[place] = lines[place][: data.draw(st.integers(0, len(lines[place])))]
            case _:
                lines[place] = "  " + lines[place]
        if not lines:
            break
    findings("\n".join(lines), path.parent)
