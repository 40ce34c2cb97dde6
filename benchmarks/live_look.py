"""Whether the live page looks as a designer would have it: a checklist over what Chromium shows of it.

In: nothing; ``--specs A,B`` for other specs than those of the checklist, ``--sizes``, ``--schemes light,dark`` as the
system may ask, ``--panels`` for the page with its panels open, ``--out FOLDER`` for pictures. Out: a table, in
Markdown, on standard output, a row a page: the share of the window that the box around all neurons has; the smallest
text in the picture, and beside it, in pixels; the least contrast of a text with what is behind it, and the smallest
side of what can be pressed, beside the picture; how many rows the bar has; and words that nobody but us has. What
misses the checklist is bold; then the status is 1. The picture is measured by what is drawn of it: the transform of
its canvas, the discs of the scene that was sent, and the texts that were written.
"""

from __future__ import annotations

import argparse
import asyncio
import sys
import tempfile
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import cast

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

from chromium import Page, chromium

import neurovis_spec as nv
from neurovis_spec.live.access import Access
from neurovis_spec.live.commands import REQUESTS
from neurovis_spec.live.desk import Desk
from neurovis_spec.live.hub import Hub
from neurovis_spec.live.live import listen
from neurovis_spec.live.run import Run
from neurovis_spec.live.server import Server
from neurovis_spec.live.show import Show

