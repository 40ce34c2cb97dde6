"""Windows: of which shape the room is that a page gives the network, and the layout that fills it.

In: a compiled network, and of which shape a window is, in three coarse kinds. Out: the network as though its spec asked
for a page of that shape, with its layout, where it is drawn clearly larger in the window so; else nothing, as where
somebody says how the network is laid out: its spec, or a layout file.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final, Literal, TypeAlias

from neurovis_spec.compilation import Compilation
from neurovis_spec.layout.model import RADIUS, Layout, LayoutRefusalError

#: Of which shape a window is: higher than wide, wider than high, or neither clearly.
Window: TypeAlias = Literal["tall", "default", "wide"]
#: What is this much larger is clearly so; no layout is, where the network has this share of a room that it can have.
_LARGER: Final = 1.1
_FILLED: Final = 0.75
#: With more neurons and connections a second layout would take too long beside a run.
_MANY: Final = 20_000
#: The page draws no larger discs than of 60 pixels (room.js).
_MOST: Final = 60.0 / RADIUS


@dataclass(frozen=True, slots=True)
class Shape:
    """The page that a network is laid out for, and the rooms that it can have in such a window, in pixels: where there
    are several curves stand beside it, or below it."""

    page: tuple[int, int]
    rooms: tuple[tuple[float, float], ...]

    def scale(self, layout: Layout) -> float:
        """How many pixels a unit of the layout has, where the whole is as large as it is drawn."""
        wide, high = layout.sides
        return min(_MOST, max(min(across / wide, down / high) for across, down in self.rooms))

    def is_filled(self, layout: Layout) -> bool:
        """Whether the network takes most of a room, or is as large as it can be, so that no layout is much larger."""
        wide, high = layout.sides
        ratios = [(across / wide, down / high) for across, down in self.rooms]
        return self.scale(layout) == _MOST or any(min(both) >= _FILLED * max(both) for both in ratios)


#: By what a page says of its window; in others the network is laid out as anywhere. The rooms are those of a telephone
#: (390x844), and of a window of 1280x800, which one of 1920x1080 is much alike.
SHAPES: Final[Mapping[Window, Shape]] = {
    "tall": Shape((720, 920), ((390.0, 500.0),)),
    "wide": Shape((1440, 960), ((990.0, 690.0), (1280.0, 470.0))),
}


def fitted(compiled: Compilation, engine: str | None, window: Window) -> tuple[Compilation, Layout] | None:
    """A network for a window of this shape; None where it is drawn in its own layout. Raises LayoutRefusalError where
    it has none."""
    shape = SHAPES.get(window)
    if shape is None or not is_free(compiled):
        return None
    own = compiled.placed(engine)
    if shape.is_filled(own):
        return None
    made = compiled.of_size(shape.page)
    try:
        layout = made.placed(engine)
    except LayoutRefusalError:
        return None
    return (made, layout) if shape.scale(layout) >= _LARGER * shape.scale(own) else None


def is_free(compiled: Compilation) -> bool:
    """Whether nobody says how a network is laid out (page, direction, place, layout file), and it is small enough."""
    network = compiled.network
    if network.render.size is not None or compiled.layout_file is not None:
        return False
    if len(network.neurons) + len(network.connections) > _MANY:
        return False
    problem = compiled.problem
    return bool(problem.neurons) and not problem.places and replace(problem, aspect=1.0).turns


def window_of(compiled: Compilation) -> Window:
    """The window for which a network is laid out."""
    size = compiled.network.render.size
    return next((window for window, shape in SHAPES.items() if shape.page == size), "default")
