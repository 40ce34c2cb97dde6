"""Random specs for the seams between features: modules, states, rules, events, draws, noise, episodes, delays, ties,
shares of a group, pairs by expressions at once.

In: a number. Out: a spec as a mapping, the same for the same number, that compiles and does not explode.
"""

from __future__ import annotations

import random

from random_specs import WHERES, Plain, Spec, ties

_MODELS: tuple[Plain, ...] = (
    "static",
    "static",
    {"leaky_integrator": {"leak": 0.3}},
    {"adaptive": {"leak": "0.2 + 0.1*a", "strength": 0.5}},
    "hysteresis",
)
_ACTIVATIONS: tuple[Plain, ...] = ("tanh", "sigmoid", "sin", {"gaussian": {"sigma": 2}}, {"clip": {"low": -0.8}})
_STATES = {"leaky_integrator": ("v",), "adaptive": ("v", "b"), "hysteresis": ("s",)}
_RULES: tuple[Plain, ...] = (
    {"hebbian": {"rate": "eta"}},
    {"oja": {"rate": 0.02}},
    {"decay": {"rate": "eta"}},
    {"bcm": {"rate": 0.005}},
    {"covariance": {"rate": 0.01}},
    {"differential_hebbian": {"rate": "eta"}},
)
_PATTERNS: tuple[Plain, ...] = (
    "all_to_all",
    {"random": {"probability": 0.4}},
    {"random": {"probability": 0.15}},
)


def name_of(definition: Plain) -> str:
    """The name of a definition, with parameters or without."""
    return definition if isinstance(definition, str) else next(iter(definition)) if isinstance(definition, dict) else ""


