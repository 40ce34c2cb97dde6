"""The update program: what a step does, and by which definitions.

In: nothing; these are values of a Network. A Definition is a set of typed expressions, of one Kind; populations and
projections say for which neurons and connections which are in use; operations are what a step does, in order.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Final, Literal, NamedTuple, TypeAlias

from neurovis_spec.arrays import FloatArray, Indices, IntArray
from neurovis_spec.language.expressions.tree import Call, Chain, Name, Number, Tree, names, walk
from neurovis_spec.language.words import Combine, Method

_ZERO = Number(0.0)
#: What of a definition is carried out together: what each step changes, derivatives of what it gives among it, and an
#: episode's end.
Phase: TypeAlias = Literal["on_pre", "on_post", "jump", "fire", "settle", "jump_now", "each_step", "each_episode"]
PHASES: Final[tuple[Phase, ...]] = ("each_step", "each_episode")
#: The state of a model with a spike block that is 1 in the step in which the neuron fires, else 0.
SPIKE: Final = "spike"
#: Of synapses and rules: what a spike changes that arrives, or that the target has fired, before ``PHASES``; what is
#: read of an end to know that.
AT_SPIKE: Final[Mapping[Phase, str]] = MappingProxyType({"on_pre": f"pre.{SPIKE}", "on_post": f"post.{SPIKE}"})


@dataclass(frozen=True, slots=True)
class Quantity:
    """A number that a definition keeps or gives, and what it becomes: its value at each step and at an episode's end;
    where there is no such expression, it stays. ``initial`` is what a state begins with.

    A state with a ``derivative`` *flows*: it is integrated over a step, before its ``each_step``. ``noise`` is what a
    standard normal number is multiplied by to disturb it, per square root of the time (dx = derivative dt + noise dW).
    Both are per second or millisecond, as their definition says."""

    name: str
    each_step: Tree | None = None
    each_episode: Tree | None = None
    initial: Tree = _ZERO
    derivative: Tree | None = None
    noise: Tree | None = None
    #: as it is written, to be shown
    unit: str = ""
    #: its values in phases that few definitions have, beside ``each_step`` and ``each_episode``
    acts: tuple[tuple[Phase, Tree], ...] = ()

    def during(self, phases: Collection[Phase]) -> Quantity:
        """The same with what becomes of it in these phases: those of a step, or one of ``acts`` as its ``each_step``,
        perhaps with the episode's end."""
        one = self if "each_step" in phases else replace(self, each_step=None, derivative=None)
        for phase, tree in self.acts:
            if phase in phases:
                one = replace(one, each_step=tree)
        return replace(one, acts=(), each_episode=self.each_episode if "each_episode" in phases else None)

    def has(self, phase: Phase) -> bool:
        """Whether anything becomes of it in a phase."""
        if phase == "each_step":
            return self.each_step is not None
        return self.each_episode is not None if phase == "each_episode" else phase in dict(self.acts)

    @property
    def stepped(self) -> bool:
        """Whether anything changes it once a step, or at some."""
        return bool(self.each_step or self.each_episode or self.acts)


@dataclass(frozen=True, slots=True)
class Hidden(Quantity):
    """A state of ours, which no author names or sees: of a spike block whether the neuron is armed, and how long it
    rests."""


@dataclass(frozen=True, slots=True)
class Check(Hidden):
    """A state of ours, which nothing reads: an infinity after a step in which something undefined was computed that no
    other number shows (``compiler/run_checks.py``), else 0. ``name`` says it: ``the model 'm' divides by 0``."""


#: What there is one of a state, or of a parameter, for.
Each: TypeAlias = Literal["neuron", "connection"]


@dataclass(frozen=True, slots=True)
class Kind:
    """What all definitions of a kind have in common. Its name is that of the owners of states and parameters, too."""

    name: str
    #: what there is one of its states and parameters for
    each: Each
    #: what it gives
    gives: str
    #: whether that is kept from step to step, so that it is seen by its name and replaced as a state is; else it is
    #: made anew from the new states
    lasting: bool = False
    #: whether it is a function of what is called ``x`` in it, for formulas of others
    function: bool = False
    #: the kind that it is a part of, as authors know it
    part_of: str = ""

    @property
    def noun(self) -> str:
        """What it is called in messages."""
        return self.part_of or self.name

    @property
    def section(self) -> str:
        """Where it is defined in a spec."""
        return f"{self.name}s"


