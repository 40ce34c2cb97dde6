"""Rules in use that change no weight, with a rate of 0, without episodes, or because a signal is the own target; and
signals that are each connection's own target where another neuron may be meant.

In: what a spec without errors became. Out: warnings. Whether a rule changes weights is found by trial: it is carried
out for several steps and episodes at a few arbitrary points. So ``A -> O`` that learns by ``delta`` from the target O
is told of: there the signal is always ``post``, and with any other it would learn.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.checks.compiled import Compiled, WrittenEntry
from neurovis_spec.compiler.connections.entries import Bundle
from neurovis_spec.compiler.connections.plasticity import Learning
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import AT_SPIKE, PHASES, Definition
from neurovis_spec.diagnostics import Findings, Span, shorten
from neurovis_spec.language.expressions.evaluate import Value, evaluate_array
from neurovis_spec.language.expressions.functions import CONSTANTS
from neurovis_spec.language.grammar import ACTIVITIES
from neurovis_spec.language.values import Choice
from neurovis_spec.language.yaml.source import Scalar

_POINTS = 16
_STEPS = 6


def check_rules(compiled: Compiled, findings: Findings) -> None:
    """Warn of every entry whose rule changes no weight, or has each target for its own signal."""
    watched = _watched(compiled.network)
    for entry in compiled.entries.values():
        is_watched = not watched.isdisjoint(bundle.name for bundle in entry.bundles)  # it is there for its states
        for used in (_Used(entry, place, *rule) for place, rule in enumerate(entry.rules)):
            _check_rule(used, compiled.network, findings)
            if not is_watched:
                _check_rate(used, findings)
        if entry.rules and not is_watched:
            _check_bounds(entry, findings)


class _Used(NamedTuple):
    """A rule of an entry: its place among those, how it is written, and what was made of it in the first scope."""

    entry: WrittenEntry
    place: int
    choice: Choice
    learning: Learning

    @property
    def everywhere(self) -> Iterator[Learning]:
        """What was made of it in all scopes."""
        return (bundle.rules[self.place] for bundle in self.entry.bundles if bundle.rules)


def _check_rule(used: _Used, network: Network, findings: Findings) -> None:
    """Warn of a rule of which a signal is each target, or that changes weights where no episode ends."""
    rule = used.learning.rule
    for signal in rule.signals:
        if all(_is_own(bundle, used.place, signal) for bundle in used.entry.bundles):
            _check_signal(used, signal, network, findings)
    what, given = rule.given.name, rule.given
    if network.episode is None and not (given.each_step or given.derivative or given.acts):
        message = f"'{rule.name}' changes {what}s at the end of an episode, and there are none: no {what} will change"
        hint = "say how many steps an episode has, as in time: {episode: 100}"
        findings.warning("no-effect", used.choice.name.span, message, hint)


def changes(rule: Definition, parameters: Mapping[str, FloatArray], own: Collection[str] = ()) -> bool:
    """Whether a weight (or centre) changes in a few steps and episodes with arbitrary values, from the states' initial
    values; the signals of ``own`` are the target's activity."""
    generator = np.random.default_rng(0)  # the points of a test, not a draw of the network
    given = rule.given
    values: dict[str, Value] = {**CONSTANTS, "dt": 0.5, given.name: generator.uniform(-2.0, 2.0, _POINTS)}
    values |= {name: float(array[0]) for name, array in parameters.items()}
    values |= {state.name: evaluate_array(state.initial, values) for state in rule.state}
    for k in range(_STEPS):
        values |= {"k": float(k), "t": k * 0.5}
        for name in (*ACTIVITIES, *rule.signals, *(end.text for end in rule.end_names)):
            values[name] = generator.uniform(-2.0, 2.0, _POINTS) * 10.0 ** (k % 3)
        values |= dict.fromkeys(own, values["post"])
        for phase in (*AT_SPIKE, *PHASES):
            new: dict[str, Value] = {}
            for name, tree in rule.let:
                values[name] = evaluate_array(tree, values)
            for one in (quantity.during((phase,)) for quantity in (*rule.state, given)):
                change = one.each_episode if phase == "each_episode" else one.each_step
                if change is not None:
                    new[one.name] = evaluate_array(change, values)
                elif one.derivative is not None:
                    new[one.name] = values[one.name] + 0.5 * evaluate_array(one.derivative, values)
            if given.name in new and not np.array_equal(new[given.name], values[given.name]):
                return True
            values |= new
    return False


