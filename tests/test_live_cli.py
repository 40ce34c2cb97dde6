"""``neurovis live`` as a process: its URL, how it ends, what it refuses, and that it shows what is saved."""

from __future__ import annotations

import asyncio
import re
import signal
import socket
import sys
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import aiohttp
import pytest
from click.testing import CliRunner, Result
from test_live_server import Eyes

import neurovis_spec as nv
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.live.commands import REQUESTS
from neurovis_spec.live.view import FINENESS
from neurovis_spec.live.watch import Watch

SPEC = """neurovis: 1
name: x
time: {dt: 0.01, steps: 30}
neurons:
  A: {count: 2, activation: tanh, bias: 0.4}
  B: {activation: tanh}
connections:
  A -> B: {matrix: {file: weights.csv}, plasticity: {hebbian: {rate: 0.01}}}
render: {gain: {activity: 1, signal: 1, thickness: 4, change: 10}}
"""


@pytest.fixture
def spec(tmp_path: Path) -> Path:
    (tmp_path / "weights.csv").write_text("0.5\n-0.25\n")
    (tmp_path / "x.yaml").write_text(SPEC)
    return tmp_path / "x.yaml"


def invoke(*arguments: object) -> Result:
    return CliRunner().invoke(neurovis, ["live", *(str(argument) for argument in arguments)])


class Started:
    """A process, and the URL that it has printed."""

    def __init__(self, process: asyncio.subprocess.Process, url: str) -> None:
        self.process, self.url = process, url

    async def end(self, number: signal.Signals) -> tuple[int, str]:
        self.process.send_signal(number)
        _, told = await asyncio.wait_for(self.process.communicate(), 20)
        assert self.process.returncode is not None
        return self.process.returncode, told.decode()


@asynccontextmanager
async def started(*arguments: object) -> AsyncIterator[Started]:
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "neurovis_spec", "live", *(str(argument) for argument in arguments)),
        stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.PIPE,
    )  # fmt: skip
    assert process.stdout is not None
    try:
        line = await asyncio.wait_for(process.stdout.readline(), 60)
        yield Started(process, line.decode().strip())
    finally:
        if process.returncode is None:
            process.kill()
            await process.wait()


async def drained(stream: aiohttp.ClientWebSocketResponse) -> None:
    """All that is still sent."""
    while not stream.closed:
        await stream.receive(20)


@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_it_prints_its_url_and_ends_on_signals(spec: Path, number: signal.Signals, status: int) -> None:
    async def main() -> None:
        async with started(spec, "--viewers") as live, aiohttp.ClientSession() as session:
            assert re.fullmatch(r"http://127\.0\.0\.1:\d+/\?token=[\w-]{32}", live.url)
            async with session.get(live.url) as answer:
                assert answer.status == 200
            async with session.get(live.url.partition("?")[0]) as answer:
                assert answer.status == 403
            stream = await session.ws_connect(live.url.replace("/?", "/live?"))
            eyes = Eyes(stream)
            await eyes.until(lambda: eyes.step > 35)
            (found, told), _ = await asyncio.gather(live.end(number), drained(stream))
            assert found == status
            assert "Traceback" not in told
            viewers = re.search(r"viewers: (http\S+)", told)
            assert viewers is not None
            assert viewers[1] != live.url
            assert stream.close_code == aiohttp.WSCloseCode.GOING_AWAY

    asyncio.run(main())


