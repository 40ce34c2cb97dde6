"""What ``run`` writes, ``load`` reads, whatever was recorded: some neurons, states, weights or none, one step in K, in
every format; and what a recording lacks is said by whatever needs it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st
from toy_bodies import SPEC as CART
from toy_bodies import carted, registered

import neurovis_spec as nv
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.fitting import fitted
from neurovis_spec.runtime.recording import Recording

LEG = """\
modules:
  leg:
    neurons: {K: {count: 2, model: {adaptive: {}}, bias: 1 + i}, v: {bias: 0.5}}
    connections:
      K -> K: {pattern: all_to_all, self: true, weight: 0.1, plasticity: hebbian}
"""
REST = """\
neurons:
  A: {count: 3, model: leaky_integrator, bias: 1 + i, activation: tanh}
  R: {input: reward}
  O: {}
connections:
  - A -> O: {weight: 0.1, plasticity: {reward_modulated: {policy: R, reward: R}}}
  - A1 -> O: {weight: 0.2, delay: 2, plasticity: oja}
  - A1 -> O: {weight: 0.2, delay: 3, plasticity: {reward_modulated: {policy: R, reward: R}}}
  - R -> A: 0.3
"""
HEAD = "neurovis: 1\nname: parts\ntime: {dt: 0.1, steps: 13, episode: 4}\ninputs: {reward: {expression: sin(k)}}\n"
INSTANCES = "instances: {left: {module: leg, count: 2}, A0: {module: leg}}\n"
#: what a recording of O alone lacks
OTHERS = "the activities of A1, A2, A3, R"
OUTPUTS = "outputs: {membrane: A.v, one: A2.v, trace: (A -> O).eligibility, signal: O}\n"
#: a spec, the references that a recording may be asked for, those to its states
SPECS = {
    "plain": (HEAD + REST, ["O", "A", "A1..A2", "R"], ["A.v", "A2.v", "(A -> O).eligibility", "(A1 -> O).baseline"]),
    "outputs": (HEAD + REST + OUTPUTS, ["O", "A3", "R"], ["A3.v", "(A -> O).baseline"]),
    "modules": (
        HEAD + LEG + REST + INSTANCES,
        ["O", "A", "left.K", "left1.K2", "A0.v", "A0.K"],
        ["left.K.b", "A0.K.b", "A1.v", "(A3 -> O).eligibility"],
    ),
    "body": (CART, ["P", "A", "W + O1", "O"], []),
}


def network_of(name: str) -> CompiledNetwork:
    return carted() if name == "body" else nv.compile_text(SPECS[name][0])


@pytest.fixture(scope="module")
def networks() -> dict[str, CompiledNetwork]:
    with pytest.MonkeyPatch.context() as patch:
        registered(patch)
        return {name: network_of(name) for name in SPECS}


@pytest.fixture(autouse=True)
def _carts(monkeypatch: pytest.MonkeyPatch) -> None:
    registered(monkeypatch)


@pytest.fixture(scope="module")
def wholes(networks: dict[str, CompiledNetwork]) -> dict[str, Recording]:
    """All of a run, all states included."""
    with pytest.MonkeyPatch.context() as patch:
        registered(patch)
        return {name: network.run(13, states=SPECS[name][2]) for name, network in networks.items()}


def some(names: Sequence[str]) -> st.SearchStrategy[list[str]]:
    return st.lists(st.sampled_from(names), max_size=2, unique=True) if names else st.just([])


def disjoint(whole: Recording, references: Sequence[str]) -> list[str]:
    """Those references that name no neuron twice."""
    seen: set[str] = set()
    kept = []
    for reference in references:
        own = set(whole.names_of(reference))
        if seen.isdisjoint(own):
            kept.append(reference)
            seen |= own
    return kept


def agree(
    back: Recording, whole: Recording, neurons: set[str], states: set[str], weights: set[str], every: int
) -> None:
    """What was recorded is there to the bit, what was not is not."""
    for name in whole.neurons:
        if name in neurons:
            assert np.array_equal(back[name], whole[name][::every])
        else:
            with pytest.raises(KeyError):
                back[name]
    for name in whole.state_names:
        if name in states:
            assert np.array_equal(back[name], whole[name][::every])
        else:
            assert name not in back
    for index in whole.plastic.tolist():
        name = whole.connection_names[index]
        if name in weights:
            assert np.array_equal(back.weight(name), whole.weight(name)[::every])
        else:
            with pytest.raises(KeyError):
                back.weight(name)
    assert back.sensor_names == whole.sensor_names
    if whole.sensors is not None:
        assert back.sensors is not None
        assert np.array_equal(back.sensors, whole.sensors[::every])
    assert (back.dt, back.step.tolist()) == (whole.dt, whole.step[::every].tolist())


@settings(max_examples=40)
@given(
    data=st.data(),
    name=st.sampled_from(sorted(SPECS)),
    weights=st.sampled_from([["plastic"], ["none"], [0], [0, 1], [2]]),
    every=st.sampled_from([1, 1, 3]),
    suffix=st.sampled_from(["npz", "csv", "csv", "mcap"]),
    streamed=st.booleans(),
)
def test_what_run_writes_load_reads(
    networks: dict[str, CompiledNetwork],
    wholes: dict[str, Recording],
    data: st.DataObject,
    name: str,
    weights: list[str | int],
    every: int,
    suffix: str,
    streamed: bool,
) -> None:
    network, whole = networks[name], wholes[name]
    neurons = disjoint(whole, data.draw(some(SPECS[name][1])))
    states = data.draw(some(SPECS[name][2]))
    held = {one for reference in neurons for one in whole.names_of(reference)} or set(whole.neurons)
    changing = [whole.connection_names[index] for index in whole.plastic.tolist()]
    kept = [changing[one % len(changing)] if isinstance(one, int) else one for one in weights]
    named = {name for name in changing if any(name == one or name.startswith(f"{one} (") for one in kept)}
    some_weights = {"plastic": set(changing), "none": set[str]()}.get(kept[0], named)  # of the same ends all
    made = network.run(13, every=every, neurons=neurons, states=states, weights=kept)
    partial = len(held) < len(whole.neurons) or 0 < len(some_weights) < len(changing)
    with TemporaryDirectory() as folder:
        path = Path(folder) / f"x.{suffix}"

        def write() -> None:
            if streamed:
                network.run_to(path, 13, every=every, neurons=neurons, states=states, weights=kept)
            else:
                made.save(path)

        if suffix == "mcap" and partial:
            with pytest.raises(RecordingError, match=r"record a part as \.npz or \.csv"):
                write()
            assert not list(Path(folder).iterdir())
            return
        write()
        back = nv.load(path)
    agree(back, whole, held, set(made.state_names), some_weights, every)
    fit = fitted(back, network.network)
    agree(fit, whole, held, set(made.state_names), some_weights, every)
    assert fit.neurons == whole.neurons
    assert fit.missing == made.missing
    if fit.missing is None:
        assert network.run(1, start=back).step.tolist() == [0]
    else:
        with pytest.raises(RecordingError, match="go on from a partial recording"):
            network.run(1, start=back)


def test_a_table_of_before_is_read(tmp_path: Path) -> None:
    """Tables of some neurons had their states unmarked."""
    path = tmp_path / "x.csv"
    path.write_text("step,t,B,A -> B,A.v,(A -> B).e\n0,0.0,1.0,2.0,3.0,4.0\n", "utf-8")
    back = nv.load(path)
    assert (back.neurons, back.columns, back.state_names) == (("B", "A"), ("B",), ("A.v", "(A -> B).e"))
    found = [back[name].tolist() for name in ("B", "A.v", "(A -> B).e")]
    assert [*found, back.weight("A -> B").tolist()] == [[1.0], [3.0], [4.0], [2.0]]
    with pytest.raises(KeyError, match="A was not recorded: the recording is partial and holds B"):
        back["A"]


def test_the_step_of_a_table_is_the_one_that_was_run(tmp_path: Path) -> None:
    for dt in (0.1, 0.3, 1 / 3, 0.025, 1e-4, 7.3e-3, 2.0, 0.7):
        network = nv.compile({"neurovis": 1, "name": "x", "time": {"dt": dt}, "neurons": {"A": {"bias": 1}}})
        for steps, every in ((2, 1), (50, 7), (1000, 333)):
            network.run_to(tmp_path / "x.csv", steps, every=every)
            assert nv.load(tmp_path / "x.csv").dt == dt


@pytest.mark.parametrize("suffix", ["npz", "csv"])
@pytest.mark.parametrize(
    ("kept", "lacking"),
    [
        (["--neurons", "O"], OTHERS),
        (
            ["--neurons", "O", "--weights", "none", "--states", "A.v"],
            "the activities of A1, A2, A3, R and the changing weights",
        ),
        (["--weights", "none"], "the changing weights"),
    ],
)
def test_what_a_command_lacks_is_said(tmp_path: Path, suffix: str, kept: list[str], lacking: str) -> None:
    (tmp_path / "x.yaml").write_text(SPECS["plain"][0], "utf-8")
    spec, part = str(tmp_path / "x.yaml"), str(tmp_path / f"part.{suffix}")

    def answer(*words: str) -> tuple[int, str]:
        result = CliRunner().invoke(neurovis, words)
        assert result.exception is None or isinstance(result.exception, SystemExit)
        return result.exit_code, result.stderr

    assert answer("run", spec, "-o", part, *kept)[0] == 0
    for command in (
        ("render", spec, "--recording", part, "-o", str(tmp_path / "x.svg")),
        ("animate", spec, "--recording", part, "-o", str(tmp_path / "x.gif")),
        ("live", spec, "--recording", part),
        ("run", spec, "--from", part, "-o", str(tmp_path / "on.npz")),
        ("export", spec, "--to", "c", "--from", part, "-o", str(tmp_path / "c")),
    ):
        code, said = answer(*command)
        assert code == 1
        assert f"a partial recording: it lacks {lacking}" in said
    folder = tmp_path / "report"
    assert answer("analyze", spec, "--recording", part, "-o", str(folder), "--no-trials")[0] == 0
    page = (folder / "index.html").read_text("utf-8")
    assert f"a map is not drawn of a partial recording: it lacks {lacking}" in page
    assert ("1 of 5" in page) == ("--neurons" in kept)
    assert not [path for path in tmp_path.iterdir() if path.name in ("x.svg", "x.gif", "on.npz", "c")]


def test_a_table_with_states_is_drawn(tmp_path: Path) -> None:
    network = nv.compile_text(SPECS["outputs"][0])
    network.run_to(tmp_path / "x.csv", states=["A1.v", "(A -> O).baseline"])
    network.run_to(tmp_path / "x.npz")
    for suffix in ("csv", "npz"):
        network.render(tmp_path / f"{suffix}.svg", step=5, recording=nv.load(tmp_path / f"x.{suffix}"))
    assert (tmp_path / "csv.svg").read_bytes() == (tmp_path / "npz.svg").read_bytes()
