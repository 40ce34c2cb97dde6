"""The body in the live page, in Chromium: the pose of the step that is shown, in a panel of its own."""

from __future__ import annotations

import asyncio
import io
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bodies_by_hand import hexapod, posed
from chromium import Page, chromium
from PIL import Image
from test_live_browser import STEP, pause
from test_live_everyone import violations
from toy_bodies import SKELETON, Cart, carted, registered

import neurovis_spec as nv
from neurovis_spec.body import Link, Solid
from neurovis_spec.live.access import Access
from neurovis_spec.live.commands import REQUESTS
from neurovis_spec.live.hub import Hub
from neurovis_spec.live.live import listen
from neurovis_spec.live.recorded import RecordedSource
from neurovis_spec.live.run import Run
from neurovis_spec.live.server import Server
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.live.source import Source
from neurovis_spec.live.view import view_of
from neurovis_spec.scene import THEMES, Theme, channels
from neurovis_spec.scene.body import mixed

pytestmark = pytest.mark.browser

NETWORK = nv.compile_text("""
neurovis: 1
name: walker
time: {dt: 0.05, steps: 60}
neurons: {C1: {initial: 0.2}, C2: {}}
connections: {C1 -> C1: 1.2, C2 -> C2: 1.2, C1 -> C2: -0.3, C2 -> C1: 0.3}
""")
RUN = NETWORK.run()
SOLIDS = (Solid((-9, -9, -1), (9, 9, 0)), Solid((0.4, -0.4, 0), (0.5, 0.3, 0.03)))


@asynccontextmanager
async def shown(
    source: Source, folder: Path, theme: str = "default", network: nv.CompiledNetwork = NETWORK
) -> AsyncIterator[Page]:
    """A live view of a source, paused at its first step."""
    hub = Hub(asyncio.get_running_loop(), REQUESTS)
    run = Run(source, view_of(network, network.gains, theme), hub.show, lambda: hub.watched)
    sock = listen("127.0.0.1", 0)
    access = Access("127.0.0.1", sock.getsockname()[1])
    server = Server(access, hub, run)
    await server.start(sock)
    run.start()
    try:
        async with chromium(folder) as opened:
            await opened.size(1000, 1000)
            await opened.call("Page.navigate", url=access.url())
            await opened.until(f"{STEP} >= 0")
            await pause(opened)
            await go(opened, 0)
            yield opened
            assert opened.errors == []
    finally:
        run.end()
        await server.stop()


def walked(turn: float = 0.0) -> RecordedSource:
    return RecordedSource(NETWORK.network, posed(RUN, *hexapod(len(RUN), turn, SOLIDS)))


async def said(opened: Page) -> str:
    """What the picture of the body is to whoever cannot see it."""
    return str(await opened.ask("document.querySelector('#posed').getAttribute('aria-label')"))


async def go(opened: Page, step: int) -> None:
    await opened.ask(f"document.querySelector('#scrub').value = {step}")
    await opened.ask("document.querySelector('#scrub').dispatchEvent(new Event('input', {bubbles: true}))")
    await opened.until(f"{STEP} == {step}")
    await opened.ask("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")


async def pixels(opened: Page) -> np.ndarray[tuple[int, ...], np.dtype[np.int64]]:
    """The panel as it is seen."""
    box = await opened.ask("(({x, y, width, height}) => [x, y, width, height])(posed.getBoundingClientRect())")
    assert isinstance(box, list)
    x, y, wide, high = (round(value) for value in box)
    picture = Image.open(io.BytesIO(await opened.shot())).convert("RGB").crop((x, y, x + wide, y + high))
    return np.asarray(picture, np.int64)


