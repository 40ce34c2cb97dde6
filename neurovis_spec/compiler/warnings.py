"""Warnings: what is legal but surely not meant.

In: the Spec of a network without errors, and the network. Out: warnings among the findings. Better none than a false
one: what may be meant (a rate that is a parameter and can be set in a run, a bias of 0 that is written down) is let be.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

import numpy as np

from neurovis_spec.compiler.connect import Bundle
from neurovis_spec.compiler.idle import idle_neurons
from neurovis_spec.compiler.inert import changes_nothing
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.populate import key_span
from neurovis_spec.diagnostics import Findings, Span
from neurovis_spec.language.source import Mapping, Node, Packed, Scalar, Sequence
from neurovis_spec.language.spec import ConnectionModel, Spec

_WORD: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_DEFINITIONS: Final = ("activations", "models", "rules")
#: keys whose values are texts for people, or words of the language, never expressions
_NO_EXPRESSIONS: Final = frozenset(
    ("title", "description", "authors", "license", "references", "name", "label", "box", "role", "combine", "rows")
)


def warn(spec: Spec, network: Network, bundles: tuple[Bundle, ...], findings: Findings) -> None:
    """Note everything that is surely not meant in a spec that compiled."""
    _inputs(spec, network, findings)
    _parameters(spec, findings)
    _definitions(spec, network, findings)
    _neurons(spec, network, findings)
    _rates(spec, bundles, findings)


def _inputs(spec: Spec, network: Network, findings: Findings) -> None:
    """Inputs that neither a group nor a rule reads."""
    n = len(network.neurons)
    read = set(network.neurons.input.tolist())
    for plasticity in network.plasticity:
        for signal in plasticity.signals.values():
            read.update((np.unique(signal) - n).tolist())
    for entry in network.inputs:
        if entry.name in spec.inputs and read.isdisjoint(range(entry.start, entry.start + entry.size)):
            message = f"nothing reads the input '{entry.name}'"
            findings.warning("unused-input", key_span(spec, "inputs", entry.name), message, _READ.format(entry.name))


_READ: Final = "give it to a group, as in {{input: {0}}}, or to a rule as a signal, or remove it"


def _parameters(spec: Spec, findings: Findings) -> None:
    """Parameters that no expression names."""
    used: set[str] = set()
    for entry in spec.source.entries:
        # a definition sees its own parameters only
        if entry.name not in _NO_EXPRESSIONS.union(_DEFINITIONS):
            for text in _texts(entry.value, _NO_EXPRESSIONS):
                used.update(_WORD.findall(text))
    for name in spec.parameters:
        if name not in used:
            message = f"no expression uses the parameter '{name}'"
            findings.warning("unused-parameter", key_span(spec, "parameters", name), message, "remove it, or use it")


def _definitions(spec: Spec, network: Network, findings: Findings) -> None:
    """Activations, models and rules of the spec's own that nothing names."""
    used = {name for group in network.neurons.groups for name in (group.activation, group.model)}
    used |= {plasticity.rule.name for plasticity in network.plasticity}
    for entry in spec.source.entries:
        if entry.name not in _DEFINITIONS:
            used.update(_texts(entry.value, frozenset(), keys=True))
    for section in _DEFINITIONS:
        node = spec.source.get(section)
        for entry in node.entries if isinstance(node, Mapping) else ():
            if entry.name not in used:
                message = f"nobody uses the {section.removesuffix('s')} '{entry.name}'"
                findings.warning("unused-definition", entry.key.span, message, "remove it, or use it")


def _neurons(spec: Spec, network: Network, findings: Findings) -> None:
    """Neurons that stay at 0 for ever while something depends on them; a finding for each group."""
    events = spec.source.get("events")
    if events is not None and any(text == "clamp" for text in _texts(events, frozenset(), keys=True)):
        return  # what is clamped is active from outside
    for group, members in idle_neurons(network):
        model = spec.neurons.get(group.name)
        if model is None or model.bias is not None or model.initial is not None:
            continue
        names = [network.neurons.names[member] for member in members]
        shown = f"'{group.name}'" if len(names) == group.count else ", ".join(f"'{name}'" for name in names[:5])
        if len(names) > 5 and len(names) < group.count:
            shown += " and others"
        message = f"nothing reaches {shown}, and there is no input, bias, initial or noise: the activity stays 0"
        hint = "connect something to it, or give it an input, a bias, an initial or a noise"
        findings.warning("idle-neuron", key_span(spec, "neurons", group.name), message, hint)


def _rates(spec: Spec, bundles: tuple[Bundle, ...], findings: Findings) -> None:
    """Rules whose rate is 0, and which therefore change no weight. A rate that names a parameter can be set later."""
    bodies = {key.span: body for key, body in spec.connections}
    for bundle in bundles:
        body, learning = bodies.get(bundle.key), bundle.learning
        if body is None or learning is None or "rate" not in learning.parameters:
            continue
        if learning.parameters["rate"].any() or not changes_nothing(learning.rule, learning.parameters):
            continue
        span, constant = _rate(body)
        if constant:
            message = f"the rate of '{learning.rule.name}' is 0: no weight will change"
            findings.warning("zero-rate", span, message, "give it a rate, or leave the plasticity out")


def _rate(body: ConnectionModel) -> tuple[Span, bool]:
    """Where the rate of a rule is said, and whether it is a number for good."""
    assert body.plasticity is not None
    for entry in body.plasticity.settings:
        if entry.name == "rate":
            constant = isinstance(entry.value, Scalar) and not isinstance(entry.value.value, str)
            return entry.value.span, constant
    return body.plasticity.name.span, True


def _texts(node: Node, without: frozenset[str], keys: bool = False) -> Iterator[str]:
    """Every text of a node; ``without`` are keys whose values are left out, ``keys`` adds the keys themselves."""
    waiting = [node]
    while waiting:
        node = waiting.pop()
        match node:
            case Scalar(value=str() as text):
                yield text
            case Mapping(entries=entries):
                if keys:
                    yield from (entry.name for entry in entries)
                waiting += [entry.value for entry in entries if entry.name not in without]
            case Packed(texts=texts):
                yield from texts
            case Sequence(items=items):
                waiting += items
