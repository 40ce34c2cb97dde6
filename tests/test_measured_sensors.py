"""Measures over what a body senses: of a recording, in runs that end early, in sweeps; what is said of wrong ones."""

from __future__ import annotations

import numpy as np
import pytest
import yaml
from toy_bodies import BODY, SPEC, carted, registered

import neurovis_spec as nv
from neurovis_spec.body import BodyError
from neurovis_spec.diagnostics import SpecError
from neurovis_spec.runtime.recording import Recording


@pytest.fixture(autouse=True)
def _carts(monkeypatch: pytest.MonkeyPatch) -> None:
    registered(monkeypatch)


@pytest.fixture
def network() -> nv.CompiledNetwork:
    return nv.compile_text(SPEC + BODY)


def by_hand(recording: Recording) -> dict[str, float]:
    """Measures after the last step, and what they are."""
    x, arm, drive = recording.sensor("x"), recording.sensor("arm"), recording["drive"]
    return {
        "x": x[-1],
        "arm[1] - arm[0]": arm[-1, 1] - arm[-1, 0],
        "mean(x)": x.mean(),
        "max(x, last=7)": x[-7:].max(),
        "min(arm)": arm.min(),
        "rms(arm, last=5)": np.sqrt(np.mean(arm[-5:] ** 2)),
        "mean(abs(x - drive), last=20)": np.abs(x - drive)[-20:].mean(),
        "max(arm - O, last=9)": (arm - recording["both"])[-9:].max(),
        "count(arm > 0) + gain": (arm[-1] > 0).sum() + 0.8,
    }


def test_of_a_recording(network: nv.CompiledNetwork) -> None:
    recording = network.run(60)
    for text, value in by_hand(recording).items():
        assert network.measure(text, recording)[-1] == pytest.approx(value, rel=1e-12), text


def test_in_a_sweep() -> None:
    texts = by_hand(carted().run(60))
    table = nv.sweep(yaml.safe_load(SPEC + BODY), {"gain": [0.8]}, list(texts), steps=60)
    assert list(table.rows[0][1:-1]) == pytest.approx(list(texts.values()), rel=1e-12)


@pytest.mark.parametrize("backend", ["reference", pytest.param("c", marks=pytest.mark.compiler)])
def test_a_run_ends_by_what_is_sensed(network: nv.CompiledNetwork, backend: str) -> None:
    clock = network.run(60, backend=backend).sensor("clock")
    ended = network.run(200, backend=backend, until="clock > 0.6")
    assert len(ended) == int(np.argmax(clock > 0.6)) + 1
    until = network.until("mean(arm, last=3) > 1000")
    network.run(30, until=until, backend=backend)
    assert until.ending is not None
    assert not until.ending.met
    assert set(until.ending.values) == {"mean(arm, last=3)"}


@pytest.mark.parametrize(
    ("text", "code", "said"),
    [
        ("arm > 1", "not-one-number", "'arm' is 2 numbers of a sensor, and no single one: name one of them"),
        ("arm[2] > 1", "unknown-name", "there is no neuron, output or parameter 'arm[2]'"),
        ("clok > 1", "unknown-name", "did you mean 'clock'"),
        ("mean(arm - K, last=3)", "unknown-name", "'K'"),
        ("mean(arm - arm*P, last=3) > mean(O - arm[0], last=2) + O[0]", "unknown-name", "'O[0]'"),
        ("rate(x, last=3) > 1", "unknown-name", "'x'"),
    ],
)
def test_what_is_wrong_is_said(network: nv.CompiledNetwork, text: str, code: str, said: str) -> None:
    with pytest.raises(SpecError) as caught:
        network.until(text)
    (found,) = caught.value.diagnostics
    assert found.code == code
    assert said in f"{found.message}: {found.hint}"


def test_without_a_body_nothing_is_sensed(network: nv.CompiledNetwork) -> None:
    alone = network.run(5, body=False)
    with pytest.raises(BodyError, match=r"'x' of 'mean\(x\)' is not sensed: there is no body"):
        network.measure("mean(x)", alone)
    with pytest.raises(BodyError, match="'x' of 'x > 1' is not sensed: there is no body"):
        network.run(5, body=False, until="x > 1")


def test_what_has_the_name_of_a_sensor_too_is_meant_as_before(network: nv.CompiledNetwork) -> None:
    named = nv.compile_text((SPEC + BODY).replace("drive: O1", "x: O1").replace("gain * drive", "gain * x"))
    recording = named.run(20)
    assert named.measure("x", recording)[-1] == recording["O1"][-1]
