"""Undefined operations that no number of a run shows: one warning, the same whatever computes the steps."""

from __future__ import annotations

import math
import random
import warnings
from pathlib import Path

import numpy as np
import pytest
from fuzz_expressions import NAMES, make

import neurovis_spec as nv
from neurovis_spec.language.expressions.evaluate import evaluate
from neurovis_spec.language.expressions.functions import CONSTANTS
from neurovis_spec.language.expressions.parser import parse
from neurovis_spec.language.expressions.tree import (
    Binary,
    Call,
    Chain,
    Conditional,
    ExpressionError,
    Name,
    Tree,
    names,
)
from neurovis_spec.language.expressions.undefined import either, hazards

BACKENDS = ["reference", "numpy", pytest.param("c", marks=pytest.mark.compiler)]
SPEC = """
neurovis: 1
name: hiding
time: {{dt: 1, steps: 40, episode: 10}}
parameters: {{scale: 1, zero: 0}}
inputs:
  ramp: {{expression: k - 7}}
activations:
  steep: {{parameters: {{s: 1}}, value: "tanh(s/x)"}}
  split: {{parameters: {{s: 1}}, value: "clip(x/s, -1, 1)"}}
models:
  m: {{parameters: {{s: 1}}, {model}}}
rules:
  r: {{parameters: {{c: 1}}, {rule}}}
neurons:
  I: {{input: ramp}}
  A: {{count: 3, model: m, {neuron}}}
  B: {{}}
connections:
  I -> A: {{delay: 0}}
  A -> B: {{plasticity: r, delay: 0, bounds: [-1, 9]}}
{more}
"""
HIDDEN = ", which the rest of the formula hides, in 'hiding'"


def spec(
    model: str = "activity: f(drive)",
    neuron: str = "activation: identity",
    rule: str = "weight: {each_step: weight + c*pre*0}",
    more: str = "",
) -> nv.CompiledNetwork:
    return nv.compile_text(SPEC.format(model=model, neuron=neuron, rule=rule, more=more))


def told(network: nv.CompiledNetwork, backend: str) -> list[str]:
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        network.run(backend=backend)
    return [str(one.message) for one in found]


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize(
    ("parts", "message"),
    [
        ({"model": 'activity: "clip(1/drive, -1, 1)"'}, "the model 'm' divides by 0 for A1 at step 7"),
        ({"model": 'activity: "max(log(drive^2), 0)"'}, "the model 'm' takes the logarithm of 0 for A1 at step 7"),
        (
            {"model": 'let: {y: sqrt(drive)}, activity: "1 if y > 1 else 0"'},
            "the model 'm' takes the square root of a number below 0 for A1 at step 0",
        ),
        (
            {"model": 'let: {y: 1/drive}, activity: "tanh(y) + (1 if acos(drive/9) > 1 else 0)"'},
            "the model 'm' has an undefined operation for A1 at step 7",
        ),
        (
            {"model": "state: {v: {initial: 3, each_step: v - 1}}, activity: f(v)", "neuron": "activation: steep"},
            "the activation 'steep' divides by 0 for A1 at step 2",
        ),
        (
            {"model": 'activity: "1 if f(drive) > 0.5 else 0"', "neuron": "activation: steep"},
            "the activation 'steep' divides by 0 for A1 at step 7",
        ),
        (
            {"model": "state: {v: {initial: 0, each_step: v + 1, each_episode: exp(-1/(k - 19)^2)}}, activity: f(v)"},
            "the model 'm' divides by 0 for A1 at step 19",
        ),
        (
            {"model": 'state: {v: {derivative: "clip(1/drive, -1, 1)"}}, activity: v'},
            "the model 'm' divides by 0 for A1 at step 7",
        ),
        (
            {"model": 'state: {v: {derivative: 1/drive, each_step: "clip(v, -1, 1)"}}, activity: v'},
            "the model 'm' divides by 0 for A1 at step 7",
        ),
        (
            {
                "model": "let: {y: f(drive)}, state: {v: {derivative: y - v}}, activity: v",
                "neuron": "activation: steep",
            },
            "the activation 'steep' divides by 0 for A1 at step 7",
        ),
        (
            {"model": "state: {v: {each_step: v + f(drive)}}, activity: v", "neuron": "activation: steep"},
            "the activation 'steep' divides by 0 for A1 at step 7",
        ),
        (
            {"model": 'state: {v: {derivative: drive}}, outputs: {o: "tanh(1/drive)"}, activity: v'},
            "the model 'm' divides by 0 for A1 at step 7",
        ),
        (
            {"rule": 'weight: {each_step: "weight + min(1/pre, 0.01)"}'},
            "the rule 'r' divides by 0 for A1 -> B after step 7",
        ),
        ({"rule": "weight: {each_step: weight + 1/pre}"}, "the rule 'r' divides by 0 for A1 -> B after step 7"),
        (
            {"neuron": 'noise: "clip(normal(0, 1)/(k - 5), -1, 1)"'},
            "the noise of A1 has an undefined operation at step 5",
        ),
        (
            {"neuron": "activation: {split: {s: scale}}", "more": "events: [{at: 9, set: {scale: 0}}]"},
            "the activation 'split' divides by 0 for A1 at step 9",
        ),
    ],
)
def test_what_is_undefined_and_hidden_is_told_once(parts: dict[str, str], message: str, backend: str) -> None:
    assert told(spec(**parts), backend) == [message + HIDDEN]


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize(
    "parts",
    [
        {"model": 'activity: "clip(1/drive, -1, 1) if drive != 0 else 0"'},
        {"model": 'let: {y: 1/drive}, activity: "0 if drive == 0 else tanh(y)"'},
        {"model": 'activity: "1 if drive != 0 and 1/drive > 0.5 else 0"'},
        {"model": 'activity: "1/(1 + exp(-300*drive))"'},
        {"model": "state: {v: {derivative: exprel(drive) - v}}, activity: tanh(v)"},
        {"model": 'activity: "clip(exp(1000*drive), 0, 1)"'},
        {"model": 'activity: "tanh(drive/s) + clip(drive % 3, 0, 1) + exp(-drive^2)"'},
        {"rule": 'weight: {each_step: "weight + (min(1/pre, 0.01) if pre > 0 else 0)"}'},
        {"model": 'activity: "tanh(1/drive)"', "more": "events: [{at: 3, lesion: [A, A -> B]}]"},
    ],
)
def test_what_is_not_computed_and_what_only_overflows_is_not_told(parts: dict[str, str], backend: str) -> None:
    assert told(spec(**parts), backend) == []


