"""Random specs in which something flows: derivatives and maps mixed, ports, factors, outputs, synapses, delays, noise,
events."""

from __future__ import annotations

import json
import random
from itertools import islice

from hypothesis import strategies as st
from random_specs import Plain, Spec

#: by name, and what they have beside ``drive`` and the activity
MODELS: dict[str, Plain] = {
    "leaky": {
        "parameters": {"tau": 0.7},
        "state": {"v": {"initial": 0.2, "derivative": "(f(drive) - v)/tau"}},
        "activity": "v",
    },
    "rate": {
        "parameters": {"tau": {"value": 700}},
        "time": "ms",
        "ports": ["gate"],
        "let": {"r": "f(v)", "leak": "0.3 - v"},
        "state": {
            "v": {"initial": 0.4, "derivative": "(leak + (1 - r)*gate + drive)/tau", "noise": 0.01},
            "w": {"initial": "0.1*dt", "derivative": "0.001*(r - w) + 0.0001*sin(0.01*t)"},
        },
        "outputs": {"rate": "r", "both": "v - w"},
        "activity": "r",
        "send": "rate",
    },
    "mixed": {
        "ports": {"gain": {"combine": "product"}, "far": {"combine": "distance"}, "best": "max"},
        "state": {
            "x": {"initial": 0.3, "derivative": "y - 0.3*x + 0.1*gain - 0.2*best", "each_step": "clip(x, -1.5, 1.5)"},
            "y": {"initial": -0.2, "derivative": "-x - 0.1*y*count + 0.2*far", "noise": "0.05*x"},
            "count": {"initial": 1, "each_step": "0.9*count + 0.1*drive^2", "each_episode": "1"},
        },
        "outputs": {"phase": "x*y + 0.1*drive"},
        "activity": "f(x + drive)",
    },
    "through": {"state": {"z": {"derivative": "drive - 2*z"}}, "activity": "f(drive)", "outputs": {"half": "z/2"}},
}
#: what of each model can be sent, and to which ports what is sent can be brought
SENT: dict[str, list[str]] = {
    "leaky": ["", "v"],
    "rate": ["", "activity", "v", "both"],
    "mixed": ["", "x", "y", "count", "phase"],
    "through": ["", "z", "half"],
    "static": [""],
    "leaky_integrator": ["", "v"],
}
PORTS: dict[str, list[Plain]] = {
    "leaky": ["drive"],
    "rate": ["drive", "gate", {"drive": 0.5, "gate": -0.3}],
    "mixed": [
        "drive",
        "gain",
        "far",
        "best",
        {"best": -0.5, "drive": 1},
        {"gain": 0.7, "far": 1.2},
        {"drive": -0.4, "far": 1},
    ],
    "through": ["drive"],
    "static": ["drive"],
    "leaky_integrator": ["drive"],
}
#: what synapses can read of neurons of each model; ``tau`` is a parameter
READ: dict[str, list[str]] = {
    "leaky": ["v", "v", "activity", "tau"],
    "rate": ["v", "w", "both", "rate", "activity", "tau"],
    "mixed": ["x", "y", "count", "phase", "activity"],
    "through": ["z", "z", "half", "activity"],
    "static": ["activity"],
    "leaky_integrator": ["v", "activity"],
}
#: synapses that read X of their source and Y of their target
_GATE: Plain = {"initial": 0.1, "derivative": "(pre.X - g)/tau"}
SYNAPSES: list[dict[str, Plain]] = [
    {"signal": "weight*(pre.X - post.Y)", "sign": "0"},
    {"signal": "0.3*weight*pre*(1 - 0.2*post.Y^3)"},
    {"parameters": {"E": 0.8}, "let": {"open": "0.5*pre.X"}, "signal": "weight*open*(E - post.Y)"},
    {"parameters": {"E": 0.8, "tau": 0.3}, "state": {"g": _GATE}, "signal": "g*(E - post.Y) + 0.1*sent"},
    {
        "time": "ms",
        "parameters": {"E": 0.4, "tau": 250},
        "let": {"sum": "g + 0.5*h"},
        "state": {"g": _GATE, "h": {"derivative": "(weight*post.Y - sum)/tau + 0.0001*t"}},
        "signal": "weight*sum*(E - 0.1*post)",
    },
    {
        "state": {"u": {"initial": 1, "each_step": "0.8*u + 0.1*pre.X", "each_episode": "0.5*u"}},
        "signal": "weight*u - 0.1*post.Y",
    },
    {
        "state": {
            "g": {"initial": 0.2, "derivative": "0.5*pre - g", "each_step": "clip(g, -0.3, 0.4)"},
            "u": {"each_step": "0.5*u + 0.2*post.Y*g", "each_episode": "0"},
        },
        "signal": "weight*(g + u)",
    },
    {"signal": "0.2*post.Y"},
    {"parameters": {"E": 0.1}, "signal": "E"},
    {"signal": "0.1*weight*pre.X*post.Y*(1 + 0.1*t - 0.01*k)"},
]
_PHASE: dict[str, Plain] = {"parameters": {"E": 0.3}, "signal": "0.5*weight*sin(pre.X - post.Y - E)"}
#: a state of each of these models
_STATES = {"leaky": "v", "rate": "v", "mixed": "x", "through": "z", "leaky_integrator": "v"}
BIASES: list[Plain] = [0.2, 0.3, "level"]
#: three of them are continuous where what is sent flows into a derivative
DELAYS: list[Plain] = [None, None, None, 0, 1, 3, "0.3 s", "0.1 s", {"seconds": "0.13 + 0.05*i + 0.1*j"}, "i + 2*j"]
PATTERNS: list[Plain] = ["all_to_all", "all_to_all", {"random": {"probability": 0.6}}]
EXACT = ["euler", "heun", "rk4", "semi_implicit"]
METHODS = [*EXACT, "exponential"]


