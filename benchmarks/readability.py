"""Whether the default pictures of other people's networks can be read: a checklist, from the SVG alone.

In: nothing; ``--only WORD`` for networks whose name holds it. Out: a table, in Markdown, on standard output, a row a
network: neurons and connections, the engine, the picture's size in pixels, how much longer than wide, or wider than
high, the network in it is, how much of the page's width it takes, how large its smallest disc is (across, in pixels),
whether each group has a name or a number in it, which pathways from group to group are neither drawn nor bundled; and
seconds of the processor. What misses the checklist is bold; then the status is 1. The networks are in the shapes of
those that others draw, ten of them ``tests/other_networks.py``; none was drawn by hand.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
import warnings
import xml.etree.ElementTree as ET
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from random import Random

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

from other_networks import NETWORKS

import neurovis_spec as nv
from neurovis_spec.compiled import CompiledNetwork

_SVG = "{http://www.w3.org/2000/svg}"
#: The checklist: pixels across, how much longer than wide, share of the page's width.
DISC, LONG, WIDTH = 3.0, 2.5, 0.4
#: What has discs as large as this can be read however long it is: in a small network a line that runs back costs more.
LARGE = 15.0


@dataclass(frozen=True, slots=True)
class Read:
    """What is read from a picture: its size, how long the network in it is, which share of the width it takes, the
    smallest disc, groups that no text names, pathways that nothing shows."""

    width: float
    height: float
    long: float
    share: float
    disc: float
    nameless: tuple[str, ...]
    missing: tuple[str, ...]

    @property
    def passed(self) -> dict[str, bool]:
        """By what the checklist asks whether that is so."""
        return {
            "long": self.long <= LONG or self.disc >= LARGE,
            "share": self.share >= WIDTH,
            "disc": self.disc >= DISC,
            "nameless": not self.nameless,
            "missing": not self.missing,
        }


def read(network: CompiledNetwork) -> Read:
    """The default picture of a network, read."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "picture.svg"
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of lines that are left out, which the picture says itself
            network.render(path)
        return read_svg(network, path.read_bytes())


def read_svg(network: CompiledNetwork, svg: bytes) -> Read:
    """A picture of a network, read."""
    root = ET.fromstring(svg)
    width, height = float(root.get("width", "0")), float(root.get("height", "0"))
    unit = width / float(root.get("viewBox", "0 0 1 1").split()[2])
    group = {
        network.network.neurons.names[index]: one.name
        for one in network.network.neurons.groups
        for index in one.indices
    }
    discs: list[tuple[float, float, float]] = []
    named: set[str] = set()
    shown: set[tuple[str, str]] = set()
    for one in root.iter(f"{_SVG}g"):
        if (name := one.get("data-neuron")) is not None:
            if (disc := one.find(f"{_SVG}circle")) is not None:
                x, y, radius = (float(disc.get(key, "0")) * unit for key in ("cx", "cy", "r"))
                discs.append((x, y, radius + float(disc.get("stroke-width", "0")) * unit / 2))
            if one.find(f"{_SVG}text") is not None:
                named.add(group[name])
        elif (pathway := one.get("data-pathway")) is not None:
            source, target = pathway.split(" -> ")
            shown.add((source, target))
        elif one.get("data-connection") is not None:
            shown.add((group[one.get("data-from", "")], group[one.get("data-to", "")]))
    # instances of a module are drawn alike, so that one of them tells the names of all
    told = {name.rpartition(".")[2] for name in named}
    titles = {"".join(text.itertext()).split(" · ")[0] for text in root.iter(f"{_SVG}text")}
    boxes = {one.name for one in network.network.neurons.groups if one.box in titles}
    across, down = (max(d[axis] + d[2] for d in discs) - min(d[axis] - d[2] for d in discs) for axis in (0, 1))
    ends, of = network.network.connections, network.network.neurons.names
    wired = {(group[of[a]], group[of[b]]) for a, b in zip(ends.sources.tolist(), ends.targets.tolist(), strict=True)}
    return Read(
        width,
        height,
        max(across / down, down / across),
        across / width,
        2 * min(radius for _, _, radius in discs),
        tuple(sorted(name for name in set(group.values()) - boxes if name.rpartition(".")[2] not in told)),
        tuple(sorted(f"{a} -> {b}" for a, b in wired - shown)),
    )


def _spec(name: str, *lines: str) -> str:
    return "\n".join(["neurovis: 1", f"name: {name}", "time: {steps: 3}", *lines, ""])


