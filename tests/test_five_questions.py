"""Five questions that a default picture answers to those who have nothing else: is A connected to B, does it excite,
which of two pathways is stronger, who learns, how many neurons are there. What is read is the SVG alone, what is true
is the network. The same pictures pass the checklist of ``benchmarks/readability.py``.
"""

from __future__ import annotations

import re
import sys
import warnings
import xml.etree.ElementTree as ET
from collections import Counter
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from other_networks import NETWORKS

import neurovis_spec as nv
from neurovis_spec.compiled import CompiledNetwork

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "benchmarks"))

from readability import read_svg

SVG = "{http://www.w3.org/2000/svg}"
Pair = tuple[str, str]


class Reader:
    """Reads a picture: of each pathway what it does, how strong it is, whether any of it learns."""

    def __init__(self, svg: bytes) -> None:
        self.counts: Counter[str] = Counter()
        self.ends: dict[Pair, set[str]] = {}
        self.strength: Counter[Pair] = Counter()
        self.learning: set[Pair] = set()
        group: dict[str, str] = {}
        groups = list(ET.fromstring(svg).iter(f"{SVG}g"))
        for one in groups:
            if (name := one.get("data-neuron")) is not None:
                group[name] = one.get("data-group") or re.sub(r"\d+$", "", name)
                self.counts[group[name]] += 1
        for one in groups:
            if (pathway := one.get("data-pathway")) is not None:
                self._bundle(one, pathway)
            elif one.get("data-connection") is not None:
                self._line(one, (group[one.get("data-from", "")], group[one.get("data-to", "")]))

    def _bundle(self, one: ET.Element, pathway: str) -> None:
        source, target = pathway.split(" -> ")
        does = {word for word in ("excite", "inhibit") if one.get(f"data-{word}") is not None}
        strength = sum(abs(float(one.get(f"data-{word}", "0"))) for word in does)
        self._take((source, target), does, strength, one.get("data-learns") is not None)

    def _line(self, one: ET.Element, pair: Pair) -> None:
        title = (one.findtext(f"{SVG}title") or "").split("\n")
        weight = next(line.removeprefix("weight ") for line in title if line.startswith("weight "))
        does = "inhibit" if one.find(f"{SVG}polygon[@class='bar']") is not None else "excite"
        learns = any(line.startswith("gain:") and "change" in line for line in title)
        self._take(pair, {does}, abs(float(weight.replace("−", "-"))), learns)

    def _take(self, pair: Pair, does: set[str], strength: float, learns: bool) -> None:
        self.ends.setdefault(pair, set()).update(does)
        self.strength[pair] += strength  # type: ignore[assignment]
        if learns:
            self.learning.add(pair)


def pairs_of(network: CompiledNetwork) -> list[Pair]:
    """Of each connection from which group to which it runs."""
    group = [one.name for one in network.network.neurons.groups for _ in one.indices]
    ends = network.network.connections
    return [(group[a], group[b]) for a, b in zip(ends.sources.tolist(), ends.targets.tolist(), strict=True)]


@pytest.mark.parametrize("name", list(NETWORKS))
def test_a_picture_answers_them(name: str, tmp_path: Path) -> None:
    network = nv.compile_text(NETWORKS[name]())
    whole, snapshot = network.network, network.run().snapshot(network.network.steps - 1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of lines that are left out
        network.render(tmp_path / "picture.svg", step=whole.steps - 1)
    svg = (tmp_path / "picture.svg").read_bytes()
    seen, read = read_svg(network, svg), Reader(svg)
    assert seen.passed == dict.fromkeys(seen.passed, True), seen
    pairs = pairs_of(network)
    weights = snapshot.weights.tolist()
    assert set(read.ends) == set(pairs)
    does = {(pair, "inhibit" if weight < 0 else "excite") for pair, weight in zip(pairs, weights, strict=True)}
    assert {(pair, word) for pair, words in read.ends.items() for word in words} == does
    strength: Counter[Pair] = Counter()
    for pair, weight in zip(pairs, weights, strict=True):
        strength[pair] += abs(weight)
    for stronger, weaker in pairwise(sorted(strength, key=lambda pair: -strength[pair])):
        if strength[weaker] < 0.99 * strength[stronger]:
            assert read.strength[stronger] > read.strength[weaker]
    learning = np.flatnonzero(whole.connections.rules.whole() >= 0).tolist()
    assert read.learning == {pairs[index] for index in learning}
    assert read.counts == {group.name: group.count for group in whole.neurons.groups}
