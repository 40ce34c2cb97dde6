"""Definitions that are most likely mistakes: unused, read by nothing, hidden by others, replacing what they should
change.

In: the definitions and modules of a spec and of the files that it includes. Out: warnings where they are
declared, or where they are named.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from collections.abc import Mapping as AnyMapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from neurovis_spec.compiler.checks.compiled import Compiled
from neurovis_spec.compiler.connections.entries import Bundle
from neurovis_spec.compiler.flows import jacobian, slope_by, with_slope
from neurovis_spec.compiler.names.references import Section, key_of, key_span
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.neurons.groups import Built
from neurovis_spec.compiler.neurons.populate import Census
from neurovis_spec.compiler.program import ACTIVATION, DRIVE, MODEL, RULE, SYNAPSE, Definition, EndName, Kind
from neurovis_spec.compiler.values.builtin import installed
from neurovis_spec.compiler.values.constants import value_of
from neurovis_spec.compiler.values.definitions import Defined
from neurovis_spec.diagnostics import Findings, Span, listed
from neurovis_spec.language.expressions.evaluate import Value, evaluate_array
from neurovis_spec.language.expressions.functions import CONSTANTS
from neurovis_spec.language.expressions.lexer import OF_END
from neurovis_spec.language.expressions.parser import parse
from neurovis_spec.language.expressions.tree import ExpressionError, Tree, names
from neurovis_spec.language.grammar import ACTIVITIES
from neurovis_spec.language.library import DefinitionModel, Library, Parts
from neurovis_spec.language.located import Formula
from neurovis_spec.language.spec import Spec
from neurovis_spec.language.unknown import UNKNOWN
from neurovis_spec.language.values import Choice
from neurovis_spec.language.yaml.source import Mapping, Node, Packed, Scalar, Sequence

#: What the result of definitions of a kind is, in the author's words.
_RESULT_NOUN: AnyMapping[Kind, str] = {
    ACTIVATION: "the value",
    MODEL: "the activity",
    RULE: "the weight",
    SYNAPSE: "the signal",
}
_NOUNS = {"let": "intermediate value", "signals": "signal", "parameters": "parameter", "ports": "port"}


# Parts that nothing reads


def check_formulas(compiled: Compiled, findings: Findings) -> None:
    """Warn of parts of definitions that nothing reads, and of formulas that replace what they should change."""
    at_ends, of_neurons, of_connections = _read_at_ends(compiled), _taken(compiled.network), _shown(compiled.network)
    for library in compiled.libraries:
        for kind, result_noun in _RESULT_NOUN.items():
            for name, model in library.definitions[kind.section].items():
                written = model.parts()
                parts = _parts_of(model, written)
                result = f"the {written.gives}" if written.gives else result_noun
                _check_parts(parts, written, result, at_ends if kind == MODEL else (), findings)
                _check_flows(parts, written, of_neurons if kind == MODEL else of_connections, result, findings)
                if kind.lasting:
                    _check_replaced(parts, written, compiled.library.definitions.of(kind).known()[name], findings)


class _Part(NamedTuple):
    """A part of a definition: in which section it is declared and where, and the names that its formulas read."""

    section: str
    span: Span
    reads: frozenset[str]
    #: of a state whether it has a derivative
    flows: bool = False


def _names_read(*formulas: Formula | None) -> frozenset[str]:
    """The names that formulas read."""
    texts = [formula.value for formula in formulas if formula is not None and isinstance(formula.value, str)]
    return frozenset().union(*(names(parse(text, extra_functions={"f": 1}, naming="ends")) for text in texts))


def _parts_of(definition: DefinitionModel, written: Parts) -> dict[str, _Part]:
    """What a definition declares, by name."""
    reads: dict[tuple[str, str], frozenset[str]] = {}
    for name, value in written.parameters.items():
        reads["parameters", name] = _names_read(value.value, value.minimum, value.maximum)
    for name, formula in written.let.items():
        reads["let", name] = _names_read(formula)
    for name, state in (written.state or {}).items():
        flow = state.flow
        became = state.each_step, state.each_episode, flow.derivative, flow.noise, *flow.acts.values()
        read = _names_read(state.initial, *became)
        reads["state", name] = read
    flowing = {name for name, state in (written.state or {}).items() if state.flow.derivative is not None}
    found = {
        name: _Part(section, key_of(definition.source, section, name).span, read, name in flowing)
        for (section, name), read in reads.items()
    }
    found |= {port.name.value: _Part("ports", port.name.span, frozenset()) for port in written.ports}
    return found | {signal.value: _Part("signals", signal.span, frozenset()) for signal in written.signals}


def _reached(names: Iterable[str], parts: AnyMapping[str, _Part]) -> set[str]:
    """Some names, and all that the parts among them depend on."""
    found: set[str] = set()
    waiting = list(names)
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting += parts[name].reads if name in parts else ()
    return found


def _read_at_ends(compiled: Compiled) -> set[str]:
    """What rules, synapses and delays read of the models at both ends of connections."""
    found = {end.name for one in compiled.network.projections for end in one.use.definition.end_names}
    for section, _ in compiled.sections:
        for _, body in section.connections:
            delay = body.source.get("delay")
            for text in () if delay is None else _texts_in(delay):
                found.update(OF_END.findall(text))
    return found


def _check_parts(
    parts: AnyMapping[str, _Part], written: Parts, result_noun: str, elsewhere: Collection[str], findings: Findings
) -> None:
    """Warn of each part that neither the result nor any state depends on, nor is read ``elsewhere``. All states count
    as read, as an output, or whoever runs the network, can record them. A part that only such parts read is not
    reported: that follows from these."""
    states = [name for name, part in parts.items() if part.section == "state"]
    used = _reached([*_given(written), *states, *elsewhere], parts)
    unused = {name: part for name, part in parts.items() if name not in used}
    for name, (section, span, _, _) in unused.items():
        if any(name in part.reads for other, part in unused.items() if other != name):
            continue
        message = f"{result_noun} does not depend on the {_NOUNS[section]} '{name}'"
        if section == "parameters":
            findings.warning("unused-parameter", span, message, "remove it, or use it")
        else:
            findings.warning("unused-part", span, message, "remove it, or use it")


def _given(written: Parts) -> frozenset[str]:
    """What the formulas read that say what a definition gives, when it fires, and how lines end."""
    given = written.each_step, written.each_episode, written.derivative, written.sign, *written.acts.values()
    spike = written.spike
    fires = () if spike is None else (spike.when, spike.refractory, *spike.set.values())
    return _names_read(*given, *fires, *(written.outputs or {}).values())


# Derivatives


def _taken(network: Network) -> frozenset[str]:
    """The names of states that somebody outside their model asks for: a connection, a synapse or a rule, an output, a
    picture."""
    found = {route.sends for route in network.connections.routes} | {outlet.name for outlet in network.outlets}
    return frozenset(found.union((one.state for one in network.render.show), _shown(network)))


def _shown(network: Network) -> frozenset[str]:
    """The names of states that are outputs or stand in a figure; nothing else asks for those of connections."""
    outputs = (state.state for output in network.outputs for state in output.states)
    return frozenset((*outputs, *(curve.state for panel in network.render.figure for curve in panel.shown or ())))


def _check_flows(
    parts: AnyMapping[str, _Part], written: Parts, shown: Collection[str], result: str, findings: Findings
) -> None:
    """Warn of each state with a derivative on which nothing depends: neither what the definition gives or sends, nor
    another state."""
    states = written.state or {}
    for name, state in states.items():
        derivative = state.flow.derivative
        if derivative is None or name in shown or (written.send is not None and written.send.value == name):
            continue
        others = frozenset().union(*(parts[other].reads for other in states if other != name))
        if name not in _reached(_given(written) | others, {key: parts[key] for key in parts if key not in states}):
            message = f"nothing depends on the state '{name}': it is integrated for nobody"
            hint = f"let {result} or another state read it, or remove it"
            if written.outputs is not None:
                hint = f"let {result}, an output or another state read it, send it, or remove it"
            findings.warning("derivative-unread", parts[name].span, message, hint)


class Integrated(NamedTuple):
    """A definition in use that has derivatives, and where it is named; with a model the activation."""

    definition: Definition
    named: Span
    activation: Definition | None = None

    def place_of(self, derivative: str, libraries: Iterable[Library]) -> Span:
        """Where the derivative of a state, or that or the formula of what is given, stands, or where the definition is
        named, if it is a built-in."""
        kind, name = self.definition.kind, self.definition.name
        own = next((made[name] for one in libraries if name in (made := one.definitions[kind.section])), None)
        if own is None:
            return self.named
        parts = own.parts()
        state = (parts.state or {}).get(derivative)
        formula = parts.derivative or parts.each_step if state is None else state.flow.derivative
        return self.named if formula is None else formula.span


def integrated(groups: Iterable[Built], bundles: Iterable[Bundle]) -> list[Integrated]:
    """All definitions in use with derivatives, with a model each activation: of neurons, then of connections."""
    found: dict[tuple[Kind, str, str], Integrated] = {}
    for group in groups:
        (activation, model), choice = (one.definition for one in group.kind), group.model.model
        if model.flows:
            named = group.model.source.span if choice is None else choice.name.span
            found.setdefault((MODEL, model.name, activation.name), Integrated(model, named, activation))
    for bundle in bundles:
        for made in (piece.definition for use in bundle.uses for piece in use.pieces):
            if made.flows or made.given.derivative is not None:
                found.setdefault((made.kind, made.name, ""), Integrated(made, bundle.key))
    return list(found.values())


def check_dt(
    spec: Spec,
    included: Iterable[Library],
    needing: Iterable[Integrated],
    sections: Iterable[Section],
    findings: Findings,
) -> None:
    """Report a derivative in use, else an input that counts what comes in a step, where nothing says how long a step
    is."""
    if "time" in spec.unknown or (spec.time is not None and (spec.time.dt or "dt" in spec.time.unknown)):
        return
    first_of: dict[tuple[Kind, str], Integrated] = {}
    for used in needing:
        first_of.setdefault((used.definition.kind, used.definition.name), used)
    hint = "say it at the top, as in time: {dt: 0.1 ms}"
    if not first_of:
        inputs = (model for section in sections for model in section.inputs.values())
        counted = next((one for one in inputs if one.poisson or one.spikes), None)
        if counted is not None:
            entry = next(one for one in counted.source.entries if one.name in ("spikes", "poisson"))
            what = "spikes come at times in seconds" if counted.spikes else "a rate is per second"
            findings.error("dt-needed", entry.key.span, f"{what}, and no 'dt' says how long a step is", hint)
        return
    one, *others = first_of.values()
    first = next((state.name for state in one.definition.flows), one.definition.given.name)
    unit = "second" if one.definition.per_second == 1 else "millisecond"
    message = f"the derivative of '{first}' is per {unit}, and no 'dt' says how long a step is"
    if others:
        names = listed([f"'{other.definition.name}'" for other in others])
        message += f". Others that need it: {names}"
    findings.error("dt-needed", one.place_of(first, (spec, *included)), message, hint)


def check_slopes(spec: Spec, included: Iterable[Library], used: Iterable[Integrated], findings: Findings) -> None:
    """Report a derivative in use whose own derivative by its state, which the integration needs, is longer than an
    expression may be."""
    for one in used:
        for state in one.definition.flows:
            try:
                jacobian(replace(one.definition, state=(state,)))
                if one.activation is not None and one.definition.reads_activation:
                    with_slope(one.activation)
            except ExpressionError as error:
                what = f"the derivative of '{state.name}' changes with it"
                _slope_too_long(what, error, one.place_of(state.name, (spec, *included)), findings)
                break


def _slope_too_long(what: str, error: ExpressionError, place: Span, findings: Findings) -> None:
    message = f"how {what} is too long to be told: {error.message}"
    hint = f"{error.hint} (let), or take another method of time.integrate, such as rk4"
    findings.error(error.code, place, message, hint)


class _Sloped(NamedTuple):
    """A formula of a definition in use of which the integration needs the derivative by one of its names."""

    used: Integrated
    formula: str
    tree: Tree
    by: str
    what: str


def check_slopes_through(
    spec: Spec, included: Iterable[Library], census: Census, bundles: Iterable[Bundle], findings: Findings
) -> None:
    """Report the same of what a synapse makes of a state of its target, and of what the target makes of that."""
    libraries, told = (spec, *included), set[tuple[str, str, str]]()
    for one in (sloped for bundle in bundles for sloped in _sloped_through(bundle, census)):
        key = one.used.definition.name, one.formula, one.by
        if key in told:
            continue
        told.add(key)
        try:
            slope_by(one.used.definition, one.tree, one.by)
        except ExpressionError as error:
            _slope_too_long(one.what, error, one.used.place_of(one.formula, libraries), findings)


def _sloped_through(bundle: Bundle, census: Census) -> Iterator[_Sloped]:
    """What a synapse of an entry brings, by the states of its targets that it reads; and the derivatives of these by
    the ports where that arrives."""
    made = (one.definition for use in bundle.uses for one in use.pieces if one.definition.kind == SYNAPSE)
    synapse = next(made, None)  # what is a parameter at an end makes no difference here
    if synapse is None or synapse.given.each_step is None:
        return
    for group in census.groups_of(bundle.targets):
        model, choice = group.kind.model.definition, group.model.model
        combine = {DRIVE: group.group.combine} | {port.name: port.combine for port in model.ports}
        for state in model.flows:
            end = EndName("post", state.name).text
            if end not in synapse.read or state.derivative is None:
                continue
            used = Integrated(synapse, bundle.key)
            what = f"what '{synapse.name}' brings changes with {end}"
            yield _Sloped(used, synapse.given.name, synapse.given.each_step, end, what)
            used = Integrated(model, group.model.source.span if choice is None else choice.name.span)
            for port in (name for name, _ in bundle.route.ports if combine[name] == "sum"):
                what = f"the derivative of '{state.name}' changes with {port}"
                yield _Sloped(used, state.name, state.derivative, port, what)


# Weights that are replaced where a change is meant


def _check_replaced(parts: AnyMapping[str, _Part], written: Parts, rule: Defined, findings: Findings) -> None:
    """``weight: {each_step: 0.01 * pre * post}``: a formula that reads what is active but nothing that outlasts the
    step, neither the weight nor a state that builds up, and that is 0 where all activities are 0, as a change would be.
    A weight that follows states, the time or a signal, or that has a value then, is not reported. The same of a
    centre."""
    given = rule.definition.given
    for formula, tree, when in (
        (written.each_step, given.each_step, "each step"),
        (written.each_episode, given.each_episode, "the end of each episode"),
    ):
        if formula is None or tree is None:
            continue
        read = _reached(_names_read(formula), parts)
        if given.name in read or any(_lasts(name, parts) for name in read):
            continue
        reads_activity = any(name.partition(".")[0] in ACTIVITIES for name in read)
        if reads_activity and _in_silence(tree, rule) == 0:
            message = f"this replaces the {given.name} at {when}: it does not read '{given.name}'"
            findings.warning("replaces-weight", formula.span, message, f"for a change write {given.name} + …")


def _lasts(name: str, parts: AnyMapping[str, _Part]) -> bool:
    """Whether a name is a state whose value outlasts a step, since it reads itself or flows."""
    part = parts.get(name)
    return part is not None and part.section == "state" and (part.flows or name in _reached(part.reads, parts))


def _in_silence(tree: Tree, rule: Defined) -> Value:
    """What a formula gives where nothing is active, with the default parameters."""
    definition = rule.definition
    values: dict[str, Value] = {**CONSTANTS, "dt": 1.0, "k": 1.0, "t": 1.0, definition.given.name: 0.0}
    values |= dict.fromkeys((end.text for end in definition.end_names), 0.0)
    values |= dict.fromkeys((*ACTIVITIES, *definition.signals), 0.0)
    for default in rule.defaults:
        value = value_of(default.value, values)
        values[default.name] = 0.0 if value is UNKNOWN else value
    values |= {state.name: evaluate_array(state.initial, values) for state in definition.state}
    for name, let in definition.let:
        values[name] = evaluate_array(let, values)
    with np.errstate(all="ignore"):
        return evaluate_array(tree, values)


# Definitions that nobody names, or that are hidden


def check_unused(compiled: Compiled, findings: Findings) -> None:
    """Warn of definitions of the spec's own that are not used. What a module names counts as used, even if it has no
    instance, and so do rules and synapses of connections of which none is drawn."""
    network, choices = compiled.network, [*_choices(compiled)]
    used = {
        ACTIVATION: {group.activation for group in network.neurons.groups},
        MODEL: {group.model for group in network.neurons.groups},
        **{
            kind: {choice.name.value for section, choice in choices if section == kind.section}
            for kind in (RULE, SYNAPSE)
        },
    }
    modules = [library.source.get("modules") for library in compiled.libraries]
    named = {text for node in modules if node is not None for text in _texts_in(node)}
    for kind, used_here in used.items():
        node = compiled.spec.source.get(kind.section)
        for entry in node.entries if isinstance(node, Mapping) else ():
            if entry.name not in used_here | named:
                message = f"nobody uses the {kind.name} '{entry.name}'"
                findings.warning("unused-definition", entry.key.span, message, "remove it, or use it")


def _texts_in(node: Node) -> Iterator[str]:
    """Every text of a node, keys included."""
    waiting = [node]
    while waiting:
        node = waiting.pop()
        match node:
            case Scalar(value=str() as text):
                yield text
            case Mapping(entries=entries):
                yield from (entry.name for entry in entries)
                waiting += [entry.value for entry in entries]
            case Packed(texts=texts):
                yield from texts
            case Sequence(items=items):
                waiting += items


def check_modules(compiled: Compiled, findings: Findings) -> None:
    """Warn of modules of the spec's own that have no instance; those of an included file may be there for others."""
    modules = compiled.library.modules.known()
    in_modules = {instance.module.value for module in modules.values() for instance in module.model.instances.values()}
    for name, module in modules.items():
        if module.own and name not in compiled.used and name not in in_modules:
            message, hint = f"the module '{name}' has no instance", "add one under 'instances', or remove it"
            findings.warning("unused-module", key_span(compiled.spec, "modules", name), message, hint)


