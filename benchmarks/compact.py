"""What large networks take: bytes a connection that stay and at the peak, and the time of compiling them.

In: nothing, or the names of some of the cases. Out: a table, on standard output. Run it with
``python benchmarks/compact.py``. Bytes that stay are those of the Network's arrays, each buffer once, for each
connection. A peak is that of a process of its own (``validate``, and a run of 20 steps of which the last is kept), less
what the same takes of a network of two neurons. Seconds are of the processor, of compiling alone.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path

import numpy as np

import neurovis_spec as nv
from neurovis_spec.arrays import Column

_GROUP = "neurovis: 1\nname: large\nneurons:\n  N: {{count: {}, activation: tanh{}}}\nconnections:\n"
#: by case how many neurons and what is connected how
CASES: Mapping[str, tuple[int, str]] = {
    "small": (2, "  N -> N: {weight: 0.5, pattern: all_to_all}"),
    "edges": (20_000, "  N -> N: {edges: {file: edges.csv}}"),
    "table": (
        20_000,
        "  N -> N: {edges: {file: edges.tsv, columns: {from: Source, to: Target, weight: N}, where: {Type: chemical}}}",
    ),
    "matrix": (1_582, "  N -> N: {matrix: {file: matrix.npy}}"),
    "pattern": (5_000, "  N -> N: {weight: 0.01, pattern: {random: {probability: 0.1}}}"),
    "drawn": (5_000, '  N -> N: {weight: "normal(0, 0.01)", pattern: {random: {probability: 0.1}}}'),
    "nearby": (10_000, "  N -> N: {weight: 0.01, pattern: {random: {probability: 0.1*exp(-distance/0.2)}}}"),
    "nearby in space": (10_000, "  N -> N: {weight: 0.01, pattern: {random: {probability: 0.2*exp(-distance/0.2)}}}"),
    "delayed": (5_000, "  N -> N: {weight: 0.01, delay: 5, pattern: {random: {probability: 0.1}}}"),
}
#: of which neurons have places, and in how many dimensions
PLACES: Mapping[str, int] = {"nearby": 2, "nearby in space": 3}
EDGES = 1_000_000
LIMIT = 10_000_000


def write(folder: Path, case: str) -> Path:
    """The spec of a case, with its data beside it."""
    neurons, entry = CASES[case]
    random = np.random.default_rng(1)
    if case in ("edges", "table"):
        ends, weights = random.integers(1, neurons + 1, (EDGES, 2)), random.normal(0, 0.1, EDGES)
        edges = [(f"N{a}", f"N{b}", f"{w:.6g}") for (a, b), w in zip(ends.tolist(), weights.tolist(), strict=True)]
        if case == "edges":
            _write(folder / "edges.csv", "from,to,weight", (f"{a},{b},{w}" for a, b, w in edges))
        else:
            rows = (f"{w}\tchemical\t{b}\t{a}" for a, b, w in edges)
            _write(folder / "edges.tsv", "N\tType\tTarget\tSource", rows)
    if case == "matrix":
        np.save(folder / "matrix.npy", random.normal(0, 0.01, (neurons, neurons)))
    path = folder / f"{case}.yaml"
    if case in PLACES:
        np.save(folder / "places.npy", random.random((neurons, PLACES[case])))
    more = ", position: {file: places.npy}" if case in PLACES else ""
    path.write_text(_GROUP.format(neurons, more) + entry + "\n")
    return path


def _write(path: Path, head: str, rows: Iterable[str]) -> None:
    path.write_text("\n".join([head, *rows, ""]))


def _arrays(value: object, seen: set[int]) -> Iterator[np.ndarray]:
    """The buffers of all arrays that a value holds, each once."""
    if id(value) in seen:
        return
    seen.add(id(value))
    if isinstance(value, np.ndarray):
        if isinstance(value.base, np.ndarray):
            yield from _arrays(value.base, seen)
        else:
            yield value
    elif isinstance(value, Column):
        for name in Column.__slots__:
            yield from _arrays(getattr(value, name), seen)
    elif isinstance(value, Mapping):
        for item in value.values():
            yield from _arrays(item, seen)
    elif isinstance(value, (tuple, list)) and not (value and isinstance(value[0], (str, float))):
        for item in value:
            yield from _arrays(item, seen)
    elif is_dataclass(value) and not isinstance(value, type):
        for field in fields(value):
            yield from _arrays(getattr(value, field.name), seen)


def measure(path: str, what: str) -> None:
    """In a process of its own: what compiling takes, or with a run behind it, as JSON on standard output."""
    begun = time.process_time()
    made = nv.compile(path, limit=LIMIT)
    used = time.process_time() - begun
    if what == "run":
        made.run(20, last=True)
    stay = sum(array.nbytes for array in _arrays(made.network, set()))
    said = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
    peak = int(said["VmHWM"].split()[0]) << 10  # the process before had its own peak, which ru_maxrss passes on
    print(json.dumps({"seconds": used, "connections": len(made.network.connections), "stay": stay, "peak": peak}))


def measured(path: Path, what: str) -> dict[str, float]:
    """What a process of its own measures."""
    command = [sys.executable, __file__, "--measure", str(path), what]
    made: dict[str, float] = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout)
    return made


def by_hand(places: np.ndarray, most: float) -> float:
    """Seconds of drawing connections by distance in NumPy alone, 256 rows at a time; ``most``: the chance at 0."""
    random, begun = np.random.default_rng(1), time.process_time()
    found = []
    for start in range(0, len(places), 256):
        apart = np.zeros((len(places[start : start + 256]), len(places)))
        for axis in places.T:
            along = axis[start : start + 256, None] - axis[None, :]
            apart += along * along
        chances = most * np.exp(-np.sqrt(apart) / 0.2)
        i, j = np.nonzero(random.random(chances.shape) < chances)
        found.append((i + start, j))
    np.concatenate(found, axis=1)
    return time.process_time() - begun


def main(cases: list[str]) -> None:
    row = "| {:15} | {:>11} | {:>7} | {:>7} | {:>7} | {:>7} | {:>12} | {:>7} |"
    print(row.format("case", "connections", "seconds", "stay, B", "peak, B", "run, B", "validate, MB", "run, MB"))
    print(row.format(*["---"] * 8))
    with tempfile.TemporaryDirectory() as folder:
        small = write(Path(folder), "small")
        nothing = [measured(small, what)["peak"] for what in ("validate", "run")]
        for case in cases or [name for name in CASES if name != "small"]:
            path = write(Path(folder), case)
            both = [measured(path, what) for what in ("validate", "run")]
            count = both[0]["connections"]
            peaks = [one["peak"] for one in both]
            each = [
                both[0]["stay"] / count,
                *((peak - none) / count for peak, none in zip(peaks, nothing, strict=True)),
            ]
            cells = (
                f"{both[0]['seconds']:.2f}",
                *(f"{one:.0f}" for one in each),
                *(f"{peak / 1e6:.0f}" for peak in peaks),
            )
            print(row.format(case, f"{int(count):,}", *cells), flush=True)
            if case in PLACES:
                hand = by_hand(np.load(path.parent / "places.npy"), 0.1 if case == "nearby" else 0.2)
                print(f"  its connections drawn in NumPy by hand: {hand:.2f} s")


if __name__ == "__main__":
    measure(*sys.argv[2:]) if sys.argv[1:2] == ["--measure"] else main(sys.argv[1:])
