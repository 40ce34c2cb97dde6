"""The networks of ``specs/``, each compiled and laid out once for all tests of a process: nothing changes them."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import neurovis_spec as nv

SPECS = Path(__file__).parent.parent / "specs"
EXAMPLES = sorted([*SPECS.glob("*.yaml"), *SPECS.glob("*/*.yaml")])


@cache
def shipped(path: Path) -> nv.CompiledNetwork:
    """What a file of ``specs/`` is compiled to; its ``drawn()`` is its layout."""
    return nv.compile(path)
