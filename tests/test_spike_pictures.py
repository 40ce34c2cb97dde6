"""Spikes in pictures: marks of rasters and traces, and what fades of signals that are spikes."""

from __future__ import annotations

import math

import numpy as np
import pytest

import neurovis_spec as nv
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.live.history import Bins, Members
from neurovis_spec.live.recorded import RecordedSource
from neurovis_spec.runtime.quantities import Quantities
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.runtime.simulation import Simulation
from neurovis_spec.scene import THEMES, Group, Image, Polyline, Scene, Text
from neurovis_spec.scene.fading import sent_seconds_of, snapshots_of
from neurovis_spec.scene.figure import PageGains, figure
from neurovis_spec.scene.look import Look
from neurovis_spec.scene.panels import panels_of
from neurovis_spec.scene.shots import Shots, shots_of, snapshots_of_run

#: K's activity is its spike, H's its potential, C is spiking without a state, G looks like spikes and is none
SPEC = """\
neurovis: 1
name: some
time: {dt: 1 ms, steps: 120}
models:
  kicked: {time: ms, state: {v: {derivative: (drive - v)/20}}, spike: {when: v >= 1, set: {v: 0}}}
  shown:
    {time: ms, state: {v: {derivative: (drive - v)/10}}, spike: {when: v >= 1, set: {v: 0}}, activity: v, send: spike}
  count: {activity: 1 if k % 30 == 7 else 0, spikes: true}
  graded: {state: {c: {each_step: k}}, activity: 1 if c % 30 == 9 else 0}
synapses:
  once: {signal: weight*spike}
  lasting: {time: ms, state: {g: {derivative: -g/5, on_pre: g + weight}}, signal: g}
neurons:
  K: {count: 2, model: kicked, bias: [1.3, 0]}
  H: {model: shown, bias: 1.5}
  C: {model: count}
  G: {model: graded}
  O: {activation: identity}
  P: {count: 2, activation: identity}
connections:
  H -> O: {weight: 0.5, delay: 4}
  K1 -> P1: {weight: -2, synapse: once, delay: 6}
  K1 -> P2: {weight: 1, synapse: lasting, delay: 2}
"""
NETWORK = nv.compile_text(SPEC)
RUN = NETWORK.run(backend="reference", states=["K.v", "H.spike"])
DEFAULT = THEMES["default"]
INK, GROUND = ([int(colour[k : k + 2], 16) for k in (1, 3, 5)] for colour in (DEFAULT.ink, DEFAULT.box_fill))


def scene(view: str, run: Recording = RUN, network: CompiledNetwork = NETWORK) -> Scene:
    """A view of all steps of a run."""
    look = Look(network.network.render, panels_of(network.network, view))
    shots = Shots(run, np.arange(len(run)), np.array([len(run) - 1]))
    gains = PageGains(network.gains, network.gains)
    return figure(network.network, network.drawn().value, look, shots, gains).scene


def cells(
    view: str, run: Recording = RUN, network: CompiledNetwork = NETWORK
) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    (image,) = (shape for shape in scene(view, run, network).shapes() if isinstance(shape, Image))
    return np.frombuffer(image.pixels, np.uint8).reshape(image.rows, image.columns, 3)


def marks(run: Recording = RUN, *names: str) -> dict[str, list[Polyline]]:
    """The marks above each curve."""
    traced: list[Group] = [group for group in scene(f"traces: {', '.join(names)}", run).groups if "trace" in group.data]
    found = {}
    for group in traced:
        lines = (shape for shape in group.shapes if isinstance(shape, Polyline) and len(shape.points) == 2)
        found[group.data["trace"]] = [line for line in lines if line.points[0][0] == line.points[1][0]]
    return found


def test_what_its_model_calls_spikes_is_marked_in_a_raster_whatever_its_activity_is() -> None:
    drawn = cells("raster: K, H, C, G")
    fired = np.stack([*RUN["K"].T, RUN["H.spike"], RUN["C"]]) == 1
    assert fired.any(axis=1).tolist() == [True, False, True, True]
    assert (drawn[:4][fired] == INK).all()
    assert (drawn[:4][~fired] == GROUND).all()  # also the whole row of K2, which is silent
    assert not (drawn[4] == INK).all(axis=1).any()  # G has single steps of 1, and does not say that these are spikes
    words = {shape.text for shape in scene("raster: K, H, C, G").shapes() if isinstance(shape, Text)}
    assert "spikes, activity" in words


def test_a_shown_state_does_not_hide_spikes() -> None:
    network = nv.compile_text(SPEC + "render: {show: {K: v}}\n")
    (image,) = (
        s for s in scene("raster: K", network.run(backend="reference"), network).shapes() if isinstance(s, Image)
    )
    drawn = np.frombuffer(image.pixels, np.uint8).reshape(image.rows, image.columns, 3)
    assert (drawn == INK).all(axis=2).sum() == RUN["K"].sum()


def test_a_raster_marks_spikes_between_the_rows_that_are_kept() -> None:
    few = NETWORK.run(backend="reference", every=20)
    drawn = cells("raster: K, H, C, G", few)
    first, last = -10, 110  # a step stands for those around it
    assert drawn.shape[1] == last - first
    found = [np.flatnonzero((row == INK).all(axis=1)) + first for row in drawn[:4]]
    for neuron, steps in zip((0, 1, 2, 3), found, strict=True):
        fired = RUN.spike_steps[RUN.spike_neurons == neuron]
        np.testing.assert_array_equal(steps, fired[fired < last])
    whole = cells("raster: G", few)
    np.testing.assert_array_equal(drawn[4][::20], whole[0])  # each of the few colours over its steps


