"""Networks as C for robots: what is exported compiles everywhere, and runs as the reference does."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from exported import LANGUAGES, compiled
from test_runtime_conformance import EVENTS, SPECS

import neurovis_spec as nv
from neurovis_spec.compiler.network import Network
from neurovis_spec.runtime.record import record
from neurovis_spec.runtime.resume import resumed_state
from neurovis_spec.runtime.simulation import Simulation

pytestmark = pytest.mark.compiler


def runs_alike(network: Network, folder: Path, language: str = "C99", steps: int = 60) -> None:
    """The recording of the reference, bit for bit."""
    expected = record(network, steps + 1, backend="reference")
    controller = compiled(network, folder, language)
    for k in range(steps):
        np.testing.assert_array_equal(controller.weights[network.changing], expected.weights[k], f"w[{k}]")
        controller.step()
        np.testing.assert_array_equal(controller.activity, expected.activity[k], f"a[{k}]")


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("path", SPECS, ids=lambda path: path.stem)
def test_an_exported_example_gives_the_recording_of_the_reference(path: Path, language: str, tmp_path: Path) -> None:
    runs_alike(nv.compile(path).network, tmp_path, language)


@pytest.mark.parametrize("language", LANGUAGES)
def test_events_noise_and_rules_are_part_of_it(language: str, tmp_path: Path) -> None:
    runs_alike(nv.compile_text(EVENTS).network, tmp_path, language, 40)


def test_what_is_set_follows_as_in_a_simulation(tmp_path: Path) -> None:
    network = nv.compile_text(EVENTS).network
    controller, simulation = compiled(network, tmp_path), Simulation(network, "reference")
    for k in range(30):
        if k == 5:
            assert controller.set("gain", -0.3)
            simulation.set(gain=-0.3)
        if k == 12:
            assert controller.set("offset", 0.7)
            simulation.set(offset=0.7)
        controller.step()
        simulation.step()
        np.testing.assert_array_equal(controller.activity, simulation.activity)
    assert not controller.set("gain", float("nan"))


def test_a_controller_begins_with_what_was_learned(tmp_path: Path) -> None:
    network = nv.compile(next(path for path in SPECS if path.stem == "cpg_rbf")).network
    before = record(network, 500, backend="reference")
    expected = record(network, 20, backend="reference", start=before)
    controller = compiled(network, tmp_path, start=resumed_state(network, before))
    for k in range(19):
        np.testing.assert_array_equal(controller.weights[network.changing], expected.weights[k])
        controller.step()
        np.testing.assert_array_equal(controller.activity, expected.activity[k])
    assert expected.weights[0].any()
