"""Scale: the weights of an entry are what was asked for, and follow when a parameter is set."""

from __future__ import annotations

import numpy as np
import pytest

import neurovis_spec as nv
from neurovis_spec.arrays import FloatArray

HEAD = "neurovis: 1\nname: x\nseed: 3\nparameters: {rho: 0.9}\nneurons: {A: {count: 40}, B: {count: 3}}\nconnections:\n"


def matrix(text: str, n: int, m: int, start: int = 0) -> FloatArray:
    """The weights as a matrix, rows are sources."""
    wires = nv.compile_text(text).network.connections
    result = np.zeros((n, m))
    np.add.at(result, (wires.sources.whole(), wires.targets.whole() - start), wires.weights.whole())
    return result


def test_spectral_radius() -> None:
    body = "{weight: 'normal(0, 1)', pattern: {random: {probability: 0.3}}%s}"
    plain = matrix(HEAD + "  A -> A: " + body % "", 40, 40)
    scaled = matrix(HEAD + "  A -> A: " + body % ", scale: {spectral_radius: rho}", 40, 40)
    assert np.abs(np.linalg.eigvals(scaled)).max() == pytest.approx(0.9, rel=1e-12)
    np.testing.assert_allclose(scaled / scaled.sum(), plain / plain.sum(), rtol=1e-9)


def test_spectral_radius_of_ends_in_another_order() -> None:
    body = "{matrix: [[0, 2], [3, 0]], scale: {spectral_radius: 1}}"
    found = matrix(HEAD + f"  B1 + B2 -> B2 + B1: {body}", 43, 43)[40:42, 40:42]
    np.testing.assert_allclose(found, np.array([[2 / 3, 0.0], [0.0, 1.0]]), rtol=1e-12)  # B1 -> B1 is 2, B2 -> B2 is 3


def test_norm_adds_parallel_connections_up() -> None:
    text = HEAD + "  A -> B: {edges: [[A1, B1, 3], [A1, B2, 2], [A1, B2, 2]], scale: {norm: 10}}"
    assert nv.compile_text(text).network.connections.weights.tolist() == [6.0, 4.0, 4.0]


def test_indegree() -> None:
    text = HEAD + "  A1..A3 -> B: {matrix: [[6, 5, null], [6, null, 8], [6, null, 8]], scale: {indegree: %s}}"
    assert matrix(text % "true", 40, 3, 40)[:3].tolist() == [[2, 5, 0], [2, 0, 4], [2, 0, 4]]
    assert matrix(text % "false", 40, 3, 40)[:3].tolist() == [[6, 5, 0], [6, 0, 8], [6, 0, 8]]


def test_it_follows_when_a_parameter_is_set() -> None:
    text = HEAD + "  A -> A: {weight: 'uniform(-1, 1)', pattern: all_to_all, scale: {spectral_radius: rho}}"
    simulation = nv.compile_text(text).simulator()
    before = simulation.weight("A1 -> A2")
    simulation.set(rho=1.8)
    assert simulation.weight("A1 -> A2") == pytest.approx(2 * before, rel=1e-12)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("size", [1e-320, 1e-300, 1.0, 1e154, 1e300, 1e308])
@pytest.mark.parametrize("norm", [1e-300, 1.0, 1e300])
def test_weights_of_any_size_have_the_norm(size: float, norm: float) -> None:
    """Their squares alone would overflow or vanish."""
    text = HEAD + f"  A1 + A2 + A3 + A4 -> B1: {{weight: {size!r}, pattern: all_to_all, scale: {{norm: {norm!r}}}}}"
    weights = nv.compile_text(text).network.connections.weights.whole()
    np.testing.assert_allclose(weights, norm / 2, rtol=1e-15)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("size", [1e-320, 1e-300, 1.0, 1e154, 1e300, 1e308])
@pytest.mark.parametrize("radius", [1e-300, 1.0, 1e300])
def test_weights_of_any_size_have_the_radius(size: float, radius: float) -> None:
    body = f"{{weight: {size!r}, pattern: all_to_all, scale: {{spectral_radius: {radius!r}}}}}"
    weights = nv.compile_text(HEAD + f"  B1 + B2 -> B1 + B2: {body}").network.connections.weights.whole()
    np.testing.assert_allclose(weights, radius, rtol=1e-14)  # there and back


def test_small_weights_beside_large_ones_stay() -> None:
    text = HEAD + "  A1 -> B: {matrix: [[1e200, 1e-200, 0]], scale: {norm: 1e201}}"
    assert nv.compile_text(text).network.connections.weights.tolist() == pytest.approx([1e201, 1e-199, 0], rel=1e-15)


def test_a_factor_is_what_it_would_be_in_one_multiplication() -> None:
    body = "{weight: 'normal(0, 1)', pattern: all_to_all%s}"
    plain = nv.compile_text(HEAD + "  A -> B: " + body % "").network.connections.weights.whole()
    scaled = nv.compile_text(HEAD + "  A -> B: " + body % ", scale: {norm: 0.7}").network.connections.weights.whole()
    assert scaled.tolist() == (plain * (0.7 / float(np.linalg.norm(plain)))).tolist()


@pytest.mark.parametrize(
    ("entry", "code", "column"),
    [
        ("A -> A: {pattern: all_to_all, scale: {}}", "one-key", 40),
        ("A -> A: {pattern: all_to_all, scale: {norm: 1, indegree: true}}", "one-key", 50),
        ("A -> A: {pattern: all_to_all, scale: {spectral_radios: 1}}", "unknown-key", 41),
        ("A -> B: {pattern: all_to_all, scale: {spectral_radius: 1}}", "wrong-size", 58),
        ("A -> A: {pattern: chain, scale: {spectral_radius: 1}}", "out-of-range", 53),
        ("A -> A: {pattern: all_to_all, scale: {norm: -1}}", "out-of-range", 47),
        ("A -> A: {weight: 0, pattern: all_to_all, scale: {norm: 1}}", "out-of-range", 58),
        ("A -> A: {pattern: all_to_all, scale: 0.9}", "wrong-type", 40),
        (
            "B1..B2 -> B1..B2: {matrix: [[0.001, 1], [0, 0.001]], scale: {spectral_radius: 1e308}}",
            "not-finite",
            81,
        ),
    ],
)
def test_findings(entry: str, code: str, column: int) -> None:
    with pytest.raises(nv.SpecError) as caught:
        nv.compile_text(HEAD + f"  {entry}")
    assert [(d.code, d.span.line, d.span.column) for d in caught.value.diagnostics] == [(code, 7, column)]
