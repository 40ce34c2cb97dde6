"""Small specs in, their networks or findings out: what the tests of the compiler have in common."""

from __future__ import annotations

from pathlib import Path

import pytest

import neurovis_spec as nv
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.compiler.network import Network

HEAD = "neurovis: 1\nname: x\n"


def compiled(text: str, folder: Path | None = None) -> CompiledNetwork:
    """The compiled network of a spec without its head."""
    return nv.compile_text(HEAD + text, folder=folder)


def network_of(text: str, folder: Path | None = None) -> Network:
    """The network of a spec without its head."""
    return compiled(text, folder).network


def codes(text: str, folder: Path | None = None, *, limit: int | None = None) -> list[str]:
    """The codes of the errors of a spec without its head, in order."""
    with pytest.raises(nv.SpecError) as caught:
        nv.compile_text(HEAD + text, folder=folder, limit=limit)
    return [item.code for item in caught.value.diagnostics if item.severity == "error"]


def answer(text: str, folder: Path | None = None) -> tuple[str, str, str]:
    """The one finding of a spec without its head: code, message, hint."""
    with pytest.raises(nv.SpecError) as caught:
        nv.compile_text(HEAD + text, folder=folder)
    (item,) = caught.value.diagnostics
    return item.code, item.message, item.hint or ""


def wires(network: Network) -> list[tuple[str, str, float, int]]:
    """All connections in order: from, to, weight, delay."""
    names, lines = network.neurons.names, network.connections
    columns = (lines.sources.tolist(), lines.targets.tolist(), lines.weights.tolist(), lines.delays.tolist())
    return [(names[s], names[t], w, d) for s, t, w, d in zip(*columns, strict=True)]


def pairs(text: str) -> list[str]:
    """The connections of a spec, as ``A1 B2``."""
    return [f"{source} {target}" for source, target, _, _ in wires(network_of(text))]


def weights(text: str) -> list[float]:
    """The weights of a spec, in order."""
    return [weight for _, _, weight, _ in wires(network_of(text))]


#: Every kind of thing that commands show: an input with a source and one without, a delay, a rule, outputs.
SMALL = """\
neurovis: 1
name: small
time: {dt: 0.5, steps: 10}
parameters: {gain: {value: 0.5, min: 0}}
inputs: {push: {expression: 1}, pull: {size: 2}}
neurons:
  A: {input: push, bias: 0.25}
  B: {count: 2, input: pull}
connections:
  A -> B: {weight: gain, delay: 2}
  B -> B: {weight: 0.1, pattern: ring, plasticity: {hebbian: {rate: 0.01}}, bounds: [-1, 1]}
outputs: {last: B2, both: B}
"""
