"""Definitions: activations, models and rules of one's own, and the file that holds them.

In: nodes. Out: frozen models whose leaves know their places.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping as AnyMapping
from typing import Annotated, ClassVar, Final, NamedTuple

from pydantic import Field, ValidationInfo

from neurovis_spec.language.grammar import (
    IN_ACTIVATION,
    IN_MODEL,
    IN_RULE,
    PLAIN,
    WITHOUT_F,
    Needs,
    OneOf,
    Plain,
    declaring,
    naming,
)
from neurovis_spec.language.located import (
    BoolField,
    Formula,
    FormulaField,
    Leaf,
    Located,
    TextField,
    TextsField,
    as_integer,
    findings_of,
    give_up,
    refuse,
    value_or,
    words,
)
from neurovis_spec.language.model import Model, Named
from neurovis_spec.language.unknown import Unknown
from neurovis_spec.language.values import LOCAL, ParameterField, ParameterModel, PortsField, WrittenPort
from neurovis_spec.language.words import TimeUnit
from neurovis_spec.language.yaml.source import Mapping, Node, Scalar

LANGUAGE_VERSION = 1
VERSION = Plain({"const": LANGUAGE_VERSION})
_TIMES: Final = {"s": "Seconds.", "ms": "Milliseconds."}


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
    """What is written of a state beside what becomes of it at each step: nothing, of a rule."""

    derivative: Formula | None = None
    noise: Formula | None = None
    unit: str = ""


class StateModel(Model):
    """A state: of a rule, and what states of models have in common with that."""

    BARE: ClassVar[str] = "initial"

    initial: Annotated[FormulaField, PLAIN] | None = Field(None, description="Its value before step 0 (default 0).")
    each_step: FormulaField | None = Field(None, description="Its new value at each step.")
    each_episode: FormulaField | None = Field(None, description="Its new value at an episode's end.")

    @property
    def flow(self) -> Flow:
        """How it changes over the time of a step."""
        return Flow()

    @classmethod
    def _foreign(cls, name: str) -> tuple[str, str] | None:
        if name == "derivative":
            return "rules have no 'derivative' yet, models have", "write each_step: x + dt*(…), x being the state"
        return not_yet(name, "on_pre", "on_post", "unit")


class NeuronStateModel(StateModel):
    """A state of a model."""

    ELSEWHERE: ClassVar[AnyMapping[str, str]] = {
        **dict.fromkeys(("ode", "dot", "flow", "equation", "rate"), "derivative"),
        **dict.fromkeys(("sigma", "diffusion"), "noise"),
    }

    each_episode: Annotated[FormulaField, WITHOUT_F] | None = Field(
        None, description="Its new value at an episode's end."
    )
    derivative: FormulaField | None = Field(
        None, description="What it changes by, per second (or millisecond: time): what an equation has behind dx/dt."
    )
    noise: Annotated[
        Annotated[FormulaField, WITHOUT_F] | None,
        Needs(("derivative",), "'noise' disturbs what has a 'derivative'", "add derivative: 0, or what it changes by"),
    ] = Field(None, description="What white noise is multiplied by that is added to the derivative.")
    unit: TextField | None = Field(None, description="Its unit, which is shown.")

    @property
    def flow(self) -> Flow:
        """How it changes over the time of a step."""
        return Flow(self.derivative, self.noise, value_or(self.unit, ""))

    @classmethod
    def _foreign(cls, name: str) -> tuple[str, str] | None:
        return not_yet(name, "jump")


def not_yet(name: str, *later: str) -> tuple[str, str] | None:
    """What is said of a key that the language is to have, if it is one of ``later``: a message and a hint."""
    return (f"'{name}' is not there yet", "a later version of the language has it") if name in later else None


class Parts(NamedTuple):
    """What a definition says, whatever its kind: what it gives at each step and at an episode's end, and of what that
    is made. ``state`` and ``outputs`` are None where the kind has none."""

    parameters: AnyMapping[str, ParameterModel]
    let: AnyMapping[str, Formula]
    each_step: Formula | None
    each_episode: Formula | None = None
    state: AnyMapping[str, StateModel] | None = None
    signals: tuple[Located[str], ...] = ()
    spikes: bool = False
    ports: tuple[WrittenPort, ...] = ()
    outputs: AnyMapping[str, Formula] | None = None
    send: Located[str] | None = None
    time: TimeUnit = "s"


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
    description: TextField | None = Field(None, description="What it is, its equation and its source.")

    def parts(self) -> Parts:
        """What it says."""
        return Parts(self.parameters, self.let, self.value)


class ModelModel(DefinitionModel):
    """A neuron model of one's own: how the activity follows from the drive."""

    time: Annotated[Located[TimeUnit], words(TimeUnit, abouts=_TIMES)] | None = Field(
        None, description="The unit of t, dt and derivatives in it: s or ms (default s)."
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
    activity: Annotated[FormulaField, IN_MODEL] = Field(
        description="The activity; f(…) is the neuron's activation, drive is u[t]."
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
            time=value_or(self.time, "s"),
        )

    @classmethod
    def _foreign(cls, name: str) -> tuple[str, str] | None:
        return not_yet(name, "spike")


class WeightModel(Model):
    """How a rule changes the weight."""

    ONE_OF: ClassVar[OneOf | None] = OneOf(
        ("each_step", "each_episode"), "a rule changes the weight in 'each_step' or in 'each_episode'"
    )

    each_step: Annotated[FormulaField, IN_RULE] | None = Field(
        None, description="w[t+1], an expression of weight, pre, post, …."
    )
    each_episode: Annotated[FormulaField, IN_RULE] | None = Field(None, description="The weight after an episode.")

    @classmethod
    def _foreign(cls, name: str) -> tuple[str, str] | None:
        return not_yet(name, "on_pre", "on_post", "derivative")


class RuleModel(DefinitionModel):
    """A plasticity rule of one's own."""

    parameters: Annotated[Named[ParameterField], LOCAL] = Field(default_factory=dict, description="Names and defaults.")
    signals: Annotated[TextsField, LOCAL] = Field(
        default=(), description="Names of signals that the connection must supply."
    )
    let: Annotated[Named[Annotated[FormulaField, IN_RULE]], LOCAL] = Field(
        default_factory=dict, description="Intermediate values; one may read others."
    )
    state: Annotated[Named[Annotated[StateModel, IN_RULE]], LOCAL] = Field(
        default_factory=dict, description="States, one for each connection."
    )
    weight: WeightModel = Field(description="How the weight changes.")
    description: TextField | None = Field(None, description="What it is, its equation and its source.")

    def parts(self) -> Parts:
        """What it says."""
        weight = self.weight
        return Parts(self.parameters, self.let, weight.each_step, weight.each_episode, self.state, self.signals)

    @classmethod
    def _foreign(cls, name: str) -> tuple[str, str] | None:
        return not_yet(name, "time")

    @classmethod
    def _without(cls, name: str, data: Mapping) -> str:
        return "a rule says how the weight changes: add weight: {each_step: …}, or {each_episode: …}"


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

    @classmethod
    def _foreign(cls, name: str) -> tuple[str, str] | None:
        return not_yet(name, "synapses")

    @property
    def definitions(self) -> AnyMapping[str, AnyMapping[str, DefinitionModel]]:
        """All definitions, by section and name."""
        return {"activations": self.activations, "models": self.models, "rules": self.rules}
