"""Random specs of what learns: groups whose models have states and outputs, connections of several rules, which see
states and outputs of any group and of both ends, and whose own flow, with synapses that read their weights; always
legal, never explosive."""

from __future__ import annotations

import random

from hypothesis import strategies as st
from random_specs import Plain, Spec

#: states by each_step and by derivative, outputs
_MODELS: dict[str, Plain] = {
    "stepping": {
        "parameters": {"keep": 0.5},
        "state": {"v": {"each_step": "keep*v + 0.3*drive"}, "w": {"each_step": "0.5*v"}},
        "outputs": {"twice": "2*v - w"},
        "activity": "f(v)",
    },
    "flowing": {
        "time": "ms",
        "parameters": {"keep": 40},
        "state": {"v": {"initial": 0.1, "derivative": "(0.5*drive - v)/keep"}, "w": {"each_step": "0.5*v"}},
        "outputs": {"twice": "2*v + 0.1*drive"},
        "activity": "f(v)",
    },
}
_RULES: dict[str, Plain] = {
    "chase": {
        "signals": ["error", "gain"],
        "state": {"seen": {"each_step": "0.5*seen + 0.1*tanh(gain)*pre", "each_episode": "seen/2"}},
        "weight": {"each_step": "weight - 0.01*tanh(error)*seen"},
    },
    "fade": {
        "parameters": {"rate": 0.05},
        "state": {"mean": {"each_step": "mean + rate*(post - mean)"}},
        "weight": {"each_step": "weight - rate*weight", "each_episode": "weight + 0.01*mean"},
    },
    "follow": {
        "time": "ms",
        "signals": ["of"],
        "state": {
            "a": {"initial": 0.2, "derivative": "(pre.v - a)/20 + pre/40"},
            "b": {"derivative": "(tanh(post.twice) + 0.1*tanh(of) - b)/30", "each_episode": "b/2"},
            "c": {"each_step": "0.5*c + pre.w"},
        },
        "weight": {"derivative": "0.001*(a*post.v - b*weight + tanh(c))"},
    },
    "near": {
        "state": {"apart": {"derivative": "-10*apart + pre.twice - post"}},
        "weight": {"each_step": "weight + 0.01*tanh(post.w - apart) - pre.keep/10000"},
    },
    "move": {"centre": {"each_step": "centre + 0.1*tanh(pre - centre)", "each_episode": "0.9*centre"}},
    "grow": {
        "parameters": {"step": 0.01},
        "signals": ["by"],
        "let": {"both": "tanh(pre)*tanh(by)"},
        "weight": {"each_step": "weight + step*both"},
    },
}
#: what clamps can hold of each
_HELD = {
    "chase": ["seen"],
    "fade": ["mean"],
    "follow": ["a", "b", "c"],
    "near": ["apart"],
    "move": ["centre"],
    "grow": [],
}
_SYNAPSES: dict[str, Plain] = {
    "pull": {"signal": "weight*(tanh(pre.v) - 0.1*post.w)"},
    "slow": {
        "state": {"g": {"each_step": "0.5*g + 0.5*weight*pre", "each_episode": "g/2"}},
        "signal": "g - 0.1*weight*post.twice",
    },
}


