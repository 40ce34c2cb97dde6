"""The server of the live view, over real sockets: who is refused, what broken messages do, that nobody is waited for.

Each intrusion that docs/live.md lists is made here.
"""

from __future__ import annotations

import asyncio
import gzip
import json
import random
import socket
import struct
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import dataclass, replace
from typing import Any

import aiohttp
import numpy as np
import pytest
from aiohttp import ClientWebSocketResponse, WSMsgType

import neurovis_spec as nv
from neurovis_spec.compilation import Compilation
from neurovis_spec.layout.model import Layout
from neurovis_spec.live.access import Access
from neurovis_spec.live.commands import REQUESTS, Appearance, Pause, Seek
from neurovis_spec.live.desk import Desk
from neurovis_spec.live.hub import AHEAD, Hub
from neurovis_spec.live.live import listen
from neurovis_spec.live.protocol import FILE, FRAME, HELD, LARGEST, MESSAGES, SCENE, TRACE
from neurovis_spec.live.run import Run, Stage
from neurovis_spec.live.server import BURST, MOST_CLIENTS, MOST_CONNECTIONS, Server
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.live.source import Source
from neurovis_spec.live.view import View, view_of
from neurovis_spec.themes import THEMES

COMPILED = nv.compile_text("""neurovis: 1
name: live
time: {dt: 0.01}
parameters: {pull: {value: 0.1, min: 0, max: 1}}
neurons:
  A: {count: 3, activation: tanh, bias: 0.4}
  B: {activation: tanh}
connections:
  A -> B: {weight: -0.5, plasticity: {hebbian: {rate: 0.01}}}
  B -> A: pull
render: {gain: {activity: 1, signal: 1, thickness: 4, change: 10}}
""")
VIEW = view_of(COMPILED, COMPILED.gains)


def draw(compiled: Compilation, appearance: Appearance, layout: Layout) -> View:
    return view_of(compiled, compiled.gains, appearance=appearance, layout=layout)


@dataclass
class Live:
    """A server of a run, and a session of a browser that knows nothing."""

    access: Access
    hub: Hub
    run: Run
    desk: Desk
    session: aiohttp.ClientSession

    @property
    def base(self) -> str:
        return f"http://127.0.0.1:{self.access.port}"

    async def get(self, path: str, method: str = "GET", **headers: str) -> tuple[int, Mapping[str, str], str]:
        async with self.session.request(method, f"{self.base}{path}", headers=headers) as answer:
            return answer.status, answer.headers, await answer.text()

    def stream(self, token: str, **headers: str) -> Any:
        return self.session.ws_connect(f"{self.base}/live?token={token}", headers=headers, max_msg_size=1 << 24)


@asynccontextmanager
async def serving(started: bool = True) -> AsyncIterator[Live]:
    hub, call = Hub(asyncio.get_running_loop(), REQUESTS), asyncio.get_running_loop().call_soon_threadsafe
    run = Run(SimulatedSource(COMPILED.simulator()), VIEW, hub.show, lambda: hub.watched)
    sock = listen("127.0.0.1", 0)
    access = Access("127.0.0.1", sock.getsockname()[1], viewers=True)
    desk = Desk(COMPILED, None, draw, run, lambda text: call(hub.tell, text, "placed"))
    server = Server(access, hub, run, desk)
    await server.start(sock)
    if started:
        run.start()
    desk.start()
    connector = aiohttp.TCPConnector(limit=0)
    async with aiohttp.ClientSession(connector=connector) as session:
        try:
            yield Live(access, hub, run, desk, session)
        finally:
            desk.end()
            run.end()
            await server.stop()
    assert run.failure is None


def served(test: Callable[[Live], Awaitable[None]], started: bool = True) -> None:
    """Run a test with a server, whose run the test starts where it is not ``started``."""

    async def main() -> None:
        async with serving(started) as live, asyncio.timeout(600):
            await test(live)

    asyncio.run(main())


