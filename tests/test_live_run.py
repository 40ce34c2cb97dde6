"""The run of a live view: its clock, its commands, and that what it shows is the picture of the step."""

from __future__ import annotations

import gzip
import math
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest

import neurovis_spec as nv
from neurovis_spec.live.clock import FRAMES, Clock, Pace
from neurovis_spec.live.commands import (
    Appearance,
    Branch,
    Command,
    Draw,
    Event,
    Loop,
    Pause,
    Play,
    Restart,
    Seek,
    Speed,
    Step,
    Unloop,
)
from neurovis_spec.live.recorded import RecordedSource
from neurovis_spec.live.run import Run, Shown
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.live.source import Reach, Source
from neurovis_spec.live.turns import Lesion, Set
from neurovis_spec.live.undefined import Undefined, undefined_in
from neurovis_spec.live.view import BAR, FAINT, FINENESS, LEVELS, UNDEFINED, View, view_of
from neurovis_spec.scene.encode import looks

SPEC = """neurovis: 1
name: live
time: {dt: 0.05, steps: 40}
parameters: {pull: {value: 0.1, min: 0, max: 1}}
neurons:
  A: {count: 3, activation: tanh, bias: 0.4}
  B: {activation: tanh}
connections:
  A -> B: {weight: -0.5, plasticity: {hebbian: {rate: 0.05}}}
  B -> A: pull
events:
  - {at: 30, lesion: [A2]}
  - {at: 55, set: {pull: 0.2}}
render: {gain: {activity: 1, signal: 1, thickness: 4, change: 10}}
"""
COMPILED = nv.compile_text(SPEC)
VIEW = view_of(COMPILED, COMPILED.gains)


class Driven:
    """A run that stands still at first; all that it shows is kept."""

    def __init__(self, source: Source, view: View = VIEW) -> None:
        self.shown: list[Shown] = []
        self.refused: list[str] = []
        self.run = Run(source, view, self.shown.append)
        self.run.ask(Pause())
        self.run.start()

    def ask(self, *commands: Command) -> Shown:
        """What is shown when all commands have been carried out, and it stands still."""
        for command in commands:
            self.run.ask(command, self.refused.append)
        return self.until(lambda shown: not shown.status.playing)

    def until(self, true: Callable[[Shown], bool]) -> Shown:
        """What is shown when something is true of it, after all that was asked."""
        seen: list[str] = []
        self.run.ask(Set({"none": 0.0}), seen.append)  # refused, when its turn comes, and after what is then to be seen
        for _ in range(2000):
            if seen and true(self.shown[-1]):
                return self.shown[-1]
            time.sleep(0.005)
        raise AssertionError(f"never: step {self.shown[-1].glance.step}, {self.run.failure}")


@pytest.fixture
def driven() -> Iterator[Driven]:
    made = Driven(SimulatedSource(COMPILED.simulator()))
    yield made
    made.run.end()
    assert made.run.failure is None


def test_frames_that_are_begun_late_are_no_fewer() -> None:
    pace, now, frames = Pace(), 100.0, 0
    pace.begin(now)
    while now < 110.0:
        now = max(now + 0.005, pace.due) + 0.002 * (frames % 3)
        pace.begin(now)
        frames += 1
    assert 10 * FRAMES - 2 <= frames <= 10 * FRAMES + 2
    # after a while in which there were none, they are not made up for
    pace.begin(now + 60.0)
    assert pace.due == now + 60.0
    pace.begin(now + 60.0)
    assert pace.due > now + 60.0


def test_the_clock_counts_steps_in_real_time_and_at_other_speeds() -> None:
    clock = Clock.of(0.05, True)
    clock.start(10.0)
    assert clock.next() == pytest.approx(10.05)
    assert clock.due(10.04) == 0
    assert clock.due(10.05) == 1
    clock.make(1)
    assert clock.due(10.16) == 2
    clock.make(2)
    clock.set_speed(16.0, 10.16)
    assert clock.due(10.26) == 32
    clock.set_speed(math.inf, 10.26)
    assert clock.due(10.26) == math.inf
    assert clock.next() == 10.26


def test_without_a_dt_it_is_a_step_a_frame() -> None:
    clock = Clock.of(1.0, False)
    clock.start(0.0)
    assert clock.due(1 / 60) == 1
    assert clock.due(0.2) == 12


def test_what_is_late_is_not_caught_up() -> None:
    clock = Clock.of(0.05, True)
    clock.start(0.0)
    assert clock.due(60.0) == 1
    clock.make(1)
    assert clock.next() == pytest.approx(60.05)


