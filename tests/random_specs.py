"""Random specs for laws: groups of any make, connections of any shape, by expressions and tied ones among them, delays,
rules; always legal, never explosive."""

from __future__ import annotations

import copy
import random
from typing import TypeAlias

from hypothesis import strategies as st

Plain: TypeAlias = "bool | int | float | str | list[Plain] | dict[str, Plain] | None"
Spec: TypeAlias = dict[str, Plain]

_ACTIVATIONS: list[Plain] = ["tanh", "sigmoid", "sin", {"clip": {"low": -0.8, "high": 0.9}}, {"gaussian": {"sigma": 2}}]
_ACTIVATIONS += ["softmax", {"softmax": {"gain": 2}}]
_MODELS: list[Plain] = ["static", {"leaky_integrator": {"leak": 0.3}}]
#: each holds of the pairs of the first source, at least
WHERES = ["i == 0 or i >= j", "i < 1 or (i + j) % 2 == 0", "i*j < 3", "abs(i - j) < 2 or i == 0"]
_RULES: list[Plain] = [None, None, {"oja": {"rate": 0.01}}, {"decay": {"rate": 0.05}}, {"hebbian": {"rate": 0.002}}]
_RULES += [[{"oja": {"rate": 0.01}}, {"decay": {"rate": 0.05}}], ["decay", {"bcm": {"rate": 0.001}}, {"oja": {}}]]


def section(spec: Spec, name: str) -> dict[str, Plain]:
    """A section that is a mapping."""
    value = spec[name]
    assert isinstance(value, dict)
    return value


@st.composite
def specs(draw: st.DrawFn) -> Spec:
    """A spec as a mapping."""
    chooser = random.Random(draw(st.integers(0, 2**32)))
    sizes = {f"G{letter}": chooser.choice([1, 1, 2, 3, 5]) for letter in "abcde"[: draw(st.integers(1, 5))]}
    neurons: dict[str, Plain] = {}
    for name, size in sizes.items():
        group: dict[str, Plain] = {
            "activation": copy.deepcopy(chooser.choice(_ACTIVATIONS)),
            "model": copy.deepcopy(chooser.choice(_MODELS)),
            "combine": chooser.choice(["sum", "sum", "sum", "distance", "max"]),
            "bias": round(chooser.uniform(-0.5, 0.5), 3),
        }
        if size > 1:
            group["count"] = size
        if chooser.random() < 0.4:
            group["initial"] = round(chooser.uniform(-1, 1), 3)
        if chooser.random() < 0.3:
            group["input"] = "wave"
        neurons[name] = group
    connections: dict[str, Plain] = {}
    order = list(sizes)
    for i, source in enumerate(order):
        for j, target in enumerate(order):
            if chooser.random() < 0.5:
                connections[f"{source} -> {target}"] = _body(chooser, sizes, source, target, i < j)
    connections |= ties(chooser, sizes, connections)
    wave: dict[str, Plain] = {"expression": "0.3*sin(k/3)"}
    spec: Spec = {"neurovis": 1, "name": "random", "seed": chooser.randrange(100), "inputs": {"wave": wave}}
    return {**spec, "neurons": neurons, "connections": connections, "outputs": {"out": order[-1]}}


def ties(chooser: random.Random, sizes: dict[str, int], connections: dict[str, Plain]) -> dict[str, Plain]:
    """Entries that have the weights of others, between groups of these sizes that nothing connects yet."""
    made: dict[str, Plain] = {}
    for name in chooser.sample([*connections], min(2, len(connections))):
        source, _, target = name.partition(" -> ")
        way = chooser.choice(["same_as", "transpose"])
        ends = (source, target) if way == "same_as" else (target, source)
        fitting = [
            f"{one} -> {other}"
            for one in sizes
            for other in sizes
            if (sizes[one], sizes[other]) == (sizes[ends[0]], sizes[ends[1]])
            and f"{one} -> {other}" not in {*connections, *made}
        ]
        if fitting:
            made[chooser.choice(fitting)] = {"weight": {way: name}, "delay": chooser.choice([1, 1, 2])}
    return made


def _body(chooser: random.Random, sizes: dict[str, int], source: str, target: str, forward: bool) -> dict[str, Plain]:
    several = sizes[source] > 1 and sizes[target] > 1
    shape = chooser.choice(["weight", "matrix"])
    body: dict[str, Plain] = {"delay": chooser.choice([0, 1, 1, 2, 4] if forward else [1, 1, 3])}
    if shape == "matrix":
        # The first cell is always there: an entry that makes no connection at all is an error.
        body["matrix"] = [
            [_cell(chooser, keep=r == c == 0) for c in range(sizes[target])] for r in range(sizes[source])
        ]
    else:
        body["weight"] = chooser.choice([0.2, "0.1*(i - j)", "uniform(-0.3, 0.3)"])
        if several:
            body["pattern"] = "all_to_all" if chooser.random() < 0.5 else {"random": {"probability": 1}}
            body["self"] = True
        elif source == target and sizes[source] > 1:
            body["self"] = True
        if chooser.random() < 0.25:
            body["where"] = chooser.choice(WHERES)
    rule = chooser.choice(_RULES)
    if rule is not None:
        body["plasticity"] = copy.deepcopy(rule)
    return body


def _cell(chooser: random.Random, keep: bool) -> Plain:
    return None if not keep and chooser.random() < 0.3 else round(chooser.uniform(-0.4, 0.4), 3)