HERE = Path(__file__).parent
SPECS = ("cpg_rbf.yaml", "hexapod/hexapod.yaml", "walk/walk.yaml", "reward.yaml", "mlp.yaml", "ring.yaml")
SIZES = ("1280x800", "1920x1080", "390x844", "844x390")
#: What is narrower or lower than this is a telephone, whose fingers need more room than a pointer.
TELEPHONE = 600
#: The checklist: share of a window that is no telephone; pixels; contrast (WCAG 2.2, 1.4.3); pixels for a pointer
#: (2.5.8) and for a finger (2.5.5), but for what is in a strip; rows.
SHARE, LABEL, TEXT, CONTRAST, TARGET, FINGER, ROWS = 0.45, 8.0, 11.0, 4.5, 24.0, 44.0, 2
#: Words of ours, of which no field speaks.
JARGON = (
    "turned", "put by hand", "glyph", "strip", "look on", "desk", "glance", "scrubber", "as it went", "gains, times",
)  # fmt: skip
#: What is sent and drawn is noted before the page begins.
NOTES = """
window.notes = { scene: null, at: null, texts: new Map() };
const { prototype } = CanvasRenderingContext2D, { setTransform, fillText } = prototype;
prototype.setTransform = function (...of) {
  if (this.canvas.id === 'picture' && of[0] !== 1) notes.at = of;
  return setTransform.apply(this, of);
};
prototype.fillText = function (...of) {
  const { a, b } = this.getTransform(), size = /([\\d.]+)px/.exec(this.font);
  const inPicture = this.canvas.id === 'picture' || !this.canvas.isConnected;
  if (inPicture && size) notes.texts.set(of[0], Number(size[1]) * Math.hypot(a, b) / devicePixelRatio);
  return fillText.apply(this, of);
};
window.WebSocket = class extends WebSocket {
  constructor(...of) {
    super(...of);
    this.addEventListener('message', async ({ data }) => {
      if (typeof data === 'string' || new Uint8Array(data)[0] !== 1) return;
      const stream = new Blob([data.slice(4)]).stream().pipeThrough(new DecompressionStream('gzip'));
      notes.scene = JSON.parse(await new Response(stream).text());
    });
  }
};"""
#: What is measured, in the page.
MEASURE = """(() => {
  const seen = (one) => one.checkVisibility({ visibilityProperty: true, opacityProperty: true })
    && one.getBoundingClientRect().width > 1;
  const lightness = (rgb) => rgb.map((value) => value / 255)
    .map((value) => value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4)
    .reduce((sum, value, at) => sum + value * [0.2126, 0.7152, 0.0722][at], 0);
  const paint = document.createElement('canvas').getContext('2d', { willReadFrequently: true });
  const over = (colours) => {
    paint.globalAlpha = 1;
    for (const colour of colours) { paint.fillStyle = colour; paint.fillRect(0, 0, 1, 1); }
    return [...paint.getImageData(0, 0, 1, 1).data].slice(0, 3);
  };
  const behind = (one) => one ? [...behind(one.parentElement), getComputedStyle(one).backgroundColor] : ['#fff'];
  const contrast = (one) => {
    const grounds = behind(one), back = lightness(over(grounds));
    const ink = lightness(over([...grounds, getComputedStyle(one).color]));
    return (Math.max(back, ink) + 0.05) / (Math.min(back, ink) + 0.05);
  };
  const all = [...document.body.querySelectorAll('*')].filter(seen);
  const off = (one) => one.closest(':disabled');
  const texts = all.filter((one) => [...one.childNodes].some((node) => node.nodeType === 3 && node.data.trim())
    && !['SCRIPT', 'STYLE'].includes(one.tagName) && getComputedStyle(one).clipPath === 'none');
  const least = (some, of) => some.map((one) => [of(one), one.id || one.className || one.tagName.toLowerCase()])
    .reduce((one, other) => other[0] < one[0] ? other : one, [Infinity, '']);
  const pressed = all.filter((one) => one.matches('button, select, input, summary, [role=option]'));
  const side = (one) => {
    const { width, height } = (one.type === 'checkbox' && one.closest('label') || one).getBoundingClientRect();
    return Math.min(width, height);
  };
  const told = all.flatMap((one) => [one.title, one.ariaLabel, one.placeholder]).filter(Boolean);
  const { scene, at } = notes, ratio = devicePixelRatio;
  const discs = scene.groups.filter(({ data }) => data.neuron !== undefined).map(({ shapes }) => shapes[0]);
  const box = document.querySelector('#picture').getBoundingClientRect();
  const edges = [0, 1].map((axis) => {
    const ends = discs.flatMap(({ at: place, radius }) => [place[axis] - radius, place[axis] + radius]);
    const room = [box.width, box.height][axis];
    const [low, high] = [Math.min(...ends), Math.max(...ends)].map((end) => (at[4 + axis] + at[0] * end) / ratio);
    return Math.max(0, Math.min(room, high) - Math.max(0, low));
  });
  const rows = new Set([...document.querySelectorAll('#bar button')].filter(seen)
    .map((one) => Math.round(one.getBoundingClientRect().top / 8)));
  return {
    share: edges[0] * edges[1] / innerWidth / innerHeight,
    label: [...notes.texts].map(([text, size]) => [size, text]).reduce((a, b) => b[0] < a[0] ? b : a, [Infinity, '']),
    text: least(texts, (one) => parseFloat(getComputedStyle(one).fontSize)),
    contrast: least(texts.filter((one) => !off(one)), contrast),
    target: least(pressed.filter((one) => !one.closest('#strips')), side),
    rows: rows.size,
    wide: document.documentElement.scrollWidth > innerWidth,
    words: [document.body.innerText, ...told].join('\\n').toLowerCase(),
  };
})()"""


@dataclass(frozen=True, slots=True)
class Looked:
    """What was measured of a page: numbers, where it is said of what they are, and words of ours that are in it."""

    telephone: bool
    share: float
    label: tuple[float, str]
    text: tuple[float, str]
    contrast: tuple[float, str]
    target: tuple[float, str]
    rows: int
    wide: bool
    jargon: tuple[str, ...]

    @property
    def passed(self) -> dict[str, bool]:
        """By what the checklist asks whether that is so."""
        return {
            "share": self.telephone or self.share >= SHARE,
            "label": self.label[0] >= LABEL,
            "text": self.text[0] >= TEXT,
            "contrast": self.contrast[0] >= CONTRAST,
            "target": self.target[0] >= (FINGER if self.telephone else TARGET),
            "rows": self.rows <= ROWS and not self.wide,
            "jargon": not self.jargon,
        }

    def row(self) -> list[str]:
        """The cells of the table; what misses is bold, and says where."""
        told = {"share": f"{self.share:.0%}", "rows": str(self.rows), "jargon": ", ".join(self.jargon) or "–"}
        for name in ("label", "text", "contrast", "target"):
            value, where = cast(tuple[float, str], getattr(self, name))
            told[name] = f"{value:.1f}" if self.passed[name] else f"{value:.1f} ({where})"
        return [told[name] if good else f"**{told[name]}**" for name, good in self.passed.items()]