def test_it_is_stepped_sought_and_begun_anew(driven: Driven) -> None:
    assert driven.ask().glance.step == 0
    assert driven.ask(Step(1), Step(1)).glance.step == 2
    assert driven.ask(Step(-1)).glance.step == 1
    assert driven.ask(Seek(100)).reach == Reach(0, 100)
    assert driven.ask(Seek(7)).glance.step == 7
    assert driven.ask(Branch()).reach == Reach(0, 7)
    assert driven.ask(Step(-20)).glance.step == 0
    assert driven.ask(Event(1)).glance.step == 30
    assert driven.ask(Event(1)).glance.step == 55
    assert driven.ask(Event(-1)).glance.step == 30
    assert driven.ask(Event(-1)).glance.step == 30
    assert driven.refused == ["there is no event before step 30"]
    assert driven.ask(Restart()).reach == Reach(0, 0)


def test_it_plays_past_the_steps_of_the_spec_and_stands_still(driven: Driven) -> None:
    for command in (Speed(math.inf), Seek(41), Play()):
        driven.run.ask(command)
    assert driven.until(lambda shown: shown.glance.step > 200).status.playing
    step = driven.ask(Pause()).glance.step
    assert driven.ask().glance.step == step > 200


def test_a_turn_is_listed_and_one_that_cannot_be_is_told(driven: Driven) -> None:
    shown = driven.ask(Seek(5), Set({"pull": 0.9}), Lesion("B"), Set({"pull": 9.0}))
    assert [entry.turn for entry in shown.status.turned] == [Set({"pull": 0.9}), Lesion("B")]
    assert shown.status.parameters == {"pull": 0.9}
    assert "pull" in driven.refused[0]
    assert shown.glance.kinds[-1] == FAINT


def test_a_recording_ends() -> None:
    made = Driven(RecordedSource(COMPILED.network, COMPILED.run(steps=50)))
    made.run.ask(Speed(math.inf))
    made.run.ask(Play())
    shown = made.until(lambda shown: shown.status.ended)
    assert shown.glance.step == 49
    assert not shown.status.playing
    assert made.ask(Step(-9)).glance.step == 40
    assert not made.ask(Set({"pull": 0.1})).status.capabilities.takes
    assert made.refused == ["a recording cannot be changed: run the spec"]
    made.run.end()


def test_a_recording_that_has_ended_plays_from_its_beginning() -> None:
    made = Driven(RecordedSource(COMPILED.network, COMPILED.run(steps=50)))
    shown = made.ask(Seek(49))
    assert (shown.status.ended, shown.status.playing) == (True, False)
    made.run.ask(Play())
    shown = made.until(lambda shown: shown.status.playing)
    assert not shown.status.ended
    assert shown.glance.step < 49
    made.run.end()


@pytest.mark.parametrize("recorded", [False, True])
def test_steps_that_are_known_are_played_over_and_over(recorded: bool) -> None:
    """Nothing is added to them; what was turned in them is turned again."""
    of = RecordedSource(COMPILED.network, COMPILED.run(steps=61)) if recorded else SimulatedSource(COMPILED.simulator())
    made = Driven(of)
    made.ask(Seek(60))
    assert made.ask(Loop(20, 99)).status.loop is None
    assert made.refused == ["steps 20 to 99 cannot be played again"]
    assert made.ask(Loop(20, 30)).status.loop == (20, 30)
    begun = len(made.shown)
    made.run.ask(Speed(4.0))
    made.run.ask(Play())
    made.until(lambda shown: [one.glance.step for one in made.shown[begun:]].count(20) > 1)
    made.ask(Pause())
    steps = [one.glance.step for one in made.shown[begun:]]
    assert set(steps[steps.index(20) :]) <= set(range(20, 31))
    assert made.shown[-1].reach.last == 60
    made.run.ask(Speed(math.inf))
    made.run.ask(Play())
    made.run.ask(Unloop())
    made.until(lambda shown: shown.glance.step >= 50)
    made.ask(Pause())
    if not recorded:
        made.ask(Seek(25), Loop(20, 30), Restart())
        assert made.shown[-1].status.loop is None
    made.run.end()
    assert made.run.failure is None


def test_nothing_is_shown_to_nobody() -> None:
    shown: list[Shown] = []
    run = Run(SimulatedSource(COMPILED.simulator()), VIEW, shown.append, lambda: False)
    run.start()
    run.ask(Step(3))
    run.end()
    assert shown == []