def test_a_port_in_use_is_told(spec: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        result = invoke(spec, "--port", port)
    assert result.exit_code == 1
    assert result.stderr == f"error: port {port} of 127.0.0.1 is in use\nhelp: leave --port out for one that is free\n"


def test_without_aiohttp_the_extra_is_named(spec: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("neurovis_spec.cli.live.find_spec", lambda name: None)
    result = invoke(spec)
    assert result.exit_code == 1
    assert "neurovis-spec[live]" in result.stderr


def test_what_cannot_be_shown_is_answered_clearly(spec: Path) -> None:
    recording = spec.with_name("x.npz")
    nv.compile(spec).run_to(recording)
    for arguments, status, words in [
        ((spec, spec), 2, "live shows one network, and 2 specs are given"),
        (("-", "--watch"), 2, "standard input cannot be watched"),
        ((spec, "--recording", recording, "--from", recording), 2, "give one of them"),
        ((spec, "--only", "weights"), 2, "give one with --from"),
        ((recording, "--watch"), 2, "is a recording: SPEC is the spec that it was made of"),
        ((recording, "--recording", recording), 2, "is a recording: SPEC is the spec that it was made of"),
        ((recording,), 1, f"help: name it: neurovis live SPEC --recording {recording}"),
        ((spec, "--host", "nowhere.invalid"), 1, "cannot listen at nowhere.invalid"),
        ((spec, "--port", "70000"), 2, "70000"),
        ((spec.with_name("y.yaml"),), 1, "y.yaml"),
    ]:
        result = invoke(*arguments)
        assert result.exit_code == status, arguments
        assert words in result.stderr.replace("\n", " ") or words in result.stderr, (arguments, result.stderr)


@pytest.mark.parametrize("suffix", [".npz", ".mcap"])
def test_a_recording_is_played_to_its_end(spec: Path, suffix: str) -> None:
    recording = spec.with_name(f"x{suffix}")
    nv.compile(spec).run_to(recording)

    async def main() -> None:
        given = [recording] if suffix == ".mcap" else [spec, "--recording", recording]
        async with started(*given) as live, aiohttp.ClientSession() as session:
            eyes = Eyes(await session.ws_connect(live.url.replace("/?", "/live?")))
            await eyes.until(lambda: eyes.status.get("ended") is True and eyes.step == 29)
            assert eyes.status["playing"] is False
            assert eyes.status["can"] == {"takes": sorted(REQUESTS), "ends": True, "arrives": False}

    asyncio.run(main())


def test_it_begins_with_what_a_recording_has_learned(spec: Path) -> None:
    recording = spec.with_name("x.npz")
    nv.compile(spec).run_to(recording, 3000)

    async def main() -> None:
        async with started(spec, "--from", recording) as live, aiohttp.ClientSession() as session:
            eyes = Eyes(await session.ws_connect(live.url.replace("/?", "/live?")))
            await eyes.until(lambda: eyes.step >= 0)
            begun = 0.5 * 4 * FINENESS
            assert eyes.widths[0] > 1.5 * begun

    asyncio.run(main())


def test_a_saved_spec_and_its_data_are_shown_at_the_same_step_and_findings_told(spec: Path) -> None:
    async def main() -> None:
        async with started(spec, "--watch") as live, aiohttp.ClientSession() as session:
            eyes = Eyes(await session.ws_connect(live.url.replace("/?", "/live?")))
            await eyes.until(lambda: eyes.step > 20)
            await eyes.ask("pause")
            await eyes.until(lambda: eyes.status["playing"] is False)
            here, learned = eyes.step, eyes.widths.tolist()

            spec.write_text(SPEC.replace("  B: {", "  C: {}\n  B: {").replace("name: x", "name: x\ntitle: Edited"))
            await eyes.until(lambda: eyes.scene["title"] == "Edited" and len(eyes.discs) == 4)
            assert eyes.step == here
            assert eyes.widths.tolist() == learned

            spec.write_text(SPEC.replace("tanh", "tahn"))
            await eyes.until(lambda: eyes.told[-1]["type"] == "findings" and eyes.told[-1]["errors"])
            found = eyes.told[-1]["text"]
            assert f"{spec}:5:" in found
            assert "^" in found
            assert "tanh" in found.partition("help:")[2]
            await eyes.ask("step", by=1)
            await eyes.until(lambda: eyes.step == here + 1)

            late = Eyes(await session.ws_connect(live.url.replace("/?", "/live?")))
            await late.until(lambda: any(told["type"] == "findings" for told in late.told))
            assert [told["type"] for told in late.told].count("findings") == 1

            spec.write_text(SPEC)
            await eyes.until(lambda: eyes.scene["title"] == "x")
            spec.with_name("weights.csv").write_text("0.5\n")
            await eyes.until(lambda: eyes.told[-1]["type"] == "findings" and eyes.told[-1]["errors"])
            assert "weights.csv" in eyes.told[-1]["text"]

    asyncio.run(main())


def test_what_is_saved_while_it_is_read_is_read_again(tmp_path: Path) -> None:
    file = tmp_path / "x"
    file.write_text("1")
    read: list[str] = []

    def changed() -> list[Path]:
        read.append(file.read_text())
        if len(read) == 1:
            file.write_text("three")
        return [file]

    watch = Watch([file], changed)
    file.write_text("22")
    watch.start()
    for _ in range(100):
        if len(read) == 2:
            break
        time.sleep(0.05)
    watch.end()
    assert read == ["22", "three"]
