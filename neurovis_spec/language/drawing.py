"""The sections ``layout`` and ``render``, with its theme: how a network is laid out and drawn; the shape as written.

In: nodes. Out: frozen models whose leaves know their places.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Annotated, ClassVar, Final, NamedTuple

from pydantic import Field, ValidationInfo

from neurovis_spec.diagnostics import Span, shorten
from neurovis_spec.language import grammar
from neurovis_spec.language.grammar import (
    ENDS,
    FORMULA,
    NULL,
    REFERENCE,
    REFERENCES,
    TEXT,
    TWO,
    Either,
    Key,
    ListOf,
    Map,
    Plain,
    Role,
    Shape,
)
from neurovis_spec.language.located import (
    BoolField,
    Formula,
    FormulaField,
    Leaf,
    Located,
    TextField,
    as_formula,
    as_text,
    each,
    findings_of,
    give_up,
    items_of,
    one_of,
    refuse,
    valid,
    words,
)
from neurovis_spec.language.model import Keyed, Model, Short
from neurovis_spec.language.tables import TEXTS_OF_EDGES, EdgeTexts, as_edge_texts
from neurovis_spec.language.values import (
    Pair,
    PointField,
    Reference,
    ReferenceField,
    TitleField,
    ViewField,
    as_reference,
    pair,
    sole,
)
from neurovis_spec.language.words import VIEWS, WHOLE, Direction
from neurovis_spec.language.yaml.source import AnyList, Mapping, Node, Scalar, Sequence

_COLOUR = re.compile(r"#[0-9A-Fa-f]{6}")
THEMES: Final = {
    "default": "vermilion over grey to blue, on light",
    "dark": "the same on dark",
    "print": "for paper, readable without colour",
    "paper": "red, grey and green, as in the NeuroVis paper",
}


def _colour(node: Node, info: ValidationInfo) -> Located[str]:
    """``#rrggbb``."""
    text = as_text(node, info)
    if not _COLOUR.fullmatch(text.value):
        message = f"'{shorten(text.value)}' is not a colour"
        findings_of(info).error("bad-colour", node.span, message, "write six hexadecimal digits, '#d55e00', in quotes")
        give_up()
    return Located(text.value.lower(), text.node)


ColourField = Annotated[Located[str], Leaf(_colour, Plain({"type": "string", "pattern": f"^{_COLOUR.pattern}$"}))]


class ThemeModel(Model):
    """A theme of one's own: another one with other colours."""

    PLACE: ClassVar[str] = "'render: theme'"
    UNSAID: ClassVar[str] = "leave the key out, or write a colour in quotes, '#d55e00': # begins a comment"

    base: Annotated[Located[str], words(*THEMES, abouts=THEMES)] | None = Field(
        None, description="The theme whose colours hold where no other is given: default, dark, print or paper."
    )
    negative: ColourField | None = Field(None, description="The colour of −1, in quotes: '#d55e00'.")
    zero: ColourField | None = Field(None, description="The colour of 0.")
    positive: ColourField | None = Field(None, description="The colour of 1.")
    glow: ColourField | None = Field(None, description="Around connections whose weight changes.")
    background: ColourField | None = Field(None, description="Behind all.")
    ink: ColourField | None = Field(None, description="Titles, and labels beside discs.")
    muted: ColourField | None = Field(None, description="Other texts, and the lines of the legend.")
    box_fill: ColourField | None = Field(None, description="Within boxes.")
    box_line: ColourField | None = Field(None, description="Around boxes.")
    ring: ColourField | None = Field(None, description="Around discs.")
    light: ColourField | None = Field(None, description="Texts on dark discs.")
    dark: ColourField | None = Field(None, description="Texts on light discs.")
    ends: Annotated[Located[str], words("signs", "arrows")] | None = Field(
        None,
        description="Lines end as the sign of their weight says, or all in arrowheads: signs, arrows (default signs).",
    )


ThemeField = Annotated[ThemeModel, Short("base", "the name of a theme, or a mapping of its colours")]