class Eyes:
    """What a client sees: it takes frames over as the page does."""

    def __init__(self, stream: ClientWebSocketResponse) -> None:
        self.stream = stream
        self.scene: dict[str, Any] = {}
        self.status: dict[str, Any] = {}
        self.told: list[dict[str, Any]] = []
        self.step = -1
        self.serial = 0
        self.bytes = 0
        self.saved = ""
        self.held: dict[str, Any] = {}
        #: items (connections, then neurons) with the least and the largest value of each bin
        self.traces: dict[int, np.ndarray[Any, Any]] = {}

    async def look(self, acknowledge: bool = True, seconds: float = 120.0) -> int:
        """The kind of the next message: SCENE, FRAME, or 0 for a text."""
        message = await self.stream.receive(timeout=seconds)
        assert message.type in (WSMsgType.TEXT, WSMsgType.BINARY), message
        if message.type is WSMsgType.TEXT:
            told = json.loads(message.data)
            self.told.append(told)
            self.status = told if told["type"] == "status" else self.status
            return 0
        data = message.data
        self.bytes = len(data)
        if data[0] == SCENE:
            self.scene = json.loads(gzip.decompress(data[4:]))
            lines, discs = self.scene["lines"], self.scene["discs"]
            self.widths, self.kinds = np.zeros(lines, np.uint16), np.zeros(lines + discs, np.uint8)
            return SCENE
        if data[0] == FILE:
            self.saved = data[4 + struct.unpack_from("<H", data, 2)[0] :].decode()
            return FILE
        if data[0] == HELD:
            self.held = json.loads(gzip.decompress(data[4:]))
            return HELD
        if data[0] == TRACE:
            _, _, count, _, _, bins = struct.unpack_from("<BxHIdII", data)
            items, names = np.frombuffer(data, "<u4", 2 * count, 24).reshape(2, count)
            assert not names.any(), "nothing in this network has one"
            ranges = np.frombuffer(data, "<f4", 2 * bins * count, 24 + 8 * count).reshape(count, bins, 2)
            self.traces = dict(zip(items.tolist(), ranges, strict=True))
            return TRACE
        _, _, self.serial, changed, step, self.first, self.last, words = struct.unpack_from("<BxHIIdddH", data)
        self.step = int(step)
        items = np.frombuffer(data, "<u4", changed, 40)
        kinds = np.frombuffer(data, np.uint8, changed, 40 + 8 * changed)
        lines = len(self.widths)
        self.kinds[items] = kinds
        self.widths[items[items < lines]] = np.frombuffer(data, "<u2", changed, 40 + 4 * changed)[items < lines]
        self.discs = np.frombuffer(data, np.int8, len(self.kinds) - lines, 40 + 9 * changed)
        self.caption = data[len(data) - words :].decode()
        if acknowledge:
            await self.stream.send_bytes(struct.pack("<I", self.serial))
        return FRAME

    async def until(self, true: Callable[[], bool]) -> None:
        while not true():
            await self.look()

    async def ask(self, kind: str, **values: object) -> None:
        await self.stream.send_json({"type": kind, **values})


# --- who is refused


def test_without_the_token_every_path_and_method_is_refused() -> None:
    async def test(live: Live) -> None:
        for token in (
            "",
            "?token=",
            "?token=x",
            f"?token={live.access.owner[:-1]}",
            f"?token={'x' * 5000}",
            "?token=%00ä",
        ):
            for path in ("/", "/live", "/page.html", "/../../etc/passwd", "/%2e%2e/x", "//evil", "/favicon.ico"):
                status, headers, text = await live.get(path + token)
                assert status == 403, (path, token, text)
                assert "default-src 'none'" in headers["Content-Security-Policy"]
                assert live.access.owner not in text
        for method in ("POST", "PUT", "DELETE", "OPTIONS", "TRACE"):
            assert (await live.get("/", method))[0] == 403
        assert (await live.get("/", "BREW"))[0] == 400

    served(test)


