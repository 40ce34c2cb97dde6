"""What a page shows of a run before anybody has asked: outputs, what they are to be, and how far they are off."""

from __future__ import annotations

import gzip
import json

import numpy as np
import pytest

import neurovis_spec as nv
from neurovis_spec.live.curves import Curve, series_of
from neurovis_spec.live.history import Bins
from neurovis_spec.live.protocol import LookAt, command_of
from neurovis_spec.live.recorded import RecordedSource
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.live.view import KIND, KINDS, View, view_of

HEAD = "neurovis: 1\nname: x\ninputs: {goal: {expression: 'sin(k/5)'}}\n"
ONE = f"""{HEAD}neurons: {{A: {{activation: tanh, bias: 0.4}}, O: {{role: output}}, T: {{input: goal}}}}
connections: {{A -> O: {{weight: 0.1, plasticity: {{delta: {{rate: 0.1, target: T}}}}}}}}
"""
TWO = f"""{HEAD}neurons: {{A: {{activation: tanh, bias: 0.4}}, O: {{count: 2}}, T: {{count: 2, input: goal}}}}
connections: {{A -> O: {{weight: 0.1, plasticity: {{delta: {{rate: 0.1, target: T}}}}}}}}
"""
FREE = f"{HEAD}neurons: {{A: {{count: 5, input: goal}}, B: {{input: goal}}}}\n"
FIRES = f"""{HEAD}time: {{dt: 0.1}}
neurons: {{A: {{input: goal}}, S: {{count: 3, model: lif}}}}
connections: {{A -> S: 2}}
"""


def seen(text: str) -> tuple[nv.CompiledNetwork, View]:
    compiled = nv.compile_text(text)
    return compiled, view_of(compiled, compiled.gains)


def test_an_output_is_shown_before_its_target_and_their_difference_below() -> None:
    _, view = seen(ONE)
    assert view.curves.shown == (Curve(("n1", "n2"), ("O", "T")), Curve(("e0",), ("T − O",)))
    begins = json.loads(gzip.decompress(view.content))["curves"]
    assert begins == [{"items": ["n1", "n2"], "names": ["O", "T"]}, {"items": ["e0"], "names": ["T − O"]}]


@pytest.mark.parametrize("recorded", [False, True])
@pytest.mark.parametrize("text", [ONE, TWO])
def test_an_error_is_read_as_what_is_wanted_less_what_is_there(text: str, recorded: bool) -> None:
    compiled, view = seen(text)
    run = compiled.run(30)
    wrong = run["T"].reshape(30, -1) - run["O"].reshape(30, -1)
    expected = wrong[:, 0] if text == ONE else np.sqrt((wrong**2).mean(axis=1))
    source = RecordedSource(compiled.network, run) if recorded else SimulatedSource(compiled.simulator())
    while source.step < 29:
        source.advance()
    error = view.members("e0")
    assert error is not None
    source.history.follow({name: one for name, (_, one) in series_of(compiled.network).items()})
    read = source.history.read(error, Bins(0, 1, 30))
    assert np.allclose(read, expected[:, None], rtol=1e-5, atol=1e-7)
    assert view.values(source.seen(), ["e0"]) == {"e0": pytest.approx(expected[-1], rel=1e-12)}
    assert view.place("e0") == (KINDS.index("e") << KIND, 0)


def test_of_several_it_is_the_root_mean_square_and_there_are_no_more_than_three() -> None:
    _, view = seen(TWO)
    assert [curve.names for curve in view.curves.shown] == [("O1", "T1"), ("O2", "T2"), ("error (RMS)",)]
    assert len(seen(TWO.replace("count: 2", "count: 40"))[1].curves.shown) == 3


def test_without_a_target_outputs_are_shown_and_else_who_fires() -> None:
    outputs = seen(f"{FREE}outputs: {{out: A}}\n")[1].curves.shown
    assert [curve.items for curve in outputs] == [("n0",), ("n1",), ("n2",)]
    role = FREE.replace("B: {", "B: {role: output, ")
    assert [curve.names for curve in seen(role)[1].curves.shown] == [("B",)]
    assert [curve.items for curve in seen(FIRES)[1].curves.shown] == [("n1.*",)]
    assert seen(FREE)[1].curves.shown == ()


def test_of_what_is_collapsed_it_is_the_glyph() -> None:
    _, view = seen(f"{TWO}render: {{collapse: [O]}}\n")
    assert [curve.names for curve in view.curves.shown] == [("O", "T1"), ("O", "T2"), ("error (RMS)",)]


def test_errors_can_be_looked_at_and_none_that_there_is_not() -> None:
    _, view = seen(ONE)
    assert command_of('{"type": "look", "items": ["e0", "n1"]}') == LookAt(("e0", "n1"))
    assert view.members("e1") is None
    assert view.members("e0.v") is None
    source = SimulatedSource(seen(ONE)[0].simulator())
    assert set(view.values(source.seen(), ["e0", "e1", "n1"])) == {"e0", "n1"}
