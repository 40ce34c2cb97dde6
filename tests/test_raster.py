"""Raster pictures: areas and colours that are known exactly, sizes, and frames that do not depend on one another."""

from __future__ import annotations

import io
import math
import subprocess
import sys
import tracemalloc

import numpy as np
import pytest
from hand_networks import use_case_1
from hypothesis import given, settings
from hypothesis import strategies as st
from neurovis_renderers import coverage, films, raster
from neurovis_renderers.lettering import lettering
from neurovis_renderers.raster import Canvas, PillowRenderer
from PIL import Image

from neurovis_spec.compiler.wishes import RenderSettings
from neurovis_spec.scene import Disc, Film, Scene, Text, channels, still, texts
from neurovis_spec.scene.encode import encode
from neurovis_spec.scene.film import film
from neurovis_spec.scene.gains import choose_gains

SIZE = (200, 160)
CASE = use_case_1(200)
GAINS = choose_gains(CASE.network, RenderSettings(), CASE.reached)


def scene(step: int = 160, theme: str = "default") -> Scene:
    return encode(CASE.network, CASE.layout, CASE.snapshot(step), GAINS, RenderSettings(theme=theme))


def short_film(frames: int = 6) -> Film:
    steps = [CASE.snapshot(k) for k in range(150, 150 + frames)]
    return film(CASE.network, CASE.layout, steps, GAINS, RenderSettings(size=(320, 300)), 40)


@settings(max_examples=40, deadline=None)
@given(st.floats(0.6, 12), st.floats(0, math.tau))
def test_a_strokes_area_is_its_width_times_its_length(width: float, angle: float) -> None:
    """On the mean over where it lies between the pixels: right on a diagonal of theirs a thin one comes out darker."""
    areas = []
    for shift in (part / 8 for part in range(8)):
        x, y = 100 - shift * math.sin(angle), 80 + shift * math.cos(angle)
        start = (x - 40 * math.cos(angle), y - 40 * math.sin(angle))
        end = (x + 40 * math.cos(angle), y + 40 * math.sin(angle))
        line = tuple(
            (start[0] + t * (end[0] - start[0]), start[1] + t * (end[1] - start[1])) for t in (0, 1 / 3, 2 / 3, 1)
        )
        mask = coverage.stroke_field(line, width, SIZE).mask(width)
        assert mask.share.max() <= 1
        areas.append(mask.share.sum())
    assert sum(areas) / 8 == pytest.approx(80 * width, rel=0.03)


def test_a_field_serves_every_narrower_width() -> None:
    line = ((10.0, 10.0), (60.0, 120.0), (120.0, 10.0), (180.0, 150.0))
    field = coverage.stroke_field(line, 9, SIZE)
    for width in (0.6, 2.0, 5.5, 9.0):
        kept, fresh = field.mask(width), coverage.stroke_field(line, width, SIZE).mask(width)
        one, other = np.zeros(SIZE[0] * SIZE[1]), np.zeros(SIZE[0] * SIZE[1])
        one[kept.pixels], other[fresh.pixels] = kept.share, fresh.share
        assert np.abs(one - other).max() < 1e-9


@given(st.floats(2, 40), st.floats(60, 140), st.floats(60, 100))
def test_the_area_of_a_disc_and_of_its_ring(radius: float, x: float, y: float) -> None:
    # pixels at the edge count by the distance of their centres: 0.844 at most, where the disc sits on the grid
    assert coverage.disc((x, y), radius, SIZE).share.sum() == pytest.approx(math.pi * radius**2, rel=0.01, abs=0.9)
    around = coverage.ring((x, y), radius, 2.0, SIZE).share.sum()
    assert around == pytest.approx(math.tau * radius * 2, rel=0.04)


def test_the_area_of_a_polygon_and_of_a_rectangle() -> None:
    head = ((50.3, 60.0), (40.0, 66.0), (42.0, 60.0), (40.0, 54.0))
    area = 0.5 * abs(sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(head, (*head[1:], head[0]), strict=True)))
    assert coverage.polygon(head, SIZE).share.sum() == pytest.approx(area, rel=0.02)
    assert coverage.rectangle((10.25, 10.5), (30, 20), 0, SIZE).share.sum() == pytest.approx(600, rel=0.01)
    assert coverage.rectangle((10, 10), (30, 20), 5, SIZE).share.sum() == pytest.approx(
        600 - (4 - math.pi) * 25, rel=0.01
    )


