"""Futures of a live run: what is changed in the past leaves another future, which can be gone to, bit for bit."""

from __future__ import annotations

import json
from collections.abc import Sequence
from threading import Event

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import neurovis_spec as nv
from neurovis_spec.arrays import FloatArray
from neurovis_spec.live import futures as kept
from neurovis_spec.live.carry import carried
from neurovis_spec.live.commands import Compare, Pause, Step, Switch
from neurovis_spec.live.futures import Future
from neurovis_spec.live.history import Bins, Members, Ring
from neurovis_spec.live.protocol import ProtocolError, command_of, status_message
from neurovis_spec.live.run import Run
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.live.source import Reach, Seen, SourceError
from neurovis_spec.live.turns import Hold, Learn, Lesion, Mend, Set, Turn, Weigh
from neurovis_spec.live.view import view_of

TEXT = """neurovis: 1
name: x
parameters: {pull: {value: 0.1, min: 0, max: 1}}
neurons:
  A: {count: 3, activation: tanh, bias: 0.4}
  B: {activation: tanh, noise: "normal(0, 0.1)"}
connections:
  A -> B: {weight: -0.5, plasticity: {hebbian: {rate: 0.05}}}
  B -> A: pull
"""
COMPILED = nv.compile_text(TEXT)


def at(step: int) -> SimulatedSource:
    source = SimulatedSource(COMPILED.simulator())
    while source.step < step:
        source.advance()
    return source


def known(source: SimulatedSource, steps: int = 400) -> FloatArray:
    """All activities that its history knows."""
    return np.stack([source.history.read(Members("neurons", np.array([i])), Bins(0, 1, steps))[:, 0] for i in range(4)])


def everything(source: SimulatedSource) -> list[object]:
    """What can be seen of a run at each of its steps, and what was turned."""
    here, found = source.step, list[object]()
    for step in range(source.reach.first, source.reach.last + 1):
        source.go(step)
        seen = source.seen()
        found.append((seen.snapshot.activity.tolist(), seen.snapshot.weights.tolist(), seen.lesioned_neurons.tolist()))
    found.append((source.turned, known(source).tolist().__repr__()))
    source.go(here)
    return found


def shapes(futures: Sequence[Future]) -> Sequence[object]:
    """Where futures are, but for their numbers."""
    return sorted([one.at, one.last, len(one.turned), repr(shapes(one.within))] for one in futures)


def numbers_in(futures: Sequence[Future]) -> list[int]:
    return [number for one in futures for number in (one.number, *numbers_in(one.within))]


def test_what_is_taken_back_later_is_the_opposite_from_there_on_and_earlier_has_not_been() -> None:
    source = at(30)
    source.turn(Lesion("A1"))
    source.advance()
    first = source.turned[0].number
    source.take_back(first)
    assert [(entry.step, entry.turn) for entry in source.turned] == [(30, Lesion("A1")), (31, Mend("A1"))]
    source.turn(Set({"pull": 0.4}))
    second = source.turned[-1].number
    for _ in range(5):
        source.advance()
    source.go(20)
    source.take_back(second)
    assert (source.step, [(one.at, one.last) for one in source.futures.all]) == (31, [(31, 36)])
    source.go(10)
    source.take_back(first)
    assert (source.step, source.turned, source.reach.last) == (30, (), 30)
    with pytest.raises(SourceError, match="no part of this branch"):
        source.take_back(first)


def test_what_was_is_kept_when_something_is_turned_in_the_past_and_can_be_gone_to() -> None:
    source = at(200)
    before = everything(source)
    source.go(80)
    source.turn(Lesion("A1"))
    (left,) = source.futures.all
    assert (left.number, left.at, left.last) == (0, 80, 200)
    old = left.history.read(Members("neurons", np.array([3])), Bins(0, 1, 201))[:, 0]
    assert np.isnan(old[:81]).all()
    assert np.array_equal(old[81:], known(at(200), 201)[3, 81:])
    while source.step < 150:
        source.advance()
    other = everything(source)
    assert other[:80] == before[:80]
    assert other[100] != before[100]
    source.switch(0)
    assert source.step == 150
    assert everything(source) == before
    (left,) = source.futures.all
    assert (left.number, left.at, left.last) == (1, 80, 150)
    source.switch(1)
    assert everything(source) == other
    while source.advance() and source.step < 260:
        pass
    assert source.futures.all[0].last == 200


