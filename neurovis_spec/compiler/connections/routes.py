"""Routes: what the connections of an entry take at their sources, and to which ports of their targets they bring it.

In: ``send`` and ``port`` of an entry, the neurons of its ends. Out: a Route, or UNKNOWN with findings; the delays of
connections that name none, which depend on it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from neurovis_spec.arrays import Indices
from neurovis_spec.compiler.flows import sent_by
from neurovis_spec.compiler.names.state_references import no_port
from neurovis_spec.compiler.network import PLAIN_ROUTE, Route
from neurovis_spec.compiler.neurons.groups import Built, is_written
from neurovis_spec.compiler.neurons.populate import Census, Models
from neurovis_spec.compiler.program import MODEL, Definition
from neurovis_spec.compiler.values.constants import Constants
from neurovis_spec.diagnostics import Findings, Home, Undeclared, shorten
from neurovis_spec.language.located import Formula, Located
from neurovis_spec.language.sections import ConnectionModel
from neurovis_spec.language.unknown import UNKNOWN, Unknown
from neurovis_spec.language.values import AtPort
from neurovis_spec.likeness import suggest


def route_of(
    body: ConnectionModel, sources: Indices | Unknown, targets: Indices | Unknown, census: Census, constants: Constants
) -> Route | Unknown:
    """The route of an entry; UNKNOWN where what it says of that is invalid."""
    if body.port is None and body.send is None:
        return PLAIN_ROUTE if body.unknown.isdisjoint(("port", "send")) else UNKNOWN
    findings = constants.findings
    before = findings.errors
    ports = PLAIN_ROUTE.ports
    if body.port is not None:
        ports = tuple(_ports(body.port, () if targets is UNKNOWN else _known(census.groups_of(targets)), constants))
    from_ = [] if sources is UNKNOWN else _known(census.groups_of(sources))
    sends = "" if body.send is None else _sends(body.send, from_, findings)
    return UNKNOWN if findings.errors > before else Route(sends, ports)


def _known(groups: Sequence[Built]) -> list[Built]:
    """The groups whose model is in order."""
    return [one for one in groups if is_written(one.kind, one.model)]


def _ports(
    written: Sequence[AtPort[Formula | None]], groups: Sequence[Built], constants: Constants
) -> Iterator[tuple[str, float]]:
    """The ports with their factors, on which the structure depends."""
    for factor, port in written:
        assert port is not None
        found = (no_port(port.value, one.name, one.kind.model.definition) for one in groups)
        if (refusal := next(filter(None, found), None)) is not None:
            refusal.report("unknown-port", port.span, constants.findings)
        value = 1.0 if factor is None else constants.scalar(factor, structural=True)
        yield port.value, math.nan if value is UNKNOWN else value


def _sends(name: Located[str], groups: Sequence[Built], findings: Findings) -> str:
    """What is taken; "" where it is what all of these send by themselves."""
    for one in groups:
        model = one.kind.model.definition
        having = (MODEL.gives, *(quantity.name for quantity in model.named))
        if name.value not in having:
            message = f"the model '{model.name}' of '{one.name}' has no state and no output '{shorten(name.value)}'"
            lost = Undeclared(name.value, Home((MODEL.section, model.name), ("state", "outputs")))
            hint = partial(suggest, name.value, having, "it can send")
            findings.error("unknown-state", name.span, message, hint, undeclared=lost)
            return ""
    own = all(sent_by(one.kind.model.definition, "") == name.value for one in groups)
    return "" if own else name.value


def default_delays(
    sources: Indices, targets: Indices, route: Route, models: Models, synapse: Definition | None = None
) -> int | Indices:
    """The delays of connections that name none: one for all, or one for each."""
    if not models.flow and synapse is None:
        return 1
    starts, ends = models.of[sources], models.of[targets]
    table = np.ones((len(models.different), len(models.different)), dtype=np.int64)
    for start in np.unique(starts).tolist():
        for end in np.unique(ends).tolist():
            table[start, end] = models.delay(start, end, route, synapse)
    found = table[starts, ends]
    return int(found[0]) if len(found) and (found == found[0]).all() else found
