"""A node of ROS 1 in C++ around the C of a network: the same topics as ``neurovis ros run``, without Python.

In: a Network, what templates insert. Out: the texts of its sources, and of how they are built.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from neurovis_spec.compiler.network import Network
from neurovis_spec.language.expressions.emit_c import INEXACT
from neurovis_spec.ros.definitions import Definition, definition
from neurovis_spec.ros.templates import render
from neurovis_spec.runtime.c_export import Exported
from neurovis_spec.runtime.c_package import tell_fixed


@dataclass(frozen=True, slots=True)
class _Source:
    """An input that comes from a topic; ``own`` is its name in C."""

    own: str
    input: str
    size: int
    topic: str
    private: bool
    type: str
    field: str
    names: tuple[str, ...]
    timeout: float
    when: str


@dataclass(frozen=True, slots=True)
class _Sink:
    """An output that goes to a topic; ``truth`` where the field holds 0 or 1."""

    own: str
    output: str
    size: int
    topic: str
    private: bool
    type: str
    field: str
    truth: bool
    safe: float | None


@dataclass(frozen=True, slots=True)
class _Setter:
    """A parameter that can be set; ``own`` is its name in C."""

    own: str
    name: str
    slot: int


def node_files(network: Network, values: dict[str, object]) -> dict[str, str]:
    """The sources. Raises ExportError where C cannot be made of the network."""
    made = Exported(_open(network))
    tell_fixed(made)
    values = values | _values(made)
    name = made.name
    return {
        f"{name}.h": made.header(),
        f"{name}.c": made.source(),
        f"{name}_node.cpp": render("cpp/node.cpp", values),
        "neurovis_node.hpp": render("cpp/neurovis_node.hpp", values),
        "CMakeLists.txt": render("cpp/CMakeLists.txt", values),
        "README.md": render("cpp/README.md", values),
    }


def _open(network: Network) -> Network:
    """The network, in which the inputs that come from topics have no source of their own."""
    heard = {one.input for one in network.ros.subscribe}
    inputs = tuple(
        replace(one, expression=None, table=None, slots={}, parts=()) if one.name in heard else one
        for one in network.inputs
    )
    return replace(network, inputs=inputs)


def _values(made: Exported) -> dict[str, object]:
    network = made.network
    inputs = {one.name: (one, own) for one, own in zip(made.inputs, made.input_names, strict=True)}
    outputs = {one.name: (one, own) for one, own in zip(network.outputs, made.output_names, strict=True)}
    sources, sinks = list[_Source](), list[_Sink]()
    for heard in network.ros.subscribe:
        entry, own = inputs[heard.input]
        timeout = -1.0 if heard.timeout is None else heard.timeout
        topic, private = _topic(heard.topic)
        sources.append(
            _Source(own, heard.input, entry.size, topic, private, heard.type, heard.field, heard.names, timeout,
                    heard.on_timeout)
        )  # fmt: skip
    for said in network.ros.publish:
        output, own = outputs[said.output]
        topic, private = _topic(said.topic)
        truth = _is_truth(said.type, said.field)
        sinks.append(_Sink(own, said.output, output.size, topic, private, said.type, said.field, truth, said.safe))
    slots = network.settable.index
    return {
        "sources": sources,
        "sinks": sinks,
        "setters": [
            _Setter(own, name, slots[name]) for name, own in zip(made.settable, made.settable_names, strict=True)
        ],
        "changing": network.changing.tolist(),
        "headers": sorted({f"{type_}.h" for type_ in (*(one.type for one in sources), *(one.type for one in sinks))}),
        "exact": [f"-fno-builtin-{function}" for function in INEXACT],
    }


def _topic(topic: str) -> tuple[str, bool]:
    """A topic's name, whole or seen from the node's namespace; or that behind the node's name."""
    return (topic[1:].lstrip("/"), True) if topic.startswith("~") else (topic, False)


def _is_truth(type_: str, path: str) -> bool:
    text = definition(type_, 1)
    field = None if text is None else Definition.parse(type_, text).field(path)
    return field is not None and field.type == "bool"
