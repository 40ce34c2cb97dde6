"""The page that is asked for chooses the direction, in small networks, too: in `layered`, `organic`, of pathways."""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import neurovis_spec as nv
from neurovis_spec.compiled import NetworkLayout

HIGH, WIDE = (400, 1200), (1600, 500)
NAMES = [f"n{i}" for i in range(8)]
#: A chain of neurons.
LINE = "neurovis: 1\nname: line\nneurons: {" + ", ".join(f"{name}: {{}}" for name in NAMES) + "}\nconnections:\n"
LINE += "".join(f"  {a} -> {b}: 1\n" for a, b in pairwise(NAMES))
#: A chain of groups.
GROUPS = LINE.replace(": {}", ": {count: 6}").partition("  n")[0]
GROUPS += "".join(f"  {a} -> {b}: {{pattern: all_to_all, weight: 1}}\n" for a, b in pairwise(NAMES))


def reach(folder: Path, text: str, size: tuple[int, int] | None, **options: object) -> tuple[float, float]:
    """How far discs are apart to the side and down."""
    nv.compile_text(text).render(folder / "x.svg", step=0, size=size, **options)  # type: ignore[arg-type]
    found = re.findall(r'<circle[^>]* cx="([^"]*)" cy="([^"]*)"', (folder / "x.svg").read_text())
    count = len(NAMES) if options.get("view") else len(nv.compile_text(text).network.neurons)
    wide, high = np.ptp(np.array(found[-count:], float), axis=0)
    return float(wide), float(high)


CASES = {
    "layered": (LINE, {}),
    "organic": (LINE, {"engine": "organic"}),
    "pathways": (GROUPS, {"view": "pathways"}),
}


@pytest.mark.parametrize("kind", CASES)
def test_signals_run_along_the_longer_side_of_the_page(tmp_path: Path, kind: str) -> None:
    text, options = CASES[kind]
    wide, high = reach(tmp_path, text, HIGH, **options)
    assert high > max(400, 4 * wide)
    wide, high = reach(tmp_path, text, WIDE, **options)
    assert wide > max(400, 4 * high)
    in_spec = f"{text}render: {{size: [{WIDE[0]}, {WIDE[1]}]}}\n"
    assert reach(tmp_path, in_spec, None, **options) == (wide, high)


@pytest.mark.parametrize("kind", CASES)
def test_without_a_page_and_with_a_direction_they_run_as_ever(tmp_path: Path, kind: str) -> None:
    text, options = CASES[kind]
    for spec, size in ((text, None), (f"{text}layout: {{direction: down}}\n", WIDE)):
        wide, high = reach(tmp_path, spec, size, **options)
        assert high > wide


def test_a_small_network_fits_the_page_that_is_asked_for(tmp_path: Path) -> None:
    text = LINE.replace(", ".join(f"{name}: {{}}" for name in NAMES[3:]), "").split("  n2 ->")[0].replace(", }", "}")
    assert nv.compile_text(text).network.neurons.names == tuple(NAMES[:3])
    wide, high = reach(tmp_path, text, WIDE)
    assert wide > 2 * high
    wide, high = reach(tmp_path, text, None)
    assert high > 2 * wide


def test_pins_and_an_earlier_layout_hold_the_direction() -> None:
    def level(layout: NetworkLayout) -> bool:
        xs, ys = zip(*layout.positions.values(), strict=True)
        return bool(max(xs) - min(xs) > max(ys) - min(ys))

    page = f"render: {{size: [{WIDE[0]}, {WIDE[1]}]}}\n"
    free = nv.compile_text(LINE).layout("organic")
    assert not level(free)
    asked = nv.compile_text(LINE + page)
    assert level(asked.layout("organic"))
    assert not level(asked.layout("organic", earlier=free.value))
    assert not level(nv.compile_text(f"{LINE}layout: {{positions: {{n0: [0, 0]}}}}\n{page}").layout("organic"))
    turned = asked.layout("organic")
    assert nv.compile_text(LINE).layout("organic", earlier=turned.value).positions == turned.positions
