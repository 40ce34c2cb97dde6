"""Debian's Chromium, headless, driven over its DevTools: pages are opened, asked, clicked and photographed."""

from __future__ import annotations

import asyncio
import base64
import json
import re
import shutil
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import aiohttp

ARGUMENTS = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking", "--no-first-run"),
    *("--disable-component-update", "--disable-sync", "--hide-scrollbars", "--remote-debugging-port=0"),
)


class Page:
    """A page; ``errors`` are all exceptions, and all that its console or its log calls an error or a warning."""

    def __init__(self, socket: aiohttp.ClientWebSocketResponse) -> None:
        self._socket = socket
        self._number = 0
        self._answers: dict[int, asyncio.Future[dict[str, object]]] = {}
        self.session = ""
        self.errors: list[str] = []
        self._reader = asyncio.create_task(self._read())

    async def _read(self) -> None:
        async for message in self._socket:
            found = json.loads(message.data)
            if found.get("id") in self._answers:
                self._answers.pop(found["id"]).set_result(found)
            told = found.get("params", {})
            match found.get("method"):
                case "Runtime.exceptionThrown":
                    self.errors.append(json.dumps(told["exceptionDetails"]))
                case "Runtime.consoleAPICalled" if told["type"] in ("error", "warning", "assert"):
                    self.errors.append(json.dumps(told["args"]))
                case "Log.entryAdded" if told["entry"]["level"] in ("error", "warning"):
                    self.errors.append(json.dumps(told["entry"]))

    async def call(self, method: str, **values: object) -> dict[str, object]:
        """A DevTools method; gives its result."""
        self._number += 1
        self._answers[self._number] = asyncio.get_running_loop().create_future()
        message = {"id": self._number, "method": method, "params": values}
        await self._socket.send_str(json.dumps(message | ({"sessionId": self.session} if self.session else {})))
        answer = await asyncio.wait_for(self._answers[self._number], 30)
        assert "error" not in answer, answer
        result = answer["result"]
        assert isinstance(result, dict)
        return result

    async def ask(self, script: str) -> object:
        """The value of an expression, or of what it promises."""
        answer = await self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in answer, answer
        result = answer["result"]
        assert isinstance(result, dict)
        return result.get("value")

    async def until(self, script: str, seconds: float = 15.0) -> None:
        """Wait until an expression is true."""
        for _ in range(int(seconds / 0.02)):
            if await self.ask(script):
                return
            await asyncio.sleep(0.02)
        raise AssertionError(f"never: {script}; {self.errors}")

    async def size(self, width: int, height: int, density: float = 1.0) -> None:
        """Have the window so large, and what stands in it arranged."""
        await self.call(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=density, mobile=False
        )
        await self.ask("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => done(0))))")

    async def key(self, name: str) -> None:
        """Press a key."""
        for kind in ("keyDown", "keyUp"):
            await self.call("Input.dispatchKeyEvent", type=kind, key=name)

    async def point(self, x: float, y: float) -> None:
        """Move the pointer."""
        await self.call("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)

    async def click(self, x: float, y: float) -> None:
        """Click with the left button."""
        await self.point(x, y)
        for kind in ("mousePressed", "mouseReleased"):
            await self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    async def shot(self) -> bytes:
        """A PNG of the window."""
        answer = await self.call("Page.captureScreenshot", format="png")
        return base64.b64decode(str(answer["data"]))


@asynccontextmanager
async def chromium(folder: Path, *arguments: str) -> AsyncIterator[Page]:
    """A page in a Chromium of its own, which ends with the block."""
    found = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    assert found, "these tests need chromium"
    process = await asyncio.create_subprocess_exec(
        *(found, *ARGUMENTS, *arguments, f"--user-data-dir={folder / 'user'}", "about:blank"),
        stdout=asyncio.subprocess.DEVNULL, stderr=asyncio.subprocess.PIPE,
    )  # fmt: skip
    assert process.stderr is not None
    try:
        while not (where := re.search(rb"DevTools listening on (ws://\S+)", await process.stderr.readline())):
            assert process.returncode is None
        async with (
            aiohttp.ClientSession() as session,
            session.ws_connect(where[1].decode(), max_msg_size=1 << 27) as socket,
        ):
            page = Page(socket)
            target = (await page.call("Target.createTarget", url="about:blank"))["targetId"]
            attached = await page.call("Target.attachToTarget", targetId=target, flatten=True)
            page.session = str(attached["sessionId"])
            for name in ("Page", "Runtime", "Log"):
                await page.call(f"{name}.enable")
            yield page
    finally:
        if process.returncode is None:
            process.terminate()
        await process.wait()
