"""The widget without a browser: its parameters are traits, its messages are those of the protocol, and it ends."""

from __future__ import annotations

import copy
import json
import pickle
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
import traitlets
from IPython.core.formatters import DisplayFormatter

import neurovis_spec as nv
from neurovis_spec.live.protocol import FRAME, SCENE
from neurovis_spec.notebook import session
from neurovis_spec.notebook.recording import PlayedRecording
from neurovis_spec.notebook.session import MOST, Session
from neurovis_spec.notebook.widget import LiveWidget
from neurovis_spec.runtime.errors import RecordingError
from neurovis_spec.runtime.recording import Recording

ROOT = Path(__file__).parents[1]
SPEC = """neurovis: 1
name: cell
time: {dt: 0.01, steps: 40}
parameters:
  mix: {value: 0.5, min: 0, max: 1, description: how much of A there is}
  layout: 0.1
  lambda: 0.2
neurons:
  A: {activation: tanh, bias: 1}
  B: {activation: tanh, bias: layout + lambda}
connections:
  A -> B: {weight: mix}
"""


class Notebook:
    """What a notebook gets of a widget: its messages, by frame."""

    def __init__(self, widget: LiveWidget) -> None:
        self.widget = widget
        self.texts: dict[str, list[dict[str, object]]] = {}
        self.binary: dict[str, list[bytes]] = {}
        self.pages: list[str] = []
        widget.send = self._take

    def _take(self, content: dict[str, str], buffers: list[bytes] | None = None) -> None:
        if "page" in content:
            self.pages.append(content["view"])
        elif "text" in content:
            self.texts.setdefault(content["view"], []).append(json.loads(content["text"]))
        else:
            self.binary.setdefault(content["view"], []).extend(buffers or [])

    def say(self, view: object, *buffers: bytes, **content: object) -> None:
        """A message of a frame."""
        self.widget._take_message(self.widget, {"view": view, **content}, buffers)

    def kinds(self, view: str) -> list[int]:
        return [message[0] for message in self.binary.get(view, [])]


@contextmanager
def notebook(steps: int | None = None, spec: str = SPEC) -> Iterator[Notebook]:
    """A widget of a run, or of a recording of so many steps."""
    network = nv.compile_text(spec)
    widget = network.live(None if steps is None else network.run(steps))
    try:
        yield Notebook(widget)
    finally:
        widget.close()


def until(true: Callable[[], bool]) -> None:
    for _ in range(1000):
        if true():
            return
        time.sleep(0.01)
    raise AssertionError("never")


def test_a_frame_is_sent_the_page_the_scene_and_frames_as_fast_as_it_draws() -> None:
    with notebook() as it:
        it.say("a", page=True)
        it.say("a", open=True)
        until(lambda: len(it.kinds("a")) == 3)
        time.sleep(0.2)
        assert it.kinds("a") == [SCENE, FRAME, FRAME]
        assert it.pages == ["a"]
        assert it.texts["a"][0]["type"] == "status"
        serial = int.from_bytes(it.binary["a"][-1][4:8], "little")
        it.say("a", serial.to_bytes(4, "little"))
        until(lambda: len(it.kinds("a")) > 3)


@pytest.mark.parametrize("steps", [None, 20])
def test_connections_with_synapses_and_delays_are_shown(steps: int | None) -> None:
    synapse = "synapses: {gate: {parameters: {E: 1}, state: {g: {derivative: pre - g}}, signal: weight*g*(E - post)}}\n"
    with notebook(steps, SPEC.replace("{weight: mix}", "{synapse: {gate: {E: 3*mix}}, delay: 2}") + synapse) as it:
        it.say("a", open=True)
        until(lambda: len(it.kinds("a")) >= 2)
        assert it.kinds("a")[:2] == [SCENE, FRAME]
        if steps is None:
            it.widget.mix = 0.25
            until(lambda: any("0.25" in json.dumps(one) for one in it.texts["a"]))


