"""Spikes as C: loops over what has fired, and over the connections of that, in place of loops over all connections.

In: a Network, the rows of some connections. Out: lines of C. Each neuron's sum is formed in the order of its
connections: where what has fired does not bring them in this order, the connections are marked first, a bit each, and
gone through by their marks.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from neurovis_spec.arrays import BoolArray
from neurovis_spec.language.expressions.emit_c import Value
from neurovis_spec.runtime.c_arrivals import Arrivals
from neurovis_spec.runtime.c_code import Code, Form
from neurovis_spec.runtime.c_connections import Ends, taken_at
from neurovis_spec.runtime.events import Rows, rows_of, weights_stay
from neurovis_spec.runtime.signals import SignalLayout
from neurovis_spec.runtime.stages import taken_by

#: rows that are looked at together (``nv_quiet``)
_AT_ONCE = 16


@dataclass(frozen=True)
class Firing:
    """Writes what comes of spikes."""

    ends: Ends
    code: Code
    form: Form

    @property
    def count(self) -> int:
        """The numbers of a row of the history."""
        return len(self.ends.network.neurons) + self.ends.network.outlet_count

    @contextmanager
    def before(self, rows: Rows, remembered: bool) -> Iterator[tuple[str, str, str]]:
        """The body of a loop over the rows of what fired by the delays of the rows before now: how many steps ago, ""
        for now, which row, and what was sent. It is in the history, where it is ``remembered``; with delays of 0 alone
        it is what is now."""
        code = self.code
        if remembered and rows.delays.any():
            with self._each_delay(rows):
                sent = f"h[{code.at(rows.ends, 'r')}]"
                self._pass_over(rows, "h")
                code.line(f"if ({sent} == 0)")
                code.line("    continue;")
                yield "ago", "r", sent
            return
        with code.block(code.loop("r", len(rows.ends))):
            sent = taken_at(self.ends.network, code, rows.ends, "r")
            code.line(f"if ({sent} == 0)")
            code.line("    continue;")
            yield "", "r", sent

    @contextmanager
    def now_or_then(self, rows: Rows) -> Iterator[str]:
        """The body of a loop over the rows of what fires now, or fired as many steps ago as the rows say: what it sends
        now."""
        code = self.code
        with self._each_delay(rows):
            now = taken_at(self.ends.network, code, rows.ends, "r")
            if now.startswith("activity["):
                self._pass_over(rows, "h", "activity")
            code.line(f"if ({now} == 0 && h[{code.at(rows.ends, 'r')}] == 0)")
            code.line("    continue;")
            yield now

    def _pass_over(self, rows: Rows, *arrays: str) -> None:
        """Lines that pass over many rows at once of which nothing has fired, as most of them, in loops over the rows of
        a delay."""
        code = self.code
        first, count = int(rows.ends[0]), len(rows.ends)
        if count < _AT_ONCE or not np.array_equal(rows.ends, np.arange(first, first + count)):
            return
        stop = f"{code.tables.name(rows.firsts)}[d + 1]"
        quiet = (f"nv_quiet({array} + {code.at(rows.ends, 'r')})" for array in arrays)
        code.line(f"if (r + {_AT_ONCE} <= {stop} && {' && '.join(quiet)}) {{")
        code.line(f"    r += {_AT_ONCE - 1};")
        code.line("    continue;")
        code.line("}")

    @contextmanager
    def _each_delay(self, rows: Rows) -> Iterator[None]:
        """The body of a loop over rows, delay by delay: ``h`` is what was sent ``ago`` steps before."""
        code, depth, firsts = self.code, self.ends.depth, self.code.tables.name(rows.firsts)
        with code.block(code.loop("d", len(rows.delays))):
            code.line(f"const int32_t ago = {code.at(rows.delays, 'd')};")
            code.line(f"const {code.real} *const h = history + (size_t)((k + {depth} - ago) % {depth})*{self.count};")
            with code.block(code.loop("r", f"{firsts}[d + 1]", f"{firsts}[d]")):
                yield

    def add_up(self, arrivals: Arrivals, rows: Rows, name: str, marks: str = "") -> None:
        """The sums of the spikes that come to a port, into an array of this name; ``marks`` is one with a bit for each
        connection, where they do not come in order."""
        code, starts = self.code, self.code.tables.name(rows.starts)
        code.line(f"memset({name}, 0, {arrivals.count}*sizeof({name}[0]));")
        bits = code.name("b") if marks else ""  # several ports of a population may have some
        if marks:
            code.line(f"unsigned char *const {bits} = (unsigned char *){marks};")
            code.line(f"memset({bits}, 0, {8 * -(-len(rows.order) // 64)});")
        with self.before(rows, bool(rows.delays.all())) as (ago, row, sent):
            head = code.loop("e", f"{starts}[{row} + 1]", f"{starts}[{row}]")
            with code.block(head):
                if marks:
                    code.line(f"const int32_t q = {code.at(rows.order, 'e')};")
                    code.line(f"{bits}[q >> 3] |= (unsigned char)(1 << (q & 7));")
                else:
                    total = f"{name}[{code.at(arrivals.slots[rows.order], 'e')}]"
                    arrivals.add_spike(total, "e", rows.order, sent, ago, self._weight(arrivals, rows))
        if marks:
            self._add_marked(arrivals, rows, name, bits)

    def _weight(self, arrivals: Arrivals, rows: Rows) -> Value | None:
        """The weight of a connection in its row, where none of them changes in a run: one number where it is the same
        for all, or for a row, else one of a table in the order of the rows; None where some change."""
        network, connections = self.ends.network, arrivals.connections[rows.order]
        if not weights_stay(network)[connections].all():
            return None
        weights = network.connections.weights[connections]
        of_row = weights[rows.starts[:-1]]
        if np.array_equal(np.repeat(of_row, np.diff(rows.starts)), weights):
            return self.code.number(of_row, "r")
        return self.code.number(weights, "e")

    def _add_marked(self, arrivals: Arrivals, rows: Rows, name: str, bits: str) -> None:
        """The sums of the connections that are marked in ``bits``, in their order."""
        code, count, depth = self.code, len(rows.order), self.ends.depth
        ago, ends = (np.empty(count, dtype=np.int64) for _ in range(2))
        ago[rows.order] = np.repeat(rows.delays, np.diff(rows.starts[rows.firsts]))
        ends[rows.order] = np.repeat(rows.ends, np.diff(rows.starts))
        with code.block(code.loop("g", -(-count // 64))):
            code.line("uint64_t any;")
            code.line(f"memcpy(&any, {bits} + 8*g, 8);")
            code.line("if (!any)")
            code.line("    continue;")
            with code.block(code.loop("byte", "8*g + 8", "8*g")), code.block(code.loop("q", "8*byte + 8", "8*byte")):
                code.line(f"if (!{bits}[byte])")
                code.line("    break;")
                code.line(f"if (!({bits}[byte] >> (q & 7) & 1))")
                code.line("    continue;")
                sent, then = taken_at(self.ends.network, code, ends, "q"), ""
                if rows.delays.any():
                    then = f"({code.at(ago, 'q')})"
                    row = f"(size_t)((k + {depth} - {then}) % {depth})*{self.count}"
                    sent = f"history[{row} + {code.at(ends, 'q')}]"
                total = f"{name}[{code.at(arrivals.slots, 'q')}]"
                arrivals.add_spike(total, "q", slice(None), sent, then, None)

    def own(self, layout: SignalLayout) -> BoolArray:
        """The connections (m,) that send spikes and have slots of their own."""
        there = (layout.offsets >= 0) & ~layout.shares
        return np.asarray(there & self.ends.network.spikes[taken_by(self.ends.network)])

    def leave(self, which: BoolArray, layout: SignalLayout) -> None:
        """The signals of some connections (m,) leave, which send spikes and have slots of their own: written are those
        of what fires now, or fired when that left which they hold."""
        members = np.flatnonzero(which)
        if not len(members):
            return
        code, network = self.code, self.ends.network
        delays = network.connections.delays[members]
        rows = rows_of(np.asarray(taken_by(network)[members], dtype=np.int64), delays)
        starts, sending = code.tables.name(rows.starts), members[rows.order]
        with self.now_or_then(rows) as now, code.block(code.loop("e", f"{starts}[r + 1]", f"{starts}[r]")):
            slot = code.at(layout.offsets[sending], "e")
            code.line(f"signals[{slot} + k % ago] = weights[{code.at(sending, 'e')}]*{now};")
