"""Layouts for windows: asked for by the owner's page, taken where the network is drawn larger so, and nowhere else."""

from __future__ import annotations

import asyncio
import gzip
import json
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import numpy as np
import pytest
from chromium import Page, chromium
from examples import SPECS
from live_window import HEAD, area_of
from test_live_browser import STEP
from test_live_hand import holds
from test_live_room import box, discs
from test_live_server import Eyes, Live, served

import neurovis_spec as nv
from neurovis_spec.diagnostics import Findings
from neurovis_spec.layout.model import RADIUS, LayoutRefusalError
from neurovis_spec.live.access import Access
from neurovis_spec.live.commands import (
    REQUESTS,
    Appearance,
    Branch,
    Compare,
    Draw,
    Fetch,
    Fit,
    PlaceNeuron,
    Save,
    Seek,
    Unplace,
    Write,
)
from neurovis_spec.live.desk import Desk, Written
from neurovis_spec.live.hub import Hub
from neurovis_spec.live.live import Edited, Edits, listen
from neurovis_spec.live.pins import placed
from neurovis_spec.live.protocol import FILE, ProtocolError, command_of
from neurovis_spec.live.run import Run
from neurovis_spec.live.saved_views import SavedView, keep, views_in
from neurovis_spec.live.server import Server
from neurovis_spec.live.show import Show
from neurovis_spec.live.view import View
from neurovis_spec.live.windows import SHAPES, Window, fitted, is_free

#: A fan that is wide as it is laid out anywhere, and can be high.
FAN = """neurovis: 1
name: fan
title: A fan
neurons: {A: {activation: tanh, bias: 0.1}, N: {count: 12, activation: tanh}}
connections: {A -> N: 1}
"""
DIRECTED = "\nlayout: {direction: down}\n"


def compiled(text: str = FAN, folder: Path | None = None) -> nv.CompiledNetwork:
    return nv.compile_text(text, file="x.yaml", folder=folder)


def told(view: View) -> str:
    """The window that a page is told of."""
    return str(json.loads(gzip.decompress(view.content))["window"])


def test_a_network_is_laid_out_for_a_window_in_which_it_is_larger_so() -> None:
    network = compiled()
    found = fitted(network, None, "tall")
    assert found is not None
    made, layout = found
    assert layout == network.placed(size=SHAPES["tall"].page), "that of render --size"
    assert SHAPES["tall"].scale(layout) >= 1.1 * SHAPES["tall"].scale(network.placed())
    assert (made.hash, made.of_size(None).placed()) == (network.hash, network.placed())
    assert np.array_equal(made.gains.activity, network.gains.activity)
    assert fitted(network, None, "wide") is None, "it is as large as it can be"
    assert fitted(network, None, "default") is None
    assert placed(network).layout is network.placed()


def test_a_small_network_runs_along_a_wide_window() -> None:
    network = nv.compile(SPECS / "mlp.yaml")
    assert placed(network, None, "wide").layout.direction == "right"
    assert placed(network, None, "tall").layout is network.placed()


@pytest.mark.parametrize("spec", ["hebbian.yaml", "ring.yaml", "cpg_rbf.yaml", "walk/walk.yaml", "worm/worm.yaml"])
@pytest.mark.parametrize("window", ["tall", "wide"])
def test_examples_are_laid_out_as_ever(spec: str, window: Window) -> None:
    network = nv.compile(SPECS / spec)
    found = placed(network, None, window)
    assert found.compiled is network
    assert found.layout is network.placed()


def test_nothing_is_asked_where_a_window_is_filled_or_discs_are_as_large_as_they_are_drawn() -> None:
    few, walk = nv.compile(SPECS / "hebbian.yaml").placed(), nv.compile(SPECS / "walk/walk.yaml").placed()
    assert SHAPES["wide"].is_filled(few)
    assert [SHAPES[window].is_filled(walk) for window in ("wide", "tall")] == [True, False]
    assert SHAPES["wide"].scale(few) * RADIUS == 60


