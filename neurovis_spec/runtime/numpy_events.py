"""Connections to which spikes have come, as NumPy code: those alone are read and changed.

In: a Step in the making, a projection in a phase of spikes. Out: code.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager

import numpy as np

from neurovis_spec.compiler.program import JOINING, Key, Projection
from neurovis_spec.runtime.events import rows_of
from neurovis_spec.runtime.numpy_arrivals import Step, Working, all_sent
from neurovis_spec.runtime.numpy_lags import behind_lags
from neurovis_spec.runtime.numpy_spikes import come_to
from neurovis_spec.runtime.stages import End, behind_flow, ends_of, target_of
from neurovis_spec.runtime.state import NEVER_LOST


@contextmanager
def come_to_some(step: Step, working: Working, sent: bool) -> Iterator[str]:
    """Lines about those connections of a projection to which a spike has come; the code of which these are, of those
    that do something. ``sent``: what is sent now is in the history."""
    code, projection = step.code, working.projection
    end = ends_of(step.network, projection)[projection.when]
    delays = step.network.connections.delays[projection.members] * int(end.past)
    rows = rows_of(np.asarray(end.places, dtype=np.int64), delays)
    code.namespace["come_to"] = come_to
    now = "" if delays.any() and (sent or delays.all()) else f", {all_sent(step)}"
    which = code.let("q", f"come_to({code.constant(rows)}, k, history{now})")
    if end.past and (lost := step.structure.lost[projection.members] + delays).max(initial=NEVER_LOST) > 0:
        code.line(f"{which} = {which}[k >= {code.constant(lost)}[{which}]]")
    code.line(f"if len({which}):")
    code.indent += 1
    yield which
    code.indent -= 1


def seen_by(step: Step, working: Working, which: str, read: Collection[str]) -> dict[str, str]:
    """What a definition sees of its parameters and of both ends of some connections of a projection, as code says
    which; as far as it is ``read``. What is of the weight comes from elsewhere."""
    code, (projection, some) = step.code, working
    use = projection.use
    seen = code.time(use.definition)
    for name, values in use.parameters.items():
        if name in read:
            seen[name] = code.numbers_of(Key(use.owner, name), values, some, which)
    is_synapse = projection.kind in JOINING
    behind = behind_flow(step.network, projection) if is_synapse else {}
    late = {} if is_synapse else behind_lags(step, projection)
    for name, end in ends_of(step.network, projection).items():
        if name in read and name in behind:
            seen[name] = _behind(step, projection, behind[name], which)
        elif name in read and name in late:
            seen[name] = code.let("a", f"{late[name]}[{which}]")
        elif name in read:
            seen[name] = code.let("a", _end(step, projection, end, which))
    return seen


def _behind(step: Step, projection: Projection, state: str, which: str) -> str:
    """A state of targets that flows, as it is behind the integration."""
    network, code = step.network, step.code
    target = network.populations[target_of(network, projection)]
    code.line(f"if fixed: hold_cells(fixed, {code.constant((target.model.owner,))}, cells)")
    at = np.searchsorted(target.members, network.connections.targets[projection.members]).astype(np.intp)
    return code.let("a", f"{code.state(target.model, state)}[{code.constant(at)}[{which}]]")


def _end(step: Step, projection: Projection, end: End, which: str) -> str:
    """What some connections read of an end."""
    code, delays = step.code, step.network.connections.delays[projection.members] * int(end.past)
    places = code.constant(np.ascontiguousarray(end.places, dtype=np.intp))
    now = f"{all_sent(step)}[{places}[{which}]]"
    if (end.places >= len(step.network.neurons) + step.network.outlet_count).any():
        now = f"np.concatenate((activity, outlets, s))[{places}[{which}]]"
    if not delays.any():
        return now
    ago, lost = code.constant(delays), step.structure.lost[projection.members]
    past = f"history[(k - {ago}[{which}]) % {step.depth}, {places}[{which}]]"
    if (lost > NEVER_LOST).any():
        past = f"np.where(k < {code.constant(lost + delays)}[{which}], 0.0, {past})"
    return past if delays.all() else f"np.where({ago}[{which}] > 0, {past}, {now})"