@asynccontextmanager
async def served(spec: Path) -> AsyncIterator[str]:
    """The address of a live view of a spec."""
    compiled = nv.compile(spec)
    hub, show = Hub(asyncio.get_running_loop(), REQUESTS), Show()
    run = Run(*show.stage(compiled), hub.show, lambda: hub.watched)
    desk = Desk(compiled, None, show.view, run, hub.keep_soon)
    sock = listen("127.0.0.1", 0)
    access = Access("127.0.0.1", sock.getsockname()[1])
    server = Server(access, hub, run, desk)
    await server.start(sock)
    run.start()
    desk.start()
    try:
        yield access.url()
    finally:
        desk.end()
        run.end()
        await server.stop()


async def opened_in(page: Page, url: str, size: str, scheme: str, panels: bool) -> bool:
    """Open a page in a window of a size, some steps on; whether it is a telephone."""
    width, height = (int(side) for side in size.split("x"))
    telephone = min(width, height) < TELEPHONE
    await page.call(
        "Emulation.setDeviceMetricsOverride",
        width=width, height=height, deviceScaleFactor=2 if telephone else 1, mobile=telephone,
    )  # fmt: skip
    await page.call("Emulation.setTouchEmulationEnabled", enabled=telephone, maxTouchPoints=5 if telephone else 1)
    await page.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
    await page.call("Page.navigate", url=url)
    await page.until("document.readyState === 'complete' && window.notes?.scene && notes.at", 60)
    await page.until("parseInt(document.querySelector('#told').textContent.split(' ')[1]) > 60", 60)
    if panels:
        await page.ask("document.querySelector('#picture').focus()")
        for key in ("]", "t") if telephone else ("]", "t", "o"):
            await page.key(key)
    await asyncio.sleep(0.5)
    return telephone


async def looked(page: Page, telephone: bool) -> Looked:
    """What is measured of a page that is open."""
    found = cast(dict[str, object], await page.ask(MEASURE))
    words = str(found.pop("words"))

    def told(name: str) -> tuple[float, str]:
        value, where = cast(tuple[float | None, str], found[name])
        return (float("inf") if value is None else value), where

    return Looked(
        telephone, float(cast(float, found["share"])), told("label"), told("text"), told("contrast"), told("target"),
        int(cast(int, found["rows"])), bool(found["wide"]), tuple(word for word in JARGON if word in words),
    )  # fmt: skip


async def measured(options: argparse.Namespace) -> list[tuple[str, str, str, Looked]]:
    """A row for each page."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        async with chromium(Path(folder)) as page:
            await page.call("Page.addScriptToEvaluateOnNewDocument", source=NOTES)
            for spec in options.specs.split(","):
                async with served(HERE.parent / "specs" / spec) as url:
                    for scheme in options.schemes.split(","):
                        for size in options.sizes.split(","):
                            telephone = await opened_in(page, url, size, scheme, options.panels)
                            name = Path(spec).stem
                            rows.append((name, size, scheme, await looked(page, telephone)))
                            if options.out:
                                suffix = "-panels" if options.panels else ""
                                (options.out / f"{name}-{size}-{scheme}{suffix}.png").write_bytes(await page.shot())
                    await page.call("Page.navigate", url="about:blank")
    return rows


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--specs", default=",".join(SPECS))
    parser.add_argument("--sizes", default=",".join(SIZES))
    parser.add_argument("--schemes", default="light")
    parser.add_argument("--panels", action="store_true")
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    if options.out:
        options.out.mkdir(parents=True, exist_ok=True)
    rows = asyncio.run(measured(options))
    print("| spec | window | system | neurons | label | text | contrast | target | rows | jargon |")
    print("| --- | --- | --- | --: | --: | --: | --: | --: | --: | --- |")
    for name, size, scheme, found in rows:
        print("| " + " | ".join([name, size, scheme, *found.row()]) + " |", flush=True)
    return 0 if all(all(found.passed.values()) for *_, found in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
