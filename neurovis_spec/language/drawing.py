"""The sections ``layout`` and ``render``: how a network is laid out and drawn; the shape as written.

In: nodes. Out: frozen models whose leaves know their places.
"""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import BeforeValidator, Field, ValidationInfo, WithJsonSchema

from neurovis_spec.language.located import (
    FORMULA,
    BoolField,
    FormulaField,
    Leaf,
    Located,
    TextField,
    findings_of,
    give_up,
    refuse,
    words,
)
from neurovis_spec.language.model import Keyed, Model
from neurovis_spec.language.source import Node, Packed, Sequence
from neurovis_spec.language.values import PointField, Reference, ReferenceField, TitleField, as_reference


def _references(node: Node, info: ValidationInfo) -> tuple[Reference, ...]:
    """A list of lists of references."""
    if not isinstance(node, (Sequence, Packed)):
        refuse(info, node, "a list of lists", "write [[K1, K2], [O1, O2]]")
    for item in node.items:
        if not isinstance(item, (Sequence, Packed)):
            refuse(info, item, "a list of references", "write [[K1, K2]], a list of lists")
    return tuple(as_reference(item, info) for item in node.items)


def _pairs(node: Node, info: ValidationInfo) -> tuple[Reference, ...]:
    """A list of pairs of references."""
    found = _references(node, info)
    for reference in found:
        if reference.failed:
            give_up()
        if len(reference.parts) != 2:
            message = f"a mirror has two sides, [left, right]; this has {len(reference.parts)}"
            findings_of(info).error("wrong-size", reference.span, message)
            give_up()
    return found


_TEXT = {"type": "string"}
_PAIR = {"type": "array", "items": _TEXT, "minItems": 2, "maxItems": 2}

# what a spec and a module both say of their drawing
ArrangeField = Annotated[
    Keyed[Annotated[Located[str], words("row", "column", "grid", "ring", "arc")]],
    Field(default_factory=dict, description="{reference: row | column | grid | ring | arc}."),
]
BoxesField = Annotated[Keyed[ReferenceField], Field(default_factory=dict, description="{title: references}.")]
MirrorField = Annotated[
    tuple[Reference, ...],
    Leaf(_pairs, {"type": "array", "items": _PAIR}),
    Field(default=(), description="[[left, right], …]: groups or instances; the second is the first's mirror image."),
]
AlignField = Annotated[
    tuple[Reference, ...],
    Leaf(_references, {"type": "array", "items": {"type": "array", "items": _TEXT}}),
    Field(default=(), description="[[references], …]: each list on one line across the direction."),
]


class Spacing(Model):
    """Distances of the layout in its units."""

    PLACE: ClassVar[str] = "'layout: spacing'"

    neuron: FormulaField | None = Field(None, description="Between neighbours of a rank (default 1).")
    rank: FormulaField | None = Field(None, description="Between ranks (default 2).")


ENGINES = ("auto", "layered", "organic", "large", "circular", "grid", "spatial", "manual")


class LayoutModel(Model):
    """How the network is laid out."""

    PLACE: ClassVar[str] = "'layout'"

    engine: TextField | None = Field(
        None,
        description="What lays it out: auto, layered, organic, large, circular, grid, spatial, manual, or a plug-in "
        "(default auto).",
    )
    direction: Annotated[Located[str], words("down", "up", "right", "left")] | None = Field(
        None, description="Where the signals go: down, up, right, left (default down)."
    )
    positions: Keyed[PointField] = Field(default_factory=dict, description="Pins: {neuron: [x, y]}.")
    arrange: ArrangeField
    boxes: BoxesField
    mirror: MirrorField
    align: AlignField
    file: TextField | None = Field(None, description="An earlier layout, whose places are kept where they can be.")
    spacing: Spacing | None = Field(None, description="Distances in units of the layout.")


class ModuleLayoutModel(Model):
    """How every instance of a module is laid out, relative to its origin."""

    PLACE: ClassVar[str] = "the 'layout' of a module"

    positions: Keyed[PointField] = Field(
        default_factory=dict, description="{neuron: [x, y]}, relative to the instance's origin."
    )
    arrange: ArrangeField
    boxes: BoxesField
    mirror: MirrorField
    align: AlignField


class Gain(Model):
    """The scaling factors γ of Eqs. 2–5; those not given suit the network's range."""

    PLACE: ClassVar[str] = "'render: gain'"

    activity: FormulaField | None = Field(None, description="γ_NC, Eq. 2: colour of neurons.")
    signal: FormulaField | None = Field(None, description="γ_CC, Eq. 3: colour of connections.")
    thickness: FormulaField | None = Field(None, description="γ_CT, Eq. 4: thickness of connections, pixels a unit.")
    change: FormulaField | None = Field(None, description="γ_LI, Eq. 5: glow of connections whose weight changes.")


class RenderModel(Model):
    """How the network is drawn."""

    PLACE: ClassVar[str] = "'render'"

    gain: Gain | None = Field(None, description="The scaling factors γ of Eqs. 2–5.")
    theme: Annotated[Located[str], words("default", "dark", "print", "paper")] | None = Field(
        None, description="The colours: default, dark, print or paper (default default)."
    )
    size: Annotated[
        tuple[FormulaField, FormulaField] | None,
        BeforeValidator(lambda node, info: _size(node, info)),
        WithJsonSchema({"type": "array", "items": FORMULA, "minItems": 2, "maxItems": 2}),
    ] = Field(None, description="[width, height] in pixels: 64 to 16384 each, and 33554432 in all.")
    labels: BoolField | None = Field(None, description="Whether neurons show their labels (default true).")
    legend: BoolField | None = Field(None, description="Whether there is a legend (default true).")
    title: TitleField | None = Field(
        None, description="Whether there is a title, or another text for it (default true)."
    )


def _size(node: Node, info: ValidationInfo) -> tuple[Node, Node]:
    if isinstance(node, Sequence) and len(node.items) == 2:
        return (node.items[0], node.items[1])
    refuse(info, node, "a size [width, height]")
