"""A layout does not depend on the processor: NumPy has other code for newer ones, which rounds some functions anew."""

from __future__ import annotations

import os
import subprocess
import sys
from functools import cache

import pytest

PROGRAM = """
import hashlib, random
import neurovis_spec as nv
from neurovis_spec.layout.arrange import lay_out_problem
from neurovis_spec.layout.problem import problem_of

count, links, engine = {count}, {links}, "{engine}"
drawn = random.Random(5)
pairs = sorted({{(drawn.randrange(count) + 1, drawn.randrange(count) + 1) for _ in range(links)}})
edges = ", ".join(f"N{{a}} -> N{{b}}: 1" for a, b in pairs if a != b)
text = "neurovis: 1\\nname: x\\nneurons: {{N: {{count: %d}}}}\\nconnections: {{%s}}\\n" % (count, edges)
layout = lay_out_problem(problem_of(nv.compile_text(text).network), engine)
print(hashlib.sha256(repr((layout.positions, layout.routes)).encode()).hexdigest())
"""
#: What NumPy picks code by; names that it does not know are refused one by one, so each is tried alone.
FEATURES = ("X86_V3", "X86_V4", "AVX2", "FMA3", "AVX512F", "AVX512_SKX", "AVX512_ICL")


def drawn(engine: str, count: int, links: int, without: str) -> str:
    """The hash of a layout that a fresh Python makes ``without`` some features of the processor."""
    program = PROGRAM.format(engine=engine, count=count, links=links)
    result = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", program],
        env={**os.environ, "NPY_DISABLE_CPU_FEATURES": without},
        capture_output=True,
        text=True,
        check=False,
    )
    return result.stdout.strip() if result.returncode == 0 else f"failed: {result.stderr[-300:]}"


@cache
def known() -> str:
    """Those features that this NumPy lets be switched off on this processor."""
    program = "import numpy"
    return " ".join(
        feature
        for feature in FEATURES
        if subprocess.run(
            [sys.executable, "-W", "error", "-c", program],
            env={**os.environ, "NPY_DISABLE_CPU_FEATURES": feature},
            capture_output=True,
            check=False,
        ).returncode
        == 0
    )


@pytest.mark.parametrize(
    ("engine", "count", "links"), [("organic", 45, 160), ("organic", 250, 1000), ("layered", 30, 60)]
)
def test_a_layout_is_the_same_on_older_processors(engine: str, count: int, links: int) -> None:
    here = drawn(engine, count, links, "")
    assert len(here) == 64, here
    assert drawn(engine, count, links, known()) == here
