"""Animated SVG: a Film as one file without script, the structure of the still with palettes on top.

In: a Film. Out: the bytes of an ``.svg`` that moves, also inside ``<img>``. The attributes are those of frame 0;
each group that changes has one SMIL animation of its ``class``: a letter or two for the colour, where a weight
changes one each for width and glow, and where it changes its sign one more while it is negative. What these classes
look like stands in a style sheet that holds only where no reduced motion is asked for: where it is, the picture stands
still at frame 0. A group that is shifted has an animation of its ``transform``, which the style sheet takes back there.
One that is redrawn has an animation of each attribute of its shapes that changes, and is there twice: as it is in frame
0 where no motion is welcome.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import replace
from string import ascii_lowercase
from zlib import crc32

import numpy as np
import numpy.typing as npt

from neurovis_renderers.svg import document, element, escape, num, open_group, pairs, unchanging
from neurovis_spec.scene import (
    ENDS_OF,
    HEAD_MORE,
    HEAD_OF_LENGTH,
    HEAD_OF_WIDTH,
    Arrowhead,
    Disc,
    Film,
    FloatArray,
    Group,
    IntArray,
    Point,
    Progress,
    Rectangle,
    RendererCapabilities,
    Scene,
    Shape,
    Spline,
    Text,
    Theme,
    colours,
    filled_shape,
    head_half_width,
    readable,
)

#: Levels of colour from −1 to +1; an odd number, so that 0 is one of them.
LEVELS = 51
#: Their classes; none differs from another in case alone, which pages in quirks mode do not tell apart.
LETTERS: tuple[str, ...] = (*ascii_lowercase, *(f"a{letter}" for letter in ascii_lowercase))
#: At most so many different widths are told apart, and so many captions.
_MOST_WIDTHS, _MOST_CAPTIONS = 240, 500
#: The classes of what is lesioned, of what is shifted, and of shapes of a changing group that stay as they are.
_FAINT, _SHIFTED, _FIXED = "lesioned", "shifted", "fixed"
#: The classes of what is redrawn, as it moves and as it stands still.
_MOVING, _STANDING = "moving", "standing"
#: Groups that have the class of a colour.
_COLOURED = f"[class]:not(.{_SHIFTED},.{_MOVING},.{_STANDING})"
#: The class of a line of a bundle.
_BAND = "band"
#: The class of a line that ends otherwise at the moment than in an arrow, where it does not always.
_OTHERWISE = {-1: "less", 0: "nil"}
#: What the parts are of a head that ends in several ways.
_PARTS = {1: "arrow", -1: "bar", 0: "none"}


class AnimatedSvgRenderer:
    """Films as SVG."""

    name = "animated_svg"
    capabilities = RendererCapabilities(films=frozenset({".svg"}))

    def draw(self, scene: Scene, suffix: str) -> bytes:
        """Stills are made by ``svg``. Raises ValueError."""
        raise ValueError("this renderer makes no stills")

    def animate(self, film: Film, suffix: str, progress: Progress | None = None) -> bytes:
        """The film as an SVG file: frame n shows during [n/F, (n+1)/F) seconds, and it starts over at the end."""
        writer = _Writer(film)
        body = []
        for done, group in enumerate(film.scene.groups):
            body.append(writer.group(group))
            if progress is not None:
                progress(done + 1, len(film.scene.groups))
        content = "".join(body)
        root = f"nv-{crc32(content.encode()):x}"  # so that two films in one page do not share their rules
        return document(film.scene, content, writer.style(root), {"class": root})


class _Writer:
    """Writes the groups of a film, and remembers which classes they use."""

    def __init__(self, film: Film) -> None:
        self._film = film
        self._fills = {name: place for place, name in enumerate(film.fills)}
        self._shifts = {name: place for place, name in enumerate(film.shifts)}
        self._lines = {name: place for place, name in enumerate(film.lines)}
        self._bands = {name: place for place, name in enumerate(film.bands)}
        self._banded = {name for name, _ in film.bands}
        self._changing = film.changing
        self._width_step = max(_step(film.line_widths), _step(film.band_widths))
        self._glow_step = _step(film.glow_widths)
        self._letters: set[int] = set()
        self._widths: set[int] = set()
        self._glows: set[int] = set()
        self._turning: set[int] = set()
        self._captions = -1
        self._moves = self._redraws = False

    def group(self, group: Group) -> str:
        """A group, animated where it changes."""
        if group.id == self._film.caption:
            return self._caption(group)
        if group.id in self._fills:
            levels = _levels(self._film.fill_values[:, self._fills[group.id]])
            return self._animated(group, [self._letter(level) for level in levels.tolist()])
        if group.id in self._shifts:
            return self._shifted(group, self._film.shift_values[:, self._shifts[group.id]])
        if group.id in self._lines:
            return self._connection(group, self._lines[group.id])
        if group.id in self._film.redrawn:
            return self._redrawn(group)
        if group.id in self._banded:
            return self._bundle(group)
        return unchanging(group, _class(_FIXED))

    def _letter(self, level: int) -> str:
        self._letters.add(level)
        return LETTERS[level]

    def _connection(self, group: Group, place: int) -> str:
        tokens = [self._letter(level) for level in _levels(self._film.line_values[:, place]).tolist()]
        if self._changing[place]:
            widths = np.rint(self._film.line_widths[:, place] / self._width_step).astype(int).tolist()
            glows = np.rint(self._film.glow_widths[:, place] / self._glow_step).astype(int).tolist()
            self._widths.update(widths)
            self._glows.update(glows)
            tokens = [f"{c} w{w} g{g}" for c, w, g in zip(tokens, widths, glows, strict=True)]
            ends = self._film.line_ends[:, place].tolist()
            if len(set(ends)) > 1:
                tokens = [
                    token if end > 0 else f"{token} {_OTHERWISE[end]}" for token, end in zip(tokens, ends, strict=True)
                ]
                self._turning.update(ends)
        return self._animated(group, tokens)

    def _bundle(self, group: Group) -> str:
        """A group of lines that keep their colours and change their widths, each with its head for itself."""
        shapes, content, place = group.shapes, "", 0
        while place < len(shapes):
            shape, head = shapes[place], shapes[min(place + 1, len(shapes) - 1)]
            number = self._bands.get((group.id, place))
            if number is None or not isinstance(head, Arrowhead):
                content += element(shape, _class(_FIXED))
                place += 1
                continue
            levels = np.rint(self._film.band_widths[:, number] / self._width_step).astype(int).tolist()
            self._widths.update(levels)
            tokens = [f"{_BAND} w{level}" for level in levels]
            drawn = element(shape, _class(_FIXED)) + self._head_element(head, np.array([ENDS_OF[head.kind]]), True)
            content += f"<g{_class(tokens[0])}>{drawn}{animation(tokens, self._film.frames / self._film.fps)}</g>"
            place += 2
        return f"{open_group(group)}{content}</g>\n"

    def _animated(self, group: Group, tokens: Sequence[str]) -> str:
        since = self._film.faint.get(group.id)
        if since is not None:
            tokens = [f"{token} {_FAINT}" if frame >= since else token for frame, token in enumerate(tokens)]
        filled = filled_shape(group) if group.id in self._fills else None
        shapes = "".join(self._element(group, place, shape, filled) for place, shape in enumerate(group.shapes))
        frames = animation(tokens, self._film.frames / self._film.fps)
        return f"{open_group(group, _class(tokens[0]))}{shapes}{frames}</g>\n"

    def _element(self, group: Group, place: int, shape: Shape, filled: int | None) -> str:
        """A shape of a group whose colour changes."""
        match shape:
            case Text():
                return element(shape, _class("on") if shape.on_disc else "")
            case Disc() | Rectangle():
                return element(shape, "" if place == filled else _class(_FIXED))
            case Arrowhead() if group.id in self._lines and self._changing[self._lines[group.id]]:
                return self._head_element(shape, self._film.line_ends[:, self._lines[group.id]])
            case Arrowhead() | Spline() if group.id not in self._lines:
                return element(shape, _class(_FIXED))
            case _:
                return element(shape)

    def _shifted(self, group: Group, shifts: FloatArray) -> str:
        """A group that moves as a whole; its shapes are where they stand in frame 0."""
        tokens = [f"{num(x)} {num(y)}" if y else num(x) for x, y in shifts.tolist()]
        seconds = self._film.frames / self._film.fps
        frames = animation(tokens, seconds, '<animateTransform attributeName="transform" type="translate"')
        self._moves = True
        shapes = "".join(element(shape) for shape in group.shapes)
        return f"{open_group(group, _class(_SHIFTED))}{shapes}{frames}</g>\n"

    def _redrawn(self, group: Group) -> str:
        """A group whose shapes are others in each frame, and what it is in frame 0."""
        seconds, redrawn = self._film.frames / self._film.fps, self._film.redrawn[group.id]
        frames = [redrawn(frame) for frame in range(self._film.frames)]
        moving = "".join(redrawn_shape(shapes, seconds) for shapes in zip(*frames, strict=True))
        standing = "".join(element(shape) for shape in frames[0])
        self._redraws = True
        return f"{open_group(group)}<g{_class(_MOVING)}>{moving}</g><g{_shown(_STANDING, False)}>{standing}</g></g>\n"

    def _head_element(self, head: Arrowhead, ends: npt.NDArray[np.int8], fixed: bool = False) -> str:
        """A head in its own coordinates, so that its width alone can be scaled: at the tip, pointing right. One that
        is now a bar and now an arrow has both, of which the one that it is not at the moment is not displayed. One that
        is ``fixed`` keeps its colour."""
        (x, y), (dx, dy) = head.tip, head.direction
        place = f"matrix({dx:.4g} {dy:.4g} {-dy:.4g} {dx:.4g} {num(x)} {num(y)})"
        every = {1, *ends.tolist()} if len(set(ends.tolist())) > 1 else {ends[0].item()}
        both, inner, half = len(every) > 1, "", head.half_width
        if head.kind == "none":
            half = head_half_width(head.width, head.length)
        back, whole = -head.BAR * head.length, replace(head, half_width=half)
        if 1 in every:
            shown = _shown("arrow", head.kind == "arrow") if both else _class(_FIXED) if fixed else ""
            inner += self._part(replace(whole, kind="arrow").corners, whole, shown)
        if -1 in every:
            shown, corners = _class(_FIXED) if fixed else "", ((0.0, half), (back, half), (back, -half), (0.0, -half))
            across = self._part(corners, whole, shown)
            inner += f"<g{_shown('bar', head.kind == 'bar')}>{self._stem(head, back, fixed)}{across}</g>"
        if 0 in every:
            inner += f"<g{_shown('none', head.kind == 'none')}>{self._stem(head, 0.0, fixed)}</g>"
        return f'<g{_class("both") if both else ""} transform="{place}">{inner}</g>'

    def _stem(self, head: Arrowhead, end: float, fixed: bool) -> str:
        """What leads a line on, as wide as this, from the notch of its head."""
        start = -(head.NOTCH + head.LAP) * head.length
        path = f'<path class="stem" d="M{num(start)} 0H{num(end)}" stroke="{head.fill}" '
        return path + f'stroke-width="{num(head.width)}"{_kept(head.fill) if fixed else ""}/>'

    def _part(self, corners: Sequence[Point], head: Arrowhead, attributes: str = "") -> str:
        """What is filled of a head; its style says what its width follows from."""
        return (
            f'<polygon{attributes} points="{pairs(corners)}" fill="{head.fill}" '
            f'style="--h:{head.half_width:.4g};--l:{head.length:.4g}"/>'
        )

    def _caption(self, group: Group) -> str:
        """One text for each caption; all but the one of the moment are not displayed."""
        (shape,) = group.shapes
        assert isinstance(shape, Text)
        stride = max(1, math.ceil(self._film.frames / _MOST_CAPTIONS))
        shown = list(dict.fromkeys(self._film.captions[::stride]))
        number = {words: place for place, words in enumerate(shown)}
        tokens = [f"t{number[words]}" for words in self._film.captions[::stride] for _ in range(stride)]
        start = f'x="{num(shape.point[0])}" y="{num(shape.point[1])}"'
        hidden = ' display="none"'
        lines = "".join(
            f"<text {start}{hidden if place else ''}>{escape(words)}</text>" for place, words in enumerate(shown)
        )
        frames = animation(tokens[: self._film.frames], self._film.frames / self._film.fps)
        self._captions = len(shown)
        return (
            f'<g class="caption" font-size="{num(shape.size)}" fill="{shape.fill}"><g{_class(tokens[0])}>{lines}'
            f"{frames}</g></g>\n"
        )

    def style(self, root: str) -> str:
        """The style sheet; its rules hold only within the class ``root``, and where motion is welcome."""
        theme = self._film.scene.theme
        rules = [
            ",".join(f"{_COLOURED}{shape}:not(.{_FIXED})" for shape in (">circle", ">rect", " polygon"))
            + "{fill:currentColor}",
            f"{_COLOURED}>path:not(.glow):not(.{_FIXED}){{stroke:currentColor}}",
            f"{_COLOURED} .stem{{stroke:currentColor}}",
            ".on{fill:var(--d)}",
            *self._palette(theme),
        ]
        if self._widths:
            rules += self._width_rules()
        if self._turning:
            others = [end for end in _OTHERWISE if end in self._turning]
            rules += [*(f".both>.{_PARTS[end]}{{display:none}}" for end in others), ".both>.arrow{display:inline}"]
            for end in others:
                rules.append(f".{_OTHERWISE[end]}>.both>.{_PARTS[end]}{{display:inline}}")
                rules.append(f".{_OTHERWISE[end]}>.both>.arrow{{display:none}}")
        if self._film.faint:
            rules.append(f".{_FAINT}{{opacity:{num(self._film.faintness)}}}")
        if self._captions > 1:
            rules.append(".caption text{display:none}")
            rules += [f".t{n}>:nth-child({n + 1}){{display:inline}}" for n in range(self._captions)]
        scoped = "".join(_scoped(rule, root) for rule in rules)
        calm = [f".{_SHIFTED}{{transform:none!important}}"] if self._moves else []
        if self._redraws:
            calm += [f".{_MOVING}{{display:none}}", f".{_STANDING}{{display:inline}}"]
        still = "".join(_scoped(rule, root) for rule in calm)
        still = f"@media (prefers-reduced-motion:reduce){{{still}}}" if still else ""
        return f"<style>@media (prefers-reduced-motion:no-preference){{{scoped}}}{still}</style>\n"

    def _palette(self, theme: Theme) -> list[str]:
        levels = sorted(self._letters)
        fills = colours(theme, [2 * level / (LEVELS - 1) - 1 if level < LEVELS else math.nan for level in levels])
        return [
            f".{LETTERS[level]}{{color:{fill};--d:{readable(theme, fill)}}}"
            for level, fill in zip(levels, fills, strict=True)
        ]

    def _width_rules(self) -> list[str]:
        rules = [
            '[class*=" w"]>path:not(.glow),[class*=" w"] .stem{stroke-width:calc(var(--w)*1px)}',
            '[class*=" w"]>.glow{stroke-width:calc(var(--g)*1px)}',
            f'[class*=" w"] polygon{{transform:scaleY(calc({_half_width("var(--w)", "var(--l)")}/var(--h)))}}',
        ]
        rules += [f".w{level}{{--w:{num(level * self._width_step)}}}" for level in sorted(self._widths)]
        rules += [f".g{level}{{--g:{num(level * self._glow_step)}}}" for level in sorted(self._glows)]
        return rules


def _half_width(width: str, length: str) -> str:
    """``head_half_width`` as a CSS expression."""
    of_length, of_width, more = HEAD_OF_LENGTH, HEAD_OF_WIDTH, HEAD_MORE
    return f"max({of_length}*{length} + {of_width}*{width},{0.5 / Arrowhead.NOTCH:.4g}*{width} + {more})"


def _scoped(rule: str, root: str) -> str:
    """A rule for this picture alone, should it stand inside a page."""
    selectors, rest = rule.split("{", 1)
    return ",".join(f".{root} {selector}" for selector in selectors.split(",")) + "{" + rest


def _class(token: str) -> str:
    return f' class="{token}"'


def _kept(stroke: str) -> str:
    """A style that goes before the rules by which what is part of a line has its colour."""
    return f' style="stroke:{stroke}"'


def _shown(token: str, shown: bool) -> str:
    """The class of something that may not be displayed."""
    return _class(token) + ("" if shown else ' display="none"')


def _levels(values: FloatArray) -> IntArray:
    """The levels of colour values; LEVELS for NaN."""
    levels: IntArray = np.where(np.isnan(values), LEVELS, np.rint((np.nan_to_num(values) + 1) / 2 * (LEVELS - 1)))
    return levels.astype(np.int64)


def _step(widths: FloatArray) -> float:
    """The step to which widths are rounded: a twentieth of a unit, more where there would be too many widths."""
    return max(0.05, float(widths.max(initial=0.0)) / _MOST_WIDTHS)


def animation(tokens: Sequence[str], seconds: float, start: str = '<animate attributeName="class"') -> str:
    """The SMIL animation, of a class or what else ``start`` says, through ``tokens``, one a frame; '' where it never
    changes.

    Frames are told either one by one, which is even spacing, or where they change, whichever is shorter.
    """
    frames = len(tokens)
    changes = [place for place in range(frames) if place == 0 or tokens[place] != tokens[place - 1]]
    if len(changes) == 1:
        return ""
    every = ";".join(tokens)
    digits = len(str(frames)) + 2
    times = ";".join(_fraction(place, frames, digits) for place in changes)
    some = ";".join(tokens[place] for place in changes)
    values = f'values="{every}"'
    if len(some) + len(times) + 12 < len(every):
        values = f'values="{some}" keyTimes="{times}"'
    return f'{start} calcMode="discrete" dur="{seconds:.6g}s" repeatCount="indefinite" {values}/>'


#: The attributes in the start tag of an element.
_ATTRIBUTE = re.compile(r' ([a-z-]+)="([^"]*)"')


def redrawn_shape(shapes: Sequence[Shape], seconds: float) -> str:
    """A shape that is another one, of the same kind, in each frame: each attribute that changes is animated. Of a text
    that says other words there is one for each, of which those that are not said are not displayed."""
    words = [shape.text if isinstance(shape, Text) else "" for shape in shapes]
    said = list(dict.fromkeys(words))
    if len(said) == 1:
        return _attributes_animated(shapes, seconds)
    result = ""
    for one in filter(None, said):
        held, last = [], shapes[words.index(one)]
        for shape, word in zip(shapes, words, strict=True):
            last = shape if word == one else last  # while it is not displayed, it stays where it was
            held.append(last)
        display = ["inline" if word == one else "none" for word in words]
        result += _attributes_animated(held, seconds, display)
    return result


def _attributes_animated(shapes: Sequence[Shape], seconds: float, display: Sequence[str] = ()) -> str:
    """A shape with an animation of each attribute that changes, and of whether it is displayed."""
    first = f' display="{display[0]}"' if display else ""
    starts = [element(shape).partition(">")[0] for shape in shapes]
    found: list[dict[str, str]] = [dict(_ATTRIBUTE.findall(start)) for start in starts]
    frames = "".join(
        animation([one.get(name, value) for one in found], seconds, f'<animate attributeName="{name}"')
        for name, value in found[0].items()
    )
    if display:
        frames += animation(display, seconds, '<animate attributeName="display"')
    return element(shapes[0], first, frames)


def _fraction(place: int, frames: int, digits: int) -> str:
    """When a frame starts, as a share of the whole, rounded down so that it is not late."""
    scale = 10**digits
    return f"{place * scale // frames / scale:.{digits}f}".rstrip("0").rstrip(".").replace("0.", ".", 1) or "0"