def _watched(network: Network) -> set[str]:
    """The entries a state of whose rule is named by an output."""
    connections = network.connections
    states = [state.connections for output in network.outputs for state in output.states]
    return {connections.entries[number] for own in states for number in set(connections.entry[own].tolist())}


def _is_own(bundle: Bundle, place: int, signal: str) -> bool:
    """Whether a signal of a rule is, for every connection, the activity of its own target."""
    return bool(bundle.rules) and bundle.rules[place].signals[signal].is_activity_of(bundle.targets)


def _check_signal(used: _Used, signal: str, network: Network, findings: Findings) -> None:
    """Warn of a signal that is each connection's own target, where the rule changes nothing then, or where other
    neurons may be meant."""
    learning, rule = used.learning, used.learning.rule
    span = next(setting.value.span for setting in used.choice.settings.entries if setting.name == signal)
    if changes(rule, learning.parameters, (signal,)) or not changes(rule, learning.parameters):
        if any(_is_of_others(bundle) for bundle in used.entry.bundles):
            _tell_own(used, signal, span, network, findings)
        return
    message = (
        f"'{shorten(learning.texts[signal])}' is this connection's own end: '{signal}' is then always 'post', and "
        f"'{rule.name}' changes no {rule.given.name}"
    )
    findings.warning("no-effect", span, message, "name a neuron or an input that says what 'post' should be")


def _is_of_others(bundle: Bundle) -> bool:
    """Whether a name of all targets may be meant for others than the one of each connection: of several targets one has
    several connections, or one from another of them."""
    targets, counts = np.unique(bundle.targets, return_counts=True)
    among = np.isin(bundle.sources, targets) & (bundle.sources != bundle.targets)
    return len(targets) > 1 and bool((counts > 1).any() or among.any())


def _tell_own(used: _Used, signal: str, span: Span, network: Network, findings: Findings) -> None:
    """Of a group that drives itself the source is probably meant, of another one all of its neurons together."""
    called, names = shorten(used.learning.texts[signal]), network.neurons.names
    first = next(bundle for bundle in used.entry.bundles if _is_of_others(bundle))
    one = names[int(first.targets[0])]
    message = f"'{called}' gives each connection its own target as '{signal}', which is 'post' already"
    if np.isin(first.sources, first.targets).any():
        hint = "in the rule the source is 'pre' (as it arrives) or 'sent' (as it is now), and the target 'post'"
    else:
        hint = f"in the rule the target is 'post'; all of '{called}' as one signal is a neuron that they drive"
    findings.warning("own-signal", span, message, f"{hint}; one neuron for all connections is named, as in {one}")


def _check_bounds(entry: WrittenEntry, findings: Findings) -> None:
    """Bounds that are one number. One that names a parameter can be set later."""
    bounds = entry.body.bounds
    if bounds is None or isinstance(bounds.first.value, str) or isinstance(bounds.second.value, str):
        return
    if bounds.first.value == bounds.second.value:
        message = f"both bounds are {bounds.first.value}: no weight will change"
        findings.warning("no-effect", bounds.span, message, "leave the plasticity out, or give the weight room")


def _check_rate(used: _Used, findings: Findings) -> None:
    """A rate of 0, which changes no weight. One that names a parameter can be set later."""
    choice = used.choice
    written = next((setting.value for setting in choice.settings.entries if setting.name == "rate"), None)
    if isinstance(written, Scalar) and isinstance(written.value, str):
        return
    for learning in used.everywhere:
        if "rate" not in learning.parameters or learning.parameters["rate"].any():
            continue
        if not changes(learning.rule, learning.parameters):
            message = f"the rate of '{learning.rule.name}' is 0: no {learning.rule.given.name} will change"
            span = choice.name.span if written is None else written.span
            findings.warning("zero-rate", span, message, "give it a rate, or leave the plasticity out")
            return
