"""Raster pictures: areas and colours that are known exactly, sizes, and frames that do not depend on one another."""

from __future__ import annotations

import io
import math
import subprocess
import sys
import tracemalloc
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt
import pytest
from hand_networks import use_case_1
from hypothesis import given, settings
from hypothesis import strategies as st
from neurovis_renderers import canvas, coverage, moving, raster
from neurovis_renderers.canvas import paint, slots
from neurovis_renderers.coverage import Fragments
from neurovis_renderers.frames import frames
from neurovis_renderers.lettering import font, lettering
from neurovis_renderers.moving import Moving, Painter
from neurovis_renderers.raster import PillowRenderer
from PIL import Image

from neurovis_spec.compiler.drawing.drawing_settings import RenderSettings
from neurovis_spec.scene import (
    THEMES,
    Arrowhead,
    Disc,
    Film,
    Group,
    Rectangle,
    Scene,
    Spline,
    Text,
    channels,
    still,
    texts,
)
from neurovis_spec.scene.film import film, scene_of_step
from neurovis_spec.scene.gains import choose_gains

SIZE = (200, 160)
CASE = use_case_1(200)
GAINS = choose_gains(CASE.network, RenderSettings(), CASE.reached)


def scene(step: int = 160, theme: str = "default") -> Scene:
    return scene_of_step(CASE.network, CASE.layout, CASE.snapshot(step), GAINS, RenderSettings(theme=theme))


def short_film(frames: int = 6) -> Film:
    steps = [CASE.snapshot(k) for k in range(150, 150 + frames)]
    return film(CASE.network, CASE.layout, steps, GAINS, RenderSettings(size=(320, 300)), 40)


def stroke(points: Sequence[tuple[float, float]], width: float, size: tuple[int, int] = SIZE) -> Fragments:
    """One line of this width."""
    control = np.array(points, float)
    pieces = coverage.flatten(control, np.array([0, len(control)]))
    made = coverage.strokes(pieces, np.full(len(pieces), width / 2), size)
    shares = made.shares(np.full(len(made), width / 2, np.float32))
    found = Fragments(made.owners, made.pixels, shares)
    kept = np.sort(slots(found, 1).order)
    return found.only(kept)


def shares(found: Fragments, size: tuple[int, int] = SIZE) -> npt.NDArray[np.float32]:
    """By pixel, (height, width)."""
    result = np.zeros(size[0] * size[1], np.float32)
    result[found.pixels] = found.shares
    return result.reshape(size[1], size[0])


@settings(max_examples=40, deadline=None)
@given(st.floats(0.6, 12), st.floats(0, math.tau), st.floats(0, 1), st.floats(0, 1))
def test_a_strokes_area_is_its_width_times_its_length(width: float, angle: float, x: float, y: float) -> None:
    start = (100 + x - 40 * math.cos(angle), 80 + y - 40 * math.sin(angle))
    line = [(start[0] + 80 * t * math.cos(angle), start[1] + 80 * t * math.sin(angle)) for t in (0, 1 / 3, 2 / 3, 1)]
    drawn = stroke(line, width)
    assert 0 <= drawn.shares.min() <= drawn.shares.max() <= 1
    assert drawn.shares.sum() == pytest.approx(80 * width, rel=0.02)


@settings(max_examples=40, deadline=None)
@given(st.floats(1, 12), st.floats(0, math.tau), st.floats(0, 1))
def test_a_stroke_covers_of_each_pixel_what_lies_within_half_its_width(width: float, angle: float, x: float) -> None:
    """Compared with 16 × 16 points of each pixel."""
    way, middle = (math.cos(angle), math.sin(angle)), (30 + x, 30.0)
    line = [(middle[0] + t * way[0], middle[1] + t * way[1]) for t in (-15, -5, 5, 15)]
    place = (np.arange(60 * 16) + 0.5) / 16
    px, py = place[None, :] - middle[0], place[:, None] - middle[1]
    inside = (np.abs(px * way[1] - py * way[0]) <= width / 2) & (np.abs(px * way[0] + py * way[1]) <= 15)
    counted = inside.reshape(60, 16, 60, 16).mean(axis=(1, 3))
    drawn = shares(stroke(line, width, (60, 60)), (60, 60))
    sides = np.hypot(*(np.indices((60, 60))[::-1] + 0.5 - np.array(middle)[:, None, None])) < 12
    assert np.abs(drawn - counted)[sides].max() < 0.09
    assert np.abs(drawn - counted).max() < 0.5  # at the corners of its ends


