"""The ``figure`` of the section ``render``: which views a picture is made of, their references resolved.

In: the section as written, the Population, the connections, inputs and outputs. Out: Panels, or findings with the
nearest known names.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from neurovis_spec.compiler.connections.connect import Connected
from neurovis_spec.compiler.drawing.drawing_settings import Curve, Panel
from neurovis_spec.compiler.names.connection_references import Finder, wires_of
from neurovis_spec.compiler.names.outputs import StateReader, state_reader
from neurovis_spec.compiler.names.references import Directory, parts, resolve, resolve_part
from neurovis_spec.compiler.names.state_references import StateName, StateOf
from neurovis_spec.compiler.network import Output
from neurovis_spec.compiler.neurons.populate import Population
from neurovis_spec.diagnostics import Findings, Span, shorten
from neurovis_spec.language.drawing import PanelModel
from neurovis_spec.language.located import Located
from neurovis_spec.language.spec import Spec
from neurovis_spec.language.yaml.source import Scalar


def figure_of(
    spec: Spec,
    population: Population,
    made: Connected,
    outputs: tuple[Output, ...],
    findings: Findings,
) -> tuple[Panel, ...]:
    """The views in the order written; those that are invalid are left out, and reported."""
    models = () if spec.render is None else spec.render.figure
    finder = Finder(wires_of(made), population.directory, findings)
    states = state_reader(population, made, findings)
    reader = _Reader(population, {output.name: output for output in outputs}, frozenset(spec.outputs), finder, states)
    panels = [reader.panel(model) for model in models]
    return tuple(panel for panel in panels if panel is not None)


@dataclass(frozen=True)
class _Reader:
    population: Population
    outputs: dict[str, Output]
    #: the names of all outputs, also of those that are invalid
    declared: frozenset[str]
    finder: Finder
    states: StateReader

    @property
    def directory(self) -> Directory:
        """Who is called what."""
        return self.population.directory

    def panel(self, model: PanelModel) -> Panel | None:
        """A view with what it shows; None where something of it is invalid."""
        if model.shown is None:
            return Panel(model.view.value)
        findings = self.finder.findings
        if not model.shown.parts:
            if not model.shown.failed:
                message = f"the view '{model.view.value}' names nothing to show"
                findings.error("empty-reference", model.shown.span, message, "leave the list out for what it chooses")
            return None
        before = findings.errors
        curves = [curve for text in model.shown.parts for curve in self._curves(model.view.value, text)]
        return None if findings.errors > before else Panel(model.view.value, tuple(dict.fromkeys(curves)))

    def _curves(self, view: str, text: Located[str]) -> Iterator[Curve]:
        """What a reference names, where the view can show it."""
        wired = view in ("weights", "matrix")
        name = self.states.name(text.value.strip())
        if "->" in text.value and (name is None or not name.of_rule):
            if view == "raster":
                self._refuse(text.value, text.span, "a raster shows neurons", "show it as weights")
                return
            found = self.finder.connections(text)
            yield from (Curve("connection", index) for index in ([] if found is None else found.tolist()))
            return
        for part, span in parts(text):
            if wired:
                self._refuse(part, span, f"the view '{view}' shows connections", "write FROM -> TO")
                continue
            yield from self._part(view, part, span)

    def _part(self, view: str, part: str, span: Span) -> Iterator[Curve]:
        output = self.outputs.get(part)
        known = self.directory.find(part) is not None
        if not known and output is None and part in self.declared:
            return
        name = None if known else self.states.name(part)
        if not known and output is not None and output.states:
            states: tuple[StateOf, ...] = output.states
        elif name is not None and not (output is not None or self._fed(part)):
            states = self._states(name, span)
        else:
            yield from (Curve("neuron", index) for index in self._neurons(part, span, output))
            return
        if view == "raster":
            self._refuse(part, span, "a raster shows neurons", "show it as traces")
            return
        for one in states:
            yield from (Curve("neuron", index, one.state) for index in one.neurons.tolist())
            yield from (Curve("connection", index, one.state) for index in one.connections.tolist())

    def _states(self, name: StateName, span: Span) -> tuple[StateOf, ...]:
        one = self.states.find(name, span)
        return () if one is None else (one,)

    def _neurons(self, part: str, span: Span, output: Output | None) -> tuple[int, ...]:
        """Those of a reference, of an output, of an instance, or those that take in an input."""
        directory, findings = self.directory, self.finder.findings
        if directory.find(part) is None:
            if output is not None:
                return tuple(output.neurons.tolist())
            if directory.instance(part):
                found = resolve((Located(part, Scalar(part, span)),), directory, findings, instances=True)
                return found or ()
            if self._fed(part):
                groups = self.population.neurons.groups
                return tuple(index for group in groups if group.input == part for index in group.indices)
        return resolve_part(part, span, directory, findings) or ()

    def _fed(self, name: str) -> bool:
        """Whether it is an input that neurons take in."""
        return any(group.input == name for group in self.population.neurons.groups)

    def _refuse(self, name: str, span: Span, what: str, hint: str) -> None:
        message = f"{what}, and '{shorten(name)}' is none"
        self.finder.findings.error("bad-view", span, message, hint)