def test_with_it_other_paths_and_methods_are_refused() -> None:
    async def test(live: Live) -> None:
        token = f"?token={live.access.owner}"
        for path in ("/page.html", "/live/", "/etc/passwd", "/%2e%2e/x", "/index.html"):
            assert (await live.get(path + token))[0] == 404
        for method in ("POST", "PUT", "DELETE", "OPTIONS", "HEAD", "PATCH"):
            status, headers, _ = await live.get("/" + token, method)
            assert (status, headers["Allow"]) == (405, "GET")
        assert (await live.get("/live" + token))[0] == 426

    served(test)


def test_the_page_carries_a_strict_policy_and_may_only_run_its_own_script() -> None:
    async def test(live: Live) -> None:
        status, headers, text = await live.get(f"/?token={live.access.owner}")
        assert status == 200
        assert text.startswith("<!doctype html>")
        policy = headers["Content-Security-Policy"]
        assert "unsafe" not in policy
        for part in ("default-src 'none'", "script-src 'sha256-", "style-src 'sha256-", "frame-ancestors 'none'"):
            assert part in policy
        assert headers["X-Content-Type-Options"] == "nosniff"
        assert headers["Referrer-Policy"] == "no-referrer"
        assert headers["Cache-Control"] == "no-store"
        assert headers["Server"] == "neurovis"
        assert headers["Content-Encoding"] in ("deflate", "gzip")

    served(test)


@pytest.mark.parametrize(
    "host",
    ["evil.example", "evil.example:{port}", "127.0.0.1", "127.0.0.1:1", "127.0.0.1.evil.example:{port}", "[::1", ""],
)
def test_a_foreign_host_is_refused(host: str) -> None:
    async def test(live: Live) -> None:
        token = f"?token={live.access.owner}"
        status, _, _ = await live.get("/" + token, Host=host.format(port=live.access.port))
        assert status in (400, 403)

    served(test)


@pytest.mark.parametrize(
    "origin",
    ["http://evil.example", "https://127.0.0.1:{port}", "http://127.0.0.1:1", "null", "http://localhost:{port}", ""],
)
def test_a_foreign_origin_is_refused(origin: str) -> None:
    async def test(live: Live) -> None:
        token = f"?token={live.access.owner}"
        origin_ = origin.format(port=live.access.port)
        assert (await live.get("/" + token, Origin=origin_))[0] == 403
        with pytest.raises(aiohttp.WSServerHandshakeError) as refused:
            async with live.stream(live.access.owner, Origin=origin_):
                pass
        assert refused.value.status == 403

    served(test)


def test_our_own_origin_and_localhost_are_let_in() -> None:
    async def test(live: Live) -> None:
        async with live.stream(live.access.owner, Origin=live.base) as stream:
            assert await Eyes(stream).look() in (0, SCENE)
        host = f"localhost:{live.access.port}"
        assert (await live.get(f"/?token={live.access.owner}", Host=host, Origin=f"http://{host}"))[0] == 200

    served(test)


def test_without_viewers_there_is_one_token() -> None:
    access = Access("127.0.0.1", 80)
    assert access.of(access.owner) is True
    assert access.of(access.viewer) is None
    assert access.of(None) is None
    open_to_all = Access("0.0.0.0", 8000)
    assert open_to_all.url().startswith("http://127.0.0.1:8000/?token=")
    token = open_to_all.owner
    assert open_to_all.refusal("GET", "/", "192.168.1.7:8000", None, token) is None
    assert open_to_all.refusal("GET", "/", "evil.example:8000", None, token) is not None


# --- what is seen and asked