def test_a_look_is_the_picture_of_its_step(driven: Driven) -> None:
    recording = COMPILED.run(steps=70)
    for step in (0, 1, 29, 30, 69):
        look = driven.ask(Seek(step)).glance
        wanted = looks(COMPILED.network, recording.snapshot(step), COMPILED.gains, VIEW.plan.frame.widest)
        assert np.abs(look.discs / LEVELS - wanted.discs).max() <= 0.5 / LEVELS
        assert np.abs(look.lines / LEVELS - wanted.lines).max() <= 0.5 / LEVELS
        assert np.abs(look.widths / FINENESS - wanted.widths).max() <= 0.5 / FINENESS
        assert np.abs(look.glows / FINENESS - wanted.glows).max() <= 0.5 / FINENESS
        assert (look.kinds[: len(wanted.ends)] & BAR > 0).tolist() == (wanted.ends < 0).tolist()
        faint = (look.kinds & FAINT > 0).tolist()
        gone = step >= 30
        assert faint == [False, gone, False, False, gone, False, False, gone, False, False]
        assert look.caption == f"step {step} · {step * 0.05:.2f} s"


def test_it_is_drawn_otherwise_beside_the_run_which_goes_on(driven: Driven) -> None:
    before = driven.ask(Step(5))
    wanted = Appearance(activity=0.5, thickness=2.0)
    driven.run.ask(Draw(Appearance(change=3.0)))
    driven.run.ask(Draw(wanted))
    assert driven.ask().status.appearance == wanted, "it is what is wanted as soon as it is asked for"
    after = driven.until(lambda shown: shown.view.appearance == wanted)
    assert after.glance.step == before.glance.step
    assert np.abs(after.glance.discs[0] - before.glance.discs[0] / 2) <= 1
    widths = before.glance.widths > FINENESS
    assert widths.any()
    assert np.abs(after.glance.widths[widths] - 2.0 * before.glance.widths[widths]).max() <= 2
    words = gzip.decompress(after.view.content).decode()
    assert after.view.gains.activity_scales[0].gain == 0.5
    assert '"2"' in words, "the legend says how far a colour goes"
    driven.run.change(lambda source: (source, VIEW))
    again = driven.until(lambda shown: shown.view.appearance == wanted and shown.view is not after.view)
    assert again.status.appearance == wanted
    driven.run.ask(Draw(Appearance()))
    plain = driven.until(lambda shown: shown.view.appearance == Appearance())
    assert plain.view.content == VIEW.content
    assert np.array_equal(plain.glance.discs, before.glance.discs)


def test_a_picture_that_cannot_be_drawn_is_refused_and_the_next_one_is_drawn() -> None:
    def otherwise(appearance: Appearance) -> View:
        if appearance.pathways:
            raise ValueError("an engine has failed")
        return VIEW.otherwise(appearance)

    driven = Driven(SimulatedSource(COMPILED.simulator()), replace(VIEW, otherwise=otherwise))
    try:
        driven.run.ask(Draw(Appearance(pathways=True)), driven.refused.append)
        shown = driven.until(lambda shown: shown.status.appearance == Appearance())
        assert driven.refused == ["the picture cannot be drawn so: an engine has failed"]
        assert shown.view.appearance == Appearance(), "what is shown stays"
        driven.run.ask(Draw(Appearance(pathways=True)), driven.refused.append)
        driven.run.ask(Draw(Appearance(change=2.0)), driven.refused.append)
        driven.until(lambda shown: shown.view.appearance == Appearance(change=2.0))
        assert len(driven.refused) == 1, "by then it is not wanted any more"
    finally:
        driven.run.end()
    assert driven.run.failure is None


def test_neurons_without_a_finite_activity_are_marked() -> None:
    spec = "neurovis: 1\nname: x\nneurons: {A: {initial: 1e300}, B: {}}\nconnections: {A -> A: 1e300, A -> B: 0}\n"
    compiled = nv.compile_text(spec)
    source, view = SimulatedSource(compiled.simulator()), view_of(compiled, compiled.gains)
    marked = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for _ in range(4):
            marked.append((view.glance(source.seen()).kinds[-2:] & UNDEFINED > 0).tolist())
            source.advance()
    assert marked == [[False, False], [True, False], [True, True], [True, True]]
    told, before = [], None
    for step in (0, 1, 2, 3, 1, 0, 3):
        source.go(step)
        before = undefined_in(view, view.glance(source.seen()), source, before)
        told.append(before)
        assert before == undefined_in(view, view.glance(source.seen()), source, None)
    one, both = Undefined("n0", 1, True, 1), Undefined("n0", 1, True, 2)
    assert told == [None, one, both, both, one, None, both]
