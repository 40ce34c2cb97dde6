"""The gallery: what it lists, that nothing else can be asked of it, and that a click opens a network that runs."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import aiohttp
import pytest
from chromium import chromium
from click.testing import CliRunner
from test_live_browser import STEP
from test_live_server import Eyes

from neurovis_spec import user_cache
from neurovis_spec.cli import gallery as commands
from neurovis_spec.cli import new
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.live import listing, rooms
from neurovis_spec.live.access import PAGE, PICTURE, STREAM, Access
from neurovis_spec.live.gallery import Gallery, page_of
from neurovis_spec.live.listing import Listed, specs_in
from neurovis_spec.live.live import listen
from neurovis_spec.live.show import Show
from neurovis_spec.live.thumbnails import Thumbnails

SPEC = """neurovis: 1
name: NAME
time: {dt: 0.01}
neurons: {A: {bias: 0.4}, B: {activation: tanh}}
connections: {A -> B: 1, B -> A: -1}
"""
#: A fan that is wide as it is laid out anywhere, and can be high.
FAN = """neurovis: 1
name: fan
time: {dt: 0.01}
neurons: {A: {activation: tanh, bias: 0.1}, N: {count: 12, activation: tanh}}
connections: {A -> N: 1}
"""
INCLUDED = "neurovis: 1\nmodules: {m: {neurons: {A: {}}}}\n"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with two specs, one of which is invalid, and with much else."""
    files = {
        "one.yaml": SPEC.replace("NAME", "one"),
        "deep/er/two.yml": SPEC.replace("B -> A", "B -> C").replace("NAME", "two<b>"),
        "module.yaml": INCLUDED,
        "other.yaml": "neurons: 3\n",
        ".hidden/x.yaml": SPEC,
        "env/pyvenv.cfg": "",
        "env/x.yaml": SPEC,
        "node_modules/x.yaml": SPEC,
        "a/b/c/d/e/too_deep.yaml": SPEC,
    }
    for name, text in files.items():
        path = tmp_path / "work" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    (tmp_path / "work/again").symlink_to(tmp_path / "work")
    (tmp_path / "outside.yaml").write_text(SPEC)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "work"


@asynccontextmanager
async def served(folder: Path) -> AsyncIterator[tuple[Access, aiohttp.ClientSession]]:
    sock = listen("127.0.0.1", 0)
    access = Access("127.0.0.1", sock.getsockname()[1], True, (PAGE, STREAM, PICTURE))
    gallery = Gallery(access, tuple(specs_in(folder)), commands.draw_listed, commands.opener(Show()))
    await gallery.start(sock)
    try:
        async with aiohttp.ClientSession(f"http://127.0.0.1:{access.port}") as session:
            yield access, session
    finally:
        await gallery.stop()


