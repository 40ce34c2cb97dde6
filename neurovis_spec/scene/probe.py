"""The probe: a run whose only purpose is to see how far the values of a network go.

In: a network. Out: Gains. The run is the network's own: its inputs, its default length as far as ``BUDGET`` allows, by
array code, for which nothing is compiled.
Where a recording is drawn, its gains are those of all its steps: inputs without a source have values in it alone.
"""

from __future__ import annotations

import warnings
from collections.abc import Collection
from dataclasses import replace

import numpy as np

from neurovis_spec.arguments import CodedWarning, callers_level
from neurovis_spec.body import BodyMissingError
from neurovis_spec.compiler.drawing.drawing_settings import StatedGain
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.stiffness import stiffest_at_begin
from neurovis_spec.runtime.course import Course
from neurovis_spec.runtime.record import record
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.runtime.stiffness import stiffest_of_run
from neurovis_spec.scene.collapse import gathered
from neurovis_spec.scene.gains import Gains, choose_gains
from neurovis_spec.scene.reached import nothing

#: Most numbers that a probe records: 32 MB of activities and weights.
BUDGET = 4_000_000


def probe_steps(network: Network) -> int:
    """How many steps the gains of a network take: none where its spec states all of them."""
    settings, connections = network.render, len(network.connections)
    sorts = (
        (settings.activity, len(network.neurons)),
        (settings.signal, connections),
        (settings.thickness, connections),
        (settings.change, connections),
    )
    if all(_is_for_all(stated, count) for stated, count in sorts):
        return 0
    width = len(network.neurons) + len(network.changing) + 1
    return max(1, min(network.steps, BUDGET // width))


def _is_for_all(stated: Collection[StatedGain], count: int) -> bool:
    """Whether gains are stated for each of ``count`` neurons or connections, at once or by references."""
    if any(one.members is None for one in stated):
        return True
    return len({member for one in stated for member in one.members or ()}) == count


def probe(network: Network, made: Recording | None = None) -> Gains:
    """The gains of a network: what its spec states, else from the peaks of its default run. Where this is ``made``, as
    far as they need it or further, it is not run again."""
    steps, drawn = probe_steps(network), gathered(network, network.render.collapse, network.render.pathways)
    if not steps:
        return choose_gains(drawn.network, drawn.network.render, nothing(drawn.network))
    if made is None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # the run that the author asks for warns
            course = Course(steps, backend="numpy")
            try:
                made = record(network, course)
            except BodyMissingError:  # its pictures can be drawn all the same
                made = record(replace(network, body=None), course)
    _warn_of_stiffness(network, made.part(slice(steps)))
    return choose_gains(drawn.network, drawn.network.render, drawn.reached(made.part(slice(steps))))


def _warn_of_stiffness(network: Network, made: Recording) -> None:
    """Warn of a step that is too long for what is integrated, later than as a run begins. One that is no longer finite
    for that warns itself."""
    if network.integration is None or not np.isfinite(made.activity).all() or stiffest_at_begin(network) is not None:
        return
    worst = stiffest_of_run(network, len(made))
    if worst is not None:
        message, hint = worst.words(network)
        warnings.warn(CodedWarning("stiff-step", f"{message}: {hint}"), stacklevel=callers_level())


def gains_of(network: Network, recording: Recording) -> Gains:
    """The gains for a recording: what the spec states, else from all of its steps, so that each looks the same. Raises
    RecordingError for a partial one."""
    drawn = gathered(network, network.render.collapse, network.render.pathways)
    reached = drawn.reached(recording)
    return choose_gains(
        drawn.network, drawn.network.render, reached if probe_steps(network) else nothing(drawn.network)
    )
