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
#: Steps between two pictures, and how long each is seen, in milliseconds.
STEPS, SEEN = 3, 80
STEP = "Number(document.querySelector('#told')?.textContent.split(' ')[1])"


async def pictures(page: Page, count: int) -> list[Image.Image]:
    """So many pictures, some steps apart."""
    taken = []
    for _ in range(count):
        for _ in range(STEPS):
            before = await page.ask(STEP)
            await page.key("ArrowRight")
            await page.until(f"{STEP} > {before}")
        taken.append(Image.open(io.BytesIO(await page.shot())).convert("RGB"))
    return taken


async def film() -> list[Image.Image]:
    """The page as it is played, held, and turned."""
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
                await page.until(f"{STEP} >= 60")
                await page.key(" ")
                taken = await pictures(page, 25)
                for _ in range(4):
                    await page.key("]")
                taken += await pictures(page, 35)
                await page.key("Escape")
                taken += await pictures(page, 10)
                assert page.errors == []
                return taken
    finally:
        live.terminate()
        await live.wait()


def main() -> None:
    """Write the film."""
    first, *rest = asyncio.run(film())
    first.save(TARGET, save_all=True, append_images=rest, duration=SEEN, loop=0, quality=70, method=6)
    print(f"{TARGET.name}: {1 + len(rest)} pictures, {TARGET.stat().st_size / 1024:.0f} KiB")


if __name__ == "__main__":
    main()
