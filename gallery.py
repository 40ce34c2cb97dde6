"""The gallery: every example as a picture at a telling step, in every theme, and as graphviz' dot arranges it.

In: ``specs/``. Out: ``docs/pictures/``, ``docs/gallery.md`` and ``docs/themes.md``, the same bytes each time with the
same dot (which must be installed). Run by ``make gallery``; ``python gallery.py NAME… --to FOLDER`` draws some of the
pictures elsewhere.
"""

from __future__ import annotations

import argparse
import math
import re
import shutil
import sys
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE / "benchmarks"))

from layout_peers import Timed, directed, nested  # noqa: E402

import neurovis_spec as nv  # noqa: E402
from neurovis_spec.layout import LayoutProblem  # noqa: E402
from neurovis_spec.layout.metrics import metrics  # noqa: E402
from neurovis_spec.layout.problem import problem_of  # noqa: E402
from neurovis_spec.runtime.recording import Recording  # noqa: E402
from neurovis_spec.scene.film import scene_of_step  # noqa: E402
from neurovis_spec.scene.renderers import drawing  # noqa: E402
from neurovis_spec.scene.shown import LeftOut  # noqa: E402

#: A number in a picture; and how far two may be apart that differ by the last digits of a machine's functions.
_NUMBER = re.compile(r"(?<![#\w])[+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?")
_NEXT = 1e-6
#: What a picture tells those who point at it: a page shows it as an image, in which nobody can.
_TOLD = re.compile(r"(<g[^>]*>)<title>[^<]*</title>")
_DATA = re.compile(r' data-[\w-]+="[^"]*"')
#: Measures of a layout, as the page heads them.
_MEASURES = {
    "crossings": "crossings",
    "edges_over_neurons": "lines over neurons",
    "overlaps": "discs that overlap",
    "flow": "along the direction",
    "area": "area",
}


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
    #: what it shows beside the network or in its place, and of views over time how many steps
    views: tuple[str, ...] = ()
    window: int | None = None
    #: groups and instances that are one glyph each; neurons that are shown with all that they are connected to
    collapse: tuple[str, ...] = ()
    focus: str | None = None
    #: without what it tells those who point at it
    plain: bool = False

    @property
    def whole(self) -> bool:
        """Whether it is a still of the network, all of it, in the spec's own theme."""
        return not (self.theme or self.frames or self.views not in ((), ("network",)) or self.collapse or self.focus)