@given(st.floats(0.5, 8), st.floats(0, math.tau))
@settings(max_examples=30, deadline=None)
def test_a_curve_has_no_gap_where_its_direction_turns(width: float, angle: float) -> None:
    """A circle, of four splines: everywhere along it the pixels across it add up to its width."""
    k, radius, parts = 4 / 3 * math.tan(math.pi / 8), 50.0, []
    for quarter in range(4):
        a, b = angle + quarter * math.pi / 2, angle + (quarter + 1) * math.pi / 2
        ca, sa, cb, sb = math.cos(a), math.sin(a), math.cos(b), math.sin(b)
        parts += [(ca, sa), (ca - k * sa, sa + k * ca), (cb + k * sb, sb - k * cb)]
    parts.append(parts[0])
    drawn = shares(stroke([(100 + radius * x, 80 + radius * y) for x, y in parts], width))
    y, x = np.indices(drawn.shape) + 0.5
    turn = np.floor(np.mod(np.arctan2(y - 80, x - 100), math.tau) / math.tau * 36).astype(int)
    around = np.bincount(turn.ravel(), drawn.ravel()) / (math.tau * radius / 36)
    assert around == pytest.approx(width, rel=0.25)
    assert drawn.sum() == pytest.approx(math.tau * radius * width, rel=0.03)
    away = np.abs(np.hypot(x - 100, y - 80) - radius)
    seam = np.hypot(x - 100 - radius * math.cos(angle), y - 80 - radius * math.sin(angle)) < 3 + width
    assert drawn[(away < width / 2 - 0.8) & ~seam].min(initial=1) > 0.97
    assert drawn[away > width / 2 + 0.8].max() < 0.05


def test_a_corner_is_filled() -> None:
    drawn = shares(stroke([(40, 40), (80, 40), (100, 40), (120, 40), (120, 60), (120, 80), (120, 120)], 8))
    assert drawn[37:43, 112:123].min() > 0.96
    assert drawn[36, 123] < 0.5  # it is round
    assert drawn[:35].max() == 0


def test_strokes_know_their_shares_at_every_narrower_width() -> None:
    line = ((10.0, 10.0), (60.0, 120.0), (120.0, 10.0), (180.0, 150.0))
    pieces = coverage.flatten(np.array(line), np.array([0, 4]))
    made = coverage.strokes(pieces, np.full(len(pieces), 4.5), SIZE)
    for width in (0.6, 2.0, 5.5, 9.0):
        wide = made.shares(np.full(len(made), width / 2, np.float32))
        kept = np.zeros(SIZE[0] * SIZE[1])
        np.maximum.at(kept, made.pixels, wide)
        apart = np.abs(kept.reshape(160, 200) - shares(stroke(line, width)))
        assert apart.max() < 0.3  # at the edge of the line, where two pieces meet
        assert apart.sum() < 0.01 * kept.sum()


@given(st.floats(2, 40), st.floats(60, 140), st.floats(60, 100))
def test_the_area_of_a_disc_and_of_its_ring(radius: float, x: float, y: float) -> None:
    # pixels at the edge count by the distance of their centres: 0.844 at most, where the disc sits on the grid
    centre, radii = np.array([[x, y]]), np.array([radius])
    assert coverage.discs(centre, radii, SIZE).shares.sum() == pytest.approx(math.pi * radius**2, rel=0.01, abs=0.9)
    around = coverage.ringed(centre, radii, np.array([2.0]), SIZE)[1].shares.sum()
    assert around == pytest.approx(math.tau * radius * 2, rel=0.04)


