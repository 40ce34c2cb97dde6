"""What the language says of editors: descriptions on hover (§3, §4), and names that are renamed wherever they stand."""

from __future__ import annotations

import re

import pytest
import yaml
from jsonschema import Draft202012Validator
from lsp_marks import marked
from test_contract_numbers import HEAD, PLACES

from neurovis_spec import api
from neurovis_spec.lsp.check import check
from neurovis_spec.lsp.completion import complete
from neurovis_spec.lsp.document import Document
from neurovis_spec.lsp.hover import hover
from neurovis_spec.lsp.rename import apply, rename

TOP = "neurovis: 1\nname: x\n"


def written(place: str) -> str:
    """A spec with the expressions of one place."""
    text = re.sub("‹([^|]*)\\|[^›]*›", r"\1", place)
    return TOP + (text if text.startswith("parameters") else HEAD + text)


@pytest.mark.parametrize("place", [place for place in PLACES if "two" in place or "half" in place])
@pytest.mark.parametrize("name", ["two", "half"])
def test_a_parameter_is_renamed_in_every_place_that_takes_an_expression(place: str, name: str) -> None:
    """And the spec means the same as before."""
    text = written(place)
    document, at = marked(text.replace(f"{name}:", f"{name}¦:", 1))
    result = apply(document, rename(document, at, "other")).source
    assert result == re.sub(rf"\b{name}\b", "other", text)
    assert check(Document(result)).network is not None


@pytest.mark.parametrize("place", [place for place in PLACES if re.search(r"‹[^|]*\b(two|half)\b", place)])
def test_parameters_are_offered_in_every_place_that_takes_an_expression(place: str) -> None:
    """Where the name of one begins."""
    text = re.sub("‹([^|]*)\\|[^›]*›", "‹\\1›", place)
    found = re.search(r"‹[^›]*?\b(two|half)\b", text)
    assert found is not None
    at = found.start(1) + 2
    text = text[:at] + "¦" + text[at:]
    text = text.replace("‹", "").replace("›", "")
    document, spot = marked(TOP + (text if text.startswith("parameters") else HEAD + text))
    assert {"two", "half", "sin"} <= {item.label for item in complete(document, spot)}


@pytest.mark.parametrize("place", PLACES)
def test_the_schema_takes_an_expression_wherever_the_language_does(place: str) -> None:
    """So that an editor does not underline one."""
    found = Draft202012Validator(api.schema()).iter_errors(yaml.safe_load(written(place)))
    assert [error.message for error in found] == []


DESCRIBED = """\
neurovis: 1
name: x
parameters: {gain: {value: 2, description: how much}}
inputs: {push: {expression: k, description: what pushes}}
activations: {bend: {value: x^3, description: a bend}}
modules: {leg: {description: a whole leg, neurons: {K: {bias: 1}}}}
neurons: {A: {count: 2, input: push, bias: gain, activation: bend, description: what A is}, B: {}}
instances: {left: {module: leg}}
connections:
  A -> B: {weight: gain, description: how it goes}
  B -> A: 1
"""


@pytest.mark.parametrize(
    ("old", "words"),
    [
        ("bias: ga¦in", "how much"),
        ("input: pu¦sh", "what pushes"),
        ("activation: be¦nd", "a bend"),
        ("neurons: {A¦: {count", "what A is"),
        ("  A¦ -> B", "what A is"),
        ("  A -¦> B", "how it goes"),
        ("module: le¦g", "a whole leg"),
    ],
)
def test_a_description_is_shown_on_hover(old: str, words: str) -> None:
    """Of whatever may have one."""
    assert old.replace("¦", "") in DESCRIBED
    found = hover(*marked(DESCRIBED.replace(old.replace("¦", ""), old)))
    assert found is not None
    assert words in found.markdown