PICTURES = (
    Picture(
        "cpg_rbf_learning",
        "cpg_rbf",
        90,
        "Use case 1, moving: a period of learning",
        "The rhythm of C1 and C2 wakes one kernel after another, from left to right and round again (K1 and K8, which "
        "sit at the same place, together). Where O misses its target T, the connections of the kernels that are awake "
        "glow: they are changing.",
        frames=129,
    ),
    Picture(
        "cpg_rbf",
        "cpg_rbf",
        90,
        "Use case 1, in the midst of learning",
        "The paper's Figure 5A. C1 is weakly negative, C2 strongly positive: K1 to K4 and K8 are active. O is too high "
        "by 0.41 (the caption says so), so the connections of these kernels glow, most of all those of K2 and K3, "
        "the most active: they turn to inhibition. The lines between C1 and C2 have a scale of their own; they "
        "would be grey beside the others.",
    ),
    Picture(
        "cpg_rbf_dark",
        "cpg_rbf",
        1248,
        "Use case 1 nine periods later, in the dark theme",
        "The paper's Figure 5C. C1, C2 and the kernels are as they were, the glow is faint, and the thickness has "
        "stayed: that is what has been learned so far. The connection of K2 is the thickest and inhibits O, which "
        "follows T: both have the same colour, and the error is 0.09.",
        theme="dark",
    ),
    Picture(
        "cpg_rbf_figure",
        "cpg_rbf",
        250,
        "Use case 1 as a figure: the network, and beneath it what it does in time",
        "The paper's Figure 4. The rhythm of C1 and C2; the weights that K2 and K4 have to O, one of which becomes "
        "inhibition and the other excitation; the ripple that runs through the kernels, in the colours of the network. "
        "O comes to follow T. The line marks the step that the network above it shows.",
        views=("network", "traces: C1, C2", "weights: K2 -> O, K4 -> O", "raster: K, O", "traces: O, T"),
        window=500,
    ),
    Picture(
        "cpg_printed",
        "cpg_printed",
        2020,
        "The oscillator alone, with the weights that the paper prints",
        "Both neurons excite themselves with weight 1; what turns the rhythm are the two thin lines between them, of "
        "opposite sign. The legend shows how small the activities and the signals are at which the colours are full.",
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
        "sound",
        "sound",
        92,
        "Spikes: where a sound comes from",
        "The sound is on the left: the left ear clicked eight steps ago, the right one four steps later. A line "
        "with a bead takes two to five steps, so that both clicks came to D5, and to no other, in the same step. "
        "It spiked three steps ago; the spike fades (the legend says how fast), so that the eye can see it. It "
        "excites M1, which turns the head to the left, and inhibits M2.",
    ),
    Picture(
        "sound_figure",
        "sound",
        431,
        "The same with its spikes",
        "The raster has a mark for each spike: D5 while the sound is on the left, D3 while it is in the middle, D1 "
        "from two seconds on. M1 and M2 add the spikes up and forget them slowly; the sound has just passed to the "
        "right, and they have changed places.",
        views=("network", "raster: L, R, D", "traces: M1, M2"),
    ),
    Picture(
        "reward",
        "reward",
        14364,
        "A leg that learns from reward alone",
        "An episode has just ended, and all connections to O change at once: by how much, reward and policy say "
        "(dotted). L reaches B twice, at once and (the line with a bead) a step later, with opposite signs: B is "
        "the difference.",
    ),
    Picture(
        "stick_insect",
        "stick_insect/stick_insect",
        150,
        "Conductances: a leg of a stick insect",
        "Three joints, each with a half-centre: C1 and C2 inhibit each other (lines that end in bars) and take turns. "
        "The leg is lifted, since C1 of LD is up; through S the other joints feel that, and are to follow. A line has "
        "the colour of the current that flows through it.",
        views=("network",),
    ),
    Picture(
        "worm",
        "worm/worm",
        100,
        "Gap junctions and graded synapses: a worm is touched",
        "The head is to the left, the back up. ALM and AVM have been touched for 25 ms, and AVD and AVA follow; the "
        "motor neurons of A type, which move the worm back, have come further than those of B type. Lines without ends "
        "are gap junctions.",
        views=("network",),
    ),
    Picture(
        "balance",
        "balance",
        1151,
        "Spikes: excitation and inhibition in balance",
        "E9 and I3 fire, since spikes arrive that E3 and E2 sent 1.5 ms ago: these, and I2, which fired with them, "
        "fade. A line takes the colour of the spike that leaves, blue where it adds to the potential of its target and "
        "orange where it takes away.",
        views=("network",),
    ),
    Picture(
        "balance_figure",
        "balance",
        1151,
        "The same with a raster of 100 ms",
        "A mark for each spike. Each cell is driven above its threshold, and would fire regularly if it were alone.",
        views=("network", "raster: E, I"),
        window=1000,
    ),
    Picture(
        "walk",
        "walk/walk",
        52,
        "Use case 2: a hexapod that learns to walk",
        "In the first episode. The network is that of use case 1; what guides its learning (dotted) is N, the noise: "
        "O + N swings the legs of a [simulated robot](../specs/walk/hexapod.xml), C1 lifts them, and the way that they "
        "make in an episode is the reward. Nothing has been learned yet: K to O are as thin as they can be. "
        "[250 episodes later](pictures/walk.webp) it walks.",
        views=("network",),
    ),
    Picture(
        "hexapod",
        "hexapod/hexapod",
        586,
        "Use case 3, walking: three ripples on the line",
        "The rhythm enters the upper delay line at DL6 and passes over the right legs, from hind to front, then over "
        "the left ones. At this frequency every second neuron of DL6 to DL11 is active, and three legs are lifted: "
        "left2, right1 and right3. This is the tripod gait. The lower line swings them forward.",
    ),
    Picture(
        "hexapod_legs",
        "hexapod/hexapod",
        586,
        "Use case 3, a leg a glyph",
        "The same step; each leg is one glyph of 22 neurons in the colour of their mean activity, with its connections "
        "added up. The three legs that are lifted, left2, right1 and right3, are the most active. Each takes from both "
        "delay lines, and hands on to the leg behind it.",
        collapse=("left", "right"),
    ),
    Picture(
        "hexapod_focus",
        "hexapod/hexapod",
        586,
        "Use case 3, one neuron and what it is connected to",
        "The rhythm enters the upper delay line at DL6: at once, and twice later with the opposite sign (the lines "
        "with a bead), so that a swing is over whatever the frequency. DL6 hands it on to DL7 and to B, from where it "
        "enters the lower line, and moves two joints of right3. What it is not connected to is small.",
        focus="DL6",
    ),
    Picture(
        "hexapod_matrix",
        "hexapod/hexapod",
        586,
        "Use case 3 as a matrix: six legs of one make",
        "A row is what a neuron sends, a column what it takes in. The six blocks on the diagonal are the legs, all "
        "alike; above them the delay lines reach into each leg once or twice. What leads from leg to leg are the "
        "single cells beside the diagonal: news of obstacles.",
        views=("matrix",),
    ),
    Picture(
        "hexapod_obstacle",
        "hexapod/hexapod",
        870,
        "Use case 3, learning to step over a beam",
        "The front legs hit the second beam some 80 steps ago, and d6 and d7 carry the news to the legs behind. The "
        "left middle leg stepped high too early and has just hit the beam, too (H is active): the connection that "
        "warned it glows. Thicker, it keeps the news up for longer, and the leg will step high later.",
    ),
    Picture(
        "hexapod_floor",
        "hexapod/hexapod",
        2341,
        "Use case 3, remembering the floor",
        "All legs but the right front one walk on the soft floor, where contact comes late: S is active in left1, "
        "left3 and right2, which have just come down, and K is high in all five. The S of right1 has been silenced "
        "for 31 steps; its K, lower since its floor is rigid, is where it was.",
    ),
)