@pytest.mark.parametrize(
    "more",
    [
        DIRECTED,
        "\nrender: {size: [900, 700]}\n",
        "\nlayout: {positions: {N1: [0, 0]}}\n",
        "\nlayout: {file: x.layout.yaml}\n",
        "\nlayout: {arrange: {N: ring}}\n",
    ],
)
def test_who_says_how_a_network_is_laid_out_is_heard(more: str, tmp_path: Path) -> None:
    network = compiled(FAN + more, tmp_path)
    for window in SHAPES:
        assert fitted(network, None, window) is None


def test_large_networks_are_laid_out_once() -> None:
    large = FAN.replace("count: 12", "count: 101").replace("{A -> N: 1}", "{N -> N: {weight: 1, pattern: all_to_all}}")
    assert is_free(compiled(FAN))
    assert is_free(compiled(large))
    assert not is_free(compiled(large.replace("101", "150")))


def test_given_places_are_heard() -> None:
    text = FAN.replace("count: 12,", "count: 12, position: [i, 0.5*i],").replace(
        "bias: 0.1}", "bias: 0.1, position: [3, 9]}"
    )
    for window in SHAPES:
        assert fitted(compiled(text), None, window) is None


def test_what_cannot_be_laid_out_for_a_window_is_drawn_as_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    network, own = compiled(), compiled().placed()

    def refused(self: nv.CompiledNetwork, *_: object, **__: object) -> object:
        if self.network.render.size is not None:
            raise LayoutRefusalError("too-large", "no")
        return own

    monkeypatch.setattr(nv.CompiledNetwork, "placed", refused)
    assert fitted(network, None, "tall") is None


@dataclass
class Watched:
    """A run that somebody looks on at, and its desk; what all are told."""

    folder: Path
    show: Show = field(default_factory=Show)
    said: list[dict[str, Any]] = field(default_factory=list)

    @property
    def path(self) -> Path:
        return self.folder / "x.yaml"

    def compile(self) -> nv.CompiledNetwork:
        return nv.compile(self.path)

    def begin(self, playing: bool) -> None:
        network = self.compile()
        source, view = self.show.stage(network)
        self.run = Run(source, view, lambda _: None, lambda: False, playing=playing)
        written = Written(self.path, lambda text: nv.compile_text(text, file=str(self.path), folder=self.folder))
        tell = lambda text: self.said.append(json.loads(text))  # noqa: E731
        self.desk = Desk(network, None, self.show.view, self.run, tell, written)
        self.edits = Edits(self.show, Edited(self.path, self.compile), self.run, tell, self.desk)
        self.run.start()
        self.desk.start()

    def ask(self, request: Any) -> str | bytes:
        """Ask the desk, and wait until it has answered."""
        answers = SimpleQueue[str | bytes]()
        self.desk.ask(request, answers.put)
        return answers.get(timeout=60)

    def fit(self, window: Window) -> str:
        """Ask for a window, and wait until it is known what comes of it; the window of what is shown."""
        self.desk.ask(Fit(window), lambda _: None)
        return self.settled()

    def settled(self) -> str:
        """The window of what is shown, when nothing is being done."""
        for _ in range(2):  # what is put into the queue while it is asked
            while True:
                self.ask(Save("events"))
                if not [one for one in self.said if one["type"] == "fitting"][-1:] or self.last("fitting") is None:
                    break
        self.done()
        return told(self.run.view)

    def last(self, kind: str) -> Any:
        return [one for one in self.said if one["type"] == kind][-1]["window"]

    def done(self) -> None:
        """Wait until the run has done what it was asked."""
        answer = SimpleQueue[str]()
        self.run.inquire(lambda _: answer.put(""))
        answer.get(timeout=60)

    def edit(self, text: str) -> str:
        self.path.write_text(text)
        self.edits._edited()
        return told(self.run.view)


@contextmanager
def watched(folder: Path, text: str = FAN, playing: bool = False, show: Show | None = None) -> Iterator[Watched]:
    made = Watched(folder, show or Show())
    made.path.write_text(text)
    made.begin(playing)
    try:
        yield made
        assert made.run.failure is None
    finally:
        made.desk.end()
        made.run.end()


