"""Eqs. 2–5: what activities and weights look like, as pure functions of arrays.

In: activities, weights, gains (one for all, or one for each), which connections are compressed: of these the square
root of the signal or the weight counts. Out: colour values in −1…1, widths in user units. The paper prints Eq. 5 as
|γ·w[t] − w[t−1]|, which would glow for ever when γ ≠ 1; the difference is meant.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from neurovis_spec.arrays import BoolArray, FloatArray

#: One for all, or one for each.
Gain: TypeAlias = float | FloatArray
#: Of all, or of each.
Compressed: TypeAlias = bool | BoolArray

#: The thinnest line, in user units.
THINNEST = 0.6
#: A change of less intensity than this is not drawn: its glow would be little wider than a pixel on either side of its
#: line, and only tint it.
FAINTEST = 1 / 5
#: How far a glow can reach beyond its line, on either side, in user units.
GLOW_REACH = 8.0


def _quiet() -> np.errstate:
    """The run has warned of values that are no numbers; a picture says of neurons that they have none."""
    return np.errstate(invalid="ignore", over="ignore")


def neuron_colour(activity: FloatArray, gain: Gain, centre: Gain = 0.0) -> FloatArray:
    """Eq. 2: NC_i[t] = clip(−1, γ_NC · a_i[t], 1); of a range that is not centred on 0, a_i[t] − centre. NaN where the
    activity is no finite number."""
    with _quiet():
        result: FloatArray = np.where(np.isfinite(activity), np.clip(gain * (activity - centre), -1.0, 1.0), np.nan)
    return result


def connection_colour(sent: FloatArray, weight: FloatArray, gain: Gain, compressed: Compressed = False) -> FloatArray:
    """Eq. 3: CC_ij[t] = clip(−1, γ_CC · a_i[t] · w_ij[t], 1); ``sent`` is the activity of the source of each, or what
    it takes in its place (``Signals``). A signal that is no number is drawn as none."""
    with _quiet():
        shown = gain * sent * weight
        if np.any(compressed):
            shown = np.where(compressed, gain * root(sent * weight), shown)
        result: FloatArray = np.nan_to_num(np.clip(shown, -1.0, 1.0), nan=0.0)
    return result


def thickness(weight: FloatArray, gain: Gain, compressed: Compressed = False) -> FloatArray:
    """Eq. 4: CT_ij[t] = |γ_CT · w_ij[t]|."""
    with _quiet():
        result: FloatArray = np.abs(gain * np.where(compressed, root(weight), weight))
    return result


def root(values: FloatArray) -> FloatArray:
    """The square root of magnitudes, with their signs."""
    result: FloatArray = np.copysign(np.sqrt(np.abs(values)), values)
    return result


def line_width(weight: FloatArray, gain: Gain, widest: float, compressed: Compressed = False) -> FloatArray:
    """The width of a line: Eq. 4, never thinner than ``THINNEST``, never wider than ``widest``, which covers the whole
    picture. Weights that are no finite number are drawn as thin as can be."""
    drawn = np.clip(thickness(weight, gain, compressed), THINNEST, widest)
    result: FloatArray = np.where(np.isfinite(weight), drawn, THINNEST)
    return result


def clamped(widths: FloatArray) -> FloatArray:
    """Widths of lines as Eq. 4 gives them, none thinner than ``THINNEST``; what is no finite number is as thin."""
    result: FloatArray = np.where(np.isfinite(widths), np.maximum(widths, THINNEST), THINNEST)
    return result


def glow(weight: FloatArray, previous: FloatArray | None, gain: Gain, least: Gain = 0.0) -> FloatArray:
    """Eq. 5: LI_ij[t] = |γ_LI · (w_ij[t] − w_ij[t−1])|, none where there is no step before; and none of changes by
    less than the ``least`` that are shown."""
    if previous is None:
        return np.zeros_like(weight)
    with _quiet():
        change = weight - previous
        result: FloatArray = np.where(np.abs(change) < least, 0.0, np.abs(gain * change))
    return result


def glow_width(width: FloatArray, intensity: FloatArray) -> FloatArray:
    """The width of a glow around a line of ``width``: it reaches further the more the weight changes, at an intensity
    of 1 by half of ``GLOW_REACH`` on either side; 0 (none) below ``FAINTEST``."""
    light = np.minimum(np.nan_to_num(intensity, nan=0.0), 1e12)  # brighter cannot be told from it
    result: FloatArray = np.where(light < FAINTEST, 0.0, width + 2 * GLOW_REACH * light / (1 + light))
    return result
