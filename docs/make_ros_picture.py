"""Pictures the page for docs/ros.md: docs/pictures/ros_hexapod.png, the hexapod as ``neurovis ros view`` shows it.

Run it from the checkout, after ``make .ros/kilted/made``: ``python docs/make_ros_picture.py``.
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

from chromium import chromium  # noqa: E402
from ros_worlds import world  # noqa: E402

SPEC, TARGET = HERE.parent / "specs" / "hexapod" / "hexapod.yaml", HERE / "pictures" / "ros_hexapod.png"
SIZE = (1000, 1100)
STEP = "Number(document.querySelector('#told')?.textContent.split(' ')[1])"


async def picture(url: str) -> Image.Image:
    """The page, once the robot walks, with the trace of a neuron."""
    with tempfile.TemporaryDirectory() as folder:
        async with chromium(Path(folder)) as page:
            await page.size(*SIZE)
            await page.call("Page.navigate", url=url)
            await page.until(f"{STEP} >= 700", 60)
            for key in ("]", "p", "Escape"):
                await page.key(key)
            await asyncio.sleep(4)
            assert page.errors == []
            return Image.open(io.BytesIO(await page.shot())).convert("RGB")


def main() -> None:
    """Write the picture."""
    with world("kilted") as ros:
        ros.neurovis("ros", "run", SPEC).wait_for("ready")
        view = ros.neurovis("ros", "view", "--live", "0")
        taken = asyncio.run(picture(view.wait_for("live: ").removeprefix("live: ")))
    taken.save(TARGET, optimize=True)
    print(f"{TARGET.name}: {TARGET.stat().st_size / 1024:.0f} KiB")


if __name__ == "__main__":
    main()
