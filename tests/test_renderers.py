"""Every renderer that needs no browser draws the scenes of ``renderer_conformance`` alike, and says what it can do."""

from __future__ import annotations

import io
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pypdfium2
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from neurovis_renderers import coverage, truetype
from neurovis_renderers.animated_svg import AnimatedSvgRenderer
from neurovis_renderers.canvas import paint
from neurovis_renderers.frames import frames
from neurovis_renderers.lettering import FONTS
from neurovis_renderers.pdf import PdfRenderer
from neurovis_renderers.raster import PillowRenderer
from neurovis_renderers.svg import SvgRenderer
from neurovis_renderers.video import VideoRenderer
from PIL import Image as Pillow
from renderer_conformance import ALIKE, SCENES, short_film, similarity
from test_videos import decoded

from neurovis_spec import plugins
from neurovis_spec.scene import THEMES, Group, Renderer, RendererCapabilities, Scene, Text, still
from neurovis_spec.scene.model import StreamingRenderer

OURS: tuple[Renderer, ...] = (
    SvgRenderer(),
    AnimatedSvgRenderer(),
    PillowRenderer(),
    PdfRenderer(),
    VideoRenderer(),
)


def page(data: bytes, pixels: tuple[int, int]) -> Pillow.Image:
    """The page of a PDF in this size."""
    document = pypdfium2.PdfDocument(data)
    assert len(document) == 1
    shown: Pillow.Image = document[0].render(scale=pixels[0] / document[0].get_width()).to_pil().convert("RGB")
    return shown if shown.size == pixels else shown.resize(pixels)


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.floats(0, 6.28), min_size=1, max_size=9, unique=True),
    st.floats(2, 30),
    st.floats(0, 12),
    st.tuples(st.floats(-20, 60), st.floats(-20, 60)),
)
def test_a_polygon_covers_as_much_as_it_is_large_also_where_others_lie_in_front(
    angles: list[float], radius: float, margin: float, centre: tuple[float, float]
) -> None:
    """Corners on a circle, and all that lies within a margin of them, on a page that it leaves at any side."""
    ways = np.sort(np.array(angles))
    corners = np.array(centre) + radius * np.stack([np.cos(ways), np.sin(ways)], axis=1)
    made = coverage.rounded(corners[None], np.array([margin]))
    one, two = np.array([0]), np.array([0, 1])
    found = coverage.polygons(made - (-100, -100), one, (300, 300)).fragments()
    edges = np.roll(corners, -1, axis=0) - corners
    inner = 0.5 * abs(
        float((corners[:, 0] * np.roll(corners[:, 1], -1) - corners[:, 1] * np.roll(corners[:, 0], -1)).sum())
    )
    area = inner + margin * float(np.hypot(*edges.T).sum()) + np.pi * margin**2
    assert float(found.shares.sum()) == pytest.approx(area, rel=0.03, abs=1.0)
    page = coverage.polygons(made, one, (40, 40)).fragments()
    there = np.zeros(300 * 300)
    there[found.pixels] = found.shares
    seen = np.zeros(40 * 40)
    seen[page.pixels] = page.shares
    assert seen.reshape(40, 40) == pytest.approx(there.reshape(300, 300)[100:140, 100:140], abs=1 / 256)
    both = coverage.polygons(np.concatenate([made, made]) - (-100, -100), two, (300, 300)).fragments()
    assert (both.only(both.owners == 1).shares.sum()) == pytest.approx(float(found.shares.sum()), rel=1e-5)
    whole = np.flatnonzero(there == 1)
    assert not np.isin(both.only(both.owners == 0).pixels, whole).any()


@pytest.mark.parametrize("name", SCENES)
def test_a_pdf_shows_what_the_pixels_show(name: str) -> None:
    """Drawn three times as large, then reduced: only pixels have texts that stand on whole ones."""
    scene = replace(SCENES[name], density=3.0)
    one, other = page(PdfRenderer().draw(scene, ".pdf"), scene.pixels), Pillow.fromarray(paint(scene))
    # programs that show PDFs make the edges of cells soft, some of them
    assert similarity(one.reduce(3), other.reduce(3)) >= (0.9 if name == "cells" else ALIKE)


@pytest.mark.parametrize("name", ["texts", "areas", "faint", "use case 1, print"])
@pytest.mark.parametrize("suffix", [".png", ".webp"])
def test_files_of_pixels_hold_them_exactly(name: str, suffix: str) -> None:
    scene = SCENES[name]
    with Pillow.open(io.BytesIO(PillowRenderer().draw(scene, suffix))) as picture:
        assert np.array_equal(np.asarray(picture.convert("RGB")), paint(scene))


