"""Rules that see states, several a connection: in every backend as the reference has them, and as loops by hand do."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from random_learning import learning_specs
from random_specs import Spec

import neurovis_spec as nv
from neurovis_spec.arrays import FloatArray
from neurovis_spec.runtime.backend import load
from neurovis_spec.runtime.controls import Controls
from neurovis_spec.runtime.inputs import InputReader
from neurovis_spec.runtime.reference import ReferenceBackend
from neurovis_spec.runtime.state import State, initial_state

STEPS = 9
BACKENDS = ["numpy", pytest.param("c", marks=pytest.mark.compiler)]


def arrays(state: State) -> dict[str, FloatArray]:
    """All numbers of a state, by what they are."""
    cells = {f"{owner}.{name}": values for owner, own in state.cells.items() for name, values in own.items()}
    return {"activity": state.activity, "outlets": state.outlets, "weights": state.weights, **cells}


@pytest.mark.parametrize("backend", BACKENDS)
@settings(max_examples=25, deadline=None)
@given(spec=learning_specs())
def test_each_step_begun_in_the_references_state_agrees(backend: str, spec: Spec) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        network = nv.compile(spec).network
    plain, other, reader = ReferenceBackend().prepare(network), load(backend).prepare(network), InputReader(network)
    state, controls = initial_state(network), Controls(network)
    for k in range(STEPS):
        controls.begin(state)
        reader.use(state)
        beside = state.copy()
        plain.step(state, reader.at(k))
        other.step(beside, reader.at(k))
        for (name, expected), found in zip(arrays(state).items(), arrays(beside).values(), strict=True):
            np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12, err_msg=f"{name} at {k}")