def test_a_client_sees_the_scene_the_status_and_frames() -> None:
    async def test(live: Live) -> None:
        async with live.stream(live.access.owner) as stream:
            eyes = Eyes(stream)
            await eyes.until(lambda: eyes.step > 5)
            assert [group["data"] for group in eyes.scene["groups"] if group["id"] == "n3"] == [{"neuron": "B"}]
            assert eyes.status["owner"] is True
            assert eyes.status["parameters"] == {"pull": 0.1}
            await eyes.ask("pause")
            await eyes.until(lambda: not eyes.status["playing"])
            await eyes.ask("seek", step=3)
            await eyes.until(lambda: eyes.step == 3)
            assert eyes.caption == "step 3 · 0.03 s"
            recording = COMPILED.run(steps=4)
            assert (np.abs(eyes.discs / 127 - np.clip(recording.activity[3], -1, 1)) < 0.005).all()
            await eyes.ask("lesion", part="B")
            await eyes.until(lambda: bool(eyes.status["turned"]))
            await eyes.until(lambda: eyes.kinds[-1] == 2)
            lesioned = {"step": 3, "type": "lesion", "part": "B", "number": 0, "back": {"type": "mend", "part": "B"}}
            assert eyes.status["turned"] == [lesioned]
            await eyes.ask("set", values={"pull": 7.0})
            await eyes.until(lambda: eyes.told[-1]["type"] == "refused")
            assert "pull" in eyes.told[-1]["reason"]
            await eyes.ask("play")
            await eyes.until(lambda: eyes.step > 20)

    served(test)


@pytest.mark.parametrize("owner", [True, False])
def test_whoever_looks_at_something_is_told_its_exact_values(owner: bool) -> None:
    recording = COMPILED.run(steps=400)

    async def test(live: Live) -> None:
        async with live.stream(live.access.owner if owner else live.access.viewer) as stream:
            eyes = Eyes(stream)
            await eyes.until(lambda: eyes.step > 2)
            await eyes.ask("look", items=["n3", "c0", "c999999"])
            await eyes.until(lambda: [told["type"] for told in eyes.told].count("values") > 4)
            for told in (told for told in eyes.told if told["type"] == "values"):
                step = told["step"]
                assert told["values"] == {"n3": recording.activity[step, 3], "c0": recording.weights[step, 0]}
            live.run.ask(Seek(300))
            await eyes.until(lambda: eyes.step == 300)
            await eyes.ask("look", items=["n0"])
            await eyes.until(lambda: eyes.told[-1].get("values", {}).keys() == {"n0"})
            assert eyes.told[-1]["step"] == 300

    served(test)


@pytest.mark.parametrize("owner", [True, False])
def test_whoever_asks_for_traces_is_sent_them_once(owner: bool) -> None:
    recording = COMPILED.run(steps=60)

    async def test(live: Live) -> None:
        async with live.stream(live.access.owner if owner else live.access.viewer) as stream:
            eyes = Eyes(stream)
            await eyes.until(lambda: eyes.step >= 60)
            await eyes.ask("trace", items=["n3", "c0", "c99", "c0.trace"], first=10, every=5, bins=8)
            await eyes.until(lambda: bool(eyes.traces))
            assert set(eyes.traces) == {6 + 3, 0}
            rows = recording.activity[10:50, 3].reshape(8, 5)
            assert np.allclose(eyes.traces[9], np.transpose([rows.min(axis=1), rows.max(axis=1)]), rtol=1e-6)
            assert np.allclose(eyes.traces[0][:, 0], recording.weights[10:50, 0].reshape(8, 5).min(axis=1), rtol=1e-6)
            eyes.traces = {}
            here = eyes.step
            await eyes.until(lambda: eyes.step > here + 10)
            assert not eyes.traces

    served(test)


def test_many_who_ask_for_traces_are_answered_in_turn_and_cost_the_run_little() -> None:
    """Whoever asks again before there was an answer does not wait twice, and none is forgotten."""

    async def test(live: Live) -> None:
        async with AsyncExitStack() as stack:
            crowd = [Eyes(await stack.enter_async_context(live.stream(live.access.viewer))) for _ in range(20)]
            for _ in range(3):
                for eyes in crowd:
                    await eyes.ask("trace", items=["n0", "n1", "n2", "n3"], first=0, every=1, bins=2048)
            for eyes in crowd:
                await eyes.until(lambda eyes=eyes: len(eyes.traces) == 4)  # type: ignore[misc]
            here = crowd[0].step
            await crowd[0].until(lambda: crowd[0].step > here + 20)

    served(test)


