"""Moving pictures: the frames of a Film as pixels, of which only what has changed is drawn anew.

In: a Film. Out: for any frame its pixels. What covers what hardly changes in a film: it is worked out once, for each
pixel the shapes that are seen in it, in order (an A-buffer: Carpenter 1984), with all that stands still behind them as
one colour. A frame then adds up colours times weights where a colour is another one, and works the weights out anew
where a line is wider or narrower. What moves otherwise (a caption, a cursor) is laid over or under the rest.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from neurovis_renderers import coverage
from neurovis_renderers.apart import FRAMES, Laid, laid
from neurovis_renderers.canvas import COVERED, Pixels, Stack, bands, portions, slots
from neurovis_renderers.coverage import BoolArray, Fragments, Heads, Numbers, Size, Strokes
from neurovis_renderers.sheet import LANE, WHOLE, Sheet, Words, lanes, lanes_of, packed, packed_all
from neurovis_spec.scene import (
    ENDS_OF,
    HEAD_MORE,
    HEAD_OF_LENGTH,
    HEAD_OF_WIDTH,
    Arrowhead,
    Film,
    FloatArray,
    Group,
    IntArray,
    Spline,
    Text,
    Theme,
    blend,
    filled_shape,
    part,
    readable,
    still,
)

#: Half widths of lines are told apart to so much of a pixel.
_STEP = np.float32(1 / 64)
#: Where more than this share of the pixels, or of what lies on them, changes, all are drawn anew.
_MUCH = 0.4
#: Fragments that are kept of a band.
MOST_KEPT = 6_000_000
#: How lines end, as a Film has it.
_Ends = npt.NDArray[np.int8]


class TooDeepError(Exception):
    """There is more to be kept of a film than is reasonable: its frames are painted each by itself."""


class Moving:
    """What all frames of a film have in common. ``Painter(moving)`` paints them; several may at the same time."""

    def __init__(self, film: Film) -> None:
        """Raises TooDeepError."""
        self.film, self.theme = film, film.scene.theme
        apart = tuple(group for group in film.scene.groups if _stands_apart(film, group))
        names = frozenset(group.id for group in apart)
        self.apart = part(film, names)
        self.sheet = Sheet(film.scene.groups, film.scene.density, names)
        places = zip(film.scene.groups, self.sheet.places, strict=True)
        self.apart_places = [where[0] for group, where in places if group.id in names]
        #: how many of what stands apart are redrawn and come last, so that nothing is in front of them
        self.last = next((k for k, group in enumerate(reversed(apart)) if group.id not in film.redrawn), len(apart))
        self._line_widths, self._line_ends = _with_bands(film)
        self._find_what_changes(names)
        self.bands = [Band(self, top, size) for top, size in bands(film.scene.pixels)]

    def _find_what_changes(self, apart: frozenset[str]) -> None:
        """Where in the order the parts are that change, and how wide lines are at least and at most."""
        film, sheet = self.film, self.sheet
        fill_of = {name: number for number, name in enumerate(film.fills)}
        line_of = {name: number for number, name in enumerate(film.lines)}
        fills, words, lines, glows, ends, bands, band_ends = ([(0, 0)][:0] for _ in range(7))
        band_of = {name: number for number, name in enumerate(film.bands, len(film.lines))}
        for group, places in zip(film.scene.groups, sheet.places, strict=True):
            if group.id in apart:
                continue
            if group.id in fill_of:
                number, first = fill_of[group.id], filled_shape(group)
                for index, shape in enumerate(group.shapes):
                    if index == first:
                        fills.append((places[index], number))
                    elif isinstance(shape, Text) and shape.on_disc:
                        words.append((places[index] + bool(shape.halo), number))
            elif group.id in line_of:
                number = line_of[group.id]
                for place, shape in zip(places, group.shapes, strict=True):
                    match shape:
                        case Spline(glow=True):
                            glows.append((place, number))
                        case Spline():
                            lines.append((place, number))
                        case Arrowhead():
                            ends.append((place, number))
            for number, (place, head) in enumerate(pairwise(places)) if band_of else ():
                if (group.id, number) in band_of:
                    bands.append((place, band_of[group.id, number]))
                    band_ends.append((head, band_of[group.id, number]))
        self._fills, self._words, self._lines, self._glows, self._ends, self._wide, self._headed = (
            np.array(pairs, np.int64).reshape(-1, 2).T
            for pairs in (fills, words, lines, glows, ends, [*lines, *bands], [*ends, *band_ends])
        )
        self._lengths = sheet.head_lengths[self._headed[0]] / film.scene.density
        #: which shapes get another colour, or another width, at any time
        self.coloured = np.zeros(len(sheet), bool)
        for values, parts in ((film.fill_values, (fills, words)), (film.line_values, (lines, ends))):
            turns = ((values != values[:1]) & ~(np.isnan(values) & np.isnan(values[:1]))).any(axis=0)
            for place, number in (pair for pairs in parts for pair in pairs):
                self.coloured[place] = turns[number]
        #: half widths and stems, at least and at most
        widths, line_ends = self._line_widths, self._line_ends
        self.least = self._halves(widths.min(axis=0), film.glow_widths.min(axis=0), line_ends[0])
        turned = (line_ends != line_ends[:1]).any(axis=0)
        wide = np.where(turned & (line_ends[0] == 0), np.int8(-1), line_ends[0])  # as it is when it is a head
        self.most = self._halves(widths.max(axis=0), film.glow_widths.max(axis=0), wide)
        self.shaped = self.least[0] != self.most[0]
        heads, whose = self._headed
        turning = heads[turned[whose]]
        self.shaped[turning] = True
        self.least[0][turning] = 0  # what is now an arrow and now something else hides nothing for certain
        self.least[1][turning] = -1

    def _halves(self, widths: FloatArray, glows: FloatArray, line_ends: _Ends) -> tuple[Numbers, Numbers]:
        """Half the width of every line, band, glow and head in pixels, by place, where lines and then bands have such
        widths (in user units); and of the stem of what ends in no arrow, −1 elsewhere."""
        density = self.film.scene.density
        halves: Numbers = self.sheet.halves + self.sheet.head_halves
        (lines, which), (shining, whose), (ends, of) = self._wide, self._glows, self._headed
        halves[lines] = widths[which] * (density / 2)
        halves[shining] = glows[whose] * (density / 2)
        wide, long = widths[of], self._lengths
        halves[ends] = density * np.maximum(
            HEAD_OF_LENGTH * long + HEAD_OF_WIDTH * wide, 0.5 / Arrowhead.NOTCH * wide + HEAD_MORE
        )
        stems = self.sheet.head_stems.copy()  # of those that stand still, too
        stems[ends] = np.where(line_ends[of] > 0, -1, wide * (density / 2))
        halves[ends] = np.where(line_ends[of] == 0, wide * (density / 2), halves[ends])
        result: Numbers = np.rint(halves / _STEP) * _STEP
        return result, stems

    def halves(self, frame: int) -> tuple[Numbers, Numbers]:
        """Half the width of every line, glow and head at a frame, by place, and of the stems."""
        return self._halves(self._line_widths[frame], self.film.glow_widths[frame], self._line_ends[frame])

    def colours(self, frame: int) -> IntArray:
        """The colours of all shapes at a frame, by place."""
        result = np.array(self.sheet.colours, np.int64)
        fills = packed_all(blend(self.theme, self.film.fill_values[frame]))
        lines = packed_all(blend(self.theme, self.film.line_values[frame]))
        for (places, which), colours in ((self._fills, fills), (self._lines, lines), (self._ends, lines)):
            result[places] = colours[which]
        result[self._words[0]] = [_readable(self.theme, fill) for fill in fills[self._words[1]].tolist()]
        return result


def _with_bands(film: Film) -> tuple[FloatArray, _Ends]:
    """How wide lines and then bands are, and how they end, (frames, lines and bands)."""
    if not film.bands:
        return film.line_widths, film.line_ends
    groups = {group.id: group.shapes for group in film.scene.groups}
    heads = [groups[name][place + 1] for name, place in film.bands]
    ends = np.array([ENDS_OF[head.kind] for head in heads if isinstance(head, Arrowhead)], np.int8)
    every = np.broadcast_to(ends, (film.frames, len(ends)))
    widths = np.concatenate([film.line_widths, film.band_widths], axis=1)
    return widths, np.concatenate([film.line_ends, every], axis=1)


def _stands_apart(film: Film, group: Group) -> bool:
    """Whether a group changes in other ways than by a colour or a width, or is seen in part."""
    others = (film.shifts, film.faint, film.redrawn)
    changes = group.id and (group.id == film.caption or any(group.id in names for names in others))
    return bool(changes) or group.opacity != 1


@lru_cache(maxsize=4096)
def _readable(theme: Theme, fill: int) -> int:
    """The colour of a text that can be read on a colour."""
    mask = (1 << LANE) - 1
    return packed(readable(theme, f"#{fill & mask:02x}{fill >> LANE & mask:02x}{fill >> 2 * LANE:02x}"))


def _most(chosen: BoolArray) -> bool:
    """Whether so many are chosen that it is quicker to draw all than to pick them out."""
    return int(np.count_nonzero(chosen)) > _MUCH * len(chosen)


class Band:
    """Of some rows of all frames what is seen in each pixel, from the front to the back.

    Pixels in which something changes are numbered, those with the most fragments first, so that the pixels with more
    than r of them are the first ``ends[r]``; their fragments r lie from ``begins[r]`` on in arrays of all.
    """

    def __init__(self, moving: Moving, top: int, size: Size) -> None:
        self.top, self.size = top, size
        found, strokes, heads, least = _gathered(moving, top, size)
        front, colours = len(moving.sheet), np.array(moving.sheet.colours, np.int64)
        rank = found.shares.copy()
        # of several pieces of a line the one that covers the pixel at the least width, the nearest
        rank[: len(strokes)] -= np.maximum(strokes.beyond, np.abs(strokes.beside) / strokes.secants)
        kept, still = _sorted_out(found, least, rank, moving.coloured | moving.shaped, front)
        stack = Stack(size[0] * size[1])
        stack.add(found.only(still), colours[found.owners[still]], front)
        #: the colour of each pixel behind all that changes
        self.behind = lanes(stack.over(packed(moving.theme.background)))
        chosen = np.flatnonzero(kept)
        found = found.only(chosen)
        by_pixel = slots(found, front)
        parts = [(end, which) for end, which in by_pixel.each()]
        self.pixels = by_pixel.pixels
        self.ends = [end for end, _ in parts]
        self.begins = [0, *np.cumsum(self.ends).tolist()]
        order = np.concatenate([which for _, which in parts]) if parts else np.empty(0, np.int64)
        self.owners, self.shares = found.owners[order], found.shares[order]
        position = np.full(len(kept), -1, np.int64)
        position[chosen[order]] = np.arange(len(order))
        #: the fragments of what gets another width, and where they lie
        some = position[: len(strokes)] >= 0
        self.strokes, self.stroke_at = strokes.only(some), position[: len(strokes)][some]
        at = position[len(strokes) : len(strokes) + len(heads)]
        self.heads, self.head_at = heads.only(at >= 0), at[at >= 0]
        #: the number of each pixel, −1 where nothing changes
        self.numbers = np.full(size[0] * size[1], -1, np.int64)
        self.numbers[self.pixels] = np.arange(len(self.pixels))

    def slots(self, some: IntArray) -> list[tuple[int, IntArray]]:
        """Where the fragments of some pixels lie, by their ascending numbers, from the front to the back: how many of
        the pixels have one more, and which it is."""
        result = []
        for begin, end in zip(self.begins, self.ends, strict=False):
            count = int(np.searchsorted(some, end))
            if not count:
                break
            result.append((count, some[:count] + begin))
        return result


def _gathered(moving: Moving, top: int, size: Size) -> tuple[Fragments, Strokes, Heads, Numbers]:
    """What may be seen in any frame, as wide as it gets: the fragments of strokes that get another width, of such
    heads, and of all else; and the shares of all when lines are narrowest."""
    widest, narrowest = moving.sheet.with_halves(*moving.most), moving.sheet.with_halves(*moving.least)
    stack, nothing = Stack(size[0] * size[1]), np.zeros(1, np.int64)
    still, strokes, heads, count = list[Fragments](), list[Strokes](), list[Heads](), 0
    for portion in portions(widest, 0, len(widest), (0, top), size, stack.covered):
        seen = portion.fragments(narrowest)
        stack.add(seen, np.broadcast_to(nothing, len(seen)), portion.front)
        still.append(seen.only(~moving.shaped[seen.owners]))
        strokes.append(portion.strokes.only(moving.shaped[portion.strokes.owners]))
        heads.append(portion.heads.only(moving.shaped[portion.heads.owners]))
        count += len(still[-1]) + len(strokes[-1]) + len(heads[-1])
        if count > MOST_KEPT:
            raise TooDeepError
    lines, ends = coverage.joined(strokes, coverage.NO_STROKES), coverage.joined(heads, coverage.NO_HEADS)
    fixed = coverage.joined(still, coverage.NOTHING)
    wide = [
        Fragments(lines.owners, lines.pixels, widest.stroke_shares(lines)),
        Fragments(ends.owners, ends.pixels, widest.head_shares(ends)),
        fixed,
    ]
    narrow = [narrowest.stroke_shares(lines), narrowest.head_shares(ends), fixed.shares]
    return coverage.joined(wide, coverage.NOTHING), lines, ends, np.concatenate(narrow)


def _sorted_out(
    found: Fragments, least: Numbers, rank: Numbers, changing: BoolArray, front: int
) -> tuple[BoolArray, BoolArray]:
    """Which fragments are kept, since something changes there or behind them, and which stand still behind all that
    changes; the others are hidden behind what covers them at any time."""
    by_pixel = slots(found, front, rank)
    left = np.full(len(by_pixel.pixels), WHOLE, np.float32)
    deepest = np.full(len(left), -1, np.int32)
    seen = np.zeros(len(found), bool)
    for depth, (end, which) in enumerate(by_pixel.each()):
        visible = left[:end] > COVERED
        seen[which] = visible
        deepest[:end][visible & changing[found.owners[which]]] = depth
        left[:end] -= np.rint(left[:end] * least[which])
    kept = np.zeros(len(found), bool)
    for depth, (end, which) in enumerate(by_pixel.each()):
        kept[which] = deepest[:end] >= depth
    kept &= seen
    return kept, seen & ~kept


def _words(sums: IntArray) -> Words:
    """The same as red, green, blue and nothing, a byte each."""
    rounded = sums + (WHOLE // 2) * (1 | 1 << LANE | 1 << 2 * LANE)
    result = rounded >> 13 & 255
    result |= rounded >> LANE + 5 & 255 << 8
    result |= rounded >> 2 * LANE - 3 & 255 << 16
    return result.astype(np.uint32)


def _over(one: Laid, behind: Words) -> Words:
    """What stands apart in front of the pixels that it lies over in part, which look so."""
    weights = np.rint(one.fragments.shares * WHOLE).astype(np.int64)
    return _words(one.colours * weights + lanes_of(behind) * (WHOLE - weights))


def _three(picture: Words) -> Pixels:
    """Red, green and blue alone, (n, 3): each word is written over the fourth byte of the one before."""
    result = np.empty(3 * len(picture) + 1, np.uint8)
    np.ndarray(picture.shape, np.uint32, result.data, 0, (3,))[:] = picture
    return result[:-1].reshape(-1, 3)


class Painter:
    """Paints frames of a film, each from what the one that it painted before it has in common with it."""

    def __init__(self, moving: Moving) -> None:
        self._moving = moving
        self._bands = [_Painted(moving, band) for band in moving.bands]
        self._colours = np.full(len(moving.sheet), -1, np.int64)
        self._halves = np.full((2, len(moving.sheet)), -2, np.float32)
        self._run = -1

    def paint(self, frame: int) -> Pixels:
        """The picture, (height, width, 3)."""
        moving = self._moving
        colours = moving.colours(frame)
        halves = np.stack(moving.halves(frame)) if moving.shaped.any() else self._halves
        recoloured, reshaped = colours != self._colours, moving.shaped & (halves != self._halves).any(axis=0)
        self._lay(frame // FRAMES)
        rows = []
        for band in self._bands:
            band.update(colours, recoloured, halves, reshaped)
            rows.append(band.with_apart(frame % FRAMES, colours))
        self._colours, self._halves = colours, halves
        return rows[0] if len(rows) == 1 else np.concatenate(rows)

    def _lay(self, run: int) -> None:
        """Draw what stands apart, for all frames of a run."""
        film, begin = self._moving.apart, run * FRAMES
        if run == self._run or not self._moving.apart_places:
            return
        stills = [still(film, frame).groups for frame in range(begin, min(begin + FRAMES, film.frames))]
        for band in self._bands:
            band.lay(stills)
        self._run = run


class _Painted:
    """A band as it looks at a frame."""

    def __init__(self, moving: Moving, band: Band) -> None:
        self._moving, self._band = moving, band
        self._shares = band.shares.copy()
        self._weights = np.zeros(len(band.shares), np.uint16)
        self._rest = np.zeros(len(band.pixels), np.uint16)
        self._behind = band.behind[band.pixels]
        self._picture = _words(band.behind * WHOLE)
        self._new = True
        #: what stands apart, by the frame of a run; and each as it was in the last of these
        self._apart = list[list[Laid]]()
        self._last = list[tuple[Group, Laid]]()

    def update(self, colours: IntArray, recoloured: BoolArray, halves: Numbers, reshaped: BoolArray) -> None:
        """Draw anew what has changed."""
        band, every = self._band, np.arange(len(self._rest))
        changed = np.zeros(len(every), bool)
        if self._new:
            recoloured = np.ones_like(recoloured)
            self._reshape(halves, self._moving.shaped)
            self._weigh(every)
        elif reshaped.any():
            changed[self._reshape(halves, reshaped)] = True
            self._weigh(np.flatnonzero(changed))
        self._new = False
        if recoloured.any():
            for begin, end in zip(band.begins, band.ends, strict=False):
                changed[:end] |= recoloured[band.owners[begin : begin + end]]
        if _most(changed):
            self._picture[band.pixels] = _words(self._sums(colours))
        elif changed.any():
            some = np.flatnonzero(changed)
            self._picture[band.pixels[some]] = _words(self._some_sums(some, colours))

    def _reshape(self, halves: Numbers, reshaped: BoolArray) -> IntArray:
        """Give what is ``reshaped`` its width; the numbers of the pixels where it lies."""
        band, sheet = self._band, self._moving.sheet.with_halves(*halves)
        strokes, heads, lines, ends = band.strokes, band.heads, band.stroke_at, band.head_at
        if not _most(chosen := reshaped[strokes.owners]):
            which = np.flatnonzero(chosen)
            strokes, lines = strokes.only(which), lines[which]
        if not _most(chosen := reshaped[heads.owners]):
            which = np.flatnonzero(chosen)
            heads, ends = heads.only(which), ends[which]
        self._shares[lines] = sheet.stroke_shares(strokes)
        self._shares[ends] = sheet.head_shares(heads)
        return np.concatenate([band.numbers[strokes.pixels], band.numbers[heads.pixels]])

    def _weigh(self, some: IntArray) -> None:
        """Work out how much is seen of each fragment in some pixels."""
        left = np.full(len(some), WHOLE, np.float32)
        for end, at in self._band.slots(some):
            weight = np.rint(left[:end] * self._shares[at])
            left[:end] -= weight
            self._weights[at] = weight
        self._rest[some] = left

    def _sums(self, colours: IntArray) -> IntArray:
        band = self._band
        sums: IntArray = self._behind * self._rest
        found = np.empty(band.ends[0] if band.ends else 0, np.int64)
        for begin, end in zip(band.begins, band.ends, strict=False):
            some = np.take(colours, band.owners[begin : begin + end], out=found[:end], mode="clip")
            some *= self._weights[begin : begin + end]
            sums[:end] += some
        return sums

    def _some_sums(self, some: IntArray, colours: IntArray) -> IntArray:
        sums: IntArray = self._behind[some] * self._rest[some]
        for end, at in self._band.slots(some):
            sums[:end] += colours[self._band.owners[at]] * self._weights[at]
        return sums

    def lay(self, stills: list[tuple[Group, ...]]) -> None:
        """Draw what stands apart, at the frames of a run; only what is not as it was before."""
        band, density = self._band, self._moving.sheet.density
        columns, last = list[list[Laid]](), list[tuple[Group, Laid]]()
        changed, new = list[list[bool]](), list[Group]()
        for number in range(len(self._moving.apart_places)):
            groups = [groups[number] for groups in stills]
            before = [self._last[number][0] if self._last else None, *groups]
            changed.append([group != earlier for group, earlier in zip(groups, before, strict=False)])
            new += [group for group, is_new in zip(groups, changed[-1], strict=True) if is_new]
        drawn = iter(laid(new, density, band.top, band.size) if new else ())
        for number, row in enumerate(changed):
            column = [self._last[number][1]] if self._last else []
            for is_new in row:
                column.append(next(drawn) if is_new else column[-1])
            columns.append(column[-len(row) :])
            last.append((stills[-1][number], column[-1]))
        self._apart, self._last = [list(row) for row in zip(*columns, strict=True)], last

    def with_apart(self, number: int, colours: IntArray) -> Pixels:
        """The picture with the groups that stand apart, at a frame of the run, (height, width, 3)."""
        wide, high = self._band.size
        apart = self._apart[number] if self._apart else []
        among, picture, covered = len(apart) - self._moving.last, self._picture, list[tuple[IntArray, Words]]()

        def put(pixels: IntArray, words: Words, before: Words) -> None:
            covered.append((pixels, before))
            picture[pixels] = words

        some = [one.as_fragments(place) for one, place in zip(apart[:among], self._moving.apart_places, strict=False)]
        if any(len(fragments) for fragments, _ in some):
            pixels, words = self._composed(some, colours)
            put(pixels, words, picture[pixels])
        for one in apart[among:]:
            put(one.covered, one.covering, picture[one.covered])
            before = picture[one.fragments.pixels]
            put(one.fragments.pixels, _over(one, before), before)
        result = _three(picture).reshape(high, wide, 3)
        for pixels, words in reversed(covered):
            picture[pixels] = words
        return result

    def _composed(self, apart: list[tuple[Fragments, IntArray]], colours: IntArray) -> tuple[IntArray, Words]:
        """The pixels in which some of what stands apart is seen, and how they look, with all that lies there."""
        pixels = np.sort(np.concatenate([fragments.pixels for fragments, _ in apart]))
        pixels = pixels[np.diff(pixels, prepend=-1) > 0]
        band, front = self._band, len(self._moving.sheet)
        stack = Stack(len(pixels))
        parts = [replace(one, pixels=np.searchsorted(pixels, one.pixels)) for one, _ in apart]
        paints = [shades for _, shades in apart]
        numbers = band.numbers[pixels]
        places = np.argsort(numbers)
        places = places[np.searchsorted(numbers[places], 0) :]
        for end, at in band.slots(numbers[places]):
            parts.append(Fragments(band.owners[at], places[:end], self._shares[at]))
            paints.append(colours[band.owners[at]])
        stack.add(coverage.joined(parts, coverage.NOTHING), np.concatenate(paints), front)
        return pixels, _words(stack.sums + stack.left.astype(np.int64) * band.behind[pixels])