@pytest.mark.parametrize("backend", BACKENDS)
def test_an_input_that_hides_it_is_told_but_not_one_that_a_caller_replaces(backend: str) -> None:
    network = nv.compile_text(
        "neurovis: 1\nname: t\ninputs: {wave: {expression: 'clip(1/(k - 3), -1, 1)'}}\nneurons: {A: {input: wave}}\n"
    )
    with pytest.warns(RuntimeWarning, match="the input 'wave' of A has an undefined operation at step 3") as found:
        network.run(steps=300, backend=backend)
    assert len(found) == 1
    simulation = network.simulator(backend=backend)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for k in range(10):
            simulation.step({"wave": 1.0} if k == 3 else {})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        network.run(steps=10, inputs={"wave": 0.5}, backend=backend)


def test_checks_change_no_number_and_nobody_sees_them(tmp_path: Path) -> None:
    counting = "state: {{v: {{initial: 0, each_step: v + 1}}}}, activity: {}"
    network = spec(model=counting.format('"clip(f(v)/drive, -1, 1)"'))
    with pytest.warns(RuntimeWarning):
        found = network.run(states="A.v")
    drive, v = np.arange(40.0) - 7, np.arange(1, 41.0)
    with np.errstate(divide="ignore"):
        np.testing.assert_array_equal(found["A"], np.clip(v / drive, -1, 1)[:, None] * np.ones(3))
    assert found.state_names == ("A1.v", "A2.v", "A3.v")
    shown = spec(model=counting.format("f(v)/drive"))
    for one in (network, shown):
        one.export(tmp_path / one.hash)
    header, plain = ((tmp_path / one.hash / "hiding.h").read_text() for one in (network, shown))
    assert header == plain.replace(shown.hash, network.hash)


@pytest.mark.parametrize(
    ("parts", "messages"),
    [
        (
            {
                "model": "activity: 1/drive + log(drive)",
                "rule": "state: {q: {initial: 0, each_step: 1/pre}}, weight: {each_step: weight + c*q*0}",
            },
            ["the activity of A1 is nan at step 0, in 'hiding'"],
        ),
        ({"model": 'activity: "clip(drive/s, -1, 1)"'}, []),
    ],
)
def test_only_what_is_hidden_is_told_as_hidden(parts: dict[str, str], messages: list[str]) -> None:
    assert told(spec(**parts), "numpy") == messages


def lazily(tree: Tree, known: dict[str, float]) -> tuple[float, bool, bool]:
    """The value of an expression of which only what counts is computed; whether something undefined was, and whether
    something overflowed."""
    match tree:
        case Conditional(condition=condition, then=then, otherwise=otherwise):
            parts = [lazily(condition, known)]
            parts.append(lazily(then if parts[0][0] != 0 else otherwise, known))
            value = parts[1][0]
        case Chain(operators=("and" | "or" as sign, *_), operands=operands):
            parts, value = [], float(sign == "and")
            for operand in operands:
                parts.append(lazily(operand, known))
                if (parts[-1][0] != 0) != (sign == "and"):
                    value = 1.0 - value
                    break
        case Chain(operands=(first, *_)):
            value, undefined, overflown = lazily(first, known)
            for joined, operand in tree.steps:
                right = lazily(operand, known)
                value, wrong, beyond = one(Chain((joined,), (Name("0"), Name("1"))), (value, right[0]))
                undefined, overflown = undefined or right[1] or wrong, overflown or right[2] or beyond
            return value, undefined, overflown
        case _:
            parts = [lazily(part, known) for part in tree.parts]
            own = tree.having(tuple(Name(str(place)) for place in range(len(parts))))
            made = one(own, tuple(part[0] for part in parts), known)
            parts.append(made)
            value = made[0]
    return value, any(part[1] for part in parts), any(part[2] for part in parts)