def check_hidden(compiled: Compiled, findings: Findings) -> None:
    """Warn of names that another installed package defines, too, whose definition is not used: what the spec means is
    not what its author may think. A definition of the spec's own has another warning (``replaces-builtin``)."""
    hidden = installed().hidden
    if not hidden:
        return
    for section, choice in _choices(compiled):
        name = choice.name.value
        found = hidden.get((section, name))
        if found is not None and not any(name in library.definitions[section] for library in compiled.libraries):
            message = f"'{name}' is that of {found.owner}; {found.place} defines one, too, which is not used"
            hint = "rename it in that package, or define here what is meant"
            findings.warning("hidden-definition", choice.name.span, message, hint)


def _choices(compiled: Compiled) -> Iterator[tuple[str, Choice]]:
    """What groups and connections name, with the section that defines such."""
    return (choice for section, _ in compiled.sections for choice in choices_in(section))


def choices_in(section: Section) -> Iterator[tuple[str, Choice]]:
    """The same of a spec or a module."""
    for group in section.neurons.values():
        if group.activation is not None:
            yield ACTIVATION.section, group.activation
        if group.model is not None:
            yield MODEL.section, group.model
    for _, body in section.connections:
        if body.synapse is not None:
            yield SYNAPSE.section, body.synapse
        yield from ((RULE.section, choice) for choice in body.plasticity)
