"""Random specs of what spikes: blocks with and without a reset, refractory times, jumps; connections with delays of all
kinds, ports with factors, synapses and rules that wait for spikes, several rules, events."""

from __future__ import annotations

import json
import random
from itertools import islice

from hypothesis import strategies as st
from random_specs import Plain, Spec

MODELS: dict[str, Plain] = {
    # integrates and fires; what jumps and what flows have ports of their own
    "lif": {
        "time": "ms",
        "parameters": {"tau": 4, "reset": 0.1, "rest": 2},
        "ports": ["kick"],
        "state": {
            "v": {"initial": 0.6, "derivative": "(drive + w - v)/tau", "noise": 0.05, "jump": "kick"},
            "w": {"initial": 0.1, "derivative": "-w/5", "jump": "0.3*kick/tau", "each_step": "clip(w, -2, 2)"},
        },
        "spike": {"when": "v >= 1", "set": {"v": "reset", "w": "w - 0.2*v"}, "refractory": "rest", "hold": "v"},
        "outputs": {"rate": "0.5*spike + v", "current": "drive + kick"},
    },
    # no reset: fires once an upstroke
    "wave": {
        "time": "ms",
        "ports": ["kick"],
        "let": {"up": "x > 0.2", "it": "spike"},
        "state": {
            "x": {"initial": 0.15, "derivative": "y + 0.1*drive"},
            "y": {"initial": 0.4, "derivative": "-x", "jump": "-0.5*kick"},
        },
        "spike": {"when": "up", "refractory": 1.4},
        "activity": "x",
        "outputs": {"fired": "it"},
        "send": "fired",
    },
    # a map: nothing flows
    "map": {
        "parameters": {"keep": 0.7, "rest": 0.0015},
        "ports": {"kick": "sum", "gain": "product"},
        "state": {
            "u": {"initial": 0.2, "each_step": "keep*u + drive + 0.05*gain - 0.3*spike", "jump": "kick/2 + 2*kick*c"},
            "c": {"each_step": "0.5*c", "each_episode": "c/2"},
        },
        "spike": {
            "when": "f(u) > 0.5",
            "set": {"u": "u - 0.4", "c": "c + u"},
            "refractory": "rest + 0.001*c",
            "hold": ["u", "c"],
        },
        "activity": "f(u) + 0.1*spike",
        "outputs": {"both": "u - c"},
        "send": "spike",
    },
    # two that never fire
    "decay": {
        "ports": ["kick"],
        "state": {"g": {"initial": 0.3, "derivative": "0.2*drive - 300*g", "jump": "kick"}},
        "activity": "f(g)",
    },
    "hop": {"ports": ["kick"], "state": {"p": {"jump": "kick", "each_step": "0.5*p + 0.1*drive"}}, "activity": "p"},
}
#: what of each model can be sent, which of that is a spike or made of one
SENT: dict[str, list[str]] = {
    "lif": ["", "", "spike", "v", "w", "rate", "current"],
    "wave": ["", "spike", "x", "activity", "y"],
    "map": ["", "spike", "u", "both", "activity"],
    "decay": ["", "g"],
    "hop": ["", "p"],
    "static": [""],
    "leaky_integrator": ["", "v"],
}
SPIKES = {
    ("lif", ""),
    ("lif", "spike"),
    ("lif", "rate"),
    ("wave", ""),
    ("wave", "spike"),
    ("wave", "fired"),
    ("map", ""),
    ("map", "spike"),
    ("map", "activity"),
}
FIRING = ("lif", "wave", "map")
PORTS: dict[str, list[Plain]] = {
    "lif": ["drive", "kick", "kick", {"drive": 0.5, "kick": -0.3}],
    "wave": ["drive", "kick"],
    "map": ["drive", "kick", "kick", "gain", {"drive": 0.7, "kick": 1.2}, {"kick": 0.5, "gain": 1.5}],
    "decay": ["drive", "kick", {"drive": 0.1, "kick": 1}],
    "hop": ["drive", "kick", {"drive": -0.5, "kick": 0.7}],
    "static": ["drive"],
    "leaky_integrator": ["drive"],
}
#: the ports that derivatives read
FLOW = {"lif": "drive", "wave": "drive", "decay": "drive"}
#: states that synapses and rules can read of each
READ: dict[str, list[str]] = {
    "lif": ["v", "w", "current", "tau"],
    "wave": ["x", "y"],
    "map": ["u", "c", "both", "keep"],
    "decay": ["g", "activity"],
    "hop": ["p", "activity"],
    "static": ["activity"],
    "leaky_integrator": ["v", "activity"],
}
#: what reads X of its source and Y of its target; of those that wait for spikes and of those that do not
WAITING: list[dict[str, Plain]] = [
    {
        "time": "ms",
        "parameters": {"tau": 3},
        "state": {"g": {"derivative": "-g/tau", "on_pre": "g + weight"}},
        "signal": "g*(1.5 - post.Y)",
    },
    {
        "state": {
            "g": {"each_step": "0.7*g", "on_pre": "g + weight*(1 - 0.1*post.Y)"},
            "c": {"on_pre": "c + 1", "each_episode": "c/4"},
        },
        "signal": "g + 0.01*c",
    },
    {
        "time": "ms",
        "parameters": {"U": 0.5, "rec": 8},
        "let": {"u1": "u + U*(1 - u)"},
        "state": {
            "u": {"derivative": "-u/3", "on_pre": "u1"},
            "x": {"initial": 1, "derivative": "(1 - x)/rec", "on_pre": "x - u1*x"},
            "released": {"on_pre": "u1*x + 0.01*pre.X"},
        },
        "signal": "weight*released",
    },
    {"state": {"q": {"on_pre": "q + sent"}}, "signal": "weight*q*pre.X*0.1"},
]
#: whose signal is a spike: to no port that a derivative reads
INSTANT: list[dict[str, Plain]] = [
    {"state": {"r": {"initial": 1, "on_pre": "0.5*r", "each_step": "r + 0.1*(1 - r)"}}, "signal": "weight*r*spike"},
    {"signal": "weight*spike*(1 - 0.2*post.Y)"},
]
OTHER: list[dict[str, Plain]] = [
    {"signal": "0.3*weight*(pre.X - post.Y)"},
    {"state": {"s": {"each_step": "0.5*s + pre.X"}}, "signal": "0.2*weight*s"},
]
RULES: dict[str, dict[str, Plain]] = {
    "stdp": {
        "time": "ms",
        "parameters": {"up": 0.1},
        "state": {
            "a": {"derivative": "-a/5", "on_pre": "a + up"},
            "b": {"derivative": "-b/4", "on_post": "b - 0.12"},
        },
        "weight": {"on_pre": "weight + b", "on_post": "weight + a"},
    },
    "pre": {
        "state": {"n": {"on_pre": "n + 1", "each_step": "0.8*n", "each_episode": "n/2"}},
        "weight": {
            "on_pre": "weight*0.9 + 0.01*pre.X",
            "each_step": "weight + 0.01*n*spike",
            "each_episode": "0.95*weight",
        },
    },
    "post": {
        "parameters": {"up": 0.05},
        "state": {"m": {"initial": 0.1, "on_post": "m + up*post.Y"}},
        "weight": {"on_post": "weight - 0.1*m"},
    },
    "drift": {
        "time": "ms",
        "state": {"l": {"derivative": "0.1*(pre.X - l)"}},
        "weight": {"on_pre": "weight + 0.1*l", "derivative": "-0.01*weight + 0.001*l"},
    },
    "slow": {"signals": ["by"], "weight": {"each_step": "weight - 0.02*weight*by"}},
    "told": {
        "signals": ["by"],
        "state": {"told": {"on_pre": "0.5*told + by"}},
        "weight": {"on_post": "weight + 0.1*told"},
    },
}
DELAYS: list[Plain] = [
    None,
    None,
    1,
    1,
    2,
    7,
    "2.4 ms",
    {"seconds": "0.0012 + 0.001*i"},
    "uniform(1, 4)",
    "1 + (i + 2*j) % 3",
]
_STATES = {"lif": "v", "wave": "x", "map": "u", "decay": "g", "hop": "p", "leaky_integrator": "v"}