def test_it_lists_the_specs_of_the_folder_and_the_examples(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert [one.name for one in specs_in(folder)] == ["one.yaml", "deep/er/two.yml"]
    found = commands.listed_in(folder)
    assert {one.heading for one in found} == {"in this folder", "examples", "to start from"}
    assert {"cpg_rbf", "hexapod"} <= {one.name for one in found if one.heading == "examples" and not one.own}
    assert len({one.path or one.text for one in found}) == len(found)
    assert "two.yml</span>" in page_of((Listed("two.yml", "a&b"),))
    assert "a&amp;b" in page_of((Listed("<b>", "a&b"),))
    assert "<b>" not in page_of((Listed("<b>", "a&b"),))
    monkeypatch.setattr(listing, "FOLDERS", 1)
    assert [one.name for one in specs_in(folder)] == ["one.yaml"]
    monkeypatch.setattr(listing, "MOST", 1)
    monkeypatch.setattr(listing, "FOLDERS", 100)
    assert [one.name for one in specs_in(folder)] == ["one.yaml"]
    assert specs_in(folder / "nowhere") == []


def test_what_is_asked_is_a_number_of_the_list_and_nothing_else(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rooms, "MOST", 1)

    async def main() -> None:
        async with served(folder) as (access, session):

            async def get(path: str) -> tuple[int, str, str]:
                async with session.get(path) as answer:
                    assert answer.headers["X-Frame-Options"] == "DENY"
                    return answer.status, answer.headers["Content-Type"].partition(";")[0], await answer.text()

            owner, viewer = f"token={access.owner}", f"token={access.viewer}"
            for other in ("-1", "2", "1e0", "", "../outside.yaml", "%2Fetc%2Fpasswd", "٣", "0" * 9):
                for path in ("/", "/picture", "/live"):
                    expected = 426 if path == "/live" else 404
                    assert (await get(f"{path}?{owner}&spec={other}"))[0] == expected, (path, other)
                with pytest.raises(aiohttp.WSServerHandshakeError, match="404"):
                    await session.ws_connect(f"/live?{owner}&spec={other}")
            assert [(await get(path))[0] for path in ("/", "/picture?spec=0", "/?spec=0")] == [403] * 3
            assert (await get(f"/one.yaml?{owner}"))[0] == 404
            status, kind, text = await get(f"/?{owner}")
            assert (status, kind) == (200, "text/html")
            assert "deep/er/two.yml" in text
            assert str(folder) not in text
            assert (await get(f"/picture?{viewer}&spec=0"))[:2] == (200, "image/svg+xml")
            status, kind, text = await get(f"/picture?{owner}&spec=1")
            assert (status, kind) == (200, "text/plain")
            assert "there is no" in text
            assert "'C'" in text

            eyes = Eyes(await session.ws_connect(f"/live?{owner}&spec=0"))
            await eyes.until(lambda: eyes.step > 3)
            assert eyes.scene["title"] == "one"
            assert eyes.told[0]["text"] == "compiling and laying out …"
            late = Eyes(await session.ws_connect(f"/live?{viewer}&spec=0"))
            await late.until(lambda: late.step > 3)
            assert not late.status["owner"]
            await late.ask("restart")
            await late.until(lambda: late.told[-1]["type"] == "refused")
            with pytest.raises(aiohttp.WSServerHandshakeError, match="503"):
                await session.ws_connect(f"/live?{owner}&spec=1")
            await eyes.stream.close()
            await late.stream.close()
            broken = Eyes(await session.ws_connect(f"/live?{owner}&spec=1"))
            await broken.until(lambda: any(told.get("errors") for told in broken.told))
            assert "there is no" in broken.told[-1]["text"]

    asyncio.run(main())


def test_pictures_are_kept_until_a_file_of_theirs_changes(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(user_cache.ENVIRONMENT_VARIABLE, "")
    drawn: list[str] = []

    def draw(one: Listed) -> tuple[str, list[Path]]:
        assert one.path is not None
        drawn.append(one.name)
        return one.path.read_text(), [one.path, folder / "module.yaml"]

    one, two = specs_in(folder)
    assert [Thumbnails(draw).of(which).svg for which in (one, one, two)] == [SPEC.replace("NAME", "one")] * 2 + [
        (folder / "deep/er/two.yml").read_text()
    ]
    assert drawn == ["one.yaml", "deep/er/two.yml"]
    (folder / "module.yaml").write_text(INCLUDED + "#")
    Thumbnails(draw).of(one)
    (folder / "module.yaml").unlink()
    Thumbnails(draw).of(one)
    Thumbnails(draw).of(one)
    assert drawn[2:] == ["one.yaml"] * 3


def test_the_command_line_has_it_and_a_new_spec_says_how_to_see_it(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    served: list[object] = []
    monkeypatch.setattr(commands, "show_gallery", lambda *of: served.append(of))
    monkeypatch.chdir(folder)
    assert CliRunner().invoke(neurovis, ["live"]).exit_code == 0
    assert len(served) == 1
    refused = CliRunner().invoke(neurovis, ["live", "--watch"])
    assert refused.exit_code == 2
    assert "--watch is of a spec" in refused.stderr
    monkeypatch.setattr(new, "on_terminal", lambda: True)
    made = CliRunner().invoke(neurovis, ["new", "first"])
    assert (made.stdout, made.stderr) == ("first.yaml\n", "see it run: neurovis live first.yaml --open\n")


@pytest.mark.browser
def test_two_clicks_open_a_network_that_runs(folder: Path, tmp_path: Path) -> None:
    async def main() -> None:
        async with served(folder) as (access, _), chromium(tmp_path) as opened:
            await opened.size(390, 844)
            await opened.call("Page.navigate", url=access.url())
            await opened.until("document.querySelector('.picture img')?.naturalWidth > 0", 60)
            await opened.until("document.querySelector('li.broken pre')?.textContent.includes(\"'C'\")", 60)
            assert await opened.ask("document.documentElement.scrollWidth <= innerWidth")
            script = "const s = document.querySelector('#search'); s.value = 'TWO'; s.dispatchEvent(new Event('input'))"
            await opened.ask(f"{{ {script} }}")
            assert await opened.ask("[...document.querySelectorAll('li')].map((li) => li.hidden)") == [True, False]
            await opened.ask("document.querySelector('a').click()")
            await opened.until("+document.querySelector('#scrub')?.value > 3", 60)
            assert await opened.ask("document.title") == "one – NeuroVis"
            assert opened.errors == []

    asyncio.run(main())


def test_the_network_of_a_room_is_laid_out_for_the_window_of_its_owner_and_of_no_other(folder: Path) -> None:
    (folder / "fan.yaml").write_text(FAN)
    names = [one.name for one in specs_in(folder)]
    fan, one = names.index("fan.yaml"), names.index("one.yaml")

    async def main() -> None:
        async with served(folder) as (access, session):
            owner, viewer = f"token={access.owner}", f"token={access.viewer}"
            eyes = Eyes(await session.ws_connect(f"/live?{owner}&spec={fan}"))
            beside = Eyes(await session.ws_connect(f"/live?{owner}&spec={one}"))
            await eyes.until(lambda: eyes.step > 3)
            await beside.until(lambda: beside.step > 3)
            assert eyes.scene["window"] == beside.scene["window"] == "default"
            late = Eyes(await session.ws_connect(f"/live?{viewer}&spec={fan}"))
            await late.until(lambda: late.step > 3)
            await late.ask("fit", window="tall")
            await late.until(lambda: late.told[-1]["type"] == "refused")
            await eyes.ask("fit", window="tall")
            await eyes.until(lambda: eyes.scene["window"] == "tall")
            await late.until(lambda: late.scene["window"] == "tall")
            step = eyes.step
            await eyes.until(lambda: eyes.step > step)
            await eyes.until(lambda: any(told["type"] == "fitting" and told["window"] is None for told in eyes.told))
            assert beside.scene["window"] == "default"

    asyncio.run(main())


@pytest.mark.browser
def test_a_click_on_a_telephone_opens_a_network_that_is_laid_out_for_that(folder: Path, tmp_path: Path) -> None:
    (folder / "fan.yaml").write_text(FAN)
    number = [one.name for one in specs_in(folder)].index("fan.yaml")

    async def main() -> None:
        async with served(folder) as (access, session), chromium(tmp_path) as opened:
            await opened.size(390, 844)
            await opened.call("Page.navigate", url=access.url())
            await opened.until("document.querySelectorAll('a').length > 2")
            await opened.ask(f"document.querySelector('[data-spec=\"{number}\"]').click()")
            await opened.until("+document.querySelector('#scrub')?.value > 3", 60)
            eyes = Eyes(await session.ws_connect(f"/live?token={access.viewer}&spec={number}"))
            await eyes.until(lambda: eyes.scene.get("window") == "tall")
            step = eyes.step
            await eyes.until(lambda: eyes.step > step)
            await opened.until(f"{STEP} > {eyes.step}")  # so that it has the same by now
            await opened.ask("document.querySelector('#picture').focus()")
            await opened.key("+")
            await opened.until("location.hash.includes('view=') && location.hash.includes('window=tall')")
            await opened.key("0")
            await opened.until("!location.hash.includes('view=')")
            (tmp_path / "room.png").write_bytes(await opened.shot())
            await opened.size(1280, 800)
            await eyes.until(lambda: eyes.scene["window"] == "default")
            assert opened.errors == []

    asyncio.run(asyncio.wait_for(main(), 240))
