"""Laws that hold for every network: order and names do not matter, backends agree, every neuron has one place."""

from __future__ import annotations

import json
import random
import re

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from laws import examples
from random_specs import Plain, Spec, section, specs

import neurovis_spec as nv
from neurovis_spec.runtime.recording import Recording

STEPS = 40
LAW = settings(examples(20), suppress_health_check=[HealthCheck.too_slow])
#: A layout takes longer than all else; that of any problem is held to the laws of test_layout_engines.py as well.
LAID_OUT = settings(examples(6), suppress_health_check=[HealthCheck.too_slow])


def by_name(recording: Recording) -> tuple[dict[str, list[float]], dict[str, list[float]]]:
    activity = {name: recording[name].tolist() for name in recording.neurons}
    weights = {name: recording.weight(name).tolist() for name in recording.connection_names}
    return activity, weights


def assert_same(one: Recording, other: Recording) -> None:
    for first, second in zip(by_name(one), by_name(other), strict=True):
        assert first.keys() == second.keys()
        for name in first:
            np.testing.assert_allclose(first[name], second[name], rtol=0, atol=1e-12, err_msg=name)


def shuffled(mapping: dict[str, Plain], seed: int) -> dict[str, Plain]:
    items = list(mapping.items())
    random.Random(seed).shuffle(items)
    return dict(items)


@LAW
@given(specs(), st.integers(0, 1000))
def test_the_order_of_the_spec_permutes_the_result_and_changes_nothing_else(spec: Spec, seed: int) -> None:
    other = {
        **shuffled(spec, seed),
        "neurons": shuffled(section(spec, "neurons"), seed),
        "connections": shuffled(section(spec, "connections"), seed + 1),
    }
    assert_same(nv.compile(spec).run(STEPS), nv.compile(other).run(STEPS))


@LAID_OUT
@given(specs(), st.integers(0, 1000))
def test_the_order_of_the_spec_does_not_show_in_the_layout(spec: Spec, seed: int) -> None:
    other = {
        **spec,
        "neurons": shuffled(section(spec, "neurons"), seed),
        "connections": shuffled(section(spec, "connections"), seed + 1),
    }
    assert nv.compile(spec).layout().dump() == nv.compile(other).layout().dump()


@LAID_OUT
@given(specs())
def test_renaming_changes_nothing_else(spec: Spec) -> None:
    """Every group takes a new name that keeps the order, and as wide a one, for which the same room is kept; draws,
    which depend on names, are replaced by numbers."""
    text = json.dumps(spec).replace("uniform(-0.3, 0.3)", "0.1*sin(3*i + j)")
    renamed = re.sub(r"\bG([a-e])", r"O\1", text)
    one, other = nv.compile(json.loads(text)), nv.compile(json.loads(renamed))
    first, second = one.run(STEPS), other.run(STEPS)
    assert [name.replace("G", "O") for name in first.neurons] == list(second.neurons)
    np.testing.assert_array_equal(first.activity, second.activity)
    np.testing.assert_array_equal(first.weights, second.weights)
    layouts = one.layout().positions, other.layout().positions
    assert {name.replace("G", "O"): at for name, at in layouts[0].items()} == dict(layouts[1])


@LAW
@given(specs())
def test_backends_agree_with_the_reference(spec: Spec) -> None:
    network = nv.compile(spec)
    assert_same(network.run(STEPS, backend="reference"), network.run(STEPS, backend="numpy"))


@LAID_OUT
@given(specs())
def test_every_neuron_is_placed_exactly_once_and_nothing_overlaps(spec: Spec) -> None:
    network = nv.compile(spec)
    layout = network.layout()
    assert sorted(layout.positions) == sorted(network.network.neurons.names)
    assert sorted(layout.routes) == sorted(network.network.connection_names)
    assert layout.metrics()["overlaps"] == 0


@LAW
@given(specs(), st.integers(1, STEPS - 1))
def test_a_run_can_be_cut_and_goes_on(spec: Spec, at: int) -> None:
    """Step by step, copied in the middle, gives what the whole run gives."""
    network = nv.compile(spec)
    whole = network.run(STEPS)
    simulation = network.simulator()
    for _ in range(at):
        simulation.step()
    state = simulation.state()
    for _ in range(3):
        simulation.step()
    simulation.restore(state)
    assert simulation.k == at
    for k in range(at, STEPS):
        simulation.step()
        np.testing.assert_array_equal(simulation.activity, whole.activity[k])


@LAW
@given(specs())
def test_writing_it_differently_keeps_the_hash(spec: Spec) -> None:
    """YAML in blocks, or as one line of JSON; with titles, other run lengths and pictures: the same network."""
    import yaml

    blocks = yaml.safe_dump(spec, sort_keys=False, default_flow_style=False)
    dressed: Spec = {**spec, "title": "A title", "time": {"steps": 7}, "render": {"theme": "dark"}}
    hashes = {nv.compile(spec).hash, nv.compile_text(blocks).hash, nv.compile(dressed).hash}
    assert len(hashes) == 1