def one(tree: Tree, given: tuple[float, ...], known: dict[str, float] | None = None) -> tuple[float, bool, bool]:
    """The value of one operation; whether it is undefined, or overflows."""
    value = evaluate(tree, {**(known or {}), **{str(place): number for place, number in enumerate(given)}})
    if not all(map(math.isfinite, given)) or math.isfinite(value):
        return value, False, False
    divides = isinstance(tree, Chain) and tree.operators[0] in ("/", "%") and given[1] == 0
    pole = isinstance(tree, Call) and tree.function in ("log", "log1p")
    powers = isinstance(tree, Binary) or (isinstance(tree, Call) and tree.function == "pow")
    undefined = divides or pole or math.isnan(value) or (powers and given[0] == 0)
    return value, undefined, not undefined


SPIKING = """
neurovis: 1
name: spiking
time: {dt: 1 ms, steps: 20}
parameters: {zero: 0}
models:
  cell:
    time: ms
    parameters: {z: 0}
    ports: [kick]
    state: {v: {initial: 0.2, derivative: (drive - v)/5, jump: JUMP}}
    spike: {when: WHEN, set: {v: SET}, refractory: 2, hold: v}
    activity: ACTIVITY
    send: spike
synapses: {s: {parameters: {z: 0}, state: {g: {on_pre: SYNAPSE}}, signal: g}}
rules: {r: {parameters: {z: 0}, weight: {on_pre: ARRIVES, on_post: FIRES}}}
neurons: {A: {count: 2, model: {cell: {z: zero}}, bias: 2}, B: {count: 2, model: cell, bias: 1.5}, C: {}}
connections:
  A -> B: {weight: 0.1, port: kick, delay: DELAY, pattern: all_to_all, plasticity: {r: {z: zero}}}
  A -> C: {synapse: {s: {z: zero}}, delay: 0, weight: 1}
"""
PLAIN = {
    "JUMP": "kick",
    "WHEN": "v >= 1",
    "SET": "0",
    "ACTIVITY": "spike",
    "SYNAPSE": "g + weight",
    "ARRIVES": "weight",
    "FIRES": "weight",
    "DELAY": "1",
}
HIDES = '"clip(1/z, 0, 1)"'


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({}, ""),
        ({"JUMP": '"kick*clip(1/z, -1, 1)"'}, "the model 'cell' divides by 0 for A1 at step 1"),
        ({"WHEN": "v >= 1 and 1/z > 0"}, "the model 'cell' divides by 0 for A1 at step 3"),
        ({"SET": HIDES}, "the model 'cell' divides by 0 for A1 at step 3"),
        ({"ACTIVITY": '"clip((1 + spike)/z, 0, 1)"'}, "the model 'cell' divides by 0 for A1 at step 1"),
        ({"SYNAPSE": HIDES}, "the synapse 's' divides by 0 for A1 -> C after step 3"),
        ({"ARRIVES": HIDES, "DELAY": "2"}, "the rule 'r' divides by 0 for A1 -> B1 after step 5"),
        ({"FIRES": HIDES, "DELAY": "0"}, "the rule 'r' divides by 0 for A1 -> B1 after step 4"),
    ],
)
def test_what_spikes_bring_about_is_looked_at_when_it_is_computed(
    backend: str, changed: dict[str, str], message: str
) -> None:
    """Where a neuron jumps, where it fires, in its activity behind that, and at connections that wait for it alone."""
    text = SPIKING
    for name, formula in (PLAIN | changed).items():
        text = text.replace(name, formula)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        nv.compile_text(text).run(backend=backend)
    assert [str(one.message)[: len(message)] for one in told] == ([message] if message else [])


@pytest.mark.parametrize("seed", range(2))
def test_what_is_told_of_is_computed_and_hidden(seed: int) -> None:
    """Laws: where a hazard is told of, something undefined is computed; where something undefined is computed and none
    is, the value shows it."""
    told = missed = shown = 0
    for number in range(4000):
        try:
            tree = parse(make(seed, number))
        except ExpressionError:
            continue
        if not names(tree) <= {*NAMES, *CONSTANTS}:
            continue
        found = hazards(tree).found
        chooser = random.Random(number)
        for _ in range(6):
            values = {name: chooser.choice((-2.0, -1.0, 0.0, 0.5, 1.0)) for name in NAMES} | dict(CONSTANTS)
            value, undefined, overflown = lazily(tree, values)
            tells = bool(found) and evaluate(either(hazard.formula for hazard in found), values) != 0
            if overflown:
                continue
            assert undefined or not tells, make(seed, number)
            told, shown = told + tells, shown + (undefined and not tells)
            missed += undefined and not tells and math.isfinite(value)
    assert missed == 0
    assert told > 20
    assert shown > 100
