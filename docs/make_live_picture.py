"""Films the live page for the README: docs/pictures/live.webp, made in Chromium, step by step, so that it is smooth.

Run it from the checkout with what the tests need: ``python docs/make_live_picture.py``.
"""

from __future__ import annotations

import asyncio
import io
import sys
import tempfile
from pathlib import Path

from PIL import Image

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "tests"))

from chromium import Page, chromium  # noqa: E402

SPEC, TARGET = HERE.parent / "specs" / "cpg_rbf.yaml", HERE / "pictures" / "live.webp"
SIZE = (900, 760)
#: Steps between two pictures, and how long each is seen, in milliseconds; how long the last is.
STEPS, SEEN, LAST = 16, 90, 2500
#: Where it is played to, and from where on it goes otherwise.
END, BACK = 640, 300
STEP = "Number(document.querySelector('#told')?.textContent.split(' ')[1])"


async def picture(page: Page) -> Image.Image:
    """What is seen, with the curves of all steps."""
    await page.ask("new Promise((done) => setTimeout(done, 120))")
    return Image.open(io.BytesIO(await page.shot())).convert("RGB")


async def played(page: Page, end: int) -> list[Image.Image]:
    """Pictures some steps apart, until a step."""
    taken = []
    while True:
        before = await page.ask(STEP)
        assert isinstance(before, int | float)
        if before >= end:
            return taken
        for _ in range(STEPS):
            await page.key("ArrowRight")
        await page.until(f"{STEP} >= {before + STEPS}")
        taken.append(await picture(page))


async def dragged(page: Page, start: int, end: int) -> list[Image.Image]:
    """Pictures of how the thumb is dragged back."""
    taken = []
    for step in range(start, end - 1, -34):
        await page.ask(f"scrub = document.querySelector('#scrub'); scrub.value = {step}")
        await page.ask("scrub.dispatchEvent(new Event('input'))")
        await page.until(f"{STEP} == {step}")
        taken.append(await picture(page))
    return taken


async def film() -> list[Image.Image]:
    """O chases T and the error falls; back, K2 is lesioned, and the new curve runs over the pale old one."""
    live = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "neurovis_spec", "live", str(SPEC)), stdout=asyncio.subprocess.PIPE
    )
    assert live.stdout is not None
    url = (await live.stdout.readline()).decode().strip()
    try:
        with tempfile.TemporaryDirectory() as folder:
            async with chromium(Path(folder)) as page:
                await page.size(*SIZE)
                await page.call("Page.navigate", url=url)
                await page.until(f"{STEP} >= 0")
                await page.key(" ")
                await page.key("Home")
                await page.until(f"{STEP} == 0")
                taken = await played(page, END)
                taken += await dragged(page, END, BACK)
                for _ in range(4):
                    await page.key("]")
                await page.key("t")
                taken += [await picture(page)] * 6
                await page.ask("document.querySelector('#lesion').click()")
                await page.until("document.querySelector('#others').children.length > 0")
                await page.key("t")
                taken += [await picture(page)] * 3
                await page.key("Escape")
                await page.ask("document.activeElement.blur()")
                taken += await played(page, END)
                assert page.errors == []
                return taken
    finally:
        live.terminate()
        await live.wait()


def main() -> None:
    """Write the film."""
    first, *rest = asyncio.run(film())
    durations = [SEEN] * len(rest) + [LAST]
    first.save(TARGET, save_all=True, append_images=rest, duration=durations, loop=0, quality=60, method=6)
    print(f"{TARGET.name}: {1 + len(rest)} pictures, {TARGET.stat().st_size / 1024:.0f} KiB")


if __name__ == "__main__":
    main()