def test_a_run_is_gone_back_to_at_the_step_where_it_was() -> None:
    source = at(60)
    source.go(30)
    source.turn(Lesion("A1"))
    for _ in range(5):
        source.advance()
    source.switch(0)
    source.go(58)
    source.switch(1)
    assert source.step == 35, "where the branch ends"
    source.switch(0, 58)
    assert source.step == 58
    source.switch(1, 9)
    assert source.step == 9
    source.switch(0, 99)
    assert source.step == 60


def test_branches_of_branches_are_gone_to_through_these() -> None:
    source = at(120)
    first = everything(source)
    source.go(40)
    source.turn(Set({"pull": 0.9}))
    while source.step < 110:
        source.advance()
    second = everything(source)
    source.go(90)
    source.turn(Lesion("A2"))
    while source.step < 100:
        source.advance()
    third = everything(source)
    assert [(one.number, one.at) for one in source.futures.all] == [(0, 40), (1, 90)]
    source.switch(0)
    assert everything(source) == first
    (outer,) = source.futures.all
    assert (outer.number, outer.at, [(one.number, one.at) for one in outer.within]) == (2, 40, [(1, 90)])
    source.switch(1)
    assert everything(source) == second
    assert {one.at: one.number for one in source.futures.all} == {40: 0, 90: 2}, "each keeps its number"
    source.switch(2)
    assert everything(source) == third


def test_beginning_anew_keeps_what_was() -> None:
    source = at(70)
    source.turn(Lesion("A1"))
    while source.step < 90:
        source.advance()
    before = everything(source)
    source.restart()
    assert source.step == 0
    assert [(one.at, one.last) for one in source.futures.all] == [(-1, 90)]
    source.advance()
    source.switch(0)
    assert source.step == 1
    assert everything(source) == before
    assert source.futures.all[0].at == -1


def test_nothing_is_kept_where_nothing_came_after_and_none_is_gone_to_that_there_is_not() -> None:
    source = at(30)
    source.turn(Lesion("A1"))
    source.branch()
    assert not len(source.futures.all)
    with pytest.raises(SourceError, match="no longer kept"):
        source.switch(0)
    source.go(10)
    source.branch()
    assert [one.at for one in source.futures.all] == [10]
    with pytest.raises(SourceError, match="no longer kept"):
        source.switch(7)