def test_it_stands_still_while_nobody_looks() -> None:
    with notebook() as it:
        assert not it.widget.playing
        it.say("a", open=True)
        until(lambda: it.widget.playing)
        it.say("b", open=True)
        it.say("a", open=False)
        until(lambda: "b" in it.binary)
        assert it.widget.playing
        it.say("b", open=False)
        until(lambda: not it.widget.playing)
        step = it.widget.step
        time.sleep(0.1)
        assert it.widget.step == step
        it.say("c", open=True)
        until(lambda: it.widget.step > step)


def test_parameters_are_traits_of_what_the_run_has() -> None:
    with notebook() as it:
        widget = it.widget
        seen: list[float] = []
        widget.observe(lambda change: seen.append(change["new"]), "mix")
        widget.mix = 0.25
        assert widget.mix == 0.25
        assert widget._session.shown.status.parameters["mix"] == 0.25
        it.say("a", open=True)
        it.say("a", text='{"type": "set", "values": {"mix": 0.75}}')
        until(lambda: bool(widget.mix == 0.75))
        assert seen == [0.25, 0.75]
        assert widget.traits()["mix"].help == "how much of A there is"
        widget.restart()
        assert widget.mix == 0.5
        traitlets.link((widget, "mix"), (widget, "layout_"))
        widget.layout_ = 0.125
        until(lambda: widget._session.shown.status.parameters == {"mix": 0.125, "layout": 0.125, "lambda": 0.2})
        assert widget.lambda_ == 0.2


@pytest.mark.parametrize(("value", "said"), [(2, "mix"), ("much", "a number"), (True, "a number"), (None, "a number")])
def test_what_a_parameter_cannot_be_is_refused_and_it_stays(value: object, said: str) -> None:
    with notebook() as it:
        with pytest.raises(traitlets.TraitError, match=said):
            it.widget.mix = value
        assert it.widget.mix == 0.5


def test_it_goes_where_it_is_told() -> None:
    with notebook() as it:
        widget = it.widget
        widget.go(30)
        until(lambda: bool(widget.step == 30))
        widget.go(10)
        assert (widget.step, widget.playing) == (10, False)
        widget.play()
        assert widget.playing
        widget.pause()
        assert not widget.playing
        with pytest.raises(traitlets.TraitError):
            widget.step = 3


def test_a_recording_is_played_and_cannot_be_turned() -> None:
    with notebook(steps=20) as it:
        it.widget.go(15)
        assert it.widget.step == 15
        with pytest.raises(ValueError, match="step 50 is not in the recording"):
            it.widget.go(50)
        assert "mix" not in it.widget.traits()


@pytest.mark.parametrize(
    "content",
    [
        *({}, {"view": "a"}, {"view": 3, "open": True}, {"view": "", "open": True}, {"view": "a" * 65, "open": True}),
        *({"view": "a", "text": 3}, {"view": "a", "open": 1}, {"view": "nobody", "open": False}, "what", None),
    ],
)
def test_a_message_that_no_frame_of_ours_sends_does_nothing(content: object) -> None:
    with notebook() as it:
        it.widget._take_message(it.widget, content, [])
        it.widget._take_message(it.widget, content, [b"1", b"2"])
        assert it.pages == []
        it.say("a", open=True)
        it.say("a", text="{")
        it.say("a", b"12345")
        until(lambda: sum(text["type"] == "refused" for text in it.texts.get("a", [])) == 2)


def test_of_too_many_frames_the_first_are_left() -> None:
    with notebook() as it:
        for number in range(MOST + 1):
            it.say(f"f{number}", open=True)
        until(lambda: f"f{MOST}" in it.binary)
        assert "f0" not in it.widget._session._frames
        assert len(it.widget._session._frames) == MOST


