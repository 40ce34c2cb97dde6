"""How long a film may be: known, and refused, before anything is run.

In: a network, the number of frames, the kind of file. Out: nothing, or RendererError that says the limit and the way
out. What a film takes of memory grows with its frames where it is not written while it is made: all colours and widths,
or of pixels what is left of them when they are compressed. A film that nobody asked to be long is thinned.
"""

from __future__ import annotations

from neurovis_spec.compiler.network import Network
from neurovis_spec.scene.frame import MOST
from neurovis_spec.scene.model import RendererCapabilities
from neurovis_spec.scene.renderers import RendererError

#: The most colours of a film: frames times neurons and connections; with the widths half a gigabyte.
MOST_COLOURS = 20_000_000


def check_film(network: Network, frames: int, suffix: str, capabilities: RendererCapabilities) -> None:
    """Refuse a film that would take more memory than is reasonable. Raises RendererError."""
    parts = len(network.neurons) + len(network.connections)
    if suffix not in capabilities.streams and frames * parts > MOST_COLOURS:
        most = max(1, MOST_COLOURS // parts)
        message = f"a film of {frames:,} frames of {parts:,} neurons and connections is too long: {most:,} is the most"
        hint = f"draw fewer steps (--steps {most}, --frames {most}), or a video ('.mp4'), which may be of any length"
        raise RendererError(message, hint)
    if suffix not in capabilities.pixels:
        return
    wide, high = network.render.size or (int(MOST[0]), int(MOST[1]))
    most = max(1, capabilities.pixels[suffix] // (wide * high))
    if frames > most:
        message = f"a '{suffix}' of {frames:,} frames of {wide} × {high} pixels is too long: {most:,} is the most"
        fewer = f"--steps {most}, --frames {most}"
        hint = f"draw fewer steps ({fewer}), a smaller picture (render: size), or a '.gif' or '.mp4' of any length"
        raise RendererError(message, hint)


#: Frames a second of a film at most, and where the spec writes no dt.
_MOST_FPS, _FPS = 60.0, 25.0


def frames_a_second(network: Network) -> float:
    """The default rate of a film: a step a frame, in real time."""
    return min(1 / network.dt, _MOST_FPS) if network.dt_given else _FPS


#: The most frames of a film by default.
MOST_FRAMES = 3000


def thinned(steps: int, every: int | None, frames: int | None) -> int:
    """Every how many steps there is a frame in a film of so many ``steps``: ``every`` if it is given, else as few as
    leave at most so many ``frames``.

    >>> thinned(2000, None, None), thinned(40_000, None, None), thinned(40_000, 2, None), thinned(1000, None, 300)
    (1, 14, 2, 4)
    """
    return every if every is not None else -(-steps // (frames or MOST_FRAMES))
