"""The spec with the interventions of a run as its events: it says what it said, and does what the page has shown."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from difflib import SequenceMatcher
from pathlib import Path
from queue import SimpleQueue
from typing import Literal

import pytest
from test_live_saving import FOLLOWING

import neurovis_spec as nv
from neurovis_spec.live.carry import carried
from neurovis_spec.live.commands import Fetch, Into, PlaceNeuron, Save, Seek, Write
from neurovis_spec.live.desk import Desk, Written
from neurovis_spec.live.pins import Compile, SavingError
from neurovis_spec.live.recorded import RecordedSource
from neurovis_spec.live.run import Run, Shown
from neurovis_spec.live.show import Show
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.live.source import Source
from neurovis_spec.live.turns import Hold, Lesion, Release, Set, Turn, Turned, Weigh
from neurovis_spec.live.with_events import with_events

ODD = """neurovis:   1     # mine
name: odd
include: library.yaml
parameters: {pull: {value: 0.1, min: 0, max: 1},   gain: 2}
neurons:
    A: {count: 3, activation: tanh, bias: 0.2}
    S: {activation: step_like}   # of the library
connections:
    A -> A: {pattern: all_to_all, weight: "uniform(-1, 1)"}

    A3 -> S: pull
time: {steps: 40}
"""
LIBRARY = "activations: {step_like: {value: tanh(2*x)}}\n"
#: Ways to write events, none, and other things around them.
TEXTS = {
    "none": ODD,
    "no last line end": ODD.rstrip("\n"),
    "CRLF": (ODD + "# the end\n").replace("\n", "\r\n"),
    "BOM": "\ufeff" + ODD,
    "no items": ODD.replace("time:", "events: [ ]\ntime:"),
    "block": ODD.replace("time:", "events:\n- {at: 3, lesion:   A1}  # why\n-   at: 15\n    mend: A1\n\n# so\n\ntime:"),
    "braces": ODD.replace(
        "time:", "events: [{at: 3, lesion: A1},\n         {at: 15, mend: A1},  # b\n        ]\ntime:"
    ),
}


def compiler(folder: Path) -> Compile:
    """Compiles texts as though they stood in a folder."""
    (folder / "library.yaml").write_text(LIBRARY)
    return lambda text: nv.compile_text(text, file=str(folder / "odd.yaml"), folder=folder)


def turned_in_the_past(source: SimulatedSource) -> None:
    """Turn a run, go back, and turn it differently: what came after is another branch."""
    source.turn(Lesion("A2"))
    for _ in range(20):
        source.advance()
    source.turn(Weigh("A1 -> A2", 0.75))
    source.go(8)
    source.turn(Set({"pull": 0.6}))
    source.turn(Hold("A1", 0.25))
    for _ in range(5):
        source.advance()
    source.turn(Release("A1"))
    for _ in range(12):
        source.advance()


def does(source: SimulatedSource, text: str, path: Path) -> None:
    """That the run of a text is what a source has shown, as far as that can be gone back to, bit for bit."""
    path.write_bytes(text.encode())
    run = nv.compile(path).run(source.step + 1)
    for one in source.recall(1000):
        assert one.snapshot.activity.tobytes() == run.activity[one.snapshot.step].tobytes()


@pytest.mark.parametrize("name", [*TEXTS, "following"])
def test_it_does_what_the_branch_that_is_shown_did_and_all_else_stays(name: str, tmp_path: Path) -> None:
    text, compile = TEXTS.get(name, FOLLOWING), compiler(tmp_path)
    network = nv.compile_text(text.removeprefix("\ufeff"), file=str(tmp_path / "odd.yaml"), folder=tmp_path)
    source = SimulatedSource(network.simulator())
    turned_in_the_past(source)
    made = with_events(text, network.hash, source.turned, compile)
    kinds = {kind for kind, *_ in SequenceMatcher(None, text, made.after, autojunk=False).get_opcodes()}
    assert kinds == {"equal", "insert"}
    does(source, made.after, tmp_path / "odd.yaml")
    assert "A1 -> A2" not in made.after.replace(text, ""), "it is of the other branch"


def test_what_no_event_does_is_a_comment_and_nothing_turned_is_refused(tmp_path: Path) -> None:
    compile = compiler(tmp_path)
    shown = compile(ODD).hash
    several = Turned(4, Lesion("A1 -> A2\n (2)"))
    assert "# step 5, lesion A1 -> A2 (2): an event names all" in with_events(ODD, shown, [several], compile).after
    dragged = Turned(9, Set({"pull": 1e-7}), since=5)
    after = with_events(ODD, shown, [dragged], compile).after
    assert after.endswith(
        "events:\n  - {at: 10, set: {pull: 1.0e-07}}\n# step 6 to 10: what pull was while it was dragged is left out\n"
    )
    with pytest.raises(SavingError, match="nothing was turned"):
        with_events(ODD, shown, [], compile)
    with pytest.raises(SavingError, match="another network"):
        with_events(ODD.replace("gain: 2", "more: 2").replace("count: 3", "count: 4"), shown, [dragged], compile)


def test_a_spec_that_runs_with_what_was_saved_has_it_once(tmp_path: Path) -> None:
    """With --watch the run goes on in the spec that was written, is turned on, and begins anew in it."""
    compile, path = compiler(tmp_path), tmp_path / "odd.yaml"
    path.write_text(ODD)
    network = nv.compile(path)
    source = SimulatedSource(network.simulator())
    turned_in_the_past(source)
    saved = with_events(ODD, network.hash, source.turned, compile)
    path.write_text(saved.after)
    again = nv.compile(path)
    watched = carried(source, again.simulator())
    watched.turn(Lesion("A2"))
    for _ in range(5):
        watched.advance()
    more = with_events(saved.after, again.hash, watched.turned, compile, saved)
    assert more.after.startswith(saved.after)
    assert more.after.count("A2") == saved.after.count("A2") + 1
    does(watched, more.after, path)
    watched.restart()
    watched.turn(Lesion("A3"))
    for _ in range(30):
        watched.advance()
    anew = with_events(saved.after, again.hash, watched.turned, compile, saved)
    assert anew.after == saved.after + "  - {at: 1, lesion: A3}\n"
    does(watched, anew.after, path)
    assert with_events(saved.after, again.hash, watched.turned, compile).after == anew.after


@contextmanager
def desk_of(
    path: Path, compile: Compile, source: Source | None = None
) -> Iterator[tuple[Callable[[int, Turn], None], Desk]]:
    """A run that stands still, what turns it at a step, and its desk."""
    steps = SimpleQueue[tuple[int, int]]()
    network = compile(path.read_text())
    staged, view = Show().stage(network)

    def show(shown: Shown) -> None:
        steps.put((shown.glance.step, len(shown.status.turned)))

    def turn(step: int, what: Turn) -> None:
        run.ask(Seek(step))
        while steps.get(timeout=30)[0] != step:
            pass
        run.ask(what)
        while not steps.get(timeout=30)[1]:
            pass

    run = Run(source or staged, view, show, lambda: True, playing=False)
    desk = Desk(network, None, Show().view, run, lambda _: None, Written(path, compile))
    run.start()
    desk.start()
    try:
        yield turn, desk
    finally:
        desk.end()
        run.end()


def test_it_is_shown_then_written_and_written_anew(tmp_path: Path) -> None:
    compile, path, answers = compiler(tmp_path), tmp_path / "odd.yaml", SimpleQueue[str | bytes]()
    path.write_text(ODD)

    def told(desk: Desk, request: Save | Write | Fetch) -> dict[str, object]:
        desk.ask(request, answers.put)
        answer = answers.get(timeout=30)
        assert isinstance(answer, str)
        found: dict[str, object] = json.loads(answer)
        return found

    with desk_of(path, compile) as (turn, desk):
        assert "nothing was turned" in str(told(desk, Save("events"))["reason"])
        turn(10, Lesion("A2"))
        shown = told(desk, Save("events"))
        assert shown["into"] == "events"
        assert shown["written"] is False
        added = [line for line in str(shown["diff"]).splitlines()[2:] if line.startswith(("+", "-"))]
        assert added == ["+", "+events:", "+  - {at: 11, lesion: A2}"]
        assert path.read_text() == ODD
        desk.ask(Fetch("yaml", 1), answers.put)
        fetched = answers.get(timeout=30)
        assert isinstance(fetched, bytes)
        assert path.read_text() == ODD
        assert told(desk, Write())["written"]
        assert fetched.endswith(path.read_bytes())
        assert told(desk, Save("events"))["diff"] == ""
        turn(3, Set({"pull": 0.5}))
        assert told(desk, Save("events"))["written"] is False
        assert told(desk, Write())["written"]
        assert path.read_text() == ODD + "\nevents:\n  - {at: 4, set: {pull: 0.5}}\n"
        edited = path.read_text().replace("# mine", "# edited")
        path.write_text(edited)
        turn(6, Lesion("A3"))
        assert told(desk, Save("events"))["written"] is False
        assert told(desk, Write())["written"], "what was saved before is there once, wherever it stands"
        assert path.read_text() == edited + "  - {at: 7, lesion: A3}\n"
        path.write_text(path.read_text().replace("lesion: A3", "lesion: [A3]"))
        assert "have been edited since" in str(told(desk, Save("events"))["reason"])
        path.write_text(ODD.replace("# mine", "# edited"))
        assert "-" not in [line[:1] for line in str(told(desk, Save("events"))["diff"]).splitlines()[2:]]
        path.write_text(ODD.replace("count: 3", "count: 4"))
        assert "another network" in str(told(desk, Save("events"))["reason"])
        path.write_text(ODD + "  broken")
        assert "error" in str(told(desk, Save("events"))["reason"])

    path.write_text(ODD)
    network = nv.compile(path)
    with desk_of(path, compile, RecordedSource(network.network, network.run(5))) as (_, desk):
        assert "what is played" in str(told(desk, Fetch("yaml", 1))["reason"])


@pytest.mark.parametrize("into", ["spec", "file"])
@pytest.mark.parametrize("text", ["none", "block", "braces"])
def test_neurons_put_by_hand_are_saved_beside_events_that_were_saved_before_them(
    tmp_path: Path, into: Literal["spec", "file"], text: str
) -> None:
    """And these once, whatever is saved next; the file is drawn as the page is."""
    compile, path, answers = compiler(tmp_path), tmp_path / "odd.yaml", SimpleQueue[str | bytes]()
    path.write_text(TEXTS[text])
    with desk_of(path, compile) as (turn, desk):

        def saved(into: Into) -> None:
            desk.ask(Save(into), answers.put)
            answer = json.loads(answers.get(timeout=30))
            assert answer["type"] == "saving", answer
            desk.ask(Write(), answers.put)
            assert json.loads(answers.get(timeout=30))["written"]

        turn(10, Lesion("A2"))
        saved("events")
        desk.ask(PlaceNeuron("S", (9.0, 4.0), True), answers.put)
        saved(into)
        turn(14, Lesion("A3"))
        saved("events")
        desk.ask(PlaceNeuron("S", (7.0, 5.0), True), answers.put)
        saved(into)
        saved("events")
        now = nv.compile(path)
        assert now.placed().positions == desk.placed.layout.positions
        assert path.read_text().count("lesion: A2") == path.read_text().count("lesion: A3") == 1
        assert now.placed().positions["S"] == (7.0, 5.0)
        path.write_text(path.read_text().replace("count: 3", "count: 4"))
        desk.ask(Save(into), answers.put)
        assert "another network by now" in str(answers.get(timeout=30))
