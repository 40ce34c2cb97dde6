"""Files of a live run: the picture and the film that the page has, and a recording with every bit."""

from __future__ import annotations

import io
import json
import re
import struct
from collections.abc import Callable, Collection
from contextlib import suppress
from dataclasses import fields
from pathlib import Path
from queue import SimpleQueue

import numpy as np
import pytest
import toy_bodies
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from PIL import Image
from scenes import file_of, scene_of

import neurovis_spec as nv
from neurovis_spec.language.format.append import append
from neurovis_spec.live.as_events import as_events
from neurovis_spec.live.commands import Fetch, Seek
from neurovis_spec.live.desk import Desk
from neurovis_spec.live.recorded import RecordedSource
from neurovis_spec.live.run import Run
from neurovis_spec.live.saving import film, picture, recording, steps_for, told_by
from neurovis_spec.live.show import Show
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.live.source import SourceError
from neurovis_spec.live.turns import Feed, Hold, Learn, Lesion, Mend, Release, Set, Turn, Weigh
from neurovis_spec.live.view import view_of
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.scene.film_size import frames_a_second

COMPILED = nv.compile(Path(__file__).parents[1] / "specs/cpg_rbf.yaml")


def test_the_last_steps_are_recalled_and_the_run_goes_on() -> None:
    source = SimulatedSource(COMPILED.simulator())
    for _ in range(150):
        source.advance()
    source.turn(Set({"eta": 0.5}))
    seen = source.recall(100)
    assert [one.snapshot.step for one in seen] == list(range(51, 151))
    assert source.step == 150
    assert source.parameters["eta"] == 0.5
    source.advance()
    assert source.step == 151
    run = COMPILED.run(152)
    assert all(np.array_equal(one.snapshot.activity, run.activity[one.snapshot.step]) for one in seen)


def test_a_recording_has_every_bit(tmp_path: Path) -> None:
    source = SimulatedSource(COMPILED.simulator())
    for _ in range(200):
        source.advance()
    (tmp_path / "x.npz").write_bytes(recording(COMPILED.network, told_by(source, 1000)))
    found, run = nv.load(tmp_path / "x.npz"), COMPILED.run(201)
    assert np.array_equal(found.activity, run.activity)
    assert np.array_equal(found.weights, run.weights)
    assert np.array_equal(found.weights_after, run.weights_after)
    assert (found.step == run.step).all()
    assert found.hash == run.hash
    assert COMPILED.run(5, start=found).activity.tolist() == COMPILED.run(5, start=run).activity.tolist()


def test_the_picture_is_that_of_render() -> None:
    view = view_of(COMPILED, COMPILED.gains)
    source = SimulatedSource(COMPILED.simulator())
    scene = scene_of(COMPILED, COMPILED.run(1).snapshot(0))
    for suffix in (".svg", ".pdf"):
        assert picture(view, told_by(source, 1), suffix) == file_of(scene, suffix)


def test_a_film_has_a_frame_for_each_step_and_says_how_far_it_is() -> None:
    """Fetched as a page does: the answers are words of how far it is, then the file."""
    network, answers = COMPILED, SimpleQueue[str | bytes]()
    source, view = Show().stage(network)
    run = Run(source, view, lambda _: None, lambda: False, playing=False)
    desk = Desk(network, None, Show().view, run, lambda _: None)
    run.start()
    desk.start()
    try:
        run.ask(Seek(30))
        desk.ask(Fetch("gif", 20 / frames_a_second(network.network)), answers.put)
        words, answer = list[str](), answers.get(timeout=60)
        while isinstance(answer, str):
            words.append(json.loads(answer)["type"])
            answer = answers.get(timeout=60)
        assert set(words) == {"making"}
        head = 4 + struct.unpack_from("<BxH", answer)[1]
        assert answer[4:head].decode() == f"{network.name}.gif"
        with Image.open(io.BytesIO(answer[head:])) as made:
            assert getattr(made, "n_frames", 1) > 5
    finally:
        desk.end()
        run.end()


