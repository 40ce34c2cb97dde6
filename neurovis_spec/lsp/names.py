"""Every name in a document, at its very characters: where it is declared, and wherever it is used.

In: Items. Out: Names, in the order of the document: those in references (``K3``, ``K3..K5``, ``left1.K -> O``), in
expressions, and those that are a whole value or key; each with its Scope, the module and the definition within which it
is looked up. What a text is for is in the models of the language (``language/places.py``).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Final

from neurovis_spec.compiler.values.constants import ALWAYS
from neurovis_spec.diagnostics import Span
from neurovis_spec.language.expressions.lexer import OF_END
from neurovis_spec.language.grammar import Kind, Role
from neurovis_spec.language.places import role_of
from neurovis_spec.language.references import Arrow, DottedName, NeuronRange, Part, RuleState, Sum, parse
from neurovis_spec.language.templates import Hole, pieces
from neurovis_spec.lsp.outline import Item, Path
from neurovis_spec.lsp.text import Text

#: The kinds that definitions declare, by section.
DEFINITIONS: Final[Mapping[str, Kind]] = {
    "activations": "activation",
    "models": "model",
    "rules": "rule",
    "synapses": "synapse",
}
SECTIONS: Final[Mapping[Kind, str]] = {kind: section for section, kind in DEFINITIONS.items()}
#: A name in an expression, and the parenthesis behind the name of a function.
_IN_FORMULA = re.compile(r"(?<![\w.])([A-Za-z_]\w*)(\s*\()?", re.ASCII)
_WORDS = frozenset({"and", "or", "not", "if", "else"})


@dataclass(frozen=True, slots=True)
class Scope:
    """Within which module (None: the spec itself) and which definition (section, name) a text stands."""

    module: str | None = None
    definition: tuple[str, str] | None = None


def scope_of(path: Path) -> Scope:
    """The scope of a key or a value.

    >>> scope_of(("modules", "leg", "parameters", "gain")).module
    'leg'
    """
    if len(path) > 2 and path[0] == "modules" and isinstance(path[1], str):
        return Scope(path[1])
    if len(path) > 2 and path[0] in DEFINITIONS:
        return Scope(None, (str(path[0]), str(path[1])))
    return Scope()


@dataclass(frozen=True, slots=True)
class Name:
    """A name where it stands. ``exact`` says whether its span is exactly its characters (it is not in a text with
    escapes); ``via`` is the name of the instance in front of it."""

    kind: Kind
    text: str
    span: Span
    scope: Scope
    item: Item
    declares: bool = False
    exact: bool = True
    via: Name | None = None


@dataclass(frozen=True)
class Lookup:
    """What the reading of some names needs to know of others: the module of an instance, whether a setting of a rule
    is a signal, whether an output is called so, the model that alone has a state, an output or a parameter of a name,
    the model of a group or a neuron of a module, and the definition of connections that alone has a state of a name."""

    module_of: Callable[[str, str | None], str | None]
    is_signal: Callable[[str, str], bool]
    is_output: Callable[[str], bool]
    model_with: Callable[[str], str | None]
    model_of: Callable[[str, str | None], str | None]
    joining_with: Callable[[str], tuple[str, str] | None]


def names_of(items: Iterable[Item], text: Text, lookup: Lookup) -> Iterator[Name]:
    """All names of the items."""
    for item in items:
        role = role_of(item.path, item.is_key)
        if role is not None and (item.is_key or isinstance(item.scalar.value, str)):
            yield from _names(item, role, scope_of(item.path), text, lookup)


def _names(item: Item, role: Role, scope: Scope, text: Text, lookup: Lookup) -> Iterator[Name]:
    match role.use:
        case "formula" | "template":
            yield from _formula(item, role, scope, text, lookup)
        case "setting value":
            if role.kind == "rule" and lookup.is_signal(*setting_of(item.path)):
                yield from _references(item, scope, text, lookup, stately=True)
            else:
                yield from _formula(item, role, scope, text, lookup)
        case "ends" | "references":
            yield from _references(item, scope, text, lookup, stately=may_be_states(item.path))
        case "settable" if isinstance(parse(item.text), Arrow):
            yield from _references(item, scope, text, lookup)
        case "settable":
            yield _whole(item, "parameter", scope, text)
        case "setting":
            assert role.kind is not None
            definition = Scope(None, (SECTIONS[role.kind], str(item.path[-2])))
            yield _whole(item, "local", definition, text)
        case "choice" | "names" | "declares":
            assert role.kind is not None
            if role.use == "choice":
                scope = Scope()
            elif item.is_key and item.path[-4:-3] == ("instances",):
                scope = Scope(lookup.module_of(str(item.path[-3]), scope.module))
            declares = role.use == "declares"
            if role.kind == "input" and "." in item.text:  # one of an instance: left1.load
                yield from _references(item, scope, text, lookup)
                return
            if role.kind == "module" or role.kind in SECTIONS:
                scope = Scope()
            yield _whole(item, role.kind, scope, text, declares)


def may_be_states(path: Path) -> bool:
    """Whether references at a path may be to states: what leaves the network, what is shown, and what is held."""
    held = path[:1] == ("events",) and path[2:3] == ("clamp",)
    return path[:1] == ("outputs",) or path[:2] == ("render", "figure") or held


def setting_of(path: Path) -> tuple[str, str]:
    """The definition, and that setting of it of which the text at a path is the value or one of several.

    >>> setting_of(("modules", "leg", "connections", "K -> O", "plasticity", 0, "delta", "target", "from", 1))
    ('delta', 'target')
    """
    keys = [part for part in path if isinstance(part, str)]
    behind = 5 if keys[0] == "modules" else 3
    return keys[behind], keys[behind + 1]


def _whole(item: Item, kind: Kind, scope: Scope, text: Text, declares: bool = False) -> Name:
    place = _inside(item, text, [(0, len(item.text))])
    span, exact = place[0]
    return Name(kind, item.text, span, scope, item, declares, exact)


def _formula(item: Item, role: Role, scope: Scope, text: Text, lookup: Lookup) -> Iterator[Name]:
    """The names of an expression that somebody declares: no constants, no functions, nothing that is given here."""
    found = [match for match in _IN_FORMULA.finditer(item.text) if match[1] not in _WORDS]
    if role.use == "template":
        holes = [piece for piece in pieces(item.text) if isinstance(piece, Hole)]
        found = [match for match in found if any(hole.start <= match.start() < hole.end for hole in holes)]
    places = _inside(item, text, [match.span(1) for match in found])
    local = scope.definition is not None
    for match, (span, exact) in zip(found, places, strict=True):
        if match[2] is None and match[1] not in ALWAYS and match[1] not in role.sees:
            output = role.kind == "output" and lookup.is_output(match[1])
            kind: Kind = "output" if output else "local" if local else "parameter"
            yield Name(kind, match[1], span, scope, item, False, exact)
    if role.ends:
        yield from _of_ends(item, text, lookup)


def _of_ends(item: Item, text: Text, lookup: Lookup) -> Iterator[Name]:
    """The names behind the points of ``pre.v`` and ``post.v``, as far as it is sure which model is meant."""
    found = [(match, lookup.model_with(match[1])) for match in OF_END.finditer(item.text)]
    sure = [(match, model) for match, model in found if model is not None]
    places = _inside(item, text, [match.span(1) for match, _ in sure])
    for (match, model), (span, exact) in zip(sure, places, strict=True):
        yield Name("local", match[1], span, Scope(None, (SECTIONS["model"], model)), item, False, exact)


def _references(item: Item, scope: Scope, text: Text, lookup: Lookup, stately: bool = False) -> Iterator[Name]:
    """The names of neurons and instances; where it is ``stately`` the last one may be a state of these, or of
    connections."""
    found = parse(item.text)
    written = list(_dotted(found))
    steps = [(step.start, step.end) for name, _ in written for step in name.steps]
    places = iter(_inside(item, text, steps))
    way: list[tuple[Scope | None, Name | None]] = []  # where the instances of the name before lead
    for name, shared in written:
        way = way[:shared]
        here, via = way[-1] if way else (Scope(scope.module), None)
        model: str | None = None
        *instances, last = name.steps
        for number, step in enumerate(instances, 1):
            span, exact = next(places)
            module = None if here is None else lookup.module_of(step.text, here.module)
            if here is not None and stately and number == len(instances) and module is None:
                yield Name("neuron", step.text, span, here, item, False, exact, via)  # K.v is the state v of K
                model = lookup.model_of(step.text, here.module)
            elif here is not None:
                via = Name("instance", step.text, span, here, item, False, exact, via)
                yield via
            here = None if module is None else Scope(module)
            way.append((here, via))
        span, exact = next(places)
        if here is not None and last.text:
            yield Name("neuron", last.text, span, here, item, False, exact, via)
        elif model is not None:
            yield Name("local", last.text, span, Scope(None, (SECTIONS["model"], model)), item, False, exact)
    for part in found.parts if stately and isinstance(found, Sum) else ():
        if isinstance(part, RuleState) and (definition := lookup.joining_with(part.state)) is not None:
            state = part.end - len(part.state), part.end
            span, exact = _inside(item, text, [*(step for step in steps if step[1] < state[0]), state])[-1]
            yield Name("local", part.state, span, Scope(None, definition), item, False, exact)


def _dotted(written: Sum | Arrow | Part) -> Iterator[tuple[DottedName, int]]:
    """The names of a reference, in order, each with how many of the instances of the name before lead to it as well:
    those that the second end of a range leaves out, as in left1.K1..K3."""
    match written:
        case Arrow():
            yield from (*_dotted(written.sources), *_dotted(written.targets))
        case Sum():
            for part in written.parts:
                yield from _dotted(part)
        case RuleState():
            yield from _dotted(written.ends)
        case NeuronRange():
            yield written.low, 0
            again = len(written.high.steps) - len(written.last.steps)
            yield written.high, len(written.low.steps) - 1 - again
        case DottedName():
            yield written, 0


def _inside(item: Item, text: Text, parts: list[tuple[int, int]]) -> list[tuple[Span, bool]]:
    """The places of parts of an item's text, and whether each is exact.

    Where the characters do not stand one by one in the source (several lines, escapes), names are looked for in order
    in what is written; if others are found there, the whole item is given.
    """
    scalar = item.scalar
    if scalar.inner is not None and scalar.span.line == scalar.span.end_line:
        return [(scalar.at(start, end), True) for start, end in parts]
    raw = text.part(scalar.span)
    first = text.index(scalar.span.line, scalar.span.column)
    result: list[tuple[Span, bool]] = []
    at = 0
    locate = partial(text.span, scalar.span.file)
    for start, end in parts:
        wanted = item.text[start:end]
        match = re.compile(rf"(?<!\w){re.escape(wanted)}(?!\w)").search(raw, at)
        if match is None or "\\" in raw:
            return [(scalar.span, False)] * len(parts)
        result.append((locate(first + match.start(), first + match.end()), True))
        at = match.end()
    return result