def _references(node: Node, info: ValidationInfo) -> tuple[Reference, ...]:
    """A list of lists of references."""
    items = items_of(node, info, "a list of lists", "write [[K1, K2], [O1, O2]]")
    return tuple(_several(item, info) for item in items)


def _several(node: Node, info: ValidationInfo) -> Reference:
    items = items_of(node, info, "a list of references", "write [[K1, K2]], a list of lists")
    return Reference(each(items, as_text, info), node.span)


def _pairs(node: Node, info: ValidationInfo) -> tuple[Reference, ...]:
    """A list of pairs of references."""
    found = _references(node, info)
    for parts, span in found:
        if len(parts) != 2:
            message = f"a mirror has two sides, [left, right]; this has {len(parts)}"
            findings_of(info).error("wrong-size", span, message)
            give_up()
    return found


class PlanRow(NamedTuple):
    """A row of the page as written: the name in each cell, None where a cell is empty."""

    cells: tuple[Located[str] | None, ...]
    span: Span


def _plan(node: Node, info: ValidationInfo) -> tuple[PlanRow, ...]:
    """A list of rows of names; ``~`` is an empty cell."""
    hint = "write [[left1, ~, right1], [left2, middle, right2]]"

    def row(node: Node, info: ValidationInfo) -> PlanRow:
        return PlanRow(each(items_of(node, info, "a row, that is a list of names", hint), _cell, info), node.span)

    return tuple(row(item, info) for item in items_of(node, info, "a list of rows", hint))


def _cell(node: Node, info: ValidationInfo) -> Located[str] | None:
    return None if isinstance(node, Scalar) and node.value is None else as_text(node, info)


# what a spec and a module both say of their drawing
ArrangeField = Annotated[
    Keyed[Annotated[Located[str], words("row", "column", "grid", "ring", "arc")]],
    REFERENCES,
    Field(default_factory=dict, description="{reference: row | column | grid | ring | arc}."),
]
BoxesField = Annotated[Keyed[ReferenceField], Field(default_factory=dict, description="{title: references}.")]
MirrorField = Annotated[
    tuple[Reference, ...],
    Leaf(_pairs, ListOf(ListOf(TEXT, least=2, most=2))),
    REFERENCES,
    Field(default=(), description="[[left, right], …]: groups or instances; the second is the first's mirror image."),
]
AlignField = Annotated[
    tuple[Reference, ...],
    Leaf(_references, ListOf(ListOf(TEXT))),
    REFERENCES,
    Field(default=(), description="[[references], …]: each list on one line across the direction."),
]

PlanField = Annotated[
    tuple[PlanRow, ...],
    Leaf(_plan, ListOf(ListOf(Either((TEXT, NULL))))),
    REFERENCES,
    Field(
        default=(),
        description="[[name, ~, name], …]: rows of the page; a cell is an instance, a group, a box's title or empty.",
    ),
]


class Spacing(Model):
    """Distances of the layout in its units."""

    PLACE: ClassVar[str] = "'layout: spacing'"

    neuron: FormulaField | None = Field(None, description="Between neighbours of a rank (default 1).")
    rank: FormulaField | None = Field(None, description="Between ranks (default 2).")


class LayoutModel(Model):
    """How the network is laid out."""

    PLACE: ClassVar[str] = "'layout'"
    BARE: ClassVar[str] = "engine"

    engine: Annotated[TextField, Role("engine")] | None = Field(
        None,
        description="What lays it out: auto, layered, organic, large, circular, grid, spatial, manual, or a plug-in "
        "(default auto).",
    )
    direction: Annotated[Located[Direction], words(Direction)] | None = Field(
        None,
        description="Where the signals go: down, up, right, left; a page of a given size may have them go right "
        "where this is left out (default down).",
    )
    positions: Annotated[Keyed[PointField], REFERENCES] = Field(
        default_factory=dict, description="Pins: {neuron: [x, y]}."
    )
    arrange: ArrangeField
    boxes: BoxesField
    mirror: MirrorField
    align: AlignField
    plan: PlanField
    file: TextField | None = Field(None, description="An earlier layout, whose places are kept where they can be.")
    spacing: Spacing | None = Field(None, description="Distances in units of the layout.")
    view: ViewField | None = Field(
        None, description="From where positions of three numbers are seen: top, front, side, or [azimuth, elevation]."
    )