def test_what_was_lesioned_by_hand_is_faint_in_picture_and_film() -> None:
    view = view_of(COMPILED, COMPILED.gains)
    source = SimulatedSource(COMPILED.simulator())
    for _ in range(20):
        source.advance()
    before = told_by(source, 1)
    source.turn(Lesion("K3"))
    for _ in range(20):
        source.advance()
    told = told_by(source, 30)
    assert picture(view, told).count(b"opacity") > picture(view, before).count(b"opacity")
    moving = film(view, told)
    assert re.search(rb"<animate|@keyframes", moving)
    assert io.BytesIO(moving).read(4) in (b"<svg", b"<?xm")


def test_memory_is_bounded() -> None:
    assert steps_for(COMPILED.network, 5) == 100, "20 steps a second"
    assert steps_for(COMPILED.network, None) == 10_000


FOLLOWING = """neurovis: 1
name: following
time: {dt: 0.05, steps: 40}
parameters: {pull: {value: 0.1, min: 0, max: 1}, twice: 2 * pull, mix: 0.5}
inputs: {push: {}, wave: {size: 3, expression: sin(k/3)}}
neurons:
  A: {count: 3, activation: tanh, noise: "normal(0, 0.05)", input: wave}
  B: {activation: tanh, bias: twice, input: push}
  S: {model: integrate_and_fire, bias: 0.4}
connections:
  A -> A: {pattern: all_to_all, weight: "uniform(-1, 1)", delay: 2}
  A -> B: {weight: mix, plasticity: {hebbian: {rate: 0.05}}}
  B -> B: pull
  S -> A: {weight: -twice, delay: 3}
outputs: {drive: B, charge: S.v}
events:
  - {at: 6, lesion: [A2]}
  - {at: 9, mend: [A2]}
  - {at: 9, set: {pull: 0.3}}
  - {at: 7, feed: {push: 0.4}}
"""
LEGS = """neurovis: 1
name: legs
time: {dt: 0.05, steps: 40, episode: 10}
parameters: {gain: 0.7}
modules:
  leg:
    parameters: {strength: 1}
    neurons: {K: {count: 2, activation: tanh, bias: 0.3}, O: {activation: tanh}}
    connections: {K -> O: {weight: strength * 0.5}, O -> K: {weight: -0.4, delay: 3, plasticity: {oja: {rate: 0.1}}}}
neurons: {C: {activation: tanh, bias: 0.2}}
instances: {left: {module: leg, count: 2, set: {strength: gain}}, right: {module: leg}}
connections:
  C -> left1.K: {pattern: all_to_all, weight: gain}
events:
"""
CART = (
    toy_bodies.SPEC.replace("{gain: 0.8}", "{gain: 0.8, much: -0.7}").replace("-0.7}\n  A", "much}\n  A") + "events:\n"
)
#: Specs, how they are compiled, and what can be turned: neurons, connections, rules, parameters, inputs.
SAVED: dict[str, tuple[str, Callable[[str], nv.CompiledNetwork], tuple[list[str], ...]]] = {
    "following": (
        FOLLOWING,
        nv.compile_text,
        (["A3", "B"], ["A1 -> A3", "S -> A1"], ["A -> B"], ["pull", "twice", "mix"], ["push", "wave"]),
    ),
    "legs": (LEGS, nv.compile_text, (["left1.K2", "C"], ["left2.K1 -> left2.O"], ["right.O -> right.K"], ["gain"], [])),
    "body": (
        CART,
        lambda text: toy_bodies.carted(spec=text),
        (["A1", "O2"], ["P -> O1"], ["W -> O"], ["gain", "much"], ["arms"]),
    ),
    "whole body": (
        CART,
        lambda text: toy_bodies.carted("whole", spec=text),
        (["P"], ["W -> O2"], ["W -> O"], ["much"], ["arms", "place"]),
    ),
}


def turns(parts: tuple[list[str], ...]) -> st.SearchStrategy[Turn]:
    """Turns that the page can copy as events."""
    *names, inputs = parts
    neurons, connections, rules, parameters = map(st.sampled_from, names)
    fed = [st.builds(Feed, st.sampled_from(inputs), st.sampled_from([(), (0.5,), (0.1, 0.2, 0.3)]))] if inputs else []
    value, either = st.sampled_from([0.0, 0.25, 0.6, 1.0]), neurons | connections
    return st.one_of(
        st.builds(lambda name, one: Set({name: one}), parameters, value),
        st.builds(Hold, neurons, value), st.builds(Release, neurons), st.builds(Learn, rules, st.booleans()),
        st.builds(Lesion, either), st.builds(Mend, either), st.builds(Weigh, connections, value), *fed,
    )  # fmt: skip


