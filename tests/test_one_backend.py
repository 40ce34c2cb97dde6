"""One network, one machine, one backend: which it is, who says so, and that what goes on goes on with it."""

from __future__ import annotations

import re
import warnings
import zipfile
from collections.abc import Iterator
from importlib.metadata import EntryPoint
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result
from test_checkpoint import SPEC as PARTS
from toy_bodies import BODY, registered
from toy_bodies import SPEC as CARTED

import neurovis_spec as nv
from neurovis_spec import plugins
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.runtime import backend as backends
from neurovis_spec.runtime import c_library
from neurovis_spec.runtime.backend import (
    ENVIRONMENT_VARIABLE,
    Availability,
    BackendError,
    Capabilities,
    choose_backend,
    load,
    names,
    ready,
)
from neurovis_spec.runtime.c_library import Compiler, CompilerError
from neurovis_spec.runtime.numpy_backend import NumpyBackend
from neurovis_spec.runtime.recording import Recording


@pytest.fixture
def chosen_here(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The default is that of the machine, and what it says once has not been said yet."""
    monkeypatch.delenv(ENVIRONMENT_VARIABLE)
    monkeypatch.delenv("CC", raising=False)
    backends._warn_once.cache_clear()
    yield
    backends._warn_once.cache_clear()


@pytest.fixture
def network() -> nv.CompiledNetwork:
    return nv.compile_text(PARTS)


def invoke(*arguments: str) -> Result:
    return CliRunner().invoke(neurovis, arguments)


# ---- which it is ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("found", "name", "words"),
    [
        (Compiler(("/usr/bin/gcc",), "gcc", ""), "c", "compiled by gcc"),
        (Compiler(("python", "-m", "ziglang", "cc"), "ziglang", "", on_request=True), "numpy", "c on request"),
        (None, "numpy", "there is no C compiler"),
    ],
)
@pytest.mark.usefixtures("chosen_here")
def test_it_depends_on_the_machine_and_not_on_the_steps(
    found: Compiler | None, name: str, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def compiler() -> Compiler:
        if found is None:
            raise CompilerError("there is no C compiler")
        return found

    monkeypatch.setattr(c_library, "compiler", compiler)
    for steps in (1, 10**6):
        made = choose_backend(nv.compile_text(PARTS.replace("steps: 60", f"steps: {steps}")).network)
        assert made[0] == name
        assert words in made[1]
        assert "5 neurons" in made[1]


class Fast(NumpyBackend):
    """A backend of somebody else's."""

    name = "a fast one"
    by_default, works = True, True
    capabilities = Capabilities(noise=True)

    def availability(self) -> Availability:
        return Availability(self.works, "by a fast processor" if self.works else "no such processor", self.by_default)


@pytest.mark.usefixtures("chosen_here")
def test_a_backend_of_somebody_else_s_may_be_the_default(
    network: nv.CompiledNetwork, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By the mechanism by which C is: where it says so, and can run the network."""
    ours = dict(plugins._points(plugins.BACKENDS))
    theirs = EntryPoint("a fast one", "test_one_backend:Fast", plugins.BACKENDS)
    monkeypatch.setattr(plugins, "_points", lambda group: {"a fast one": theirs, **ours})
    monkeypatch.setattr(EntryPoint, "load", lambda self: Fast if self is theirs else loaded(self))
    assert network.choose_backend()[0] == "a fast one"
    assert "by a fast processor" in network.choose_backend()[1]
    monkeypatch.setattr(c_library, "compiler", no_compiler)
    monkeypatch.setattr(Fast, "capabilities", Capabilities(noise=True, largest=3))
    assert choose_backend(network.network)[0] == "numpy"
    assert "at most 3 neurons" in choose_backend(network.network)[1]
    monkeypatch.setattr(Fast, "capabilities", Capabilities(noise=True))
    monkeypatch.setattr(Fast, "works", False)
    with pytest.warns(RuntimeWarning, match="no such processor"):
        assert network.choose_backend()[0] == "numpy"
    monkeypatch.setattr(Fast, "by_default", False)
    assert choose_backend(network.network)[0] == "numpy"
    assert Availability(True).by_default is False  # who says nothing of it waits to be named


def no_compiler() -> Compiler:
    raise CompilerError("there is no C compiler")


loaded = EntryPoint.load


def test_the_environment_names_another_default(network: nv.CompiledNetwork, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(ENVIRONMENT_VARIABLE, "reference")
    assert network.choose_backend() == ("reference", "named by NEUROVIS_BACKEND")
    assert network.run(3).backend == network.simulator().backend == "reference"
    monkeypatch.setenv(ENVIRONMENT_VARIABLE, "nmupy")
    with pytest.raises(BackendError, match="NEUROVIS_BACKEND names 'nmupy', which is no backend; did you mean 'numpy'"):
        network.run(3)


@pytest.mark.usefixtures("chosen_here")
def test_one_neuron_is_one_neuron(tmp_path: Path) -> None:
    one = nv.compile_text("neurovis: 1\nname: x\nneurons: {A: {count: 1}}\nconnections: {A -> A: 0.5}\n")
    assert "(1 neuron, 1 connection)" in one.choose_backend()[1]
    one.export(tmp_path)
    said = [repr(one), repr(one.run(1)), *(file.read_text() for file in tmp_path.iterdir())]
    for text in said:
        assert not re.search(r"\b1 (neurons|connections|steps)\b", text)


def test_auto_means_the_choice(tmp_path: Path, network: nv.CompiledNetwork, monkeypatch: pytest.MonkeyPatch) -> None:
    """As where nothing is named: what goes on goes on with its backend, and the environment may name a default."""
    (tmp_path / "spec.yaml").write_text(PARTS)
    assert network.run(3, backend="auto").backend == network.simulator("auto").backend == "numpy"
    before = network.run(3, backend="reference")
    assert network.run(3, backend="auto", start=before).backend == "reference"
    done = invoke("run", str(tmp_path / "spec.yaml"), "--steps", "3", "--backend", "auto")
    assert done.stdout.splitlines()[0].endswith("backend numpy"), done.output
    neuron, seed = network.network.neurons.names[0], network.network.seed
    table = nv.sweep(tmp_path / "spec.yaml", {"seed": [seed]}, {"last": f"{neuron} * 1"}, steps=3, backend="auto")
    assert table["last"][0] == network.run(3)[neuron][-1]
    monkeypatch.setenv(ENVIRONMENT_VARIABLE, "auto")
    assert network.choose_backend() == chosen_without(network, monkeypatch)


def chosen_without(network: nv.CompiledNetwork, monkeypatch: pytest.MonkeyPatch) -> tuple[str, str]:
    monkeypatch.delenv(ENVIRONMENT_VARIABLE)
    return network.choose_backend()


@pytest.mark.parametrize(
    ("compiler", "reason"),
    [
        ("false", "'false' fails with status 1"),
        ("/nonexistent/cc -m64", "CC names '/nonexistent/cc', which is not there"),
        ("'", 'CC is no command: "\'"'),
    ],
)
@pytest.mark.usefixtures("chosen_here")
def test_a_compiler_that_fails_is_told_of_once(
    compiler: str, reason: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, network: nv.CompiledNetwork
) -> None:
    """A compiler that cannot compile, or that is asked for and not there: array code runs, and says why, in inspect,
    too."""
    monkeypatch.setenv("CC", compiler)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    (tmp_path / "spec.yaml").write_text(PARTS)
    first = invoke("run", str(tmp_path / "spec.yaml"), "--steps", "5")
    assert first.exit_code == 0, first.output
    said = f"warning: NumPy computes, as the backend 'c' is not available here: {reason}"
    assert first.stderr.splitlines().count(said) == 1
    assert first.stdout.splitlines()[0].endswith("backend numpy")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert network.run(5).backend == "numpy"
    shown = next(
        line for line in invoke("inspect", str(tmp_path / "spec.yaml")).output.splitlines() if "backend" in line
    )
    assert "numpy" in shown
    assert reason in shown
    with pytest.raises(BackendError, match=re.escape(reason)):
        network.run(5, backend="c")


# ---- what names it, and goes on with it ----------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".npz", ".mcap"])
def test_a_recording_names_its_backend_and_goes_on_with_it(
    suffix: str, tmp_path: Path, network: nv.CompiledNetwork
) -> None:
    made = network.run(20, backend="reference")
    made.save(tmp_path / f"saved{suffix}")
    assert network.run_to(tmp_path / f"run{suffix}", 20, backend="reference") == "reference"
    with network.simulator("reference", record=tmp_path / f"stepped{suffix}") as simulation:
        simulation.step()
    for name in ("saved", "run", "stepped"):
        read = nv.load(tmp_path / f"{name}{suffix}")
        assert read.backend == "reference"
        assert network.run(5, start=read).backend == network.simulator(start=read).backend == "reference"
    expected = network.run(20, backend="reference", start=made)
    assert network.run(20, start=made).activity.tobytes() == expected.activity.tobytes()


def test_a_checkpoint_names_its_backend_and_goes_on_with_it(tmp_path: Path, network: nv.CompiledNetwork) -> None:
    kept = tmp_path / "state"
    whole = network.run(backend="reference")
    network.run(25, backend="reference", checkpoint=kept)
    simulation = network.simulator()
    simulation.restore(kept)
    assert simulation.backend == "reference"
    simulation.step()
    assert simulation.activity.tobytes() == whole.activity[25].tobytes()
    simulation.reset()
    assert simulation.backend == "numpy"
    rest = network.run(35, checkpoint=kept)
    assert rest.backend == "reference"
    assert rest.activity.tobytes() == whole.activity[25:].tobytes()


def test_another_backend_is_taken_where_it_is_asked_for_and_said(tmp_path: Path, network: nv.CompiledNetwork) -> None:
    network.run(5, backend="reference", checkpoint=tmp_path / "state")
    with pytest.warns(UserWarning, match="'reference' made the steps before, and 'numpy' makes those to come"):
        assert network.run(5, backend="numpy", checkpoint=tmp_path / "state").backend == "numpy"
    before = network.run(5, backend="reference")
    with pytest.warns(UserWarning, match="their last bits may differ"):
        assert network.simulator("numpy", start=before).backend == "numpy"


@pytest.mark.filterwarnings("error")
def test_nothing_is_said_where_both_give_the_bits_of_the_reference(
    network: nv.CompiledNetwork, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert {name: load(name).capabilities.exactness for name in names()} == {
        "c": "bits",
        "numpy": "rounding",
        "reference": "bits",
    }
    monkeypatch.setattr(Fast, "capabilities", Capabilities(noise=True, exactness="bits", exact_sums=True))
    assert ready(network.network, Fast(), "reference").name == "a fast one"
    monkeypatch.setattr(Fast, "capabilities", Capabilities(noise=True, exact_sums=True))
    for before in ("reference", "one that is not here"):
        with pytest.warns(UserWarning, match="their last bits may differ"):
            ready(network.network, Fast(), before)


def test_a_warning_points_at_the_caller_s_line(network: nv.CompiledNetwork, monkeypatch: pytest.MonkeyPatch) -> None:
    """Not at one of ours, however deep in the package it is said."""
    before = network.run(5, backend="reference")
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        network.run(5, backend="numpy", start=before)
        network.simulator("numpy", start=before)
        monkeypatch.setenv("CC", "/nonexistent/cc")
        monkeypatch.delenv(ENVIRONMENT_VARIABLE)
        backends._warn_once.cache_clear()
        network.run(5)
    backends._warn_once.cache_clear()
    assert len(told) == 3
    assert [one.filename for one in told] == [__file__] * 3


@pytest.mark.parametrize("option", ["--from", "--checkpoint"])
def test_where_the_backend_of_before_is_not_there_nothing_runs(option: str, tmp_path: Path) -> None:
    """Status 1 and why, and a way out."""
    spec, before = tmp_path / "spec.yaml", tmp_path / ("a.npz" if option == "--from" else "state")
    spec.write_text(PARTS)
    assert invoke("run", str(spec), "--steps", "5", "-o" if option == "--from" else option, str(before)).exit_code == 0
    rename(before, "numpy", "tensor")
    done = invoke("run", str(spec), "--steps", "5", option, str(before))
    assert done.exit_code == 1
    assert "the steps before were made by the backend 'tensor'" in done.stderr
    assert "unknown backend 'tensor'" in done.stderr
    assert "--backend" in done.stderr
    done = invoke("run", str(spec), "--steps", "5", option, str(before), "--backend", "numpy")
    assert done.exit_code == 0
    assert "'tensor' made the steps before" in done.stderr


def rename(path: Path, backend: str, other: str) -> None:
    """Have a file name another backend."""
    with zipfile.ZipFile(path) as archive, (about := archive.open("about.npy")):
        others = {name: archive.read(name) for name in archive.namelist() if name != "about.npy"}
        text = str(np.lib.format.read_array(about))
    assert f'"backend": "{backend}"' in text
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in others.items():
            archive.writestr(name, data)
        with archive.open("about.npy", "w") as member:
            renamed = text.replace(f'"backend": "{backend}"', f'"backend": "{other}"' if other else '"was": ""')
            np.lib.format.write_array(member, np.array(renamed), allow_pickle=False)


def test_files_that_name_none_go_on_with_the_default(tmp_path: Path, network: nv.CompiledNetwork) -> None:
    network.run(5, backend="reference", checkpoint=tmp_path / "state").save(tmp_path / "a.npz")
    for name in ("state", "a.npz"):
        rename(tmp_path / name, "reference", "")
    assert nv.load(tmp_path / "a.npz").backend == ""
    assert network.run(5, start=nv.load(tmp_path / "a.npz")).backend == "numpy"
    assert network.run(5, checkpoint=tmp_path / "state").backend == "numpy"


# ---- the law -------------------------------------------------------------------------------------------------------

EVERYTHING = PARTS.replace("g*sin(k/5)", "g*sin(k/5) + tanh(level*t) - log1p(k/7) % 0.3").replace(
    "level: 0.1}", "level: exp(-g)}"
)


def in_pieces(compiled: nv.CompiledNetwork, folder: Path, steps: int) -> Recording:
    """Parts with a checkpoint, some in files, one by a simulator."""
    kept, rows = folder / "state", []
    rows.append(compiled.run(11, checkpoint=kept).activity)
    compiled.run_to(folder / "part.npz", 9, checkpoint=kept)
    rows.append(nv.load(folder / "part.npz").activity)
    simulation = compiled.simulator()
    simulation.restore(kept)
    for _ in range(8):
        simulation.step()
        rows.append(simulation.activity[None])
    simulation.save_state(kept)
    last = compiled.run(steps - 28, checkpoint=kept)
    return last.having(np.arange(steps), last.rows._replace(activity=np.concatenate([*rows, last.activity])))


@pytest.mark.compiler
@pytest.mark.parametrize("text", [EVERYTHING, CARTED + BODY], ids=["everything", "a body"])
def test_a_run_is_the_same_however_it_is_made(
    text: str, chosen_here: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In one go, in pieces, by a simulator, live, in a sweep: all the same bits, and all by C."""
    registered(monkeypatch)
    compiled = nv.compile_text(text)
    whole = compiled.run(60)
    assert whole.backend == compiled.choose_backend()[0] == "c"
    pieces = in_pieces(compiled, tmp_path, 60)
    assert pieces.activity.tobytes() == whole.activity.tobytes()
    assert pieces.weights_after.tobytes() == whole.weights_after.tobytes()
    simulation, source = compiled.simulator(), SimulatedSource(compiled.simulator())
    for row in whole.activity:
        simulation.step()
        assert simulation.activity.tobytes() == row.tobytes()
        assert source.seen().snapshot.activity.tobytes() == row.tobytes()
        assert source.advance()
    (tmp_path / "spec.yaml").write_text(text)
    neuron, seed = compiled.network.neurons.names[0], compiled.network.seed
    table = nv.sweep(tmp_path / "spec.yaml", {"seed": [seed]}, {"last": f"{neuron} * 1"}, steps=60)
    assert table["last"][0] == whole[neuron][-1]
