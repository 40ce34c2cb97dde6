"""Makes centres.csv: where the eight kernels of cpg_rbf.yaml sit.

They are eight points of the oscillator's settled orbit, equally spaced in time over one period that begins at the
minimum of C1, with both of its ends: the centre of K8 is that of K1. Centres on the diagonal from -1 to 1 would not
do: the orbit has an amplitude of 0.192, and hardly any kernel would ever be active.

Run it in this folder: python make_centres.py
"""

import csv
import math
from pathlib import Path

ALPHA, PHI, KERNELS = 1.0094, 0.049, 8
SETTLE, MEASURE = 20_000, 200  # steps; periods


def orbit():
    """C1 and C2, step by step, from (0.1, 0), with the SO(2) matrix of the spec."""
    c1, c2 = 0.1, 0.0
    while True:
        yield c1, c2
        c1, c2 = (
            math.tanh(ALPHA * math.cos(PHI) * c1 + ALPHA * math.sin(PHI) * c2),
            math.tanh(-ALPHA * math.sin(PHI) * c1 + ALPHA * math.cos(PHI) * c2),
        )


def settled():
    """The settled orbit, and when C1 is least, in steps: the vertices of the parabolas through the least points."""
    points = []
    minima = []
    for step, point in enumerate(orbit()):
        if step < SETTLE:
            continue
        points.append(point)
        if len(points) < 3:
            continue
        before, least, after = (c1 for c1, _ in points[-3:])
        if least < before and least <= after:
            minima.append(len(points) - 2 + 0.5 * (before - after) / (before - 2 * least + after))
            if len(minima) > MEASURE:
                return points, minima
    raise AssertionError("the orbit never ends")


def at(points, time):
    """The orbit between two steps, by the cubic through the four points around it."""
    k = int(time)
    u = time - k
    a, b, c, d = points[k - 1 : k + 3]
    weights = (
        -u * (u - 1) * (u - 2) / 6,
        (u + 1) * (u - 1) * (u - 2) / 2,
        -(u + 1) * u * (u - 2) / 2,
        (u + 1) * u * (u - 1) / 6,
    )
    return tuple(sum(w * p[axis] for w, p in zip(weights, (a, b, c, d), strict=True)) for axis in (0, 1))


def main():
    """Write one row a source (C1, C2), one column a kernel (K1 … K8)."""
    points, minima = settled()
    period = (minima[-1] - minima[0]) / MEASURE
    centres = [at(points, minima[1] + number * period / (KERNELS - 1)) for number in range(KERNELS)]
    with Path(__file__).with_name("centres.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        for axis in (0, 1):
            writer.writerow([f"{centre[axis]:.6f}" for centre in centres])
    radius = sum(math.hypot(*centre) for centre in centres) / KERNELS
    print(f"period {period:.2f} steps, mean radius {radius:.3f}")


if __name__ == "__main__":
    main()
