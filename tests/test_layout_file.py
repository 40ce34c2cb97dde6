from __future__ import annotations

import layout_conformance as suite
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from neurovis_spec.diagnostics import Diagnostic, Findings
from neurovis_spec.layout import Layout
from neurovis_spec.layout.arrange import lay_out_problem
from neurovis_spec.layout.file import dump, parse

EXAMPLE = """\
neurovis_layout: 1
network: cpg_rbf
engine: layered
positions: {C1: [0, 0], C2: [1, 0]}
routes: {C1 -> K1: [[0, 0], [0, 0.3], [0.2, 0.7], [0, 1]]}     # optional
"""


def read(text: str) -> tuple[Layout | None, tuple[Diagnostic, ...]]:
    findings = Findings()
    return parse(text, "net.layout.yaml", findings), findings.sorted()


def test_the_contracts_example_reads() -> None:
    layout, found = read(EXAMPLE)
    assert not found
    assert layout == Layout(
        "cpg_rbf",
        "layered",
        {"C1": (0.0, 0.0), "C2": (1.0, 0.0)},
        {"C1 -> K1": ((0.0, 0.0), (0.0, 0.3), (0.2, 0.7), (0.0, 1.0))},
    )


def test_a_whole_layout_comes_back_equal() -> None:
    layout = lay_out_problem(suite.use_case_one())
    text = dump(layout)
    assert read(text) == (layout, ())
    assert text.startswith("neurovis_layout: 1\nnetwork: cpg_rbf\nengine: layered\npositions:\n  C1: [")
    assert text.index("  K2:") < text.index("  K8:") < text.index("  O:")


NAMES = st.from_regex(r"[A-Za-z_][A-Za-z0-9_]{0,5}(\.[A-Za-z_][A-Za-z0-9_]{0,5})?", fullmatch=True)
NUMBERS = st.floats(-2e6, 2e6) | st.integers(-5000, 5000).map(lambda n: n / 1024)
POINTS = st.tuples(NUMBERS, NUMBERS)


@settings(max_examples=30, deadline=None)
@given(st.dictionaries(NAMES | st.sampled_from(["yes", "Null", "on", "true"]), POINTS, max_size=5), NAMES)
def test_numbers_and_names_read_back_exactly(positions: dict[str, tuple[float, float]], network: str) -> None:
    routes = {f"{name} -> {network} (2)": ((0.1, 0.2), point, point, (1e-7, -2e6)) for name, point in positions.items()}
    layout = Layout(network, "grid", positions, routes)
    text = dump(layout)
    assert read(text) == (layout, ())
    plain = yaml.safe_load(text)  # and to a reader of YAML 1.1
    assert {name: tuple(point) for name, point in plain["positions"].items()} == positions


def test_any_part_may_be_missing() -> None:
    assert read("neurovis_layout: 1\n") == (Layout("", "manual", {}, {}), ())
    assert read("neurovis_layout: 1\npositions:\nroutes: {}\n") == (Layout("", "manual", {}, {}), ())


@pytest.mark.parametrize(
    ("line", "code", "place", "message"),
    [
        ("postions: {}", "unknown-key", (2, 1), "unknown key 'postions'"),
        ("network: 3", "wrong-type", (2, 10), "'network' is a name, found the number 3"),
        ("positions: [1]", "wrong-type", (2, 12), "'positions' is a mapping"),
        ("direction: aside", "wrong-type", (2, 12), "'direction' is one of four, found the text 'aside'"),
        ("positions: {A: 1}", "wrong-type", (2, 16), "the position of 'A' is a pair [x, y], found the number 1"),
        ("positions: {A: [1]}", "wrong-type", (2, 16), "found a list of 1"),
        ("positions: {A: [1, x]}", "wrong-type", (2, 20), "has a number here, found the text 'x'"),
        ("positions: {A: [true, 1]}", "wrong-type", (2, 17), "found true"),
        ("routes: {A -> B: 3}", "wrong-type", (2, 18), "is a list of points"),
        ("routes: {A -> B: [[0, 0], [1, 1]]}", "route-points", (2, 18), "has 2 points"),
        ("routes: {A -> B: [[0, 0], [1, 1], [1], [2, 2]]}", "wrong-type", (2, 35), "pair [x, y]"),
    ],
)
def test_what_is_wrong_is_found_in_its_place(line: str, code: str, place: tuple[int, int], message: str) -> None:
    layout, found = read(f"neurovis_layout: 1\n{line}\n")
    assert layout is None
    assert [(d.code, (d.span.line, d.span.column)) for d in found] == [(code, place)]
    assert message in found[0].message


def test_all_findings_come_at_once_with_suggestions() -> None:
    layout, found = read("neurovis_layout: 2\nengin: x\npositions: {A: [.nan, 0], B: 3}\n")
    assert layout is None
    assert {d.span.line for d in found} >= {1, 2, 3}
    assert any(d.hint == "did you mean 'engine'?" for d in found)


def test_the_version_is_needed() -> None:
    layout, found = read("network: x\n")
    assert layout is None
    assert [d.code for d in found] == ["missing-key"]


def test_broken_yaml_is_a_finding() -> None:
    layout, found = read("neurovis_layout: 1\npositions: {A: [1, 2\n")
    assert layout is None
    assert found