#: In the order of the columns of the page of themes; the first is that of the gallery.
THEMES = ("default", "dark", "print", "paper")


def themed() -> list[Picture]:
    """Every still of a whole network in the other themes."""
    return [
        replace(picture, name=f"themes/{picture.name}_{theme}", theme=theme, plain=True)
        for picture in PICTURES
        if picture.whole
        for theme in THEMES[1:]
    ]


#: What dot's drawing of a network shows beside ours, by the name of our picture.
BESIDE = {
    "cpg_rbf": "dot puts C2 a rank below C1, though neither comes first, and has to lead what C1 sends around it; the"
    " kernels are out of order. Told of no boxes it crosses fewer lines, and the rhythm is in two places.",
    "cpg_printed": "Much the same.",
    "short_term_memory": "Much the same.",
    "ring": "dot knows no rings and makes ranks of what has neither a first nor a last neuron: fewer crossings, and"
    " nobody sees a ring. Here the author asks for one (`arrange: {R: ring}`), and opposite lines run side by side.",
    "mlp": "Much the same, but for the order of the neurons.",
    "hebbian": "Much the same.",
    "sound": "Much the same.",
    "reward": "As above, C2 stands below C1, and the kernels are out of order. G stands near what it drives; ours near"
    " what drives it.",
    "stick_insect": "Each joint is drawn in its own way, and they stand one above the other.",
    "worm": "dot has no place for what is where in the worm, and makes ranks of what goes around in circles.",
    "balance": "dot crosses fewer lines only where it is told of no boxes.",
    "walk": "As above, C2 stands below C1, and the kernels are out of order.",
    "hexapod": "dot draws six legs six times: each has other ranks and another place for its parts, left and right are"
    " no mirror images, and the delay lines run down, one beside the other. Free of all that it needs less room and may"
    " cross fewer lines. Here all legs are one drawing, so that only colours differ between them, and both delay lines"
    " are rows above the legs that they move.",
}


def main(arguments: Sequence[str] | None = None) -> None:
    """Draw the pictures, and write the page unless only some of them are wanted."""
    parser = argparse.ArgumentParser(description="Draw the examples.")
    parser.add_argument("names", nargs="*", help="pictures to draw (default: all, and the page)")
    parser.add_argument("--to", type=Path, default=HERE / "docs" / "pictures", metavar="FOLDER")
    options = parser.parse_args(arguments)
    pictures = (*PICTURES, *themed())
    wanted = options.names or [picture.name for picture in pictures] + [f"{name}_dot" for name in BESIDE]
    if shutil.which("dot") is None and any(name.endswith("_dot") for name in wanted):
        sys.exit("the gallery shows dot's drawings beside ours and needs dot (on Debian: apt-get install graphviz)")
    for picture in pictures:
        if picture.name in wanted:
            draw(picture, options.to / f"{picture.name}.svg")
        if f"{picture.name}_dot" in wanted:
            draw_as_dot(picture, options.to / f"{picture.name}_dot.svg")
    if not options.names:
        (HERE / "docs" / "gallery.md").write_text(page(), encoding="utf-8")
        (HERE / "docs" / "themes.md").write_text(themes_page(), encoding="utf-8")


