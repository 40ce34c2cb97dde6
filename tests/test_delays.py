"""Delays as they are written: by expressions, in seconds, drawn, in matrices, in columns of a file; and as steps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from small_specs import network_of

import neurovis_spec as nv
from neurovis_spec.compiler.connections.delays import nearest_steps, rounded
from neurovis_spec.compiler.network import Network

GROUPS = """\
time: {dt: 1 ms}
parameters: {speed: 1000, d: 3, far: 2}
neurons:
  A: {count: 3, bias: 1, position: [[0, 0], [1, 0], [far, 0]]}
  B: {count: 2, position: [[0, 3], [1, 3]]}
"""


def compiled(body: str, folder: Path | None = None) -> Network:
    """The network of connections from A to B with this body."""
    return network_of(f"{GROUPS}connections: {{A -> B: {{{body}}}}}\n", folder)


def delays(body: str, folder: Path | None = None) -> list[int]:
    """The delays of connections from A to B, all of them, or as the body says."""
    return compiled(f"pattern: all_to_all, {body}" if "edges" not in body else body, folder).connections.delays.tolist()


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ("delay: d", [3] * 6),
        ("delay: i + 2*j", [0, 2, 1, 3, 2, 4]),
        ("delay: n_from + n_to - i", [5, 5, 4, 4, 3, 3]),
        ("delay: round(distance)", [3, 3, 3, 3, 4, 3]),
        ("delay: {seconds: distance/speed}", [3, 3, 3, 3, 4, 3]),
        ("delay: {seconds: 0.0025}", [2] * 6),
        ("delay: {seconds: 2.5 ms}", [2] * 6),
        ("delay: {seconds: (i + j)/4*dt}", [0, 1, 1, 1, 1, 1]),
        ("delay: {matrix: [[1, 2], [d, 0], [null, 4]]}", [1, 2, 3, 0, 1, 4]),
        ("delay: {matrix: [[1, 2, i + j], [4, 5, 6]]}, rows: to", [1, 4, 2, 5, 2, 6]),
        ("delay: {seconds: {matrix: [[1e-3, 2e-3], [d*dt, 0], [5e-3, 6.9e-3]]}}", [1, 2, 3, 0, 5, 7]),
    ],
)
def test_delays_as_they_are_written(body: str, expected: list[int]) -> None:
    assert delays(body) == expected


def test_delays_of_edges_go_before_that_of_the_entry(tmp_path: Path) -> None:
    entry = "delay: {seconds: (1 + i)*dt}"
    assert delays(f"edges: [[A1, B1], [A2, B1, 1, 7], [A3, B2, 1, 2.4 ms], [A3, B1]], {entry}") == [1, 7, 2, 3]
    (tmp_path / "edges.csv").write_text("from,delay_seconds,to,delay\nA1,0.004,B1,\nA2,,B1,9\nA3,,B2,\nA1,4.3e-4,B2,\n")
    assert delays(f"edges: {{file: edges.csv}}, {entry}", tmp_path) == [4, 9, 3, 1]
    (tmp_path / "steps.csv").write_text("from,to,delay\nA1,B1,4\nA2,B1,\n")
    assert delays("edges: {file: steps.csv}", tmp_path) == [4, 1]


def test_delays_of_files_are_in_the_text_of_the_whole_spec(tmp_path: Path) -> None:
    """In seconds they count as they are, to the last bit."""
    (tmp_path / "edges.csv").write_text("from,delay_seconds,to,delay\nA1,1e-5,B1,\nA2,,B1,9\nA3,,B2,\nA1,2.3e-3,B2,\n")
    text = f"neurovis: 1\nname: x\n{GROUPS}connections: {{A -> B: {{edges: {{file: edges.csv}}}}}}\n"
    made = nv.compile_text(text, folder=tmp_path)
    assert made.network.connections.delays.tolist() == [1, 9, 1, 2]
    assert nv.compile_text(made.text(), folder=tmp_path / "elsewhere").network.hash == made.network.hash


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ("A1,B1,2,0.001", "row 2, column 4: a delay in steps stands in this row, too"),
        ("A1,B1,,-0.001", "'-0.001' is no delay: it is at least 0 seconds"),
        ("A1,B1,,1\nA1,B2,,2000", "a delay must be at most 1,000,000 steps, this is 2000 s, of row 3 of the file"),
    ],
)
def test_a_column_of_seconds_is_checked(rows: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "edges.csv").write_text(f"from,to,delay,delay_seconds\n{rows}\n")
    with pytest.raises(nv.SpecError) as caught:
        compiled("edges: {file: edges.csv}", tmp_path)
    assert message in str(caught.value)


def test_parameters_of_the_models_at_the_ends() -> None:
    text = """\
