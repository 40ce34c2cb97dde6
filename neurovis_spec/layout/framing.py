"""Whether the engine that a spec names draws instances as frames.

In: the engine as the author wrote it, the network. Out: a warning among the findings where there are instances and the
engine leaves their neurons to themselves: they are then drawn as anybody's, each instance in another way.
"""

from __future__ import annotations

from neurovis_spec.compiler.network import Network
from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.located import Located
from neurovis_spec.layout.engines import engine_of, engines_that, they_can
from neurovis_spec.layout.model import LayoutRefusalError
from neurovis_spec.plugins import PluginError


def check_engine(engine: Located[str], network: Network, findings: Findings) -> None:
    """Report a warning (``engine-without-frames``) where instances will not be drawn alike. An engine that draws what
    is pinned alone has no choice, and one that cannot be loaded is told of when it is called."""
    name = engine.value
    if not network.instances or name == "auto":
        return
    try:
        can = engine_of(name).capabilities
    except (LayoutRefusalError, PluginError):
        return
    if can.free and not can.modules:
        message = f"the engine '{name}' draws no frames: instances of a module are not drawn alike"
        hint = they_can(engines_that(lambda other: other.modules))
        findings.warning("engine-without-frames", engine.span, message, hint)