def test_above_traces_of_states_there_are_marks_of_spikes_one_row_for_each_neuron() -> None:
    found = marks(RUN, "K1", "K1.v", "H", "H.spike", "C", "O")
    assert [len(found[name]) for name in ("K1", "H.spike", "C", "O")] == [0, 0, 0, 0]  # which show it, or do not spike
    assert len(found["K1.v"]) == RUN["K1"].sum()
    assert len(found["H"]) == RUN["H.spike"].sum()
    tops = [{line.points[0][1] for line in found[name]} for name in ("K1.v", "H")]
    assert len(tops[0]) == len(tops[1]) == 1
    assert tops[0] != tops[1]
    few = NETWORK.run(backend="reference", every=20)
    assert len(marks(few, "H")["H"]) == (RUN.spike_steps[RUN.spike_neurons == 2] < 110).sum()


def test_spikes_that_are_sent_beside_activities_fade_on_their_lines() -> None:
    """A state that is sent, and what a synapse forms of a spike; not a synapse's own state, which lasts by itself."""
    assert [seconds > 0 for seconds in sent_seconds_of(NETWORK.network).tolist()] == [True, True, False]
    usual = sent_seconds_of(NETWORK.network).max()
    run = NETWORK.run(backend="reference")
    left, faded = math.exp(-NETWORK.network.dt / usual), np.zeros(2)
    sent = np.stack([run["H.spike"], run["(K1 -> P1).signal"]], axis=1)
    assert (sent[:, 1] != 0).sum() == run["K1"][:-6].sum()
    made = snapshots_of_run(Simulation(NETWORK.network), Look(NETWORK.network.render, count=120, fps=1.0))
    stored = snapshots_of(NETWORK.network, run, range(120))
    for step, (one, other) in enumerate(zip(stored, made, strict=True)):
        faded = np.where(np.abs(sent[step]) >= np.abs(faded * left), sent[step], faded * left)
        for snapshot in (one, other):
            assert snapshot.sent is not None
            assert snapshot.sent[:2] == pytest.approx(faded, abs=1e-12)
            assert snapshot.sent[2] == run["(K1 -> P2).signal"][step]
    (alone,) = shots_of(NETWORK.network, run, Look(NETWORK.network.render, first=119)).snapshots(NETWORK.network)
    assert alone.sent is not None
    assert alone.sent[:2] == pytest.approx(faded, abs=2e-5)


def test_the_legend_tells_that_spikes_fade_where_no_activity_does() -> None:
    quiet = SPEC.replace("model: kicked, bias", "model: shown, bias").replace("C: {model: count}", "C: {}")
    for text, words in ((SPEC, "activity fades"), (quiet, "spikes fade")):
        network = nv.compile_text(text)
        shown = {
            one.text
            for one in scene("network", network.run(backend="reference"), network).shapes()
            if isinstance(one, Text)
        }
        assert words in shown


def test_times_of_traces_are_told_in_the_unit_of_dt() -> None:
    """In the legend and in tooltips, as axes and captions do; in seconds where ``dt`` is written so."""
    quiet = SPEC.replace("model: kicked, bias", "model: shown, bias").replace("C: {model: count}", "C: {}")
    for text, head in ((SPEC, "fades to 1/e in"), (quiet, "")):
        for dt, told in (("1 ms", "12 ms"), ("0.001", "0.012 s"), ("1000 us", "12000 us")):
            network = nv.compile_text(text.replace("dt: 1 ms", f"dt: {dt}"))
            groups = tuple(shape for shape in scene("network", network.run(backend="reference"), network).groups)
            legend = {one.text for group in groups for one in group.shapes if isinstance(one, Text)}
            assert f"to 1/e in {told}" in legend
            titles = [group.title for group in groups if group.title is not None]
            assert any(f"{head} {told}" in title for title in titles) == bool(head)


def test_the_live_page_has_the_spikes_of_a_recording_without_their_state() -> None:
    """As events, also between its rows; of what is recorded as a state, the same."""
    names = Quantities(NETWORK.network).names
    place = names.index("K1.spike")
    for options in ({}, {"states": ["K.spike"]}):
        source = RecordedSource(NETWORK.network, NETWORK.run(backend="reference", **options))  # type: ignore[arg-type]
        seen = source.history.read(Members("quantities", np.array([place])), Bins(0, 1, 120))
        np.testing.assert_array_equal(seen[:, 1], RUN["K1"])
        source.go(int(RUN.spike_steps[RUN.spike_neurons == 0][0]))
        assert source.quantities is not None
        assert source.quantities[place] == 1
    few = RecordedSource(NETWORK.network, NETWORK.run(backend="reference", every=20))
    seen = few.history.read(Members("quantities", np.array([place])), Bins(0, 20, 6))
    np.testing.assert_array_equal(seen[:, 1], RUN["K1"].reshape(6, 20).max(axis=1))
    unknown = few.history.read(Members("quantities", np.array([names.index("K1.v")])), Bins(0, 20, 6))
    assert np.isnan(unknown).all()
