"""The ``ros`` section: the topics and settings of a node, checked against the inputs and outputs of the network.

In: the section as written, the inputs and outputs. Out: RosSettings, a value of the Network that the ROS commands read;
or findings. No ROS has to be installed: message types are checked against a table of the usual ones.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Final

from neurovis_spec.compiler.limits import plural
from neurovis_spec.compiler.names.references import Directory, key_of, known_inputs, resolve
from neurovis_spec.compiler.names.scope import Surroundings
from neurovis_spec.compiler.network import Input
from neurovis_spec.compiler.ros_settings import (
    MOST_WAITING,
    NAMESPACE,
    Publication,
    RosSettings,
    Subscription,
    absolute,
    by_name,
)
from neurovis_spec.compiler.values.constants import Constants
from neurovis_spec.diagnostics import Findings, Home, Undeclared, shorten
from neurovis_spec.language.located import Formula, Located, value_or
from neurovis_spec.language.model import names_of, opening
from neurovis_spec.language.ros import PublishModel, RosModel, SubscribeModel
from neurovis_spec.language.ros_types import Field, all_types, fields_of, misspelt, numbers_of, plain
from neurovis_spec.language.spec import Spec
from neurovis_spec.language.unknown import known
from neurovis_spec.likeness import suggest

#: Where a message has its numbers if nothing else is said.
_DATA: Final = "data"
#: The types of what the network itself publishes.
_ARRAY: Final = "std_msgs/Float64MultiArray"
_SPEC: Final = "std_msgs/String"
_VALUES: Final = "diagnostic_msgs/DiagnosticArray"
#: The most steps a second that a node makes unless the spec says so.
_MOST_RATE: Final = 1000 * (1 + 1e-9)


def ros_settings(model: RosModel, around: Surroundings, directory: Directory, constants: Constants) -> RosSettings:
    """The ``ros`` section of a spec, whose ``directory`` knows what references name. What is invalid in it is reported
    and left out."""
    rate = None if model.rate is None else _above_zero(model.rate, "'rate' is steps a second", constants)
    if model.rate is None and "rate" not in model.unknown and constants.timed and 1 / constants.dt > _MOST_RATE:
        message = f"a node would make {1 / constants.dt:,.6g} steps a second, by dt; above 1,000 they are written"
        hint = "add rate: how many steps a second it is to make, as many as the machine can"
        constants.findings.error("out-of-range", opening(model.source), message, hint)
    namespace = NAMESPACE if model.namespace is None else f"/{model.namespace.value.strip('/')}"
    qos, depth = model.qos, None
    if qos is not None and qos.depth is not None:
        depth = known(constants.integer(qos.depth, "'depth'", 1, MOST_WAITING, structural=False), None)
    settings = RosSettings(
        namespace=namespace,
        rate=1 / constants.dt if rate is None else rate,
        reliability="reliable" if qos is None else value_or(qos.reliability, "reliable"),
        durability="volatile" if qos is None else value_or(qos.durability, "volatile"),
        depth=depth,
        subscribe=tuple(_subscriptions(model, around, constants)),
        publish=tuple(_publications(model, around, constants)),
        values=_values(model, directory, constants.findings),
    )
    name, neurons = known(around.spec.name.value, ""), len(directory.members)
    _check_topics(model, settings, name, bool(by_name(settings.values, neurons)), constants.findings)
    return settings


def _values(model: RosModel, directory: Directory, findings: Findings) -> tuple[int, ...] | None:
    """The neurons that are published by name; None where the spec does not say, or what it says is invalid."""
    if model.values is None:
        return None
    if isinstance(model.values, Located):
        return tuple(directory.members) if model.values.value else ()
    return known(resolve(model.values.parts, directory, findings, instances=True), None)


def _check_topics(model: RosModel, settings: RosSettings, name: str, named: bool, findings: Findings) -> None:
    """A topic has messages of one type, and of one output: who listens cannot tell them apart. ``named`` is whether
    activities are published by name, too."""
    node = f"{settings.namespace.rstrip('/')}/{name}"
    own = {f"{node}/activity": "the activities", f"{node}/weights": "the weights", f"{node}/spec": "the spec"}
    types = {topic: _SPEC if what == "the spec" else _ARRAY for topic, what in own.items()}
    if named:
        own[f"{node}/values"], types[f"{node}/values"] = "the activities by name", _VALUES
    outputs = {topic: f"{what} of the network" for topic, what in own.items()}
    for output in settings.publish:
        entry = model.publish[output.output]
        topic = absolute(output.topic, node)
        other = outputs.setdefault(topic, f"the output '{output.output}'")
        if other != f"the output '{output.output}'":
            message = f"{topic} is the topic of {other}, too: who listens cannot tell the messages apart"
            findings.error("topic-conflict", entry.topic.span, message, "take another topic")
        elif "type" not in entry.unknown:
            types[topic] = output.type
    for heard in settings.subscribe:
        source, topic = model.subscribe[heard.input], absolute(heard.topic, node)
        if "type" not in source.unknown and types.setdefault(topic, heard.type) != heard.type:
            message = f"{topic} has messages of {types[topic]} elsewhere in this spec, here of {heard.type}"
            findings.error("topic-conflict", (source.type or source.topic).span, message, "a topic has one type")


def _above_zero(formula: Formula, what: str, constants: Constants) -> float | None:
    """The number that a formula gives; None where it is invalid, or not above 0, which is reported."""
    value = known(constants.scalar(formula), None)
    if value is not None and not value > 0:
        constants.findings.error("out-of-range", formula.span, f"{what} and above 0, this is {value:g}")
        return None
    return value


def _subscriptions(model: RosModel, around: Surroundings, constants: Constants) -> Iterator[Subscription]:
    """What arrives at inputs; what is invalid is reported and left out."""
    findings = constants.findings
    inputs = {entry.name: entry for entry in around.inputs}
    for name, entry in model.subscribe.items():
        found = inputs.get(name) or around.scope.input(name)
        if found is None:
            span = key_of(model.source, "subscribe", name).span
            hint = partial(known_inputs, name, tuple(inputs))
            message = f"there is no input '{shorten(name)}'"
            findings.error("unknown-input", span, message, hint, undeclared=around.scope.undeclared(name))
        timeout = (
            None
            if entry.timeout is None
            else _above_zero(entry.timeout, "'timeout' is seconds without a message", constants)
        )
        if entry.on_timeout is not None and entry.timeout is None and "timeout" not in entry.unknown:
            message = "'on_timeout' has no effect without 'timeout'"
            findings.warning("no-effect", entry.on_timeout.span, message, "add timeout: SECONDS")
        size = found.size if isinstance(found, Input) else None
        _check_numbers(entry, size, f"the input '{name}' takes", findings)
        _check_joints(entry, size, name, findings)
        if isinstance(found, Input):
            yield Subscription(
                input=name,
                topic=entry.topic.value,
                type=_type(entry, found.size),
                field=value_or(entry.field, _DATA),
                names=tuple(joint.value for joint in entry.names or ()),
                timeout=timeout,
                on_timeout=value_or(entry.on_timeout, "zero"),
            )


def _publications(model: RosModel, around: Surroundings, constants: Constants) -> Iterator[Publication]:
    """What is sent of outputs; what is invalid is reported and left out."""
    outputs = {output.name: output for output in around.outputs}
    for name, entry in model.publish.items():
        output = outputs.get(name)
        if output is None:
            _report_output(name, model, around.spec, constants.findings)
        safe = None if entry.safe is None else known(constants.scalar(entry.safe), None)
        size = None if output is None else output.size
        _check_numbers(entry, size, f"the output '{name}' has", constants.findings)
        if output is not None:
            yield Publication(name, entry.topic.value, _type(entry, output.size), value_or(entry.field, _DATA), safe)


def _type(entry: SubscribeModel | PublishModel, size: int) -> str:
    """The message type, for so many numbers."""
    if entry.type is not None:
        return plain(entry.type.value)
    return "std_msgs/Float64" if size == 1 else "std_msgs/Float64MultiArray"


def _report_output(name: str, model: RosModel, spec: Spec, findings: Findings) -> None:
    """Report a name that is no output, unless it is that of an invalid one."""
    declared = names_of(spec, "outputs", spec.outputs)
    if name in declared:
        return
    findings.error(
        "unknown-output",
        key_of(model.source, "publish", name).span,
        f"there is no output '{shorten(name)}'",
        lambda: suggest(name, declared, "outputs") or "no outputs are declared; add it under 'outputs'",
        undeclared=Undeclared(name, Home((), ("outputs",))),
    )


def _check_numbers(entry: SubscribeModel | PublishModel, size: int | None, who: str, findings: Findings) -> None:
    """Whether messages of the type have numbers at the field, and may have as many; ``size`` is how many ``who`` has,
    None where that is not known."""
    if not entry.unknown.isdisjoint(("type", "field")):
        return
    name = _type(entry, size or 1)
    fields = fields_of(name)
    if fields is None:
        if entry.type is not None and misspelt(name):
            hint = suggest(name, all_types(), "types")
            findings.error("unknown-message", entry.type.span, f"there is no message type '{shorten(name)}'", hint)
        return
    path = value_or(entry.field, _DATA)
    span = (entry.field or entry.type or entry.topic).span
    field = fields.get(path)
    if field is None:
        if not _within_unknown(path, fields):
            hint = _where(entry, path, name)
            findings.error("unknown-field", span, f"messages of type {name} have no field '{shorten(path)}'", hint)
    elif field.kind == "number":
        if size is not None and field.size is not None and field.size != size:
            holds = "one number" if not field.several else plural(field.size, "number")
            findings.error("wrong-size", span, f"'{path}' of {name} is {holds}; {who} {size}")
    elif field.kind != "opaque":
        what = (
            {"text": "a text", "message": "a message"}[field.kind] if not field.several else f"a list of {field.kind}s"
        )
        message = f"'{shorten(path)}' of {name} is {what}, neither a number nor an array of numbers"
        findings.error("unknown-field", span, message, _where(entry, path, name))


def _within_unknown(path: str, fields: Mapping[str, Field]) -> bool:
    """Whether a path leads into what ROS 1 and ROS 2 define differently."""
    parts = path.split(".")
    heads = (fields.get(".".join(parts[:count])) for count in range(1, len(parts)))
    return any(head is not None and head.kind == "opaque" for head in heads)


def _where(entry: SubscribeModel | PublishModel, path: str, name: str) -> str:
    """Which fields of a type there are."""
    known = numbers_of(name)
    if not known:
        return "take a type that holds numbers"
    inner = [one for one in known if one.startswith(f"{path}.")]
    hint = suggest(path, inner or known, "fields with numbers") or ""
    return f"say which with field: {', '.join(known[:8])}" if entry.field is None else hint


def _check_joints(entry: SubscribeModel, size: int | None, name: str, findings: Findings) -> None:
    """``names``: as many joints as the input has numbers, each once, of messages that name their joints."""
    if entry.names is None:
        return
    key = entry.source.entry("names")
    assert key is not None
    type_ = _type(entry, size or 1)
    fields = fields_of(type_)
    if fields is not None and "name" not in fields and "type" not in entry.unknown:
        message = f"'names' has no effect: messages of type {type_} name no joints"
        findings.error("useless-key", key.key.span, message, "sensor_msgs/JointState does")
        return
    seen = set[str]()
    for joint in entry.names:
        if joint.value in seen:
            findings.error("repeated-reference", joint.span, f"the joint '{shorten(joint.value)}' is named twice")
        seen.add(joint.value)
    if size is not None and len(entry.names) != size:
        message = f"{plural(len(entry.names), 'joint')}; the input '{name}' takes {plural(size, 'number')}"
        findings.error("wrong-size", key.value.span, message)