def test_what_lies_outside_is_cut_off() -> None:
    line = ((-50.0, 80.0), (0.0, 80.0), (200.0, 80.0), (300.0, 80.0))
    mask = coverage.stroke_field(line, 4, SIZE).mask(4)
    assert mask.pixels.min() >= 0
    assert mask.pixels.max() < SIZE[0] * SIZE[1]
    assert mask.share.sum() == pytest.approx(800, rel=0.01)


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
    moving = short_film()
    told: list[int] = []
    data = PillowRenderer().animate(moving, suffix, lambda done, total: told.append(done))
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
    moving = short_film(4)
    with Image.open(io.BytesIO(PillowRenderer().animate(moving, suffix))) as picture:
        for frame in range(4):
            picture.seek(frame)
            shown = np.asarray(picture.convert("RGB"), float)
            meant = Canvas(moving.scene).paint(still(moving, frame)).astype(float)
            assert np.abs(shown - meant).mean() < 4, np.abs(shown - meant).mean()


def test_a_gif_lasts_as_long_as_its_frames_also_where_nothing_changes_for_hours() -> None:
    first, second = np.zeros((8, 9, 3), np.uint8), np.zeros((8, 9, 3), np.uint8)
    second[3:5, 2:7] = 200
    data = films.gif(iter([first, first, second, first]), [20, 2_000_000, 40, 30])
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
import resource, sys
import numpy as np
from neurovis_renderers import films

def frames(count):
    for frame in range(count):
        picture = np.full((400, 300, 3), 90, np.uint8)
        picture[frame : frame + 40, 20:220, frame % 3] = 250
        yield picture

make = getattr(films, sys.argv[1])
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
    drawn = scene()
    whole = Canvas(drawn).paint(drawn)
    monkeypatch.setattr(raster, "_MOST_AT_ONCE", 100 * drawn.pixels[0])
    assert len(Canvas(drawn)._bands) > 4
    assert np.abs(Canvas(drawn).paint(drawn).astype(int) - whole).max() <= 1


def test_what_is_remembered_is_bounded_by_its_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(raster, "_MOST_KEPT", 1 << 16)
    drawn = scene()
    canvas = Canvas(drawn)
    before = canvas.paint(drawn)
    (band,) = canvas._bands
    assert 0 < band._masks._bytes <= 1 << 16
    assert band._masks._bytes == sum(mask.nbytes for mask, _ in band._masks._kept.values())
    assert np.array_equal(canvas.paint(drawn), before)


@pytest.mark.parametrize("width", [63.0, 400.0, 4000.0])
def test_a_wide_stroke_covers_what_lies_within_half_its_width(width: float) -> None:
    line = ((20.0, 80.0), (70.0, 80.0), (120.0, 80.0), (180.0, 80.0))
    mask = coverage.stroke_field(line, width, SIZE).mask(width)
    assert mask.share.sum() == pytest.approx(160 * min(width, SIZE[1]), rel=0.01)


def test_a_head_that_hides_the_picture_takes_the_memory_of_the_picture() -> None:
    corners = ((100.0, 80.0), (4000.0, 9000.0), (3000.0, 80.0), (4000.0, -9000.0))
    tracemalloc.start()
    mask = coverage.polygon(corners, (1280, 960))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert len(mask.pixels) > 1000 * 900
    assert peak < 1280 * 960 * 100


def test_a_frame_does_not_depend_on_those_before_it() -> None:
    moving = short_film()
    canvas = Canvas(moving.scene)
    for frame in range(moving.frames):
        frozen = still(moving, frame)
        assert np.array_equal(canvas.paint(frozen), Canvas(frozen).paint(frozen))


def test_texts_are_no_wider_than_the_table_says() -> None:
    for words in ("Function approximation", "rhythm · tanh", "−0.44", "WWWiii", "K"):
        for weight in (400, 600):
            mask = lettering(Text((10, 80), words, 12, "#000000", weight=weight), SIZE)
            columns = mask.pixels % SIZE[0]
            assert columns.max() - 10 <= texts.width(words, 12, weight) + 1
