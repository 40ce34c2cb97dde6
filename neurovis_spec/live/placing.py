"""Placing: neurons that were put somewhere by hand, and the layout that comes of it.

In: a compiled network, where somebody has dragged a neuron to. Out: a layout in which it stands there, its mirror image
opposite, and everything else where it was; what runs into it is routed anew. It is what the layout command makes of a
layout file in which a position was edited.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.layout.model import Layout, Point

#: Positions by hand are multiples of this (units of the layout).
STEP: Final = 1 / 16


@dataclass(frozen=True, eq=False)
class Placed:
    """The layout of a network, and the neurons that were put somewhere by hand since it was saved."""

    compiled: CompiledNetwork
    engine: str | None
    layout: Layout
    moved: tuple[str, ...] = ()

    def put(self, neuron: str, at: Point) -> Placed:
        """Put a neuron here; its mirror image follows. Raises LayoutRefusalError where that cannot be drawn, KeyError
        for a neuron that there is not."""
        index = self.compiled.network.neuron_index
        if neuron not in index:
            raise KeyError(f"there is no neuron '{neuron}'")
        images = _images(self.compiled, index[neuron])
        moved = (*(name for name in self.moved if name != neuron and index[name] not in images), neuron)
        place = (round(at[0] / STEP) * STEP, round(at[1] / STEP) * STEP)
        return replace(self, layout=self._with(moved, {neuron: place}), moved=moved)

    def carried(self, compiled: CompiledNetwork) -> Placed:
        """The same in an edited network: what is there still stays where it was put. Raises LayoutRefusalError."""
        begun = placed(compiled, self.engine)
        moved = tuple(name for name in self.moved if name in compiled.network.neuron_index)
        if not moved:
            return begun
        return replace(
            begun, layout=begun._with(moved, {name: self.layout.positions[name] for name in moved}), moved=moved
        )

    def _with(self, moved: Sequence[str], places: Mapping[str, Point]) -> Layout:
        """The layout in which some have just been put elsewhere. They are remembered there, as from a layout file that
        was edited; so are pins of the spec that were ``moved``, and of their mirror images none are left."""
        network, index = self.compiled.network, self.compiled.network.neuron_index
        positions = {**self.layout.positions, **places}
        by_hand = {index[name]: positions[name] for name in moved}
        images = {image for neuron in by_hand for image in _images(self.compiled, neuron)}
        pins = {
            neuron: by_hand.get(neuron, point)
            for neuron, point in network.layout.positions.items()
            if neuron in by_hand or neuron not in images
        }
        compiled = replace(self.compiled, network=replace(network, layout=replace(network.layout, positions=pins)))
        return compiled.layout(self.engine, earlier=replace(self.layout, positions=positions)).value


def placed(compiled: CompiledNetwork, engine: str | None = None) -> Placed:
    """A network as it is laid out. Raises LayoutRefusalError."""
    return Placed(compiled, engine, compiled.drawn(engine).value)


def _images(compiled: CompiledNetwork, neuron: int) -> set[int]:
    """The neurons whose places follow from that of this one."""
    pairs = (pair for mirror in compiled.network.layout.mirrors for pair in mirror.pairs)
    return {b if a == neuron else a for a, b in pairs if neuron in (a, b) and a != b}
