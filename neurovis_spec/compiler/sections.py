"""The sections ``outputs``, ``layout`` and ``render``: references resolved, values checked.

In: the sections as written and the Directory. Out: Outputs, LayoutSettings, RenderSettings.
"""

from __future__ import annotations

import math
from typing import Literal, cast

import numpy as np

from neurovis_spec import plugins
from neurovis_spec.compiler.network import LayoutSettings, Output, RenderSettings, frozen
from neurovis_spec.compiler.references import Directory, key_of, resolve, resolve_end
from neurovis_spec.diagnostics import Findings, suggest
from neurovis_spec.language.located import Located, shown
from neurovis_spec.language.spec import LayoutModel, RenderModel, RosModel, Spec

#: Engines that the language names and that come later.
_LATER_ENGINES = ("organic", "large", "spatial")
#: The diameter of a neuron's disc, and how far out anything may be asked to stand (units of the layout).
DIAMETER, _FARTHEST = 0.6, 1e6


def make_outputs(spec: Spec, directory: Directory, findings: Findings) -> tuple[Output, ...]:
    """The named outputs. Without any, nothing leaves the network but its record."""
    result = []
    for name, reference in spec.outputs.items():
        neurons = resolve(reference.parts, directory, findings)
        if not reference.parts:
            findings.error("empty-reference", reference.span, f"the output '{name}' names no neuron")
        elif neurons is not None:
            array = np.array(neurons, dtype=np.int64)
            frozen(array)
            result.append(Output(name, array, len(neurons) == 1))
    return tuple(result)


def layout_settings(model: LayoutModel | None, directory: Directory, findings: Findings) -> LayoutSettings:
    """The ``layout`` section. Which engines there are is known where they are called; here only words are checked."""
    if model is None:
        return LayoutSettings()
    engine = "auto" if model.engine is None else model.engine.value
    if model.engine is not None:
        _check_engine(model.engine, findings)
    arrange = []
    for name, how in model.arrange.items():
        members = resolve_end(key_of(model.source, "arrange", name), directory, findings)
        if members is not None:
            arrange.append((members, how.value))
    boxes = []
    for name, reference in model.boxes.items():
        members = resolve(reference.parts, directory, findings)
        if not reference.parts:
            findings.error("empty-reference", reference.span, f"the box '{shown(name)}' holds no neuron")
        elif members is not None:
            boxes.append((name, members))
    spacing = model.spacing
    neuron = 1.0 if spacing is None or spacing.neuron is None else spacing.neuron.value
    rank = 2.0 if spacing is None or spacing.rank is None else spacing.rank.value
    for value, field in ((neuron, "neuron"), (rank, "rank")):
        if not DIAMETER <= value <= _FARTHEST and spacing is not None:
            node = spacing.source.get(field)
            message = (
                f"a spacing lies between {DIAMETER}, the diameter of a neuron, and {_FARTHEST:g}; this is {value:g}"
            )
            findings.error("out-of-range", spacing.source.span if node is None else node.span, message)
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


def _check_engine(engine: Located[str], findings: Findings) -> None:
    """An engine is ours or a plug-in's; who calls it asks again, as another machine may have others."""
    name = engine.value
    installed = plugins.names(plugins.LAYOUTS)
    if name == "auto" or name in installed:
        return
    if name in _LATER_ENGINES:
        findings.error("unsupported", engine.span, f"the engine '{name}' is not part of this version yet")
    else:
        hint = suggest(name, ("auto", *installed), "known engines")
        findings.error("unknown-engine", engine.span, f"there is no layout engine '{shown(name)}' here", hint)


def _pins(model: LayoutModel, directory: Directory, findings: Findings) -> dict[int, tuple[float, float]]:
    """Pins by neuron; a pin names a neuron or a group of one, and pins closer than 0.6 are a finding."""
    pins: dict[int, tuple[float, float]] = {}
    keys: dict[int, Located[str]] = {}
    cells: dict[tuple[int, int], list[int]] = {}  # as wide as a disc: what is too close lies in one next to it
    for name, point in model.positions.items():
        key = key_of(model.source, "positions", name)
        neuron = _pinned(key, directory, findings)
        if neuron is None:
            continue
        if neuron in pins:
            message = f"'{name}' is pinned already (line {keys[neuron].span.line})"
            findings.error("duplicate-pin", key.span, message)
            continue
        if max(abs(point.x), abs(point.y)) > _FARTHEST:
            findings.error("out-of-range", point.span, f"a pin lies within {_FARTHEST:g} of the origin")
            continue
        column, row = math.floor(point.x / DIAMETER), math.floor(point.y / DIAMETER)
        near = (other for i in (-1, 0, 1) for j in (-1, 0, 1) for other in cells.get((column + i, row + j), ()))
        for other in near:
            if math.dist(pins[other], (point.x, point.y)) < DIAMETER - 1e-9:
                first = keys[other]
                message = (
                    f"the pins of '{name}' and '{first.value}' (line {first.span.line}) are closer than {DIAMETER}"
                )
                findings.error("pins-overlap", point.span, message)
                break
        cells.setdefault((column, row), []).append(neuron)
        pins[neuron], keys[neuron] = (point.x, point.y), key
    return pins


def _pinned(key: Located[str], directory: Directory, findings: Findings) -> int | None:
    members = resolve_end(key, directory, findings)
    if members is not None and len(members) != 1:
        message = f"'{shown(key.value)}' is {len(members)} neurons; a pin names one"
        findings.error("bad-pin", key.span, message, "pin its neurons one by one, or use 'arrange'")
        return None
    return None if members is None else members[0]


def check_ros(model: RosModel | None, findings: Findings) -> None:
    """The ``ros`` section: only what needs no ROS to be seen."""
    if model is not None and model.rate is not None and not model.rate.value > 0:
        message = f"'rate' is steps a second and above 0, this is {model.rate.value:g}"
        findings.error("out-of-range", model.rate.span, message)


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
                message = f"a side of a picture has 64 to 16384 pixels, this is {side.value:.15g}"
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
