"""Numbers with units: times, and values of parameters that have a unit."""

from __future__ import annotations

from decimal import Decimal
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from small_specs import codes, compiled, network_of

import neurovis_spec as nv
from neurovis_spec.cli.overview import overview
from neurovis_spec.language.units import Measured, UnitError, measured, number_in, seconds_of
from neurovis_spec.sweeps.grid import SweepError
from neurovis_spec.sweeps.sweep import sweep

SCALES = {"s": Decimal(1), "ms": Decimal("1e-3"), "us": Decimal("1e-6"), "min": Decimal(60)}
NUMBERS = st.decimals(-10_000, 10_000, places=4).map(str) | st.floats(1e-200, 1e200).map(repr)


@given(NUMBERS, st.sampled_from(sorted(SCALES)))
def test_a_time_is_rounded_once(number: str, unit: str) -> None:
    assert seconds_of(Measured(number, unit)) == float(Decimal(number) * SCALES[unit])


@given(NUMBERS)
def test_a_number_in_the_wanted_unit_is_itself(number: str) -> None:
    for unit in ("ms", "mV", "nS/cm^2", "arbitrary"):
        assert measured(f"{number} {unit}") == Measured(number, unit)
        assert number_in(unit, Measured(number, unit)) == float(number)


@pytest.mark.parametrize(
    ("written", "wanted", "value"),
    [
        ("0.02 s", "ms", 20.0),
        ("2.3 us", "s", 2.3e-6),
        ("-65 mV", "V", -0.065),
        ("1 min", "ms", 60000.0),
        ("3 nS", "pS", 3000.0),
        ("1.5 kHz", "Hz", 1500.0),
        ("2 MOhm", "kΩ", 2000.0),
        ("2 1/s", "1/s", 2.0),
    ],
)
def test_a_unit_is_moved_by_powers_of_ten(written: str, wanted: str, value: float) -> None:
    found = measured(written)
    assert found is not None
    assert number_in(wanted, found) == value


@pytest.mark.parametrize(
    ("written", "wanted"), [("20 mV", "ms"), ("1 kg", "kHz"), ("2 nS/cm2", "nS"), ("1e300 km", "fm")]
)
def test_another_dimension_is_none(written: str, wanted: str) -> None:
    found = measured(written)
    assert found is not None
    with pytest.raises(UnitError):
        number_in(wanted, found)


@pytest.mark.parametrize("text", ["1.5", "1.5ms", "1.5*ms", "1 if", "x", "2 - ms", "1e9999 s"])
def test_what_is_no_number_with_a_unit(text: str) -> None:
    assert measured(text) is None


SPEC = """\
neurovis: 1
name: x
time: {{dt: {dt}}}
parameters: {{tau: {{value: {tau}, unit: ms, min: {least}}}}}
modules:
  leg: {{parameters: {{g: {{value: 1, unit: mV}}}}, neurons: {{K: {{bias: g}}}}}}
models:
  leaky:
    time: ms
    parameters: {{tau: {{value: {tau}, unit: ms}}}}
    state: {{v: {{derivative: (drive - v)/tau}}}}
    activity: v
instances: {{left: {{module: leg, set: {{g: {g}}}}}}}
neurons:
  A: {{bias: tau, model: {{leaky: {{tau: {tau}}}}}}}
  B: {{count: 2, model: {{leaky: {{tau: [{tau}, 3]}}}}}}
  C: {{count: 2}}
connections:
- A -> C: {{pattern: all_to_all, delay: {delay}}}
- A -> C: {{edges: [[A, C1, 1, {delay}]]}}
events:
- {{at: {at}, set: {{tau: {tau}}}}}
- {{from: {at}, to: {to}, clamp: {{A: 1}}}}
"""
PLAIN = {"dt": "0.0001", "tau": "20", "least": "1", "g": "30", "delay": "15", "at": "50", "to": "60000"}
WITH_UNITS = {
    "dt": "0.1 ms", "tau": "0.02 s", "least": "1000 us", "g": "0.03 V",
    "delay": "1.5 ms", "at": "5 ms", "to": "0.1 min",
}  # fmt: skip