class ModuleLayoutModel(Model):
    """How every instance of a module is laid out, relative to its origin."""

    PLACE: ClassVar[str] = "the 'layout' of a module"

    positions: Annotated[Keyed[PointField], REFERENCES] = Field(
        default_factory=dict, description="{neuron: [x, y]}, relative to the instance's origin."
    )
    arrange: ArrangeField
    boxes: BoxesField
    mirror: MirrorField
    align: AlignField
    plan: PlanField


class Range(NamedTuple):
    """What is drawn as −1, and as +1."""

    low: Formula
    high: Formula


class GainValue(NamedTuple):
    """A gain as written: for what ``key`` refers to (None: for all) a factor, or a range; None where it is invalid."""

    key: Located[str] | None
    value: Formula | Range | None
    span: Span


def _factor(node: Node, info: ValidationInfo) -> Formula:
    if isinstance(node, AnyList):
        refuse(info, node, "a number or an expression", "a range [low, high] is for 'activity' alone")
    return as_formula(node, info)


def _factor_or_range(node: Node, info: ValidationInfo) -> Formula | Range:
    if not isinstance(node, AnyList):
        return as_formula(node, info)
    if len(node.items) != 2:
        refuse(info, node, "a gain, or a range [low, high]")
    return Range(*each(node.items, as_formula, info))


def _gains(
    node: Node, info: ValidationInfo, read: Callable[[Node, ValidationInfo], Formula | Range]
) -> tuple[GainValue, ...]:
    """One gain for all, or a mapping from references to gains, each of which is checked."""
    if not isinstance(node, Mapping):
        return (GainValue(None, read(node, info), node.span),)
    if not node.entries:
        hint = "leave the key out, or give it a value"
        findings_of(info).error("no-value", node.span, "expected {reference: gain}, found nothing", hint)
        give_up()
    found = []
    for entry in node.entries:
        value = next(valid((entry.value,), read, info), None)
        found.append(GainValue(Located(entry.name, entry.key), value, entry.value.span))
    return tuple(found)


def _by_reference(value: Shape, role: Role) -> Either:
    """A gain, or a mapping of references to gains."""
    return Either((value, Map({}, value, role, least=1)))


GainField = Annotated[
    tuple[GainValue, ...], Leaf(lambda node, info: _gains(node, info, _factor), _by_reference(FORMULA, ENDS))
]
ActivityGainField = Annotated[
    tuple[GainValue, ...],
    Leaf(lambda node, info: _gains(node, info, _factor_or_range), _by_reference(Either((FORMULA, TWO)), REFERENCES)),
]


class Gain(Model):
    """The scaling factors γ of Eqs. 2–5; those not given suit what each group and each entry reaches."""

    PLACE: ClassVar[str] = "'render: gain'"

    activity: ActivityGainField = Field(
        (), description="γ_NC, Eq. 2: colour of neurons; also a range [low, high], and {neurons: gain or range}."
    )
    signal: GainField = Field((), description="γ_CC, Eq. 3: colour of connections; also {FROM -> TO: gain}.")
    thickness: GainField = Field(
        (), description="γ_CT, Eq. 4: thickness of connections, pixels a unit; also {FROM -> TO: gain}."
    )
    change: GainField = Field(
        (), description="γ_LI, Eq. 5: glow of connections whose weight changes; also {FROM -> TO: gain}."
    )


class PanelModel(NamedTuple):
    """A view, and what it shows; None where it shows what it chooses by itself."""

    view: Located[str]
    shown: Reference | None