@given(st.floats(0.2, 12), st.floats(-20, 180), st.floats(-40, 220), st.floats(0.5, 150), st.booleans(), st.booleans())
def test_a_line_along_an_axis_covers_what_its_pieces_cover(
    width: float, across: float, begin: float, long: float, steep: bool, back: bool
) -> None:
    ends = [(across, begin), (across, begin + long)] if steep else [(begin, across), (begin + long, across)]
    (x0, y0), (x1, y1) = ends[::-1] if back else ends
    line = [(x0 + t * (x1 - x0), y0 + t * (y1 - y0)) for t in (0, 1 / 3, 2 / 3, 1)]
    halves, opaque = np.array([width / 2], np.float32), np.ones(1, np.float32)
    bar = coverage.bars(np.array([[(x0, y0), (x1, y1)]]), halves, opaque, SIZE)
    assert shares(bar) == pytest.approx(shares(stroke(line, width)), abs=0.003)


@pytest.mark.parametrize("kind", ["arrow", "bar"])
@given(st.floats(0, math.tau), st.floats(4, 30), st.floats(1.5, 12), st.floats(0.3, 4))
@settings(max_examples=40, deadline=None)
def test_the_area_of_a_head(kind: Literal["arrow", "bar"], angle: float, length: float, half: float, w: float) -> None:
    head = Arrowhead((100.3, 80.2), (math.cos(angle), math.sin(angle)), length, half, "#000000", kind, w)
    corners = head.points
    pairs = zip(corners, (*corners[1:], corners[0]), strict=True)
    area = abs(0.5 * sum(a[0] * b[1] - b[0] * a[1] for a, b in pairs))
    pixels = paint(Scene(200, 160, replace(THEMES["default"], background="#ffffff"), "head", (Group((head,)),)))
    assert (1 - pixels[:, :, 0] / 255).sum() == pytest.approx(area, rel=0.06, abs=1.2)


def test_the_area_of_a_rectangle() -> None:
    assert coverage.rectangle((10.25, 10.5), (30, 20), 0, SIZE).shares.sum() == pytest.approx(600, rel=0.01)
    assert coverage.rectangle((10, 10), (30, 20), 5, SIZE).shares.sum() == pytest.approx(
        600 - (4 - math.pi) * 25, rel=0.01
    )


def test_what_lies_outside_is_cut_off() -> None:
    found = stroke(((-50.0, 80.0), (0.0, 80.0), (200.0, 80.0), (300.0, 80.0)), 4)
    assert found.pixels.min() >= 0
    assert found.pixels.max() < SIZE[0] * SIZE[1]
    assert found.shares.sum() == pytest.approx(800, rel=0.01)


@pytest.mark.parametrize("theme", ["default", "dark"])
def test_discs_have_the_scenes_colour_at_a_pixel_beside_their_label(theme: str) -> None:
    drawn = scene(theme=theme)
    pixels = np.asarray(Image.open(io.BytesIO(PillowRenderer().draw(drawn, ".png"))).convert("RGB"))
    assert pixels.shape[:2] == drawn.pixels[::-1]
    discs = [s for s in drawn.shapes() if isinstance(s, Disc)]
    assert len(discs) == 12
    for disc in discs:
        x, y = int(drawn.density * disc.centre[0]), int(drawn.density * (disc.centre[1] - 0.72 * disc.radius))
        assert tuple(pixels[y, x]) == channels(disc.fill)
    assert tuple(pixels[0, 0]) == channels(drawn.theme.background)


