"""Ten networks in the shapes of those that others draw, for which neither layouts nor pictures were tuned: as specs,
made the same way on every machine. Their sizes are those of the originals, their wiring is drawn."""

from __future__ import annotations

from collections.abc import Callable
from random import Random

#: Probabilities of connections between the populations of Potjans and Diesmann (2014): a row a target.
_POPULATIONS = ("L23E", "L23I", "L4E", "L4I", "L5E", "L5I", "L6E", "L6I")
_SIZES = (207, 58, 219, 55, 49, 11, 144, 29)
_PROBABLE = (
    (0.1009, 0.1689, 0.0437, 0.0818, 0.0323, 0.0, 0.0076, 0.0),
    (0.1346, 0.1371, 0.0316, 0.0515, 0.0755, 0.0, 0.0042, 0.0),
    (0.0077, 0.0059, 0.0497, 0.135, 0.0067, 0.0003, 0.0453, 0.0),
    (0.0691, 0.0029, 0.0794, 0.1597, 0.0033, 0.0, 0.1057, 0.0),
    (0.1004, 0.0622, 0.0505, 0.0057, 0.0831, 0.3726, 0.0204, 0.0),
    (0.0548, 0.0269, 0.0257, 0.0022, 0.06, 0.3158, 0.0086, 0.0),
    (0.0156, 0.0066, 0.0211, 0.0166, 0.0572, 0.0197, 0.0396, 0.2252),
    (0.0364, 0.001, 0.0034, 0.0005, 0.0277, 0.008, 0.0658, 0.1443),
)


def _spec(name: str, *lines: str) -> str:
    return "\n".join(["neurovis: 1", f"name: {name}", "time: {steps: 3}", *lines, ""])


def connectome() -> str:
    """Of 302 neurons of five classes 3,709 connections, as a list of edges."""
    random, classes = Random(302), {"sensory": 83, "inter": 81, "command": 10, "motor": 108, "pharynx": 20}
    names = {kind: [f"{kind}{i + 1}" for i in range(count)] for kind, count in classes.items()}
    kinds = list(names)
    found: dict[tuple[str, str], float] = {}
    likely = (("sensory", "inter"), ("inter", "inter"), ("inter", "command"), ("command", "motor"), ("motor", "motor"))
    while len(found) < 3709:
        if random.random() < 0.06:
            a, b = ("pharynx", "pharynx")
        elif random.random() < 0.7:
            a, b = random.choice(likely)
        else:
            a, b = random.choice(kinds[:4]), random.choice(kinds[:4])
        ends = names[a][int(len(names[a]) * random.random() ** 2)], random.choice(names[b])
        if ends[0] != ends[1]:
            found[ends] = round(random.choice((1, 1, 1, -1)) * random.lognormvariate(0, 1), 3)
    groups = [f"  {kind}: {{count: {count}}}" for kind, count in classes.items()]
    rows = [f"      - [{a}, {b}, {weight}]" for (a, b), weight in found.items()]
    everybody = " + ".join(kinds)
    return _spec(
        "connectome", "neurons:", *groups, "connections:", f"  {everybody} -> {everybody}:", "    edges:", *rows
    )


def potjans_diesmann() -> str:
    """Eight populations of four layers of cortex, 772 neurons in all."""
    groups, lines = [], []
    for name, size in zip(_POPULATIONS, _SIZES, strict=True):
        groups.append(f"  {name}: {{count: {size}, box: {name[:-1]}}}")
    for target, row in zip(_POPULATIONS, _PROBABLE, strict=True):
        for source, likely in zip(_POPULATIONS, row, strict=True):
            weight = "normal(0.15, 0.015)" if source.endswith("E") else "normal(-0.6, 0.06)"
            if likely > 0.001:
                lines.append(
                    f"  {source} -> {target}: {{pattern: {{random: {{probability: {likely}}}}}, weight: {weight!r}}}"
                )
    return _spec("microcircuit", "neurons:", *groups, "connections:", *lines)


def balanced() -> str:
    """A recurrent network of 800 that learns what excites."""
    return _spec(
        "balanced",
        "neurons: {E: {count: 640, bias: 0.1}, I: {count: 160}}",
        "connections:",
        "  E -> E: {pattern: {fixed_indegree: {count: 8}}, weight: 0.2, plasticity: {hebbian: {rate: 0.001}}}",
        "  E -> I: {pattern: {fixed_indegree: {count: 8}}, weight: 0.2}",
        "  I -> E + I: {pattern: {fixed_indegree: {count: 4}}, weight: -0.8}",
    )


def hierarchy() -> str:
    """Three levels of areas that drive the next and are modulated by it: 450 neurons."""
    names = [f"{area}{side}" for area in ("V1", "V2", "V4", "IT", "PFC") for side in ("l", "r")]
    lines = []
    for place, name in enumerate(names):
        lines.append(f"  {name} -> {name}: {{pattern: {{random: {{probability: 0.05}}}}, weight: -0.2}}")
        if place + 2 < len(names):
            above = names[place + 2]
            lines.append(f"  {name} -> {above}: {{pattern: {{random: {{probability: 0.1}}}}, weight: 0.5}}")
            lines.append(f"  {above} -> {name}: {{pattern: {{random: {{probability: 0.03}}}}, weight: 0.1}}")
    groups = [f"  {name}: {{count: 45, box: {name}}}" for name in names]
    return _spec("hierarchy", "neurons:", *groups, "connections:", *lines)


