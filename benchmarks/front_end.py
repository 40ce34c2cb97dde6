"""How quickly an author gets an answer: the commands' start, a small spec, a connectome's size, a spec of 5 MB.

In: nothing. Out: a table, on standard output. Run it with ``python benchmarks/front_end.py``. The ratios are to what
Python itself takes for nothing (``python -c pass``), or PyYAML to load the text; only ratios of one run can be
compared. Processes find the modules compiled to byte code, which an installation does once.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import yaml

import neurovis_spec as nv

EXAMPLE = Path(__file__).resolve().parent.parent / "specs" / "cpg_rbf.yaml"
COMMAND = [sys.executable, "-m", "neurovis_spec"]


def connectome(neurons: int, connections: int) -> str:
    """Tanh neurons and random connections, as edges."""
    random = np.random.default_rng(1)
    ends = random.integers(1, neurons + 1, (connections, 2)).tolist()
    weights = random.normal(0, (neurons / connections) ** 0.5, connections).tolist()
    edges = "".join(f"      - [N{a}, N{b}, {w:.6g}]\n" for (a, b), w in zip(ends, weights, strict=True))
    return (
        f"neurovis: 1\nname: worm\nneurons:\n  N: {{count: {neurons}, activation: tanh, bias: 0.1}}\n"
        f"connections:\n  N -> N:\n    edges:\n{edges}"
    )


def _used() -> float:
    return sum(
        used.ru_utime + used.ru_stime
        for used in map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    )


def best(what: Callable[[], object], repeats: int = 5) -> float:
    """Seconds of the processor, here and in processes begun here: the least of several times."""
    seconds = []
    for _ in range(repeats):
        begun = _used()
        what()
        seconds.append(_used() - begun)
    return min(seconds)


def process(*command: str) -> Callable[[], object]:
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    return lambda: subprocess.run(command, check=True, capture_output=True, env=environment)


def main() -> None:
    print(f"{'what':44}{'time':>10}{'against':>26}{'time':>10}{'ratio':>8}")

    def row(what: str, seconds: float, against: str, peer: float) -> None:
        print(f"{what:44}{seconds:8.3f} s{against:>26}{peer:8.3f} s{seconds / peer:8.2f}", flush=True)

    nothing = best(process(sys.executable, "-c", "pass"), 15)
    row("neurovis --help", best(process(*COMMAND, "--help"), 15), "python -c pass", nothing)
    validate = best(process(*COMMAND, "validate", str(EXAMPLE)), 15)
    row("neurovis validate, use case 1", validate, "python -c pass", nothing)
    small = connectome(302, 2194)
    peer = best(lambda: yaml.load(small, yaml.CSafeLoader))
    row("302/2,194: compile", best(lambda: nv.compile_text(small)), "CSafeLoader", peer)
    row("302/2,194: compile and 1,000 steps", best(lambda: nv.compile_text(small).run(1000)), "CSafeLoader", peer)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "big.yaml"
        path.write_text(connectome(1000, 150_000), encoding="utf-8")
        text = path.read_text(encoding="utf-8")
        peer = best(lambda: yaml.load(text, yaml.CSafeLoader), 2)
        row("1,000/150,000, 3.9 MB: compile", best(lambda: nv.compile(path), 2), "CSafeLoader", peer)


if __name__ == "__main__":
    main()