def test_whoever_asks_before_there_is_a_picture_is_answered_when_there_is_one() -> None:
    async def test(live: Live) -> None:
        async with live.stream(live.access.viewer) as stream, live.stream(live.access.viewer) as other:
            both = [Eyes(one) for one in (stream, other)]
            for eyes in both:
                await eyes.ask("trace", items=["n0"], first=0, every=1, bins=8)
                await eyes.ask("connections", of="n0")
                await eyes.ask("pause")
                await eyes.until(lambda eyes=eyes: "refused" in [told["type"] for told in eyes.told])  # type: ignore[misc]
            live.run.start()
            for eyes in both:
                await eyes.until(lambda eyes=eyes: bool(eyes.traces and eyes.held))  # type: ignore[misc]

    served(test, started=False)


def test_one_who_comes_while_it_stands_still_sees_the_same() -> None:
    async def seen(live: Live, token: str) -> tuple[list[int], ...]:
        async with live.stream(token) as stream:
            eyes = Eyes(stream)
            await eyes.until(lambda: eyes.step == 300)
            return eyes.widths.tolist(), eyes.kinds.tolist(), eyes.discs.tolist()

    async def test(live: Live) -> None:
        live.run.ask(Seek(300))
        assert await seen(live, live.access.owner) == await seen(live, live.access.viewer)

    served(test)


def test_a_viewer_looks_on_and_can_ask_for_nothing() -> None:
    async def test(live: Live) -> None:
        async with live.stream(live.access.viewer) as stream:
            eyes = Eyes(stream)
            await eyes.until(lambda: eyes.step > 2)
            assert eyes.status["owner"] is False
            for kind in ("pause", "restart", "branch"):
                await eyes.ask(kind)
                await eyes.until(lambda: eyes.told[-1]["type"] == "refused")
                eyes.told.append({"type": ""})
            await eyes.ask("place", neuron="B", at=[3, 3], done=True)
            await eyes.ask("save", into="spec")
            await eyes.ask("write")
            await eyes.ask("lesion", part="B")
            here = eyes.step
            await eyes.until(lambda: eyes.step > here + 5)
            assert eyes.status["turned"] == []
            assert eyes.status["playing"]
            assert live.desk.placed.moved == ()
            assert not any(told["type"] in ("moved", "saving") for told in eyes.told)

    served(test)


def test_each_sees_the_picture_in_a_theme_of_their_own() -> None:
    """Frames are the same for all; a saved picture has the theme of who saves it; what cannot be drawn stays."""
    asked = []

    def dress(theme: str) -> View:
        asked.append(theme)
        if theme == "print":
            raise ValueError("an engine has failed")
        return VIEW.dress(theme)

    async def test(live: Live) -> None:
        def change(source: Source) -> Stage:
            return source, replace(VIEW, dress=dress)

        live.run.change(change)
        async with live.stream(live.access.owner) as stream, live.stream(live.access.viewer) as other:
            owner, viewer = Eyes(stream), Eyes(other)
            await owner.until(lambda: owner.step > 2)
            scene = owner.scene
            for wants in ({"name": "", "dark": True}, {"name": "dark", "dark": False}):
                await viewer.ask("theme", **wants)
                await viewer.until(lambda: viewer.scene.get("theme", {}).get("name") == "dark")
            assert viewer.scene["groups"] != scene["groups"]
            assert [group["id"] for group in viewer.scene["groups"]] == [group["id"] for group in scene["groups"]]
            await owner.ask("pause")
            await owner.ask("seek", step=2)  # to which both come, wherever each was when it stood still
            await owner.until(lambda: owner.step == 2)
            # a scene anew has nothing until its first frame
            await viewer.until(lambda: viewer.step == owner.step and bool((viewer.kinds == owner.kinds).all()))
            assert owner.scene == scene
            assert viewer.discs.tolist() == owner.discs.tolist()
            await owner.ask("theme", name="dark", dark=False)
            await owner.until(lambda: bool(owner.scene == viewer.scene))
            assert asked == ["dark"], "it is made once for all"
            await owner.ask("fetch", what="svg", seconds=1)
            await owner.until(lambda: owner.saved != "")
            assert THEMES["dark"].background in owner.saved
            await owner.ask("theme", name="print", dark=False)
            await owner.until(lambda: bool(owner.scene == scene))
            await owner.ask("theme", name="", dark=False)
            await owner.ask("step", by=1)
            await owner.until(lambda: owner.step == viewer.step + 1)

    served(test)