def test_the_picture_is_that_of_the_window_that_was_asked_for_last(tmp_path: Path) -> None:
    with watched(tmp_path) as live:
        own = live.run.view
        assert [live.fit(window) for window in ("tall", "wide", "tall")] == ["tall", "default", "tall"]
        size = SHAPES["tall"].page
        assert live.run.view.layout == live.compile().placed(size=size)
        saved = live.ask(Fetch("svg", 1.0))
        assert isinstance(saved, bytes)
        assert saved[0] == FILE
        head = 4 + int.from_bytes(saved[2:4], "little")
        live.compile().render(tmp_path / "x.svg", step=0, size=size)
        assert saved[head:] == (tmp_path / "x.svg").read_bytes()
        assert live.fit("default") == "default"
        assert live.run.view.content == own.content, "as it began"
        assert not any(one["undo"] for one in live.said if one["type"] == "placed"), "there is nothing to be undone"


def test_the_picture_is_as_large_with_pathways_and_in_another_theme(tmp_path: Path) -> None:
    with watched(tmp_path) as live:
        live.run.ask(Draw(Appearance(pathways=True)))
        while not live.run.view.appearance.pathways:
            live.done()
        assert live.fit("tall") == "tall"
        assert told(live.run.view.dressed("dark")) == "tall"
        live.run.ask(Draw(Appearance(activity=2.0)))
        while live.run.view.appearance.pathways:
            live.done()
        assert told(live.run.view) == "tall"
        assert live.run.view.layout == live.compile().placed(size=SHAPES["tall"].page)


def test_what_was_put_by_hand_stays_and_what_is_undone_is_laid_out(tmp_path: Path) -> None:
    with watched(tmp_path) as live:
        live.desk.ask(PlaceNeuron("N3", (2.0, 5.0), done=True), lambda _: None)
        assert live.fit("tall") == "default"
        assert live.run.view.layout.positions["N3"] == (2.0, 5.0)
        live.desk.ask(Unplace(), lambda _: None)
        assert live.settled() == "tall"
        others = dict(live.run.view.layout.positions)
        live.desk.ask(PlaceNeuron("N3", (3.0, 2.0), done=True), lambda _: None)
        assert live.fit("default") == "tall", "only the neuron moves"
        moved = live.run.view.layout.positions
        assert {name for name in moved if moved[name] != others[name]} == {"N3"}
        assert live.edit(FAN.replace("bias: 0.1", "bias: 0.2")) == "tall"
        assert live.run.view.layout.positions["N3"] == (3.0, 2.0)


@pytest.mark.parametrize("into", ["spec", "file"])
def test_what_is_saved_is_drawn_as_it_was_shown(tmp_path: Path, into: Any) -> None:
    with watched(tmp_path) as live:
        live.fit("tall")
        x, y = live.run.view.layout.positions["N3"]
        live.desk.ask(PlaceNeuron("N3", (x + 1.0, y), done=True), lambda _: None)
        assert "saving" in str(live.ask(Save(into)))
        assert "true" in str(live.ask(Write()))
        shown = live.run.view.layout.positions
        assert live.fit("default") == "default", "the spec says it by now"
        for positions in (live.run.view.layout.positions, live.compile().placed().positions):
            assert all(positions[name] == pytest.approx(at) for name, at in shown.items()), "and nothing has moved"


def test_edits_keep_the_window(tmp_path: Path) -> None:
    with watched(tmp_path) as live:
        assert live.fit("tall") == "tall"
        view = live.run.view
        assert live.edit(FAN.replace("A fan", "Another")) == "tall"
        assert live.run.view.layout is view.layout
        assert live.run.view.plan.title == "Another"
        assert live.edit(FAN.replace("A fan", "Another").replace("count: 12", "count: 14")) == "tall"
        assert live.edit(FAN + DIRECTED) == "default"
        assert live.edit(FAN) == "tall"
        assert live.edit("neurovis: 1") == "tall", "what cannot be shown changes nothing"
        assert live.edit(FAN.replace("A fan", "A third")) == "tall"


def test_a_run_goes_on_to_where_it_was_sent(tmp_path: Path) -> None:
    with watched(tmp_path, playing=True) as live:
        live.run.ask(Seek(10_000))
        live.done()
        assert live.fit("tall") == "tall"
        while live.run._running:
            live.done()
        assert live.run.shown().glance.step == 10_000