@pytest.mark.parametrize("theme", ["default", "dark"])
def test_the_pose_is_that_of_the_step_that_is_shown(tmp_path: Path, theme: str) -> None:
    async def look() -> None:
        async with shown(walked(), tmp_path, theme) as opened:
            assert await said(opened) == (
                "the body 0.00 m forward, 6 of 6 feet touching; from above, and from its right side"
            )
            first = await pixels(opened)
            await go(opened, 50)
            assert (await said(opened)).startswith("the body 0.30 m forward, 3 of 6 feet touching;")
            far = await pixels(opened)
            assert (np.abs(first - far).sum(axis=2) > 30).mean() > 0.02
            colours = THEMES[theme]
            filled = (far[:, : far.shape[1] // 2] == channels(colours.positive)).all(axis=2)
            torso = (far == channels(colours.zero)).all(axis=2)
            assert filled.sum() > 3 * 30
            assert torso.sum() > 2000
            await opened.ask("document.querySelector('#back').click()")
            await opened.until(f"{STEP} == 49")
            await go(opened, 0)
            assert (await pixels(opened) != first).mean() < 0.2  # it may have reached further by now

    asyncio.run(look())


def test_a_foot_that_touches_is_seen_where_another_of_its_leg_is_in_the_air(tmp_path: Path) -> None:
    skeleton, poses = hexapod(len(RUN), 0.0, SOLIDS)
    skeleton = replace(skeleton, feet=skeleton.feet * 2)
    source = RecordedSource(NETWORK.network, posed(RUN, skeleton, np.concatenate([poses, 0 * poses[:, -6:]], axis=1)))

    async def look() -> None:
        async with shown(source, tmp_path) as opened:
            assert (await said(opened)).startswith("the body 0.00 m forward, 6 of 12 feet touching;")
            seen = await pixels(opened)
            assert (seen == channels(THEMES["default"].positive)).all(axis=2).sum() > 6 * 30

    asyncio.run(look())


def test_a_box_covers_its_outline_and_the_way_so_far_is_seen_behind_it(tmp_path: Path) -> None:
    """A box of 30 by 10 by 4 cm, by its edges along the way; the colour of the way is no other's."""
    skeleton, poses = hexapod(len(RUN), 0.0)
    first, count = len(skeleton.points), 3 * len(skeleton.points)
    corners = np.array([[x, y, z] for y in (-0.05, 0.05) for z in (-0.02, 0.02) for x in (-0.15, 0.15)])
    at = (poses[:, None, :3] + corners).reshape(len(poses), -1)
    edges = tuple((first + number, first + number + 1) for number in range(0, 8, 2))
    box = replace(skeleton, points=(*skeleton.points, *"abcdefgh"), links=(Link(*edges[0], 0.0, edges[1:]),), feet=())
    source = RecordedSource(NETWORK.network, posed(RUN, box, np.concatenate([poses[:, :count], at], axis=1)))
    theme = THEMES["default"]

    async def look() -> None:
        async with shown(source, tmp_path) as opened:
            for step in range(0, 50, 7):
                await go(opened, step)
            seen = await pixels(opened)
            covered = (seen == channels(theme.zero)).all(axis=2)
            half = covered.shape[1] // 2
            above, beside = covered[:, :half], covered[:, half:]
            wide = [np.ptp(np.flatnonzero(one.any(axis=0))) for one in (above, beside)]
            assert wide[0] == pytest.approx(wide[1], abs=2)
            assert above.sum() == pytest.approx(wide[0] ** 2 / 3, rel=0.06)
            assert beside.sum() == pytest.approx(wide[1] ** 2 * 4 / 30, rel=0.08)
            trail = (np.abs(seen - channels(mixed(theme.positive, theme.box_fill, 0.55))).sum(axis=2) < 6)[:, :half]
            assert trail.sum() > 20
            assert np.flatnonzero(trail.any(axis=0)).max() <= np.flatnonzero(above.any(axis=0)).min() + 2

    asyncio.run(look())


def test_the_panel_closes_and_opens_and_is_read(tmp_path: Path) -> None:
    async def look() -> None:
        async with shown(walked(), tmp_path) as opened:
            closed, button = "document.querySelector('#embodied').hidden", "document.querySelector('#bodily')"
            assert await opened.ask(f"{closed} || {button}.hidden") is False
            await opened.key("y")
            assert await opened.ask(f"{closed} && {button}.getAttribute('aria-expanded') == 'false'") is True
            await opened.ask(f"{button}.click()")
            assert await opened.ask(closed) is False
            await opened.key("v")
            await opened.until("document.querySelector('#said').textContent.includes('the body 0.00 m forward')")

    asyncio.run(look())


SAVED = """
new Promise(done => {
  URL.createObjectURL = blob => {
    createImageBitmap(blob).then(picture => {
      const canvas = new OffscreenCanvas(picture.width, picture.height), context = canvas.getContext('2d');
      context.drawImage(picture, 0, 0);
      const rgb = [COLOUR], high = picture.height - BELOW;
      const { data } = context.getImageData(0, high, picture.width, BELOW);
      let count = 0;
      for (let at = 0; at < data.length; at += 4) count += rgb.every((value, channel) => data[at + channel] === value);
      done([picture.width, picture.height, count]);
    });
    return '#';
  };
  document.querySelector('#png').click();
})
"""


@pytest.mark.parametrize("bodied", [True, False])
def test_a_picture_that_is_saved_has_the_body_in_it(tmp_path: Path, bodied: bool) -> None:
    source = walked() if bodied else RecordedSource(NETWORK.network, RUN)

    async def look() -> None:
        async with shown(source, tmp_path) as opened:
            plan = view_of(NETWORK, NETWORK.gains).plan.frame
            colour = ",".join(str(value) for value in channels(THEMES["default"].zero))
            script = SAVED.replace("COLOUR", colour).replace("BELOW", str(round(260 * plan.density)))
            found = await opened.ask(script)
            assert isinstance(found, list)
            wide, high, count = found
            assert wide == round(plan.width * plan.density)
            assert high == round((plan.height + 260 * bodied) * plan.density)
            assert count > 2000 or not bodied

    asyncio.run(look())


def test_without_a_body_there_is_no_panel(tmp_path: Path) -> None:
    async def look() -> None:
        async with shown(RecordedSource(NETWORK.network, RUN), tmp_path) as opened:
            assert await opened.ask("embodied.hidden && bodily.hidden") is True
            await opened.key("y")
            assert await opened.ask("embodied.hidden") is True

    asyncio.run(look())


def test_of_a_pose_that_is_not_known_nothing_is_drawn(tmp_path: Path) -> None:
    skeleton, poses = hexapod(len(RUN))
    poses[20:] = np.nan

    async def look() -> None:
        async with shown(RecordedSource(NETWORK.network, posed(RUN, skeleton, poses)), tmp_path) as opened:
            await go(opened, 30)
            assert (await said(opened)).startswith("the body: its pose is not known;")
            torso = (await pixels(opened) == channels(THEMES["default"].zero)).all(axis=2)
            assert torso.sum() < 50

    asyncio.run(look())


@pytest.mark.parametrize("space", [False, True])
def test_joints_have_the_colours_of_what_moves_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, space: bool
) -> None:
    """Push, from -1 to 1, moves the cart: full colour at its ends. The two of the hand share its disc, each as large as
    it has been."""
    registered(monkeypatch)
    monkeypatch.setattr(Cart, "skeleton", replace(SKELETON, joints=(0, 1, 1), solids=()))
    network, theme = carted(), THEMES["default"]
    push, source = 0.8 * network.run(40)["O1"], SimulatedSource(network.simulator())
    for _ in range(39):
        source.advance()

    async def look() -> None:
        async with shown(source, tmp_path, network=network) as opened:
            if space:
                await opened.ask("spatial.click()")
            for step in (38, 25, 12):  # at step 39 the body is reset, and told nothing
                await go(opened, step)
                seen = await pixels(opened)
                assert (seen == channels(shade(theme, float(push[step])))).all(axis=2).sum() >= 12
            assert (seen == channels(theme.zero)).all(axis=2).sum() > 12, "the first of the hand is told nothing"

    asyncio.run(look())


def shade(theme: Theme, share: float) -> str:
    """The colour of a share of the activity."""
    return mixed(theme.negative if share < 0 else theme.positive, theme.zero, abs(share))


async def drawn(opened: Page) -> None:
    await opened.ask("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")


DRAG = """
for (const [type, x] of [['pointerdown', 100], ['pointermove', 160], ['pointerup', 160]])
  posed.dispatchEvent(new PointerEvent(type, {pointerId: 1, bubbles: true, clientX: x, movementX: x - 100}));
"""


async def feet_of_space(opened: Page, pose: np.ndarray[tuple[int, ...], np.dtype[np.float64]], least: int) -> None:
    """Feet that touch, but for those behind the torso, are where a projection says that is worked out here, from the
    angles that the page says."""
    view = await opened.ask("posed.dataset.view")
    assert isinstance(view, str)
    turned, up, scale, x, y, level = (float(value) for value in view.split())
    right = np.array([-np.sin(turned), np.cos(turned), 0])
    high = np.array([-np.sin(up) * np.cos(turned), -np.sin(up) * np.sin(turned), np.cos(up)])
    skeleton, _ = hexapod(len(RUN), 0.0, SOLIDS)
    points = pose[: 3 * len(skeleton.points)].reshape(-1, 3)[list(skeleton.feet)]
    away = points - [pose[3 * skeleton.middle], pose[3 * skeleton.middle + 1], level]
    spots = np.rint([x, y] + scale * np.stack([away @ right, -(away @ high)], axis=1)).astype(int)
    filled = (await pixels(opened) == channels(THEMES["default"].positive)).all(axis=2)
    seen = [filled[row - 2 : row + 3, column - 2 : column + 3].any() for column, row in spots.tolist()]
    touching = pose[-len(skeleton.feet) :] > 0.5
    assert not any(one and not down for one, down in zip(seen, touching, strict=True))
    assert sum(seen) >= least


def test_in_space_it_turns_by_dragging_and_by_keys_and_this_is_remembered(tmp_path: Path) -> None:
    _, poses = hexapod(len(RUN), 0.0, SOLIDS)

    async def look() -> None:
        async with shown(walked(), tmp_path) as opened:
            await opened.ask("spatial.click()")
            await drawn(opened)
            assert (await said(opened)).endswith("; in space; arrow keys turn it")
            await feet_of_space(opened, poses[0], 3)
            before = await opened.ask("posed.dataset.view")
            await opened.ask("posed.setPointerCapture = () => 0, posed.hasPointerCapture = () => true")
            await opened.ask(DRAG)
            await drawn(opened)
            dragged = await opened.ask("posed.dataset.view")
            assert dragged != before
            await feet_of_space(opened, poses[0], 2)
            await opened.ask("posed.focus()")
            await opened.key("ArrowUp")
            await drawn(opened)
            assert await opened.ask("posed.dataset.view") != dragged
            assert await opened.ask(STEP) == 0, "the key turns it and makes no step"
            assert await violations(opened) == []
            await opened.ask("posed.dispatchEvent(new MouseEvent('dblclick', {bubbles: true}))")
            await drawn(opened)
            assert (await said(opened)).endswith("; from above, and from its right side")
            assert await opened.ask("localStorage.getItem('neurovis.body')") == ""

    asyncio.run(look())


@pytest.mark.parametrize("theme", ["default", "dark"])
def test_axe_finds_nothing_where_the_body_is_shown(tmp_path: Path, theme: str) -> None:
    async def look() -> None:
        async with shown(walked(), tmp_path, theme) as opened:
            assert await violations(opened) == []

    asyncio.run(look())


@pytest.mark.parametrize(("wide", "high", "beside"), [(1200, 800, True), (500, 800, False), (390, 844, False)])
def test_the_panel_stands_where_there_is_room_for_it(tmp_path: Path, wide: int, high: int, beside: bool) -> None:
    async def look() -> None:
        async with shown(walked(), tmp_path) as opened:
            await opened.size(wide, high)
            boxes = "['#stage', '#embodied'].map(one => document.querySelector(one).getBoundingClientRect())"
            found = await opened.ask(f"{boxes}.map(({{x, y, width, height}}) => [x, y, width, height])")
            assert isinstance(found, list)
            (x0, y0, wide0, high0), (x1, y1, wide1, high1) = found
            assert (x1 >= x0 + wide0 - 1) == beside
            assert (y1 >= y0 + high0 - 1) != beside
            assert min(wide0, wide1) > 250
            assert min(high0, high1) > 150
            assert await opened.ask("document.documentElement.scrollWidth") == wide

    asyncio.run(look())