def _figure(node: Node, info: ValidationInfo) -> tuple[PanelModel, ...]:
    """A view, or a list of them, without those that are invalid."""
    return tuple(valid(node.items if isinstance(node, Sequence) else (node,), _panel, info))


def _panel(node: Node, info: ValidationInfo) -> PanelModel:
    """``traces``, or ``{traces: [C1, C2]}``."""
    view = one_of(*VIEWS)
    if isinstance(node, Scalar) and isinstance(node.value, str):
        return PanelModel(view(node, info), None)
    if not isinstance(node, Mapping):
        refuse(info, node, "a view, such as traces or {traces: [C1, C2]}")
    entry = sole(node, "view", "write a list: [network, {traces: [C1, C2]}]", info)
    name = view(entry.key, info)
    if isinstance(entry.value, Scalar) and entry.value.value is None:
        return PanelModel(name, None)
    if name.value in WHOLE:
        message = f"nothing here: the view '{name.value}' shows {WHOLE[name.value]}"
        refuse(info, entry.value, message, f"write {name.value} alone")
    return PanelModel(name, as_reference(entry.value, info))


_PART = Plain(REFERENCE.written, ENDS)
_PARTS = Either((_PART, ListOf(_PART, least=1)))
_PANEL = Either(
    (
        grammar.words(*VIEWS),
        Map(
            {
                **{name: Key(_PARTS, "What it shows.") for name in VIEWS if name not in WHOLE},
                **{name: Key(NULL, f"The {name}.") for name in WHOLE},
            },
            one=True,
        ),
    )
)
FigureField = Annotated[tuple[PanelModel, ...], Leaf(_figure, Either((_PANEL, ListOf(_PANEL))))]


class LinesModel(Model):
    """How connections are drawn, beside their colour and their thickness."""

    PLACE: ClassVar[str] = "'render: lines'"

    style: Annotated[EdgeTexts, Leaf(as_edge_texts, TEXTS_OF_EDGES)] | None = Field(
        None,
        description="{column: NAME} of the files of edges: solid, dashed, … by its values, in their order as names.",
    )


class RenderModel(Model):
    """How the network is drawn."""

    PLACE: ClassVar[str] = "'render'"
    BARE: ClassVar[str] = "theme"

    gain: Gain | None = Field(None, description="The scaling factors γ of Eqs. 2–5.")
    trace: Annotated[Keyed[FormulaField], REFERENCES] = Field(
        default_factory=dict,
        description="{neurons: seconds}: how long activity is still seen while it fades, to 1/e; 0: not at all.",
    )
    show: Annotated[Keyed[Annotated[TextField, Role("state", "model")]], REFERENCES] = Field(
        default_factory=dict,
        description="{neurons: state}: a state or an output whose value is their colour, in place of the activity.",
    )
    lines: LinesModel | None = Field(None, description="How connections are drawn: {style: {column: NAME}}.")
    theme: ThemeField | None = Field(
        None, description="The colours: default, dark, print, paper, or other ones (default default)."
    )
    size: Annotated[Pair, pair("a size [width, height]")] | None = Field(
        None, description="[width, height] in pixels: 64 to 16384 each, and 33554432 in all."
    )
    labels: BoolField | None = Field(None, description="Whether neurons show their labels (default true).")
    legend: BoolField | None = Field(None, description="Whether there is a legend (default true).")
    title: TitleField | None = Field(
        None, description="Whether there is a title, or another text for it (default true)."
    )
    figure: FigureField = Field(
        (),
        description="The views that make up the picture, from top to bottom: network or pathways, matrix, traces, "
        "raster, weights, body, or {traces: references} (default the network, with its body where a run has one).",
    )
    window: FormulaField | None = Field(
        None, description="How many steps around the one that is drawn the views over time show (default all)."
    )
    collapse: ReferenceField | None = Field(
        None, description="Groups and instances that are drawn as one glyph each, with what connects them added up."
    )
    min_weight: FormulaField | None = Field(
        None, description="Connections with |w| below this are left out; 0 draws all, however many there are."
    )