def test_a_branch_beside_the_run_is_drawn_in_the_same_layout(tmp_path: Path) -> None:
    with watched(tmp_path) as live:
        for command in (Seek(20), Seek(5), Branch()):
            live.run.ask(command)
            live.done()
            while live.run._running:
                live.done()
        (other,) = live.run.shown().status.futures.all
        live.run.ask(Compare(other.number))
        assert live.fit("tall") == "tall"
        shown = live.run.shown()
        assert shown.compared is not None
        assert told(shown.view) == "tall", "that of both"
        assert len(shown.status.futures.all) == 1


def test_recordings_are_laid_out_for_a_window(tmp_path: Path) -> None:
    recording = compiled().run(20)
    with watched(tmp_path, show=Show(recording)) as live:
        assert live.fit("tall") == "tall"
        assert live.run.view.layout == live.compile().placed(size=SHAPES["tall"].page)


def test_an_engine_that_fails_leaves_the_picture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object) -> None:
        raise RuntimeError("no")

    with watched(tmp_path) as live:
        monkeypatch.setattr("neurovis_spec.live.pins.fitted", fails)
        assert live.fit("tall") == "default"


def test_only_owners_ask_and_only_for_windows_that_there_are() -> None:
    async def test(live: Live) -> None:
        async with live.stream(live.access.viewer) as viewing, live.stream(live.access.owner) as owning:
            viewer, owner = Eyes(viewing), Eyes(owning)
            await viewing.send_json({"type": "fit", "window": "tall"})
            await viewer.until(lambda: any(one["type"] == "refused" for one in viewer.told))
            await owning.send_json({"type": "fit", "window": "tall"})
            await owner.until(lambda: owner.scene != {})
            assert not any(one["type"] == "refused" for one in owner.told)

    served(test)
    for text in ('{"type": "fit"}', '{"type": "fit", "window": "low"}', '{"type": "fit", "window": [3, 4]}'):
        with pytest.raises(ProtocolError):
            command_of(text)
    assert command_of('{"type": "fit", "window": "wide"}') == Fit("wide")


def test_a_saved_view_has_the_window_of_its_camera(tmp_path: Path) -> None:
    path, network = tmp_path / "x.neurovis-view.yaml", compiled().network
    keep(path, "near", SavedView(3, "1", (2.0, 1.0, 1.0), (), "", (), window="tall"))
    keep(path, "far", SavedView(3, "1", (2.0, 1.0, 1.0), (), "", ()))
    findings = Findings()
    assert {name: view.window for name, view in views_in(path, network, findings).items()} == {
        "near": "tall",
        "far": None,
    }
    assert path.read_text().count("window") == 1
    keep(path, "near", SavedView(3, "1", (2.0, 1.0, 1.0), (), "", ()))
    assert views_in(path, network, findings)["near"].window is None
    assert not findings.sorted()
    path.write_text(path.read_text().replace("window: null", "window: round"))
    assert views_in(path, network, findings)["near"].window is None
    assert [one.code for one in findings.sorted()] == ["wrong-type"]


@asynccontextmanager
async def opened(folder: Path, text: str) -> AsyncIterator[tuple[Page, Access, Run]]:
    """A browser, and a live view that knows files, at which nobody looks yet."""
    async with editable(folder, text) as (page, access, run, _):
        yield page, access, run


@asynccontextmanager
async def editable(folder: Path, text: str) -> AsyncIterator[tuple[Page, Access, Run, Edits]]:
    """The same, with what shows its spec, x.yaml, anew when that was edited."""
    path = folder / "x.yaml"
    path.write_text(text)
    network, show, hub = nv.compile(path), Show(), Hub(asyncio.get_running_loop(), REQUESTS)
    run = Run(*show.stage(network), hub.show, lambda: hub.watched)
    sock = listen("127.0.0.1", 0)
    access = Access("127.0.0.1", sock.getsockname()[1], viewers=True)
    written = Written(path, lambda again: compiled(again, folder))
    desk = Desk(network, None, show.view, run, hub.keep_soon, written)
    edits = Edits(show, Edited(path, lambda: nv.compile(path)), run, hub.keep_soon, desk)
    server = Server(access, hub, run, desk)
    await server.start(sock)
    run.start()
    desk.start()
    try:
        async with chromium(folder) as page:
            yield page, access, run, edits
            assert page.errors == []
    finally:
        desk.end()
        run.end()
        await server.stop()


