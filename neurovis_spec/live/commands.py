"""Commands: what a client asks of a live run, besides turns; requests: what its owner asks of the desk.

In: what ``protocol`` has checked. Out: frozen values: commands, which ``run`` carries out, among them how the picture
is drawn otherwise than the spec says (an Appearance); requests, neurons put by hand and files, which ``desk`` carries
out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final, Literal, TypeAlias

from neurovis_spec.layout.model import Point
from neurovis_spec.live.saved_views import SavedView
from neurovis_spec.live.turns import Turn
from neurovis_spec.live.windows import Window
from neurovis_spec.scene.gains import Gains, Scale

#: Gains become at most so many times as large, or as small.
MOST = 64.0


@dataclass(frozen=True, slots=True)
class Appearance:
    """How many times as large the gains of Eqs. 2–5 are, and whether each group is drawn as one glyph, with the
    pathways between them."""

    activity: float = 1.0
    signal: float = 1.0
    thickness: float = 1.0
    change: float = 1.0
    pathways: bool = False

    def gains(self, gains: Gains) -> Gains:
        """These gains, so many times as large."""
        return replace(
            gains,
            activity=gains.activity * self.activity,
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


@dataclass(frozen=True, slots=True)
class Play:
    """Go on at the speed that is set."""


@dataclass(frozen=True, slots=True)
class Pause:
    """Stand still."""


@dataclass(frozen=True, slots=True)
class Step:
    """A few steps on, or back; the run then stands still."""

    by: int


@dataclass(frozen=True, slots=True)
class Seek:
    """To a step; the run then stands still."""

    step: int


@dataclass(frozen=True, slots=True)
class Event:
    """To the next event of the spec (1), or the one before (−1); the run then stands still."""

    by: int


@dataclass(frozen=True, slots=True)
class Restart:
    """From the beginning; what was turned is undone."""


@dataclass(frozen=True, slots=True)
class Branch:
    """From here on differently: what came after is another future."""


@dataclass(frozen=True, slots=True)
class Switch:
    """To another future, by its number, to the step that is shown, or to another one."""

    number: int
    shown: int | None = None


@dataclass(frozen=True, slots=True)
class Compare:
    """Show another future beside what is shown, by its number, at the same step; −1: no more."""

    number: int


@dataclass(frozen=True, slots=True)
class Rename:
    """Give a future a name, by its number, or the run as it goes."""

    number: int
    name: str


@dataclass(frozen=True, slots=True)
class Forget:
    """Delete another future, by its number."""

    number: int


@dataclass(frozen=True, slots=True)
class Restore:
    """Have the future again that was deleted last."""


@dataclass(frozen=True, slots=True)
class Undo:
    """Take a turn back, by its number."""

    number: int


@dataclass(frozen=True, slots=True)
class Speed:
    """How fast it plays; infinity is as fast as can be."""

    value: float


@dataclass(frozen=True, slots=True)
class Measure:
    """A measure of the language is a curve from now on, for all who look on."""

    text: str


@dataclass(frozen=True, slots=True)
class Unmeasure:
    """The measure of a number is none any more."""

    number: int


@dataclass(frozen=True, slots=True)
class Loop:
    """What is played goes from this step to that one, and from the first of them again."""

    first: int
    last: int


@dataclass(frozen=True, slots=True)
class Unloop:
    """What is played goes on."""


@dataclass(frozen=True, slots=True)
class Present:
    """Show the current step once more, for a client that has just connected."""


@dataclass(frozen=True, slots=True)
class Draw:
    """The picture is drawn otherwise, for all who look on."""

    appearance: Appearance


Branching: TypeAlias = Branch | Switch | Compare | Rename | Forget | Restore | Undo
Showing: TypeAlias = Present | Draw | Play | Pause | Step | Seek | Event | Restart | Speed
Command: TypeAlias = Showing | Branching | Loop | Unloop | Measure | Unmeasure | Turn


#: What is written: what was put by hand, into ``layout.positions`` of the spec, or into the layout file that the spec
#: (then) names; or what was turned, into the ``events`` of the spec.
Into: TypeAlias = Literal["spec", "file", "events"]
#: What can be had as a file: a picture, a film (``film`` is a moving SVG), a recording, the spec with events.
What: TypeAlias = Literal["svg", "pdf", "film", "mp4", "webm", "gif", "npz", "yaml"]
#: Those of one step.
STILLS: Final = frozenset({"svg", "pdf"})


@dataclass(frozen=True, slots=True)
class PlaceNeuron:
    """Put a neuron here (units of the layout); until ``done`` only the places and routes that follow are told."""

    neuron: str
    at: Point
    done: bool


@dataclass(frozen=True, slots=True)
class Unplace:
    """Undo the last placing."""


@dataclass(frozen=True, slots=True)
class Save:
    """Say what would be written."""

    into: Into


@dataclass(frozen=True, slots=True)
class Write:
    """Write what was said."""


@dataclass(frozen=True, slots=True)
class Fetch:
    """Have the picture, a film of the last ``seconds``, the recording, or the spec with events; pictures in a
    ``theme``, "" for their own."""

    what: What
    seconds: float
    theme: str = ""


@dataclass(frozen=True, slots=True)
class Keep:
    """Keep where a page stands, by a name, in the file of views beside the spec."""

    name: str
    view: SavedView


@dataclass(frozen=True, slots=True)
class Unkeep:
    """Take a view out of the file of views."""

    name: str


@dataclass(frozen=True, slots=True)
class Rekeep:
    """Have a view of the file of views be called otherwise."""

    name: str
    to: str


@dataclass(frozen=True, slots=True)
class Fit:
    """Lay the network out for a window of this shape, where that shows it larger."""

    window: Window


Request: TypeAlias = PlaceNeuron | Unplace | Save | Write | Fetch | Keep | Unkeep | Rekeep | Fit
#: the messages that ask for them
REQUESTS: Final = frozenset(("place", "unplace", "save", "write", "fetch", "keep", "unkeep", "rekeep", "fit"))
