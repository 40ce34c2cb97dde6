"""The body of a document: the sensors and actuators that may be named in it.

In: a Document. Out: Ports, found as the compiler finds them; none where the body cannot be opened as the text stands.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from neurovis_spec import plugins
from neurovis_spec.body.model import Port
from neurovis_spec.compiler.body import Clock, Place, find_body
from neurovis_spec.compiler.limits import plural
from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.located import Located
from neurovis_spec.lsp.document import Document


def ports_of(document: Document, use: Literal["sensor", "actuator"]) -> Sequence[Port]:
    """The sensors, or the actuators, of the body that a document names."""
    values = document.index.values
    for kind in plugins.names(plugins.BODIES):
        given = values.get(("body", kind))
        if given is not None and given.text:
            dt = values.get(("time", "dt"))
            seconds = None if dt is None else dt.scalar.value
            clock = Clock(float(seconds) if isinstance(seconds, (int, float)) and seconds > 0 else 1.0)
            place = Place(document.path.parent, document.root)
            _, body = find_body(kind, Located(given.text, given.scalar), place, clock, Findings())
            return () if body is None else body.sensors if use == "sensor" else body.actuators
    return ()


def described(port: Port) -> str:
    """How many numbers a port is, of what, and from where to where."""
    size = plural(port.size, "number")
    unit = f", {port.unit}" if port.unit else ""
    limited = port.low > float("-inf") and port.high < float("inf")
    return size + unit + (f", {port.low:g} … {port.high:g}" if limited else "")
