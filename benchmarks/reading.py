"""How long a spec of 5 MB takes to read, and how much memory, beside PyYAML's own loader.

Each measurement runs in a process of its own: the best of several times, and the growth of the largest resident
memory from just before the reading. Run with ``python benchmarks/reading.py [EDGES]``.
"""

from __future__ import annotations

import json
import random
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import yaml

REPEATS = 3
HEAD = "neurovis: 1\nname: big\nneurons:\n  N: {count: 1000}\nconnections:\n"


def edge_list(count: int) -> str:
    draw = random.Random(7)
    edges = (f"[N{draw.randrange(1000)}, N{draw.randrange(1000)}, {draw.gauss(0, 1):.12g}]" for _ in range(count))
    return HEAD + "  N -> N:\n    edges:\n" + "".join(f"      - {edge}\n" for edge in edges)


def entries(count: int) -> str:
    draw = random.Random(7)
    return HEAD + "".join(f"  N{i // 1000} -> N{i % 1000}: {draw.gauss(0, 1):.12g}\n" for i in range(count))


def matrix(count: int) -> str:
    draw = random.Random(7)
    size = round(count**0.5)
    rows = ("[" + ", ".join(f"{draw.gauss(0, 1):.12g}" for _ in range(size)) + "]" for _ in range(size))
    return HEAD + "  N -> N:\n    matrix:\n" + "".join(f"    - {row}\n" for row in rows)


SHAPES: dict[str, Callable[[int], str]] = {"edges": edge_list, "entries": entries, "matrix": matrix}


def load(text: str) -> object:
    return yaml.load(text, yaml.CSafeLoader)


def read(text: str) -> object:
    from neurovis_spec.diagnostics import Findings
    from neurovis_spec.language.yaml.reader import read_text

    findings = Findings()
    document = read_text(text, "big.yaml", findings)
    assert document is not None
    assert not findings.failed
    return document


READERS: dict[str, Callable[[str], object]] = {"CSafeLoader": load, "ours": read}


def measure(reader: str, path: Path) -> dict[str, float]:
    """Seconds (the best) and growth in MiB; to be called once in a process."""
    text = path.read_text(encoding="utf-8")
    READERS[reader]("a: [1, 2]\n")  # imports are not what is measured
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    seconds = []
    for turn in range(REPEATS):
        start = time.perf_counter()
        READERS[reader](text)
        seconds.append(time.perf_counter() - start)
        if turn == 0:
            growth = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    return {"seconds": min(seconds), "mib": growth / 1024}


def measured_apart(reader: str, path: Path) -> dict[str, float]:
    command = [sys.executable, __file__, "--measure", reader, str(path)]
    result: dict[str, float] = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    return result


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 150_000
    print(f"{'shape':8} {'size':>8}  {'CSafeLoader':>20}  {'ours':>20}  {'ratio':>6}")
    with tempfile.TemporaryDirectory() as folder:
        for shape, make in SHAPES.items():
            path = Path(folder) / f"{shape}.yaml"
            path.write_text(make(count), encoding="utf-8")
            peer, ours = (measured_apart(reader, path) for reader in READERS)
            columns = "  ".join(f"{m['seconds']:8.2f} s {m['mib']:5.0f} MiB" for m in (peer, ours))
            size = path.stat().st_size / 1e6
            print(f"{shape:8} {size:5.1f} MB  {columns}  {ours['seconds'] / peer['seconds']:6.2f}")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--measure"]:
        print(json.dumps(measure(sys.argv[2], Path(sys.argv[3]))))
    else:
        main()