def connectome_448() -> str:
    """Of 448 neurons and muscles 7,379 connections, most of them to near ones."""
    random, found = Random(448), set[tuple[int, int]]()
    while len(found) < 7379:
        a, b = int(random.random() ** 1.6 * 448), random.randrange(448)
        b = b if random.random() < 0.3 else (a + round(random.gauss(0, 25))) % 448
        if a != b:
            found.add((a, b))
    rows = [f"      - [N{a + 1}, N{b + 1}, {random.choice((1, 1, 2, 3, 5))}]" for a, b in sorted(found)]
    return _spec("connectome_448", "neurons: {N: {count: 448}}", "connections:", "  N -> N:", "    edges:", *rows)


def _column(wide: float) -> str:
    """Four layers of a cortical column, each of two populations, at their depths."""
    random, layers = Random(764), {"L23": (207, 58, 0, 550), "L4": (219, 55, 550, 850)}
    layers |= {"L5": (49, 11, 850, 1050), "L6": (144, 29, 1050, 1500)}
    groups, names = [], []
    for layer, (excite, inhibit, top, end) in layers.items():
        for kind, count in (("E", excite), ("I", inhibit)):
            at = [(random.random() * wide, -random.uniform(top, end)) for _ in range(count)]
            places = ", ".join(f"[{x:.1f}, {random.random() * wide:.1f}, {z:.1f}]" for x, z in at)
            groups.append(f"  {layer}{kind}: {{count: {count}, box: {layer}, position: [{places}]}}")
            names.append(f"{layer}{kind}")
    lines = [
        f"  {a} -> {b}: {{pattern: {{random: {{probability: 0.02}}}}, weight: {0.2 if a[-1] == 'E' else -0.6}}}"
        for a in names
        for b in names
        if random.random() < 0.6
    ]
    return _spec("column", "neurons:", *groups, "connections:", *lines, "layout: {view: front}")


def column_slim() -> str:
    """A strip fifteen times as high as wide."""
    return _column(100.0)


def column_wide() -> str:
    """As a slice is shown."""
    return _column(1200.0)


def _instances(modules: Sequence[str], instances: str, links: Sequence[str]) -> str:
    return _spec("hierarchy", "modules:", *modules, instances, "connections:", *links)


def hierarchy_chain() -> str:
    """Ninety modules of five, one after the other: 450."""
    cell = "A -> B: 1, B -> C: 1, C -> D: 1, D -> E: 1, E -> A: 1"
    module = f"  m: {{neurons: {{A: {{}}, B: {{}}, C: {{}}, D: {{}}, E: {{}}}}, connections: {{{cell}}}}}"
    links = [f"  m{i}.E -> m{i + 1}.A: 1" for i in range(1, 90)]
    return _instances([module], "instances: {m: {module: m, count: 90}}", links)


def hierarchy_tree() -> str:
    """Modules in modules, two in each: 255."""
    parts = ["  l0: {neurons: {A: {}, B: {}, C: {}}, connections: {A -> B: 1, B -> C: 1}}"]
    for level in range(1, 7):
        own = f"instances: {{x: {{module: l{level - 1}}}, y: {{module: l{level - 1}}}}}"
        parts.append(f"  l{level}: {{neurons: {{A: {{}}}}, {own}, connections: {{A -> x.A: 1, A -> y.A: 1}}}}")
    return _spec("hierarchy", "modules:", *parts, "instances: {r: {module: l6}}")


def hierarchy_columns() -> str:
    """Ten areas of nine columns of five, each area driving the next and told by it: 454."""
    kinds = ("L4", "L23", "L5", "L6", "I")
    cell = "L4 -> L23: 1, L23 -> L5: 1, L5 -> L6: 1, L6 -> L4: 1, L23 -> I: 1, I -> L23: -1"
    column = f"  column: {{neurons: {{{', '.join(f'{kind}: {{}}' for kind in kinds)}}}, connections: {{{cell}}}}}"
    side = ", ".join(f"c{i}.L23 -> c{i + 1}.L23: 1" for i in range(1, 9))
    area = f"  area: {{instances: {{c: {{module: column, count: 9}}}}, connections: {{{side}}}}}"
    links = [f"  a{a}.c{c}.L23 -> a{a + 1}.c{c}.L4: 1" for a in range(1, 10) for c in range(1, 10)]
    links += [f"  a{a + 1}.c{c}.L6 -> a{a}.c{c}.L23: 1" for a in range(1, 10) for c in range(1, 10)]
    return _instances([column, area], "instances: {a: {module: area, count: 10}}", links)