#: ``f``, the value for ``x``, the combined input.
ACTIVATION = Kind("activation", "neuron", "f", function=True)
#: How the activity follows from ``drive`` (u[t]); ``f`` in it is the neuron's activation.
MODEL = Kind("model", "neuron", "activity")
#: How a weight changes, within its bounds, from pre, sent, post and signals.
RULE = Kind("rule", "connection", "weight", lasting=True)
#: What a connection brings to its ports, from its weight, what is known of both ends, and states of its own.
SYNAPSE = Kind("synapse", "connection", "signal")
#: What connections add to states of a shared synapse, of which there is one for all of an entry at a target.
FEED = Kind("feed", "connection", "added", lasting=True, part_of=SYNAPSE.name)
#: Of what makes synapses.
JOINING: Final = (SYNAPSE, FEED)

#: The function of an activation that says whether it is undefined for an argument.
UNDEFINED_F = "f is undefined"
#: The function of an activation that is its derivative.
SLOPE_F = "slope of f"
#: The port that all neurons have.
DRIVE = "drive"
#: What a rule may change in place of a weight.
CENTRE = "centre"


class EndName(NamedTuple):
    """What a formula of a connection reads of an end, ``pre.v``: the activity, a state, an output or a parameter of the
    model there."""

    side: Literal["pre", "post"]
    name: str

    @property
    def text(self) -> str:
        """As it is written in formulas, and called in trees."""
        return f"{self.side}.{self.name}"


class PortOf(NamedTuple):
    """A port that a model declares, beside ``drive``."""

    name: str
    combine: Combine = "sum"
    #: as it is written, to be shown
    unit: str = ""