@given(
    st.lists(
        st.tuples(st.sampled_from(["go", "turn", "undo", "on", "switch", "restart", "branch"]), st.integers(0, 60)),
        max_size=14,
    ),
    st.sampled_from([Hold("A2", 0.3), Lesion("A1"), Weigh("A1 -> B", 0.2), Learn("A -> B", False), Set({"pull": 0.7})]),
)
@example([("go", 0), ("branch", 0)], Hold("A2", 0.3))
@settings(max_examples=40, deadline=None)
def test_every_future_is_as_it_was_left_and_what_is_undone_leaves_none(acts: list[tuple[str, int]], what: Turn) -> None:
    source, left = at(40), dict[int, list[object]]()
    for act, number in acts:
        made, line, now = source.futures.made, source.futures.now, None
        if act in ("turn", "undo", "branch", "restart", "switch"):
            now = everything(source)
        if act == "go":
            source.go(min(number, source.reach.last))
        elif act == "turn":
            source.turn(Weigh("A1 -> B", number / 60) if number % 3 == 0 else Set({"pull": number / 60}))
        elif act == "undo":
            if source.turned:
                source.take_back(source.turned[number % len(source.turned)].number)
        elif act == "on":
            for _ in range(number // 3):
                source.advance()
        elif act == "branch":
            source.branch()
        elif act == "restart":
            source.restart()
        elif source.futures.all:
            chosen = source.futures.all[number % len(source.futures.all)].number
            twin = source.twin(chosen)
            for step in (twin.reach.last, twin.reach.last // 3):
                assert seen_at(twin, step) == left[chosen][step], "it goes there beside the run"
            assert everything(source) == now, "of which nothing changes"
            source.switch(chosen)
            assert everything(source) == left[chosen]
        if now is not None and source.futures.made > made:
            left[line] = now
    numbers = [source.futures.now, *numbers_in(source.futures.all)]
    assert len(set(numbers)) == len(numbers), "each is asked for by its own"
    assert set(numbers[1:]) <= set(left)
    if any(type(entry.turn) is type(what) and entry.step == source.step for entry in source.turned):
        return  # of two values at one step the last is the turn
    before = everything(source), shapes(source.futures.all)
    source.turn(what)
    source.take_back(max(entry.number for entry in source.turned))
    assert (everything(source), shapes(source.futures.all)) == before


def seen_at(source: SimulatedSource, step: int) -> object:
    source.go(step)
    snapshot = source.seen().snapshot
    return snapshot.activity.tolist(), snapshot.weights.tolist(), source.seen().lesioned_neurons.tolist()


@pytest.mark.parametrize("edited", [False, True])
def test_a_future_that_begins_later_than_the_run_stays_so(edited: bool) -> None:
    """As the oldest states are gone, or as the spec was edited: what is before them is out of reach."""
    if edited:
        source, end = carried(at(100), COMPILED.simulator()), 300
    else:
        source, end = SimulatedSource(COMPILED.simulator(), room=30_000), 1000
        while source.step < 40:
            source.advance()
    source.turn(Lesion("A1"))
    while source.step < end:
        source.advance()
    first = source.reach.first
    assert first > 64
    steps = (first, (first + end) // 2, end)
    was = [seen_at(source, step) for step in steps]
    source.restart()
    twin = source.twin(source.futures.all[-1].number)
    assert twin.reach == Reach(first, end)
    assert [seen_at(twin, step) for step in steps] == was
    source.switch(source.futures.all[-1].number)
    assert source.reach == Reach(first, end)
    assert [seen_at(source, step) for step in steps] == was
    with pytest.raises(SourceError, match="out of reach"):
        source.go(first - 1)


def test_they_are_bounded_and_the_oldest_go_first(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kept, "MOST", 3)
    source = at(20)
    for number in range(5):
        source.go(10)
        source.turn(Set({"pull": 0.1 * (number + 1)}))
        while source.step < 20:
            source.advance()
    assert [one.number for one in source.futures.all] == [2, 3, 4]
    assert source.futures.dropped == 2
    small = source.futures.bounded(source.futures.all[-1].size)
    assert [one.number for one in small.all] == [4]


def test_they_are_bounded_where_a_larger_one_is_left_to_go_to_another(monkeypatch: pytest.MonkeyPatch) -> None:
    source = at(400)
    source.go(10)
    source.turn(Set({"pull": 0.3}))
    (large,) = source.futures.all
    source.switch(large.number)
    (small,) = source.futures.all
    assert (source.reach.last, source.futures.dropped) == (400, 0)
    monkeypatch.setattr(kept, "ROOM", large.size - 1)
    source.switch(small.number)
    assert (source.reach.last, source.futures.all, source.futures.dropped) == (10, (), 1)
    with pytest.raises(SourceError, match="no longer kept"):
        source.switch(large.number)
    run = Run(source, view_of(COMPILED, COMPILED.gains), lambda shown: None, lambda: False)
    assert json.loads(status_message(run.shown().status, True))["dropped"] == 1, "which a page tells"


def test_what_has_no_room_by_itself_goes_before_others(monkeypatch: pytest.MonkeyPatch) -> None:
    source = at(400)
    for step in (10, 15, 17):
        source.go(step)
        source.turn(Set({"pull": 0.01 * step}))
        while source.step < 20:
            source.advance()
    large = max(source.futures.all, key=lambda one: one.size)
    source.switch(large.number)
    (small,) = source.futures.all
    assert len(small.within) == 2
    monkeypatch.setattr(kept, "ROOM", large.size - 1)
    source.switch(small.number)
    assert [one.number for one in source.futures.all] == [one.number for one in small.within], (
        "though the large one was left last"
    )
    assert source.futures.dropped == 1


def test_they_stand_in_the_order_in_which_they_were_left() -> None:
    """Also those that branch off from one that is gone to, and one that was deleted and is there again."""
    source = at(30)
    for step in (20, 15, 10, 18):
        source.go(step)
        source.turn(Set({"pull": 0.01 * step}))
        while source.step < 25:
            source.advance()
    for number in [one.number for one in source.futures.all]:
        source.switch(number)
        places = [one.place for one in source.futures.all]
        assert places == sorted(places)
        assert source.futures.left is source.futures.all[-1]
    first = source.futures.all[0].number
    again = source.futures.forgotten(first).restored()
    assert again is not None
    assert [one.number for one in again.all] == [one.number for one in source.futures.all]


def test_futures_are_named_deleted_with_those_within_and_had_again() -> None:
    source = at(30)
    source.go(10)
    source.turn(Lesion("A1"))
    source.advance()
    source.go(5)
    source.turn(Set({"pull": 0.3}))
    source.advance()
    source.futures = source.futures.renamed(0, "first").renamed(1, "second")
    before = shapes(source.futures.all)
    less = source.futures.forgotten(0)
    assert [(one.name, len(one.within)) for one in less.all] == [("second", 0)]
    again = less.restored()
    assert again is not None
    assert (shapes(again.all), again.path(0)[-1].name) == (before, "first")
    assert again.restored() is None
    gone = source.futures.forgotten(1)
    assert gone.all == ()
    source.futures = gone
    source.branch()
    assert source.futures.restored() is not None, "as there is no other branch since"
    source.go(3)
    source.branch()
    assert source.futures.restored() is None


@pytest.mark.parametrize("turned", [True, False])
def test_what_is_left_where_it_begins_can_be_gone_back_to_and_taken_back(turned: bool) -> None:
    source = at(60)
    first = everything(source)
    source.go(30)
    source.turn(Set({"pull": 0.4})) if turned else source.branch()
    second = everything(source)
    source.switch(0)
    assert (source.step, everything(source)) == (30, first)
    assert [(one.number, one.at, one.last, len(one.turned)) for one in source.futures.all] == [(1, 30, 30, turned)]
    assert source.twin(1).reach == Reach(0, 30)
    source.go(50)
    source.switch(1)
    assert (source.step, source.reach.last, source.parameters["pull"]) == (30, 30, 0.4 if turned else 0.1)
    assert everything(source) == second, "and of what came after in the other nothing is left"
    assert [(one.number, one.at, one.last) for one in source.futures.all] == [(0, 30, 60)]
    if turned:
        source.take_back(source.turned[-1].number)
        assert (source.futures.now, source.futures.all, everything(source)) == (0, (), first)
    else:
        for _ in range(30):
            source.advance()
        assert everything(source) == first, "nothing was changed"


def test_what_is_turned_in_a_branch_of_no_steps_and_taken_back_leads_into_no_other() -> None:
    source = at(40)
    source.go(20)
    source.branch()
    source.switch(0)
    source.turn(Lesion("A1"))
    source.switch(1)
    source.turn(Set({"pull": 0.3}))
    source.take_back(source.turned[-1].number)
    assert (source.futures.now, source.reach.last, source.turned) == (1, 20, ())


def test_a_name_goes_with_its_branch() -> None:
    source = at(30)
    source.go(10)
    source.turn(Lesion("A1"))
    source.advance()
    source.futures = source.futures.renamed(0, "first")
    source.switch(0)
    assert (source.name, [one.name for one in source.futures.all]) == ("first", [""])
    source.go(4)
    source.turn(Lesion("A2"))
    assert (source.name, [one.name for one in source.futures.all]) == ("", ["first"])
    source.restart()
    source.switch(source.futures.path(source.futures.all[-1].within[-1].number)[-1].number)
    assert source.name == "first"

    source = at(50)
    source.go(30)
    source.turn(Lesion("A1"))
    source.name = "last"
    source.advance()
    source.go(30)
    source.take_back(0)
    assert (source.name, [one.name for one in source.futures.all]) == ("", ["last"]), "and is not there twice"


def test_what_fails_in_another_branch_is_told_once_and_the_run_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    source, told, shown = at(40), list[str](), list[int | None]()
    source.go(10)
    source.turn(Lesion("A1"))
    run = Run(
        source,
        view_of(COMPILED, COMPILED.gains),
        lambda one: shown.append(one.status.compared),
        tell=told.append,
        playing=False,
    )
    done = [Event() for _ in range(3)]
    run.start()
    run.ask(Compare(0), done=done[0].set)
    assert done[0].wait(30)
    assert shown[-1] == 0

    def fails(_: SimulatedSource) -> Seen:
        raise RuntimeError("a body has failed")

    with monkeypatch.context() as broken:
        broken.setattr(SimulatedSource, "seen", fails)
        run.ask(Pause(), done=done[1].set)
        assert done[1].wait(30)
    run.ask(Step(1), done=done[2].set)
    assert done[2].wait(30)
    run.end()
    assert source.step == 11
    assert shown[-1] is None
    assert "a body has failed" in told[0]


def test_any_future_can_be_read_from_where_it_branched_off() -> None:
    source = at(40)
    whole = known(source, 41)
    source.go(20)
    source.turn(Lesion("A1"))
    while source.step < 30:
        source.advance()
    second = known(source, 31)
    source.go(10)
    source.turn(Set({"pull": 0.5}))
    inner = source.futures.history(0)
    outer = source.futures.history(1)
    assert inner is not None
    assert outer is not None
    one = Members("neurons", np.array([3]))
    read = [history.read(one, Bins(0, 1, 41))[:, 0] for history in (inner, outer)]
    assert np.array_equal(read[0][11:], whole[3, 11:])
    assert np.isnan(read[0][:11]).all()
    assert np.array_equal(read[1][11:31], second[3, 11:])
    assert np.isnan(read[1][31:]).all()
    assert source.futures.history(7) is None


def test_what_was_before_an_edit_is_a_branch_that_goes_on_only_in_the_same_network() -> None:
    source = at(70)
    source.turn(Lesion("A1"))
    source.advance()
    before = everything(source)
    same = carried(source, COMPILED.simulator())
    (left,) = same.futures.all
    assert (left.at, left.last, left.older) == (-1, 71, False)
    same.advance()
    same.switch(left.number)
    assert everything(same) == before
    edited = nv.compile_text(TEXT.replace("count: 3", "count: 2").replace("0.4}", "0.5}"))
    other = carried(same, edited.simulator())
    assert [(one.last, one.older) for one in other.futures.all] == [(72, True), (71, True)]
    history = other.futures.history(other.futures.all[-1].number)
    assert history is not None
    index = edited.network.neurons.names.index("B")
    read = history.read(Members("neurons", np.array([index])), Bins(0, 1, 72))[:, 0]
    assert np.array_equal(read, known(same, 72)[3])
    with pytest.raises(SourceError, match="of an older spec"):
        other.switch(other.futures.all[0].number)
    later = carried(other, COMPILED.simulator())
    assert [(one.last, one.older) for one in later.futures.all] == [(72, True), (71, True), (71, True)]
    missing = later.futures.history(later.futures.all[-1].number)
    assert missing is not None
    assert np.isnan(missing.read(Members("neurons", np.array([2])), Bins(0, 1, 9))).all(), "there was no A3"


def test_a_ring_goes_on_with_steps_of_another() -> None:
    ring, other = Ring(1, 0), Ring(1, 0)
    for step in range(50):
        ring.note(step, np.array([1.0]), np.zeros(0))
        other.note(step, np.array([2.0]), np.zeros(0))
    ring.go_on(other.after(29))
    read = ring.read(Members("neurons", np.array([0])), Bins(0, 1, 50))[:, 0].tolist()
    assert read == [1.0] * 30 + [2.0] * 20
    assert other.after(29).size < other.size
    assert other.after(60).steps == (61, 49)
    ring.go_on(other.after(60))
    assert ring.steps == (0, 49)


def test_a_status_tells_them_and_a_message_goes_there() -> None:
    source = at(30)
    source.go(10)
    source.turn(Lesion("A1"))
    source.advance()
    source.go(5)
    source.turn(Set({"pull": 0.3}))
    run = Run(source, view_of(COMPILED, COMPILED.gains), lambda shown: None, lambda: False)
    status = json.loads(status_message(run.shown().status, True))
    told = status["futures"]
    assert status["current"] == 2
    assert [(one["number"], one["at"], one["last"], one["turned"]) for one in told] == [
        (1, 5, 11, [{"step": 10, "type": "lesion", "part": "A1"}])
    ]
    assert [(one["number"], one["turned"]) for one in told[0]["within"]] == [(0, [])]
    left = run.shown().status.futures
    assert left.history() is source.futures.all[0].history
    assert command_of('{"type": "switch", "number": 1}') == Switch(1)
    assert command_of('{"type": "switch", "number": 1, "shown": 9}') == Switch(1, 9)
    assert isinstance(source.futures.left, Future)


def test_what_is_undone_goes_on_as_the_branch_that_was_turned_alike_and_no_other() -> None:
    """One that was turned in place of another has its number."""
    source = at(5)
    source.turn(Set({"pull": 0.3}))
    for _ in range(10):
        source.advance()
    source.go(5)
    source.turn(Set({"pull": 0.6}))
    source.turn(Lesion("A1"))
    source.take_back(source.turned[-1].number)
    assert [entry.turn for entry in source.turned] == [Set({"pull": 0.6})]
    assert source.parameters["pull"] == 0.6


def test_turns_after_an_edit_of_words_have_numbers_of_their_own() -> None:
    source = at(10)
    source.turn(Set({"pull": 0.3}))
    for _ in range(10):
        source.advance()
    source.turn(Lesion("A1"))
    source.advance()
    source.go(15)
    edited = carried(source, nv.compile_text(TEXT + "# a word\n").simulator())
    edited.switch(max(one.number for one in edited.futures.all))
    edited.go(edited.reach.last)
    edited.turn(Set({"pull": 0.8}))
    numbers = [entry.number for entry in edited.turned]
    assert len(set(numbers)) == len(numbers) > 1


def test_what_is_undone_where_an_edit_left_branches_of_an_older_spec_is_none_of_these() -> None:
    source = at(10)
    source.go(0)
    source.turn(Set({"pull": 0.3}))
    edited = carried(source, nv.compile_text(TEXT.replace("count: 3", "count: 4")).simulator())
    edited.take_back(edited.turned[-1].number)
    assert edited.turned == ()


def test_what_needs_a_turn_keeps_it_from_being_undone() -> None:
    bounded = TEXT.replace("max: 1}", "max: top}").replace("parameters: {", "parameters: {top: 0.5, ")
    source = SimulatedSource(nv.compile_text(bounded).simulator())
    source.turn(Set({"top": 1.0}))
    first = source.turned[0].number
    source.turn(Set({"pull": 0.9}))
    with pytest.raises(SourceError):
        source.take_back(first)
    assert [entry.turn for entry in source.turned] == [Set({"top": 1.0}), Set({"pull": 0.9})]
    assert source.parameters["pull"] == 0.9


def test_a_weight_that_has_left_all_bounds_can_be_set_and_told_of() -> None:
    text = "neurovis: 1\nname: x\nneurons: {A: {initial: 1}, B: {initial: 1}}\n"
    text += "connections: {A -> A: 1, A -> B: {weight: 1, plasticity: {hebbian: {rate: 1000}}}}\n"
    compiled = nv.compile_text(text)
    source = SimulatedSource(compiled.simulator())
    while np.isfinite(source.seen().snapshot.weights).all():
        source.advance()
    source.turn(Weigh("A -> B", 0.5))
    view = view_of(compiled, compiled.gains)
    status = json.loads(status_message(Run(source, view, lambda shown: None, lambda: False).shown().status, True))
    assert [entry["back"] for entry in status["turned"]] == [None]
    number = source.turned[0].number
    source.advance()
    with pytest.raises(SourceError, match="not one finite number"):
        source.take_back(number)


def test_messages_name_a_branch_and_hold_no_half_characters() -> None:
    asked = '{"type": "trace", "items": ["n0"], "first": 0, "every": 1, "bins": 1, "branch": 3}'
    assert getattr(command_of(asked), "branch", None) == 3
    with pytest.raises(ProtocolError, match="half a character"):
        command_of('{"type": "rename", "number": 0, "name": "\\ud83d"}')
