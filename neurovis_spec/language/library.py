"""Definitions: activations, models, rules and synapses of one's own, and the file that holds them.

In: nodes. Out: frozen models whose leaves know their places.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping as AnyMapping
from types import MappingProxyType
from typing import Annotated, ClassVar, Final, Literal, NamedTuple, TypeAlias, cast

from pydantic import Field, ValidationInfo

from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.grammar import (
    IN_ACTIVATION,
    IN_CENTRE,
    IN_MODEL,
    IN_RULE,
    IN_SIGN,
    IN_SYNAPSE,
    PLAIN,
    WITHOUT_F,
    Needs,
    NotWith,
    OneOf,
    Plain,
    declaring,
    naming,
)
from neurovis_spec.language.keys import Keys
from neurovis_spec.language.located import (
    BoolField,
    Formula,
    FormulaField,
    Leaf,
    Located,
    TextField,
    TextsField,
    TimeField,
    as_integer,
    findings_of,
    give_up,
    refuse,
    value_or,
    words,
)
from neurovis_spec.language.model import Model, Named
from neurovis_spec.language.unknown import Unknown
from neurovis_spec.language.values import LOCAL, ParameterField, ParameterModel, PortsField, WrittenPort, put_in_unit
from neurovis_spec.language.words import TimeUnit
from neurovis_spec.language.yaml.source import Node, Scalar

LANGUAGE_VERSION = 1
VERSION = Plain({"const": LANGUAGE_VERSION})
_TIMES: Final = {"s": "Seconds.", "ms": "Milliseconds."}
#: How other languages call the derivative of a state.
_CHANGES: Final = dict.fromkeys(("ode", "dot", "flow", "equation", "rate"), "derivative")


def version_field(node: Node, info: ValidationInfo) -> Located[int]:
    """The version of the language, which must be the one that this program reads."""
    if isinstance(node, Scalar) and isinstance(node.value, (str, bool)):
        refuse(info, node, "the version of the language", f"write neurovis: {LANGUAGE_VERSION}")
    version = as_integer(node, info)
    if version.value != LANGUAGE_VERSION:
        message = f"this is written in version {version.value:g} of the language; this program reads version 1"
        findings_of(info).error("language-version", node.span, message, "write neurovis: 1")
        give_up()
    return version


class Flow(NamedTuple):
    """What is written of a state beside what becomes of it at each step. ``acts`` are what spikes do to it, by their
    phases, as the program calls them: ``jump``, ``on_pre``, ``on_post``."""

    derivative: Formula | None = None
    noise: Formula | None = None
    unit: str = ""
    acts: AnyMapping[Act, Formula] = MappingProxyType({})


#: What spikes do to something, a key.
Act: TypeAlias = Literal["jump", "on_pre", "on_post"]


def _acts(**written: Formula | None) -> AnyMapping[Act, Formula]:
    return {cast(Act, name): formula for name, formula in written.items() if formula is not None}


_ON_PRE: Final = "Its new value when a spike arrives."
_ON_POST: Final = "Its new value when the target fires."
_DERIVATIVE: Final = "What it changes by, per second (or millisecond: time): what an equation has behind dx/dt."
#: What a rule changes step by step it does not change within a step.
_WITHOUT_STEPS: Final = NotWith(
    ("each_step",),
    "'{own}' beside '{other}': a rule changes something within a step or from step to step",
    "keep '{other}' or '{own}'; with x + dt*(…) as '{other}' it is Euler's method",
)


class StateModel(Model):
    """A state: what those of models, rules and synapses have in common."""

    BARE: ClassVar[str] = "initial"
    ELSEWHERE: ClassVar[AnyMapping[str, str]] = _CHANGES

    initial: Annotated[FormulaField, PLAIN] | None = Field(None, description="Its value before step 0 (default 0).")
    each_step: FormulaField | None = Field(None, description="Its new value at each step.")
    each_episode: FormulaField | None = Field(None, description="Its new value at an episode's end.")
    derivative: FormulaField | None = Field(None, description=_DERIVATIVE)
    unit: TextField | None = Field(None, description="Its unit, which is shown; formulas are checked by it.")

    @property
    def flow(self) -> Flow:
        """How it changes over the time of a step."""
        return Flow(self.derivative, unit=value_or(self.unit, ""))

    @classmethod
    def _keys(cls, keys: Keys, findings: Findings) -> dict[str, object]:
        """What is written with a unit is a number in that of the state."""
        result = super()._keys(keys, findings)
        put_in_unit(result, ("initial",), findings)
        return result

    @classmethod
    def _foreign(cls, name: str) -> tuple[str, str] | None:
        if name in ("noise", "jump"):
            return f"'{name}' is of the states of models alone", "leave it out"
        return _elsewhere(name)


class RuleStateModel(StateModel):
    """A state of a rule."""

    on_pre: FormulaField | None = Field(None, description=_ON_PRE)
    on_post: FormulaField | None = Field(None, description=_ON_POST)
    derivative: Annotated[FormulaField | None, _WITHOUT_STEPS] = Field(None, description=_DERIVATIVE)

    @property
    def flow(self) -> Flow:
        """How it changes over the time of a step, and at spikes."""
        return super().flow._replace(acts=_acts(on_pre=self.on_pre, on_post=self.on_post))


class SynapseStateModel(StateModel):
    """A state of a synapse."""

    on_pre: FormulaField | None = Field(None, description=_ON_PRE)

    @property
    def flow(self) -> Flow:
        """How it changes over the time of a step, and at spikes."""
        return super().flow._replace(acts=_acts(on_pre=self.on_pre))

    @classmethod
    def _foreign(cls, name: str) -> tuple[str, str] | None:
        if name == "on_post":
            return "'on_post' is of rules: a synapse does not learn", "make a rule of it, with plasticity: …"
        return super()._foreign(name)


class NeuronStateModel(StateModel):
    """A state of a model."""

    ELSEWHERE: ClassVar[AnyMapping[str, str]] = {**_CHANGES, **dict.fromkeys(("sigma", "diffusion"), "noise")}

    each_episode: Annotated[FormulaField, WITHOUT_F] | None = Field(
        None, description="Its new value at an episode's end."
    )
    noise: Annotated[
        Annotated[FormulaField, WITHOUT_F] | None,
        Needs(("derivative",), "'noise' disturbs what has a 'derivative'", "add derivative: 0, or what it changes by"),
    ] = Field(None, description="What white noise is multiplied by that is added to the derivative.")

    jump: FormulaField | None = Field(
        None, description="What is added when spikes arrive: an expression in which each port is multiplied once."
    )

    @property
    def flow(self) -> Flow:
        """How it changes over the time of a step, and at spikes."""
        return super().flow._replace(noise=self.noise, acts=_acts(jump=self.jump))

    @classmethod
    def _foreign(cls, name: str) -> tuple[str, str] | None:
        return _elsewhere(name)


def _elsewhere(name: str) -> tuple[str, str] | None:
    """What is said of a key of spikes that is of states of something else."""
    if name in ("on_pre", "on_post"):
        return f"'{name}' is of synapses and rules", "in a model, what arriving spikes add is jump: PORT"
    if name in ("refractory", "when", "set", "hold"):
        return f"'{name}' is of the spike, not of a state", "write spike: {when: …, set: {…}} beside 'state'"
    return None


class Parts(NamedTuple):
    """What a definition says, whatever its kind: what it gives at each step and at an episode's end, or changes by over
    the time of a step, and of what that is made. ``gives`` is how that is called where it is not as in all definitions
    of the kind, ``state`` and ``outputs`` are None where the kind has none."""

    parameters: AnyMapping[str, ParameterModel]
    let: AnyMapping[str, Formula]
    each_step: Formula | None
    each_episode: Formula | None = None
    derivative: Formula | None = None
    gives: str = ""
    acts: AnyMapping[Act, Formula] = MappingProxyType({})
    state: AnyMapping[str, StateModel] | None = None
    signals: tuple[Located[str], ...] = ()
    spikes: bool = False
    ports: tuple[WrittenPort, ...] = ()
    outputs: AnyMapping[str, Formula] | None = None
    send: Located[str] | None = None
    time: TimeUnit = "s"
    sign: Formula | None = None
    spike: SpikeModel | None = None
    #: whether its states are those of all connections of an entry to the same target
    shared: bool = False
    #: of an activation whether a group shares 1 by it
    softmax: bool = False

    @property
    def units(self) -> AnyMapping[str, str]:
        """The units that are declared, by the names of what has them."""
        found = {name: parameter.measure for name, parameter in self.parameters.items()}
        found |= {name: state.flow.unit for name, state in (self.state or {}).items()}
        found |= {port.name.value: port.unit for port in self.ports}
        return {name: unit for name, unit in found.items() if unit}


class DefinitionModel(Model):
    """A definition of one's own, of any kind."""

    @abstractmethod
    def parts(self) -> Parts:
        """What it says."""