@dataclass(frozen=True, slots=True)
class Definition:
    """How numbers follow from others. All expressions see the clock, the parameters, the states, ``let``, the signals
    and what its kind is given; ``let`` in order."""

    kind: Kind
    name: str
    parameters: tuple[str, ...]
    #: what it gives; the first is what its kind gives, the others are further outputs of a model
    gives: tuple[Quantity, ...]
    let: tuple[tuple[str, Tree], ...] = ()
    state: tuple[Quantity, ...] = ()
    signals: tuple[str, ...] = ()
    #: of a model whether its activity, of a step as the activation where it depends on one, is a spike or nothing
    spikes: bool = False
    #: of a model its inputs beside ``drive``
    ports: tuple[PortOf, ...] = ()
    #: of a model which state or output connections take unless they say otherwise; "" is the activity
    send: str = ""
    #: how many of its unit of time a second has: 1, or 1000 where ``time: ms``; ``t`` and ``dt`` are in that unit in it
    per_second: float = 1.0
    #: the units of parameters that have one, as they are written, to be shown
    units: tuple[tuple[str, str], ...] = ()
    #: of a synapse what says how its line ends: above 0 in an arrow, below 0 in a bar, at 0 in nothing; None: as its
    #: weight does
    sign: Tree | None = None
    #: of a model whether it has a spike block: a state SPIKE, and the phases "fire" and "settle"
    fires: bool = False
    #: of a synapse whether all connections of an entry that lead to the same target have its states together
    shared: bool = False
    #: of an activation whether the neurons of a group share 1: exp(f(x)), divided by the sum of these
    softmax: bool = False

    def during(self, phases: Collection[Phase]) -> Definition:
        """The same with what is carried out of it in these phases."""
        if set(phases) == set(PHASES) and not self.acts:
            return self
        lasting = self.kind.lasting
        gives = tuple(one.during(phases) for one in self.gives) if lasting else self.gives
        return replace(self, gives=gives, state=tuple(one.during(phases) for one in self.state))

    @property
    def acts(self) -> frozenset[Phase]:
        """The phases beside those of every step in which anything becomes of what it keeps or gives."""
        return frozenset(phase for one in (*self.gives, *self.state) for phase, _ in one.acts)

    def has(self, phase: Phase) -> bool:
        """Whether anything that lasts changes in a phase."""
        return any(one.has(phase) for one in self.lasting)

    @property
    def at_update(self) -> Definition:
        """Of a model what its Update carries out, behind what is carried out in advance."""
        return self.during(("settle", "each_episode") if self.fires else PHASES)

    @property
    def outputs(self) -> tuple[Quantity, ...]:
        """What a model gives beside the activity. Like a state it is kept, for whoever reads it."""
        return self.gives[1:] if self.kind == MODEL else ()

    @property
    def kept(self) -> tuple[Quantity, ...]:
        """Whatever has a cell in ``State.cells``: states, then outputs, and the centre that a rule changes."""
        return (*self.state, *self.outputs, *(self.gives if self.moves_centre else ()))

    @property
    def holdable(self) -> tuple[Quantity, ...]:
        """What a clamp can hold: states, and the centre that a rule changes; no output, which is made anew."""
        own = (*self.state, *(self.gives if self.moves_centre else ()))
        return tuple(one for one in own if not isinstance(one, Hidden))

    @property
    def named(self) -> tuple[Quantity, ...]:
        """What of all that is kept authors have names for: all but states of ours."""
        return (*self.holdable, *self.outputs)

    @property
    def moves_centre(self) -> bool:
        """Whether it is a rule that changes the centre of a connection, in place of the weight."""
        return self.kind == RULE and self.given.name == CENTRE

    @property
    def flows(self) -> tuple[Quantity, ...]:
        """The states with a derivative."""
        return tuple(one for one in self.state if one.derivative is not None)

    @property
    def received(self) -> bool:
        """Of a synapse whether states of it are made once a step, or at an episode's end."""
        return any(one.each_step is not None or one.each_episode is not None for one in self.state)

    @property
    def given(self) -> Quantity:
        """What its kind gives."""
        return self.gives[0]

    @property
    def lasting(self) -> tuple[Quantity, ...]:
        """What lasts from step to step, and is replaced all at once, from old values."""
        return (*self.state, *self.gives) if self.kind.lasting else self.state

    @property
    def steps(self) -> Mapping[str, Tree | None]:
        """What becomes of all that lasts at a step, formulas by their names: what a rule changes by a derivative goes
        along that for the length of the step."""
        along = {
            one.name: Chain(("+",), (Name(one.name), Chain(("*",), (Name("dt"), one.derivative))))
            for one in self.lasting
            if one.derivative is not None and one in self.gives
        }
        return {one.name: one.each_step for one in self.lasting} | along

    @property
    def staying(self) -> frozenset[str]:
        """What of all that lasts stays as it is at the first step of all: of what has states with a derivative all of
        it, of a rule, whose steps are taken there, what a derivative changes."""
        if self.kind.lasting:
            return frozenset(one.name for one in self.gives if one.derivative is not None)
        return frozenset(one.name for one in self.lasting) if self.flows or self.fires else frozenset()

    @property
    def fleeting(self) -> tuple[Quantity, ...]:
        """What is made anew at each step, from the new states."""
        return () if self.kind.lasting else self.gives

    @property
    def functions(self) -> Mapping[str, Tree]:
        """What formulas of others may call, each an expression of x."""
        return {one.name: one.each_step for one in self.gives if one.each_step is not None}

    @property
    def formulas(self) -> Iterator[Tree]:
        """All that is computed in a run."""
        yield from (tree for _, tree in self.let)
        for one in (*self.state, *self.gives):
            parts = one.each_step, one.each_episode, one.derivative, one.noise
            yield from (tree for tree in parts if tree is not None)
            yield from (tree for _, tree in one.acts)

    @property
    def read(self) -> frozenset[str]:
        """All names that its formulas read in a run, and whether a spike has come, where that changes something."""
        return frozenset(AT_SPIKE[phase] for phase in self.acts & AT_SPIKE.keys()).union(*map(names, self.formulas))

    @property
    def end_names(self) -> tuple[EndName, ...]:
        """What it reads of the ends of a connection beside ``pre``, ``sent`` and ``post``, in the order of the
        texts."""
        shown = () if self.sign is None else names(self.sign)
        return tuple(
            EndName("pre" if side == "pre" else "post", name)
            for side, dot, name in (one.partition(".") for one in sorted({*self.read, *shown}))
            if dot and side in ("pre", "post")
        )

    @property
    def reads_activation(self) -> bool:
        """Whether any of its formulas depends on the neuron's activation."""
        return any(is_activation(node) for tree in self.formulas for node in walk(tree))


