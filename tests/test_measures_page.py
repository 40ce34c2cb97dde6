"""docs/measures.md is made from the catalogue, names all of Table 1 that measures, and its examples are so."""

from __future__ import annotations

import doctest
import re
from pathlib import Path

import pytest

import neurovis_spec as nv
from neurovis_spec.analysis.catalogue import INTRODUCTION, catalogue, document

ROOT = Path(__file__).parents[1]
#: Table 1 of the paper: what measures something, by its own names.
TECHNIQUES = {
    *("Feature importance", "Connection matrix", "Cross-correlation", "Mutual information", "Gradient"),
    *("Weight analysis", "Graph", "Topography map", "Post-hoc (saliency)"),
}


@pytest.fixture(scope="module")
def known() -> dict[str, object]:
    """What the introduction of the page has made."""
    found: dict[str, object] = {}
    text = "".join(re.findall(r"^(?:>>>|\.\.\.) ?(.*\n)", INTRODUCTION, re.MULTILINE))
    text = text.replace('"specs/', f'"{ROOT.as_posix()}/specs/')
    exec(compile(text, "measures.md", "exec"), found)
    assert isinstance(found["network"], nv.CompiledNetwork)
    return found


def test_the_page_is_made_from_the_catalogue() -> None:
    assert (ROOT / "docs" / "measures.md").read_text(encoding="utf-8") == document(), "make docs"


def test_each_technique_that_measures_is_there_once() -> None:
    found = [one.technique for one in catalogue().values() if one.technique]
    assert sorted(found) == sorted(TECHNIQUES)


@pytest.mark.parametrize("key", catalogue())
def test_an_example_gives_what_it_says(key: str, known: dict[str, object]) -> None:
    test = doctest.DocTestParser().get_doctest(catalogue()[key].example, dict(known), key, "measures.md", 0)
    assert test.examples
    failed = doctest.DocTestRunner(verbose=False).run(test).failed
    assert failed == 0


def test_links_within_the_page_lead_somewhere() -> None:
    text = document()
    anchors = {line[3:].lower().replace(" ", "-") for line in text.splitlines() if line.startswith("## ")}
    assert set(re.findall(r"\]\(#([^)]*)\)", text)) == anchors