class ActivationModel(DefinitionModel):
    """An activation function of one's own."""

    BARE: ClassVar[str] = "value"

    parameters: Annotated[Named[ParameterField], LOCAL] = Field(default_factory=dict, description="Names and defaults.")
    let: Annotated[Named[Annotated[FormulaField, IN_ACTIVATION]], LOCAL] = Field(
        default_factory=dict, description="Intermediate values; one may read others."
    )
    value: Annotated[FormulaField, IN_ACTIVATION] = Field(
        description="An expression of x, the combined input, and the parameters."
    )
    softmax: BoolField | None = Field(
        None,
        description="Whether exp(value) is divided by the sum of these of all neurons of the group (default false).",
    )
    description: TextField | None = Field(None, description="What it is, its equation and its source.")

    def parts(self) -> Parts:
        """What it says."""
        return Parts(self.parameters, self.let, self.value, softmax=value_or(self.softmax, False))


class TimedModel(DefinitionModel):
    """A definition that may have derivatives."""

    time: Annotated[Located[TimeUnit], words(TimeUnit, abouts=_TIMES)] | None = Field(
        None, description="The unit of t, dt and derivatives in it: s or ms (default s)."
    )

    @property
    def unit_of_time(self) -> TimeUnit:
        """The unit of t, dt and derivatives in it."""
        return value_or(self.time, "s")