def ports_of(model: Definition) -> tuple[str, ...]:
    """The names of the ports of a model."""
    return DRIVE, *(port.name for port in model.ports)


def is_activation(node: Tree) -> bool:
    """Whether a node of a formula of a model is the neuron's activation of something."""
    return isinstance(node, Call) and node.function == "f"


class Owner(NamedTuple):
    """Whose states and parameters: those of the definition of a kind that is in use at the ``number``-th population or
    projection."""

    kind: str
    number: int


class Key(NamedTuple):
    """An array of numbers of a network: a parameter of an owner by its name, or what the network has one of, such as
    ``bias``."""

    owner: Owner | None
    name: str

    @property
    def text(self) -> str:
        """How it is called in what outlives a run: ``bias``, ``model/3/leak``, ``table/0``."""
        return "/".join((*map(str, self.owner or ()), *filter(None, [self.name])))


@dataclass(frozen=True, slots=True, eq=False)
class Use:
    """A definition in use; ``parameters`` have a value for each member."""

    owner: Owner
    definition: Definition
    parameters: Mapping[str, FloatArray]


@dataclass(frozen=True, slots=True, eq=False)
class Port:
    """An input of neurons: what arrives there is combined to one number. ``incoming`` are the connections that lead
    there, in the order of the connections, and ``slots`` says which member (its position) each of them goes to."""

    name: str
    combine: Combine
    incoming: Indices
    slots: Indices
    #: what each signal is multiplied by here (``port: {ampa: 1, nmda: 0.3}``); None where that is 1
    factors: FloatArray | None = None
    #: which of them are made anew at each stage of the integration, since what they bring flows: positions in
    #: ``incoming``; the others are held over a step
    staged: Indices | None = None
    #: which of them bring spikes of the same step that act behind all spikes of the step ("jump_now"), where the port
    #: holds these alone: positions in ``incoming``; None where there are none
    now: Indices | None = None

    @property
    def nothing(self) -> float:
        """What is there where nothing arrives."""
        return 1.0 if self.combine == "product" else 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Population:
    """Neurons that are updated together: the same activation, model, combination and level. ``members`` are neuron
    indices, ascending. ``stage`` is their level within a stage of the integration: behind all whose outputs reach
    theirs there."""

    level: int
    members: IntArray
    activation: Use
    model: Use
    ports: tuple[Port, ...]
    stage: int = 0
    #: where each group begins among the members, and behind the last one, where its neurons share 1 among each other
    shares: IntArray | None = None

    @property
    def uses(self) -> tuple[Use, ...]:
        """The definitions that its neurons are of."""
        return self.activation, self.model

    @property
    def drive(self) -> Port:
        """The port that all neurons have."""
        return self.ports[0]


@dataclass(frozen=True, slots=True, eq=False)
class Projection:
    """Connections of the same definition, a rule or a synapse, which is its only one in use; a connection is a member
    of one for its synapse, and of one for each of its rules.

    ``signals`` gives, for each signal of a rule, one index a connection into the activities of all neurons, followed by
    the outlets, followed by the vector of all inputs. ``ends`` gives the same for what is read of the ends, by the
    texts of ``EndName`` (``pre.v``), among activities and outlets: of the source d steps ago, of the target now. What
    is a parameter at an end is one of the definition here, by the same text."""

    members: IntArray
    uses: tuple[Use, ...]
    signals: Mapping[str, IntArray]
    ends: Mapping[str, IntArray] = field(default_factory=dict)
    #: of a rule its place among those of its connections
    place: int = 0
    #: the names of the states and outputs that are among its signals
    signal_names: frozenset[str] = frozenset()
    #: the name of an end (``pre.spike``, ``post.spike``) that must not be 0 of a connection for anything of it to be
    #: carried out; "" where all are
    when: str = ""
    #: of a synapse that spikes change whether its connections have no delay, so that they do behind all of the step
    at_once: bool = False
    #: of a FEED the number of the projection to whose states it adds, else −1; and to those of which of its members
    feeds: int = -1
    slots: IntArray | None = None

    @property
    def asks(self) -> frozenset[str]:
        """The names of the states and outputs of neurons that it reads."""
        return self.signal_names.union(text.partition(".")[2] for text in self.ends)

    @property
    def read(self) -> frozenset[str]:
        """All names that its definitions read in a run."""
        when = (self.when,) if self.when else ()
        return frozenset(when).union(*(use.definition.read for use in self.uses))

    def during(self, phases: Collection[Phase]) -> Projection:
        """The same with what of its definition is carried out in these phases."""
        made = self.use.definition.during(phases)
        if made is self.use.definition:
            return self
        when = next((end for phase, end in AT_SPIKE.items() if phase in phases), "")
        return replace(self, uses=(replace(self.use, definition=made),), when=when)

    @property
    def use(self) -> Use:
        """The definition that is in use."""
        return self.uses[0]

    @property
    def kind(self) -> Kind:
        """What its definition is."""
        return self.uses[0].definition.kind

    @property
    def rule(self) -> Use:
        """The rule by which the weights change."""
        return self.uses[0]


