"""Networks that spike against Brian2, whose spikes and weights are in ``data/spikes.npz``; ``make_spikes`` makes them,
on the same connections and from the same initial values."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from make_spikes import ADEX, BRUNEL, COBA, FILE, HODGKIN_HUXLEY, METHODS, ORDER, POST, PRE, STEPS, of_steps

import neurovis_spec as nv
from neurovis_spec.arrays import FloatArray
from neurovis_spec.manual.networks import starts
from neurovis_spec.runtime.recording import Recording

EXPECTED = np.load(FILE)


def fired(run: Recording) -> FloatArray:
    """(spikes, 2) steps and neurons, by steps."""
    return np.argwhere(run.activity != 0).astype(np.float64)


@pytest.mark.parametrize(
    ("name", "text"),
    [("brunel", BRUNEL), ("coba_1", COBA.replace("DELAY", "1")), ("coba_0", COBA.replace("DELAY", "0"))],
)
def test_every_spike_of_a_network(name: str, text: str) -> None:
    found = fired(nv.compile_text(text).run(3001, backend="numpy"))
    expected = EXPECTED[name]
    assert len(expected) > 2000
    assert found.shape == expected.shape
    assert (found == expected).all()


def test_adex_is_brian2s() -> None:
    run = nv.compile_text(ADEX).run(30001, backend="numpy", states=["N.v", "N.w"])
    assert np.flatnonzero(run["N"]).tolist() == EXPECTED["adex"].tolist()
    assert len(EXPECTED["adex"]) == 11
    found = np.stack([run[name][:-1:100].ravel() for name in ("N.v", "N.w")])
    assert np.abs(found - EXPECTED["adex_states"]).max() < 4.6e-13


@pytest.mark.parametrize("method", METHODS)
def test_hodgkin_and_huxleys_cells_fire_when_brian2s_do(method: str) -> None:
    """Once an upstroke, with the same method in the same steps; the exponentials are of other libraries."""
    run = nv.compile_text(HODGKIN_HUXLEY.replace("METHOD", method)).run(backend="numpy", states=["N.spike"])
    found = np.argwhere(run["N.spike"][:5001] != 0)
    expected = EXPECTED[f"squid_{method}"]
    assert np.bincount(expected[:, 1]).tolist() == [2, 3, 4, 5, 6]
    assert found.tolist() == expected.tolist()
    assert np.abs(run["N"][:-1:100][:50] - EXPECTED[f"squid_{method}_v"]).max() < 1e-9


def joined(body: str, target: str) -> str:
    """Three sources, each joined to a target."""
    return f"""neurovis: 1
name: pairs
time: {{dt: 1 ms, integrate: exponential}}
models:
  told:
    ports: [aside]
    state: {{waiting: {{each_step: drive}}, total: {{jump: aside}}}}
    spike: {{when: waiting >= 1, set: {{waiting: 0}}}}
inputs:
  pre: {{spikes: {{times: {of_steps(PRE)}}}}}
  post: {{spikes: {{times: {of_steps(POST)}}}}}
neurons:
  A: {{count: 3, model: spike_source, input: pre}}
  B: {{count: 3, model: told{target}}}
connections: {{A -> B: {{pattern: one_to_one, port: aside, {body}}}}}
"""


@pytest.mark.parametrize(("rule", "bound"), [("stdp", 2.8e-16), ("stdp_triplet", 1.4e-14)])
def test_weights_learnt_by_timing(rule: str, bound: float) -> None:
    text = joined(f"weight: 0.5, plasticity: {rule}", ", input: post")
    found = nv.compile_text(text).run(STEPS + 2, backend="numpy").weights[1:]
    assert np.abs(found - EXPECTED[rule]).max() <= bound
    assert np.ptp(found) > 0.01


def test_what_tsodyks_and_markrams_synapses_release() -> None:
    text = joined("weight: 2, delay: 3, synapse: tsodyks_markram", "")
    found = nv.compile_text(text).run(STEPS + 1, backend="numpy", states=["B.total"])["B.total"]
    assert np.abs(found - EXPECTED["tsodyks_markram"]).max() < 8e-14
    assert found[-1].min() > 1


def test_who_sees_a_spike_when() -> None:
    """The table of the manual is what runs say."""
    page = (Path(__file__).parent.parent / "docs" / "language.md").read_text(encoding="utf-8")
    _, _, part = page.partition("### Who sees a spike when")
    assert ORDER.replace("DELAY", "1") in part
    rows = re.findall(r"^\| (\d) \|(.*)\|$", part.partition("###")[0], re.MULTILINE)
    assert [int(delay) for delay, _ in rows] == [0, 1, 2]
    for delay, row in rows:
        run = nv.compile_text(ORDER.replace("DELAY", delay)).run(backend="reference", states=["V.v"])
        assert np.flatnonzero(run["S"]).tolist() == [10]
        told = [int(np.flatnonzero(run["V.v"] > 1)[0]) - 10, int(np.flatnonzero(run["N"])[0]) - 10]
        nest = ["–", "–"] if delay == "0" else EXPECTED["order_nest"][int(delay) - 1].tolist()
        both = [*told, *nest, *EXPECTED["order_brian2"][int(delay)].tolist()]
        assert [str(one) for one in both] == [cell.strip() for cell in row.split("|")]


#: The spikes a second of Potjans and Diesmann's populations, as they publish them with the numbers of their network.
CORTEX = {"E23": 0.971, "I23": 2.868, "E4": 4.746, "I4": 5.396, "E5": 8.142, "I5": 9.078, "E6": 0.991, "I6": 7.523}


def test_networks_to_start_from_spike() -> None:
    found = {}
    for start in starts():
        if start.name in ("brunel", "microcircuit", "nengo", "cuba_lif", "iaf"):
            network = nv.compile_text(start.spec)
            assert network.warnings == ()
            found[start.name] = network.run(5001 if start.name == "nengo" else None, backend="numpy")
    assert np.array_equal(fired(found["brunel"]), EXPECTED["brunel"])
    begun = slice(500, None)
    for name, rate in CORTEX.items():
        assert rate / 1.6 < (found["microcircuit"][name][begun] != 0).mean() * 1e4 < rate * 1.6, name
    assert found["cuba_lif"]["B"].sum() > 5
    assert found["iaf"]["post"].sum() > 2
    apart = np.abs(found["nengo"]["Y"] - found["nengo"]["X"])
    assert apart[4000:].mean() < 0.12 < apart[:500].mean()
