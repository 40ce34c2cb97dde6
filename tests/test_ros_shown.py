"""The page of what arrives: it says what it takes, and what it says is done."""

from __future__ import annotations

import asyncio
import io
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager
from typing import cast

import aiohttp
import numpy as np
import pytest
from test_live_server import Eyes

import neurovis_spec as nv
from neurovis_spec.live.commands import REQUESTS
from neurovis_spec.live.live import listen
from neurovis_spec.live.show import Show
from neurovis_spec.ros.middleware import Node
from neurovis_spec.ros.page import Page
from neurovis_spec.ros.received import ReceivedSource
from neurovis_spec.ros.steering import ViewSteering

COMPILED = nv.compile_text("""
neurovis: 1
name: far
parameters: {gain: {value: 0.5, min: 0, max: 2}}
inputs: {target: {}}
neurons: {A: {input: target, initial: 0}, B: {initial: 0}}
connections: {A -> B: gain, B -> A: {weight: 0.5, plasticity: {oja: {rate: 0.1}}}}
""")


class Elsewhere:
    """The node of the network."""

    def parameters_of(self, node: str, names: object) -> Mapping[str, float]:
        return {"gain": 0.5}

    def set_parameters_of(self, node: str, values: Mapping[str, float]) -> str | None:
        return None


@asynccontextmanager
async def seen(source: ReceivedSource, told: list[str]) -> AsyncIterator[Eyes]:
    """The page of a source, as a browser sees it."""
    page = Page(COMPILED, source, Show(), listen("127.0.0.1", 0), told.append)
    with page.served() as url:
        async with aiohttp.ClientSession() as session, asyncio.timeout(30):
            yield Eyes(await session.ws_connect(url.replace("/?", "/live?"), max_msg_size=1 << 24))


def test_a_view_elsewhere_says_that_it_takes_parameters_and_what_its_desk_does() -> None:
    source, told = ReceivedSource(COMPILED.network), list[str]()

    async def main() -> None:
        async with seen(source, told) as eyes:
            await eyes.until(lambda: bool(eyes.status))
            assert eyes.status["can"] == {"takes": sorted(REQUESTS), "ends": False, "arrives": True}
            steering = ViewSteering(COMPILED.network, cast(Node, Elsewhere()), "/neurovis/far")
            assert steering.look()
            source.steer(steering)
            source.hear_activity(0, 0, np.zeros(2))
            await eyes.until(lambda: eyes.status["can"]["takes"] == sorted({"set", *REQUESTS}))
            await eyes.ask("set", values={"gain": 1.5})
            await eyes.until(lambda: eyes.status["parameters"] == {"gain": 1.5})
            for kind, values in (("lesion", {"part": "A"}), ("branch", {})):
                eyes.told.clear()
                await eyes.ask(kind, **values)
                await eyes.until(lambda: any(one["type"] == "refused" for one in eyes.told))

    asyncio.run(main())
    assert told == []


@pytest.mark.parametrize("what", ["svg", "npz", "film"])
def test_what_arrived_is_saved_and_neurons_are_put_by_hand(what: str) -> None:
    source, told = ReceivedSource(COMPILED.network), list[str]()
    for step in (0, 1, 2, 5, 6):
        source.hear_activity(step, step, np.full(2, float(step)))
        source.hear_weights(step, np.array([0.5 + step]))

    async def main() -> None:
        async with seen(source, told) as eyes:
            await eyes.until(lambda: eyes.step == 6)
            await eyes.ask("fetch", what=what, seconds=5)
            data = b""
            while not data:
                message = await eyes.stream.receive(timeout=20)
                data = message.data if isinstance(message.data, bytes) and message.data[0] == 4 else b""
            content = data[4 + int.from_bytes(data[2:4], "little") :]
            if what == "npz":
                with np.load(io.BytesIO(content)) as found:
                    assert found["step"].tolist() == [0, 1, 2, 5, 6]
                    assert found["weights"][:, 0].tolist() == [0.5, 1.5, 2.5, 5.5, 6.5]
            else:
                assert b"<svg" in content
            await eyes.ask("place", neuron="A", at=[1, 9], done=True)
            await eyes.until(lambda: any(one["type"] == "placed" and one["neurons"] == ["A"] for one in eyes.told))

    asyncio.run(main())
    assert told == []


def test_what_a_source_raises_is_told_in_the_page_which_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    source, told = ReceivedSource(COMPILED.network), list[str]()

    async def main() -> None:
        async with seen(source, told) as eyes:
            await eyes.until(lambda: bool(eyes.status))
            with monkeypatch.context() as broken:
                broken.setattr(source, "seen", lambda: 1 / 0)
                source.hear_activity(0, 0, np.zeros(2))
                await eyes.until(lambda: any("division by zero" in str(one.get("reason")) for one in eyes.told))
            await eyes.ask("play")
            source.hear_activity(1, 1, np.zeros(2))
            await eyes.until(lambda: eyes.step == 1)

    asyncio.run(main())
    assert told == []