def share_of(view: View, picture: list[float]) -> float:
    """How many pixels the neurons of a view have where the picture of the page is there."""
    corners = [place(view, picture, x + way * r, y + way * r) for x, y, r in discs(view).values() for way in (-1, 1)]
    wide, high = np.ptp(np.array(corners), axis=0).tolist()
    return float(wide * high)


def place(view: View, picture: list[float], x: float, y: float) -> tuple[float, float]:
    """Where a point of a view is in the window, as a whole."""
    left, top, right, bottom = picture
    area = area_of(view)
    across, down = area.within((right - left, bottom - top), area.at(x, y))
    return across + left, down + top - HEAD


async def shows(page: Page, view: View) -> list[float]:
    """Wait until a page shows a view as a whole; where its picture is."""
    name, (x, y, _) = next(iter(discs(view).items()))
    await holds(page, place(view, await box(page, "#picture"), x, y), name)
    return await box(page, "#picture")


@pytest.mark.browser
def test_a_network_that_is_wide_is_high_on_a_telephone_and_wide_again_when_that_is_turned(tmp_path: Path) -> None:
    async def main() -> None:
        async with opened(tmp_path, FAN) as (page, access, run):
            own = run.view
            await page.size(390, 844)
            await page.call("Page.navigate", url=access.url(owner=False))
            await page.until(f"{STEP} > 3")
            assert told(run.view) == "default", "who only looks on asks for nothing"
            await page.call("Page.navigate", url=access.url())
            await page.until(f"{STEP} > 3")
            while run.view is own:
                await asyncio.sleep(0.1)
            assert told(run.view) == "tall"
            picture = await shows(page, run.view)
            assert share_of(run.view, picture) >= 1.3 * share_of(own, picture)
            assert await page.ask("document.querySelector('#fitting').hidden")
            (tmp_path / "tall.png").write_bytes(await page.shot())
            await page.size(400, 860)
            await page.until("picture.clientWidth == 400")
            await page.ask("document.querySelector('#scrub').focus()")
            await page.size(1280, 800)
            await page.until("picture.clientWidth > 900")
            while told(run.view) != "default":
                await asyncio.sleep(0.1)
            assert run.view.layout is own.layout
            await shows(page, own)

    asyncio.run(asyncio.wait_for(main(), 240))


def test_who_asks_is_told_for_which_window_it_is_laid_out_where_nothing_changes(tmp_path: Path) -> None:
    with watched(tmp_path) as live:
        asked = json.loads(live.ask(Fit("default")))
        assert asked == {"type": "fitting", "window": None, "shown": "default"}
        assert live.fit("tall") == "tall"
        assert [one["shown"] for one in live.said if one["type"] == "fitting"] == ["default", "tall"]
        name = next(iter(live.desk.placed.layout.positions))
        live.desk.ask(PlaceNeuron(name, (30.0, 30.0), True), lambda _: None)
        assert json.loads(live.ask(Fit("wide"))) == {"type": "fitting", "window": None, "shown": "tall"}


def test_a_layout_that_nobody_wants_any_more_is_not_shown(tmp_path: Path) -> None:
    with watched(tmp_path) as live:
        own, shown = live.run.view, []
        for window in ("tall", "default"):
            live.desk.ask(Fit(window), lambda _: None)
        assert live.settled() == "default"
        shown.append(live.run.view)
        assert shown == [own]
        assert live.last("fitting") is None