def lamprey() -> str:
    """Sixty-five segments of two halves that inhibit each other: 391."""
    half = "  half: {neurons: {E: {}, C: {}, L: {}}, connections: {E -> C: 1, E -> L: 1, L -> C: -1}}"
    cross = "left.C -> right.E: -1, right.C -> left.E: -1"
    halves = "{left: {module: half}, right: {module: half}}"
    segment = f"  segment: {{instances: {halves}, connections: {{{cross}}}, layout: {{mirror: [[left, right]]}}}}"
    links = [f"  s{i}.{side}.E -> s{i + 1}.{side}.E: 1" for i in range(1, 65) for side in ("left", "right")]
    return _instances([half, segment], "instances: {s: {module: segment, count: 65}}", links)


def levels() -> str:
    """Forty-five levels of ten: 450."""
    groups = ", ".join(f"G{i}_: {{count: 10, box: level {i}}}" for i in range(45))
    drawn = "{pattern: {random: {probability: 0.15}}, weight: 1}"
    return _spec(
        "levels", f"neurons: {{{groups}}}", "connections:", *(f"  G{i}_ -> G{i + 1}_: {drawn}" for i in range(44))
    )


def levels_back() -> str:
    """Thirty levels of fifteen, each told by the next: 450."""
    groups = ", ".join(f"G{i}_: {{count: 15, box: level {i}}}" for i in range(30))
    drawn = "{pattern: {random: {probability: 0.1}}, weight: 1}"
    ways = [(a, a + 1) for a in range(29)] + [(a + 1, a) for a in range(29)]
    return _spec(
        "levels_back", f"neurons: {{{groups}}}", "connections:", *(f"  G{a}_ -> G{b}_: {drawn}" for a, b in ways)
    )


def digits() -> str:
    """784 pixels, 30 hidden units, 10 digits, sparsely wired."""
    drawn = "{pattern: {random: {probability: 0.1}}, weight: 'normal(0, 0.3)'}"
    sizes = "{X: {count: 784}, H: {count: 30, activation: tanh}, Y: {count: 10}}"
    return _spec("digits", f"neurons: {sizes}", "connections:", f"  X -> H: {drawn}", f"  H -> Y: {drawn}")


def ring() -> str:
    """A ring of ninety in three boxes."""
    groups = ", ".join(f"{name}: {{count: 30, box: part {name}}}" for name in "ABC")
    drawn = "{pattern: {random: {probability: 0.02}}, weight: 0.5}"
    wired = "connections: {" + ", ".join(f"{a} -> {b}: {drawn}" for a, b in ("AB", "BC", "CA")) + "}"
    return _spec("ring", f"neurons: {{{groups}}}", wired, "layout: {engine: circular}")


CASES: dict[str, Callable[[], str]] = NETWORKS | {
    made.__name__: made
    for made in (
        *(connectome_448, column_slim, column_wide, hierarchy_chain, hierarchy_tree),
        *(hierarchy_columns, lamprey, levels, levels_back, digits, ring),
    )
}


def row(name: str) -> bool:
    """Prints the row of a network; whether it passes."""
    network = nv.compile_text(CASES[name]())
    begun = time.process_time()
    seen = read(network)
    seconds = time.process_time() - begun
    passed = seen.passed

    def cell(key: str, words: str) -> str:
        return words if passed[key] else f"**{words}**"

    counts = f"{len(network.network.neurons):,} | {len(network.network.connections):,}"
    cells = [
        name.replace("_", " "),
        counts,
        network.layout().engine,
        f"{seen.width:.0f} × {seen.height:.0f}",
        cell("long", f"{seen.long:.1f}"),
        cell("share", f"{seen.share:.0%}".replace("%", " %")),
        cell("disc", f"{seen.disc:.1f}"),
        cell("nameless", "all" if not seen.nameless else f"not {len(seen.nameless)}"),
        cell("missing", str(len(seen.missing))),
        f"{seconds:.1f} s",
    ]
    print(f"| {' | '.join(cells)} |", flush=True)
    return all(passed.values())


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--only", default="")
    asked = parser.parse_args()
    head = ("network", "neurons", "connections", "engine", "picture", "long", "of the width", "smallest disc", "named")
    print(f"| {' | '.join((*head, 'pathways missing', 'CPU'))} |\n|{' --- |' * 11}")
    passed = [row(name) for name in CASES if asked.only in name]
    sys.exit(not all(passed))


if __name__ == "__main__":
    main()
