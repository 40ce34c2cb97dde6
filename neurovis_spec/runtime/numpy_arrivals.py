"""What is given to a port, as NumPy code: signals, combined in the order of the reference, + bias + input + noise.

In: a Step in the making. Out: code, or identifiers of what it gives. Sums are made by ``bincount``, which adds in the
order of the connections from 0.0 on, and products by ``multiply.reduceat``, which multiplies from left to right. What
is made of some connections first (``held``) comes before those of the others. The signals of all connections of a
projection that have a synapse are one expression of arrays.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from neurovis_spec.arrays import BoolArray, Indices, IntArray
from neurovis_spec.compiler.events.settable import CENTRES, bias_of
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import CENTRE, Population, Port, Projection
from neurovis_spec.runtime.events import in_order, rows_of, takes_spikes
from neurovis_spec.runtime.lags import Lags
from neurovis_spec.runtime.numpy_code import Code, any_given
from neurovis_spec.runtime.numpy_spikes import Arriving, sums
from neurovis_spec.runtime.signals import DelayClass, SharedSlots, SignalLayout
from neurovis_spec.runtime.stages import (
    End,
    Formed,
    acts_now,
    behind_flow,
    ends_of,
    formed_at,
    signal_of,
    taken_by,
    target_of,
)
from neurovis_spec.runtime.state import NEVER_LOST, Structure


@dataclass(frozen=True, slots=True)
class Step:
    """A step in the making."""

    code: Code
    whole: Network
    #: without the connections that the structure leaves out
    network: Network
    structure: Structure
    #: where signals are under way
    layout: SignalLayout
    #: how many past activities are remembered
    depth: int
    #: the continuous delays, where there are any
    lags: Lags | None
    #: by populations and names of ports the identifiers of what was gathered there
    ports: dict[int, dict[str, str]]
    #: by populations and states, those of what their noise is multiplied by
    spread: dict[tuple[int, str], str] = field(default_factory=dict)
    #: by projections, those of the signals of synapses before their targets are updated
    formed: dict[int, str] = field(default_factory=dict)

    def working(self, number: int) -> Working:
        """The connections of a projection that do something."""
        projection = self.network.projections[number]
        idle = self.structure.idle(projection)
        if not idle.any():
            return Working(projection, None)
        some = np.flatnonzero(~idle)
        signals, ends = (
            {name: indices[some] for name, indices in one.items()} for one in (projection.signals, projection.ends)
        )
        slots = None if projection.slots is None else projection.slots[some]
        members = projection.members[some]
        return Working(replace(projection, members=members, signals=signals, ends=ends, slots=slots), some)


class Working(NamedTuple):
    """The connections of a projection that do something: it without the others, and which of its members they are,
    None where all do."""

    projection: Projection
    some: IntArray | None

    def among(self, members: IntArray) -> IntArray:
        """Where some of the members of the whole projection are among them."""
        return members if self.some is None else np.searchsorted(self.some, members)


def gathered(step: Step, number: int, port: Port) -> str:
    """What is at a port of a population: what arrives there, combined, + bias + input + noise."""
    population = step.network.populations[number]
    arriving, places = "", np.flatnonzero(~acts_now(port))
    if len(places):
        arriving = arriving_at(step, number, port, places)
    return with_step_values(step, population, port, with_bias(step, population, port, arriving))


def brought_now(step: Step, number: int, port: Port) -> str:
    """What spikes of the same step bring to a port that act behind all of it, and nothing else."""
    places = np.flatnonzero(acts_now(port))
    if len(places):
        return arriving_at(step, number, port, places)
    return step.code.constant(np.zeros(len(step.network.populations[number].members)))


def arriving_at(step: Step, number: int, port: Port, places: Indices) -> str:
    """What arrives at a port of a population by the connections at these places, combined."""
    population = step.network.populations[number]
    if spikes := _spikes_at(step, port, places, len(population.members)):
        return spikes
    signals = signals_at(step, number, port, places)
    return step.code.let("u", finished(port, accumulated(step, population, port, places, signals)))


def _spikes_at(step: Step, port: Port, places: Indices, count: int) -> str:
    """The sums of the spikes that come to a port, of the connections at these places, as code; "" where anything else
    comes, too, or where some have a delay and some have none."""
    network = step.network
    incoming = port.incoming[places]
    delays = network.connections.delays[incoming]
    shares = step.layout.shares[incoming] | (delays == 0)
    alike = bool((delays > 0).any()) == bool((delays > 0).all()) and bool(shares.any()) == bool(shares.all())
    if not (alike and takes_spikes(network, port)):
        return ""
    rows = rows_of(np.asarray(taken_by(network)[incoming], dtype=np.int64), delays)
    lost, order = step.structure.lost[incoming], rows.order
    arriving = Arriving(
        rows=rows,
        connections=np.ascontiguousarray(incoming[order], dtype=np.intp),
        ends=np.repeat(rows.ends, np.diff(rows.starts)),
        slots=np.ascontiguousarray(port.slots[places][order], dtype=np.intp),
        factors=None if port.factors is None else port.factors[places][order],
        offsets=None if shares.any() else step.layout.offsets[incoming].astype(np.int64)[order],
        delays=delays[order],
        lost=lost[order] if (lost > NEVER_LOST).any() else None,
        in_order=in_order(rows, port.slots[places], incoming),
        neurons=count,
    )
    step.code.namespace["sums"] = sums
    sent = "" if delays.any() else f", {all_sent(step)}"
    return step.code.let("u", f"sums({step.code.constant(arriving)}, k, history, weights, signals{sent})")


def all_sent(step: Step) -> str:
    """All activities and outlets as they are now."""
    return "np.concatenate((activity, outlets))" if step.network.outlet_count else "activity"


def with_bias(step: Step, population: Population, port: Port, arriving: str) -> str:
    """What arrives, "" for nothing, and the bias."""
    code, nothing = step.code, port.nothing
    biases, key = step.network.neurons.bias_at(port.name), bias_of(port.name)
    bias = biases[population.members]
    if not arriving and not code.is_set(key):
        return code.constant(nothing + bias)
    # a sum that begins with 0.0 is never −0.0, so adding 0.0 changes nothing; a product may be
    if arriving and not (code.is_set(key) or any_given(bias) or port.combine == "product"):
        return arriving
    # a bias that can be set may be one number for all members: each has its own from here on
    arriving = arriving or code.constant(np.full(len(population.members), nothing))
    return code.let("u", f"{arriving} + {code.numbers(key, biases, population.members, share=False)}")


def with_step_values(step: Step, population: Population, port: Port, drive: str, vector: str = "s") -> str:
    """What is at a port, and then input and noise: numbers of the step's vector, or of another one like it."""
    network = step.network
    for indices in (network.neurons.input_at(port.name), network.noise_of(port.name)):
        drive = _plus(step.code, network, indices[population.members], drive, vector)
    return drive


