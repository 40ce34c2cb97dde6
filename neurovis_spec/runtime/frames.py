"""Recordings as what people work with: a Dataset of xarray, a DataFrame of pandas.

In: a Recording. Out: one of these, with named coordinates. Both packages are optional, extras of the same names: where
one is missing, an ImportError says how to install it.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from types import ModuleType

    import pandas as pd
    import xarray as xr

    from neurovis_spec.runtime.recording import Recording


def _extra(name: str) -> ModuleType:
    try:
        return import_module(name)
    except ImportError as error:
        message = f"{name} is not installed: pip install 'neurovis-spec[{name}]'"
        raise ImportError(message, name=name) from error


def _changing(recording: Recording) -> list[str]:
    """The names of the connections whose weights it holds."""
    plastic = recording.plastic if recording.weights.shape[1] else recording.plastic[:0]
    return [recording.connection_names[index] for index in plastic.tolist()]


def to_xarray(recording: Recording) -> xr.Dataset:
    """``activity`` (step, neuron), ``weight`` (step, connection), ``state`` (step, state_name), ``sensor`` (step,
    sensor_name), with the coordinates ``step``, ``seconds``, ``neuron``, ``connection`` (and its ``source``,
    ``target``, ``delay``), ``state_name`` and ``sensor_name``. Weights that stay are in ``weight_static`` (static).
    Raises ImportError without xarray."""
    xarray = _extra("xarray")
    names, neurons = _changing(recording), recording.neurons
    plastic = recording.plastic[: len(names)]
    fixed = np.setdiff1d(np.arange(len(recording.sources)), recording.plastic)
    result: xr.Dataset = xarray.Dataset(
        {
            "activity": (("step", "neuron"), recording.activity),
            "weight": (("step", "connection"), recording.weights),
            "state": (("step", "state_name"), recording.states),
            "sensor": (("step", "sensor_name"), recording.rows.sensors),
            "weight_static": ("static", recording.weights_static),
        },
        coords={
            "step": recording.step,
            "seconds": ("step", recording.step * recording.dt),
            "neuron": list(recording.columns),
            "connection": names,
            "source": ("connection", [neurons[index] for index in recording.sources[plastic].tolist()]),
            "target": ("connection", [neurons[index] for index in recording.targets[plastic].tolist()]),
            "delay": ("connection", recording.delays[plastic]),
            "state_name": list(recording.state_names),
            "sensor_name": list(recording.sensor_names),
            "static": [recording.connection_names[index] for index in fixed.tolist()],
        },
        attrs={"network": recording.network, "hash": recording.hash, "dt": recording.dt},
    )
    return result


def to_pandas(recording: Recording) -> pd.DataFrame:
    """A row a step, indexed by ``step`` and ``seconds``; columns by ``quantity`` (activity, weight, state, sensor) and
    ``name`` (of the neuron, the connection, the state, the sensor): ``frame["activity"]["K1"]``. Raises ImportError
    without pandas."""
    pandas = _extra("pandas")
    columns = [("activity", name) for name in recording.columns]
    columns += [("weight", name) for name in _changing(recording)]
    columns += [("state", name) for name in recording.state_names]
    columns += [("sensor", name) for name in recording.sensor_names]
    steps = [recording.step, recording.step * recording.dt]
    result: pd.DataFrame = pandas.DataFrame(
        np.hstack(recording.rows[:4]),
        index=pandas.MultiIndex.from_arrays(steps, names=["step", "seconds"]),
        columns=pandas.MultiIndex.from_tuples(columns, names=["quantity", "name"]),
    )
    return result