@pytest.mark.parametrize("suffix", [".png", ".gif", ".webp"])
def test_stills_open_in_the_right_size(suffix: str) -> None:
    drawn = scene()
    data = PillowRenderer().draw(drawn, suffix)
    with Image.open(io.BytesIO(data)) as picture:
        assert picture.size == drawn.pixels
        assert f".{(picture.format or '').lower()}" == suffix
    assert data == PillowRenderer().draw(drawn, suffix)


@pytest.mark.parametrize("suffix", [".gif", ".webp"])
def test_films_have_their_frames_and_last_as_long_as_they_should(suffix: str) -> None:
    filmed = short_film()
    told: list[int] = []
    data = PillowRenderer().animate(filmed, suffix, lambda done, total: told.append(done))
    lasts = []
    with Image.open(io.BytesIO(data)) as picture:
        assert picture.n_frames == 6  # type: ignore[attr-defined]
        for frame in range(6):
            picture.seek(frame)
            picture.load()
            lasts.append(picture.info["duration"])
        assert picture.info["loop"] == 0
    assert sum(lasts) == pytest.approx(150, abs=10)
    assert told == [1, 2, 3, 4, 5, 6]


@pytest.mark.parametrize("suffix", [".gif", ".webp"])
def test_films_show_their_frames(suffix: str) -> None:
    filmed = short_film(4)
    with Image.open(io.BytesIO(PillowRenderer().animate(filmed, suffix))) as picture:
        for frame in range(4):
            picture.seek(frame)
            shown = np.asarray(picture.convert("RGB"), float)
            meant = paint(still(filmed, frame)).astype(float)
            assert np.abs(shown - meant).mean() < 4, np.abs(shown - meant).mean()


def test_a_gif_lasts_as_long_as_its_frames_also_where_nothing_changes_for_hours() -> None:
    first, second = np.zeros((8, 9, 3), np.uint8), np.zeros((8, 9, 3), np.uint8)
    second[3:5, 2:7] = 200
    file = io.BytesIO()
    raster.gif(iter([first, first, second, first]), [20, 2_000_000, 40, 30], file)
    data = file.getvalue()
    lasts, shown = [], []
    with Image.open(io.BytesIO(data)) as picture:
        for frame in range(picture.n_frames):  # type: ignore[attr-defined]
            picture.seek(frame)
            lasts.append(picture.info["duration"])
            shown.append(int(np.asarray(picture.convert("RGB"))[4, 4, 0]))
    assert lasts[-2:] == [40, 30]
    assert sum(lasts) == 2_000_090
    assert shown == [0, 0, 0, 0, 200, 0]


_BOUNDED = """
import io, resource, sys
import numpy as np
from neurovis_renderers import raster

def frames(count):
    for frame in range(count):
        picture = np.full((400, 300, 3), 90, np.uint8)
        picture[frame : frame + 40, 20:220, frame % 3] = 250
        yield picture

def make(pictures, lasts):
    file = io.BytesIO()
    getattr(raster, sys.argv[1])(pictures, lasts, file)
    return file.getvalue()

make(frames(3), [40] * 3)
pages = int(open("/proc/self/statm").read().split()[0])
resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + (32 << 20), -1))
print(len(make(frames(200), [40] * 200)))
"""


