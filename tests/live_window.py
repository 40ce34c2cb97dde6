"""The window of the live page in tests: its picture has the network a pixel a pixel, with some room around it."""

from __future__ import annotations

import gzip
import json
from typing import NamedTuple

from chromium import Page
from PIL import Image

from neurovis_spec.live.view import View

#: Pixels above the picture, which the line of the title has, and those that are left free around the network.
HEAD, EDGE = 28, 8


class Area(NamedTuple):
    """Where the network lies in a picture, in pixels of its own size."""

    left: float
    top: float
    right: float
    bottom: float
    density: float

    @property
    def size(self) -> tuple[int, int]:
        """How large the picture of the page is then."""
        return round(self.right - self.left) + 2 * EDGE, round(self.bottom - self.top) + 2 * EDGE

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Where the window has a point of the scene."""
        return x * self.density - self.left + EDGE, y * self.density - self.top + EDGE + HEAD

    def within(self, size: tuple[float, float], at: tuple[float, float]) -> tuple[float, float]:
        """Where a place of the window is in one whose picture is so large, in which the network is fitted."""
        wide, high = self.right - self.left, self.bottom - self.top
        scale = min((size[0] - 2 * EDGE) / wide, (size[1] - 2 * EDGE) / high)
        x, y = scale * (at[0] - EDGE), scale * (at[1] - HEAD - EDGE)
        return (size[0] - scale * wide) / 2 + x, HEAD + (size[1] - scale * high) / 2 + y

    def seen(self, taken: Image.Image, sharp: int = 1) -> Image.Image:
        """The network in a picture of the window, on a display of so many pixels a pixel."""
        (wide, high), edge = self.size, sharp * EDGE
        first = edge, sharp * HEAD + edge
        return taken.crop((*first, sharp * (wide - EDGE), sharp * (HEAD + high - EDGE)))

    def drawn(self, picture: Image.Image, sharp: int = 1) -> Image.Image:
        """The same part of a picture that was rendered."""
        left, top, right, bottom = (round(sharp * value) for value in self[:4])
        return picture.crop((left, top, right, bottom))


def area_of(view: View) -> Area:
    """Where the network lies in a picture."""
    scene = json.loads(gzip.decompress(view.content))
    x0, y0, x1, y1 = (round(value * scene["density"]) for value in scene["network"])
    return Area(x0, y0, x1, y1, scene["density"])


async def fit(opened: Page, width: int, height: int, density: float = 1.0) -> None:
    """Have the picture so large, whatever stands around it; the legend is folded."""
    await opened.ask("document.querySelector('#legend[open] summary')?.click()")
    for _ in range(30):  # what stands around it may be a share of the window
        inner = await opened.ask("[innerWidth, innerHeight, picture.clientWidth, picture.clientHeight]")
        assert isinstance(inner, list)
        size = width + inner[0] - inner[2], height + inner[1] - inner[3]
        await opened.size(*size, density)
        await opened.ask("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
        if [*size] == inner[:2]:
            break
    found = await opened.ask("[picture.clientWidth, picture.clientHeight]")
    assert found == [width, height]
