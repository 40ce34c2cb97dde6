"""The figure: several views of a run on one page, as a Film; of one step, a film of one frame.

In: a network, its layout (where a view needs it), a Look, the rows of a recording that are shown, gains. Out: a Film.
What shares the page shares its time: the last of several views over time has the axis, and in all of them a cursor
stands at the step of the frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from neurovis_spec.compiler.drawing.drawing_settings import RenderSettings
from neurovis_spec.compiler.network import Network
from neurovis_spec.layout.model import Layout
from neurovis_spec.layout.problem import in_direction
from neurovis_spec.scene.body import PLOT, BodyPicture
from neurovis_spec.scene.caption import HEADER, MOST_TITLE, caption, caption_text, lowered, title_lines
from neurovis_spec.scene.encode import CAPTION
from neurovis_spec.scene.film import film
from neurovis_spec.scene.frame import DENSEST, DENSITIES, MARGIN, MOST, whole
from neurovis_spec.scene.gains import Gains
from neurovis_spec.scene.look import Look
from neurovis_spec.scene.model import Film, Group, Theme
from neurovis_spec.scene.parts import Page, Part, moved, stacked
from neurovis_spec.scene.poses import Poses
from neurovis_spec.scene.shots import Shots
from neurovis_spec.scene.strips import Span
from neurovis_spec.scene.themes import theme_of
from neurovis_spec.scene.views import AXIS, Block, BlockSpace, Drawing, Embodied, Maker, span_of

#: How wide a page without a picture of the network is, and the least with one (user units).
PAGE = 760.0
#: User units above the first view without a heading, between views, and beneath the last.
_TOP, _GAP, _FOOT = 8.0, 14.0, 12.0
#: Beside a network, other views take at most this share of a stated height.
_SHARE = 0.45
#: Plots are at least this share of what they are by themselves; what does not fit then is drawn smaller.
_LEAST = 0.35


@dataclass(frozen=True)
class _Sheet:
    """A page before anything stands on it: its width and, where it is stated, its height (user units)."""

    width: float
    height: float | None
    density: float


class PageGains(NamedTuple):
    """The gains of Eqs. 2–5 of a page: of the views that show each neuron, where one needs them; and of the picture of
    the network, in which something may be collapsed."""

    each: Gains | None
    picture: Gains | None


def figure(network: Network, layout: Layout | None, look: Look, shots: Shots, gains: PageGains) -> Film:
    """The picture of some steps of a run, a frame for each of ``shots.frames``: its views one below the other, or the
    network alone. Raises RecordingError where the recording lacks what they show, KeyError for an unknown theme."""
    if not look.panels:
        assert gains.picture is not None
        return film(network, layout, shots.snapshots(network), gains.picture, look.settings, look.fps or 1.0)
    network, settings = in_direction(network, layout), look.settings
    explained = look.shows("network") and settings.legend
    maker = Maker(network, layout, shots, gains.each, explained, settings.min_weight)
    others = {number: maker.block(panel) for number, panel in enumerate(look.panels) if panel.view != "network"}
    title = _title(network, settings)
    picture, sheet, blocks = None, _sheet(settings), list(others.values())
    if look.shows("network"):
        assert gains.picture is not None
        own, narrowest = _beside(settings, blocks, _head(title, sheet.width)), PAGE if others else 0.0
        picture = film(network, layout, shots.snapshots(network), gains.picture, own, look.fps or 1.0, narrowest)
        blocks = [_beneath(others[k], picture) if k in others else Drawing(picture) for k in range(len(look.panels))]
        density = picture.scene.density
        sheet = _Sheet(picture.scene.width, None if settings.size is None else settings.size[1] / density, density)
    span = span_of(blocks, shots, sheet.width, network.shown_dt)
    theme, captions = theme_of(settings), _captions(network, shots)
    head, down = _head(title, sheet.width), 0.0 if title is None else lowered(title, sheet.width)
    parts, bottom = _placed(blocks, sheet, span, theme, head)
    if title is not None:
        under = caption_text(captions[0], sheet.width, theme, down)
        heading = Group(title_lines(title, sheet.width, theme), id="title"), Group((under,), id=CAPTION)
        parts.insert(0, (0.0, Part(heading, head - _TOP)))
    said = tuple(caption_text(words, sheet.width, theme).text for words in captions)
    names = tuple(f"{network.title or network.name}, {words}" for words in captions)
    sheet, parts = _fitted(sheet, parts, bottom, settings)
    assert sheet.height is not None
    page = Page(sheet.width, sheet.height, sheet.density, theme, names[0], look.fps or 1.0, CAPTION, said, names)
    return stacked(page, parts, picture)


def _beside(settings: RenderSettings, others: Sequence[Block], head: float) -> RenderSettings:
    """The settings of the picture of the network on a page that has a title, and these views besides."""
    size = None
    if settings.size is not None:
        size = settings.size[0], _height_left(others, head, settings.size)
    return replace(settings, size=size, title=False)


def _placed(
    blocks: Sequence[Block], sheet: _Sheet, span: Span, theme: Theme, head: float
) -> tuple[list[tuple[float, Part]], float]:
    """The parts of all views, each with where it begins, and where the page ends."""
    share = 1.0 if sheet.height is None else _share(blocks, sheet.width, sheet.height - head - _FOOT)
    parts, top = list[tuple[float, Part]](), head
    for number, block in enumerate(blocks):
        axis = block.timed and not (number + 1 < len(blocks) and blocks[number + 1].timed)
        part = block.part(BlockSpace(sheet.width, span, share, axis, theme, f"p{number}:"))
        parts.append((top, part))
        top += part.height + _GAP
    return parts, whole(top - _GAP + _FOOT)


def with_body(picture: Film, poses: Poses) -> Film:
    """A film of a network with the body below it, in the pose of each frame."""
    scene, body = picture.scene, BodyPicture(poses)
    part = body.part(MARGIN, scene.width - MARGIN, _plot(body, picture), scene.theme, "body:")
    top = scene.height + _GAP
    height = whole(top + part.height + _FOOT)
    words = picture.caption, picture.captions, picture.titles
    page = Page(scene.width, height, scene.density, scene.theme, scene.title, picture.fps, *words)
    return stacked(page, [(0.0, Part(scene.groups, scene.height)), (top, part)], picture)


def _beneath(block: Block, picture: Film) -> Block:
    """A view on a page with the picture of the network."""
    return replace(block, plot=_plot(block.picture, picture)) if isinstance(block, Embodied) else block


def _plot(body: BodyPicture, picture: Film) -> float:
    """How high the drawings of a body are, of a page of which the network keeps at least half."""
    return min(PLOT, max(picture.scene.height - body.fixed - _GAP - _FOOT, _LEAST * PLOT))


def _captions(network: Network, shots: Shots) -> list[str]:
    """The line under the title in each frame; what was not recorded is not said."""
    recording = shots.recording
    whole_, steps = recording.recorded is None, recording.step
    none = recording.activity[0, :0]
    return [
        caption(network, int(steps[row]), recording.activity[row] if whole_ else none) for row in shots.frames.tolist()
    ]


def _title(network: Network, settings: RenderSettings) -> str | None:
    """What stands above all; nothing on a page that is too low for it."""
    words = settings.title if isinstance(settings.title, str) else network.title or network.name
    if settings.title is False or not words:
        return None
    sheet = _sheet(settings)
    low = sheet.height is not None and lowered(words, sheet.width) > MOST_TITLE * sheet.height
    return None if low or (settings.size is not None and settings.size[1] < 4 * HEADER) else words


def _head(title: str | None, width: float) -> float:
    """Where the first view begins on a page of this width."""
    return _TOP if title is None else HEADER + lowered(title, width) + _TOP


def _sheet(settings: RenderSettings) -> _Sheet:
    """A page without a picture of the network."""
    if settings.size is None:
        return _Sheet(PAGE, None, next(d for d in DENSITIES if d == 1 or d * PAGE <= MOST[0]))
    density = min(max(1.0, settings.size[0] / PAGE), DENSEST)
    return _Sheet(settings.size[0] / density, settings.size[1] / density, density)


def _needed(blocks: Sequence[Block], width: float) -> tuple[float, float]:
    """What of the height of all blocks cannot change, and what can."""
    heights = [block.heights(width) for block in blocks]
    axes = sum(
        block.timed and not (number + 1 < len(blocks) and blocks[number + 1].timed)
        for number, block in enumerate(blocks)
    )
    fixed = sum(one[0] for one in heights) + axes * AXIS + _GAP * max(len(blocks) - 1, 0)
    return fixed, sum(one[1] for one in heights)


def _height_left(others: Sequence[Block], head: float, size: tuple[int, int]) -> int:
    """How many pixels of a page's height the picture of the network has."""
    density = min(max(1.0, size[0] / PAGE), DENSEST)
    fixed, free = _needed(others, size[0] / density)
    taken = (fixed + free + head + _FOOT + _GAP) * density
    return max(round(size[1] - min(taken, _SHARE * size[1])), 16)


def _share(blocks: Sequence[Block], width: float, room: float) -> float:
    """How much higher or lower than by themselves plots are, so that all blocks fill the room."""
    fixed, free = _needed(blocks, width)
    return max((room - fixed) / free, _LEAST) if free else 1.0


def _fitted(
    sheet: _Sheet, parts: list[tuple[float, Part]], needed: float, settings: RenderSettings
) -> tuple[_Sheet, list[tuple[float, Part]]]:
    """The page as high as it has to be, or of the size that is stated: what does not fit is drawn smaller."""
    if settings.size is None or sheet.height is None:
        return _Sheet(sheet.width, needed, sheet.density), parts
    if needed <= sheet.height + 1:
        return sheet, parts
    density = settings.size[1] / needed
    width = settings.size[0] / density
    aside = (width - sheet.width) / 2
    return _Sheet(width, needed, density), [(top, moved(part, (aside, 0.0))) for top, part in parts]
