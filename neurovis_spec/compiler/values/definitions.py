"""Definitions: activations, models, rules and synapses, from their formulas to checked trees.

In: the models of a library file or of a spec's own sections. Out: Definitions by name. A definition sees its own
parameters, states and intermediate values, and what its kind is given (``x``; ``drive``; ``pre``, ``post``, …); never
the spec's parameters. It is checked even if nobody uses it. What is written of a kind, and where, is a Reading.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from graphlib import CycleError, TopologicalSorter
from heapq import heappop, heappush
from types import MappingProxyType
from typing import Final, NamedTuple, TypeAlias

import numpy as np

from neurovis_spec.compiler.flows import reads
from neurovis_spec.compiler.limits import PATIENCE
from neurovis_spec.compiler.program import (
    ACTIVATION,
    DRIVE,
    MODEL,
    RULE,
    SPIKE,
    SYNAPSE,
    Definition,
    EndName,
    Kind,
    Phase,
    PortOf,
    Quantity,
)
from neurovis_spec.compiler.values.constants import (
    ALWAYS,
    Outside,
    Sight,
    Value,
    check_finite,
    is_constant,
    parse_formula,
    value_of,
)
from neurovis_spec.compiler.values.shared import obstacles
from neurovis_spec.compiler.values.spikes import Spike, jumping, share_of, with_spike
from neurovis_spec.diagnostics import Findings, Home, Span, shorten
from neurovis_spec.language.expressions.evaluate import evaluate_array
from neurovis_spec.language.expressions.functions import CONSTANTS, meaning
from neurovis_spec.language.expressions.lexer import Naming
from neurovis_spec.language.expressions.tree import (
    ExpressionError,
    Name,
    Number,
    Tree,
    calls,
    check_extent,
    names,
    put,
    substitute,
    walk,
    with_products,
)
from neurovis_spec.language.grammar import IN_SIGN, Role
from neurovis_spec.language.library import (
    Act,
    ActivationModel,
    DefinitionModel,
    Library,
    ModelModel,
    RuleModel,
    SpikeModel,
    StateModel,
    SynapseModel,
)
from neurovis_spec.language.located import IDENTIFIER, Formula, Located, bad_name, name_hint
from neurovis_spec.language.model import names_of, unread
from neurovis_spec.language.places import formula_at
from neurovis_spec.language.units import Seconds, measured, number_in
from neurovis_spec.language.unknown import UNKNOWN, Names, Unknown
from neurovis_spec.language.values import ParameterModel, WrittenPort
from neurovis_spec.language.words import TimeUnit
from neurovis_spec.language.yaml.source import Mapping as SourceMapping
from neurovis_spec.likeness import suggest


class Default(NamedTuple):
    """A parameter of a definition: its default and its bounds, which may use earlier parameters."""

    name: str
    value: Tree | Unknown
    low: Tree | None = None
    high: Tree | None = None
    unit: str = ""


Defaults: TypeAlias = tuple[Default, ...]


class Defined(NamedTuple):
    """A definition, and the defaults of its parameters."""

    definition: Definition
    defaults: Defaults


_NONE = Names[Defined]()
_NO_FUNCTIONS: Mapping[str, int] = MappingProxyType({})


@dataclass(frozen=True)
class Definitions:
    """All definitions in reach, by their kinds."""

    kinds: Mapping[Kind, Names[Defined]] = field(default_factory=dict)

    def of(self, kind: Kind) -> Names[Defined]:
        """Those of a kind, by name."""
        return self.kinds.get(kind, _NONE)

    def over(self, other: Definitions) -> Definitions:
        """These and others: of two of one name this one."""
        return Definitions({kind: self.of(kind).over(other.of(kind)) for kind in {**self.kinds, **other.kinds}})

    def opened(self, is_open: bool) -> Definitions:
        """The same definitions; with ``is_open`` an unknown name is UNKNOWN, as some could not be read."""
        return Definitions({kind: known.opened(is_open) for kind, known in self.kinds.items()})


class Reading(NamedTuple):
    """How definitions of a kind are read: what their formulas see (``role``), whether intermediate values are put into
    what is given (``inlined``), whether x^3 and x^4 are products in all of them (``products``), not only where
    something is integrated or spikes."""

    kind: Kind
    role: Role
    inlined: bool = False
    products: bool = False


#: The built-in definitions that came when specs may have had one of their own of this name, which replaces it.
LATER: Final[Mapping[Kind, frozenset[str]]] = {
    MODEL: frozenset({
        "leaky", "fitzhugh_nagumo", "matsuoka", "hopf", "van_der_pol", "wilson_cowan", "jansen_rit", "phase_oscillator",
        "amplitude_oscillator", "ornstein_uhlenbeck", "cfc", "hodgkin_huxley", "morris_lecar", "graded", "danner",
        "ltc", "lif", "lif_current", "lif_conductance", "lif_conductance_alpha", "adex", "izhikevich_ode", "qif",
        "spike_source",
    }),
    RULE: frozenset({
        "stdp", "stdp_multiplicative", "stdp_triplet", "stdp_reward", "homeostatic_scaling", "vogels_inhibitory",
    }),
}  # fmt: skip
_READINGS = (
    Reading(ACTIVATION, formula_at(ActivationModel, "value"), inlined=True),
    Reading(MODEL, formula_at(ModelModel, "activity")),
    Reading(RULE, formula_at(RuleModel, "weight", "each_step")),
    Reading(SYNAPSE, formula_at(SynapseModel, "signal"), products=True),
)

#: Keys of a definition that declare what is named where it is used, and those that declare names for its formulas.
_NAMED = frozenset({"parameters", "signals", "ports", "outputs", "state"})
_SECTIONS = ("parameters", "signals", "let", "state")
_DECLARING = frozenset({*_SECTIONS, "ports"})
#: How many of its unit of time a second has.
_PER_SECOND: Final[Mapping[TimeUnit, float]] = {"s": 1.0, "ms": 1000.0}
#: Names that no output has: what is sent and shown by these is something else.
_NO_OUTPUTS = (MODEL.gives, "spike")


#: What nobody reads of the ends of a connection, with the message, behind the name, and the hint.
_NOT_OF_ENDS: Final[Mapping[str, tuple[str, str]]] = {
    DRIVE: (
        "is a port, where what connections bring is only being put together",
        "read a state or an output: outputs: {rate: f(drive)} in the model there is post.rate",
    ),
}
#: What a spike is called in the formulas of synapses and rules, as what of the source.
_ARRIVING: Final = EndName("pre", SPIKE).text

#: What to do where a definition reads a parameter of the spec.
_OUTSIDE = "a definition sees its own parameters alone: declare '{0}' among them, and set it where it is used"


class Around(NamedTuple):
    """What is around definitions: the seconds of a step, and the parameters of the spec, which they do not see."""

    dt: float = 1.0
    parameters: Collection[str] = ()

    @property
    def outside(self) -> Outside:
        """These, and what to do about them."""
        return Outside(self.parameters, _OUTSIDE)


#: Seconds of a step of 1, and no parameters.
NOTHING_AROUND = Around()


class _Checker:
    """Checks one definition: the names that are taken, and the trees of its formulas."""

    def __init__(
        self, reading: Reading, model: DefinitionModel, findings: Findings, around: Around, place: tuple[str, str]
    ) -> None:
        self.model = model
        self.parts = model.parts()
        self.findings, self.errors_before = findings, findings.errors
        self.functions = dict.fromkeys(reading.role.functions, 1)
        self.constants = {**CONSTANTS, "dt": around.dt * _PER_SECOND[self.parts.time]}
        self.outside = around.outside
        self.home = Home(place, _SECTIONS)
        #: what is given, which a rule sees by its name
        self.given_name = self.parts.gives or reading.kind.gives
        given = (self.given_name if name == reading.kind.gives else name for name in reading.role.sees)
        #: where each name is declared; nowhere those that are given
        self.known = Names[Span | None](dict.fromkeys((*ALWAYS, *given)), not model.unknown.isdisjoint(_DECLARING))
        #: of connections it knows what there is at their ends
        self.naming: Naming = "ends" if reading.role.ends else ""
        flows = [one.flow for one in (self.parts.state or {}).values()]
        acts = {act for one in (self.parts.acts, *(flow.acts for flow in flows)) for act in one}
        #: whether ``spike`` is what arrives
        self.arriving = reading.kind == SYNAPSE or not acts.isdisjoint(("on_pre", "on_post"))
        if self.arriving:
            self.known.declared[SPIKE] = None
        #: where the spike block of a model stands
        keys = (entry.key.span for entry in model.source.entries if entry.name == SPIKE and reading.kind == MODEL)
        self.firing = next(keys, None)
        if self.firing is not None:
            self.known.declared[SPIKE] = self.firing
        #: whether x^3 and x^4 are products
        self.products = (
            reading.products
            or self.parts.derivative is not None
            or self.parts.spike is not None
            or "jump" in acts
            or any(flow.derivative is not None for flow in flows)
        )

    def declare(self, section: str, name: str) -> None:
        """A parameter, state, signal or intermediate value; each name once, and none that is given."""
        self.declare_at(self._key(section, name), name)

    def declare_at(self, span: Span, name: str) -> None:
        """The same of one that is declared at a place."""
        if name in self.known.declared:
            such = "" if isinstance(self.known[name], Span) else f", such as '{name}_0'"
            self.findings.error("duplicate-name", span, self.taken(name), f"choose another name{such}")
        self.known.declared[name] = span

    def state(self, name: str, kind: Kind) -> None:
        """Declare a state; none of a synapse is called as its signal is, which is recorded beside states."""
        if kind == SYNAPSE and name == kind.gives:
            message = f"'{name}' is no name for a state of a synapse: it means what the synapse gives"
            self.findings.error("reserved-name", self._key("state", name), message, "choose another name")
        self.declare("state", name)

    def taken(self, name: str) -> str:
        """The message for a name that is declared twice, or that is one of the given ones."""
        first = self.known[name]
        if isinstance(first, Span):
            return f"'{name}' already means something here (it is declared in line {first.line})"
        return f"'{name}' already means something here: {meaning(name)}"

    def sharing(self, definition: Definition) -> None:
        """Report what keeps the states of a synapse from being shared, where all else of it is in order."""
        if not definition.shared or self.findings.errors > self.errors_before:
            return
        for state, key, message, hint in obstacles(definition):
            within = self.model.source.get("state") if state else None
            source = within.get(state) if isinstance(within, SourceMapping) else self.model.source
            node = source.get(key) if isinstance(source, SourceMapping) else source
            span = self.model.source.span if node is None else node.span
            self.findings.error("shared-not-linear", span, message, hint)

    def _key(self, section: str, name: str) -> Span:
        return _key_in(self.model.source, section, name)

    def optional(self, formula: Formula | None, functions: Mapping[str, int] = _NO_FUNCTIONS) -> Tree | None:
        """The tree of a formula that may be left out."""
        return None if formula is None else self.tree(formula, functions)

    def given(self, formula: Formula | None) -> Tree | None:
        """The tree of what is given. A model's activity may be undefined; who uses the model is warned."""
        if formula is None or not self.functions:
            return self.optional(formula)
        tree = self.read(formula, self.sight(), self.functions)
        return Number(0.0) if tree is UNKNOWN else tree

    def gives(self, kind: Kind, spike: Spike | None) -> Quantity:
        """What is given; a model that says nothing of it gives its spike."""
        parts = self.parts
        each_step, each_episode = self.given(parts.each_step), self.given(parts.each_episode)
        if each_step is None and kind == MODEL:  # perhaps the spike is invalid, which is reported
            each_step = Number(0.0) if spike is None else Name(SPIKE)
        derivative, acts = self.optional(parts.derivative), self.acts(parts.acts)
        return Quantity(self.given_name, each_step, each_episode, derivative=derivative, acts=acts)

    def tree(
        self,
        formula: Formula,
        functions: Mapping[str, int] = _NO_FUNCTIONS,
        sight: Sight | None = None,
    ) -> Tree:
        """The tree of a formula over what is declared so far, or what is in ``sight``; 0 in the place of one that is
        invalid, as nothing is computed with it any more."""
        tree = self.read(formula, sight or self.sight(), functions)
        if tree is not UNKNOWN and is_constant(tree) and not calls(tree, functions):
            check_finite(evaluate_array(tree, self.constants), formula, self.findings)
        return Number(0.0) if tree is UNKNOWN else tree

    def sight(self, known: Collection[str] | None = None, what: str = "known in this definition") -> Sight:
        """What a formula sees: what is declared so far, or what is ``known``."""
        ends = self.naming == "ends" and known is None
        return Sight(self.known if known is None else known, what, outside=self.outside, home=self.home, ends=ends)

    def read(self, formula: Formula, sight: Sight, functions: Mapping[str, int] = _NO_FUNCTIONS) -> Tree | Unknown:
        """The tree of a formula; UNKNOWN where it is invalid, which is reported."""
        tree = parse_formula(formula, sight, self.findings, functions=functions, naming=self.naming)
        if tree is UNKNOWN or not self._has_ends(tree, formula):
            return UNKNOWN
        if self.arriving and SPIKE in names(tree):
            tree = put(tree, {SPIKE: Name(_ARRIVING)})
        if not self.products:
            return tree
        try:
            made = with_products(tree)
            check_extent(made, tree)
            return made
        except ExpressionError as error:
            place = formula.node.at(error.start, error.end)
            self.findings.error(error.code, place, f"with x^3 as x*x*x, {error.message}", error.hint)
            return UNKNOWN

    def _has_ends(self, tree: Tree, formula: Formula) -> bool:
        """Whether all that is read of the ends may be there: a finding for what no model has, whichever it is."""
        before = self.findings.errors
        for node in walk(tree) if self.naming else ():
            end, _, name = node.name.partition(".") if isinstance(node, Name) else ("", "", "")
            if name not in _NOT_OF_ENDS:
                continue
            place = formula.node.at(node.start, node.end)
            message, hint = _NOT_OF_ENDS[name]
            self.findings.error("no-such-end-state", place, f"'{end}.{name}' {message}", hint)
        return self.findings.errors == before

    def parameters(self, parameters: Mapping[str, ParameterModel]) -> Defaults:
        """Declare the parameters; a default sees those before it."""
        result: list[Default] = []
        values = Names[Value](self.constants)
        for name, parameter in names_of(self.model, "parameters", parameters).items():
            self.declare("parameters", name)
            default = Default(name, UNKNOWN) if parameter is UNKNOWN else self._default(name, parameter, values)
            result.append(default)
            value = values.declared[name] = value_of(default.value, values)
            if parameter is not UNKNOWN and value is not UNKNOWN:
                check_bounds(value, default, values, parameter.value.span, self.findings)
        return tuple(result)

    def _default(self, name: str, parameter: ParameterModel, values: Names[Value]) -> Default:
        """A parameter's default and bounds as formulas; UNKNOWN, or None for a bound, where one is invalid."""
        value, low, high = (
            UNKNOWN if formula is None else self._finite(formula, values)
            for formula in (parameter.value, parameter.minimum, parameter.maximum)
        )
        return Default(
            name,
            value,
            None if low is UNKNOWN else low,
            None if high is UNKNOWN else high,
            parameter.measure,
        )

    def _finite(self, formula: Formula, values: Names[Value]) -> Tree | Unknown:
        """The tree of a default or a bound; UNKNOWN where it is invalid, or its value is known and not finite."""
        what = "known in this default"
        tree = self.read(formula, self.sight(values, what))
        value = value_of(tree, values)
        return UNKNOWN if value is not UNKNOWN and not check_finite(value, formula, self.findings) else tree

    def let(self, let: Mapping[str, Formula]) -> tuple[tuple[str, Tree], ...]:
        """Declare the intermediate values. They come in the order written, but behind those that they read."""
        for name in names_of(self.model, "let", let):
            self.declare("let", name)
        trees = {name: self.tree(formula, self.functions) for name, formula in let.items()}
        order, circle = sorted_by_need({name: names(tree) for name, tree in trees.items()})
        if circle:
            one = circle[0]
            message = f"'{one}' needs its own value: {' → '.join([*circle, one])}"
            hint = "what carries a value from one step to the next is a state"
            self.findings.error("let-cycle", self._key("let", one), message, hint)
        return tuple((name, trees[name]) for name in order)

    def ports(self, ports: Sequence[WrittenPort]) -> tuple[PortOf, ...]:
        """Declare the ports beside ``drive``."""
        for port in ports:
            name, span = port.name.value, port.name.span
            if name == DRIVE:
                self.findings.error("duplicate-name", span, f"'{name}' is a port of every model", "leave it out")
            else:
                self.declare_at(span, name)
        return tuple(PortOf(port.name.value, port.combine, port.unit) for port in ports)

    def outputs(self, outputs: Mapping[str, Formula]) -> tuple[Quantity, ...]:
        """The outputs beside the activity, which nothing in the definition reads."""
        trees = {name: self.tree(formula, self.functions) for name, formula in outputs.items()}
        declared = names_of(self.model, "outputs", outputs)
        for name in declared:
            if name in _NO_OUTPUTS:
                message = f"'{name}' is no name for an output: it means something else where outputs are named"
                self.findings.error("reserved-name", self._key("outputs", name), message, "choose another name")
            else:
                self.declare("outputs", name)
        return tuple(Quantity(name, trees.get(name, Number(0.0))) for name in declared)

    def sent(self, send: Located[str] | None) -> str:
        """The name of what is sent, of what the model keeps; "" for the activity."""
        if send is None or send.value == MODEL.gives:
            return ""
        kept = {"state": self.parts.state or {}, "outputs": self.parts.outputs or {}}
        known: list[Collection[str]] = [names_of(self.model, section, made) for section, made in kept.items()]
        known.append(() if self.firing is None else (SPIKE,))
        if not any(send.value in names for names in known):
            message = f"'{shorten(send.value)}' is neither a state nor an output of this model"
            hint = suggest(send.value, [*(name for names in known for name in names), MODEL.gives], "what can be sent")
            self.findings.error("unknown-state", send.span, message, hint)
        return send.value

    def signals(self, signals: Sequence[Located[str]]) -> tuple[str, ...] | Unknown:
        """Declare the signals; UNKNOWN where it is not known which there are."""
        before = self.findings.errors
        for signal in signals:
            if not IDENTIFIER.fullmatch(signal.value):
                self.findings.error("bad-name", signal.span, bad_name(signal.value), name_hint(signal.value))
            elif signal.value in self.known.declared:
                self.findings.error("duplicate-name", signal.span, self.taken(signal.value), "choose another name")
            self.known.declared[signal.value] = signal.span
            if self.findings.errors - before >= PATIENCE:
                break
        return UNKNOWN if self.findings.errors > before else tuple(signal.value for signal in signals)

    def unfolded(self, let: tuple[tuple[str, Tree], ...]) -> dict[str, Tree] | Unknown:
        """The intermediate values, each with those before it put in; UNKNOWN where one explodes."""
        result: dict[str, Tree] = {}
        before = self.findings.errors
        for key, tree in let:
            if self.findings.errors > before:  # what explodes once explodes again in all that uses it
                return UNKNOWN
            place = self.known[key]
            result[key] = self.with_let(tree, result, place if isinstance(place, Span) else self.model.source.span)
        return result

    def with_let(self, tree: Tree, let: Mapping[str, Tree], span: Span) -> Tree:
        """The tree with its intermediate values put in; a finding where that makes too much of it."""
        try:
            return substitute(tree, let)
        except ExpressionError as error:
            message = f"with its intermediate values put in, {error.message}"
            self.findings.error(error.code, span, message, error.hint)
            return Number(0.0)

    def sign(self, formula: Formula | None, defaults: Defaults) -> Tree | None:
        """How lines end, of parameters here and at the ends, and of the weight."""
        if formula is None:
            return None
        known = (*ALWAYS, *(default.name for default in defaults), *IN_SIGN.sees)
        return self.tree(formula, sight=self.sight(known, "known here")._replace(ends=True))

    def states(self, state: Mapping[str, StateModel], defaults: Defaults) -> tuple[Quantity, ...]:
        """The states; their right-hand sides see everything, their initial values the parameters alone. One that could
        not be read is there all the same, since others may name it."""
        constant = self.sight((*ALWAYS, *(default.name for default in defaults)), "known here")
        lost = tuple(map(Quantity, unread(self.model, "state")))
        return lost + tuple(
            Quantity(
                name,
                self.optional(model.each_step, self.functions),
                self.optional(model.each_episode),
                Number(0.0) if model.initial is None else self.tree(model.initial, sight=constant),
                self.optional(model.flow.derivative, self.functions),
                self.optional(model.flow.noise),
                model.flow.unit,
                self.acts(model.flow.acts),
            )
            for name, model in state.items()
        )

    def acts(self, acts: Mapping[Act, Formula]) -> tuple[tuple[Phase, Tree], ...]:
        """What arriving spikes and those of the target make of something."""
        return tuple((act, self.tree(formula)) for act, formula in acts.items() if act != "jump")

    def jumps(self, states: tuple[Quantity, ...], let: tuple[tuple[str, Tree], ...]) -> tuple[Quantity, ...]:
        """The states with what is added to them when spikes arrive: each port counts once, as a factor."""
        result = list[Quantity]()
        for state in states:
            written = (self.parts.state or {}).get(state.name)
            formula = None if written is None else written.flow.acts.get("jump")
            if formula is None:
                result.append(state)
                continue
            tree = self.tree(formula, self.functions)
            self._check_jump(tree, formula, let)
            result.append(jumping(state, tree))
        return tuple(result)

    def _check_jump(self, tree: Tree, formula: Formula, let: tuple[tuple[str, Tree], ...]) -> None:
        """Report a jump that adds anything but multiples of what arrives, so that nothing is added where nothing
        arrives."""
        if self.known.is_open or (isinstance(tree, Number) and tree.value == 0):
            return  # as of one that is invalid, or reads what is, which is reported
        ports, read = [DRIVE, *(port.name.value for port in self.parts.ports)], set(names(tree))
        for name, between in reversed(let):
            read |= names(between) if name in read else set()
        other = next((one for one in self.parts.ports if one.combine != "sum" and one.name.value in read), None)
        if other is not None:
            message = f"'{other.name.value}' combines by {other.combine}, and a jump adds up what arrives"
            self.findings.error("jump-not-linear", formula.span, message, "a port by which a state jumps is a sum")
        elif share_of(tree, ports, let) != "multiple":
            message = "a jump adds what arrives, times something: each term has one port, as a factor"
            hint = "as in jump: (1 - g)*excitatory; without spikes nothing is added"
            self.findings.error("jump-not-linear", formula.span, message, hint)

    def spike(self, written: SpikeModel) -> Spike:
        """The spike block: when it fires, and what then becomes of the states."""
        states = {} if self.parts.state is None else names_of(self.model, "state", self.parts.state)
        for key in names_of(written, "set", written.set):
            self._is_state(key, _key_in(written.source, "set", key), states)
        for one in written.hold:
            self._is_state(one.value, one.span, states)
        return Spike(
            self.tree(written.when, self.functions),
            {name: self.tree(formula, self.functions) for name, formula in written.set.items()},
            None if written.refractory is None else self._refractory(written.refractory),
            [one.value for one in written.hold],
        )

    def _refractory(self, formula: Formula) -> Tree:
        """How long it cannot fire, in the unit of time of the definition."""
        tree = self.tree(self._in_own_time(formula), self.functions)
        if is_constant(tree) and not calls(tree, self.functions) and np.any(evaluate_array(tree, self.constants) < 0):
            message = "'refractory' is how long it cannot fire, and at least 0"
            self.findings.error("out-of-range", formula.span, message, "leave it out, if it can fire in each step")
        return tree

    def _is_state(self, name: str, span: Span, states: Collection[str]) -> None:
        if name not in states and not self.known.is_open:
            message = f"'{shorten(name)}' is no state of this model"
            self.findings.error("unknown-state", span, message, suggest(name, [*states], "its states"))

    def _in_own_time(self, formula: Formula) -> Formula:
        """A time with a unit as a number in the definition's own unit."""
        written = measured(str(formula.node.value)) if isinstance(formula.value, Seconds) else None
        if written is None:
            return formula
        return Located(number_in(self.parts.time, written), formula.node)

    def no_spikes(self, definition: Definition) -> None:
        """Report derivatives, and noise, that read a spike, which lasts no time; not where something else has its name,
        which is reported."""
        if (self.arriving or definition.fires) and self.known.declared[SPIKE] is not self.firing:
            return
        names = (_ARRIVING, EndName("post", SPIKE).text, *([SPIKE] if definition.fires else []))
        flows = {name: one.flow for name, one in (self.parts.state or {}).items()}
        written = [(definition.given.derivative, self.parts.derivative)]
        for state in definition.flows:
            flow = flows[state.name]
            written += [(state.derivative, flow.derivative), (state.noise, flow.noise)]
        for tree, formula in written:
            spikes = [name for name in names if name in reads(definition, [tree])]
            if not spikes or formula is None:
                continue
            name = SPIKE if self.arriving and spikes[0] == _ARRIVING else spikes[0]
            message = f"'{name}' in a derivative: a spike lasts no time, so that its effect would depend on dt"
            act = "jump" if definition.kind == MODEL else "on_pre" if spikes[0] == _ARRIVING else "on_post"
            act = "each_step" if act == "on_post" and definition.kind == SYNAPSE else act
            self.findings.error("spike-in-derivative", formula.span, message, f"read it in '{act}'")