def _plus(code: Code, network: Network, index_in_s: IntArray, drive: str, vector: str) -> str:
    """The drive and, for each member, the number of the step's vector that ``index_in_s`` points to (−1: none)."""
    fed_members = np.flatnonzero(index_in_s >= 0)
    if not len(fed_members):
        return drive
    values = code.select(vector, index_in_s[fed_members], network.vector_size, broadcast=True)
    if len(fed_members) == len(index_in_s):
        return code.let("u", f"{drive} + {values}")
    drive = code.let("u", f"np.array({drive})")
    code.line(f"{drive}{code.position(fed_members, len(index_in_s))} += {values}")
    return drive


def signals_at(step: Step, number: int, port: Port, places: Indices) -> str:
    """What the connections at these places of a port bring, in their order: the values of each delay, put together."""
    code, connections = step.code, step.network.connections
    incoming = port.incoming[places]
    delays, shares = connections.delays[incoming], step.layout.shares[incoming]
    #: what arrives, and where in the order
    parts: list[tuple[str, IntArray]] = []
    for one in formed_at(step.network, incoming):
        parts.append((some_of(step, one, before_update(step, one.number)), one.places))
    delays = np.where(step.network.synapses.numbers[incoming] < 0, delays, -1)  # with a synapse nothing is under way
    undelayed = np.flatnonzero(delays == 0)
    if len(undelayed):
        weights = code.select("weights", incoming[undelayed], len(connections))
        parts.append((f"{weights} * {sent_by(step, incoming[undelayed])}", undelayed))
    rings = step.layout.rings
    if step.layout.many:
        delayed = np.flatnonzero(delays > 0)
        if len(delayed):
            parts.append((signals_of(step, incoming[delayed], delays[delayed]), delayed))
        rings = ()
    for slots in (one for one in rings if isinstance(one, SharedSlots)):
        there = np.flatnonzero(shares & _has(step, slots, incoming, delays))
        if len(there):
            parts.append((_shared(step, slots, incoming[there]), there))
    for delay_class in (one for one in rings if isinstance(one, DelayClass)):
        inside = np.flatnonzero(delay_class.populations == number)  # they lie next to each other
        if len(inside):
            length = delay_class.length
            start, stop = (delay_class.start + length * int(i) for i in (inside[0], inside[-1] + 1))
            own = slots_of(code, start, stop, length, delay_class.delay % length)
            arriving = np.isin(delay_class.connections[inside], incoming)
            if not arriving.any():  # a lesion, or another port: what is under way there does not arrive here
                continue
            if not arriving.all():
                own = code.select(code.let("g", own), np.flatnonzero(arriving), len(arriving))
            parts.append((own, np.flatnonzero(~shares & _has(step, delay_class, incoming, delays))))
    return with_factors(code, port, places, put_together(code, parts, len(delays)))