def test_a_frame_that_draws_nothing_counts_as_gone_until_it_says_something(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(session, "SILENCE", 0.1)
    with notebook() as it:
        it.say("a", open=True)
        until(lambda: it.kinds("a") == [SCENE, FRAME, FRAME])
        until(lambda: not it.widget.playing)
        step = it.widget.step
        serial = int.from_bytes(it.binary["a"][-1][4:8], "little")
        it.say("a", serial.to_bytes(4, "little"))
        until(lambda: it.kinds("a").count(SCENE) == 2 and it.widget.step > step)


def test_closing_ends_its_threads() -> None:
    before = set(threading.enumerate())
    with notebook() as it:
        it.say("a", open=True)
        until(lambda: it.widget.step > 2)
    assert set(threading.enumerate()) <= before
    with pytest.raises(ValueError, match="closed"):
        it.widget.play()
    it.widget.close()


def test_what_cannot_be_shown_is_refused_when_it_is_asked_for() -> None:
    network = nv.compile_text(SPEC)
    with pytest.raises(RecordingError, match="another network"):
        network.live(nv.compile_text(SPEC.replace("B", "C")).run(3))
    with pytest.raises(ValueError, match="'start'"):
        network.live(network.run(3), start=network.run(3))
    with pytest.raises(TypeError, match="recording"):
        network.live(3)  # type: ignore[arg-type]


WIDGET = "application/vnd.jupyter.widget-view+json"


def displayed(value: object) -> dict[str, object]:
    """What IPython shows of a value, by kind."""
    formatter = DisplayFormatter(active_types=["text/plain", "image/svg+xml"])
    found, _ = formatter.format(value)  # type: ignore[no-untyped-call]
    assert isinstance(found, dict)
    return found


def test_a_recording_shows_itself_with_play_and_scrubber_and_its_traces_beside() -> None:
    network = nv.compile_text(SPEC)
    recording = network.run(20)
    shown = displayed(recording)
    assert set(shown) == {WIDGET, "image/svg+xml", "text/plain"}
    assert shown["text/plain"] == "<recording of cell: 20 steps of 2 neurons, 0 changing weights>"
    assert displayed(recording)[WIDGET] == shown[WIDGET]
    assert isinstance(recording, PlayedRecording)
    widget = recording._widget
    assert widget is not None
    it = Notebook(widget)
    it.say("a", open=True)
    until(lambda: SCENE in it.kinds("a"))
    assert not widget.playing
    widget.close()


def test_a_view_stands_still_before_it_begins(monkeypatch: pytest.MonkeyPatch) -> None:
    begin, playing = Session.begin, list[bool]()

    def begun(session: Session) -> None:
        playing.append(session.shown.status.playing)
        begin(session)

    monkeypatch.setattr(Session, "begin", begun)
    with notebook():
        assert playing == [False]


def test_a_live_view_has_a_picture_for_those_who_read_the_notebook() -> None:
    with notebook() as it:
        shown = displayed(it.widget)
    assert set(shown) == {WIDGET, "image/svg+xml", "text/plain"}
    assert "live view of cell" in str(shown["text/plain"])


def test_what_cannot_be_played_shows_its_traces() -> None:
    network = nv.compile_text(SPEC)
    for recording in (network.run(20, neurons="A"), network.run(0)):
        assert set(displayed(recording)) == {"image/svg+xml", "text/plain"}


def test_a_recording_is_copied_and_pickled_without_its_network() -> None:
    recording = nv.compile_text(SPEC).run(20)
    for again in (pickle.loads(pickle.dumps(recording)), copy.copy(recording)):
        assert type(again) is Recording
        assert np.array_equal(again["B"], recording["B"])


def test_a_notebook_shows_findings_in_place_of_a_traceback() -> None:
    with pytest.raises(nv.SpecError) as found:
        nv.compile_text(SPEC.replace("tanh", "tanhh"))
    (told,) = found.value._render_traceback_()
    assert "did you mean 'tanh'?" in told
    assert "^^^^^" in told


def test_without_anywidget_it_says_what_to_install() -> None:
    code = (
        "import sys; sys.modules['anywidget'] = None\n"
        "import neurovis_spec as nv\n"
        "network = nv.compile('specs/hebbian.yaml')\n"
        "assert '<svg' in network._repr_svg_() and '<svg' in network.run(3)._repr_svg_()\n"
        "try: network.live()\n"
        "except ImportError as error: print(error)"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert "pip install 'neurovis-spec[jupyter]'" in done.stdout, done.stderr