@cache
def compiled(spec: str) -> nv.CompiledNetwork:
    """The network of a spec."""
    return nv.compile(HERE / "specs" / f"{spec}.yaml")


@cache
def recorded(spec: str) -> Recording | None:
    """A run that the stills of a spec show; None where there is one alone, which runs as far as it needs."""
    stills = [one for one in PICTURES if one.spec == spec and not one.frames]
    network = compiled(spec)
    steps = max(network.network.steps if one.views else one.step + 1 for one in stills)
    return network.run(steps) if len(stills) > 1 else None


def draw(picture: Picture, path: Path) -> None:
    """Draw one."""
    network, before = compiled(picture.spec), path.read_bytes() if path.exists() else b""
    path.parent.mkdir(parents=True, exist_ok=True)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        warnings.simplefilter("ignore", LeftOut)
        if picture.frames:
            network.animate(path, steps=picture.frames, start=picture.step, theme=picture.theme)
        else:
            views = picture.views or None
            network.render(
                path,
                step=picture.step,
                recording=recorded(picture.spec),
                theme=picture.theme,
                view=views,
                window=picture.window,
                collapse=picture.collapse,
                focus=picture.focus,
            )
    if picture.plain:
        path.write_text(untold(path.read_text(encoding="utf-8")), encoding="utf-8")
    if alike(before.decode(), path.read_text(encoding="utf-8")):
        path.write_bytes(before)
    _say(path)


def untold(svg: str) -> str:
    """A picture without what it tells those who point at it."""
    return _DATA.sub("", _TOLD.sub(r"\1", svg))


def draw_as_dot(picture: Picture, path: Path) -> None:
    """Draw the same step of the same network with dot's positions and splines, by our renderer, without tooltips."""
    network = compiled(picture.spec)
    layout, _ = _by_dot(nested, problem_of(network.network))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        snapshot = network.run(picture.step + 1).snapshot(picture.step)
    title = f"{network.network.title or network.name}: by dot"
    settings = replace(network.network.render, title=title, size=None)
    scene = scene_of_step(network.network, layout, snapshot, network.gains, settings)
    size = network.network.render.size
    if size is not None:  # as high as ours, and as wide as dot's then is
        wide, high = scene.pixels
        settings = replace(settings, size=(round(wide * size[1] / high), size[1]))
        scene = scene_of_step(network.network, layout, snapshot, network.gains, settings)
    groups = tuple(replace(group, data={}, title="") for group in scene.groups)
    drawn = drawing(replace(scene, groups=groups), ".svg")
    if not path.exists() or not alike(path.read_text(encoding="utf-8"), drawn.decode()):
        path.write_bytes(drawn)
    _say(path)


def _by_dot(way: Callable[[LayoutProblem, float], Timed | None], problem: LayoutProblem) -> Timed:
    found = way(problem, 60)
    if found is None:
        raise RuntimeError(f"dot did not lay out {problem.network}")
    return found


def _say(path: Path) -> None:
    print(f"{path.stem:<28}{path.stat().st_size / 1024:6.0f} KiB   {path}")


def alike(one: str, other: str) -> bool:
    """Whether two pictures differ by no more than the last digits of their numbers, as those of two machines do after
    thousands of steps; then the one that is there may stay.

    >>> alike('<path d="M1.5 2"/>', '<path d="M1.50000001 2"/>'), alike("M1 2", "M1 3"), alike("#0072b2", "#0072b3")
    (True, False, False)
    """
    if _NUMBER.sub("0", one) != _NUMBER.sub("0", other):
        return False
    numbers = zip(_NUMBER.findall(one), _NUMBER.findall(other), strict=True)
    return all(a == b or math.isclose(float(a), float(b), rel_tol=_NEXT) for a, b in numbers)


