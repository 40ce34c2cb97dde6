"""Publishers of one network are told apart: one that begins anew loses nothing, and two are not mixed."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_ros_recorder import HASH, LABEL, START, TOPIC, N, arrays_in, files, text_of_type

from neurovis_spec.ros.accept import ARRAY, Stream, arrays
from neurovis_spec.ros.middleware import Arrival, Origin
from neurovis_spec.ros.publishers import Numbered, OnePublisher
from neurovis_spec.ros.recorder import Recorder
from neurovis_spec.ros.summary import Teller
from neurovis_spec.runtime.wire import ENCODINGS, ArrayForm

MS = 1_000_000
FORM = ArrayForm.of(LABEL, N, ENCODINGS[2])


def message(step: int, value: float = 0.0) -> bytes:
    return FORM.message(step, step / 100, np.full(N, value))


class Controller:
    """A made-up publisher; ``beside`` are the others that are there."""

    def __init__(self, who: str, connection: str = "1", beside: Iterable[Controller] = ()) -> None:
        self.there, self.beside = True, list(beside)
        self.value = float(sum(who.encode()))
        self.origin = Origin(who, f"{who} {connection}", f"/{who}", self._alone)

    def _alone(self) -> bool:
        return not any(one.there for one in self.beside)

    def sends(self, step: int, milliseconds: float) -> Arrival:
        return Arrival(message(step, self.value), START + round(milliseconds * MS), None, ARRAY, self.origin)


def both() -> tuple[Controller, Controller]:
    """Two that are there at the same time."""
    first = Controller("a")
    second = Controller("b", beside=[first])
    first.beside = [second]
    return first, second


class Desk:
    """What listens to the activities and weights of a network."""

    def __init__(self) -> None:
        self.lines = list[str]()
        one = OnePublisher(self.lines.append)
        self.activity, self.weights = (
            Stream(name, f"/x/{name}", ARRAY, ENCODINGS[2], arrays(HASH, N), one) for name in ("activity", "weights")
        )

    def hear(self, *arrivals: Arrival, topic: str = "activity") -> list[float]:
        """The values of those that count."""
        stream = self.activity if topic == "activity" else self.weights
        taken = [one for arrival in arrivals for one in stream.take(arrival, Teller(lambda line: None))]
        return [accepted.numbers[0] for _, accepted in taken]


def test_a_controller_that_starts_again_with_a_higher_number_loses_nothing() -> None:
    """400 messages came, and 4,800 counted as lost."""
    desk, first = Desk(), Controller("a")
    second = Controller("b", beside=[first])
    desk.hear(*(first.sends(step, 10 * step) for step in range(200)))
    first.there = False
    desk.hear(*(second.sends(step, 10 * (step - 4800)) for step in range(5000, 5200)))
    counts = desk.activity.counts
    assert (counts.received, counts.lost, sum(counts.rejected.values())) == (400, 0, 0)
    assert desk.lines == ["/x/activity: another publisher goes on, /b"]
    desk.hear(second.sends(5203, 4030))
    assert counts.lost == 3, "what it lost itself"


def test_so_does_one_that_bears_the_same_name_again() -> None:
    """In ROS 1 there is one of a name at a time."""
    desk, first = Desk(), Controller("a")
    again = Controller("a", "2", beside=[first])
    for topic in ("activity", "weights"):
        desk.hear(*(first.sends(step, 10 * step) for step in range(20)), topic=topic)
    assert desk.hear(again.sends(500, 201), again.sends(501, 211)) == [97, 97]
    assert desk.hear(again.sends(500, 201), topic="weights") == [97]
    assert desk.activity.counts.lost == desk.weights.counts.lost == 0
    assert desk.lines == ["/x/activity: /a has begun anew"]


@pytest.mark.parametrize("known", [True, False])
def test_two_at_once_are_not_mixed(known: bool) -> None:
    desk, (first, second) = Desk(), both()
    if not known:  # each topic by itself then
        first.origin, second.origin = (one.origin._replace(who="", name="") for one in (first, second))
    sent = [one.sends(step, 10 * step + later) for step in range(300) for one, later in ((first, 0), (second, 4))]
    assert desk.hear(*sent) == [97.0] * 300
    rest = [second.sends(7, 3001), first.sends(7, 3002), second.sends(8, 3003), first.sends(8, 3004)]
    assert desk.hear(*rest, topic="weights") == ([97, 97] if known else [98, 98])
    assert desk.activity.counts.rejected["publisher"] == 300
    assert desk.activity.counts.lost == 0
    name = ", /b," if known else ""
    told = f"another publisher{name} sends at the same time: its messages are left out"
    assert desk.lines == [f"/x/activity: {told}", *([] if known else [f"/x/weights: {told}"])]


def test_another_goes_on_where_the_first_has_fallen_silent() -> None:
    """Such as one that kill -9 has ended: ROS 2 takes it to be there for a while."""
    desk, (first, second) = Desk(), both()
    desk.hear(*(first.sends(step, 10 * step) for step in range(100)))
    assert desk.hear(*(second.sends(step, 1500 + 10 * step) for step in range(50))) == [], "it is not sure yet"
    assert desk.hear(*(second.sends(step, 1500 + 10 * step) for step in range(50, 100))) == [98.0] * 100
    assert (sum(desk.activity.counts.rejected.values()), desk.activity.counts.lost) == (0, 0)
    assert desk.hear(first.sends(101, 2501), second.sends(100, 2502)) == [98]


@pytest.mark.parametrize("more", [True, False])
def test_at_the_end_those_that_waited_are_kept_if_the_first_one_sent_no_more(more: bool) -> None:
    desk, (first, second) = Desk(), both()
    desk.hear(first.sends(0, 0), first.sends(1, 10), second.sends(5, 500), second.sends(6, 510))
    desk.hear(second.sends(5, 501), topic="weights")
    if more:
        desk.hear(first.sends(2, 515))
    for stream, waited in ((desk.activity, 2), (desk.weights, 1)):
        found = stream.end(Teller(lambda line: None))
        assert len(found) == (0 if more else waited)
        assert stream.counts.rejected["publisher"] == (waited if more else 0)
        assert stream.counts.lost == 0


def test_a_slow_controller_is_not_silent_between_its_steps() -> None:
    desk = Desk()
    first, second = both()
    assert desk.hear(first.sends(0, 0), first.sends(1, 2000)) == [97, 97]
    for step in range(2, 30):
        assert desk.hear(second.sends(step, 2000 * step - 500), first.sends(step, 2000 * step)) == [97]


def test_messages_of_nobody_known_are_heard_as_ever() -> None:
    desk = Desk()
    desk.hear(*(Arrival(message(step), START, None, ARRAY) for step in (5, 6, 9)))
    assert (desk.activity.counts.lost, desk.lines) == (2, [])


def test_what_is_of_another_network_is_nobody_whose_turn_it_could_be() -> None:
    desk, first, stranger = Desk(), Controller("a"), Controller("b")
    other = ArrayForm.of("neurovis/1:other", N, ENCODINGS[2]).message(0, 0.0, np.zeros(N))
    desk.hear(Arrival(other, START, None, ARRAY, stranger.origin))
    assert desk.hear(first.sends(0, 1)) == [97]
    assert desk.activity.counts.rejected["hash"] == 1
    assert desk.lines == []


def test_a_recording_of_two_holds_one(tmp_path: Path) -> None:
    first, second = both()
    lines = list[str]()
    recorder = Recorder(files(tmp_path / "x.mcap", 2), {ARRAY: text_of_type(ARRAY, 2)}, lines.append)
    stream = Stream("activity", TOPIC, ARRAY, ENCODINGS[2], arrays(HASH, N), OnePublisher(lines.append))
    recorder.start()
    for step in range(200):
        recorder.put(stream, first.sends(step, 10 * step))
        recorder.put(stream, second.sends(step, 10 * step + 1))
    recorder.end()
    assert arrays_in(tmp_path / "x.mcap") == [message(step, 97) for step in range(200)]
    assert (stream.counts.received, stream.counts.recorded) == (400, 200)
    assert lines[0] == f"{TOPIC}: another publisher, /b, sends at the same time: its messages are left out"
    assert all(f"of another publisher on {TOPIC}" in line for line in lines[1:])


def test_the_one_that_there_is_has_sent_it_whatever_is_lost() -> None:
    numbered = Numbered(lambda: ["P"])
    assert [numbered.of(number) for number in (7, 8, 20, 21)] == ["P"] * 4


def test_one_that_begins_anew_is_another_one() -> None:
    there = ["P"]
    numbered = Numbered(lambda: there)
    assert [numbered.of(number) for number in (7, 8)] == ["P", "P"]
    there[:] = ["P", "Q"]  # the first was killed, and is still listed
    assert [numbered.of(number) for number in (1, 2, 3)] == ["Q"] * 3
    there[:] = ["R"]
    assert [numbered.of(number) for number in (500, 501)] == ["R"] * 2


def test_one_that_has_ended_is_not_gone_on_with() -> None:
    """Those before sent as many messages as the last one has sent by now."""
    there = list[str]()
    numbered = Numbered(lambda: there)
    for name in "PQR":
        there[:] = [name]
        assert [numbered.of(number) for number in range(1, 201)] == [name] * 200
    assert [numbered.of(number) for number in range(201, 210)] == ["R"] * 9
    there[:] = []  # which may be known late
    (late,) = {numbered.of(number) for number in range(1, 201)}
    there[:] = ["S"]
    assert {numbered.of(number) for number in range(201, 300)} == {late}


@given(
    st.lists(st.integers(0, 2), min_size=1, max_size=60),
    st.tuples(st.integers(1, 50), st.integers(100, 150), st.integers(300, 350)),
)
def test_rows_of_numbers_are_never_mixed(order: list[int], begin: tuple[int, int, int]) -> None:
    """Nobody knows which is whose where all were there before; each is by itself all the same."""
    numbered = Numbered(lambda: ["P", "Q", "R"])
    sent, names = [0, 0, 0], [set[str](), set[str](), set[str]()]
    for one in order:
        names[one].add(numbered.of(begin[one] + sent[one]))
        sent[one] += 1
    assert all(len(found) <= 1 for found in names)
    assert len(set[str]().union(*names)) == sum(map(bool, names))