@st.composite
def spiking_specs(draw: st.DrawFn, most: int = 3) -> Spec:
    """A spec as a mapping, in which nothing is computed by functions whose last bits are those of a library; it may
    hold a cycle without delay, which the compiler refuses. Groups have up to ``most`` neurons."""
    return made_spec(random.Random(draw(st.integers(0, 2**32))), draw(st.integers(1, 4)), most)


def made_spec(chooser: random.Random, groups: int, most: int = 3) -> Spec:
    """The same by a generator of random numbers."""
    kinds = {f"G{letter}": chooser.choice([*FIRING, *SENT]) for letter in "abcd"[:groups]}
    kinds["Ga"] = chooser.choice(FIRING)
    sizes = {name: chooser.randint(1, most) for name in kinds}
    used = _Used({}, {})
    connections: dict[str, Plain] = {}
    order = list(kinds)
    for i, source in enumerate(order):
        for j, target in enumerate(order):
            if chooser.random() < 0.7:
                body = _connection(chooser, kinds[source], kinds[target], used, i < j, [*sizes.items()])
                if sizes[source] > 1 or sizes[target] > 1:
                    drawn: list[Plain] = ["all_to_all", {"random": {"probability": 0.7}}]
                    body["pattern"] = chooser.choice(drawn if sizes[source] * sizes[target] > 5 else drawn[:1])
                connections[f"{source} -> {target}"] = body
    return {
        "neurovis": 1,
        "name": "random",
        "seed": chooser.randrange(100),
        "time": {
            "dt": 0.001,
            "integrate": {
                "method": chooser.choice(["euler", "heun", "rk4", "semi_implicit"]),
                "substeps": chooser.choice([1, 1, 2]),
            },
            **({"episode": 5} if chooser.random() < 0.4 else {}),
        },
        "parameters": {"level": 1.6, "w": 0.6},
        "inputs": {
            "ramp": {"expression": "level*t*100 if t >= 0.003 else 1"},
            "pulse": {"expression": "1.5 if k % 3 == 1 else 0", "hold": True},
        },
        "models": MODELS,
        "synapses": used.synapses,
        "rules": used.rules,
        "neurons": {name: _group(chooser, kind, sizes[name]) for name, kind in kinds.items()},
        "connections": connections,
        "events": _events(chooser, kinds, connections),
    }