@pytest.mark.browser
def test_a_page_that_connects_again_stays_as_it_is(tmp_path: Path) -> None:
    async def main() -> None:
        async with opened(tmp_path, FAN) as (page, access, run):
            await page.size(390, 844)
            await page.call("Page.addScriptToEvaluateOnNewDocument", source=SOCKETS)
            await page.call("Page.navigate", url=access.url())
            while told(run.view) != "tall":
                await asyncio.sleep(0.1)
            await shows(page, run.view)
            await page.ask("document.querySelector('#picture').focus()")
            await page.key("+")
            await page.until("location.hash.includes('view=') && location.hash.includes('window=tall')")
            link = str(await page.ask("location.href"))
            await page.call("Page.navigate", url="about:blank")
            await page.size(1280, 800)
            await page.call("Page.navigate", url=link)
            await page.until(f"{STEP} > 3 && location.hash.includes('view=') && location.hash.includes('window=tall')")
            assert told(run.view) == "tall"
            await page.ask("asked.length = 0; sockets.forEach((one) => one.close())")
            await page.until("sockets.length == 2 && asked.some((one) => one.includes('look'))", 30)
            await page.ask("new Promise((done) => setTimeout(done, 1000))")
            assert not await page.ask("asked.some((one) => one.includes('fit'))")
            assert await page.ask("location.hash.includes('view=') && location.hash.includes('window=tall')")

    asyncio.run(asyncio.wait_for(main(), 240))


#: Notes the sockets of a page and what it sends.
SOCKETS = """
window.sockets = []; window.asked = [];
window.WebSocket = class extends WebSocket {
  constructor(...of) { super(...of); sockets.push(this); }
  send(data) { if (typeof data === 'string') asked.push(data); super.send(data); }
};"""


@pytest.mark.browser
def test_a_link_shows_a_part_of_the_picture_in_the_layout_that_it_was_in(tmp_path: Path) -> None:
    async def main() -> None:
        async with opened(tmp_path, FAN) as (page, access, run):
            await page.size(390, 844)
            await page.call("Page.navigate", url=access.url())
            while told(run.view) != "tall":
                await asyncio.sleep(0.1)
            await shows(page, run.view)
            await page.ask("document.querySelector('#picture').focus()")
            for key in "++l":
                await page.key(key)
            await page.until("location.hash.includes('view=') && location.hash.includes('window=tall')")
            link = str(await page.ask("location.href"))
            await page.call("Page.navigate", url="about:blank")
            await page.size(1280, 800)
            await page.call("Page.navigate", url=access.url())
            while told(run.view) != "default":
                await asyncio.sleep(0.1)
            await page.until(f"{STEP} > 3")
            assert "view=" not in str(await page.ask("location.hash"))
            await page.call("Page.navigate", url="about:blank")
            await page.call("Page.navigate", url=link)
            while told(run.view) != "tall":
                await asyncio.sleep(0.1)
            wanted = link.partition("#")[2].partition("view=")[2].partition("&")[0]
            await page.until(f"location.hash.includes('view={wanted}') && location.hash.includes('window=tall')")

    asyncio.run(asyncio.wait_for(main(), 240))


#: A fan in a box, and how a page is told of it.
BOXED = FAN.replace("count: 12,", "count: 12, box: fan,")
BOX = "box:fan"
#: Whether the matrix is shown, of a network with a title.
MATRIX = (
    "document.querySelector('#matrix').ariaPressed == 'true' && picture.ariaLabel == '{}, the matrix of its weights'"
)


async def until_window(run: Run, window: str) -> None:
    """Wait until the network is laid out for a window."""
    while told(run.view) != window:
        await asyncio.sleep(0.05)


