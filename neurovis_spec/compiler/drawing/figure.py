"""The ``figure`` of the section ``render``: which views a picture is made of, their references resolved.

In: the section as written, the Census, the outputs, who finds what references name. Out: Panels, or findings with
the nearest known names.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from neurovis_spec.compiler.drawing.drawing_settings import Curve, Panel
from neurovis_spec.compiler.names.finder import Finder
from neurovis_spec.compiler.names.given import given_of
from neurovis_spec.compiler.names.references import Directory, resolve_part
from neurovis_spec.compiler.names.state_references import Refusal, StateOf
from neurovis_spec.compiler.network import Input, Output
from neurovis_spec.compiler.neurons.populate import Census
from neurovis_spec.diagnostics import Span, shorten
from neurovis_spec.language.drawing import PanelModel
from neurovis_spec.language.located import Located
from neurovis_spec.language.references import Part, Sum, parse
from neurovis_spec.language.spec import Spec
from neurovis_spec.language.unknown import UNKNOWN, Unknown, known
from neurovis_spec.language.words import PICTURES


def figure_of(
    spec: Spec,
    census: Census,
    inputs: tuple[Input, ...],
    outputs: tuple[Output, ...],
    finder: Finder,
) -> tuple[Panel, ...]:
    """The views in the order written; those that are invalid are left out, and reported."""
    models = () if spec.render is None else spec.render.figure
    known = {entry.name: entry for entry in inputs}
    named = {output.name: output for output in outputs}
    reader = _Reader(census, known, named, frozenset(spec.outputs), finder)
    panels = [reader.panel(model) for model in models]
    pictures = {model.view.value: model.view.span for model in models if model.view.value in PICTURES}
    if len(pictures) > 1:
        span, names = list(pictures.values())[1], " or ".join(f"'{name}'" for name in pictures)
        finder.findings.error("bad-view", span, "a page has the network once", f"take {names}")
    return tuple(panel for panel in panels if panel is not UNKNOWN)


@dataclass(frozen=True)
class _Reader:
    census: Census
    inputs: dict[str, Input]
    outputs: dict[str, Output]
    #: the names of all outputs, also of those that are invalid
    declared: frozenset[str]
    finder: Finder

    @property
    def directory(self) -> Directory:
        """The names of groups and neurons."""
        return self.census.directory

    def panel(self, model: PanelModel) -> Panel | Unknown:
        """A view with what it shows; UNKNOWN where something of it is invalid."""
        if model.shown is None:
            return Panel(model.view.value)
        findings = self.finder.findings
        before = findings.errors
        curves = [curve for text in model.shown.parts for curve in self._curves(model.view.value, text)]
        return UNKNOWN if findings.errors > before else Panel(model.view.value, tuple(dict.fromkeys(curves)))

    def _curves(self, view: str, text: Located[str]) -> Iterator[Curve]:
        """What a reference names, where the view can show it."""
        found = parse(text.value)
        if not isinstance(found, Sum):
            if view == "raster":
                self._refuse(text.value, text.span, "a raster shows neurons", "show it as weights")
                return
            connections = self.finder.connections(text)
            indices = [] if connections is UNKNOWN else connections.tolist()
            yield from (Curve("connection", index) for index in indices)
            return
        for part in found.parts:
            if view in ("weights", "matrix"):
                span = text.node.at(part.start, part.end)
                self._refuse(part.text, span, f"the view '{view}' shows connections", "write FROM -> TO")
                continue
            yield from self._curves_of_part(view, part, text)

    def _curves_of_part(self, view: str, part: Part, text: Located[str]) -> Iterator[Curve]:
        """The curves of a part of a reference: a state, neurons, or an output of either; what a view cannot show is
        reported."""
        name = part.text
        given = given_of(name, self.inputs)
        if isinstance(given, Refusal):
            given.report("unknown-input", text.node.at(part.start, part.end), self.finder.findings)
            return
        if given is not None and view == "raster":
            self._refuse(name, text.node.at(part.start, part.end), "a raster shows neurons", "show it as traces")
            return
        if given is not None:
            yield from (Curve("input", place) for place in given)
            return
        output = self.outputs.get(name)
        known = self.directory.holds(name)
        if not known and output is None and name in self.declared:
            return
        state = None if known else self.finder.directory.name_of_state(part)
        if not known and output is not None and output.states:
            states: tuple[StateOf, ...] = output.states
        elif state is not None and not (output is not None or self._fed(name)):
            one = self.finder.state(state, part, text)
            states = () if one is UNKNOWN else (one,)
        else:
            yield from (Curve("neuron", index) for index in self._neurons(part, text, output))
            return
        if view == "raster":
            self._refuse(name, text.node.at(part.start, part.end), "a raster shows neurons", "show it as traces")
            return
        for one in states:
            yield from (Curve("neuron", index, one.state) for index in one.neurons.tolist())
            yield from (Curve("connection", index, one.state) for index in one.connections.tolist())

    def _neurons(self, part: Part, text: Located[str], output: Output | None) -> tuple[int, ...]:
        """Those of a reference, of an output, of an instance, or those that take in an input."""
        directory, name = self.directory, part.text
        if not directory.holds(name):
            if output is not None:
                return tuple(output.neurons.tolist())
            inside = directory.instance(name)
            if inside:
                return tuple(index for one in inside for index in one.members)
            if self._fed(name):
                groups = self.census.neurons.groups
                return tuple(index for group in groups if group.input == name for index in group.indices)
        return known(resolve_part(part, text, directory, self.finder.findings), ())

    def _fed(self, name: str) -> bool:
        """Whether it is an input that neurons take in."""
        return any(group.input == name for group in self.census.neurons.groups)

    def _refuse(self, name: str, span: Span, what: str, hint: str) -> None:
        message = f"{what}, and '{shorten(name)}' is none"
        self.finder.findings.error("bad-view", span, message, hint)