class _Used:
    """The synapses and rules of a spec, by what they are called in it."""

    def __init__(self, synapses: dict[str, Plain], rules: dict[str, Plain]) -> None:
        self.synapses, self.rules = synapses, rules


def _group(chooser: random.Random, kind: str, size: int) -> Plain:
    settled: Plain = {kind: {"leak": 0.3}}
    activations: list[Plain] = ["identity", {"clip": {"low": -0.9, "high": 0.8}}]
    group: dict[str, Plain] = {
        "model": settled if kind == "leaky_integrator" else kind,
        "activation": chooser.choice(activations),
        "bias": chooser.choice([0.3, 1.4, 2.5, "level"]),
    }
    if size > 1:
        group["count"] = size
    if kind == "lif" and size > 1:
        group["model"] = {kind: {"rest": [0.4 * i for i in range(size)]}}
    if chooser.random() < 0.5:
        port = chooser.choice(["drive", "kick"]) if "kick" in PORTS[kind] else "drive"
        group["input"] = {port: chooser.choice(["ramp", "pulse"])}
    if chooser.random() < 0.3:
        group["noise"] = "normal(0, 0.3)"
    return group


def _connection(
    chooser: random.Random, source: str, target: str, used: _Used, forward: bool, sizes: list[tuple[str, int]]
) -> dict[str, Plain]:
    body: dict[str, Plain] = {"weight": chooser.choice(["w*(1 + i - j)/2", 0.5, -0.4, "uniform(-1, 1)"])}
    sent, port = chooser.choice(SENT[source]), chooser.choice(PORTS[target])
    into_flow = FLOW.get(target, "") in (port if isinstance(port, dict) else (port,))
    synapses = [*OTHER, *([*WAITING, *([] if into_flow else INSTANT)] if source in FIRING else [])]
    joined = chooser.random() < 0.5 or (into_flow and (source, sent) in SPIKES)
    made: dict[str, Plain] = {}
    if joined and source in FIRING and (source, sent) in SPIKES and into_flow:
        synapses = WAITING[:3]
    delay = chooser.choice(DELAYS if not forward else [0, 0, *DELAYS])
    if joined:
        made = chooser.choice(synapses)
        if "spike" in str(made["signal"]) and delay == 0:
            delay = 1
        body["synapse"] = _named(used.synapses, _filled(chooser, made, source, target))
    if delay is not None:
        body["delay"] = delay
    if sent:
        body["send"] = sent
    if port != "drive":
        body["port"] = port
    rules = [name for name in RULES if _possible(name, source, target, sent)]
    names = chooser.sample(rules, min(len(rules), chooser.choice([0, 0, 1, 1, 2, 3])))
    if names:
        body["plasticity"] = [_rule(chooser, name, source, target, used, sizes) for name in names]
        if chooser.random() < 0.4:
            body["bounds"] = [-1.8, 1.8]
    return body


