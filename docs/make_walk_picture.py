"""Films two strides of the hexapod that has learned to walk: docs/pictures/walk.webp, for the gallery.

Run it from the checkout with what the tests need: ``python docs/make_walk_picture.py``. The numbers are those of
the MuJoCo that is installed, so the film is not the same to the last bit elsewhere.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

from PIL import Image, ImageSequence

import neurovis_spec as nv

HERE = Path(__file__).parent
SPEC, TARGET = HERE.parent / "specs" / "walk" / "walk.yaml", HERE / "pictures" / "walk.webp"
EPISODE = 63  # steps
#: pixels across; of how many steps one is shown, so that it moves as quickly as the robot (a step is 50 ms)
WIDE, EVERY = 600, 2


def main() -> None:
    """Learn, and film the last episode."""
    network = nv.compile(SPEC)
    run = network.run()
    with tempfile.TemporaryDirectory() as folder:
        whole = Path(folder) / "walk.webp"
        network.animate(whole, recording=run, start=int(run.step[-EPISODE]), steps=EPISODE)
        with Image.open(whole) as film:
            size = (WIDE, round(WIDE * film.height / film.width))
            frames = [
                frame.convert("RGB").resize(size, Image.Resampling.LANCZOS)
                for number, frame in enumerate(ImageSequence.Iterator(film))
                if number % EVERY == 0
            ]
    frames[0].save(TARGET, save_all=True, append_images=frames[1:], duration=EVERY * 50, loop=0, quality=70, method=6)
    print(f"{TARGET}: {len(frames)} frames, {TARGET.stat().st_size / 1024:.0f} KiB")


if __name__ == "__main__":
    main()
