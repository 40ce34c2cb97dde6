"""Python (§13): the example of the contract, line by line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import neurovis_spec as nv
from neurovis_spec.runtime.simulation import ParameterError

SPEC = Path(__file__).parents[1] / "specs" / "cpg_rbf.yaml"


@pytest.fixture(scope="module")
def network() -> nv.CompiledNetwork:
    return nv.compile(SPEC)


def test_compile_takes_a_path_a_mapping_and_parameters() -> None:
    """As keywords, or as a mapping beside a seed; a text has a function of its own."""
    assert nv.compile(str(SPEC), phi=0.06).parameters["phi"] == 0.06
    other = nv.compile(SPEC, parameters={"phi": 0.06}, seed=8)
    assert (other.parameters["phi"], other.network.seed) == (0.06, 8)
    text = nv.compile_text("neurovis: 1\nname: x\nneurons: {A: {bias: 2}}\n")
    mapping = nv.compile({"neurovis": 1, "name": "x", "neurons": {"A": {"bias": 2}}})
    assert text.hash == mapping.hash
    keyword = "neurovis: 1\nname: x\nparameters: {lambda: 1, seed: 2}\nneurons: {A: {bias: lambda + seed}}\n"
    given = nv.compile_text(keyword, parameters={"lambda": 5, "seed": 7}, seed=3)
    assert (given.run(1)["A"].tolist(), given.network.seed) == ([12], 3)


def test_a_spec_at_fault_raises_an_error_that_holds_all_diagnostics() -> None:
    """Each with its place, its code and its hint; the text of the error shows them."""
    with pytest.raises(nv.SpecError) as caught:
        nv.compile_text("neurovis: 1\nname: x\nneurons: {A: {activation: tahn}, B: {bia: 1}}\n")
    found = caught.value.diagnostics
    assert [(item.code, item.span.line, item.span.column) for item in found] == [
        ("unknown-activation", 3, 27),
        ("unknown-key", 3, 38),
    ]
    assert "unknown-activation" in str(caught.value)
    assert "unknown-key" in str(caught.value)


def test_a_simulator_goes_step_by_step(network: nv.CompiledNetwork) -> None:
    """Outputs are numpy values by name; a[t] is NaN before the first step, the weights are those of the next step."""
    sim = network.simulator()
    assert np.isnan(sim.activity).all()
    assert sim.k == 0
    out = sim.step(target=0.3)
    assert set(out) == {"signal"}
    assert isinstance(out["signal"], np.ndarray | np.generic)
    recording = network.run(steps=2, inputs={"target": np.array([0.3, 0.3])})
    np.testing.assert_array_equal(sim.activity, recording.activity[0])
    np.testing.assert_array_equal(sim.weights, recording.weights[1])
    assert sim.k == 1
    assert sim.weight("K1 -> O") == recording.weight("K1 -> O")[1]
    assert sim.weight("C1 -> C2") == network.network.connections.weights[1], "any weight, a fixed one too"
    sim.set(phi=0.06)
    assert sim.weight("C1 -> C2") == pytest.approx(-1.0094 * np.sin(0.06))


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (5.0, "'g' is 5; its bounds are 0 to 2"),
        (0.25, "a lower bound of weights would be above its bound of 0.25"),
        (0.0, "a bias would be infinite"),
    ],
)
def test_what_set_cannot_take_is_a_parameter_error_and_changes_nothing(value: float, words: str) -> None:
    text = (
        "neurovis: 1\nname: x\nparameters: {g: {value: 1, min: 0, max: 2}}\nneurons: {A: {bias: 1/g}, B: {}}\n"
        "connections: {A -> B: {weight: 0.6, plasticity: hebbian, bounds: [0.5, g]}}\n"
    )
    sim = nv.compile_text(text).simulator()
    sim.step()
    with pytest.raises(ParameterError, match=words):
        sim.set(g=value)
    sim.step()
    assert sim.activity[0] == 1


def test_a_step_takes_a_mapping_for_names_with_dots() -> None:
    """``sim.step({"left1.load": 0.3})``."""
    leg = "modules: {leg: {inputs: {load: {}}, neurons: {S: {input: load}}}}\n"
    legs = "instances: {left: {module: leg, count: 2}}\noutputs: {s: left.S}\n"
    sim = nv.compile_text(f"neurovis: 1\nname: x\n{leg}{legs}").simulator()
    assert sim.step({"left1.load": 0.3})["s"].tolist() == [0.3, 0]


def test_a_recording_holds_what_the_file_does(network: nv.CompiledNetwork, tmp_path: Path) -> None:
    """A neuron is (steps,), a group (steps, n); any weight by name; saved and loaded it is the same."""
    array = np.linspace(0, 1, 400)
    rec = network.run(steps=400, inputs={"target": array})
    np.testing.assert_array_equal(rec["T"], array)
    assert (rec["O"].shape, rec["K"].shape) == ((400,), (400, 8))
    assert (rec.activity.shape, rec.weights.shape) == ((400, 12), (400, 8))
    np.testing.assert_array_equal(rec.weight("K1 -> O"), rec.weights[:, 0])
    rec.save(tmp_path / "x.npz")
    again = nv.load(tmp_path / "x.npz")
    np.testing.assert_array_equal(again.activity, rec.activity)
    np.testing.assert_array_equal(again.weights, rec.weights)
    np.testing.assert_array_equal(again["K"], rec["K"])


def test_a_layout_has_positions_routes_metrics_and_a_file(network: nv.CompiledNetwork, tmp_path: Path) -> None:
    """By the engine that is named."""
    layout = network.layout(engine="layered")
    assert set(layout.positions) == set(network.network.neurons.names)
    assert all(isinstance(x, float) and isinstance(y, float) for x, y in layout.positions.values())
    assert set(layout.routes) == set(network.network.connection_names)
    metrics = layout.metrics()
    assert (metrics["neurons"], metrics["edges"], metrics["overlaps"]) == (12, 28, 0)
    layout.save(tmp_path / "x.layout.yaml")
    assert (tmp_path / "x.layout.yaml").read_text(encoding="utf-8").startswith("neurovis_layout: 1\nnetwork: cpg_rbf\n")


def test_a_network_renders_and_animates_a_recording(network: nv.CompiledNetwork, tmp_path: Path) -> None:
    """The kind of file by its suffix."""
    recording = network.run(steps=130)
    network.render(tmp_path / "net.svg", step=120, recording=recording)
    network.render(tmp_path / "net.png", step=120, recording=recording)
    network.animate(tmp_path / "net.gif", recording=network.run(steps=4))
    begins = {name: (tmp_path / name).read_bytes()[:6] for name in ("net.svg", "net.png", "net.gif")}
    assert begins["net.svg"].startswith(b"<")
    assert begins["net.png"] == b"\x89PNG\r\n"
    assert begins["net.gif"] == b"GIF89a"


def test_in_a_notebook_they_draw_themselves(network: nv.CompiledNetwork) -> None:
    """A network, a layout and a recording."""
    for shown in (network, network.layout(), network.run(20)):
        assert shown._repr_svg_().lstrip().startswith("<svg")


def test_no_picture_is_wider_than_the_cell_of_a_notebook(network: nv.CompiledNetwork) -> None:
    """A pixel a unit, and where that is wider, as wide as the cell."""
    parts = "neurons: {A: {count: 20, position: [i, 0]}}\nconnections: {A -> A: {pattern: chain}}"
    chain = nv.compile_text(f"neurovis: 1\nname: chain\n{parts}")
    for shown, wide in ((network, 736), (network.layout(), 736), (chain.layout(), 900)):
        assert f' width="{wide}" ' in shown._repr_svg_()[:200]


def test_what_python_gives_is_checked_like_what_a_spec_says(network: nv.CompiledNetwork, tmp_path: Path) -> None:
    """Unknown names are answered with the nearest, and a seed is an integer."""
    with pytest.raises(ValueError, match="no theme 'drak'") as unknown:
        network.render(tmp_path / "x.svg", step=1, theme="drak")
    assert getattr(unknown.value, "hint", "") == "did you mean 'dark'?"
    with pytest.raises(TypeError):
        nv.compile(SPEC, seed=1.5)  # type: ignore[arg-type]
    with pytest.raises(nv.SpecError) as caught:
        nv.compile(SPEC, phy=0.06)
    assert [item.hint for item in caught.value.diagnostics] == ["did you mean 'phi'?"]
    assert not (tmp_path / "x.svg").exists()