def test_an_owner_puts_neurons_by_hand_and_everybody_is_told() -> None:
    async def test(live: Live) -> None:
        async with live.stream(live.access.owner) as stream, live.stream(live.access.viewer) as other:
            eyes, witness = Eyes(stream), Eyes(other)
            await eyes.until(lambda: eyes.step > 2)
            before = eyes.scene["groups"]

            def told(of: Eyes, kind: str) -> dict[str, Any]:
                return next((entry for entry in reversed(of.told) if entry["type"] == kind), {})

            await eyes.ask("place", neuron="B", at=[4, 3], done=False)
            await eyes.until(lambda: bool(told(eyes, "moved")))
            assert set(told(eyes, "moved")["discs"]) == {"n3"}
            assert set(told(eyes, "moved")["lines"]) == {f"c{index}" for index in range(6)}
            assert eyes.scene["groups"] == before
            await eyes.ask("place", neuron="B", at=[4, 3], done=True)
            await eyes.until(lambda: eyes.scene["groups"] != before)
            await witness.until(lambda: told(witness, "placed").get("neurons") == ["B"])
            assert live.desk.placed.layout.positions["B"] == (4, 3)
            await eyes.ask("save", into="spec")
            await eyes.until(lambda: told(eyes, "refused").get("reason") == "there is no file to save to")
            await eyes.ask("place", neuron="X", at=[4, 3], done=True)
            await eyes.until(lambda: "no neuron 'X'" in told(eyes, "refused")["reason"])
            await eyes.ask("write")
            await eyes.ask("unplace")
            await eyes.until(lambda: eyes.scene["groups"] == before)
            await witness.until(lambda: told(witness, "placed")["neurons"] == [])
            await eyes.ask("unplace")
            await eyes.until(lambda: told(eyes, "refused")["reason"] == "nothing was put by hand")

    served(test)


DRAW = {"type": "draw", "activity": 1, "signal": 1, "thickness": 1, "change": 1}
#: What no page of ours sends: no JSON, of another shape, out of range.
BROKEN: list[str | bytes] = [
    *("", "x", "{", "[]", "null", "1", "{}", '{"type": 1}', '{"type": "eval"}', '{"type": ["play"]}', "[" * 5000),
    *('{"type": "play", "more": 1}', '{"type": "step"}', '{"type": "step", "by": 1.5}', '{"type": "step", "by": true}'),
    *('{"type": "step", "by": 65}', '{"type": "seek", "step": -1}', '{"type": "seek", "step": 9007199254740992}'),
    *('{"type": "seek", "step": 1e400}', '{"type": "seek", "step": NaN}', '{"type": "speed", "value": 1e9}'),
    *('{"type": "speed", "value": "fast"}', '{"type": "set", "values": {}}', '{"type": "lesion", "part": 3}'),
    *('{"type": "set", "values": {"pull": "x"}}', '{"type": "set", "values": {"pull": Infinity}}'),
    *('{"type": "set", "values": {"": 1}}', '{"type": "hold", "neurons": "B"}'),
    *('{"type": "hold", "neurons": "B", "value": null}', '{"type": "feed", "name": "x", "values": 3}'),
    *(json.dumps({"type": "lesion", "part": "x" * 5000}), '{"type": "learn", "connections": "A -> B", "on": 1}'),
    *('{"type": "look", "items": "n1"}', '{"type": "look", "items": ["x1"]}', '{"type": "look", "items": ["n1", 2]}'),
    *(json.dumps({"type": "look", "items": ["n1"] * 65}), '{"type": "look", "items": ["n-1"]}'),
    *('{"type": "theme", "name": "x", "dark": true}', '{"type": "theme", "name": "dark"}'),
    *('{"type": "theme", "name": null, "dark": true}', '{"type": "theme", "name": "", "dark": 1}'),
    *(json.dumps(DRAW | {"theme": "dark"}), json.dumps(DRAW | {"signal": 0}), json.dumps(DRAW | {"change": 65})),
    *(json.dumps(DRAW | {"activity": True}), '{"type": "draw"}', json.dumps(DRAW | {"pathways": 1})),
    *('{"type": "set", "values": {"pull": 1}, "moving": 1}', '{"type": "lesion", "part": "B", "moving": true}'),
    *(
        json.dumps({"type": "trace", "items": ["n1"], "first": 0, "every": 1, "bins": 9} | wrong)
        for wrong in (
            *({"first": -1}, {"every": 0}, {"bins": 0}, {"bins": 1 << 20}, {"every": 1 << 60}, {"items": ["n"]}),
            *({"items": [f"n{index}" for index in range(25)]}, {"first": 0.5}, {"more": 1}),
        )
    ),
    *('{"type": "place", "neuron": "B", "at": [0, 0]}', '{"type": "place", "neuron": "B", "at": [0], "done": true}'),
    *('{"type": "place", "neuron": "B", "at": [0, 1e9], "done": true}', '{"type": "save", "into": "/etc/passwd"}'),
    *('{"type": "fetch", "what": "exe", "seconds": 5}', '{"type": "fetch", "what": "svg", "seconds": 61}'),
    *('{"type": "place", "neuron": "B", "at": "00", "done": true}', '{"type": "write", "path": "x"}'),
    *(b"", b"\x00", b"\x00" * 5, b"\x00" * 1000, '{"type": "pl\x00ay"}', '{"type": "step", "by": ' + "9" * 5000 + "}"),
]