Holder: TypeAlias = Population | Projection


# The update program: operations in order. Each sees what those before it have made in the same step.


@dataclass(frozen=True, slots=True)
class Operation:
    """Something that a step does; each backend says how, type by type."""


@dataclass(frozen=True, slots=True)
class ReadInputs(Operation):
    """s[t]: expressions, tables and what the caller supplied, into the vector of all inputs."""


@dataclass(frozen=True, slots=True)
class Gather(Operation):
    """What each port of a population is: what arrives there, combined, + bias + input + noise. Delay 0 reads what is
    sent in this step, the rest the signals under way. ``now``: the spikes of ``Port.now`` alone, and nothing is
    added; else all but these."""

    population: int
    now: bool = False


@dataclass(frozen=True, slots=True)
class Update(Operation):
    """The states and the activity of a population, from its drive; at step 0 neurons with ``initial`` take it
    instead."""

    population: int


@dataclass(frozen=True, slots=True)
class Softmax(Operation):
    """The activities of a population, behind its Update: within each group exp(a), divided by the sum of these. A
    neuron that is held, or begins with its ``initial``, is what it is, and the others share the rest of 1."""

    population: int


@dataclass(frozen=True, slots=True)
class Advance(Operation):
    """What becomes of the states of a population in a phase before its Update, from old values, by its ports as they
    were gathered last: "jump", "each_step", "fire"; "jump_now" behind all spikes of the step. Nothing at step 0. A
    population with a spike block has "settle" in place of ``each_step`` in its Update."""

    population: int
    phase: Phase


@dataclass(frozen=True, slots=True)
class Integrate(Operation):
    """The flow states of these populations and projections, together, over a step from k − 1 to k; none at step 0. What
    does not flow is held. ``populations`` are in the order in which their outputs are made at a stage; ``projections``
    are those with flow states, of synapses and of rules."""

    populations: tuple[int, ...]
    method: Method
    substeps: int
    projections: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Diffuse(Operation):
    """The noise of the flow states of these populations, once a step, behind their integration: x += g·√dt·ξ (Itô,
    Euler-Maruyama), with g as it was at the step's beginning."""

    populations: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class SendAhead(Operation):
    """What connections take of a population, by its names, where it is made of flow states alone: behind their
    integration, for neurons that are updated before this population."""

    population: int
    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Send(Operation):
    """w[t]·a[t] of every delayed connection leaves its source; a[t] is remembered for ``pre``."""


@dataclass(frozen=True, slots=True)
class Receive(Operation):
    """What of the states of a synapse is made once a step, from old values: ``on_pre``, then ``each_step``, before the
    ports of its targets are made, ``each_episode`` when these are updated, so that the last signal of an episode is of
    before. Without delay ``on_pre`` is behind all updates."""

    projection: int
    phases: tuple[Phase, ...]


@dataclass(frozen=True, slots=True)
class Learn(Operation):
    """The rule of a projection, step and (where it has them) episode: w[t+1] and its states, from old values. Where
    connections have several rules, one phase of all of them comes before the next."""

    projection: int
    phases: tuple[Phase, ...] = PHASES


@dataclass(frozen=True, slots=True, eq=False)
class Tie(Operation):
    """Weights that are those of other connections, behind the rules of these: ``connections`` have them ``of``
    others."""

    connections: IntArray
    of: IntArray