def reservoir() -> str:
    """An input, 300 units that drive each other, an output that learns to read them."""
    return _spec(
        "reservoir",
        "neurons: {U: {count: 3, bias: 1}, R: {count: 300, activation: tanh}, Y: {count: 2}}",
        "inputs: {target: {}}",
        "connections:",
        "  U -> R: {pattern: {random: {probability: 0.3}}, weight: 'uniform(-1, 1)'}",
        "  R -> R: {pattern: {random: {probability: 0.05}}, weight: 'normal(0, 0.25)'}",
        "  R -> Y: {pattern: all_to_all, weight: 0, plasticity: {delta: {target: target, rate: 0.01}}}",
    )


def joints() -> str:
    """Six legs of three joints, each a module of twelve neurons: 216 in all."""
    legs = [f"  leg{i + 1}_{joint}: {{module: joint}}" for i in range(6) for joint in ("coxa", "femur", "tibia")]
    lines = []
    for i in range(6):
        for a, b in (("coxa", "femur"), ("femur", "tibia")):
            lines.append(f"  leg{i + 1}_{a}.P -> leg{i + 1}_{b}.P: {{pattern: one_to_one, weight: 0.5}}")
        lines.append(f"  leg{i + 1}_coxa.P -> leg{(i + 1) % 6 + 1}_coxa.P: {{pattern: one_to_one, weight: -0.3}}")
    return _spec(
        "joints",
        "modules:",
        "  joint:",
        "    neurons: {S: {count: 4}, P: {count: 4, bias: 0.2}, M: {count: 4}}",
        "    connections:",
        "      S -> P: {pattern: all_to_all, weight: 0.2}",
        "      P -> P: {pattern: ring, weight: -0.4}",
        "      P -> M: {pattern: one_to_one, weight: 1}",
        "      M -> S: {pattern: one_to_one, weight: -1}",
        "instances:",
        *legs,
        "connections:",
        *lines,
    )


def brunel() -> str:
    """Sparse excitation and inhibition of 500 cells that spike."""
    return _spec(
        "brunel",
        "neurons:",
        "  E: {count: 400, model: lif, bias: 24}",
        "  I: {count: 100, model: lif, bias: 24}",
        "connections:",
        "  E -> E + I: {pattern: {fixed_indegree: {count: 40}}, weight: 0.4, port: pulses}",
        "  I -> E + I: {pattern: {fixed_indegree: {count: 10}}, weight: -2, port: pulses}",
    ).replace("{steps: 3}", "{dt: 0.1 ms, steps: 3}")


def perceptron() -> str:
    """Layers, all to all."""
    return _spec(
        "perceptron",
        "neurons: {X: {count: 64}, H: {count: 48, activation: tanh}, G: {count: 24, activation: tanh}, Y: {count: 10}}",
        "connections:",
        "  X -> H: {pattern: all_to_all, weight: 'normal(0, 0.2)'}",
        "  H -> G: {pattern: all_to_all, weight: 'normal(0, 0.2)'}",
        "  G -> Y: {pattern: all_to_all, weight: 'normal(0.1, 0.2)'}",
    )


def pattern_generator() -> str:
    """Two halves that inhibit each other, each with what it drives: everything is drawn."""
    return _spec(
        "cpg",
        "neurons: {left: {count: 2, bias: 0.1}, right: {count: 2}, flexor: {count: 2}, extensor: {count: 2}}",
        "connections:",
        "  left -> right: {pattern: all_to_all, weight: -1.2}",
        "  right -> left: {pattern: all_to_all, weight: -1.2}",
        "  left -> flexor: {pattern: all_to_all, weight: 0.8, plasticity: {hebbian: {rate: 0.01}}}",
        "  right -> extensor: {pattern: all_to_all, weight: 0.8}",
    )


def worm() -> str:
    """Segments of a worm in a chain, each of the four kinds of motor neurons: everything is drawn."""
    kinds = ("DB", "VB", "DD", "VD")
    groups = [f"  {kind}: {{count: 6}}" for kind in kinds]
    return _spec(
        "worm",
        "neurons:",
        *groups,
        "connections:",
        "  DB -> DB: {pattern: chain, weight: 0.5}",
        "  VB -> VB: {pattern: chain, weight: 0.5}",
        "  DB -> VD: {pattern: one_to_one, weight: 0.8}",
        "  VB -> DD: {pattern: one_to_one, weight: 0.8}",
        "  VD -> VB: {pattern: one_to_one, weight: -1}",
        "  DD -> DB: {pattern: one_to_one, weight: -1}",
    )


NETWORKS: dict[str, Callable[[], str]] = {
    made.__name__: made
    for made in (
        *(connectome, potjans_diesmann, balanced, hierarchy, reservoir),
        *(joints, brunel, perceptron, pattern_generator, worm),
    )
}
