"""Appearance: how a picture is drawn otherwise than the spec says: in another theme, with larger or smaller gains.

In: a theme's name and factors, as a client sends them. Out: a frozen value, and gains that are so many times as large.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from neurovis_spec.scene.gains import Gains, Scale

#: Gains become at most so many times as large, or as small.
MOST = 64.0


@dataclass(frozen=True, slots=True)
class Appearance:
    """The name of a theme ('': that of the spec), and how many times as large the gains of Eqs. 2–5 are."""

    theme: str = ""
    activity: float = 1.0
    signal: float = 1.0
    thickness: float = 1.0
    change: float = 1.0

    def gains(self, gains: Gains) -> Gains:
        """These gains, so many times as large."""
        return Gains(
            activity=gains.activity * self.activity,
            centre=gains.centre,
            signal=gains.signal * self.signal,
            thickness=gains.thickness * self.thickness,
            change=gains.change * self.change,
            activity_scales=_times(gains.activity_scales, self.activity),
            signal_scales=_times(gains.signal_scales, self.signal),
            thickness_scales=_times(gains.thickness_scales, self.thickness),
            change_scales=_times(gains.change_scales, self.change),
        )


#: As the spec says.
AS_IT_IS = Appearance()


def _times(scales: tuple[Scale, ...], factor: float) -> tuple[Scale, ...]:
    return tuple(replace(scale, gain=scale.gain * factor) for scale in scales)