def signals_of(step: Step, connections: Indices, ago: IntArray) -> str:
    """The signals of connections that were sent so many steps ago, of each another number."""
    code, layout = step.code, step.layout
    shares = layout.shares[connections]
    parts: list[tuple[str, IntArray]] = []
    for is_shared in (True, False):
        places = np.flatnonzero(shares == is_shared)
        if not len(places):
            continue
        some = connections[places]
        sent = slots_at(code, layout.offsets[some], layout.lengths[some], ago[places])
        if is_shared:
            sent = f"{code.select('weights', some, len(step.network.connections))} * {sent}"
            lost = step.structure.lost[some]
            if (lost > NEVER_LOST).any():
                sent = f"np.where(k < {code.constant(lost + ago[places])}, 0.0, {sent})"
        parts.append((sent, places))
    return put_together(code, parts, len(connections))


def slots_at(code: Code, offsets: Indices, lengths: Indices, ago: IntArray) -> str:
    """The slots of so many steps ago of rings that begin at these places and are so long."""
    firsts, sizes = offsets.astype(np.int64), lengths.astype(np.int64)
    length, count, first = int(sizes[0]), len(firsts), int(firsts[0])
    if (sizes != length).any() or (ago != ago[0]).any():
        step = "k" if (ago % sizes == 0).all() else f"(k - {code.constant(ago)})"
        return f"signals[{code.constant(firsts)} + {step} % {code.constant(sizes)}]"
    slot = code.slot(length, int(ago[0]) % length)
    if np.array_equal(firsts, first + length * np.arange(count)):
        return f"signals[{first} + {slot}:{first + length * count}:{length}]"
    return f"signals[{code.constant(firsts)} + {slot}]"


def _has(step: Step, slots: DelayClass | SharedSlots, connections: Indices, delays: IntArray) -> BoolArray:
    """Which of some connections have slots of this kind; ``delays`` are theirs."""
    return np.asarray((delays == slots.delay) & (step.layout.lengths[connections] == slots.length))


def put_together(code: Code, parts: list[tuple[str, IntArray]], count: int, prefix: str = "g") -> str:
    """Values one of which stands at each of so many places: those of each part, and where they stand."""
    if len(parts) == 1:
        return code.let(prefix, parts[0][0])
    made = code.let(prefix, f"np.empty({count})")
    for values, there in parts:
        code.line(f"{made}{code.position(there, count)} = {values}")
    return made


def some_of(step: Step, formed: Formed, signals: str) -> str:
    """Of the signals of a projection those of some of its members."""
    working = step.working(formed.number)
    return step.code.select(signals, working.among(formed.members), len(working.projection.members))


def before_update(step: Step, number: int) -> str:
    """The signals of synapses before their targets are updated."""
    if number not in step.formed:
        code, (projection, some) = step.code, step.working(number)
        formulas = signal_of(projection)
        known = code.parameters(projection.use, some) | seen_before_update(step, projection, formulas.names)
        for one in projection.use.definition.state:
            known[one.name] = cell_of(code, projection, one.name, some)
        for name, tree in formulas.let:
            known[name] = code.let("m", code.expression(tree, known))
        ((_, tree),) = formulas.trees
        step.formed[number] = each(step, projection, formulas.names, code.expression(tree, known))
    return step.formed[number]


def cell_of(code: Code, projection: Projection, state: str, some: IntArray | None) -> str:
    """A state of a projection, of some of its members or all."""
    cell = code.state(projection.use, state)
    return cell if some is None else f"{cell}[{code.constant(some)}]"


def seen_before_update(step: Step, projection: Projection, read: Collection[str]) -> dict[str, str]:
    """What synapses see before their targets are updated, as far as it is ``read``: weights, and both ends, of these
    the states that flow as they are behind the integration."""
    code, network = step.code, step.network
    number, states = target_of(network, projection), behind_flow(network, projection)
    target, seen = network.populations[number], dict[str, str]()
    at = np.searchsorted(target.members, network.connections.targets[projection.members])
    for name in (one for one in states if one in read):
        if not seen:
            code.line(f"if fixed: hold_cells(fixed, {code.constant((target.model.owner,))}, cells)")
        cells = code.state(target.model, states[name])
        seen[name] = code.let("a", code.select(cells, at, len(target.members), broadcast=True))
    seen["weight"] = code.select("weights", projection.members, len(network.connections))
    return seen | ends_at(step, projection, {one for one in read if one not in seen})