def equal(one: Recording, other: Recording, but: Collection[str] = ()) -> None:
    """That two recordings hold the same, bit for bit."""
    for field in fields(Recording):
        if field.name not in ("hash", *but):
            a, b = getattr(one, field.name), getattr(other, field.name)
            assert (a.tobytes() == b.tobytes()) if isinstance(a, np.ndarray) else a == b, field.name


AFTER = ("weights_after", "set_parameters", "lesioned_neurons", "lesioned_connections")


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("name", SAVED)
@given(data=st.data())
@settings(max_examples=8, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_what_is_saved_is_the_run_of_the_spec_with_the_events_that_are_copied(
    name: str, data: st.DataObject, tmp_path: Path
) -> None:
    with pytest.MonkeyPatch.context() as patched:
        toy_bodies.registered(patched)
        text, compile, parts = SAVED[name]
        given = text if text is FOLLOWING else text.removesuffix("events:\n")
        network = compile(given)
        source = SimulatedSource(network.simulator())
        for what, steps in data.draw(st.lists(st.tuples(turns(parts), st.integers(-2, 4)), max_size=8)):
            with suppress(SourceError):
                source.turn(what)
            source.go(min(source.number_after(steps), source.reach.last))
            for _ in range(steps):
                source.advance()
        copied = as_events(source.turned)
        assume(copied.text)
        told = told_by(source, 1000)
        (tmp_path / "x.npz").write_bytes(recording(network.network, told))
        saved, again = nv.load(tmp_path / "x.npz"), compile(append(given, "events", copied.entries, copied.comments))
        run = again.run(source.step + 1)
        last = [entry.turn for entry in source.turned if entry.step == source.step]
        at_the_end = any(isinstance(what, Set | Lesion | Mend | Weigh) for what in last)
        equal(saved, run, AFTER if at_the_end else ())
        if at_the_end:  # what was turned at the step that is shown is true after it
            simulator = again.simulator()
            for _ in range(source.step + 1):
                simulator.step()
            after = simulator.after()
            assert saved.weights_after.tobytes() == after.weights[again.network.changing].tobytes()
            assert saved.set_parameters == after.set_parameters
            assert np.array_equal(saved.lesioned_neurons, after.lesioned_neurons)
            assert np.array_equal(saved.lesioned_connections, after.lesioned_connections)


@pytest.mark.parametrize("name", ["following", "body"])
def test_the_pictures_that_are_saved_are_those_of_the_run_of_the_spec_with_the_events(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    toy_bodies.registered(monkeypatch)
    text, compile, (neurons, _, _, parameters, _) = SAVED[name]
    network = compile(text if text is FOLLOWING else text.removesuffix("events:\n"))
    source = SimulatedSource(network.simulator())
    for what in (Set({parameters[0]: 0.6}), Hold(neurons[0], 0.25), Mend(neurons[1]), Lesion(neurons[1])):
        source.turn(what)
        source.advance()
        source.advance()
    again = compile(append(text, "events", as_events(source.turned).entries))
    view, same = (view_of(one, network.gains) for one in (network, again))
    played = RecordedSource(again.network, again.run(source.step + 1))
    played.go(source.step)
    assert picture(view, told_by(source, 1)) == picture(same, told_by(played, 1))
    assert film(view, told_by(source, 2)) == film(same, told_by(played, 2))


def test_a_picture_with_the_body_has_its_legend_as_that_of_render_has(monkeypatch: pytest.MonkeyPatch) -> None:
    toy_bodies.registered(monkeypatch)
    network = toy_bodies.carted()
    words = picture(view_of(network, network.gains), told_by(SimulatedSource(network.simulator()), 1)).decode()
    assert "touching" in words
    assert "in the air" in words
    assert "Thickness" in words