@st.composite
def learning_specs(draw: st.DrawFn) -> Spec:
    """A spec as a mapping."""
    chooser = random.Random(draw(st.integers(0, 2**32)))
    sizes = {f"G{letter}": chooser.choice([1, 2, 3]) for letter in "abcd"[: draw(st.integers(1, 4))]}
    wave: dict[str, Plain] = {"expression": "sin(k/3)"}
    neurons: dict[str, Spec] = {
        name: {
            "count": size,
            "model": chooser.choice([*_MODELS, "stepping"]),
            "bias": round(chooser.uniform(-0.5, 0.5), 2),
            "combine": "distance" if chooser.random() < 0.3 else "sum",
            "activation": chooser.choice(["tanh", "sigmoid"]),
            **({"input": "wave"} if chooser.random() < 0.5 else {}),
        }
        for name, size in sizes.items()
    }
    connections: dict[str, Spec] = {}
    for source in sizes:
        for target in sizes:
            if chooser.random() < 0.6:
                by_distance = neurons[target]["combine"] == "distance"
                connections[f"{source} -> {target}"] = _body(chooser, sizes, source, target, by_distance)
    time: dict[str, Plain] = {"dt": 0.01, "episode": 4, "integrate": chooser.choice(["heun", "rk4", "exponential"])}
    return {
        "neurovis": 1, "name": "learning", "seed": chooser.randrange(100), "time": time, "inputs": {"wave": wave},
        "models": _MODELS, "rules": _RULES, "synapses": _SYNAPSES,
        "neurons": {**neurons}, "connections": {**connections},
        "events": _events(chooser, [*sizes], connections),
    }  # fmt: skip


def _events(chooser: random.Random, groups: list[str], connections: dict[str, Spec]) -> list[Plain]:
    learning = [name for name, body in connections.items() if "plasticity" in body]
    events: list[Plain] = []
    if learning:
        name = chooser.choice(learning)
        events += [{"at": 2, "learning": {name: False}}, {"at": 5, "learning": {name: True}}]
        events += [{"at": 3, "lesion": chooser.choice(learning)}] if chooser.random() < 0.5 else []
        rules = str(connections[name]["plasticity"])
        states = [f"({name}).{state}" for rule, own in _HELD.items() if f"'{rule}'" in rules for state in own]
        events += [{"from": 3, "to": 6, "clamp": {chooser.choice(states): 0.2}}] if states else []
    lost = chooser.choice(groups)
    return [*events, {"at": 4, "lesion": lost}, {"at": 6, "mend": lost}, {"from": 5, "to": 7, "clamp": {lost: 0.3}}]


def _body(chooser: random.Random, sizes: dict[str, int], source: str, target: str, by_distance: bool) -> Spec:
    body: Spec = {"weight": "uniform(-0.3, 0.3)", "pattern": "all_to_all", "self": True}
    delays: list[Plain] = [1, 1, 2, 3, {"seconds": 0.023}]
    body["delay"] = chooser.choice(delays)
    if chooser.random() < 0.2:
        del body["delay"]
    rules = chooser.sample([*_RULES], chooser.choice([0, 1, 2, 2, 3, 4]))
    if by_distance:
        body["centre"] = "uniform(-1, 1)"
    elif "move" in rules:
        rules.remove("move")
    if rules:
        body["plasticity"] = [_used(chooser, rule, sizes, source, target) for rule in rules]
        if chooser.random() < 0.4 and rules != ["move"]:
            body["bounds"] = [-0.31, 0.31]
    if not by_distance and chooser.random() < 0.4:
        body["synapse"] = chooser.choice([*_SYNAPSES])
    return body


def _used(chooser: random.Random, rule: str, sizes: dict[str, int], source: str, target: str) -> Plain:
    if rule == "fade":
        return "fade" if chooser.random() < 0.5 else {"fade": {"rate": 0.02}}
    if rule in ("near", "move"):
        return rule
    signals = {"chase": ["error", "gain"], "grow": ["by"], "follow": ["of"]}[rule]
    return {rule: {name: _signal(chooser, sizes, source, target) for name in signals}}


def _signal(chooser: random.Random, sizes: dict[str, int], source: str, target: str) -> Plain:
    end, by_source = (source, True) if chooser.random() < 0.5 else (target, False)
    fitting = [name for name, size in sizes.items() if size in (1, sizes[end])]
    what: Plain = chooser.choice(fitting) + chooser.choice(["", ".v", ".twice"])
    if chooser.random() < 0.2:
        what = "wave"
    elif chooser.random() < 0.2:  # of several, one after the other
        name = chooser.choice([*sizes])
        first = f"{name if sizes[name] == 1 else f'{name}1'}.w"
        what = [first, *["wave"] * (sizes[end] - 1)]
    return {"from": what} if by_source else what