def _key_in(source: SourceMapping, section: str, name: str) -> Span:
    """Where an entry of a section of a mapping has its name, or the section stands."""
    node = source.get(section)
    if isinstance(node, SourceMapping):
        entry = node.entry(name)
        if entry is not None:
            return entry.key.span
    return source.span if node is None else node.span


def check_bounds(
    value: Value, default: Default, values: Mapping[str, Value | Unknown], span: Span, findings: Findings
) -> bool:
    """Whether a parameter lies within its bounds, those that are known, everywhere; a finding where it does not."""
    low = UNKNOWN if default.low is None else value_of(default.low, values)
    high = UNKNOWN if default.high is None else value_of(default.high, values)
    low, high = -np.inf if low is UNKNOWN else low, np.inf if high is UNKNOWN else high
    outside = np.broadcast_to((value < low) | (value > high), np.broadcast_shapes(*map(np.shape, (value, low, high))))
    if not outside.any():
        return True
    first = np.unravel_index(int(outside.argmax()), outside.shape)
    one, least, most = (float(np.broadcast_to(part, outside.shape)[first]) for part in (value, low, high))
    bounds = f"{least:g} to {most:g}".replace("-inf", "-∞").replace("inf", "∞")
    hint = _bound(default, "at least", default.low) if one < least else _bound(default, "at most", default.high)
    findings.error("out-of-range", span, f"'{default.name}' is {one:g}; its bounds are {bounds}", hint)
    return False


