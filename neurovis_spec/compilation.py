"""A compilation: what a spec has become, and what follows from that alone: its layouts, and the gains of its pictures.

In: the Network, and the spec and the texts that it was made of. Out: the same, with layouts and gains, each of which is
made when it is asked for, once. What runs, lays out and draws is imported then: a spec is compiled, and thereby
checked, without it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Self
from weakref import WeakKeyDictionary

from neurovis_spec.compiler.compile import Request
from neurovis_spec.compiler.drawing.drawing_settings import RenderSettings
from neurovis_spec.compiler.network import Network
from neurovis_spec.diagnostics import Diagnostic
from neurovis_spec.language.spec import Spec
from neurovis_spec.likeness import suggest
from neurovis_spec.progress import Progress

if TYPE_CHECKING:
    from neurovis_spec.layout import Layout, LayoutProblem
    from neurovis_spec.runtime.recording import Recording
    from neurovis_spec.scene.gains import Gains


@dataclass(frozen=True, eq=False)
class Compilation:
    """What a spec was compiled to. ``network`` holds its arrays, ``warnings`` what was noticed, ``sources`` the texts
    that these are about."""

    network: Network
    spec: Spec
    request: Request
    warnings: tuple[Diagnostic, ...]
    sources: Mapping[str, str]
    #: the earlier layout that the spec names (``layout.file``)
    memory: Layout | None = None
    #: the files that the spec names, of data, included, and of the layout, with what was found in them by looking
    files: Mapping[Path, str] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """The name that the spec gives it."""
        return self.network.name

    @property
    def hash(self) -> str:
        """SHA-256 of the canonical network."""
        return self.network.hash

    @property
    def layout_file(self) -> Path | None:
        """The file of the earlier layout that the spec names, which need not be there."""
        layout = self.spec.layout
        return None if layout is None or layout.file is None else self.request.base / layout.file.value

    @cached_property
    def problem(self) -> LayoutProblem:
        """What a layout engine is given."""
        from neurovis_spec.layout.problem import problem_of

        return problem_of(self.network, self.memory)

    def arranged(
        self,
        engine: str | None = None,
        effort: str | None = None,
        earlier: Layout | None = None,
        progress: Progress | None = None,
        size: tuple[int, int] | None = None,
    ) -> Layout:
        """A layout, made anew by this engine, or the spec's, for a page of this ``size``, or the spec's. What an
        ``earlier`` one knew stays where it was. Raises LayoutRefusalError, which knows where the spec asks for what an
        engine cannot do."""
        from neurovis_spec.layout.arrange import lay_out_problem
        from neurovis_spec.layout.model import LayoutRefusalError
        from neurovis_spec.layout.where import where

        try:
            problem = self._asked(effort, size)
            if earlier is not None:
                problem = replace(problem, memory=earlier)
            return lay_out_problem(problem, engine or self.network.layout.engine, progress)
        except LayoutRefusalError as refusal:
            span = where(refusal, self.spec, self.request, self.network, engine)
            if span is not None:
                refusal.locate(span, self.sources)
            raise

    def _asked(self, effort: str | None, size: tuple[int, int] | None) -> LayoutProblem:
        """The problem, with this effort and for a page of this size."""
        from neurovis_spec.layout.model import effort_of
        from neurovis_spec.layout.problem import aspect_of

        problem = replace(self.problem, effort=effort_of(effort or "normal"))
        return problem if size is None else replace(problem, aspect=aspect_of(size))

    @cached_property
    def _layouts(self) -> dict[tuple[str | None, str, tuple[int, int] | None], Layout]:
        return {}

    def placed(
        self, engine: str | None = None, effort: str | None = None, size: tuple[int, int] | None = None
    ) -> Layout:
        """The layout that pictures of this size, or the spec's, are drawn in, by this engine or the spec's; computed
        once, here or when the same was asked for before (``layout/kept.py``). Raises LayoutRefusalError."""
        key = engine, effort or "normal", size or self.network.render.size
        if key not in self._layouts:
            from neurovis_spec.layout.kept import kept

            make = partial(self.arranged, engine, effort, size=size)
            self._layouts[key] = kept(self._asked(effort, size), engine or self.network.layout.engine, make)
        return self._layouts[key]

    def of_size(self, size: tuple[int, int] | None) -> Self:
        """The same as though the spec asked for pictures of this size (``render: size``), or for none; the gains and
        the layouts that are known of it are known of both."""
        network = self.network
        made = replace(self, network=replace(network, render=replace(network.render, size=size)))
        shared = {"_layouts": self._layouts, "_recorded": self._recorded}
        made.__dict__.update({**shared, **({"gains": self.gains} if self.measured else {})})
        return made

    def settings_for(self, theme: str | None) -> RenderSettings:
        """How it is drawn, in a theme of this name. Raises RendererError for one that there is not."""
        from neurovis_spec.scene.renderers import RendererError
        from neurovis_spec.themes import THEMES

        if theme is not None and theme not in THEMES:
            raise RendererError(f"there is no theme '{theme}'", suggest(theme, THEMES, "there are"))
        return self.network.render if theme is None else replace(self.network.render, theme=theme, colours=())

    @cached_property
    def gains(self) -> Gains:
        """The gains of Eqs. 2–5 for this network: the author's, else from the range of its default run."""
        from neurovis_spec.scene.probe import probe

        return probe(self.network)

    @property
    def measured(self) -> bool:
        """Whether these are known, so that nothing has to be run for them."""
        return "gains" in self.__dict__

    def gains_by(self, made: Recording) -> Gains:
        """These gains, for which nothing is run where the default run is ``made``, as far as they need it."""
        if not self.measured:
            from neurovis_spec.scene.probe import probe

            self.__dict__["gains"] = probe(self.network, made)
        return self.gains

    def gains_for(self, recording: Recording | None) -> Gains:
        """The gains of pictures of a recording, from all of its steps; without one those of the network."""
        if recording is None:
            return self.gains
        if recording not in self._recorded:
            from neurovis_spec.runtime.fitting import fitted
            from neurovis_spec.scene.probe import gains_of

            self._recorded[recording] = gains_of(self.network, fitted(recording, self.network))
        return self._recorded[recording]

    @cached_property
    def _recorded(self) -> WeakKeyDictionary[Recording, Gains]:
        """The gains of the recordings that were drawn, while these are in use."""
        return WeakKeyDictionary()
