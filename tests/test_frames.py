"""Recordings as Datasets of xarray and DataFrames of pandas, with named coordinates."""

from __future__ import annotations

import sys

import numpy as np
import pytest

import neurovis_spec as nv
from neurovis_spec.runtime.recording import Recording

SPEC = """\
neurovis: 1
name: frames
time: {dt: 0.5, steps: 10}
neurons: {A: {count: 2, bias: 1, model: leaky_integrator}, O: {}}
connections:
  A -> O: {weight: 0.1, delay: 3, plasticity: oja}
  O -> A: 0.25
outputs: {membrane: A.v}
"""


@pytest.fixture(scope="module")
def recording() -> Recording:
    return nv.compile_text(SPEC).run(every=2)


def test_a_dataset_has_named_coordinates(recording: Recording) -> None:
    data = recording.to_xarray()
    assert data.activity.sel(neuron="O", step=4).item() == recording["O"][2]
    assert data.weight.sel(connection="A2 -> O").values.tolist() == recording.weight("A2 -> O").tolist()
    assert data.state.sel(state_name="A1.v").values.tolist() == recording["A1.v"].tolist()
    assert data.seconds.values.tolist() == [0, 1, 2, 3, 4]
    assert data.source.sel(connection="A2 -> O").item() == "A2"
    assert data.delay.values.tolist() == [3, 3]
    assert data.weight_static.sel(static="O -> A1").item() == 0.25
    assert data.attrs["network"] == "frames"
    assert data.activity.swap_dims(step="seconds").sel(seconds=2.0).sizes == {"neuron": 3}


def test_a_frame_has_a_row_a_step(recording: Recording) -> None:
    frame = recording.to_pandas()
    assert frame.index.names == ["step", "seconds"]
    assert frame["activity"]["O"].tolist() == recording["O"].tolist()
    assert frame["weight"]["A1 -> O"].tolist() == recording.weight("A1 -> O").tolist()
    assert frame["state"]["A2.v"].tolist() == recording["A2.v"].tolist()
    assert frame.xs(2.0, level="seconds").index.tolist() == [4]


def test_a_partial_recording_holds_what_it_holds() -> None:
    recording = nv.compile_text(SPEC).run(neurons="O", weights="none")
    assert recording.to_xarray().sizes["connection"] == 0
    assert recording.to_xarray().neuron.values.tolist() == ["O"]
    assert np.array_equal(recording.to_pandas()["activity"]["O"], recording["O"])


@pytest.mark.parametrize("extra", ["xarray", "pandas"])
def test_a_missing_package_is_named_with_its_extra(
    recording: Recording, monkeypatch: pytest.MonkeyPatch, extra: str
) -> None:
    monkeypatch.setitem(sys.modules, extra, None)
    with pytest.raises(ImportError, match=rf"pip install 'neurovis-spec\[{extra}\]'"):
        getattr(recording, f"to_{extra}")()
