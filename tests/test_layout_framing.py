"""A named engine that does not draw instances as frames is a warning, where there are instances."""

from __future__ import annotations

import pytest

import neurovis_spec as nv
from neurovis_spec import plugins
from neurovis_spec.layout import LayoutEngine

HEAD = "neurovis: 1\nname: legs\n"
LEGS = f"{HEAD}modules: {{leg: {{neurons: {{A: {{bias: 1}}}}}}}}\ninstances: {{leg: {{module: leg, count: 2}}}}\n"
ENGINES = sorted(plugins.names(plugins.LAYOUTS))


@pytest.mark.parametrize("engine", ENGINES)
def test_the_warning_says_what_the_engine_declares(engine: str) -> None:
    warned = [
        (w.code, w.span.line, w.span.column) for w in nv.compile_text(f"{LEGS}layout: {{engine: {engine}}}\n").warnings
    ]
    made = plugins.load(plugins.LAYOUTS, engine)
    assert isinstance(made, LayoutEngine)
    draws_frames = made.capabilities.modules or not made.capabilities.free
    assert warned == ([] if draws_frames else [("engine-without-frames", 5, 18)])


def test_no_instances_or_no_name_no_warning() -> None:
    assert not nv.compile_text(f"{HEAD}neurons: {{A: {{bias: 1}}}}\nlayout: {{engine: organic}}\n").warnings
    for said in ("", "layout: {engine: auto}\n", "layout: {direction: up}\n"):
        assert not nv.compile_text(f"{LEGS}{said}").warnings
    allowed = "layout: {engine: organic}   # neurovis: allow engine-without-frames\n"
    assert not nv.compile_text(f"{LEGS}{allowed}").warnings