@pytest.mark.parametrize("kind", ["gif", "webp"])
def test_a_film_takes_the_memory_of_a_few_pictures(kind: str) -> None:
    """Two hundred of half a megabyte do not fit into the 32 that are left."""
    done = subprocess.run([sys.executable, "-c", _BOUNDED, kind], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert 10_000 < int(done.stdout) < 8 << 20


def test_a_big_picture_is_the_same_in_bands(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn, filmed = scene(), short_film()
    whole, frame = paint(drawn), Painter(Moving(filmed)).paint(3)
    monkeypatch.setattr(canvas, "MOST_AT_ONCE", 100 * drawn.pixels[0])
    assert len(list(canvas.bands(drawn.pixels))) > 4
    assert np.abs(paint(drawn).astype(int) - whole).max() <= 1
    monkeypatch.setattr(canvas, "MOST_AT_ONCE", 100 * filmed.scene.pixels[0])
    assert np.abs(Painter(Moving(filmed)).paint(3).astype(int) - frame).max() <= 1


@pytest.mark.parametrize("limit", ["_MOST_SHAPES", "_MOST_PIECES", "_MOST_TOUCHED"])
def test_a_picture_is_the_same_whatever_is_drawn_at_once(limit: str, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = scene()
    whole = paint(drawn)
    monkeypatch.setattr(canvas, limit, 40)
    apart = np.abs(paint(drawn).astype(int) - whole).max(axis=2)
    assert np.mean(apart > 2) < 5e-4  # where pieces of one line overlap


def test_what_others_hide_is_not_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of two thousand lines behind a box, fragments are made of no more than are drawn at once with it."""
    made = []
    strokes = coverage.strokes

    def counted(*arguments: object) -> coverage.Strokes:
        found = strokes(*arguments)  # type: ignore[arg-type]
        made.append(len(found))
        return found

    monkeypatch.setattr(coverage, "strokes", counted)
    monkeypatch.setattr(canvas, "_MOST_PIECES", 500)
    theme = THEMES["default"]
    lines = tuple(
        Spline(((10.0, 10.0), (60.0, 10.0 + k / 10), (120.0, 10.0), (190.0, 150.0)), "#123456", 1.5)
        for k in range(2000)
    )
    box = Rectangle((0, 0), 200, 160, 0, "#ffffff", "#ffffff", 0)
    for groups in ((Group(lines),), (Group(lines), Group((box,)))):
        paint(Scene(200, 160, theme, "lines", groups))
        made.append(-1)
    first = made.index(-1)
    assert sum(made[:first]) > 100_000
    assert sum(made[first + 1 : -1]) < sum(made[:first]) / 5


@pytest.mark.parametrize("width", [63.0, 400.0, 4000.0])
def test_a_wide_stroke_covers_what_lies_within_half_its_width(width: float) -> None:
    line = ((20.0, 80.0), (70.0, 80.0), (120.0, 80.0), (180.0, 80.0))
    assert stroke(line, width).shares.sum() == pytest.approx(160 * min(width, SIZE[1]), rel=0.01)


def test_a_group_that_is_seen_in_part_is_drawn_as_one() -> None:
    """Where its line lies on its glow, the glow does not shine through."""
    theme, line = THEMES["default"], ((20.0, 80.0), (70.0, 80.0), (120.0, 80.0), (180.0, 80.0))
    shapes = (Spline(line, "#000000", 40.0), Spline(line, "#ff0000", 20.0))
    pixels = paint(Scene(200, 160, theme, "faint", (Group(shapes, opacity=0.25),)))
    assert pixels[80, 100].tolist() == [255, 191, 191]
    assert pixels[65, 100].tolist() == [191, 191, 191]
    assert pixels[10, 100].tolist() == [255, 255, 255]


def test_what_covers_much_takes_the_memory_of_the_picture() -> None:
    """A head and a line that hide the picture wherever they are."""
    theme = THEMES["default"]
    line = ((100.0, 80.0), (400.0, 900.0), (800.0, -300.0), (1100.0, 80.0))
    shapes = (Spline(line, "#123456", 4000.0), Arrowhead((100, 80), (1, 0), 9000, 9000, "#654321"))
    drawn = Scene(1280, 960, theme, "big", (Group(shapes),))
    tracemalloc.start()
    pixels = paint(drawn)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert (pixels != 255).any(axis=2).mean() > 0.9
    assert peak < 1280 * 960 * 300


def test_a_frame_does_not_depend_on_those_before_it() -> None:
    filmed = short_film()
    shared = Moving(filmed)
    painter = Painter(shared)
    for frame in (3, 0, 5, 5, 1, 2, 4):
        assert np.array_equal(painter.paint(frame), Painter(shared).paint(frame))


def test_the_frames_of_a_film_are_those_of_its_stills() -> None:
    filmed = short_film()
    seen = [pixels.astype(int) for pixels in frames(filmed)]
    assert len(seen) == filmed.frames
    for frame, pixels in enumerate(seen):
        apart = np.abs(pixels - paint(still(filmed, frame)))
        assert apart.mean() < 0.05
        assert np.mean(apart > 8) < 1e-3


def test_a_film_in_which_much_would_have_to_be_kept_is_painted_frame_by_frame(monkeypatch: pytest.MonkeyPatch) -> None:
    filmed = short_film()
    monkeypatch.setattr(moving, "MOST_KEPT", 100)
    for frame, pixels in enumerate(frames(filmed)):
        assert np.array_equal(pixels, paint(still(filmed, frame)))


def test_what_has_not_changed_is_not_drawn_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a film whose colours stay but for one neuron's, a frame takes the pixels of that neuron and of the caption."""
    film_of = short_film()
    values = np.repeat(film_of.fill_values[:1], film_of.frames, axis=0)
    values[:, 3] = film_of.fill_values[:, 3]
    quiet = replace(
        film_of,
        fill_values=values,
        line_values=np.repeat(film_of.line_values[:1], film_of.frames, axis=0),
        line_widths=np.repeat(film_of.line_widths[:1], film_of.frames, axis=0),
        glow_widths=np.repeat(film_of.glow_widths[:1], film_of.frames, axis=0),
    )
    disc = next(shape for group in quiet.scene.groups if group.id == quiet.fills[3] for shape in group.shapes)
    assert isinstance(disc, Disc)
    (band,) = Moving(quiet).bands
    assert len(band.pixels) < 4 * (disc.radius * quiet.scene.density + 1) ** 2


def test_texts_are_no_wider_than_the_table_says() -> None:
    for words in ("Function approximation", "rhythm · tanh", "−0.44", "WWWiii", "K"):
        for weight in (400, 600):
            found = lettering(Text((10, 80), words, 12, "#000000", weight=weight), SIZE)
            columns = found.pixels % SIZE[0]
            assert columns.max() - 10 <= texts.width(words, 12, weight) + 1


def test_the_font_is_the_shipped_one_and_the_first_that_an_svg_asks_for() -> None:
    for bold in (False, True):
        made = font(40, bold)
        assert made.getname() == (texts.FAMILIES[0], "Bold" if bold else "Book")
        assert Path(str(made.path)).parent == Path(canvas.__file__).parent / "fonts"
        weight = 700 if bold else 400
        for character in "Kx0→−₁·…ΔWi ":
            assert made.getlength(character) / 40 <= texts.width(character, 1, weight) + 0.02


def test_a_text_stands_on_a_whole_pixel_as_in_browsers() -> None:
    rows = [lettering(Text((10, y), "H", 20, "#000000"), SIZE).pixels // SIZE[0] for y in (80.0, 80.4, 80.5, 81.0)]
    assert [int(row.max()) for row in rows] == [79, 79, 80, 80]


@pytest.mark.parametrize("density", [1.0, 1.37, 2.0])
def test_dots_of_a_dashed_line_are_evenly_spaced(density: float) -> None:
    """Dots shorter than a pixel, as dotted lines have them: none is left out."""
    line, period = [(5.0, 10.0), (40.0, 10.0), (70.0, 10.0), (105.0, 10.0)], 5.12 * density
    found = coverage.dashed(line, 1.6, (0.01 * density, 5.11 * density), (120, 20))
    shares = np.zeros(120 * 20)
    shares[found.pixels] = found.shares
    across = shares.reshape(20, 120).sum(axis=0)
    dots = [5 + k * period for k in range(int(100 / period) + 1)]
    around = [float(across[round(dot - 1.5) : round(dot + 1.5)].sum()) for dot in dots]
    assert min(around) > 0.8 * math.pi * 0.8**2
    assert float(across.sum()) == pytest.approx(len(dots) * math.pi * 0.8**2, rel=0.25)