def test_films_of_all_kinds_show_their_frames(tmp_path: Path) -> None:
    filmed = short_film(6)
    for number, pixels in list(enumerate(frames(filmed)))[::2]:
        assert similarity(Pillow.fromarray(pixels), Pillow.fromarray(paint(still(filmed, number)))) > 0.999
    path = tmp_path / "film.mp4"
    path.write_bytes(VideoRenderer().animate(filmed, ".mp4"))
    shown = [Pillow.fromarray(frame) for frame in decoded(path)]
    for suffix, least in ((".gif", 0.95), (".webp", 0.93)):
        with Pillow.open(io.BytesIO(PillowRenderer().animate(filmed, suffix))) as file:
            file.seek(5)
            assert similarity(file.convert("RGB"), Pillow.fromarray(paint(still(filmed, 5)))) > least
    wide, high = filmed.scene.pixels
    for number in (0, 5):
        meant = Pillow.fromarray(paint(still(filmed, number)))
        assert similarity(shown[number].crop((0, 0, wide, high)), meant) > 0.97


@pytest.mark.parametrize("renderer", OURS, ids=lambda renderer: renderer.name)
def test_a_renderer_does_what_it_declares(renderer: Renderer) -> None:
    """And the same for the same scene; what it does not declare it refuses."""
    assert type(renderer).__name__ in {type(made).__name__ for made in plugins.working(plugins.RENDERERS)}
    can = renderer.capabilities
    assert isinstance(can, RendererCapabilities)
    assert can.stills | can.films
    assert can.streams <= can.films
    assert not can.streams or isinstance(renderer, StreamingRenderer)
    scene = SCENES["glow"]
    for suffix in can.stills:
        assert suffix == suffix.lower()
        assert renderer.draw(scene, suffix) == renderer.draw(scene, suffix)
    if not can.stills:
        with pytest.raises(ValueError, match="no stills"):
            renderer.draw(scene, ".svg")
    if not can.films:
        with pytest.raises(ValueError, match="no films"):
            renderer.animate(short_film(2), ".svg")


def test_texts_of_a_pdf_can_be_searched_and_copied() -> None:
    data = PdfRenderer().draw(SCENES["texts"], ".pdf")
    words = pypdfium2.PdfDocument(data)[0].get_textpage().get_text_range()
    for shown in ("Function approximation", "step 160 · 4.00 s · error −0.28", "C → K, K → O", "K12", "halo"):
        assert shown in words
    assert len(data) < 40_000


def test_a_pdf_is_as_large_on_paper_as_its_png() -> None:
    scene = SCENES["use case 1"]
    size = pypdfium2.PdfDocument(PdfRenderer().draw(scene, ".pdf"))[0].get_size()
    with Pillow.open(io.BytesIO(PillowRenderer().draw(scene, ".png"))) as picture:
        inches = [pixels / picture.info["dpi"][0] for pixels in picture.size]
    assert [side / 72 for side in size] == pytest.approx(inches, rel=0.01)


@pytest.mark.filterwarnings("ignore:the picture's font")
@pytest.mark.parametrize("words", ["", "ä→−₁ẞΔ", "漢字 🧠", "(a)\\<b>", "\x00\ud800", "e\u0301"])
def test_any_text_can_be_drawn(words: str) -> None:
    """What the font does not have becomes its sign for that."""
    scene = Scene(100, 40, THEMES["default"], words, (Group((Text((5, 20), words, 12, "#000000"),)),))
    data = PdfRenderer().draw(scene, ".pdf")
    assert page(data, (100, 40)).size == (100, 40)
    paint(scene)


def test_a_font_of_some_glyphs_is_read_back() -> None:
    font = truetype.read(FONTS[0])
    glyphs = [font.glyph(character) for character in "Aä→−"]
    assert 0 not in glyphs
    data, number = font.subset(glyphs)
    small = io.BytesIO(data)
    assert len(data) < 30_000
    assert set(glyphs) <= set(number)
    assert len(number) > len(glyphs)  # ä is made of a and its dots
    assert sorted(number.values()) == list(range(len(number)))
    assert font.width("AVä", 20) == pytest.approx(sum(font.advance(font.glyph(c)) for c in "AVä") / 50)
    small.seek(0)


@pytest.mark.parametrize("suffix", [".png", ".pdf", ".mp4", ".gif"])
def test_letters_that_the_font_cannot_set_are_told(suffix: str) -> None:
    def draw(words: str) -> None:
        film = short_film(2)
        scene = Scene(100, 40, THEMES["default"], words, (Group((Text((5, 20), words, 12, "#000000"),)),))
        if suffix in (".png", ".pdf"):
            (PdfRenderer() if suffix == ".pdf" else PillowRenderer()).draw(scene, suffix)
        else:
            groups = (*film.scene.groups, *scene.groups)
            shown = replace(film, scene=replace(film.scene, groups=groups))
            (VideoRenderer() if suffix == ".mp4" else PillowRenderer()).animate(shown, suffix)

    with pytest.warns(UserWarning, match="no glyphs for '字', '漢'; reversed are 'ב', 'ע'. An .svg shows them"):
        draw("ä漢字 עב")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        draw("нейрон Δ→−₁ é")
