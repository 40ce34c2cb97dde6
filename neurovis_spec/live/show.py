"""Show: what a live view shows of a compiled network, and how.

In: a recording or how a run begins, a theme, an engine, a backend. Out: of a compiled network its source and view.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

from neurovis_spec.compilation import Compilation
from neurovis_spec.layout.model import Layout
from neurovis_spec.live.carry import carried
from neurovis_spec.live.commands import AS_IT_IS, Appearance
from neurovis_spec.live.recorded import RecordedSource
from neurovis_spec.live.run import Change, Stage
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.live.source import Source
from neurovis_spec.live.view import View, view_of
from neurovis_spec.runtime.simulation import Simulation

if TYPE_CHECKING:
    from neurovis_spec.compiler.network import Network
    from neurovis_spec.runtime.recording import Recording


@dataclass(frozen=True)
class Beginning:
    """How a run begins: anew, or after a recording, of which nothing may be taken but the weights that learn."""

    start: Recording | None = None
    weights_alone: bool = False

    def simulation(self, network: Network, backend: str | None) -> Simulation:
        """The run. Raises RecordingError, BackendError."""
        return Simulation(network, backend, self.start, weights_alone=self.weights_alone)


@dataclass(frozen=True)
class Show:
    """What is shown, and how: a run with its ``begin``, or a ``recording``."""

    recording: Recording | None = None
    begin: Beginning = Beginning()
    theme: str | None = None
    engine: str | None = None
    backend: str | None = None

    def stage(self, compiled: Compilation) -> Stage:
        """The source and its view. Raises RecordingError, BackendError, LayoutRefusalError."""
        return self._source(compiled), self.view(compiled)

    def changed(self, compiled: Compilation, appearance: Appearance = AS_IT_IS, layout: Layout | None = None) -> Change:
        """What shows an edited network, in this layout, at the step that is shown. Raises as ``stage`` does."""
        view = self.view(compiled, appearance, layout)
        if self.recording is not None:
            recorded = RecordedSource(compiled.network, self.recording)

            def same_row(old: Source) -> Stage:
                recorded.go(old.step)
                return recorded, view

            return same_row
        simulation = self.begin.simulation(compiled.network, self.backend)

        def same_step(old: Source) -> Stage:
            assert isinstance(old, SimulatedSource)
            return carried(old, simulation), view

        return same_step

    def retitled(self, compiled: Compilation, before: View) -> Change:
        """What shows a network of which nothing but the title was edited: the run goes on as it is."""
        view = self.view(compiled, before.appearance, before.layout, before)

        def same_run(old: Source) -> Stage:
            return old, view

        return same_run

    def _source(self, compiled: Compilation) -> Source:
        if self.recording is not None:
            return RecordedSource(compiled.network, self.recording)
        return SimulatedSource(self.begin.simulation(compiled.network, self.backend))

    def view(
        self,
        compiled: Compilation,
        appearance: Appearance = AS_IT_IS,
        layout: Layout | None = None,
        before: View | None = None,
    ) -> View:
        """How a network is drawn, by default in its own layout; ``before`` is how it was with another title. Raises
        LayoutRefusalError."""
        shown = compiled
        if appearance.pathways:
            network = compiled.network
            shown = replace(compiled, network=replace(network, render=replace(network.render, pathways=True)))
        gains, otherwise = shown.gains_for(self.recording), partial(self.view, compiled, layout=layout)
        return view_of(compiled, gains, self.theme, self.engine, appearance, layout, otherwise, before)
