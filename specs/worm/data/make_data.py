"""Makes the edge files of ../worm.yaml from the table of the whole worm, worm.csv, and prints the thresholds there.

worm.csv lists how many contacts each cell of the adult hermaphrodite makes on each other one (Cook et al. 2019, Nature
571:63-71), as c302 lists them (Gleeson et al. 2018, Philosophical Transactions of the Royal Society B 373:20170379, in
herm_full_edgelist.csv): 448 cells, 4,681 pairs with chemical synapses, and 2,698 with gap junctions, both ways.

A neuron's threshold is its potential where the whole circuit is in equilibrium, all synapses as open as they are at a
threshold (Kunert, Shlizerman and Kutz 2014). Run: python make_data.py
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
GROUPS = {
    "head": ["ALML", "ALMR", "AVM"],
    "tail": ["PLML", "PLMR"],
    "harsh": ["PVDL", "PVDR"],
    "AVD": ["AVDL", "AVDR"],
    "AVA": ["AVAL", "AVAR"],
    "PVC": ["PVCL", "PVCR"],
    "AVB": ["AVBL", "AVBR"],
    "DVA": ["DVA"],
    **{
        name: [f"{name}{number:02d}" for number in range(1, count + 1)]
        for name, count in (("DA", 9), ("DB", 7), ("VD", 13))
    },
}
INHIBIT = "VD"
#: as the model graded has them: mV, 1/s, conductances in contacts of 100 pS
REST, LEAK, EXCITED, INHIBITED, UP, DOWN = -35.0, 0.1, 0.0, -45.0, 1.0, 5.0


def main() -> None:
    """Write the three files, print the thresholds."""
    cells = [cell for group in GROUPS.values() for cell in group]
    place = {cell: index for index, cell in enumerate(cells)}
    with (HERE / "worm.csv").open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if {row["from"], row["to"]} <= place.keys()]
    contacts = {kind: np.zeros((len(cells), len(cells))) for kind in ("chemical", "electrical")}
    for row in rows:
        if row["from"] != row["to"]:
            contacts[row["kind"]][place[row["from"]], place[row["to"]]] = float(row["contacts"])
    gaps = (contacts["electrical"] + contacts["electrical"].T) / 2
    inhibit = np.array([cell.startswith(INHIBIT) for cell in cells])
    made = {
        "excitatory": contacts["chemical"] * ~inhibit[:, None],
        "inhibitory": contacts["chemical"] * inhibit[:, None],
        "electrical": np.triu(gaps),  # each once: the spec says that they are symmetric
    }
    for name, matrix in made.items():
        lines = [f"{cells[i]},{cells[j]},{matrix[i, j]:g}" for i, j in zip(*np.nonzero(matrix), strict=True)]
        (HERE / f"{name}.csv").write_text("\n".join(["from,to,weight", *lines, ""]), encoding="utf-8")
    arriving = UP / (UP + 2 * DOWN) * contacts["chemical"]
    pulled = LEAK * REST + arriving.T @ np.where(inhibit, INHIBITED, EXCITED)
    potentials = np.linalg.solve(np.diag(LEAK + gaps.sum(axis=0) + arriving.sum(axis=0)) - gaps, pulled)
    for name, group in GROUPS.items():
        print(f"{name}: [{', '.join(f'{potentials[place[cell]]:.2f}' for cell in group)}]")


if __name__ == "__main__":
    main()
