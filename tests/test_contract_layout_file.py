"""The layout file (§11), sentence by sentence, as the command writes it and as a spec reads it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

import neurovis_spec as nv
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.diagnostics import Findings
from neurovis_spec.layout import Layout
from neurovis_spec.layout.file import parse

SPEC = """\
neurovis: 1
name: paths
modules: {leg: {neurons: {S: {bias: 1}, K: {count: 11}}, connections: {S -> K: 1}}}
instances: {left: {module: leg, count: 2}}
neurons: {A: {bias: 1}, B: {}}
connections:
  - {A -> B: {weight: 2, delay: 3}, B -> A: 1, A -> A: 1, left1.S -> left2.S: 1}
  - {A -> B: {weight: 1, delay: 3}}
  - {A -> B: 5}
"""


@pytest.fixture
def spec(tmp_path: Path) -> Path:
    path = tmp_path / "paths.yaml"
    path.write_text(SPEC, encoding="utf-8")
    return path


def call(*words: str | Path) -> Result:
    result = CliRunner().invoke(neurovis, [str(word) for word in words])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result


def read(text: str) -> Layout:
    findings = Findings()
    layout = parse(text, "x.layout.yaml", findings)
    assert layout is not None, findings.sorted()
    return layout


def test_the_command_writes_every_neuron_and_every_route(spec: Path) -> None:
    """Beside the version, the network's name and the engine that made it."""
    layout = read(call("layout", spec).stdout)
    network = nv.compile(spec).network
    assert (layout.network, layout.engine) == ("paths", "layered")
    assert sorted(layout.positions) == sorted(network.neurons.names)
    assert sorted(layout.routes) == sorted(network.connection_names)


def test_neurons_stand_in_natural_order_with_their_dotted_paths(spec: Path) -> None:
    """K2 before K10, and those of an instance by its path."""
    legs = [f"left{n}.{name}" for n in (1, 2) for name in (*(f"K{k}" for k in range(1, 12)), "S")]
    assert list(read(call("layout", spec).stdout).positions) == ["A", "B", *legs]


def test_a_route_has_1_and_3k_points_from_centre_to_centre(spec: Path) -> None:
    """A self-loop leaves its centre and comes back to it."""
    layout = read(call("layout", spec).stdout)
    network = nv.compile(spec).network
    ends = zip(network.connections.sources.tolist(), network.connections.targets.tolist(), strict=True)
    names = network.neurons.names
    for connection, (source, target) in zip(network.connection_names, ends, strict=True):
        route = layout.routes[connection]
        assert len(route) >= 4
        assert (len(route) - 1) % 3 == 0
        assert (route[0], route[-1]) == (layout.positions[names[source]], layout.positions[names[target]])
    loop = layout.routes["A -> A"]
    assert loop[0] == loop[-1] == layout.positions["A"]
    assert any(point != loop[0] for point in loop)


def test_a_straight_route_has_its_control_points_on_the_line() -> None:
    """From the centre of the source to that of the target."""
    route = nv.compile_text("neurovis: 1\nname: x\nneurons: {A: {}, B: {}}\nconnections: {A -> B: 1}").layout().routes
    (x0, y0), *inner, (x1, y1) = route["A -> B"]
    assert (x0, y0) != (x1, y1)
    for x, y in inner:
        assert (x - x0) * (y1 - y0) == pytest.approx((y - y0) * (x1 - x0), abs=1e-12)


def test_a_reciprocal_pair_never_shares_a_line(spec: Path) -> None:
    """There is a point of the one that is far from all of the other."""
    routes = nv.compile(spec).layout().routes

    def at(route: tuple[tuple[float, float], ...], t: float) -> tuple[float, float]:
        (a, b), (c, d), (e, f), (g, h) = route[:4]
        u = 1 - t
        weights = (u**3, 3 * u * u * t, 3 * u * t * t, t**3)
        return sum(w * x for w, x in zip(weights, (a, c, e, g), strict=True)), sum(
            w * y for w, y in zip(weights, (b, d, f, h), strict=True)
        )

    steps = [i / 50 for i in range(51)]
    back = [at(routes["B -> A"], t) for t in steps]
    for name in ("A -> B", "A -> B (2)", "A -> B (3)"):
        there = [at(routes[name], t) for t in steps]
        assert max(min(abs(x - p) + abs(y - q) for p, q in back) for x, y in there) > 0.04


def test_connections_that_share_both_ends_stand_in_the_order_of_data_index(spec: Path, tmp_path: Path) -> None:
    """By delay, rule, weight, then place in the spec; the first has no number."""
    network = nv.compile(spec)
    made = network.network
    three = {name: index for index, name in enumerate(made.connection_names) if name.startswith("A -> B")}
    delays, weights = made.connections.delays.tolist(), made.connections.weights.tolist()
    values = {name: (delays[index], weights[index]) for name, index in three.items()}
    assert values == {"A -> B": (1, 5), "A -> B (2)": (3, 1), "A -> B (3)": (3, 2)}
    assert set(three) <= set(read(call("layout", spec).stdout).routes)
    network.render(tmp_path / "x.svg", step=1)
    shown = re.findall(
        r'data-connection="A -&gt; B"[^>]*data-index="(\d)"[^>]*><title>([^<]*)',
        (tmp_path / "x.svg").read_text(encoding="utf-8"),
    )
    weight = {index: re.search(r"weight (-?[\d.]+)", title) for index, title in shown}
    assert {index: found and found[1] for index, found in weight.items()} == {"1": "5", "2": "1", "3": "2"}


def test_numbers_read_back_exactly(spec: Path, tmp_path: Path) -> None:
    """What is written is the layout, to the last bit."""
    layout = nv.compile(spec).layout()
    layout.save(tmp_path / "x.layout.yaml")
    assert read((tmp_path / "x.layout.yaml").read_text(encoding="utf-8")) == layout.value


def test_a_file_by_hand_may_hold_any_part(spec: Path, tmp_path: Path) -> None:
    """What it holds is kept, the rest is found around it."""
    spec.write_text(SPEC + "layout: {file: some.layout.yaml}\n", encoding="utf-8")
    file = tmp_path / "some.layout.yaml"
    for part, kept in (
        ("", {}),
        ("network: paths\n", {}),
        ("positions: {B: [7, 3]}\n", {"B": (7.0, 3.0)}),
        ("engine: grid\npositions: {left1.K3: [-2, 0.5], A: [1, 1]}\n", {"left1.K3": (-2.0, 0.5), "A": (1.0, 1.0)}),
        ("positions: {A: [0, 0], B: [0, 4]}\nroutes: {A -> B: [[0, 0], [1, 1], [1, 3], [0, 4]]}\n", {"B": (0.0, 4.0)}),
    ):
        file.write_text(f"neurovis_layout: 1\n{part}", encoding="utf-8")
        network = nv.compile(spec)
        assert network.warnings == ()
        layout = network.layout()
        assert {name: layout.positions[name] for name in kept} == kept
        assert len(layout.positions) == 26
    assert layout.routes["A -> B"] == ((0, 0), (1, 1), (1, 3), (0, 4)), "a route between places that stay, stays"
