"""Pictures in Chromium: what it draws, what it measures, and that films move in it, or stand still where asked.

Needs ``chromium``; without it these tests fail rather than pass unseen.
"""

from __future__ import annotations

import io
import json
import re
import shutil
import subprocess
import time
from collections.abc import Callable, Sequence
from html import unescape
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread

import numpy as np
import pytest
from hand_networks import Case, use_case_1
from neurovis_renderers.animated_svg import LEVELS, AnimatedSvgRenderer
from neurovis_renderers.canvas import paint
from neurovis_renderers.raster import PillowRenderer
from neurovis_renderers.svg import SvgRenderer
from PIL import Image
from renderer_conformance import ALIKE, SCENES, short_film, similarity
from test_body_view import film as body_film
from test_body_view import walked

import neurovis_spec as nv
from neurovis_spec.compiler.drawing.drawing_settings import RenderSettings
from neurovis_spec.scene import THEMES, Disc, Film, Group, Scene, channels, colours, still
from neurovis_spec.scene.film import film, scene_of_step
from neurovis_spec.scene.gains import choose_gains

pytestmark = pytest.mark.browser

CASE = use_case_1(1300)
GAINS = choose_gains(CASE.network, RenderSettings(), CASE.reached)
FRAMES, FPS = 64, 40.0
Browser = Callable[..., str]


@pytest.fixture
def browser(tmp_path: Path) -> Browser:
    """Runs Chromium on a page of ours, without the network; gives what it prints."""
    found = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    assert found, "these tests need chromium"

    def run(html: str, *arguments: str) -> str:
        page = tmp_path / "page.html"
        page.write_text(html, encoding="utf-8")
        command = [
            found, "--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking", "--no-first-run",
            "--disable-component-update", "--disable-sync", "--hide-scrollbars", f"--user-data-dir={tmp_path / 'user'}",
            *arguments, page.as_uri(),
        ]  # fmt: skip
        return subprocess.run(command, capture_output=True, text=True, timeout=120, check=True).stdout

    return run


def scene(step: int, theme: str, case: Case = CASE) -> Scene:
    return scene_of_step(case.network, case.layout, case.snapshot(step), GAINS, RenderSettings(theme=theme))


def moving(theme: str = "default") -> Film:
    steps = [CASE.snapshot(k) for k in range(120, 120 + FRAMES)]
    return film(CASE.network, CASE.layout, steps, GAINS, RenderSettings(theme=theme), FPS)


