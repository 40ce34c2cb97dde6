"""Panels: the views that a caller asks for by words: ``traces``, ``traces: C1, C2``, ``weights: K -> O``.

In: a network, words. Out: Panels with what they name resolved. What the spec's own ``figure`` shows is resolved when it
is compiled (``compiler/drawing/figure``).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Final, TypeAlias

from neurovis_spec import arguments
from neurovis_spec.compiler.drawing.drawing_settings import Curve, Panel
from neurovis_spec.compiler.network import Network
from neurovis_spec.language.references import Part, Sum, parse, state_of
from neurovis_spec.language.words import PICTURES, VIEWS, WHOLE
from neurovis_spec.likeness import suggest
from neurovis_spec.runtime.errors import UnknownNameError
from neurovis_spec.runtime.names import Names, names_of
from neurovis_spec.runtime.references import find_connections, find_given, find_states
from neurovis_spec.scene.renderers import RendererError

#: A view by its name, with ``: `` and references behind it; or {view: references}.
View: TypeAlias = str | Mapping[str, str | Sequence[str]]

_SIGNS: Final = re.compile(r"[\[\]{}'\"]")
#: one of several numbers that an input is given: touch[2].given
_NUMBER: Final = re.compile(r"(?<=\w)\[[0-9]+\](?=\.)")
_APART: Final = re.compile(r"(\w+)[\s=]+(.+)", re.DOTALL)
_WANTED = "a view, {view: references}, or several"


class ViewError(RendererError):
    """There is no such view, or it cannot show what is asked for."""


def panels_of(network: Network, wanted: View | Sequence[View] | None) -> tuple[Panel, ...]:
    """The views of a picture, none where it is the network alone. Where nothing is asked for they are those of the
    spec's ``figure``; a view that names nothing shows what the figure has of its kind. Raises ViewError, KeyError and
    TypeError."""
    own = network.render.figure
    if wanted is None:
        panels = own
    else:
        views = [wanted] if isinstance(wanted, (str, Mapping)) else arguments.several("view", wanted, _WANTED)
        panels = tuple(panel for view in views for panel in _one(network, own, view))
    views = [panel.view for panel in panels]
    if views.count("network") and views.count("pathways"):
        raise ViewError("a page has the network once", f"take {' or '.join(map(repr, PICTURES))}")
    return () if views == ["network"] else panels


def _one(network: Network, own: Sequence[Panel], wanted: View) -> Iterator[Panel]:
    for name, references in _taken_apart(wanted):
        if name not in VIEWS:
            raise ViewError(f"there is no view '{name}'", _colon(name) or suggest(name, VIEWS, "views"))
        if references and name in WHOLE:
            raise ViewError(f"the view '{name}' shows {WHOLE[name]}: it takes no references")
        named = [panel for panel in own if panel.view == name and panel.shown is not None]
        if references:
            curves = [curve for reference in references for curve in curves_of(network, name, reference)]
            yield Panel(name, tuple(dict.fromkeys(curves)))
        else:
            yield from named or [Panel(name)]


def _taken_apart(wanted: View) -> Iterator[tuple[str, list[str]]]:
    """The name of a view, and its references."""
    if isinstance(wanted, str):
        name, _, rest = wanted.partition(":")
        if _SIGNS.search(_NUMBER.sub("", wanted)):  # as in a spec: what a reference holds has none of these
            plain = ": ".join(" ".join(_SIGNS.sub(" ", part).replace(",", ", ").split()) for part in (name, rest))
            raise ViewError(f"brackets and quotes belong to no view: '{wanted}'", f"write '{plain.replace(' ,', ',')}'")
        yield name.strip(), [part.strip() for part in rest.split(",") if part.strip()]
        return
    if not isinstance(wanted, Mapping):
        arguments.instance("view", wanted, str, _WANTED)
    for name, references in arguments.mapping("view", wanted).items():
        listed = () if references is None else arguments.texts("view", references)
        yield name, [part.strip() for reference in listed for part in reference.split(",") if part.strip()]


def _colon(name: str) -> str | None:
    """A help line for a view and its references that no colon parts, or for several views in one."""
    if all(part.strip() in VIEWS for part in name.split(",")):
        return "give each view by itself"
    match = _APART.fullmatch(name)
    return f"write '{match[1]}: {match[2]}'" if match is not None and match[1] in VIEWS else None


def curves_of(network: Network, view: str, reference: str) -> list[Curve]:
    """What a reference names. Raises ViewError where the view does not show its kind, KeyError for an unknown name."""
    names = names_of(network)
    found = parse(reference)
    if isinstance(found, Sum):
        curves = [curve for part in found.parts for curve in _part(network, part, names)]
    else:
        curves = [Curve("connection", index) for index in find_connections(network, reference, names).tolist()]
    refused = refusal(view, reference, curves)
    if refused is not None:
        raise ViewError(*refused)
    return curves


def refusal(view: str, reference: str, curves: Sequence[Curve]) -> tuple[str, str] | None:
    """Why a view does not show something: a raster has neurons, weights and a matrix have connections."""
    if view == "raster" and any(curve.of != "neuron" or curve.state for curve in curves):
        return f"a raster shows neurons, '{reference}' is none", "show it as traces"
    if view in ("weights", "matrix") and any(curve.of != "connection" or curve.state for curve in curves):
        return f"'{reference}' is no connection, and the view '{view}' shows connections", "write FROM -> TO"
    return None


def _part(network: Network, part: Part, names: Names) -> Iterator[Curve]:
    text = part.text
    output = next((one for one in network.outputs if one.name == text), None)
    neurons, given = names.find(text), find_given(network, text)
    if given is not None:
        yield from (Curve("input", place) for place in given)
        return
    if output is not None and output.states:
        states = output.states
    elif isinstance(neurons, str) and text in network.input_index:
        taking = [group for group in network.neurons.groups if group.input == text]
        yield from (Curve("neuron", index) for group in taking for index in group.indices)
        return
    elif isinstance(neurons, str):
        if state_of(part) is None:
            raise UnknownNameError(neurons)
        states = find_states(network, text, names)
    else:
        yield from (Curve("neuron", index) for index in neurons.neurons)
        return
    for one in states:
        yield from (Curve("neuron", index, one.state) for index in one.neurons.tolist())
        yield from (Curve("connection", index, one.state) for index in one.connections.tolist())
