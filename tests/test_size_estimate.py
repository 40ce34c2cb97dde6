"""What is counted is what is made, and too much is refused before anything is."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_specs import HEAD, network_of

import neurovis_spec as nv
from neurovis_spec.compiler.names.modules import library_of
from neurovis_spec.compiler.names.size_estimate import SizeEstimate
from neurovis_spec.compiler.values.constants import Constants
from neurovis_spec.compiler.values.parameters import make_parameters
from neurovis_spec.diagnostics import Diagnostic, Findings
from neurovis_spec.language.includes import read_includes
from neurovis_spec.language.shape import read_spec
from neurovis_spec.language.unknown import Names
from neurovis_spec.language.yaml.reader import read_text

COUNTS = ["1", "2", "p", "q", "p + 1", "q % 3 + 1", "'min(p, 2)'", "floor(p/2) + 1"]
SETS = ["", "", ", set: {p: i + 1}", ", set: {q: n - i}", ", set: {p: q + i % 2, q: p}", ", set: {q: 2}"]


@st.composite
def nested(draw: st.DrawFn) -> str:
    """A spec of modules within modules, whose counts depend on what is set and on where an instance stands."""

    def entries(below: list[str], least: int) -> str:
        made = []
        for number in range(draw(st.integers(least, 2))):
            module, count, given = (draw(st.sampled_from(choices)) for choices in (below, COUNTS, SETS))
            made.append(f"x{number}_: {{module: {module}, count: {count}{given}}}")
        return "{" + ", ".join(made) + "}"

    text, below = "parameters: {p: 2, q: 3}\nmodules:\n", list[str]()
    for name in ("a", "b", "c"):
        count = draw(st.sampled_from(COUNTS))
        text += f"  {name}: {{parameters: {{p: 1, q: p + 1}}, neurons: {{K: {{bias: 1, count: {count}}}}}"
        text += f", instances: {entries(below, 0)}}}\n" if below else "}\n"
        below.append(name)
    return text + f"neurons: {{N: {{bias: 1, names: [N1, N2]}}}}\ninstances: {entries(below, 1)}\n"


def counted(text: str, most: int = 10**6) -> tuple[int | None, tuple[Diagnostic, ...]]:
    """How many instances a spec without its head makes, and what is found where that is too much."""
    findings = Findings()
    document = read_text(HEAD + text, "x", findings)
    assert document is not None
    spec = read_spec(document, findings)
    assert spec is not None
    folder = Path()
    constants = Constants(Names(), 1.0, findings)
    library = library_of(spec, read_includes(spec, folder, folder, findings), folder, 1.0, findings)
    make_parameters(spec, constants, {})
    assert not findings.failed
    return SizeEstimate(library.modules.known(), 1.0, most).instances(spec, constants, findings), findings.sorted()


@settings(max_examples=60, deadline=None)
@given(nested())
def test_what_is_counted_is_what_is_made(text: str) -> None:
    network = network_of(text)
    neurons = len(network.neurons)
    assert counted(text, neurons) == (len(network.instances), ())
    instances, found = counted(text, neurons - 1)
    assert instances is None
    assert [item.code for item in found] == ["too-many"]


def test_more_than_there_may_be_is_never_looked_at_one_by_one() -> None:
    """Each level sets something else in each instance of the next: 2^60 values, if they were all made."""
    text = "modules:\n  m60: {parameters: {p: 1}, neurons: {K: {count: p, bias: 1}}}\n"
    for level in range(60):
        inner = f"{{x: {{module: m{level + 1}, count: 2, set: {{p: p + i*2^{level}}}}}}}"
        text += f"  m{level}: {{parameters: {{p: 1}}, instances: {inner}}}\n"
    text += "instances: {x: {module: m0}}\n"
    instances, (found,) = counted(text)
    assert instances is None
    assert found.message == "this makes more than 100,000 instances, the most that there may be"


def test_a_count_that_is_an_integer_up_to_rounding_is_counted() -> None:
    """3·0.1/0.1 is no integer in floating point, and makes three instances."""
    text = "modules: {leg: {neurons: {K: {bias: 1}}}}\ninstances: {x: {module: leg, count: 0.3/0.1}}\n"
    assert counted(text) == (len(network_of(text).instances), ()) == (3, ())


def test_instances_are_refused_for_their_neurons_before_any_is_made() -> None:
    text = "modules: {leg: {neurons: {K: {count: 40, bias: 1}}}}\ninstances: {left: {module: leg, count: 30000}}\n"
    tracemalloc.start()
    try:
        with pytest.raises(nv.SpecError) as caught:
            nv.compile_text(HEAD + text)
        assert tracemalloc.get_traced_memory()[1] < 20 << 20
    finally:
        tracemalloc.stop()
    (found,) = caught.value.diagnostics
    assert (found.code, found.span.line) == ("too-many", 4)
    assert found.message == "this makes 1,200,000 neurons; the limit is 1,000,000"
    assert found.hint == "raise it with --limit"


@pytest.mark.parametrize("count", ["legs", "0", "-3", "2.5", "1/0", '"normal(0, 1)"'])
@pytest.mark.parametrize("nested", [False, True])
def test_a_count_at_fault_is_a_finding_where_the_module_counts_by_what_is_set(count: str, nested: bool) -> None:
    """No instances at all have no largest count."""
    leg = "  leg: {parameters: {toes: 1}, neurons: {K: {count: toes, bias: 1}}}\n"
    entry = f"{{x: {{module: leg, count: {count}, set: {{toes: 2}}}}}}"
    text = f"modules:\n{leg}neurons: {{N: {{bias: 1}}}}\ninstances: {entry}\n"
    if nested:
        body = f"  body: {{parameters: {{toes: 2}}, neurons: {{N: {{bias: 1}}}}, instances: {entry}}}\n"
        text = f"modules:\n{leg}{body}instances: {{y: {{module: body, count: 2, set: {{toes: 1 + i}}}}}}\n"
    with pytest.raises(nv.SpecError) as error:
        network_of(text)
    (finding,) = error.value.diagnostics
    wanted = {
        "legs": "unknown-name",
        "2.5": "not-an-integer",
        "1/0": "not-finite",
        '"normal(0, 1)"': "draw-not-allowed",
    }
    assert finding.code == wanted.get(count, "out-of-range")


def test_a_count_of_which_some_are_none_is_a_finding() -> None:
    text = """\
modules:
  leg: {parameters: {toes: 1}, neurons: {K: {count: toes, bias: 1}}}
  body: {parameters: {toes: 2}, instances: {x: {module: leg, count: toes - 1, set: {toes: 2}}}}
instances: {y: {module: body, set: {toes: 1}}}
"""
    with pytest.raises(nv.SpecError, match="'count' must be at least 1, this is 0"):
        network_of(text)