def _possible(name: str, source: str, target: str, sent: str) -> bool:
    """Whether a rule may be there: who it waits for fires."""
    text = json.dumps(RULES[name])
    return ("on_pre" not in text or source in FIRING) and ("on_post" not in text or target in FIRING)


def _rule(
    chooser: random.Random, name: str, source: str, target: str, used: _Used, sizes: list[tuple[str, int]]
) -> Plain:
    called = _named(used.rules, _filled(chooser, RULES[name], source, target))
    if "signals" not in RULES[name]:
        return (
            {called: {"up": "w/10"}}
            if "up" in str(RULES[name].get("parameters")) and chooser.random() < 0.5
            else called
        )
    single = [group for group, size in sizes if size == 1]
    return {called: {"by": chooser.choice([*single, "pulse"])}}


def _filled(chooser: random.Random, made: dict[str, Plain], source: str, target: str) -> Plain:
    """The same with names of what is there at the ends."""
    text = json.dumps(made).replace("pre.X", f"pre.{chooser.choice(READ[source])}")
    filled: Plain = json.loads(text.replace("post.Y", f"post.{chooser.choice(READ[target])}"))
    return filled


def _named(there: dict[str, Plain], made: Plain) -> str:
    """What a definition is called, which is put there if it is new."""
    name = next((name for name, one in there.items() if one == made), f"d{len(there)}")
    there[name] = made
    return name


def _taken_out(connections: dict[str, Plain]) -> list[Plain]:
    first: list[Plain] = [*islice(connections, 1)]
    return [{"at": 2, "lesion": first}, {"at": 7, "mend": first}] if first else []


def _events(chooser: random.Random, kinds: dict[str, str], connections: dict[str, Plain]) -> list[Plain]:
    first, last = kinds["Ga"], list(kinds)[-1]
    events: list[Plain] = [
        {"at": 4, "set": {"level": 2.5, "w": -0.5}},
        {"from": 3, "to": 7, "clamp": {"Ga": chooser.choice([1, 0, 0.5])}},
        {"from": 8, "to": 10, "clamp": {f"Ga.{_STATES[first]}": 1.2}},
        {"at": 6, "lesion": [last]},
        {"at": 9, "mend": [last]},
        *_taken_out(connections),
    ]
    for name, body in connections.items():
        if isinstance(body, dict) and "plasticity" in body:
            events += [{"at": 5, "learning": {name: False}}, {"at": 8, "learning": {name: True}}]
            break
    return chooser.sample(events, chooser.randint(0, len(events)))
