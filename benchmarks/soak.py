"""Memory in a long run: what a recording of ten million steps takes, a million steps after the other.

In: a number of steps, a suffix (``python benchmarks/soak.py 10000000 .npz``). Out: a line for each tenth of the run,
resident memory and its growth since the first; then how much more was held at most than in a run of a tenth of the
steps, the making of the file included, in MiB a million steps; status 1 where that is more than 1. The network is tiny,
so that what grows with the steps alone shows.
"""

from __future__ import annotations

import resource
import sys
import tempfile
import time
from pathlib import Path

import neurovis_spec as nv

SPEC = """\
neurovis: 1
name: soak
neurons: {C: {count: 2, activation: tanh, initial: [0.1, 0]}, O: {noise: "normal(0, 0.01)"}}
connections:
  C -> C: {matrix: [[1.00, 0.06], [-0.06, 1.00]]}
  C -> O: {weight: 0.1, plasticity: {oja: {rate: 0.001}}}
"""
MIB = 1 << 20


def resident() -> float:
    """MiB of memory that this process holds now."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * resource.getpagesize() / MIB


def peak() -> float:
    """MiB that this process has held at most."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def main(steps: int, suffix: str) -> int:
    """Run, and tell of memory."""
    network = nv.compile_text(SPEC)
    begun = time.perf_counter()
    seen: list[float] = []

    def look(done: int, total: int) -> None:
        if done * 10 >= total * (len(seen) + 1):
            seen.append(resident())
            seconds = time.perf_counter() - begun
            print(f"{done:>12,} steps  {seconds:7.1f} s  {seen[-1]:7.1f} MiB  {seen[-1] - seen[0]:+6.2f}", flush=True)

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"soak{suffix}"
        network.run_to(path, steps // 10)
        before = peak()
        network.run_to(path, steps, progress=look)
        most = peak()
        size = path.stat().st_size / MIB
    growth = (most - before) / (0.9 * steps / 1e6)
    print(f"{suffix}: {size:,.0f} MiB on the disk; at most {most:.1f} MiB; {growth:+.2f} MiB a million steps")
    return int(growth > 1)


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 10_000_000, sys.argv[2] if len(sys.argv) > 2 else ".npz"))
