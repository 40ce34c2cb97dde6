"""The words of which some values are one, for those who read them behind the language.

In: nothing. Out: types and tables; the models take their words from here.
"""

from collections.abc import Mapping
from typing import Final, Literal, NamedTuple

Direction = Literal["down", "up", "right", "left"]
Combine = Literal["sum", "product", "distance", "max"]
Method = Literal["euler", "heun", "rk4", "exponential", "semi_implicit"]
TimeUnit = Literal["s", "ms"]
NeuronRole = Literal["input", "hidden", "output"]
Reliability = Literal["reliable", "best_effort"]
Durability = Literal["volatile", "transient_local"]
OnTimeout = Literal["hold", "zero", "stop"]
#: a network of more neurons publishes activities by their names only where its spec says which (``ros: {values: …}``)
MOST_NAMED: Final = 256

#: How states are integrated, and what that is.
METHODS: Final[Mapping[Method, str]] = {
    "euler": "One evaluation a step, order 1.",
    "heun": "Two evaluations a step, order 2.",
    "rk4": "The classical Runge-Kutta method: four evaluations a step, order 4.",
    "exponential": "One evaluation; exact for what decays linearly, so that stiff equations stay stable. Order 1.",
    "semi_implicit": "One evaluation, implicit in what decays: stable for stiff equations. Order 1.",
}

#: What a picture can show.
VIEWS = ("network", "pathways", "matrix", "traces", "raster", "weights", "body")
#: Those over the time of a run.
TIMED = ("traces", "raster", "weights")
#: Those that show the whole of something, which takes no references, and what that is.
WHOLE: Final[Mapping[str, str]] = {"network": "the whole network", "pathways": "all pathways", "body": "the whole body"}
#: Those that are the picture of the network, of which a page has one.
PICTURES: Final = ("network", "pathways")

#: How lines are drawn, in their order: the first is that of lines without a value, where there are any.
LINE_STYLES: Final = ("solid", "dashed", "finely dashed", "dash-dotted", "long-dashed", "dash-dot-dotted")
#: The most values that these are for.
MOST_STYLES: Final = len(LINE_STYLES) - 1


class Viewpoint(NamedTuple):
    """From where a network in space is seen: degrees around the z axis, 0 in front (where y is greatest), and degrees
    above the plane of x and y."""

    azimuth: float
    elevation: float


#: Those that have names.
VIEWPOINTS: Final = {"top": Viewpoint(0.0, 90.0), "front": Viewpoint(0.0, 0.0), "side": Viewpoint(90.0, 0.0)}
TOP: Final = VIEWPOINTS["top"]