@st.composite
def flowing_specs(draw: st.DrawFn, exact: bool = False, synapses: bool = True) -> Spec:
    """A spec as a mapping; it may hold a cycle without delay, which the compiler refuses. ``exact``: nothing in it is
    computed by functions whose last bits are those of a library."""
    chooser = random.Random(draw(st.integers(0, 2**32)))
    kinds = {f"G{letter}": chooser.choice(list(SENT)) for letter in "abcd"[: draw(st.integers(1, 4))]}
    kinds["Ga"] = chooser.choice(list(_STATES))
    sizes = {name: chooser.choice([1, 2, 3]) for name in kinds}
    neurons: dict[str, Plain] = {name: _group(chooser, kind, sizes[name]) for name, kind in kinds.items()}
    connections: dict[str, Plain] = {}
    joined: dict[str, Plain] = {}
    states: list[str] = []
    for source in kinds:
        for target in kinds:
            if chooser.random() < 0.6:
                body = _connection(chooser, kinds, sizes, source, target)
                connections[f"{source} -> {target}"] = body
                if synapses and _can_have_synapse(body) and chooser.random() < 0.5:
                    name = f"s{len(joined)}"
                    joined[name] = made = _synapse(chooser, kinds[source], kinds[target], exact)
                    if isinstance(body.get("pattern"), str):  # else there may be none
                        states += [f"({source} -> {target}).{state}" for state in _states_of(made)]
                    body["synapse"] = {name: {"E": "level"}} if "E" in str(joined[name]) else name
    method = chooser.choice(EXACT if exact else METHODS)
    spec: Spec = {
        "neurovis": 1,
        "name": "random",
        "seed": chooser.randrange(100),
        "time": {
            "dt": 0.1,
            "integrate": {"method": method, "substeps": chooser.choice([1, 1, 2, 3])},
            **({"episode": 5} if chooser.random() < 0.3 else {}),
        },
        "parameters": {"level": 0.4, "w": 0.6},
        "inputs": {
            "wave": {"expression": "level*sin(3*t) if t >= 0.3 else 0"},
            "held": {"expression": "level*sin(2*t) if k >= 2 else 0", "hold": True},
            "rows": {"values": [[0.1, -0.2, 0.3], [0.4, 0.1, 0]]},
        },
        "models": MODELS,
        "synapses": joined,
        "neurons": neurons,
        "connections": connections,
        "events": [
            {"at": 4, "set": {"level": 0.7, "w": -0.5}},
            {"from": 3, "to": 7, "clamp": {"Ga": 0.25}},
            {"from": 5, "to": 8, "clamp": {f"Ga.{_STATES[kinds['Ga']]}": "level"}},
            {"at": 6, "lesion": [list(kinds)[-1]]},
            {"at": 9, "mend": [list(kinds)[-1]]},
            *_held(states),
            *_loss(connections),
        ],
    }  # fmt: skip
    return _without_functions(spec) if exact else spec