def page() -> str:
    """The page that shows them all."""
    parts = [
        *shown(),
        "## Beside dot",
        "The same steps of the same networks; on the right the positions and splines are those of graphviz' dot, drawn"
        " by the same renderer with the same colours and thickness. dot's nodes are as wide as our discs and its ranks"
        " as far apart, and it is told the direction and, as nested clusters, the boxes and the instances of modules."
        " The tables count on the routes as drawn (`neurovis layout --metrics`): an area is in squares of the distance"
        " of neighbours, and the last row is dot told of no boxes.",
    ]
    for picture in PICTURES:
        if picture.name in BESIDE:
            parts += beside(picture)
    return "\n\n".join(parts) + "\n"


def shown() -> list[str]:
    """The paragraphs that show the pictures, each with the command that draws it."""
    parts = [
        "# Gallery",
        "Every example in `specs/`, drawn at a telling step. Colour is activity and signal, thickness is weight, glow"
        " is change; the legend of each picture says on which scale. The same pictures in the"
        " [other themes](themes.md); at the end they stand [beside dot's](#beside-dot). Made by `make gallery`, which"
        " needs graphviz' dot.",
    ]
    for picture in PICTURES:
        what = f"--steps {picture.frames} --from {picture.step}" if picture.frames else f"--step {picture.step}"
        theme = f" --theme {picture.theme}" if picture.theme else ""
        verb = "animate" if picture.frames else "render"
        views = "".join(f' --view "{view}"' if " " in view else f" --view {view}" for view in picture.views)
        window = f" --window {picture.window}" if picture.window else ""
        excerpt = "".join(f" --collapse {ref}" for ref in picture.collapse)
        excerpt += f" --focus {picture.focus}" if picture.focus else ""
        parts += [
            f"## {picture.caption}",
            f"![{picture.caption}](pictures/{picture.name}.svg)",
            picture.words,
            f"`neurovis {verb} specs/{picture.spec}.yaml {what}{theme}{views}{window}{excerpt} -o {picture.name}.svg`",
        ]
    return parts


def themes_page() -> str:
    """The page that shows the whole networks in every theme."""
    parts = [
        "# Themes",
        "The stills of the [gallery](gallery.md) in all themes, left to right: `default`, `dark` (on a dark page),"
        " `print` (on paper, also in greys) and `paper` (the red, grey and green of the NeuroVis paper)."
        " `--theme dark`, or `render: {theme: dark}`. Made by `make gallery`.",
    ]
    for picture in PICTURES:
        if picture.whole:
            name = picture.name
            files = [f"pictures/{name}.svg", *(f"pictures/themes/{name}_{theme}.svg" for theme in THEMES[1:])]
            cells = " | ".join(f"![{theme}]({file})" for theme, file in zip(THEMES, files, strict=True))
            parts += [
                f"## {picture.caption}",
                f"| {' | '.join(THEMES)} |\n|{' :---: |' * len(THEMES)}\n| {cells} |",
            ]
    return "\n\n".join(parts) + "\n"


def beside(picture: Picture) -> list[str]:
    """Ours and dot's side by side, and what they measure."""
    network = compiled(picture.spec)
    problem, name = problem_of(network.network), picture.name
    rows = {
        "NeuroVis": network.layout().metrics(),
        "dot": metrics(_by_dot(nested, problem)[0], problem),
        "dot, no boxes": metrics(_by_dot(directed, problem)[0], problem),
    }
    if not problem.boxes and not problem.modules:
        del rows["dot, no boxes"]
    table = ["|  | " + " | ".join(_MEASURES.values()) + " |", "| --- |" + " ---: |" * len(_MEASURES)]
    table += [f"| {who} | " + " | ".join(_told(found[key]) for key in _MEASURES) + " |" for who, found in rows.items()]
    return [
        f"### {network.network.title or network.name}",
        f"| NeuroVis | dot |\n| :---: | :---: |\n"
        f"| ![by NeuroVis](pictures/{name}.svg) | ![by dot](pictures/{name}_dot.svg) |",
        BESIDE[name],
        "\n".join(table),
    ]


def _told(value: float | int) -> str:
    return f"{value:,}" if isinstance(value, int) else f"{value:.2f}" if value <= 1 else f"{value:,.1f}"


if __name__ == "__main__":
    main()