def _bound(default: Default, how: str, bound: Tree | None) -> str | None:
    """A hint for a parameter whose bound is another parameter; None where it is not."""
    return f"'{default.name}' is {how} '{bound.name}'" if isinstance(bound, Name) else None


def definition_of(
    reading: Reading, name: str, model: DefinitionModel, findings: Findings, around: Around = NOTHING_AROUND
) -> Defined | Unknown:
    """A definition; UNKNOWN where it is not known which signals it has, or an intermediate value that is put into
    others is invalid."""
    kind = reading.kind
    checker = _Checker(reading, model, findings, around, (kind.section, name))
    parts = checker.parts
    defaults = checker.parameters(parts.parameters)
    signals = checker.signals(parts.signals)
    if signals is UNKNOWN:
        return UNKNOWN
    for key in () if parts.state is None else names_of(model, "state", parts.state):
        checker.state(key, kind)
    ports = checker.ports(parts.ports)
    let = checker.let(parts.let)
    state = () if parts.state is None else checker.jumps(checker.states(parts.state, defaults), let)
    spike = None if parts.spike is None else checker.spike(parts.spike)
    unfolded = checker.unfolded(let) if reading.inlined else {}
    if unfolded is UNKNOWN:
        return UNKNOWN
    given = checker.gives(kind, spike)
    each_step = given.each_step
    if reading.inlined and parts.each_step is not None and each_step is not None:
        let, given = (), replace(given, each_step=checker.with_let(each_step, unfolded, parts.each_step.span))
    outputs = () if parts.outputs is None else checker.outputs(parts.outputs)
    definition = Definition(
        kind=kind,
        name=name,
        parameters=tuple(default.name for default in defaults),
        gives=(given, *outputs),
        let=let if spike is None else (*let, spike.fires),
        state=state if spike is None else with_spike(state, spike),
        signals=signals,
        spikes=parts.spikes or (spike is not None and isinstance(each_step, Name) and each_step.name == SPIKE),
        ports=ports,
        send=checker.sent(parts.send),
        per_second=_PER_SECOND[parts.time],
        units=tuple((name, one.unit.value) for name, one in parts.parameters.items() if one.unit is not None),
        sign=checker.sign(parts.sign, defaults),
        fires=spike is not None,
        shared=parts.shared,
        softmax=parts.softmax,
    )
    checker.no_spikes(definition)
    checker.sharing(definition)
    return Defined(definition, defaults)


