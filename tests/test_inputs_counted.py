"""Inputs that are counted, spikes at given times and events at random, and those with an index."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pandas
import pytest
from exported import LANGUAGES, exported
from hypothesis import given
from hypothesis import strategies as st

import neurovis_spec as nv
from neurovis_spec.compiler.network import Spikes
from neurovis_spec.compiler.values.draws import Stream
from neurovis_spec.compiler.values.poisson import LARGEST_MEAN, counts
from neurovis_spec.runtime import inputs
from neurovis_spec.runtime.inputs import InputReader

SPEC = """
neurovis: 1
name: counted
seed: 3
time: {dt: 1 ms, steps: 100}
parameters: {rate: 400, w: 0.5, poisson: 3}
models:
  leak:
    parameters: {tau: 0.02}
    ports: [excitatory]
    state: {v: {derivative: (10*excitatory - v + drive)/tau}}
    activity: v
  jumps: {ports: [excitatory], state: {v: {derivative: -v/0.02, jump: excitatory}}, activity: v}
inputs:
  listed: {spikes: {times: [[0, 0.01, 0.09, 0.09], [w/10]]}}
  rain: {size: 4, poisson: rate*(1 + 0.5*sin(50*t))*(i + 1)/n}
  six: {size: 6, expression: w*sin(30*t + i/n)}
  same: {size: 2, expression: cos(t)}
neurons:
  B: {count: 2, input: listed}
  C: {count: 4, model: leak, input: {excitatory: rain}}
  J: {count: 4, model: jumps, input: {excitatory: rain}}
  D: {count: 6, model: leak, input: six, noise: poisson(2)}
  F: {count: 6, input: six}
  G: {count: 2, input: same}
  H: {count: 2, model: leak, input: same, initial: {v: poisson(30)}}
  R: {count: 4, input: rain}
connections:
  B -> R: {weight: 0.01*poisson(40*rate/400), pattern: all_to_all}
