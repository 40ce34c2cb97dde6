"""Long labels beside discs are shortened, so that every neuron has its own."""

from __future__ import annotations

import neurovis_spec as nv
from neurovis_spec import pipeline
from neurovis_spec.scene import Text

LONG = "a very long label that goes on for forty"
SPEC = f"""
neurovis: 1
name: labels
neurons: {{A: {{count: 3, label: "{LONG}", bias: 1}}, B: {{count: 12}}}}
connections: {{A -> B: {{pattern: all_to_all}}}}
"""


def test_every_neuron_of_a_row_has_a_shortened_label() -> None:
    network = nv.compile_text(SPEC)
    snapshot = network.run(3).snapshot(2)
    layout = network.layout().value
    scene = pipeline.picture(network.network, layout, snapshot, network.gains, network.network.render)
    texts = {group.data.get("neuron"): [s.text for s in group.shapes if isinstance(s, Text)] for group in scene.groups}
    for name in ("A1", "A2", "A3"):
        (text,) = texts[name]
        assert text.endswith("…")
        assert LONG.startswith(text[:-1].rstrip())
        assert len(text) >= 8
    assert all(LONG in group.title for group in scene.groups if group.data.get("neuron") in ("A1", "A2", "A3"))