def test_what_is_written_with_units_is_the_same_network() -> None:
    plain = nv.compile_text(SPEC.format(**PLAIN))
    for key, value in WITH_UNITS.items():
        assert nv.compile_text(SPEC.format(**(PLAIN | {key: value}))).hash == plain.hash, key
    assert nv.compile_text(SPEC.format(**(PLAIN | {"tau": "21"}))).hash != plain.hash


def test_parameters_are_set_with_units() -> None:
    text = SPEC.format(**PLAIN)
    assert nv.compile_text(text, tau="0.03 s").hash == nv.compile_text(text, tau=30).hash
    run = nv.compile_text(text).simulator()
    run.set(tau="0.03 s")
    assert run.parameters["tau"] == 30
    with pytest.raises(ValueError, match="expected a value in ms, found '3 mV'"):
        run.set(tau="3 mV")
    with pytest.raises(nv.SpecError, match="expected a value in ms"):
        nv.compile_text(text, tau="3 mV")
    with pytest.raises(nv.SpecError, match="is set to '3 mV', and has no unit"):
        nv.compile_text("neurovis: 1\nname: x\nparameters: {a: 1}\nneurons: {A: {bias: a}}\n", a="3 mV")
    with pytest.raises(TypeError):
        nv.compile_text(text, tau="3")


def test_a_sweep_is_over_values_with_units(tmp_path: Path) -> None:
    spec = tmp_path / "spec.yaml"
    spec.write_text("neurovis: 1\nname: x\nparameters: {tau: {value: 20, unit: ms}}\nneurons: {A: {bias: tau}}\n")
    written: list[str | list[int | float | str]] = ["0.01 s, 20", "10 ms:20 ms:2", ["0.01 s", 20]]
    for over in written:
        assert [row[:2] for row in sweep(spec, {"tau": over}, "rms(A)", steps=1).rows] == [(10.0, 10.0), (20.0, 20.0)]
    with pytest.raises(SweepError, match="'tau': expected a value in ms, found '1 mV'"):
        sweep(spec, {"tau": "1 mV"}, "rms(A)")


def test_people_are_told_times_in_the_unit_of_dt(tmp_path: Path) -> None:
    text = "time: {dt: 0.1 ms, steps: 201}\nneurons: {A: {bias: 1}}\n"
    for written, caption, axis in (("0.1 ms", "step 200 · 20.00 ms", "time (ms)"), ("1e-4", "0.0200 s", "time (s)")):
        made = compiled(text.replace("0.1 ms", written))
        made.render(tmp_path / "x.svg", view=["network", "traces"])
        picture = (tmp_path / "x.svg").read_text(encoding="utf-8")
        assert caption in picture
        assert f">{axis}<" in picture
        assert f"dt {'0.1 ms' if 'ms' in axis else '0.0001 s'}, 201 steps" in overview(made)


def test_an_invalid_dt_says_nothing_of_delays() -> None:
    text = "time: {dt: 0.1 msec}\nneurons: {A: {bias: 1}, B: {}}\nconnections: {A -> B: {delay: 0.15 ms}}\n"
    assert codes(text + "events: [{at: 5.05 ms, lesion: A}]\n") == ["bad-unit"]


def test_delays_are_rounded_to_steps_of_which_there_is_one_at_least() -> None:
    def delay(written: str) -> int:
        text = f"neurons: {{A: {{bias: 1}}, B: {{}}}}\nconnections: {{A -> B: {{delay: {written}}}}}\n"
        return int(network_of(f"time: {{dt: 0.1 ms}}\n{text}").connections.delays[0])

    assert [delay(one) for one in ("0 s", "1 us", "0.14 ms", "0.16 ms", "2.3 ms", "1 s")] == [0, 1, 1, 2, 23, 10000]