class SpikeModel(Model):
    """When a neuron fires, and what becomes of its states then."""

    BARE: ClassVar[str] = "when"
    ELSEWHERE: ClassVar[AnyMapping[str, str]] = {
        **dict.fromkeys(("threshold", "if", "condition"), "when"),
        **dict.fromkeys(("reset", "resets", "then", "do"), "set"),
        **dict.fromkeys(("refractory_period", "t_ref", "tau_ref", "dead_time"), "refractory"),
        **dict.fromkeys(("clamp", "freeze", "held"), "hold"),
    }

    when: FormulaField = Field(description="It fires where this is true, as v >= threshold.")
    set: Annotated[Named[Annotated[FormulaField, IN_MODEL]], naming("local")] = Field(
        default_factory=dict, description="New values of states, all from old ones."
    )
    refractory: TimeField | None = Field(
        None, description="How long it cannot fire again: an expression in its unit of time, or a time such as 5 ms."
    )
    hold: Annotated[
        TextsField,
        naming("local"),
        Needs(("refractory",), "'hold' is for as long as 'refractory' says", "add refractory: 2 ms, or remove it"),
    ] = Field(default=(), description="States that stay as they are for so long.")


class ModelModel(TimedModel):
    """A neuron model of one's own: how the activity follows from the drive."""

    ONE_OF: ClassVar[OneOf | None] = OneOf(
        ("activity", "spike"),
        "the key 'activity' is missing",
        "add activity: …, an expression of drive and the states; or spike: {when: …}, which it is then",
    )

    parameters: Annotated[Named[ParameterField], LOCAL] = Field(default_factory=dict, description="Names and defaults.")
    ports: Annotated[PortsField, LOCAL] = Field(
        default=(), description="Names of inputs beside drive, or how what arrives at each is combined."
    )
    let: Annotated[Named[Annotated[FormulaField, IN_MODEL]], LOCAL] = Field(
        default_factory=dict, description="Intermediate values; one may read others."
    )
    state: Annotated[Named[Annotated[NeuronStateModel, IN_MODEL]], LOCAL] = Field(
        default_factory=dict, description="States, updated together from old values."
    )
    outputs: Annotated[Named[Annotated[FormulaField, IN_MODEL]], LOCAL] = Field(
        default_factory=dict, description="Further values that can be sent, shown and recorded, as states can."
    )
    spike: Annotated[SpikeModel, IN_MODEL] | None = Field(
        None, description="When it fires, and what becomes of its states then."
    )
    activity: Annotated[FormulaField, IN_MODEL] | None = Field(
        None,
        description="The activity; f(…) is the neuron's activation, drive is u[t] (default spike, where it has one).",
    )
    send: Annotated[TextField | None, naming("local")] = Field(
        None, description="The state or output that connections take unless they say otherwise (default activity)."
    )
    spikes: BoolField | None = Field(
        None,
        description="Whether its activity is a spike, of one step, or silence; pictures show a trace (default false).",
    )
    description: TextField | None = Field(None, description="What it is, its equation and its source.")

    def parts(self) -> Parts:
        """What it says."""
        return Parts(
            self.parameters,
            self.let,
            self.activity,
            state=self.state,
            spikes=value_or(self.spikes, False),
            ports=self.ports,
            outputs=self.outputs,
            send=self.send,
            time=self.unit_of_time,
            spike=self.spike,
        )