time: {dt: 1 ms}
parameters: {slow: 4, g: 2, other: 1}
models:
  m: {parameters: {lag: 2, tau: 1}, activity: tau*drive}
neurons:
  A: {count: 2, model: {m: {lag: [3, slow], tau: other}}}
  B: {count: 2, model: {m: {tau: g}}}
  C: {}
connections:
  A -> B: {pattern: all_to_all, delay: DELAY}
"""
    for delay, expected, structural in (
        ("pre.lag + j", [3, 4, 4, 5], {"slow"}),
        ("{seconds: (post.lag + post.tau)*dt}", [4, 4, 4, 4], {"g"}),
        ('"round(uniform(0, 1))*0 + pre.tau"', [1, 1, 1, 1], {"other"}),
    ):
        network = network_of(text.replace("DELAY", delay))
        assert network.connections.delays.tolist() == expected
        assert network.structural == structural
    with pytest.raises(nv.SpecError) as caught:
        network_of(text.replace("A -> B", "A -> C").replace("pattern: all_to_all, delay: DELAY", "delay: 1 + post.lag"))
    (one,) = caught.value.diagnostics
    assert (one.code, one.span.column, one.message) == (
        "unknown-name", 23, "the model 'static' of 'C' has no parameter 'lag'",
    )  # fmt: skip


def test_an_index_of_one_neuron_is_told_beside_a_parameter_of_an_end() -> None:
    made = nv.compile_text(
        """\
neurovis: 1
name: x
models: {m: {parameters: {lag: 2}, activity: lag*drive}}
neurons: {A: {model: m, bias: 1}, B: {count: 2}}
connections: {A -> B: {delay: i + pre.lag}}
"""
    )
    (warning,) = made.warnings
    assert (warning.code, warning.span.line, warning.span.column) == ("lone-index", 5, 31)


def test_drawn_delays_are_rounded_and_draw_for_themselves() -> None:
    drawn = np.array(delays('delay: "normal(9, 2)"'))
    assert len(set(drawn.tolist())) > 2
    assert drawn.min() >= 1
    assert delays('delay: {seconds: "normal(9, 2)*dt"}') == drawn.tolist()
    cells = [["normal(9, 2)"] * 2] * 3
    assert delays(f"delay: {{matrix: {cells}}}") == drawn.tolist()
    network = compiled('pattern: all_to_all, weight: "normal(9, 2)", delay: "normal(9, 2)"')
    assert network.connections.delays.tolist() == drawn.tolist()
    assert np.rint(network.connections.weights.whole()).tolist() != drawn.tolist()
    alone = network_of(f'seed: 1\n{GROUPS}connections: {{A -> B: {{pattern: all_to_all, delay: "normal(9, 2)"}}}}\n')
    assert alone.connections.delays.tolist() != drawn.tolist()


def test_what_a_delay_reads_cannot_be_set_in_a_run() -> None:
    structural = {
        "delay: d": {"d"},
        "delay: d + i": {"d"},
        "delay: {seconds: distance/speed}": {"speed", "far"},
        "delay: {matrix: [[d, 1], [1, 1], [1, 1]]}": {"d"},
        "weight: d": set(),
    }
    for body, expected in structural.items():
        assert compiled(f"pattern: all_to_all, {body}").structural == expected, body


def test_whole_steps_are_the_same_network_however_they_are_written() -> None:
    written = [
        "3",
        "d",
        "3 ms",
        "{seconds: 0.003}",
        "{seconds: d*dt}",
        "i + 3 - i",
        "{matrix: [[3, 3], [3, 3], [3, 3]]}",
    ]
    hashes = {compiled(f"pattern: all_to_all, delay: {one}").hash for one in written}
    assert len(hashes) == 1
    assert compiled("pattern: all_to_all, delay: 2").hash not in hashes


@given(st.floats(0, 1e6))
def test_rounding_to_steps(exact: float) -> None:
    (near,) = nearest_steps(np.array([exact]))
    (steps,) = rounded(np.array([near]))
    assert abs(near - exact) <= 1e-9
    assert abs(steps - exact) <= 0.5 or (steps == 1 and 0 < exact < 1)
    assert (steps == 0) == (near == 0)
