"""Pathways in words: a sentence each for those who do not see the picture, and what stands beside their lines.

In: a network, strands of its pathways, who is at both ends, which sums and ends they have in what is shown. Out: texts:
``E excites I: 1,600 connections (3 lesioned), sum 12.3, delay 1.5 ms, learns by stdp``, and ``1,600 · Σ 12.3``.
What is lesioned is counted, and told.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import BoolArray, FloatArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.scene import texts
from neurovis_spec.scene.collapse import Gathered
from neurovis_spec.scene.lesions import lesions_of
from neurovis_spec.scene.pathways import Strand, pathways

#: What a rule is used with.
_PARAMETERS = re.compile(r"\([^()]*\)")
#: What a strand does, by how its lines end.
_DOES = {1: "excites", -1: "inhibits", 0: "acts on"}


def sentences(network: Network) -> list[str]:
    """What is said of all pathways of a network, as its spec begins; what excites and what inhibits each by itself."""
    names, words = [group.name for group in network.neurons.groups], PathwayWords(network, lost_by(network, 0))
    return [
        words.sentence((names[one.source], names[one.target]), strand, (strand.total, strand.total), {strand.end})
        for one in pathways(network)
        for strand in one.strands
    ]


def lost_by(network: Network, step: int) -> BoolArray:
    """Which connections (m,) events have lesioned by a step."""
    found = np.zeros(len(network.connections), bool)
    found[[index for index, since in lesions_of(network).connections.items() if since <= step]] = True
    return found


def told(
    drawn: Gathered, low: FloatArray, high: FloatArray, ends: npt.NDArray[np.int8], step: int = 0
) -> tuple[str, ...]:
    """The sentences of what is drawn as pathways, whose lines have these sums (m,) and ends (frames, m), up to a step;
    none of what is drawn otherwise."""
    if drawn.strands is None:
        return ()
    names, lines = drawn.network.neurons.names, drawn.network.connections
    words = PathwayWords(drawn.whole, lost_by(drawn.whole, step))
    result = list[str]()
    for line, strand in enumerate(drawn.strands):
        between = names[int(lines.sources[line])], names[int(lines.targets[line])]
        sums, does = (float(low[line]), float(high[line])), np.unique(ends[:, line]).tolist()
        result.append(words.sentence(between, strand, sums, does))
    return tuple(result)


@dataclass(frozen=True)
class PathwayWords:
    """What is said of the strands of a network, of whose connections (m,) these are ``lost``, by default none."""

    network: Network
    lost: BoolArray | None = None

    def sentence(self, ends: tuple[str, str], strand: Strand, sums: tuple[float, float], does: Collection[int]) -> str:
        """What is said of a strand between two ``ends``, by their names, whose ``sums`` of weights, least and greatest,
        are these in what is shown, and whose lines end so there (``does``)."""
        source, target = ends
        verbs = [_DOES[0]] if sums == (0.0, 0.0) else [_DOES[end] for end in _DOES if end in does]
        lost = f" ({lost:,} lesioned)" if (lost := self._lost(strand)) else ""
        parts = [f"{strand.count:,} connection{'' if strand.count == 1 else 's'}{lost}"]
        parts.append(f"sum {' … '.join(dict.fromkeys(map(texts.number, sums)))}")
        delay, rules = self._delay(strand), list(self._rules(strand))
        parts.append(f"delay {delay}" if delay else "no delay")
        if rules:
            parts.append(f"learns by {' and '.join(rules)}")
        elif self._learned[strand.members].any():
            parts.append("learns with others, whose weights these are")
        return f"{source} {' or '.join(verbs)} {'itself' if source == target else target}: {', '.join(parts)}"

    def beside(self, strand: Strand) -> tuple[str, ...]:
        """What stands beside its line, all of it first, then less, where there is no room: how many connections it has,
        their sum, their delay where it is longer than that of others (as beads say), and their rules. A sum that
        changes in a run is told by how wide the line is, alone."""
        sole = strand.count == 1
        parts = [] if sole else [f"{strand.count:,}"]
        if not self._changing[strand.members].any():
            parts.append(f"{'w' if sole else 'Σ'} {texts.number(strand.total)}")
        if self._steps[strand.members].max() > self._steps.min():
            parts.append(self._delay(strand))
        parts += self._rules(strand)
        if lost := self._lost(strand):
            parts.append(f"{lost:,} lesioned")
        return tuple(" · ".join(parts[:most]) for most in range(len(parts), 0, -1))

    def _lost(self, strand: Strand) -> int:
        return 0 if self.lost is None else int(self.lost[strand.members].sum())

    def _delay(self, strand: Strand) -> str:
        """How long its signals take, as the spec counts time; '' where they take none."""
        steps, dt = self._steps[strand.members], self.network.shown_dt
        low, high = float(steps.min()), float(steps.max())
        if not high:
            return ""
        length, unit = (1.0, "step" if low == high == 1 else "steps") if dt is None else (dt.length, dt.unit)
        return f"{' … '.join(dict.fromkeys(texts.number(one * length) for one in (low, high)))} {unit}"

    def _rules(self, strand: Strand) -> Iterator[str]:
        """The names of the rules that change it."""
        connections = self.network.connections
        own = strand.members[self._learning[strand.members]]
        written = (connections.learns[entry] for entry in np.unique(connections.entry[own]).tolist())
        yield from dict.fromkeys(_PARAMETERS.sub("", rule) for rule in written if rule)

    @cached_property
    def _steps(self) -> FloatArray:
        """How long the signal of each connection takes, in steps (m,)."""
        delays, lags = self.network.connections.delays.whole().astype(np.float64), self.network.connections.lags
        return delays if lags is None else np.where(np.isnan(lags.whole()), delays, lags.whole())

    @cached_property
    def _learning(self) -> BoolArray:
        return self.network.connections.learning

    @cached_property
    def _learned(self) -> BoolArray:
        return np.isin(np.arange(len(self.network.connections)), self.network.learned)

    @cached_property
    def _changing(self) -> BoolArray:
        return np.isin(np.arange(len(self.network.connections)), self.network.changing)