def ends_at(step: Step, projection: Projection, read: Collection[str]) -> dict[str, str]:
    """What the definition of a projection sees of both ends of its connections, as far as it is ``read``."""
    return {
        name: step.code.let("a", end_at(step, projection.members, end))
        for name, end in ends_of(step.network, projection).items()
        if name in read
    }


def end_at(step: Step, members: IntArray, end: End) -> str:
    """Something that connections read of an end: as it is now, or what was sent by their delays ago."""
    delays, places = step.network.connections.delays[members], end.places
    past = np.asarray(end.past & (delays > 0))
    late = past & (False if step.lags is None or end.rounded else step.lags.there[members])
    past &= ~late
    if past.all():
        return _past(step, members, places)
    if not (past | late).any():
        return sent_at(step, places, broadcast=True)
    parts = []
    if past.any():
        parts.append((_past(step, members[past], places[past]), np.flatnonzero(past)))
    if late.any():
        made = long_past(step, members[late], places[late], delays[late])
        parts.append((made, np.flatnonzero(late)))
    now = np.flatnonzero(~(past | late))
    if len(now):
        parts.append((sent_at(step, places[now]), now))
    return put_together(step.code, parts, len(members), "a")


def _past(step: Step, members: IntArray, places: IntArray) -> str:
    """Activities or outlets of d ≥ 1 steps ago, 0 where that is lost."""
    code, depth = step.code, step.depth
    delays, lost = step.network.connections.delays[members], step.structure.lost[members]
    if (delays == delays[0]).all():
        count = len(step.network.neurons) + step.network.outlet_count
        past = code.select(f"history[(k - {delays[0]}) % {depth}]", places, count, broadcast=True)
    else:
        rows = f"(k - {code.constant(delays)}) % {depth}"
        past = f"history[{rows}, {code.constant(np.ascontiguousarray(places, dtype=np.intp))}]"
    if not (lost > NEVER_LOST).any():
        return past
    return f"np.where(k < {code.constant(lost + delays)}, 0.0, {past})"


def long_past(step: Step, members: IntArray, places: IntArray, ago: IntArray) -> str:
    """Activities and outlets of so many steps ago, for continuous delays: before the first step they are as at that, 0
    where they are lost."""
    code, lost = step.code, step.structure.lost[members]
    code.head_lines.add(f"since = {NEVER_LOST} if state.continued else 0")
    if (ago == ago[0]).all():
        count = len(step.network.neurons) + step.network.outlet_count
        made = code.select(f"history[max(k - {ago[0]}, since) % {step.depth}]", places, count)
    else:
        rows = f"np.maximum(k - {code.constant(ago)}, since) % {step.depth}"
        made = f"history[{rows}, {code.constant(np.ascontiguousarray(places, dtype=np.intp))}]"
    if (lost > NEVER_LOST).any():
        made = f"np.where(k < {code.constant(lost + ago)}, 0.0, {made})"
    return code.let("a", made)


def each(step: Step, projection: Projection, read: frozenset[str], value: str) -> str:
    """Numbers made of what is ``read``, one for each connection of a projection, though all may be one."""
    members, ends = projection.members, ends_of(step.network, projection)
    own = {"weight", *(one.name for one in projection.use.definition.state)}
    own |= {name for name, end in ends.items() if (end.places != end.places[0]).any()}
    if own.isdisjoint(read):
        value = f"np.broadcast_to({value}, ({len(members)},))"
    return step.code.let("g", value)


def _shared(step: Step, slots: SharedSlots, members: Indices) -> str:
    """What was sent, times the weights of some connections that share it; 0 where it is lost."""
    code, lost = step.code, step.structure.lost[members]
    places = (step.layout.offsets[members] - slots.start) // slots.length
    own = slots_of(code, slots.start, slots.stop, slots.length, slots.delay % slots.length)
    past = code.select(own, places, len(slots.sent))
    arriving = f"{code.select('weights', members, len(step.network.connections))} * {past}"
    if not (lost > NEVER_LOST).any():
        return arriving
    return f"np.where(k < {code.constant(lost + slots.delay)}, 0.0, {arriving})"