class Author:
    """Writes one spec. ``states`` are the references to states, ``entries`` the connections, of which ``drawn`` may be
    none; ``groups`` have their sizes; ``clamps``: events clamp."""

    def __init__(self, number: int) -> None:
        self.choose = random.Random(number)
        #: what came later chooses by itself, so that a number has the rest of its spec as before
        self.later = random.Random(f"later {number}")
        self.groups: dict[str, int] = {}
        self.states: list[str] = []
        self.entries: list[str] = []
        self.drawn: list[str] = []
        self.clamps = False
        self.spec: Spec = {}

    def write(self) -> Spec:
        """The spec."""
        choose = self.choose
        time: dict[str, Plain] = {"dt": choose.choice([0.01, 0.05, 1]), "steps": choose.randrange(20, 60)}
        if choose.random() < 0.3:
            time["episode"] = choose.randrange(3, 15)
        self.spec = {
            "neurovis": 1,
            "name": "seam",
            "time": time,
            "seed": choose.randrange(1000),
            "parameters": {"a": 0.4, "b": "0.5*a", "eta": {"value": 0.02, "min": 0, "max": 1}},
            "inputs": {
                "wave": {"expression": "0.3*sin(k/3) + 0.1*a*tanh(t)"},
                "push": {"size": 1},
                "table": {"values": [[0], [0.5], [-0.25], [0.125]]},
            },
        }
        neurons: dict[str, Plain] = {}
        for letter in "ABCDE"[: choose.randrange(2, 6)]:
            neurons[letter] = self._group(letter)
        self.spec["neurons"] = neurons
        if choose.random() < 0.4:
            self._modules()
        connections: dict[str, Plain] = {}
        order = list(self.groups)
        for i, source in enumerate(order):
            for j, target in enumerate(order):
                if choose.random() < 0.4:
                    connections[f"{source} -> {target}"] = self._connection(source, target, i < j)
        self.spec["connections"] = connections
        if choose.random() < 0.7:
            self.spec["events"] = self._events()
        if self.later.random() < 0.4:
            tied = ties(self.later, self.groups, {name: connections[name] for name in self._sure()})
            connections |= {name: body for name, body in tied.items() if name not in connections}
        outputs: dict[str, Plain] = {"out": order[-1]}
        if self.states and choose.random() < 0.3:
            outputs["inner"] = choose.choice(self.states)
        self.spec["outputs"] = outputs
        return self.spec

    def _group(self, name: str) -> Plain:
        choose = self.choose
        size, model = choose.choice([1, 1, 2, 3, 5]), choose.choice(_MODELS)
        self.groups[name] = size
        group: dict[str, Plain] = {"activation": choose.choice(_ACTIVATIONS), "model": model}
        group["bias"] = choose.choice([0, 0.2, "b", "0.1*a - 0.05"])
        if size > 1:
            group["count"] = size
        if name_of(model) in ("static", "leaky_integrator") and self.later.random() < 0.1:
            group["activation"] = "softmax"
        if choose.random() < 0.3:
            group["initial"] = round(choose.uniform(-1, 1), 3)
        if choose.random() < 0.4:
            group["input"] = choose.choice(["wave", "push", "table"])
        if choose.random() < 0.2:
            group["noise"] = choose.choice(["normal(0, 0.05)", "uniform(-0.1*a, 0.1*a)"])
        if choose.random() < 0.15:
            group["combine"] = choose.choice(["distance", "product", "max"])
        self.states += [f"{name}.{state}" for state in _STATES.get(name_of(model), ())]
        return group

    def _modules(self) -> None:
        leg: dict[str, Plain] = {
            "parameters": {"gain": 0.6},
            "inputs": {"load": {}},
            "neurons": {
                "S": {"input": "load", "activation": "tanh"},
                "K": {"count": 2, "model": {"leaky_integrator": {"leak": 0.4}}, "activation": "tanh"},
            },
            "connections": {
                "S -> K": {"weight": "gain", "plasticity": self.choose.choice(["hebbian", "oja"])},
                "K -> S": {"weight": -0.3, "delay": 2},
            },
        }
        self.spec["modules"] = {"leg": leg}
        self.spec["instances"] = {
            "left": {"module": "leg", "set": {"gain": "a"}, "inputs": {"load": "wave"}},
            "right": {"module": "leg", "count": 2},
        }
        self.groups |= {"left.S": 1, "right1.K": 2, "right2.S": 1}
        self.states += ["left.K.v", "right1.K.v"]

    def _connection(self, source: str, target: str, forward: bool) -> Plain:
        choose = self.choose
        name, sizes = f"{source} -> {target}", (self.groups[source], self.groups[target])
        body: dict[str, Plain] = {"delay": choose.choice([0, 1, 1, 2, 4] if forward else [1, 1, 3])}
        body["weight"] = choose.choice([0.2, "0.3*b", "0.1*(i - j) + 0.05", "uniform(-0.3, 0.3)", "normal(0, 0.2)"])
        if source == target and sizes[0] > 1:
            body["self"] = True
        if min(sizes) > 1:
            pattern: Plain = choose.choice([*_PATTERNS])
            body["pattern"] = pattern
            if isinstance(pattern, dict):
                self.drawn.append(name)
        if self.later.random() < 0.15:
            body["where"] = self.later.choice(WHERES)
        self.entries.append(name)
        if choose.random() < 0.35:
            rule = choose.choice(_RULES)
            body["plasticity"] = rule
            if choose.random() < 0.3:
                body["bounds"] = [-5, 5]
            if name_of(rule) == "bcm" and name not in self.drawn:
                self.states.append(f"({name}).theta")
        return body

    def _events(self) -> list[Plain]:
        choose, events = self.choose, list[Plain]()
        for _ in range(choose.randrange(1, 5)):
            at = choose.randrange(25)
            kind = choose.choice(["set", "clamp", "lesion", "mend", "learning"])
            group = choose.choice(list(self.groups))
            if kind == "set":
                events.append({"at": at, "set": {choose.choice(["a", "eta"]): round(choose.uniform(0.1, 0.6), 3)}})
            elif kind == "clamp":
                self.clamps = True
                events.append({"from": at, "to": at + choose.randrange(1, 9), "clamp": {group: 0.25}})
            elif kind == "learning" and self._learning():
                on = choose.random() < 0.4
                events.append({"at": at, "learning": {choose.choice(self._learning()): on}})
            else:
                part = choose.choice([group, *self.entries])
                events.append({"at": at, "lesion": [part]})
                if choose.random() < 0.6:
                    events.append({"at": at + choose.randrange(1, 6), "mend": [part]})
        return events

    def _sure(self) -> list[str]:
        """The entries that are sure to make connections."""
        return [name for name in self.entries if name not in self.drawn]

    def _learning(self) -> list[str]:
        """The entries that learn."""
        connections = self.spec["connections"]
        assert isinstance(connections, dict)
        return [name for name, body in connections.items() if isinstance(body, dict) and "plasticity" in body]