def shot(browser: Browser, folder: Path, svg: bytes, size: tuple[int, int], wait: float = 0.0) -> Image.Image:
    """What Chromium shows of an SVG inside <img>, ``wait`` seconds after it came (the page has a slow part)."""
    (folder / "picture.svg").write_bytes(svg)
    target = folder / "shot.png"

    class Slow(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            time.sleep(wait)
            self.send_response(404)
            self.end_headers()

        def log_message(self, format: str, *args: object) -> None:
            """Nothing."""

    server = ThreadingHTTPServer(("127.0.0.1", 0), Slow)
    Thread(target=server.serve_forever, daemon=True).start()
    slow = f'<img src="http://127.0.0.1:{server.server_port}/">' if wait else ""
    try:
        browser(
            f'<body style="margin:0"><img src="picture.svg" style="display:block">{slow}',
            f"--screenshot={target}", f"--window-size={size[0]},{size[1]}",
        )  # fmt: skip
    finally:
        server.shutdown()
        server.server_close()
    return Image.open(io.BytesIO(target.read_bytes())).convert("RGB")


def measured(browser: Browser, svg: bytes, script: str, *more: str, doctype: str = "<!doctype html>") -> object:
    """What a script that stands beside an inline SVG (``svg``) returns."""
    page = (
        f"{doctype}<body style='margin:0'>{svg.decode()}<pre id=out></pre><script>"
        f"const svg = document.querySelector('svg'), out = document.getElementById('out');"
        f"const work = () => {{ out.textContent = JSON.stringify((() => {{{script}}})()); }};"
        f"setTimeout(work, 300);</script>"
    )
    found = re.search(
        r'<pre id="out">(.*?)</pre>', browser(page, "--dump-dom", "--virtual-time-budget=3000", *more), re.DOTALL
    )
    assert found
    return json.loads(unescape(found[1]))


def shots(
    browser: Browser, folder: Path, pictures: Sequence[str], sizes: Sequence[tuple[int, int]]
) -> list[Image.Image]:
    """What Chromium shows of several elements of one page, each of which is a picture of its size in pixels."""
    columns, x, y, high, places = max(wide for wide, _ in sizes), 0, 0, 0, list[tuple[int, int]]()
    for size in sizes:  # in rows
        if x + size[0] > columns:
            x, y, high = 0, y + high, 0
        places.append((x, y))
        x, high = x + size[0], max(high, size[1])
    target = folder / "shots.png"
    body = "".join(
        f'<div style="position:absolute;left:{x}px;top:{y}px;line-height:0">{picture}</div>'
        for picture, (x, y) in zip(pictures, places, strict=True)
    )
    browser(f"<!doctype html><body>{body}{AT}", f"--screenshot={target}", f"--window-size={columns},{y + high}")
    with Image.open(target) as page:
        whole = page.convert("RGB")
    return [whole.crop((x, y, x + w, y + h)) for (x, y), (w, h) in zip(places, sizes, strict=True)]


#: Films inside <figure data-at="seconds"> show that time.
AT = """<script>for (const figure of document.querySelectorAll('figure')) {
const svg = figure.querySelector('svg'); svg.pauseAnimations(); svg.setCurrentTime(+figure.dataset.at); }</script>"""


def at(svg: bytes, seconds: float) -> str:
    """An inline film that stands at a time."""
    return f'<figure data-at="{seconds}" style="margin:0">{svg.decode()}</figure>'


def unmoving(drawn: Scene) -> Film:
    """A film in which nothing changes."""
    nothing = np.zeros((2, 0))
    return Film(drawn, 10.0, (), (), nothing, nothing, nothing, nothing, nothing.astype(np.int8), "none", ("", ""))


@pytest.mark.parametrize("kind", ["still", "film"])
def test_svg_shows_what_the_pixels_show(browser: Browser, tmp_path: Path, kind: str) -> None:
    """All scenes of the conformance suite, in one page."""
    pictures = []
    for number, drawn in enumerate(SCENES.values()):
        if kind == "film":
            pictures.append(at(AnimatedSvgRenderer().animate(unmoving(drawn), ".svg"), 0.1))
        else:
            (tmp_path / f"{number}.svg").write_bytes(SvgRenderer().draw(drawn, ".svg"))
            pictures.append(f'<img src="{number}.svg">')
    seen = shots(browser, tmp_path, pictures, [drawn.pixels for drawn in SCENES.values()])
    alike = {
        name: similarity(theirs, Image.fromarray(paint(drawn)))
        for (name, drawn), theirs in zip(SCENES.items(), seen, strict=True)
    }
    # Chromium sets some pairs of letters closer to each other, by two pixels in a line of thirty
    assert {name for name, value in alike.items() if value < (0.95 if name == "texts" else ALIKE)} == set(), alike


def assert_frames_alike(browser: Browser, folder: Path, made: Film, chosen: tuple[int, int, int]) -> None:
    """Each of these frames of an animated SVG is in Chromium what the pixels show, and like no other frame so much."""
    svg = AnimatedSvgRenderer().animate(made, ".svg")
    pictures = [at(svg, (frame + 0.02) / made.fps) for frame in chosen]
    seen = shots(browser, folder, pictures, [made.scene.pixels] * len(chosen))
    ours = [Image.fromarray(paint(still(made, frame))) for frame in chosen]
    alike = [[similarity(picture, other) for other in ours] for picture in seen]
    assert min(alike[k][k] for k in range(len(chosen))) >= ALIKE, alike
    assert [row.index(max(row)) for row in alike] == [0, 1, 2], alike


def test_frames_of_an_animated_svg_show_what_the_pixels_show(browser: Browser, tmp_path: Path) -> None:
    assert_frames_alike(browser, tmp_path, short_film(8), (0, 3, 7))


def test_frames_of_a_body_that_walks_show_what_the_pixels_show(browser: Browser, tmp_path: Path) -> None:
    assert_frames_alike(browser, tmp_path, body_film(walked(2.0), "dark", rows=12), (0, 5, 11))


@pytest.mark.parametrize("theme", ["default", "dark"])
def test_views_are_the_same_picture_in_pixels(browser: Browser, tmp_path: Path, theme: str) -> None:
    network = nv.compile(Path(__file__).parents[1] / "specs" / "cpg_rbf.yaml")
    recording, view = network.run(400), ["traces: C, O", "weights: K -> O", "raster", "matrix"]
    for suffix in (".svg", ".png"):
        network.render(tmp_path / f"x{suffix}", step=250, recording=recording, view=view, theme=theme)
    ours = Image.open(tmp_path / "x.png").convert("RGB")
    theirs = shot(browser, tmp_path, (tmp_path / "x.svg").read_bytes(), ours.size)
    assert ours.size == theirs.size
    assert similarity(ours, theirs) >= 0.985


BOXES = """
const all = [...svg.querySelectorAll('text')].map(t => { const b = t.getBBox();
  return {text: t.textContent, disc: !!t.parentNode.dataset.neuron, box: [b.x, b.y, b.x + b.width, b.y + b.height]}; });
const discs = [...svg.querySelectorAll('circle')].map(c => [c.cx.baseVal.value, c.cy.baseVal.value, c.r.baseVal.value]);
const lines = [...svg.querySelectorAll('[data-connection]>path')].map(p => { const n = p.getTotalLength();
  return [...Array(60).keys()].map(k => { const q = p.getPointAtLength(n * k / 59); return [q.x, q.y]; }); });
return {texts: all, discs: discs, lines: lines, whole: svg.viewBox.baseVal.width + ' ' + svg.viewBox.baseVal.height,
  drawn: (b => [b.x, b.y, b.x + b.width, b.y + b.height])(svg.getBBox({stroke: true}))};
"""


def test_texts_touch_nothing_and_all_lies_within_the_viewbox(browser: Browser) -> None:
    found = measured(browser, SvgRenderer().draw(scene(1180, "default"), ".svg"), BOXES)
    assert isinstance(found, dict)
    width, height = (float(part) for part in found["whole"].split())
    x0, y0, x1, y1 = found["drawn"]
    assert (x0, y0) == (0, 0)
    assert x1 <= width + 1e-6
    assert y1 <= height + 1e-6
    told = found["texts"]
    assert len(told) > 20
    for place, one in enumerate(told):
        a = one["box"]
        for other in told[place + 1 :]:
            b = other["box"]
            apart = a[0] >= b[2] or b[0] >= a[2] or a[1] >= b[3] - 3 or b[1] >= a[3] - 3
            assert apart, (one["text"], other["text"])
        for x, y, r in found["discs"]:
            dx, dy = x - min(max(x, a[0]), a[2]), y - min(max(y, a[1]), a[3])
            assert one["disc"] or dx * dx + dy * dy > r * r, one["text"]
        for line in found["lines"]:
            crossed = any(a[0] < x < a[2] and a[1] + 2 < y < a[3] - 2 for x, y in line)
            assert one["disc"] or not crossed, one["text"]


SEEK = (
    f"const frames = {FRAMES}, fps = {FPS};"
    + """
svg.pauseAnimations();
const at = name => getComputedStyle(svg.querySelector(name));
const line = svg.querySelector('[data-connection="K5 -> O"]');
const read = [...Array(frames).keys()].map(frame => { svg.setCurrentTime((frame + 0.02) / fps);
  return [at('[data-neuron="K5"]>circle').fill, at('[data-connection="C1 -> K5"]>path').stroke,
    parseFloat(getComputedStyle(line.querySelector('path:not(.glow)')).strokeWidth),
    parseFloat(getComputedStyle(line.querySelector('.glow')).strokeWidth),
    line.querySelector('polygon').getBoundingClientRect().height,
    [...svg.querySelectorAll('.caption text')].filter(t => getComputedStyle(t).display != 'none')
      .map(t => t.textContent).join('|')]; });
return read;
"""
)


def rgb(text: str) -> tuple[int, ...]:
    return tuple(int(part) for part in re.findall(r"\d+", text))


def test_each_frame_of_a_film_shows_its_step(browser: Browser) -> None:
    made = moving()
    read = measured(browser, AnimatedSvgRenderer().animate(made, ".svg"), SEEK)
    assert isinstance(read, list)
    neuron = CASE.network.neuron_index["K5"]
    carries, learns = (CASE.network.connection_index[name] for name in ("C1 -> K5", "K5 -> O"))
    for frame, (fill, stroke, width, glow, _, caption) in enumerate(read):
        for shown, value in ((fill, made.fill_values[frame, neuron]), (stroke, made.line_values[frame, carries])):
            (wanted,) = colours(made.scene.theme, [float(value)])
            assert np.abs(np.subtract(rgb(shown), channels(wanted))).max() <= 150 / (LEVELS - 1) + 1
        assert width == pytest.approx(made.line_widths[frame, learns], abs=0.04)
        assert glow == pytest.approx(made.glow_widths[frame, learns], abs=0.05)
        assert caption == made.captions[frame]
    assert len({row[0] for row in read}) > 5
    assert len({row[3] for row in read}) > 10


def test_a_line_ends_in_a_bar_while_its_weight_is_negative(browser: Browser) -> None:
    steps = [CASE.snapshot(k) for k in range(70)]
    made = film(CASE.network, CASE.layout, steps, GAINS, RenderSettings(), FPS)
    name = "K8 -> O"
    weights = CASE.weights[:70, CASE.network.connection_index[name]]
    script = f"""svg.pauseAnimations();
    const line = svg.querySelector('[data-connection="{name}"]'), path = line.querySelector('path:not(.glow)');
    const shown = c => getComputedStyle(line.querySelector(c)).display != 'none';
    return [...Array(70).keys()].map(k => {{ svg.setCurrentTime((k + 0.02) / {FPS});
      return [shown('.arrow'), shown('.bar'), getComputedStyle(line.querySelector('.stem')).strokeWidth
        == getComputedStyle(path).strokeWidth]; }});"""
    read = measured(browser, AnimatedSvgRenderer().animate(made, ".svg"), script)
    assert read == [[bool(w >= 0), bool(w < 0), True] for w in weights]
    assert (weights < 0).any()
    assert (weights >= 0).any()


def test_a_film_shows_the_same_in_a_page_of_quirks_mode(browser: Browser) -> None:
    """There class names are told apart by more than their case."""
    svg = AnimatedSvgRenderer().animate(moving(), ".svg")
    assert measured(browser, svg, SEEK) == measured(browser, svg, SEEK, doctype="")


def test_a_film_starts_over_at_its_end(browser: Browser) -> None:
    svg = AnimatedSvgRenderer().animate(moving(), ".svg")
    script = f"""svg.pauseAnimations();
    const fill = t => (svg.setCurrentTime(t), getComputedStyle(svg.querySelector('[data-neuron="K5"]>circle')).fill);
    const f = n => [...Array({FRAMES}).keys()].map(k => fill((k + 0.02) / {FPS} + n * {FRAMES / FPS}));
    return [f(0), f(1), f(5)];"""
    read = measured(browser, svg, script)
    assert isinstance(read, list)
    assert read[0] == read[1] == read[2]


def test_with_reduced_motion_a_film_stands_still_at_its_first_frame(browser: Browser) -> None:
    made = moving()
    svg = AnimatedSvgRenderer().animate(made, ".svg")
    read = measured(browser, svg, SEEK, "--force-prefers-reduced-motion")
    assert isinstance(read, list)
    assert len({json.dumps(row) for row in read}) == 1
    (first,) = colours(made.scene.theme, made.fill_values[0, [CASE.network.neuron_index["K5"]]])
    assert rgb(read[0][0]) == channels(first)
    assert read[0][5] == made.captions[0]


WHERE = """
svg.pauseAnimations();
const dot = svg.querySelector('[data-part="dot"]>circle');
return [0, 1, 2].map(frame => { svg.setCurrentTime((frame + 0.02) / 10);
  const box = dot.getBoundingClientRect(); return [box.x + box.width / 2, box.y + box.height / 2]; });
"""


def test_what_is_shifted_moves_and_stands_still_with_reduced_motion(browser: Browser) -> None:
    theme = THEMES["default"]
    dot = Group((Disc((20, 30), 5, "#101010", "#101010", 1),), "dot", {"part": "dot"})
    empty = np.zeros((3, 0))
    made = Film(
        Scene(200, 100, theme, "a dot", (dot,)), 10.0, (), (), empty, empty, empty, empty, empty.astype(np.int8),
        "caption", ("",) * 3, shifts=("dot",), shift_values=np.array([[[0, 0]], [[50, 0]], [[100.5, -4]]], float),
    )  # fmt: skip
    svg = AnimatedSvgRenderer().animate(made, ".svg")
    moving = measured(browser, svg, WHERE)
    still = measured(browser, svg, WHERE, "--force-prefers-reduced-motion")
    assert isinstance(moving, list)
    assert isinstance(still, list)
    assert np.diff(np.array(moving), axis=0) == pytest.approx(np.array([[50, 0], [50.5, -4]]))
    assert still[0] == still[1] == still[2] == moving[0]


FEET = """
svg.pauseAnimations();
return [0, 5, 11].map(frame => { svg.setCurrentTime((frame + 0.02) / 20);
  return [...svg.querySelectorAll('circle')].filter(disc => disc.getClientRects().length).map(disc => {
    const box = disc.getBoundingClientRect(); return [box.x, box.y]; }); });
"""


def test_a_body_walks_and_stands_still_with_reduced_motion(browser: Browser) -> None:
    svg = AnimatedSvgRenderer().animate(body_film(walked(), rows=12), ".svg")
    moving = np.array(measured(browser, svg, FEET))
    still = np.array(measured(browser, svg, FEET, "--force-prefers-reduced-motion"))
    assert moving.shape == still.shape == (3, 14, 2)  # six feet from above and from the side, two that are explained
    assert (np.abs(np.diff(moving, axis=0)).sum(axis=(1, 2)) > 5).all()
    assert (still == moving[0]).all()


def test_a_film_moves_inside_img_and_there_shows_its_frames(browser: Browser, tmp_path: Path) -> None:
    """The picture after some time is one of the film's frames, and not always the same."""
    made = moving()
    size = made.scene.pixels
    svg = AnimatedSvgRenderer().animate(made, ".svg")
    seen = [shot(browser, tmp_path, svg, size, wait) for wait in (0.3, 0.7, 1.2)]
    frames = [
        Image.open(io.BytesIO(PillowRenderer().draw(still(made, f), ".png"))).convert("RGB")
        for f in range(0, FRAMES, 4)
    ]
    nearest = [max(range(len(frames)), key=lambda f: similarity(picture, frames[f])) for picture in seen]
    assert len(set(nearest)) > 1
    assert min(similarity(p, frames[f]) for p, f in zip(seen, nearest, strict=True)) >= 0.97
