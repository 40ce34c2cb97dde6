"""A key is declared once: what it takes, sees and excludes, and what it means; all else follows from its field."""

from __future__ import annotations

from collections.abc import Iterator
from types import ModuleType
from typing import Annotated, cast

import pytest
import yaml
from jsonschema import Draft202012Validator
from lsp_marks import marked
from pydantic import Field

from neurovis_spec.cli.topics import text_of
from neurovis_spec.compiler.values.constants import Constants
from neurovis_spec.diagnostics import Diagnostic, Findings
from neurovis_spec.language import places, shape, spec
from neurovis_spec.language.grammar import ENDS, NOISE, Needs, NotWith, declaring
from neurovis_spec.language.located import Formula, FormulaField, Located
from neurovis_spec.language.model import Named
from neurovis_spec.language.places import formula_at, formulas_of, role_of
from neurovis_spec.language.sections import GroupModel
from neurovis_spec.language.spec import Spec
from neurovis_spec.language.unknown import Names
from neurovis_spec.language.yaml.reader import read_text
from neurovis_spec.language.yaml.source import Scalar
from neurovis_spec.lsp.completion import complete
from neurovis_spec.lsp.hover import hover
from neurovis_spec.lsp.rename import apply, rename
from neurovis_spec.manual import keys
from neurovis_spec.manual.topics import topics

HEAD = "neurovis: 1\nname: x\n"


class Group(GroupModel):
    """A group with one more key."""

    mood: Annotated[FormulaField | None, NOISE, NotWith(("bias",)), Needs(("count",), "'mood' is of many")] = Field(
        None, description="How the neurons feel (default 0)."
    )


class Wider(Spec):
    """A spec of such groups."""

    neurons: Annotated[Named[Group], declaring("neuron")] = Field(  # type: ignore[assignment]
        default_factory=dict, description="Groups of neurons."
    )


CACHES = (places._places, formula_at, keys.keys, topics)
USERS: tuple[ModuleType, ...] = (places, shape, spec, keys)


@pytest.fixture(autouse=True)
def _with_one_more_key(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    for module in USERS:
        monkeypatch.setattr(module, "Spec", Wider)
    for cached in CACHES:
        cached.cache_clear()
    yield
    for cached in CACHES:
        cached.cache_clear()


def found(group: str) -> list[tuple[str, str, str | None]]:
    """The findings of the reader about one group."""
    findings = Findings()
    document = read_text(f"{HEAD}neurons:\n  K: {group}\n", "x.yaml", findings)
    assert document is not None
    shape.read_spec(document, findings)
    items: tuple[Diagnostic, ...] = findings.sorted()
    return [(item.code, item.message, item.hint) for item in items]


def test_its_value_is_read_and_checked() -> None:
    assert found("{count: 2, mood: 'normal(0, k)'}") == []
    assert found("{count: 2, mood: [1]}") == [("wrong-type", "expected a number or an expression, found a list", None)]
    assert found("{count: 2, mod: 1}") == [("unknown-key", "unknown key 'mod'", "did you mean 'mood' or 'model'?")]
    assert found("{count: 2, mood: }")[0][0] == "no-value"


def test_what_it_excludes_and_needs_is_reported_once() -> None:
    conflict = ("conflicting-keys", "'mood' beside 'bias': only one of the two may be there", "remove 'mood'")
    assert found("{count: 2, bias: 1, mood: 1}") == [conflict]
    assert found("{mood: 1}") == [("useless-key", "'mood' is of many", None)]
    assert [code for code, _, _ in found("{coutn: 2, mood: 1}")] == ["unknown-key"]


def test_the_schema_knows_it() -> None:
    validator = Draft202012Validator(spec.json_schema())

    def is_valid(group: str) -> bool:
        return validator.is_valid(yaml.safe_load(f"{HEAD}neurons: {{K: {group}}}"))

    groups = ("{count: 2, mood: k}", "{count: 2, mood: [1]}", "{count: 2, mod: 1}", "{mood: 1}")
    assert [is_valid(group) for group in groups] == [True, False, False, False]
    assert not is_valid("{count: 2, mood: 1, bias: 1}")
    definitions = cast(dict[str, dict[str, dict[str, dict[str, object]]]], spec.json_schema()["$defs"])
    assert definitions["Group"]["properties"]["mood"]["description"] == "How the neurons feel (default 0)."


def test_its_formulas_see_what_it_says() -> None:
    role = formula_at(Group, "mood")
    assert role == role_of(("neurons", "K", "mood"), False) == NOISE
    findings = Findings()
    for text in ("normal(0, i*k)", "j"):
        formula: Formula = Located(text, Scalar(text, read_text(HEAD, "x", findings).root.span))  # type: ignore[union-attr]
        Constants(Names(), 1.0, findings).tree(formula, role)
    assert [(item.code, item.message) for item in findings.sorted()] == [("unknown-name", "unknown name 'j'")]


def test_its_formulas_are_found_by_what_they_see() -> None:
    written = "count: 2, mood: i*k, bias: [i, 1], label: 'K{i}', activation: {gaussian: {mean: n}}"
    text = f"{HEAD}neurons:\n  K: {{{written}}}\n"
    findings = Findings()
    document = read_text(text, "x", findings)
    assert document is not None
    spec = shape.read_spec(document, findings)
    assert spec is not None
    group = spec.neurons["K"]
    assert [(one.path, one.text) for one in formulas_of(group, ("i", "n"))] == [
        (("mood",), "i*k"),
        (("bias",), "i"),
        (("activation", "gaussian", "mean"), "n"),
    ]
    assert [one.text for one in formulas_of(group, ("k",))] == ["i*k"]


def test_the_language_server_offers_and_explains_it() -> None:
    document, place = marked(f"{HEAD}neurons:\n  K: {{mo¦")
    offered = {item.label: item for item in complete(document, place)}
    assert offered["mood"].insert == "mood: "
    assert offered["mood"].documentation == "How the neurons feel (default 0)."
    document, place = marked(f"{HEAD}parameters: {{gain: 1}}\nneurons:\n  K: {{mood: ¦")
    labels = {item.label for item in complete(document, place)}
    assert {"gain", "i", "n", "k", "t", "normal", "tanh"} <= labels
    assert labels.isdisjoint({"j", "distance", "pre"})
    told = hover(*marked(f"{HEAD}neurons:\n  K: {{mo¦od: 1}}\n"))
    assert told is not None
    assert told.markdown == "**mood**: How the neurons feel (default 0)."
    told = hover(*marked(f"{HEAD}neurons:\n  K: {{mood: no¦rmal(0, 1)}}\n"))
    assert told is not None
    assert "random number" in told.markdown


def test_a_word_of_the_language_is_no_name_of_the_author() -> None:
    assert role_of(("render", "figure", 0), False) is None
    assert role_of(("render", "figure", 0, "traces"), False) == ENDS
    assert role_of(("neurons", "K", "initial", "activity"), True) is None


def test_a_parameter_is_renamed_in_it() -> None:
    document, place = marked(f"{HEAD}parameters: {{ga¦in: 1}}\nneurons:\n  K: {{count: 2, mood: 2*gain}}\n")
    assert "mood: 2*strength}" in apply(document, rename(document, place, "strength")).source


def test_the_manual_explains_it() -> None:
    (key,) = topics()["neurons.mood"]
    assert isinstance(key, keys.Key)
    assert (key.kind, key.default, key.about) == ("number or expression", "0", "How the neurons feel.")
    text = text_of((key,))
    assert "by default 0" in text
    assert "its expressions know parameters, k, t, i, n; they may draw random numbers" in text
