"""A recording that knows its network, so that it plays where a notebook shows it.

In: a Recording and the compiled network that made it. Out: the same Recording; where anywidget is installed, a notebook
shows it with play and scrubber, elsewhere as its traces.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from functools import cached_property
from importlib.util import find_spec
from typing import TYPE_CHECKING

from neurovis_spec.runtime.recording import Recording

if TYPE_CHECKING:
    from neurovis_spec.compilation import Compilation
    from neurovis_spec.notebook.widget import LiveWidget


@dataclass(frozen=True, eq=False, repr=False)
class PlayedRecording(Recording):
    """A recording, and the network that made it. What is copied or pickled of it is the recording."""

    compiled: Compilation = field(kw_only=True)

    def __reduce__(self) -> tuple[type[Recording], tuple[object, ...]]:
        return Recording, tuple(getattr(self, entry.name) for entry in fields(Recording))

    @cached_property
    def _widget(self) -> LiveWidget | None:
        """What plays it; None where it cannot be played: a partial one, an empty one, a network that is not drawn."""
        from neurovis_spec.layout.model import LayoutRefusalError
        from neurovis_spec.live.show import Show
        from neurovis_spec.notebook.widget import LiveWidget

        try:
            return LiveWidget(self.compiled, Show(self), play=False)
        except (ValueError, LayoutRefusalError):
            return None

    def _repr_mimebundle_(self, **_: object) -> tuple[dict[str, object], dict[str, object]] | None:
        """The page with play and scrubber, for a notebook that shows widgets; its traces stand beside it for others."""
        found = None
        if find_spec("anywidget") is not None and self._widget is not None:
            found = self._widget._repr_mimebundle_()
        return None if found is None else ({**found[0], "text/plain": repr(self)}, found[1])


def played(recording: Recording, compiled: Compilation) -> PlayedRecording:
    """A recording with the network that made it."""
    values = {entry.name: getattr(recording, entry.name) for entry in fields(Recording)}
    return PlayedRecording(**values, compiled=compiled)