class ChangeModel(Model):
    """How a rule changes what it changes: the weight, or the centre."""

    ELSEWHERE: ClassVar[AnyMapping[str, str]] = _CHANGES

    on_pre: Annotated[FormulaField, IN_RULE] | None = None
    on_post: Annotated[FormulaField, IN_RULE] | None = None
    each_step: Annotated[FormulaField, IN_RULE] | None = None
    each_episode: Annotated[FormulaField, IN_RULE] | None = None
    derivative: Annotated[Annotated[FormulaField, IN_RULE] | None, _WITHOUT_STEPS] = None

    @property
    def acts(self) -> AnyMapping[Act, Formula]:
        """What spikes make of it."""
        return _acts(on_pre=self.on_pre, on_post=self.on_post)


_NO_CHANGE: Final = "a rule says how the weight changes: add weight: {each_step: …}, or {each_episode: …}"


def _one_change(what: str) -> OneOf:
    return OneOf(
        ("each_step", "each_episode", "derivative", "on_pre", "on_post"),
        f"a rule changes the {what} in 'each_step' or in 'each_episode', or says its 'derivative'",
        f"for spikes write on_pre: … or on_post: …, the {what} when one arrives, or when the target fires",
    )


class WeightModel(ChangeModel):
    """How a rule changes the weight."""

    ONE_OF: ClassVar[OneOf | None] = _one_change("weight")

    on_pre: Annotated[FormulaField, IN_RULE] | None = Field(None, description=_ON_PRE)
    on_post: Annotated[FormulaField, IN_RULE] | None = Field(None, description=_ON_POST)
    each_step: Annotated[FormulaField, IN_RULE] | None = Field(
        None, description="w[t+1], an expression of weight, pre, post, …."
    )
    each_episode: Annotated[FormulaField, IN_RULE] | None = Field(None, description="The weight after an episode.")
    derivative: Annotated[Annotated[FormulaField, IN_RULE] | None, _WITHOUT_STEPS] = Field(
        None, description="What the weight changes by, per second (or millisecond: time)."
    )


class CentreModel(ChangeModel):
    """How a rule changes the centre, which targets that combine by distance compare what arrives with."""

    ONE_OF: ClassVar[OneOf | None] = _one_change("centre")

    on_pre: Annotated[FormulaField, IN_CENTRE] | None = Field(None, description=_ON_PRE)
    on_post: Annotated[FormulaField, IN_CENTRE] | None = Field(None, description=_ON_POST)
    each_step: Annotated[FormulaField, IN_CENTRE] | None = Field(
        None, description="The centre after a step, an expression of centre, pre, post, …."
    )
    each_episode: Annotated[FormulaField, IN_CENTRE] | None = Field(None, description="The centre after an episode.")
    derivative: Annotated[Annotated[FormulaField, IN_CENTRE] | None, _WITHOUT_STEPS] = Field(
        None, description="What the centre changes by, per second (or millisecond: time)."
    )