def test_a_broken_message_ends_its_connection_and_nothing_else() -> None:
    async def test(live: Live) -> None:
        async with live.stream(live.access.viewer) as witness:
            eyes = Eyes(witness)
            for broken in BROKEN:
                async with live.stream(live.access.owner) as stream:
                    await (stream.send_bytes(broken) if isinstance(broken, bytes) else stream.send_str(broken))
                    async for _ in stream:
                        pass
                    assert stream.close_code == aiohttp.WSCloseCode.POLICY_VIOLATION, broken
            here = eyes.step
            await eyes.until(lambda: eyes.step > here + 2)
            assert eyes.status["turned"] == []

    served(test)


def test_random_messages_do_no_harm() -> None:
    draw = random.Random(3)
    values = [None, True, -1, 0.5, 10**30, "B", "A -> B", "-> ->", "\ud83d", [], [1], {}, {"pull": 0.2}, "1"]

    async def test(live: Live) -> None:
        for _ in range(60):
            async with live.stream(live.access.owner) as stream:
                keys = (
                    "by",
                    "step",
                    "value",
                    "values",
                    "part",
                    "neurons",
                    "connections",
                    "on",
                    "name",
                    "at",
                    "done",
                    "neuron",
                    "into",
                )
                for _ in range(5):
                    message = {key: draw.choice(values) for key in draw.sample(keys, draw.randint(0, 2))}
                    if not stream.closed:
                        await stream.send_json({"type": draw.choice(MESSAGES), **message})
        async with live.stream(live.access.owner) as stream:
            eyes = Eyes(stream)
            await eyes.ask("restart")
            await eyes.ask("play")
            await eyes.until(lambda: eyes.step > 2)

    served(test)


def test_a_huge_message_and_a_flood_end_their_connection() -> None:
    async def test(live: Live) -> None:
        async with live.stream(live.access.owner) as stream:
            await stream.send_str(" " * (LARGEST + 1))
            async for _ in stream:
                pass
            assert stream.close_code == aiohttp.WSCloseCode.MESSAGE_TOO_BIG
        async with live.stream(live.access.owner) as stream:
            for _ in range(2 * BURST):
                if not stream.closed:
                    await stream.send_str('{"type":"pause"}')
            async for _ in stream:
                pass
            assert stream.close_code == aiohttp.WSCloseCode.POLICY_VIOLATION

    served(test)