events:
- {at: 50, set: {rate: 100}}
"""
HEAD = "neurovis: 1\nname: x\nseed: 3\ntime: {dt: 1 ms, steps: 40}\n"


def of(section: str, size: int = 1) -> nv.CompiledNetwork:
    return nv.compile_text(f"{HEAD}inputs: {{s: {section}}}\nneurons: {{A: {{count: {size}, input: s}}}}")


@pytest.mark.parametrize("backend", ["numpy", pytest.param("c", marks=pytest.mark.compiler)])
def test_backends_and_ways_of_running_count_the_same(backend: str) -> None:
    network = nv.compile_text(SPEC)
    expected = network.run(100, backend="reference")
    whole = network.run(100, backend=backend)
    np.testing.assert_array_equal(whole.activity, expected.activity)
    np.testing.assert_array_equal(whole.weights, expected.weights)
    simulation = network.simulator(backend=backend)
    for k in range(100):
        simulation.step()
        np.testing.assert_array_equal(simulation.activity, expected.activity[k])


@pytest.mark.compiler
@pytest.mark.parametrize("language", LANGUAGES)
def test_exported_c_counts_the_same(language: str, tmp_path: Path) -> None:
    network = nv.compile_text(SPEC)
    expected = network.run(100, backend="reference")
    controller = exported(network, tmp_path, language)
    for k in range(99):
        np.testing.assert_array_equal(controller.weights[network.network.changing], expected.weights[k], f"w[{k}]")
        controller.step()
        np.testing.assert_array_equal(controller.activity, expected.activity[k], f"a[{k}]")


@pytest.mark.compiler
def test_exported_c_of_single_precision_counts_spikes(tmp_path: Path) -> None:
    network = nv.compile_text(SPEC.replace("events:\n- {at: 50, set: {rate: 100}}", ""))
    expected, controller = network.run(60, backend="reference"), exported(network, tmp_path, real="float")
    for k in range(60):
        controller.step()
        np.testing.assert_allclose(controller.activity[:2], expected["B"][k])


def test_a_step_counts_the_spikes_from_behind_the_last_one_on(tmp_path: Path) -> None:
    rows = "t_ms, id, more\n0,1,0\n1,0,0\n1.0000000001,0,0\n1.5,2,0\n2.0001,0,0\n1e300,1,0\n20,1,0\n20,1,0\n"
    (tmp_path / "s.csv").write_text(rows)
    spikes = "{spikes: {file: s.csv, columns: {time: t_ms, index: id}, time: ms}, size: 3}"
    text = f"{HEAD}inputs: {{s: {spikes}}}\nneurons: {{A: {{count: 3, input: s}}}}"
    (tmp_path / "s.yaml").write_text(text)
    network = nv.compile(tmp_path / "s.yaml")
    expected = np.zeros((40, 3))
    for step, index in ((0, 1), (1, 0), (1, 0), (2, 2), (3, 0), (20, 1), (20, 1)):
        expected[step, index] += 1
    np.testing.assert_array_equal(network.run(40)["A"], expected)
    assert network.describe()["inputs"] == [{"name": "s", "size": 3, "source": "spikes"}]


def test_a_spike_is_in_the_step_that_its_time_names() -> None:
    for dt in (1e-4, 0.1, 1 / 3, 0.02):
        spikes = Spikes(dt * np.arange(20000.0), np.zeros(20000, dtype=np.int64))
        np.testing.assert_array_equal(spikes.steps(dt), np.arange(20000))


@given(st.lists(st.floats(0, 0.05), max_size=30), st.sampled_from([1e-3, 3e-3, 1e-2]))
def test_each_spike_counts_once(times: list[float], dt: float) -> None:
    spikes = Spikes(np.sort(np.array(times)), np.zeros(len(times), dtype=np.int64))
    for time, step in zip(spikes.times, spikes.steps(dt), strict=True):
        assert (step - 1) * dt - 1e-8 * dt <= time <= step * dt + 1e-8 * dt


def test_spikes_with_and_without_a_file_are_the_same_network(tmp_path: Path) -> None:
    (tmp_path / "s.csv").write_text("index,time\n1,0.002\n0,0.001\n1,0.03\n")
    (tmp_path / "s.yaml").write_text(
        f"{HEAD}inputs: {{s: {{spikes: s.csv, size: 2}}}}\nneurons: {{A: {{count: 2, input: s}}}}"
    )
    listed = of("{spikes: {times: [[1], [2, 30]], time: ms}}", 2)
    assert nv.compile(tmp_path / "s.yaml").hash == listed.hash
    assert of("{spikes: {times: [[0.001], [0.03, 2*0.001]]}}", 2).hash == listed.hash
    assert of("{spikes: {times: [[1], [3, 30]], time: ms}}", 2).hash != listed.hash


def test_spikes_are_read_of_tables_of_every_kind(tmp_path: Path) -> None:
    times, ids = np.array([0.002, 0.001, 0.03]), np.array([1, 0, 1])
    rows = "".join(f"{time}\tcell {index}\t{index}\n" for time, index in zip(times, ids, strict=True))
    (tmp_path / "s.tsv").write_text(f"t_s\tname\tid\n{rows}")
    (tmp_path / "s.csv").write_text(f"t_s;name;id\n{rows}".replace("\t", ";"))
    np.savez(tmp_path / "s.npz", t_s=times, id=ids, name=np.array(["a", "b", "c"]))
    pandas.DataFrame({"t_s": times, "id": ids}).to_parquet(tmp_path / "s.parquet")
    wanted = of("{spikes: {times: [[1], [2, 30]], time: ms}}", 2)
    text = f"{HEAD}inputs: {{s: {{spikes: {{%s, columns: {{time: t_s, index: id}}}}, size: 2}}}}\n"
    text += "neurons: {A: {count: 2, input: s}}"
    for suffix in ("tsv", "csv", "npz", "parquet"):
        network = nv.compile_text(text % f"file: s.{suffix}", folder=tmp_path)
        assert network.hash == wanted.hash
        # the spec as one text has them within
        assert nv.compile_text(network.text()).hash == wanted.hash
    inline = 'csv: "t_s,id\\n0.001,0\\n0.002,1\\n0.03,1\\n"'
    assert nv.compile_text(text % inline).hash == wanted.hash
    (tmp_path / "s.csv").write_text("index,time\n")
    none = nv.compile_text(
        f"{HEAD}inputs: {{s: {{spikes: s.csv, size: 2}}}}\nneurons: {{A: {{count: 2, input: s}}}}", folder=tmp_path
    )
    assert not none.run(5)["A"].any()
    assert nv.compile_text(none.text()).hash == none.hash


@pytest.mark.parametrize(
    ("rows", "messages"),
    [
        ("0.1,x\ny,1\n", ["row 3, column 1: 'y' is no number", "row 2, column 2: 'x' is no number"]),
        ("0.1,\n", ["row 2, column 2 of the file is empty; a spike needs a number everywhere"]),
        ("0.1,nan\n", ["row 2, column 2: 'nan' is not finite"]),
        ("0.1,1,2\n", ["row 2 has 3 cells, the header 2"]),
        ("-1,1\n1,2.5\n", ["row 2, column 1 of the file: a spike is at 0", "row 3, column 2 of the file: numbers of"]),
    ],
)
def test_rows_that_are_no_spikes(tmp_path: Path, rows: str, messages: list[str]) -> None:
    (tmp_path / "s.csv").write_text("time,index\n" + rows)
    text = f"{HEAD}inputs: {{s: {{spikes: s.csv, size: 2}}}}\nneurons: {{A: {{count: 2, input: s}}}}"
    with pytest.raises(nv.SpecError) as caught:
        nv.compile_text(text, folder=tmp_path)
    found = [(item.message, item.hint or "") for item in caught.value.diagnostics]
    assert len(found) == len(messages)
    for (message, hint), wanted in zip(found, messages, strict=True):
        assert wanted in message
        assert "an empty cell means" not in hint


def test_a_caller_replaces_what_is_counted() -> None:
    network = of("{spikes: {times: [[0.001], [0.002]]}}", 2)
    np.testing.assert_array_equal(network.run(5, inputs={"s": [7, 8]})["A"], [[7, 8]] * 5)
    simulation = of("{poisson: 100}").simulator()
    simulation.step({"s": 3.5})
    assert simulation.activity.tolist() == [3.5]


def test_rain_is_the_stated_draw_and_can_be_set() -> None:
    text = HEAD + "parameters: {rate: 900}\ninputs: {s: {size: 5, poisson: rate*i}}\nneurons: {A: {count: 5, input: s}}"
    network = nv.compile_text(text)
    i, k = np.arange(5), np.arange(40).reshape(-1, 1)
    each = np.arange(5.0)
    stream = Stream(3, "input", "s")
    np.testing.assert_array_equal(network.run(40)["A"], counts(900 * each * 0.001, stream.uniform(i, 0, k, 0)))
    simulation = network.simulator()
    simulation.set(rate=5000)
    simulation.step()
    np.testing.assert_array_equal(simulation.activity, counts(5000 * each * 0.001, stream.uniform(i, 0, 0, 0)))
    with pytest.raises(nv.ParameterError):
        simulation.set(rate=-1)


def test_a_rate_that_becomes_negative_is_told() -> None:
    with pytest.warns(RuntimeWarning, match="nan at step 11"):
        of("{poisson: 10 - 1000*t}").run(40)


def test_rain_goes_on_behind_a_recording() -> None:
    network = of("{size: 3, poisson: 700}", 3)
    whole, first = network.run(40)["A"], network.run(20)
    np.testing.assert_array_equal(network.run(20, start=first)["A"], whole[20:])


def test_how_many_steps_are_counted_at_once_changes_no_bit(monkeypatch: pytest.MonkeyPatch) -> None:
    network = nv.compile_text(SPEC).network
    whole = np.stack(list(InputReader(network).rows(30, 300)))
    for values in (1, 100, 1 << 20):
        monkeypatch.setattr(inputs, "_MOST_VALUES", values)
        assert np.array_equal(np.stack(list(InputReader(network).rows(30, 300))), whole)


def test_an_instance_has_an_input_of_its_own() -> None:
    module = "modules: {m: {parameters: {r: 300}, inputs: {s: {size: 2, poisson: r*(i + 1)}}, "
    module += "neurons: {A: {count: 2, input: s}}}}\n"
    network = nv.compile_text(HEAD + module + "instances: {a: {module: m}, b: {module: m, set: {r: 900}}}")
    recording, k = network.run(40), np.arange(40).reshape(-1, 1)
    for name, rate in (("a", 300), ("b", 900)):
        drawn = Stream(3, "input", f"{name}.s").uniform(np.arange(2), 0, k, 0)
        np.testing.assert_array_equal(recording[f"{name}.A"], counts(rate * np.array([1, 2]) * 0.001, drawn))


def test_an_index_is_no_constant() -> None:
    recording = of("{size: 3, expression: t + 10*i + n}", 3).run(5)
    np.testing.assert_allclose(recording["A"], np.arange(5).reshape(-1, 1) * 0.001 + 10 * np.arange(3) + 3, atol=1e-15)
    assert of("{size: 3, expression: t + i}", 3).hash != of("{size: 3, expression: t}", 3).hash


def test_step_check_finds_no_order_in_what_is_counted() -> None:
    model = "models: {m: {state: {v: {derivative: drive - v}}, activity: v}}\n"
    text = HEAD + model + "inputs: {s: {spikes: {times: [[0.004]]}}}\nneurons: {A: {model: m, input: s}}"
    (error,) = {one.why for one in nv.compile_text(text).check_step(steps=20).errors}
    assert error == "an input that counts"


@given(st.floats(0, 60), st.integers(0, 2**53 - 10**4))
def test_a_count_is_a_quantile_from_the_mode_outwards(mean: float, bits: int) -> None:
    """The counts on one side of the mode share the number with those on the other; the sum of all is 1."""
    uniform = bits / 2**53
    drawn = int(counts(mean, np.array(uniform)))

    def probability(k: int) -> float:
        return math.exp(k * math.log(mean) - mean - math.lgamma(k + 1)) if mean > 0 else float(k == 0)

    mode, total = math.floor(mean), 0.0
    order = [mode] + [k for away in range(1, 400) for k in (mode + away, mode - away) if k >= 0]
    for k in order:
        if k == drawn:
            break
        total += probability(k)
    assert total - 1e-12 <= uniform <= total + probability(drawn) + 1e-12 or probability(drawn) < 1e-12


def test_counts_have_the_mean_and_the_variance() -> None:
    for mean in (0.01, 0.7, 15.99, 16.0, 300.5, 20000.0):
        drawn = counts(mean, Stream(1, "weight", "A").uniform(np.arange(20000), 0, 0, 0))
        assert abs(drawn.mean() - mean) < 5 * math.sqrt(mean / 20000)
        assert abs(drawn.var() / mean - 1) < 0.15 or mean < 0.1
    assert np.isnan(counts(np.array([-1.0, np.nan, np.inf, 2 * LARGEST_MEAN]), np.full(4, 0.5))).all()
    assert counts(np.array([0.0, 0.5, 3.0, 20.0, 1e6]), np.full(5, 0.75)).tolist() == [0.0, 1.0, 1.0, 15.0, 998850.0]