class RuleModel(TimedModel):
    """A plasticity rule of one's own."""

    ONE_OF: ClassVar[OneOf | None] = OneOf(("weight", "centre"), "the key 'weight' is missing", _NO_CHANGE)

    parameters: Annotated[Named[ParameterField], LOCAL] = Field(default_factory=dict, description="Names and defaults.")
    signals: Annotated[TextsField, LOCAL] = Field(
        default=(), description="Names of signals that the connection must supply."
    )
    let: Annotated[Named[Annotated[FormulaField, IN_RULE]], LOCAL] = Field(
        default_factory=dict, description="Intermediate values; one may read others."
    )
    state: Annotated[Named[Annotated[RuleStateModel, IN_RULE]], LOCAL] = Field(
        default_factory=dict, description="States, one for each connection."
    )
    weight: WeightModel | None = Field(None, description="How the weight changes; a rule has this or centre.")
    centre: Annotated[
        CentreModel | None,
        NotWith(("weight",), "'{own}' beside '{other}': a rule changes one of the two", "make two rules of it"),
    ] = Field(None, description="How the centre changes, in place of the weight, where targets combine by distance.")
    description: TextField | None = Field(None, description="What it is, its equation and its source.")

    @property
    def change(self) -> ChangeModel | None:
        """How what it changes changes."""
        return self.centre if self.weight is None else self.weight

    def parts(self) -> Parts:
        """What it says."""
        change = self.change
        return Parts(
            self.parameters,
            self.let,
            None if change is None else change.each_step,
            None if change is None else change.each_episode,
            None if change is None else change.derivative,
            "centre" if isinstance(change, CentreModel) else "",
            {} if change is None else change.acts,
            state=self.state,
            signals=self.signals,
            time=self.unit_of_time,
        )


class SynapseModel(TimedModel):
    """A synapse of one's own: what a connection brings to its port."""

    BARE: ClassVar[str] = "signal"
    ELSEWHERE: ClassVar[AnyMapping[str, str]] = {
        **dict.fromkeys(("output", "current", "value", "equation", "psc"), "signal"),
        **dict.fromkeys(("states", "variables"), "state"),
    }

    parameters: Annotated[Named[ParameterField], LOCAL] = Field(default_factory=dict, description="Names and defaults.")
    let: Annotated[Named[Annotated[FormulaField, IN_SYNAPSE]], LOCAL] = Field(
        default_factory=dict, description="Intermediate values; one may read others."
    )
    state: Annotated[Named[Annotated[SynapseStateModel, IN_SYNAPSE]], LOCAL] = Field(
        default_factory=dict, description="States, one for each connection."
    )
    signal: Annotated[FormulaField, IN_SYNAPSE] = Field(
        description="What arrives at the port, an expression of weight, pre, post, pre.X, post.X, …."
    )
    sign: Annotated[FormulaField, IN_SIGN] | None = Field(
        None, description="How its line ends: above 0 in an arrow, below 0 in a bar, at 0 in nothing (default weight)."
    )
    shared: BoolField | None = Field(
        None,
        description="Whether all connections of an entry to the same target have its states together (default false).",
    )
    description: TextField | None = Field(None, description="What it is, its equation and its source.")

    def parts(self) -> Parts:
        """What it says."""
        return Parts(
            self.parameters,
            self.let,
            self.signal,
            state=self.state,
            time=self.unit_of_time,
            sign=self.sign,
            shared=value_or(self.shared, False),
        )

    @classmethod
    def _foreign(cls, name: str) -> tuple[str, str] | None:
        if name == "ports":
            return "'ports' are of models; the connection says to which its synapse goes", "write port: … there"
        if name in ("spike", "on_pre"):
            return f"'{name}' is no key of a synapse", "write on_pre: … at a state, what becomes of it at a spike"
        return None


class Library(Model):
    """A file of definitions, as the built-in ones ship."""

    neurovis: Annotated[Located[int | Unknown], Leaf(version_field, VERSION, True)] = Field(
        description="The version of the language: 1."
    )
    title: TextsField | None = Field(None, description="A title.")
    description: TextsField | None = Field(None, description="What this is.")
    activations: Annotated[Named[ActivationModel], declaring("activation")] = Field(
        default_factory=dict, description="Activation functions of one's own."
    )
    models: Annotated[Named[ModelModel], declaring("model")] = Field(
        default_factory=dict, description="Neuron models of one's own."
    )
    rules: Annotated[Named[RuleModel], declaring("rule")] = Field(
        default_factory=dict, description="Plasticity rules of one's own."
    )
    synapses: Annotated[Named[SynapseModel], declaring("synapse")] = Field(
        default_factory=dict, description="Synapses of one's own: what connections bring to their ports."
    )

    @property
    def definitions(self) -> AnyMapping[str, AnyMapping[str, DefinitionModel]]:
        """All definitions, by section and name."""
        return {
            "activations": self.activations,
            "models": self.models,
            "rules": self.rules,
            "synapses": self.synapses,
        }
