"""Default pictures of networks in the shapes of other people's pass the checklist of ``benchmarks/readability.py``."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import neurovis_spec as nv

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "benchmarks"))

import readability


def test_a_default_picture_can_be_read() -> None:
    seen = readability.read(nv.compile_text(readability.CASES["levels"]()))
    assert seen.passed == dict.fromkeys(seen.passed, True), seen


def test_what_the_checklist_asks_can_be_missed() -> None:
    seen = readability.read(nv.compile_text(readability.CASES["pattern_generator"]()))
    worse = replace(seen, long=2.6, share=0.3, disc=2.9, nameless=("A",), missing=("A -> B",))
    assert worse.passed == dict.fromkeys(worse.passed, False)
