"""Eqs. 2–5 against plain computations of single numbers, colours against their anchors."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from colour_vision import VISIONS, difference
from hypothesis import given
from hypothesis import strategies as st

from neurovis_spec.scene import Theme, encoding
from neurovis_spec.scene.themes import THEMES, channels, colours, contrast, luminance, readable

numbers = st.floats(-50, 50)
gains = st.floats(-20, 20)


def plain_clip(value: float) -> float:
    return max(-1.0, min(1.0, value))


@given(st.lists(st.tuples(numbers, numbers, numbers), min_size=1, max_size=8), gains)
def test_equations_2_to_5(rows: list[tuple[float, float, float]], gain: float) -> None:
    activity, weight, before = (np.array(column) for column in zip(*rows, strict=True))
    colour = encoding.neuron_colour(activity, gain)
    signal = encoding.connection_colour(activity, weight, gain)
    thick = encoding.thickness(weight, gain)
    light = encoding.glow(weight, before, gain)
    for place, (a, w, w0) in enumerate(rows):
        assert colour[place] == pytest.approx(plain_clip(gain * a), abs=1e-12)
        assert signal[place] == pytest.approx(plain_clip(gain * a * w), abs=1e-12)
        assert thick[place] == pytest.approx(abs(gain * w), rel=1e-12)
        assert light[place] == pytest.approx(abs(gain * (w - w0)), rel=1e-12, abs=1e-300)


def test_the_glow_is_that_of_the_difference_not_of_the_scaled_weight() -> None:
    still = np.array([0.7])
    assert encoding.glow(still, still, 100.0) == [0.0]


def test_nothing_glows_at_step_0() -> None:
    assert encoding.glow(np.array([3.0, -2.0]), None, 100.0).tolist() == [0.0, 0.0]


def test_lines_are_never_thinner_than_the_thinnest_and_else_exact() -> None:
    widths = encoding.line_width(np.array([0.0, 0.1, -0.1499, 0.15, -2.0, np.nan, np.inf]), 4.0, 5000.0)
    assert widths.tolist() == [0.6, 0.6, 0.6, 0.6, 8.0, 0.6, 0.6]


@given(st.floats(encoding.FAINTEST, 1e6), st.floats(1.001, 10), st.floats(0.6, 20))
def test_a_glow_grows_with_its_intensity_and_surrounds_its_line(light: float, factor: float, width: float) -> None:
    low, high = encoding.glow_width(np.array([width, width]), np.array([light, light * factor]))
    assert width < low <= high <= width + 2 * encoding.GLOW_REACH
    if light < 1e4:
        assert low < high


def test_a_faint_glow_is_left_out() -> None:
    """It would be thinner than a pixel on either side, and tint its line rather than glow."""
    widths = encoding.glow_width(np.array([2.0, 2.0]), encoding.FAINTEST * np.array([0.99, 1]))
    assert widths[0] == 0
    assert widths[1] >= 2 + 2 * 1


@pytest.mark.parametrize("vision", VISIONS)
@pytest.mark.parametrize("theme", THEMES.values(), ids=lambda t: t.name)
def test_a_glow_reads_as_no_colour_of_a_signal(theme: Theme, vision: str) -> None:
    """Neither of the anchors nor of what lies between them, and it can be seen on the background."""
    for fill in colours(theme, np.linspace(-1, 1, 41)):
        assert difference(theme.glow, fill, vision) >= 15
    assert difference(theme.glow, theme.background, vision) >= 15


@pytest.mark.parametrize(
    ("theme", "anchors"),
    [("default", ("#d55e00", "#969696", "#0072b2")), ("paper", ("#d62728", "#969696", "#2ca02c"))],
)
def test_anchors_of_the_contract(theme: str, anchors: tuple[str, str, str]) -> None:
    assert tuple(colours(THEMES[theme], [-1.0, 0.0, 1.0])) == anchors


def test_the_default_glow_and_the_papers_background() -> None:
    assert THEMES["default"].glow == "#f2c200"
    assert THEMES["paper"].background == "#ffffff"
    assert set(THEMES) == {"default", "dark", "print", "paper"}


@given(st.sampled_from(sorted(THEMES)), st.floats(-1, 1))
def test_colours_are_linear_between_the_anchors_channel_by_channel(name: str, value: float) -> None:
    theme = THEMES[name]
    end = channels(theme.negative if value < 0 else theme.positive)
    middle = channels(theme.zero)
    expected = [m + (e - m) * abs(value) for m, e in zip(middle, end, strict=True)]
    (drawn,) = colours(theme, [value])
    assert all(abs(d - e) <= 0.5 + 1e-9 for d, e in zip(channels(drawn), expected, strict=True))


@pytest.mark.parametrize("theme", THEMES.values(), ids=lambda t: t.name)
def test_texts_can_be_read(theme: Theme) -> None:
    assert contrast(theme.ink, theme.background) >= 7
    assert contrast(theme.muted, theme.background) >= 4.5
    assert contrast(theme.muted, theme.box_fill) >= 4.5
    for fill in colours(theme, np.linspace(-1, 1, 41)):
        assert contrast(readable(theme, fill), fill) >= 3.4
    for anchor in (theme.negative, theme.zero, theme.positive):
        assert contrast(anchor, theme.background) >= 2


def test_the_print_theme_falls_in_lightness_so_that_greyscale_tells_values_apart() -> None:
    light = [luminance(c) for c in colours(THEMES["print"], np.linspace(-1, 1, 21))]
    assert all(one > other for one, other in itertools.pairwise(light))
    assert contrast(THEMES["print"].negative, THEMES["print"].zero) > 1.5


@pytest.mark.parametrize("theme", THEMES.values(), ids=list(THEMES))
def test_a_value_that_is_no_number_has_a_colour_that_no_number_has(theme: Theme) -> None:
    (fill,) = colours(theme, [float("nan")])
    assert min(contrast(fill, colour) for colour in colours(theme, np.linspace(-1, 1, 41))) >= 1.5
    assert contrast(readable(theme, fill), fill) >= 4.5


def test_a_glow_is_bounded_however_much_a_weight_changes() -> None:
    widths = encoding.glow_width(np.full(4, 3.0), np.array([1e12, 1e307, 1.7e308, np.inf]))
    assert widths == pytest.approx(3 + 2 * encoding.GLOW_REACH)