def with_factors(code: Code, port: Port, places: Indices, signals: str) -> str:
    """Signals times what they are multiplied by at a port."""
    if port.factors is None:
        return signals
    return code.let("g", f"{signals} * {code.constant(np.array(port.factors[places]))}")


def sent_by(step: Step, connections: Indices, broadcast: bool = False) -> str:
    """What connections take now."""
    return sent_at(step, taken_by(step.network)[connections], broadcast)


def sent_at(step: Step, taken: Indices, broadcast: bool = False) -> str:
    """Some activities, outlets and, of signals of rules, inputs, as they are now, which are numbered in this order."""
    code, network = step.code, step.network
    start, sizes = 0, {"activity": len(network.neurons), "outlets": network.outlet_count, "s": network.vector_size}
    for array, size in sizes.items():
        if ((taken >= start) & (taken < start + size)).all():
            return code.select(array, taken - start if start else taken, size, broadcast)
        start += size
    if (taken < start - sizes["s"]).all():
        del sizes["s"]
    arrays = [array for array, size in sizes.items() if size]
    return code.select(f"np.concatenate(({', '.join(arrays)}))", taken, sum(sizes.values()))


def slots_of(code: Code, start: int, stop: int, length: int, ago: int = 0) -> str:
    """The slots of this step, or of one some steps ago, of connections that are stored next to each other:
    ``signals[4:8]`` in rings of 1, else every ``length``-th, ``signals[4 + r3:16:3]`` with r3 = k % 3."""
    if length == 1:
        return code.view("signals", f"{start}:{stop}")
    return f"signals[{start} + {code.slot(length, ago)}:{stop}:{length}]"


def _centres(step: Step, connections: Indices) -> str:
    """What the signals of some connections are compared with, "" for 0."""
    code, network = step.code, step.network
    centres, (holders, numbers, positions) = network.connections.centres.whole(), network.moving_centres
    own, parts = numbers[connections], list[tuple[str, IntArray]]()
    for number in np.flatnonzero(np.bincount(own + 1)).tolist():
        places = np.flatnonzero(own == number - 1)
        some = connections[places]
        if number:
            holder = holders[number - 1]
            (use,) = holder.uses
            parts.append((code.select(code.state(use, CENTRE), positions[some], len(holder.members)), places))
        elif code.is_set(CENTRES) or any_given(centres[some]) or len(places) < len(own):
            parts.append((code.numbers(CENTRES, centres, some, share=False), places))
    return put_together(code, parts, len(own), "c") if len(parts) > 1 else "".join(values for values, _ in parts)


def finished(port: Port, arrived: str) -> str:
    """What arrives as one number: of squares of a distance the root, and of the greatest signal 0 where there is none
    (of which −0 and 0 are equally great)."""
    if port.combine == "max":
        return f"np.where({arrived} == -np.inf, 0.0, {arrived}) + 0.0"
    return f"np.sqrt({arrived})" if port.combine == "distance" else arrived


def accumulated(step: Step, population: Population, port: Port, places: Indices, signals: str, held: str = "") -> str:
    """The sum, the product, the greatest, or the sum of the squares of signals, of the connections at these places, at
    each member; ``held`` is that of the connections before them."""
    code, count = step.code, len(population.members)
    slots = port.slots[places]
    if port.combine == "distance":
        centre = _centres(step, port.incoming[places])
        if centre:
            signals = code.let("g", f"{signals} - {centre}")
        signals = f"{signals} * {signals}"
    if held:
        slots = np.concatenate((np.arange(count), slots))
        signals = code.let("g", f"concatenate(({held}, {signals}))")
    if port.combine == "product":
        return _reduced(code, slots, count, signals, "multiply", "1.0")
    if port.combine == "max":
        return code.let("u", _reduced(code, slots, count, signals, "np.maximum", "-np.inf"))
    return f"bincount({code.constant(np.ascontiguousarray(slots, dtype=np.intp))}, {signals}, {count})"


def _reduced(code: Code, slots: Indices, count: int, signals: str, by: str, nothing: str) -> str:
    """What arrives at each member, multiplied or compared, ``nothing`` where nothing does. ``reduceat`` takes what lies
    between two starts, so the signals are sorted by member, and members without any are left out."""
    order = np.argsort(slots, kind="stable")  # equal ones keep the order of the connections
    filled, starts = np.unique(slots[order], return_index=True)
    sorted_signals = code.select(signals, order, len(order))
    reduced = f"{by}.reduceat({sorted_signals}, {code.constant(starts.astype(np.intp))})"
    if len(filled) == count:
        return reduced
    whole = code.let("u", f"np.full({count}, {nothing})")
    code.line(f"{whole}{code.position(filled, count)} = {reduced}")
    return whole
