"""Pins: neurons that were put somewhere by hand, and how the spec, or its layout file, comes to say so.

In: a compiled network, where somebody has dragged a neuron to; the path of its spec. Out: a layout in which it stands
there (Placed), its mirror image opposite, and everything else where it was; what runs into it is routed anew, as the
layout command makes it of a layout file in which a position was edited. And the files as they would be, tried out
before anybody sees them: what is saved is drawn as it was shown. Comments stay; a spec is formatted as ``neurovis fmt``
does.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, TypeAlias

from neurovis_spec.compilation import Compilation
from neurovis_spec.differences import difference
from neurovis_spec.language.format.edit import Path as Keys
from neurovis_spec.language.format.edit import Value, put
from neurovis_spec.layout.file import dump, name_text, number_text
from neurovis_spec.layout.model import GRID, Layout, Point
from neurovis_spec.live.commands import Into
from neurovis_spec.live.windows import Window, fitted
from neurovis_spec.runtime.files import replacing

#: Positions by hand are multiples of this (units of the layout).
STEP: Final = 1 / 16

#: Compiles a text in place of that of the spec's file. Raises SpecError.
Compile: TypeAlias = Callable[[str], Compilation]
#: Places nearer than this are the same.
_SAME: Final = 16 * GRID
#: How often further pins are added.
_ROUNDS: Final = 4


@dataclass(frozen=True, eq=False)
class Placed:
    """The layout of a network, and the neurons that were put somewhere by hand since it was saved."""

    compiled: Compilation
    engine: str | None
    layout: Layout
    moved: tuple[str, ...] = ()
    #: the window that it was asked for, and whether it is laid out for that, not as anywhere
    window: Window = "default"
    is_fitted: bool = False

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

    def carried(self, compiled: Compilation, window: Window = "default") -> Placed:
        """The same in an edited network, for a ``window``: what is there still stays where it was put, in the window in
        which that was. Raises LayoutRefusalError."""
        if compiled.problem is self.compiled.problem:
            return replace(self, compiled=compiled)
        moved = tuple(name for name in self.moved if name in compiled.network.neuron_index)
        begun = placed(compiled, self.engine, self.window if moved else window)
        if not moved:
            return begun
        return replace(
            begun, layout=begun._with(moved, {name: self.layout.positions[name] for name in moved}), moved=moved
        )

    def written(self, compiled: Compilation) -> Placed:
        """The same of a spec that says by now what was put by hand."""
        same = compiled.of_size(self.compiled.network.render.size) if self.is_fitted else compiled
        return replace(self, compiled=same, moved=())

    def for_window(self, window: Window) -> Placed:
        """The same, of which nothing was put by hand, for a window. Raises LayoutRefusalError."""
        plain = self.compiled.of_size(None) if self.is_fitted else self.compiled
        return placed(plain, self.engine, window)

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
        return compiled.arranged(self.engine, earlier=replace(self.layout, positions=positions))


def placed(compiled: Compilation, engine: str | None = None, window: Window = "default") -> Placed:
    """A network as it is laid out for a window. Raises LayoutRefusalError."""
    found = fitted(compiled, engine, window)
    shown, layout = (compiled, compiled.placed(engine)) if found is None else found
    return Placed(shown, engine, layout, window=window, is_fitted=found is not None)


def _images(compiled: Compilation, neuron: int) -> set[int]:
    """The neurons whose places follow from that of this one."""
    pairs = (pair for mirror in compiled.network.layout.mirrors for pair in mirror.pairs)
    return {b if a == neuron else a for a, b in pairs if neuron in (a, b) and a != b}


class SavingError(ValueError):
    """Nothing is written, and why."""


@dataclass(frozen=True, slots=True)
class File:
    """A file as it is (None where there is none) and as it is to be."""

    path: Path
    before: bytes | None
    after: str

    @property
    def diff(self) -> str:
        """What changes."""
        return difference((self.before or b"").decode("utf-8", "replace"), self.after, self.path.name)


@dataclass(frozen=True, slots=True)
class Saving:
    """Files that are to be written; ``base`` is the spec as it is to be, without events that the run was turned to by
    hand, where there are some in it."""

    files: tuple[File, ...]
    base: str | None = None

    @property
    def diff(self) -> str:
        """What changes in all of them."""
        return "".join(file.diff for file in self.files)

    def write(self) -> None:
        """Write them, each as a whole. Raises SavingError where one has changed meanwhile, OSError."""
        for file in self.files:
            if _bytes(file.path) != file.before:
                raise SavingError(f"{file.path.name} has changed meanwhile: look at the difference again")
        for file in self.files:
            with replacing(file.path) as opened:
                opened.write(file.after.encode())


def saving(
    shown: Placed, spec: Path, compile: Compile, into: Into, own: Callable[[str], str | None] = lambda _: None
) -> Saving:
    """What there is to write; ``own`` is the text of the spec without events that were written from here, None where it
    has none. Raises SavingError, SpecError, LayoutRefusalError, OSError."""
    data = _bytes(spec)
    if data is None:
        raise SavingError(f"{spec.name} is no longer there")
    text = data.decode("utf-8-sig")
    now, base = compile(text), None
    if now.hash != shown.compiled.hash and (base := own(text)) is not None:
        now = compile(base)
    if now.hash != shown.compiled.hash:
        raise SavingError(f"{spec.name} is another network by now than the one that is shown: use --watch")
    values = _file(shown, now, spec) if into == "file" else _pins(shown, now, text, compile)
    written = put(text, values) if values else text
    files = [File(spec, data, written)] if values else []
    if into == "file":
        _check(shown, compile(written).arranged(shown.engine, earlier=shown.layout))
        path = now.layout_file or _beside(spec)
        files.insert(0, File(path, _bytes(path), dump(shown.layout)))
    kept = put(base, values) if base is not None and values else base
    return Saving(tuple(file for file in files if file.before != file.after.encode()), kept)


def _bytes(path: Path) -> bytes | None:
    try:
        return path.read_bytes()
    except FileNotFoundError:
        return None


def _beside(spec: Path) -> Path:
    """The layout file of a spec that names none."""
    return spec.with_name(f"{spec.stem}.layout.yaml")


def _file(shown: Placed, now: Compilation, spec: Path) -> dict[Keys, Value]:
    """What the spec must say so that the layout file is heard: its name, and no other places."""
    values = _positions(shown, now, set(_moved(shown, _stated(now))))
    if now.layout_file is None:
        path = _beside(spec)
        if path.exists():
            raise SavingError(f"{path.name} is there already, and the spec does not name it (layout: {{file: …}})")
        values["layout", "file"] = name_text(path.name)
    return values


def _pins(shown: Placed, now: Compilation, text: str, compile: Compile) -> dict[Keys, Value]:
    """Pins that reproduce the layout that is shown: those made by hand and, as the rest of the network is fitted to
    pins, those of all neurons that would otherwise stand elsewhere."""
    names = {*shown.moved, *_moved(shown, _stated(now))}
    chosen: dict[Keys, Value] = {}
    if shown.layout.direction is not None and not now.network.layout.directed:
        chosen["layout", "direction"] = shown.layout.direction  # with pins the page chooses none
    for _ in range(_ROUNDS):
        values = {**_positions(shown, now, names), **chosen}
        made = compile(put(text, values) if values else text).arranged(shown.engine)
        others = _moved(shown, made.positions)
        if not others:
            return values
        names |= set(others)
    raise SavingError("pins in the spec do not give this layout: save a layout file")


def _stated(now: Compilation) -> dict[str, Point]:
    """The places that the spec says."""
    names = now.network.neurons.names
    return {names[index]: point for index, point in now.network.layout.positions.items()}


def _moved(shown: Placed, positions: Mapping[str, Point]) -> list[str]:
    """The neurons whose place in these positions is not the one that is shown."""
    return [name for name, point in positions.items() if math.dist(point, shown.layout.positions[name]) > _SAME]


def _check(shown: Placed, made: Layout) -> None:
    others = _moved(shown, made.positions)
    if others:
        raise SavingError(f"'{others[0]}' would not stand where it is shown")


def _positions(shown: Placed, now: Compilation, names: set[str]) -> dict[Keys, Value]:
    """Pins of these neurons, by the keys that the spec has for them; in the order of the network."""
    written = () if now.spec.layout is None else tuple(now.spec.layout.positions)
    groups = {group.name: group.indices for group in now.network.neurons.groups}
    known = {}
    for key in written:
        members = groups.get(key, ())
        known[now.network.neurons.names[members[0]] if len(members) == 1 else key] = key
    values: dict[Keys, Value] = {}
    for name in now.network.neurons.names:
        if name in names:
            x, y = shown.layout.positions[name]
            key = known.get(name) or name_text(name)
            values["layout", "positions", key] = (number_text(x), number_text(y))
    return values