def sorted_by_need(needs: Mapping[str, Collection[str]]) -> tuple[list[str], list[str]]:
    """Names, each with what it needs, in their order, but each behind those of them that it needs: of all that could
    come next the first. Where some need each other in a circle they stay in their order, and the circle is given, too:
    each needs the next, the last the first.

    >>> sorted_by_need({"a": "cx", "b": "", "c": "b"}), sorted_by_need({"a": "", "b": "cb", "c": "b"})[1]
    ((['b', 'c', 'a'], []), ['b'])
    """
    known = [*needs]
    place = {name: number for number, name in enumerate(known)}
    sorter = TopologicalSorter(
        {name: sorted(place.keys() & set(need), key=place.__getitem__) for name, need in needs.items()}
    )
    try:
        sorter.prepare()
    except CycleError as error:
        circle = error.args[1][:0:-1]
        first = circle.index(min(circle, key=place.__getitem__))
        return known, [*circle[first:], *circle[:first]]
    order: list[str] = []
    ready: list[int] = []
    while sorter.is_active():
        for name in sorter.get_ready():
            heappush(ready, place[name])
        order.append(known[heappop(ready)])
        sorter.done(order[-1])
    return order, []


def define(library: Library, findings: Findings, builtin: Definitions, around: Around = NOTHING_AROUND) -> Definitions:
    """The definitions of a file. Who replaces a built-in one is warned, unless that is one of ``LATER``, or a
    synapse."""
    for reading in (one for one in _READINGS if one.kind != SYNAPSE):
        node, replaced = library.source.get(reading.kind.section), builtin.of(reading.kind).known()
        for entry in node.entries if isinstance(node, SourceMapping) else ():
            if entry.name in replaced and entry.name not in LATER.get(reading.kind, ()):
                message = f"'{entry.name}' replaces the built-in of that name"
                findings.warning("replaces-builtin", entry.key.span, message)
    return Definitions({reading.kind: _defined(reading, library, findings, around) for reading in _READINGS})


def _defined(reading: Reading, library: Library, findings: Findings, around: Around) -> Names[Defined]:
    """The definitions of a section. One of which it is not known which parameters and signals it has is UNKNOWN."""
    section = reading.kind.section
    models = library.definitions[section]
    made = {name: definition_of(reading, name, model, findings, around) for name, model in models.items()}
    sure = {name: made[name] if model.unknown.isdisjoint(_NAMED) else UNKNOWN for name, model in models.items()}
    return names_of(library, section, sure)
