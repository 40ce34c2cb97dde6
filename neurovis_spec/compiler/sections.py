"""The sections ``outputs``, ``layout`` and ``render``: references resolved, values checked.

In: the sections as written and the Directory. Out: Outputs, LayoutSettings, RenderSettings.
"""

from __future__ import annotations

from typing import Literal, cast

import numpy as np

from neurovis_spec.compiler.network import LayoutSettings, Output, RenderSettings, frozen
from neurovis_spec.compiler.references import Directory, resolve, resolve_end
from neurovis_spec.diagnostics import Findings, Span
from neurovis_spec.language.located import Located
from neurovis_spec.language.source import Mapping as SourceMapping
from neurovis_spec.language.source import Scalar
from neurovis_spec.language.spec import ENGINES, LayoutModel, RenderModel, Spec

#: Engines that the language names and that come later.
_LATER_ENGINES = ("organic", "large", "spatial")


def make_outputs(spec: Spec, directory: Directory, findings: Findings) -> tuple[Output, ...]:
    """The named outputs. Without any, nothing leaves the network but its record."""
    result = []
    for name, reference in spec.outputs.items():
        neurons = resolve(reference.parts, directory, findings)
        if neurons is not None:
            array = np.array(neurons, dtype=np.int64)
            frozen(array)
            result.append(Output(name, array, len(neurons) == 1))
    return tuple(result)


def _key(section: SourceMapping, part: str, name: str) -> Located[str]:
    """The key of an entry of a part of a section, as a text with its place."""
    node = section.get(part)
    entry = node.entry(name) if isinstance(node, SourceMapping) else None
    key = Scalar(name, section.span) if entry is None else entry.key
    return Located(name, key)


def layout_settings(model: LayoutModel | None, directory: Directory, findings: Findings) -> LayoutSettings:
    """The ``layout`` section. Which engines there are is known where they are called; here only words are checked."""
    if model is None:
        return LayoutSettings()
    engine = "auto" if model.engine is None else model.engine.value
    if model.engine is not None and engine in _LATER_ENGINES:
        findings.error("unsupported", model.engine.span, f"the engine '{engine}' is not part of this version yet")
    arrange = []
    for name, how in model.arrange.items():
        members = resolve_end(_key(model.source, "arrange", name), directory, findings)
        if members is not None:
            arrange.append((members, how.value))
    boxes = []
    for name, reference in model.boxes.items():
        members = resolve(reference.parts, directory, findings)
        if members is not None:
            boxes.append((name, members))
    spacing = model.spacing
    neuron = 1.0 if spacing is None or spacing.neuron is None else spacing.neuron.value
    rank = 2.0 if spacing is None or spacing.rank is None else spacing.rank.value
    for value, field in ((neuron, "neuron"), (rank, "rank")):
        if value < 0.6 and spacing is not None:
            span = _key(spacing.source, field, field).span
            entry = spacing.source.entry(field)
            message = f"a spacing of {value:g} is below 0.6, the diameter of a neuron"
            findings.error("out-of-range", span if entry is None else entry.value.span, message)
    return LayoutSettings(
        engine=engine,
        direction=cast(
            Literal["down", "up", "right", "left"], "down" if model.direction is None else model.direction.value
        ),
        positions=_pins(model, directory, findings),
        arrange=tuple(arrange),
        boxes=tuple(boxes),
        neuron_spacing=neuron,
        rank_spacing=rank,
    )


def _pins(model: LayoutModel, directory: Directory, findings: Findings) -> dict[int, tuple[float, float]]:
    """Pins by neuron; a pin names a neuron or a group of one, and pins closer than 0.6 are a finding."""
    pins: dict[int, tuple[float, float]] = {}
    spans: dict[int, tuple[str, Span]] = {}
    for name, point in model.positions.items():
        key = _key(model.source, "positions", name)
        members = resolve_end(key, directory, findings)
        if members is None:
            continue
        if len(members) != 1:
            message = f"'{name}' is {len(members)} neurons; a pin names one"
            findings.error("bad-pin", key.span, message, "pin its neurons one by one, or use 'arrange'")
            continue
        neuron = members[0]
        if neuron in pins:
            message = f"'{name}' is pinned already (line {spans[neuron][1].line})"
            findings.error("duplicate-pin", key.span, message)
            continue
        for other, (x, y) in pins.items():
            if (x - point.x) ** 2 + (y - point.y) ** 2 < 0.6**2 - 1e-12:
                first, span = spans[other]
                message = f"the pins of '{name}' and '{first}' (line {span.line}) are closer than 0.6"
                findings.error("pins-overlap", point.span, message)
                break
        pins[neuron] = (point.x, point.y)
        spans[neuron] = (name, key.span)
    return pins


def render_settings(model: RenderModel | None, findings: Findings) -> RenderSettings:
    """The ``render`` section."""
    if model is None:
        return RenderSettings()
    gain = model.gain

    def factor(value: Located[float] | None) -> float | None:
        if value is not None and value.value < 0:
            findings.error("out-of-range", value.span, f"a gain is not negative, this is {value.value:g}")
        return None if value is None else value.value

    size = None
    if model.size is not None:
        width, height = model.size
        for side in model.size:
            if not 64 <= side.value <= 16384:
                message = f"a side of a picture has 64 to 16384 pixels, this is {side.value}"
                findings.error("out-of-range", side.span, message)
        size = (width.value, height.value)
    return RenderSettings(
        activity=None if gain is None else factor(gain.activity),
        signal=None if gain is None else factor(gain.signal),
        thickness=None if gain is None else factor(gain.thickness),
        change=None if gain is None else factor(gain.change),
        theme="default" if model.theme is None else model.theme.value,
        size=size,
        labels=model.labels is None or model.labels.value,
        legend=model.legend is None or model.legend.value,
        title=True if model.title is None else model.title.value,
    )


__all__ = ["ENGINES", "layout_settings", "make_outputs", "render_settings"]