@pytest.mark.browser
def test_closed_boxes_and_the_matrix_stay_in_another_layout(tmp_path: Path) -> None:
    """Where the window is turned, and where the layout, or the network, was edited."""
    closing = "JSON.parse(asked.filter((one) => one.includes('\"close\"')).pop() ?? '{}').boxes?.join()"

    async def main() -> None:
        async with editable(tmp_path, BOXED) as (page, access, run, edits):

            async def edit(text: str) -> None:
                before = run.view
                (tmp_path / "x.yaml").write_text(text)
                await asyncio.to_thread(edits._edited)
                assert run.view is not before

            async def is_closed(window: str) -> None:
                await page.until(f"{closing} == '{BOX}'")
                await page.ask("new Promise((done) => setTimeout(done, 300))")
                assert (told(run.view), await page.ask(closing)) == (window, BOX)

            await page.size(390, 844)
            await page.call("Page.addScriptToEvaluateOnNewDocument", source=SOCKETS)
            await page.call("Page.navigate", url=access.url())
            await until_window(run, "tall")
            await page.until(f"{STEP} > 3")
            await page.ask("document.querySelector('#picture').focus()")
            await page.key("o")
            await page.ask("Object.assign(document.querySelector('#search'), {value: 'fan'}).oninput()")
            await page.until("document.querySelector('#found li')?.textContent.startsWith('fan')")
            await page.key("Enter")
            await page.key("Escape")
            await page.ask("document.querySelector('#picture').focus()")
            await page.key("Enter")
            await is_closed("tall")
            (tmp_path / "closed_tall.png").write_bytes(await page.shot())
            await page.ask("asked.length = 0")
            await page.size(1280, 800)
            await until_window(run, "default")
            await is_closed("default")
            (tmp_path / "closed_default.png").write_bytes(await page.shot())
            for text in (BOXED + DIRECTED, BOXED.replace("count: 12", "count: 14")):
                await page.ask("asked.length = 0")
                await edit(text)
                await is_closed("default")

            await page.key("m")
            await page.until(MATRIX.format("A fan"))
            await page.size(390, 844)
            await until_window(run, "tall")
            await page.ask("new Promise((done) => setTimeout(done, 500))")
            assert await page.ask(MATRIX.format("A fan"))
            await edit(BOXED.replace("A fan", "Another") + DIRECTED)
            await page.until(MATRIX.format("Another"))
            await page.ask("asked.length = 0")
            await page.key("m")
            await page.until("picture.ariaLabel == 'Another'")
            await is_closed("default")

    asyncio.run(asyncio.wait_for(main(), 240))


@pytest.mark.browser
def test_a_saved_view_is_seen_in_the_layout_that_it_was_saved_in(tmp_path: Path) -> None:
    view = "new URLSearchParams(location.hash.slice(1)).get('view')?.split(' ').map(Number)"

    async def main() -> None:
        async with opened(tmp_path, FAN) as (page, access, run):
            await page.size(390, 844)
            await page.call("Page.navigate", url=access.url())
            await until_window(run, "tall")
            await shows(page, run.view)
            await page.ask("document.querySelector('#picture').focus()")
            for key in "++l":
                await page.key(key)
            await page.until("location.hash.includes('view=') && location.hash.includes('window=tall')")
            await page.ask("new Promise((done) => setTimeout(done, 600))")
            wanted = await page.ask(view)
            assert isinstance(wanted, list)
            await page.ask("document.querySelector('#viewname').value = 'near'")
            await page.ask("document.querySelector('#keep').requestSubmit()")
            await page.until("document.querySelector('#views .go')?.textContent == 'near'")
            findings = Findings()
            saved = views_in(tmp_path / "x.neurovis-view.yaml", compiled().network, findings)["near"]
            assert saved.window == "tall"
            assert not findings.sorted()

            seen = f"location.hash.includes('window=tall') && {view}?.every("
            seen += f"(one, at) => Math.abs(one - {wanted}[at]) < 0.01 * {wanted}[at])"
            for begun in ("", "#saved=near"):
                await page.call("Page.navigate", url="about:blank")
                await page.size(1280, 800)
                await page.call("Page.navigate", url=access.url() + begun)
                if not begun:
                    await until_window(run, "default")
                    await page.until("document.querySelector('#views .go')?.textContent == 'near'")
                    await page.ask("new Promise((done) => setTimeout(done, 300))")
                    await page.ask("document.querySelector('#views .go').click()")
                await until_window(run, "tall")
                await page.until(seen)
                if not begun:
                    (tmp_path / "near.png").write_bytes(await page.shot())
                    await page.ask("document.querySelector('#undo').click()")
                    await until_window(run, "tall")
                    await page.until("!location.hash.includes('view=')")

            await page.call("Page.navigate", url="about:blank")
            await page.call("Page.navigate", url=access.url())
            await until_window(run, "default")
            await page.call("Page.navigate", url="about:blank")
            await page.call("Page.navigate", url=access.url(owner=False) + "#saved=near")
            await page.until(f"{STEP} > 3")
            await page.ask("new Promise((done) => setTimeout(done, 500))")
            assert told(run.view) == "default", "who only looks on asks for nothing"

    asyncio.run(asyncio.wait_for(main(), 240))
