"""Networks whose connections nobody can follow one by one: classes, few neurons with most connections; seeded."""

from __future__ import annotations

from random import Random

import neurovis_spec as nv
from neurovis_spec.compiled import CompiledNetwork


def connectome(
    count: int, edges: int, classes: int, seed: int = 1, *, inside: float = 0.6, more: str = "", steps: int = 3
) -> CompiledNetwork:
    """Neurons of some classes, each a box; few have most connections, most of these within a class."""
    random = Random(seed)
    members = [[f"class{k}_neuron_{i}" for i in range(k, count, classes)] for k in range(classes)]
    names = [name for own in members for name in own]
    found: dict[tuple[str, str], float] = {}
    while len(found) < edges:
        a, b = (names[int(count * random.random() ** 2.5 * 97) % count] for _ in "ab")
        if random.random() < inside:
            own = members[int(a[5 : a.index("_")])]
            b = own[int(len(own) * random.random() ** 2)]
        if a != b:
            found[a, b] = round(random.choice((1, 1, 1, -1)) * random.lognormvariate(-1.5, 0.9), 4)
    groups = [f"  class{k}: {{names: [{', '.join(own)}], bias: 0.3, box: class{k}}}" for k, own in enumerate(members)]
    everybody = " + ".join(f"class{k}" for k in range(classes))
    rows = [f"      - [{a}, {b}, {weight}]" for (a, b), weight in found.items()]
    lines = ["neurovis: 1", "name: connectome", f"time: {{steps: {steps}}}", "neurons:", *groups, "connections:"]
    lines += [f"  {everybody} -> {everybody}:", "    edges:", *rows]
    return nv.compile_text("\n".join(lines) + f"\n{more}\n")
