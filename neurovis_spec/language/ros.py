"""The ``ros`` section, as written: topics, types, fields, quality of service.

In: nodes. Out: frozen models whose leaves know their places. What needs the inputs and outputs of the network, or what
is known of message types, is checked by the compiler; whether a ROS is there, by nobody before it is needed.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Annotated, ClassVar

from pydantic import Field, ValidationInfo

from neurovis_spec.diagnostics import shorten
from neurovis_spec.language.grammar import BOOL, REFERENCES, Either, Plain, Role, naming
from neurovis_spec.language.located import (
    FormulaField,
    Leaf,
    Located,
    TextsField,
    as_bool,
    as_text,
    findings_of,
    give_up,
    words,
)
from neurovis_spec.language.model import Keyed, Model
from neurovis_spec.language.ros_types import all_types
from neurovis_spec.language.values import SEVERAL, Reference, as_reference
from neurovis_spec.language.words import MOST_NAMED, Durability, OnTimeout, Reliability
from neurovis_spec.language.yaml.source import Node, Scalar

#: Names joined with slashes; ROS 2 has no two underscores in a row.
_PATH = r"(?!.*__)[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*"
TOPIC = re.compile(rf"(~?/)?{_PATH}")
NAMESPACE = re.compile(rf"/|/?{_PATH}")
TYPE = re.compile(r"[A-Za-z][A-Za-z0-9_]*/(msg/)?[A-Za-z][A-Za-z0-9_]*")
FIELD = re.compile(r"[A-Za-z_][A-Za-z0-9_]*(\.[A-Za-z_][A-Za-z0-9_]*)*")

_JOINED = (
    "names joined with '/', each a letter or underscore, then letters, digits and underscores, no two '_' in a row"
)
#: How others write a type: ``std_msgs.msg.Float64``, ``std_msgs::msg::Float64``.
_FOREIGN_TYPE = re.compile(r"([A-Za-z]\w*)(?:\.|::)(?:msg(?:\.|::))?([A-Za-z]\w*)", re.ASCII)
#: How others write a field: ``data[0]``, ``linear/x``.
_INDEX = re.compile(r"\[.*\]")
#: DDS takes no longer name, and ROS 2 puts three characters before it.
_LONGEST = 252


def _named(what: str, pattern: re.Pattern[str], hint: Callable[[str], str]) -> Leaf[Node]:
    """The annotation of a field that holds a name of ROS."""

    def check(node: Node, info: ValidationInfo) -> Located[str]:
        text = as_text(node, info)
        if not pattern.fullmatch(text.value) or len(text.value) > _LONGEST:
            message = f"'{shorten(text.value)}' is not the name of {what}"
            findings_of(info).error("bad-ros-name", node.span, message, hint(text.value))
            give_up()
        return text

    return Leaf(check, Plain({"type": "string", "pattern": f"^(?=.{{1,{_LONGEST}}}$)({pattern.pattern})$"}))


def _of_topic(text: str) -> str:
    if len(text) > _LONGEST:
        return f"a topic has {_LONGEST} characters at most"
    return f"a topic is {_JOINED}; '/' or '~/' may stand before them"


def _of_namespace(text: str) -> str:
    return f"a namespace is {_JOINED}; '/' may stand before them"


def _of_type(text: str) -> str:
    foreign = _FOREIGN_TYPE.fullmatch(text)
    if foreign:
        return f"write {foreign[1]}/{foreign[2]}"
    known = [name for name in all_types() if name.endswith(f"/{text}")]
    return f"write {' or '.join(known)}" if known else "write package/Name or package/msg/Name"


def _of_field(text: str) -> str:
    if _INDEX.search(text):
        return "a field is a path of names; of an array it is the whole"
    return "a field is a path of names joined with dots, such as linear.x"


TopicField = Annotated[Located[str], _named("a topic", TOPIC, _of_topic)]
NamespaceField = Annotated[Located[str], _named("a namespace", NAMESPACE, _of_namespace)]
TypeField = Annotated[Located[str], _named("a message type", TYPE, _of_type), Role("message")]
PathField = Annotated[Located[str], _named("a field", FIELD, _of_field), Role("field")]


def _values(node: Node, info: ValidationInfo) -> Located[bool] | Reference:
    return as_bool(node, info) if _is_bool(node) else as_reference(node, info)


def _is_bool(node: Node) -> bool:
    return isinstance(node, Scalar) and isinstance(node.value, bool)


ValuesField = Annotated[Located[bool] | Reference, Leaf(_values, Either((BOOL, SEVERAL))), REFERENCES]


class QosModel(Model):
    """Quality of service, as ROS 2 knows it."""

    PLACE: ClassVar[str] = "'ros: qos'"

    reliability: Annotated[Located[Reliability], words(Reliability)] | None = Field(
        None, description="Whether what is lost is sent again: reliable or best_effort (default reliable)."
    )
    durability: Annotated[Located[Durability], words(Durability)] | None = Field(
        None, description="Whether who comes late gets the last messages (default volatile)."
    )
    depth: FormulaField | None = Field(
        None, description="How many messages wait to be sent (default those of two seconds, 10 at least)."
    )


class TopicModel(Model):
    """A topic, and where in its messages the numbers are."""

    topic: TopicField = Field(description="The topic.")
    type: TypeField | None = Field(
        None,
        description="Its type, package/Name or package/msg/Name; without it std_msgs/Float64, for several numbers "
        "std_msgs/Float64MultiArray.",
    )
    field: PathField | None = Field(
        None, description="A dotted path to the number or the array of numbers in the message (default data)."
    )


class SubscribeModel(TopicModel):
    """Where an input comes from."""

    PLACE: ClassVar[str] = "'ros: subscribe'"
    BARE: ClassVar[str] = "topic"

    names: TextsField | None = Field(
        None, description="The joints whose numbers are taken, in the order of the input; they are found by name."
    )
    timeout: FormulaField | None = Field(
        None, description="Seconds after the last message from which on it is as on_timeout says; without it, never."
    )
    on_timeout: Annotated[Located[OnTimeout], words(OnTimeout)] | None = Field(
        None, description="The input then keeps its last value, falls to 0, or the run stops (default zero)."
    )


class PublishModel(TopicModel):
    """Where an output goes to."""

    PLACE: ClassVar[str] = "'ros: publish'"
    BARE: ClassVar[str] = "topic"

    safe: FormulaField | None = Field(None, description="What is sent when the run ends or stops.")


class RosModel(Model):
    """How the network meets ROS."""

    PLACE: ClassVar[str] = "'ros'"

    namespace: NamespaceField | None = Field(None, description="Prefix of the topics (default /neurovis).")
    rate: FormulaField | None = Field(
        None, description="Steps a second, which must be given where 1/dt is above 1,000 (default 1/dt)."
    )
    qos: QosModel | None = Field(None, description="Quality of service of what is published (ROS 2).")
    values: ValuesField | None = Field(
        None,
        description="The neurons whose activities are published by their names, too, on …/values: references, true for "
        f"all, false for none (default all, where there are {MOST_NAMED} at most).",
    )
    subscribe: Annotated[Keyed[SubscribeModel], naming("input")] = Field(
        default_factory=dict, description="{input: where it comes from}."
    )
    publish: Annotated[Keyed[PublishModel], naming("output")] = Field(
        default_factory=dict, description="{output: where it goes to}."
    )
