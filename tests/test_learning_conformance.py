"""Rules that see states, several a connection, and states of theirs that flow: in every backend as the reference has
them."""

from __future__ import annotations

import warnings
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from random_learning import learning_specs
from random_specs import Spec

import neurovis_spec as nv
from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.live.carry import carried
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.runtime import c_backend
from neurovis_spec.runtime.backend import Availability, Backend, Stepper
from neurovis_spec.runtime.c_backend import CBackend
from neurovis_spec.runtime.controls import Controls
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.inputs import InputReader
from neurovis_spec.runtime.numpy_backend import NumpyBackend
from neurovis_spec.runtime.record import record
from neurovis_spec.runtime.reference import ReferenceBackend
from neurovis_spec.runtime.simulation import Simulation
from neurovis_spec.runtime.state import State, initial_state

STEPS = 9


def compiled(spec: Spec) -> Network:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return nv.compile(spec).network


def arrays(state: State) -> dict[str, FloatArray]:
    """All numbers of a state, by what they are."""
    cells = {f"{owner}.{name}": values for owner, own in state.cells.items() for name, values in own.items()}
    return {"activity": state.activity, "outlets": state.outlets, "weights": state.weights, **cells}


def follow(spec: Spec, backend: Backend) -> None:
    """Each step of a backend, begun in the reference's state, is that of the reference, with all events."""
    network = compiled(spec)
    plain, other, reader = ReferenceBackend().prepare(network), backend.prepare(network), InputReader(network)
    state, controls = initial_state(network), Controls(network)
    for k in range(STEPS):
        controls.begin(state)
        reader.use(state)
        beside = state.copy()
        plain.step(state, reader.at(k))
        other.step(beside, reader.at(k))
        for (name, expected), found in zip(arrays(state).items(), arrays(beside).values(), strict=True):
            if backend.capabilities.exactness == "bits":
                assert found.tobytes() == expected.tobytes(), (name, k)
            else:
                np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12, err_msg=f"{name} at {k}")


@settings(max_examples=20, deadline=None)
@given(spec=learning_specs())
def test_each_step_in_numpy_agrees(spec: Spec) -> None:
    follow(spec, NumpyBackend())


@pytest.mark.compiler
@pytest.mark.parametrize("size", [0, 600], ids=["loops", "written out"])
@settings(max_examples=10, deadline=None, phases=(Phase.explicit, Phase.generate))
@given(spec=learning_specs())
def test_each_step_in_c_is_the_reference_bit_for_bit(spec: Spec, size: int) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(c_backend, "SMALL", size)
        follow(spec, CBackend())


class _ByStep:
    """The C backend as one that has nothing but ``step``."""

    name, capabilities = "c", CBackend.capabilities

    def availability(self) -> Availability:
        return Availability(True)

    def prepare(self, network: Network) -> Stepper:
        made = CBackend().prepare(network)
        return cast("Stepper", SimpleNamespace(step=made.step, functions=made.functions))


@pytest.mark.compiler
@settings(max_examples=10, deadline=None, phases=(Phase.explicit, Phase.generate))
@given(spec=learning_specs(), every=st.integers(1, 3))
def test_a_block_of_steps_in_c_keeps_the_signals_of_the_weights_of_each_step(spec: Spec, every: int) -> None:
    network = compiled(spec)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(c_backend, "SMALL", 0)
        by_step, block = (record(network, Course(STEPS, every, backend=one)) for one in (_ByStep(), CBackend()))
    assert block.state_names == by_step.state_names
    for found, expected in ((block.states, by_step.states), (block.weights, by_step.weights)):
        assert found.tobytes() == expected.tobytes()
    assert block.activity.tobytes() == by_step.activity.tobytes()


@settings(max_examples=10, deadline=None, phases=(Phase.explicit, Phase.generate))
@given(spec=learning_specs(), cut=st.integers(0, STEPS - 1))
def test_a_run_in_pieces_is_the_whole_one_and_an_edit_of_nothing_changes_nothing(
    spec: Spec, cut: int, tmp_path_factory: pytest.TempPathFactory
) -> None:
    network, checkpoint = compiled(spec), tmp_path_factory.mktemp("pieces") / "state"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        whole, restored = Simulation(network, "numpy"), Simulation(network, "numpy")
        plain, edited = (SimulatedSource(Simulation(network, "numpy")) for _ in range(2))
        for k in range(STEPS):
            if k == cut:
                whole.save_state(checkpoint)
                restored.restore(checkpoint)
                edited = carried(edited, Simulation(network, "numpy"))
            if k >= cut:
                restored.step()
            whole.step()
            for one in (plain, edited):
                one.advance()
            np.testing.assert_array_equal(edited.seen().snapshot.weights, plain.seen().snapshot.weights)
            np.testing.assert_array_equal(edited.seen().snapshot.activity, plain.seen().snapshot.activity)
        for found, expected in zip(arrays(restored.state()).values(), arrays(whole.state()).values(), strict=True):
            np.testing.assert_array_equal(found, expected)