def test_names_as_frames_and_compressed_bombs_are_no_way_in() -> None:
    """A client that asks for compression is not given it, so nothing that it sends can grow."""

    async def test(live: Live) -> None:
        async with live.session.ws_connect(f"{live.base}/live?token={live.access.owner}", compress=15) as stream:
            assert not stream.compress

    served(test)


# --- nobody is waited for


def test_a_stalled_client_is_sent_no_more_and_costs_nobody_anything() -> None:
    async def test(live: Live) -> None:
        async with live.stream(live.access.viewer) as stalled, live.stream(live.access.owner) as stream:
            sleeper, eyes = Eyes(stalled), Eyes(stream)
            await eyes.until(lambda: eyes.step > 150)
            frames = 0
            try:
                while True:
                    frames += await sleeper.look(acknowledge=False, seconds=0.3) == FRAME
            except TimeoutError:
                assert frames == AHEAD
            await eyes.ask("lesion", part="A1")
            await eyes.until(lambda: bool(eyes.status["turned"]))
            here = eyes.step
            await stalled.send_bytes(struct.pack("<I", sleeper.serial))
            await sleeper.until(lambda: sleeper.step > here)
            assert sleeper.kinds[6] == 2, "what has changed meanwhile comes with the next frame"

    served(test)


def test_a_client_that_never_reads_does_not_hold_up_the_run() -> None:
    async def test(live: Live) -> None:
        deaf = socket.create_connection(("127.0.0.1", live.access.port))
        deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1024)
        deaf.sendall(
            f"GET /live?token={live.access.owner} HTTP/1.1\r\nHost: 127.0.0.1:{live.access.port}\r\n"
            "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
            "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n".encode()
        )
        async with live.stream(live.access.viewer) as stream:
            eyes = Eyes(stream)
            await eyes.until(lambda: eyes.step >= 0)
            here = eyes.step
            await eyes.until(lambda: eyes.step > here + 100)
        deaf.close()

    served(test)


def test_a_hundred_viewers_see_the_same_and_more_than_there_may_be_are_refused() -> None:
    async def test(live: Live) -> None:
        streams = []
        for _ in range(MOST_CLIENTS):
            streams.append(await live.stream(live.access.viewer))
        with pytest.raises(aiohttp.WSServerHandshakeError) as refused:
            await live.stream(live.access.owner)
        assert refused.value.status == 503
        live.run.ask(Pause())
        live.run.ask(Seek(7))
        everybody = [Eyes(stream) for stream in streams]
        await asyncio.gather(*(eyes.until(lambda eyes=eyes: eyes.step == 7) for eyes in everybody))  # type: ignore[misc]
        assert len({eyes.discs.tobytes() for eyes in everybody}) == 1
        await asyncio.gather(*(stream.close() for stream in streams))

    served(test)


def test_a_thousand_connections_that_ask_nothing_leave_room_and_go() -> None:
    async def test(live: Live) -> None:
        async with live.stream(live.access.owner) as stream:
            eyes = Eyes(stream)
            await eyes.until(lambda: eyes.step >= 0)
            opened = []
            for _ in range(1000):
                opened.append(await asyncio.open_connection("127.0.0.1", live.access.port))
            await asyncio.sleep(0.1)
            closed = [reader.at_eof() for reader, _ in opened]
            assert sum(closed) >= 1000 - MOST_CONNECTIONS
            here = eyes.step
            await eyes.until(lambda: eyes.step > here + 5)
            for _, writer in opened:
                writer.close()

    served(test)


def test_a_connection_that_asks_for_nothing_is_closed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("neurovis_spec.live.server.ASKING", 0.1)

    async def test(live: Live) -> None:
        reader, writer = await asyncio.open_connection("127.0.0.1", live.access.port)
        writer.write(b"GET / HTTP/1.1\r\nX-Slow: ")
        begun = time.monotonic()
        with pytest.raises((ConnectionError, asyncio.IncompleteReadError)):
            await reader.readexactly(1)
        assert time.monotonic() > begun

    served(test)
