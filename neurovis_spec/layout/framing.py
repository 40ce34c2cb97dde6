"""Whether the engine that a spec names draws instances as frames.

In: the engine as the author wrote it, the network. Out: a warning among the findings where there are instances and the
engine leaves their neurons to themselves: they are then drawn as anybody's, each instance in another way.
"""

from __future__ import annotations

from typing import Final

from neurovis_spec import plugins
from neurovis_spec.compiler.network import Network
from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.located import Located
from neurovis_spec.layout.model import LayoutEngine

#: These draw frames, and are not loaded in order to be asked.
_WITH_FRAMES: Final = ("layered", "circular", "grid")


def check_engine(engine: Located[str], network: Network, findings: Findings) -> None:
    """Report a warning (``engine-without-frames``) where instances will not be drawn alike. An engine that draws what
    is pinned alone (``manual``) has no choice, and one that cannot be loaded is told of when it is called."""
    name = engine.value
    if not network.instances or name == "auto" or name in _WITH_FRAMES:
        return
    try:
        made = plugins.load(plugins.LAYOUTS, name)
    except (KeyError, plugins.PluginError):
        return
    if isinstance(made, LayoutEngine) and made.capabilities.free and not made.capabilities.modules:
        message = f"the engine '{name}' draws no frames: instances of a module are not drawn alike"
        findings.warning("engine-without-frames", engine.span, message, "use layered, circular or grid")