def _loss(connections: dict[str, Plain]) -> list[Plain]:
    """The events by which the first connection is lesioned for a while."""
    return [{"at": at, what: [first]} for first in islice(connections, 1) for at, what in ((2, "lesion"), (7, "mend"))]


def _held(states: list[str]) -> list[Plain]:
    """The event by which some states of synapses are held for a while."""
    return [{"from": 5, "to": 9, "clamp": dict.fromkeys(states, "level")}] if states else []


def _without_functions(spec: Spec) -> Spec:
    """The same with sums and products alone."""
    text = json.dumps(spec).replace("sin(3*t)", "t").replace("sin(2*t)", "t").replace("sin(0.01*t)", "t")
    for name in ("tanh", "sigmoid"):
        text = text.replace(f'"activation": "{name}"', '"activation": {"clip": {"low": -0.9, "high": 0.8}}')
    made: Spec = json.loads(text)
    return made


def _group(chooser: random.Random, kind: str, size: int) -> Plain:
    group: dict[str, Plain] = {"model": kind, "activation": chooser.choice(["tanh", "sigmoid", "identity"])}
    if kind == "leaky_integrator":
        group["model"] = {kind: {"leak": 0.3}}
    if kind == "leaky" and size > 1:
        group["model"] = {kind: {"tau": [0.5 + 0.1 * i for i in range(size)]}}
    if size > 1:
        group["count"] = size
    port = chooser.choice([one for one in PORTS[kind] if isinstance(one, str)])
    if chooser.random() < 0.5:
        bias = chooser.choice(BIASES)
        group["bias"] = {port: bias} if chooser.random() < 0.5 else bias
    if chooser.random() < 0.5:
        source = "rows" if size == 3 and chooser.random() < 0.5 else chooser.choice(["wave", "wave", "held"])
        group["input"] = {port: source} if chooser.random() < 0.5 else source
    if chooser.random() < 0.3:
        group["noise"] = {port: "normal(0, 0.1)"} if chooser.random() < 0.5 else "normal(0, 0.1)"
    return group


def _can_have_synapse(body: dict[str, Plain]) -> bool:
    """Whether it leads to no port that combines distances."""
    port = body.get("port", "drive")
    return port != "far" and not (isinstance(port, dict) and "far" in port)


def _synapse(chooser: random.Random, source: str, target: str, exact: bool) -> Plain:
    made = json.dumps(chooser.choice(SYNAPSES if exact else [*SYNAPSES, _PHASE]))
    pre, post = chooser.choice(READ[source]), chooser.choice(READ[target])
    synapse: Plain = json.loads(made.replace("pre.X", f"pre.{pre}").replace("post.Y", f"post.{post}"))
    return synapse


def _states_of(synapse: Plain) -> list[str]:
    states = synapse.get("state") if isinstance(synapse, dict) else None
    return [*states] if isinstance(states, dict) else []


def _connection(
    chooser: random.Random, kinds: dict[str, str], sizes: dict[str, int], source: str, target: str
) -> dict[str, Plain]:
    body: dict[str, Plain] = {"weight": chooser.choice(["w*(1 + i - j)/3", 0.5, -0.7])}
    if sizes[source] > 1 or sizes[target] > 1:
        body["pattern"] = chooser.choice(PATTERNS)
    delay = chooser.choice(DELAYS)
    if delay is not None:
        body["delay"] = delay
    sent = chooser.choice(SENT[kinds[source]])
    if sent:
        body["send"] = sent
    if chooser.random() < 0.7:
        body["port"] = chooser.choice(PORTS[kinds[target]])
    if chooser.random() < 0.3:
        body["plasticity"] = {"oja": {"rate": 0.01}}
    return body
