"""The gallery: every example as a picture at a telling step, and a page that says what to look at.

In: ``specs/``. Out: ``docs/pictures/`` and ``docs/gallery.md``, the same bytes each time. Run by ``make gallery``;
``python gallery.py NAME… --to FOLDER`` draws some of the pictures elsewhere.
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import neurovis_spec as nv

HERE = Path(__file__).parent


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture: its file's name, the spec, the step (of a film: the first), a caption, what to look at."""

    name: str
    spec: str
    step: int
    caption: str
    words: str
    theme: str | None = None
    #: of a film; a still has none
    frames: int = 0


PICTURES = (
    Picture(
        "cpg_rbf_learning",
        "cpg_rbf",
        100,
        "Use case 1, moving: the second period",
        "The rhythm of C1 and C2 wakes one kernel after another, from left to right and round again. Where O misses "
        "its target T, the connections of the kernels that are awake glow: they are changing.",
        frames=129,
    ),
    Picture(
        "cpg_rbf",
        "cpg_rbf",
        160,
        "Use case 1, in the midst of learning",
        "K4, K5 and K6 are active, and O is too low by 0.28 (the caption says so): only their three connections glow."
        " C2 sends a negative signal to every kernel; C1 passes through zero, so its lines are grey.",
    ),
    Picture(
        "cpg_rbf_dark",
        "cpg_rbf",
        1180,
        "Use case 1 after nine periods, in the dark theme",
        "The glow is faint by now, and the thickness has stayed: that is what has been learned so far. O follows T: "
        "both have the same colour, and the error is 0.05.",
        theme="dark",
    ),
    Picture(
        "cpg_printed",
        "cpg_printed",
        2020,
        "The oscillator alone, with the weights that the paper prints",
        "Both neurons excite themselves with weight 1; what turns the rhythm are the two thin lines between them, of "
        "opposite sign. The legend shows how small the activities are: the colours are full at 0.13.",
    ),
    Picture(
        "short_term_memory",
        "short_term_memory",
        100,
        "Short-term memory: a neuron that feeds itself",
        "The input I went silent fifty steps ago, and its line is grey. O is still active, and the blue loop says why.",
    ),
    Picture(
        "ring",
        "ring",
        100,
        "A ring attractor that holds a direction",
        "The cue A has gone, but the hill of activity around R8 stays. Within the ring the thicker lines run across: "
        "orange ones hold the far side down, blue ones come from there and support the hill.",
    ),
    Picture(
        "mlp",
        "mlp",
        3,
        "Exclusive or, in one step",
        "Both questions are 1, so H1 (at least one) and H2 (both) are active. What they send to O has opposite "
        "colours and adds up to nothing: O is grey.",
    ),
    Picture(
        "hebbian",
        "hebbian",
        130,
        "Conditioning: the bell comes to mean food",
        "Bell and food are there together for the third time, and the connection of the bell glows: it is growing. It"
        " is still thinner than that of the food, which does not change.",
    ),
    Picture(
        "reward",
        "reward",
        14364,
        "A leg that learns from reward alone",
        "An episode has just ended, and all connections to O change at once: by how much, reward and policy say "
        "(dotted). L reaches B twice, at once and a step later, with opposite signs: B is the difference.",
    ),
    Picture(
        "hexapod",
        "hexapod/hexapod",
        588,
        "Use case 3, walking: three ripples on the line",
        "The rhythm enters the upper delay line at DL6 and passes over the right legs, from hind to front, then over "
        "the left ones. At this frequency every second neuron of DL6 to DL11 is active, and three legs are lifted: "
        "left2, right1 and right3. This is the tripod gait. The lower line swings them forward.",
    ),
    Picture(
        "hexapod_obstacle",
        "hexapod/hexapod",
        1189,
        "Use case 3, learning to step over a beam",
        "The front legs hit the fourth beam 49 steps ago, and dp carries the news to the legs behind. The middle legs "
        "stepped high too early and have just hit the beam, too (H is active): the connection that warned them glows. "
        "Thicker, it keeps the news up for longer, and they will step later.",
    ),
    Picture(
        "hexapod_floor",
        "hexapod/hexapod",
        2341,
        "Use case 3, remembering the floor",
        "All legs but the right front one walk on the soft floor, where contact comes late: S is active in left2 and "
        "right3, which have just come down, and K is high in all five. The S of right1 has been silenced for 31 steps; "
        "its K, lower since its floor is rigid, is where it was.",
    ),
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Draw the pictures, and write the page unless only some of them are wanted."""
    parser = argparse.ArgumentParser(description="Draw the examples.")
    parser.add_argument("names", nargs="*", help="pictures to draw (default: all, and the page)")
    parser.add_argument("--to", type=Path, default=HERE / "docs" / "pictures", metavar="FOLDER")
    options = parser.parse_args(arguments)
    options.to.mkdir(parents=True, exist_ok=True)
    for picture in PICTURES:
        if not options.names or picture.name in options.names:
            draw(picture, options.to / f"{picture.name}.svg")
    if not options.names:
        (HERE / "docs" / "gallery.md").write_text(page(), encoding="utf-8")


def draw(picture: Picture, path: Path) -> None:
    """Draw one."""
    network = nv.compile(HERE / "specs" / f"{picture.spec}.yaml")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        if picture.frames:
            network.animate(path, steps=picture.frames, start=picture.step, theme=picture.theme)
        else:
            network.render(path, step=picture.step, theme=picture.theme)
    print(f"{picture.name:<20}{path.stat().st_size / 1024:6.0f} KiB   {path}")


def page() -> str:
    """The page that shows them all."""
    parts = [
        "# Gallery",
        "Every example in `specs/`, drawn at a telling step. Colour is activity and signal, thickness is weight, glow"
        " is change; the legend of each picture says on which scale. Made by `make gallery`.",
    ]
    for picture in PICTURES:
        what = f"--steps {picture.frames} --from {picture.step}" if picture.frames else f"--step {picture.step}"
        theme = f" --theme {picture.theme}" if picture.theme else ""
        verb = "animate" if picture.frames else "render"
        parts += [
            f"## {picture.caption}",
            f"![{picture.caption}](pictures/{picture.name}.svg)",
            picture.words,
            f"`neurovis {verb} specs/{picture.spec}.yaml {what}{theme} -o {picture.name}.svg`",
        ]
    return "\n\n".join(parts) + "\n"


if __name__ == "__main__":
    main()
