"""The sections ``layout`` and ``render``: references resolved, values checked.

In: the sections as written, who finds what they name. Out: LayoutSettings, RenderSettings. Gains that an author states
for references are sorted so that the reference naming the fewest is last; where references overlap, a later one
overrides.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Literal, NamedTuple

from neurovis_spec import plugins
from neurovis_spec.compiler.connections.connect import Connected
from neurovis_spec.compiler.drawing.drawing_settings import (
    LEAST_SIDE,
    MOST_PIXELS,
    MOST_SIDE,
    Cell,
    LayoutSettings,
    Mirror,
    RenderSettings,
    ShownState,
    StatedGain,
    StatedTrace,
)
from neurovis_spec.compiler.drawing.mirrors import check_pins, lines_of, mirrors_of
from neurovis_spec.compiler.drawing.page_plan import WrittenPlan, check_plan, plan_of
from neurovis_spec.compiler.drawing.pins import DIAMETER, FARTHEST, pins_of
from neurovis_spec.compiler.names.finder import Finder
from neurovis_spec.compiler.names.references import Directory, check_keys, key_of, resolve, resolve_end
from neurovis_spec.compiler.names.scope import Scope
from neurovis_spec.compiler.neurons.populate import Census
from neurovis_spec.compiler.values.constants import Constants
from neurovis_spec.diagnostics import Findings, Span, shorten
from neurovis_spec.language.data.columns import no_column
from neurovis_spec.language.drawing import GainValue, LayoutModel, ModuleLayoutModel, Range, RenderModel, ThemeModel
from neurovis_spec.language.located import Formula, Located, value_or
from neurovis_spec.language.references import Sum, parse
from neurovis_spec.language.unknown import UNKNOWN, Unknown, known
from neurovis_spec.language.values import Pair, Reference
from neurovis_spec.language.words import MOST_STYLES, TOP, VIEWPOINTS, Direction, Viewpoint
from neurovis_spec.language.yaml.source import Mapping as SourceMapping
from neurovis_spec.likeness import suggest
from neurovis_spec.themes import COLOURS

#: The section where a spec has none.
_EMPTY_LAYOUT = LayoutModel.model_validate(SourceMapping((), Span("", 1, 1, 1, 1)), context=Findings())
GainKind = Literal["activity", "signal", "thickness", "change"]


def layout_settings(
    model: LayoutModel | None, scopes: tuple[Scope, ...], census: Census, findings: Findings
) -> LayoutSettings:
    """The ``layout`` section, and those of modules. Which engines there are is known where they are called; here only
    words are checked."""
    boxes = [*_boxes_in_tables(census)]
    if not boxes and all(scope.section.layout is None for scope in scopes):
        return LayoutSettings()
    pins = pins_of(scopes, census, findings)
    arrange: list[tuple[tuple[int, ...], str]] = []
    for scope, directory in zip(scopes, census.directories, strict=True):
        if scope.section.layout is not None:
            arrange += _arrangements(scope.section.layout, directory, findings)
            boxes += _boxes(scope, scope.section.layout, directory, findings)
    if model is None:
        model = _EMPTY_LAYOUT
    engine = value_or(model.engine, "auto")
    direction: Direction = value_or(model.direction, "down")
    if model.engine is not None:
        _check_engine(model.engine, findings)
    mirrors = mirrors_of(scopes, census, findings)
    lines = lines_of(scopes, census, findings)
    plan = _plan_cells(scopes, census, boxes, mirrors, lines, direction, findings)
    check_pins(mirrors, lines, pins, direction, census.neurons.names, findings)
    spacing = model.spacing
    neuron = _spacing(None if spacing is None else spacing.neuron, 1.0, scopes[0].constants)
    rank = _spacing(None if spacing is None else spacing.rank, 2.0, scopes[0].constants)
    return LayoutSettings(
        engine=engine,
        direction=direction,
        directed=model.direction is not None,
        positions=pins.places,
        arrange=tuple(arrange),
        boxes=tuple(boxes),
        neuron_spacing=neuron,
        rank_spacing=rank,
        relative=pins.relative,
        origins=pins.origins,
        mirrors=mirrors,
        align=lines,
        plan=plan,
        file=value_or(model.file, None),
        view=_view(model, scopes[0].constants, census, findings),
    )


def _view(model: LayoutModel, constants: Constants, census: Census, findings: Findings) -> Viewpoint:
    """From where the network is seen."""
    view = model.view
    if view is None:
        return TOP
    if census.neurons.position.shape[1] == 2:
        message, hint = "'view' has no effect: no neuron has a position of three numbers", "give position: [x, y, z]"
        findings.warning("no-effect", view.span, message, hint)
    if not isinstance(view, Pair):
        return VIEWPOINTS.get(view.value, TOP)
    azimuth, elevation = (known(constants.scalar(one), 0.0) for one in (view.first, view.second))
    if not -90 <= elevation <= 90:
        findings.error("out-of-range", view.second.span, f"an elevation is from -90 to 90 degrees, not {elevation:g}")
    return Viewpoint(azimuth, elevation)


def _plan_cells(
    scopes: tuple[Scope, ...],
    census: Census,
    boxes: Iterable[tuple[str, tuple[int, ...]]],
    mirrors: tuple[Mirror, ...],
    lines: tuple[tuple[int, ...], ...],
    direction: Direction,
    findings: Findings,
) -> tuple[Cell, ...]:
    """The cells of the plans of the page and of instances. A plan names boxes by the titles that they have in its
    scope: ``legs`` is the box ``left.legs`` in the plan of the instance ``left``."""
    members_of_box: dict[str, tuple[int, ...]] = {}
    boxes_of_groups = [(group.box, tuple(group.indices)) for group in census.neurons.groups if group.box is not None]
    for title, members in [*boxes, *boxes_of_groups]:
        members_of_box[title] = (*members_of_box.get(title, ()), *members)
    result: list[Cell] = []
    for scope, directory in zip(scopes, census.directories, strict=True):
        rows = () if scope.section.layout is None else scope.section.layout.plan
        prefix = scope.called("")
        own_boxes = {
            title.removeprefix(prefix): members for title, members in members_of_box.items() if title.startswith(prefix)
        }
        plan = WrittenPlan(scope.path, rows, census.neurons.names)
        cells = plan_of(plan, directory, own_boxes, findings)
        check_plan(plan, cells, mirrors, lines, direction, findings)
        result += cells
    return tuple(result)


def _spacing(formula: Formula | None, default: float, constants: Constants) -> float:
    """A distance of neurons or ranks; the default where none is written, or an invalid one. One out of range is
    reported, and given all the same: with an error nothing is drawn."""
    value = UNKNOWN if formula is None else constants.scalar(formula)
    if formula is None or value is UNKNOWN:
        return default
    if not DIAMETER <= value <= FARTHEST:
        message = f"a spacing lies between {DIAMETER}, the diameter of a neuron, and {FARTHEST:g}; this is {value:g}"
        constants.findings.error("out-of-range", formula.span, message)
    return value


def _arrangements(
    model: LayoutModel | ModuleLayoutModel, directory: Directory, findings: Findings
) -> Iterator[tuple[tuple[int, ...], str]]:
    """The neurons of each reference under ``arrange``, and how they are arranged."""
    check_keys(model.source, "arrange", model.arrange, directory, findings)
    for name, how in model.arrange.items():
        members = resolve_end(key_of(model.source, "arrange", name), directory, findings)
        if members is not UNKNOWN:
            yield members, how.value


def _boxes(
    scope: Scope, model: LayoutModel | ModuleLayoutModel, directory: Directory, findings: Findings
) -> Iterator[tuple[str, tuple[int, ...]]]:
    """The titles and the neurons of the named boxes; a reference in them may name an instance, which stands for all of
    its neurons. A box with an invalid reference is given, too, with nothing in it."""
    for name, reference in model.boxes.items():
        yield scope.called(name), known(resolve(reference.parts, directory, findings, instances=True), ())


def _boxes_in_tables(census: Census) -> Iterator[tuple[str, tuple[int, ...]]]:
    """The titles and the neurons of boxes that tables give to neurons one by one."""
    members: dict[str, list[int]] = {}
    for built in census.groups:
        for neuron, title in enumerate(built.boxes, built.group.start):
            members.setdefault(title, []).append(neuron)
    yield from ((title, tuple(neurons)) for title, neurons in members.items() if title)


def _check_engine(engine: Located[str], findings: Findings) -> None:
    """An engine is ours or a plug-in's; who calls it asks again, as another machine may have others."""
    name = engine.value
    installed = plugins.names(plugins.LAYOUTS)
    if name == "auto" or name in installed:
        return
    hint = suggest(name, ("auto", *installed), "known engines")
    findings.error("unknown-engine", engine.span, f"there is no layout engine '{shorten(name)}' here", hint)


def _collapsed_groups(
    reference: Reference | None, directory: Directory, findings: Findings
) -> Iterator[tuple[str, tuple[int, ...]]]:
    """The names and the neurons of what is drawn as one glyph each: no neuron is in two."""
    texts = () if reference is None else reference.parts
    # resolved as a whole, to report what overlaps; then each by itself, for its members
    if resolve(texts, directory, findings, instances=True) is UNKNOWN:
        return
    for text in texts:
        members = resolve((text,), directory, findings, instances=True)
        if members is not UNKNOWN and members:
            yield text.value.strip(), members


def render_settings(model: RenderModel | None, finder: Finder, constants: Constants) -> RenderSettings:
    """The ``render`` section; ``finder`` knows what references in it name."""
    if model is None:
        return RenderSettings()
    gain, theme = model.gain, model.theme
    size = None
    if model.size is not None:
        width, height = (_side(side, constants) for side in model.size[:2])
        size = None if width is UNKNOWN or height is UNKNOWN else (width, height)
        if size is not None and size[0] * size[1] > MOST_PIXELS:
            message = f"a picture has at most {MOST_PIXELS:,} pixels, this one {size[0] * size[1]:,}"
            hint = "an '.svg' can be shown as large as one likes"
            constants.findings.error("out-of-range", model.size[1].span, message, hint)
    least = None if model.min_weight is None else known(constants.scalar(model.min_weight), None)
    if least is not None and model.min_weight is not None and least < 0:
        message = f"'min_weight' is not negative, this is {least:g}"
        constants.findings.error("out-of-range", model.min_weight.span, message)
    return RenderSettings(
        activity=() if gain is None else stated_gains(gain.activity, "activity", finder, constants),
        signal=() if gain is None else stated_gains(gain.signal, "signal", finder, constants),
        thickness=() if gain is None else stated_gains(gain.thickness, "thickness", finder, constants),
        change=() if gain is None else stated_gains(gain.change, "change", finder, constants),
        traces=_traces(model, finder, constants),
        show=_shown(model, finder),
        style="" if (style := line_style(model)) is None else style.value,
        theme="default" if theme is None else value_or(theme.base, "default"),
        colours=() if theme is None else _theme_changes(theme),
        size=size,
        labels=value_or(model.labels, True),
        legend=value_or(model.legend, True),
        title=True if model.title is None else model.title.value,
        window=None if model.window is None else known(constants.integer(model.window, "a window of steps", 1), None),
        collapse=tuple(_collapsed_groups(model.collapse, finder.directory, constants.findings)),
        min_weight=least,
    )


def line_style(model: RenderModel | None) -> Located[str] | None:
    """The column of the files of edges by whose values lines are solid, dashed, …; None without one."""
    style = None if model is None or model.lines is None else model.lines.style
    return None if style is None else style.name


def check_style(column: Located[str], connected: Connected, findings: Findings) -> None:
    """Report a column that no file of edges has, or that has more values than lines can be told apart."""
    headers = [one.columns.header for one in connected.bundles if one.columns is not None]
    values = connected.styles(column.value)
    if values is not None:
        count = len(values.used)
        if count > MOST_STYLES:
            message = f"the column '{shorten(column.value)}' has {count:,} values; {MOST_STYLES} styles are the most"
            hint = "take a column of fewer values; label: {column: NAME} at an entry writes them beside the lines"
            findings.error("too-many-styles", column.span, message, hint)
    elif connected.complete and headers:
        error = no_column(headers[0], column.value, column)
        findings.error(error.code, column.span, str(error), error.hint)
    elif connected.complete:
        message = "'column' is one of the files of edges, and no entry reads any"
        findings.error("useless-key", column.span, message, "write edges: {file: …} at an entry")


def _traces(model: RenderModel, finder: Finder, constants: Constants) -> tuple[StatedTrace, ...]:
    """The traces that a spec states, those that name the fewest last."""
    traces: list[StatedTrace] = []
    for name, formula in model.trace.items():
        seconds, key = constants.scalar(formula), key_of(model.source, "trace", name)
        if not isinstance(parse(name), Sum):
            message = f"'{shorten(name)}' is a connection; a trace is of neurons"
            constants.findings.error("wrong-type", key.span, message, "lines show the traces of their sources")
            continue
        members = finder.neurons(key)
        if seconds is UNKNOWN:
            continue
        if seconds < 0:
            message = f"a trace lasts for 0 seconds or more, this is {seconds:g}"
            constants.findings.error("out-of-range", formula.span, message)
        elif members is not UNKNOWN:
            traces.append(StatedTrace(seconds, tuple(members.tolist())))
    return tuple(sorted(traces, key=lambda trace: -len(trace.members)))


def _shown(model: RenderModel, finder: Finder) -> tuple[ShownState, ...]:
    """What neurons show in place of their activity; of a neuron that several name it is what the one says that names
    the fewest."""
    shown: list[ShownState] = []
    for name, text in model.show.items():
        key = key_of(model.source, "show", name)
        found = parse(name)
        if not isinstance(found, Sum):
            message = f"'{shorten(name)}' is a connection; what is shown is the colour of neurons"
            finder.findings.error("wrong-type", key.span, message, "the colour of connections is their signal")
            continue
        members = finder.having(key, text)
        if members is not UNKNOWN:
            shown.append(ShownState(text.value, tuple(members.tolist()), found.normal))
    taken, result = set[int](), list[ShownState]()
    for one in sorted(shown, key=lambda one: len(one.members)):
        own = tuple(index for index in one.members if index not in taken)
        taken.update(own)
        result.append(replace(one, members=own))
    return tuple(reversed(result))


def _theme_changes(theme: ThemeModel) -> tuple[tuple[str, str], ...]:
    """The names and the values of what a spec changes of a theme."""
    result: list[tuple[str, str]] = []
    for name in (*COLOURS, "ends"):
        colour: Located[str] | None = getattr(theme, name)
        if colour is not None:
            result.append((name, colour.value))
    return tuple(result)


def _side(formula: Formula, constants: Constants) -> int | Unknown:
    """The width or the height of a picture, in pixels."""
    value = constants.scalar(formula)
    if value is UNKNOWN:
        return UNKNOWN
    if not value.is_integer():
        message = f"a side of a picture must be an integer, this is {value:g}"
        constants.findings.error("not-an-integer", formula.span, message)
        return UNKNOWN
    if not LEAST_SIDE <= value <= MOST_SIDE:
        message = f"a side of a picture has {LEAST_SIDE} to {MOST_SIDE} pixels, this is {value:.15g}"
        constants.findings.error("out-of-range", formula.span, message)
        return UNKNOWN
    return int(value)


class _GainAndCentre(NamedTuple):
    gain: float
    #: what is drawn as 0
    centre: float = 0.0


def stated_gains(
    written: tuple[GainValue, ...], kind: GainKind, finder: Finder, constants: Constants
) -> tuple[StatedGain, ...]:
    """The gains of one kind, those that name the fewest last; what is invalid in them is reported and left out."""
    stated: list[tuple[StatedGain, Span]] = []
    for one in written:
        value = _gain_and_centre(one, constants)
        members = None if one.key is None else _members(one.key, kind, finder)
        if value is UNKNOWN:
            continue
        if one.key is None:
            stated.append((StatedGain(value.gain, centre=value.centre), one.span))
        elif members is not UNKNOWN:
            name = parse(one.key.value).normal
            stated.append((StatedGain(value.gain, members=members, name=name, centre=value.centre), one.key.span))
    stated.sort(key=lambda item: math.inf if item[0].members is None else len(item[0].members))
    _check_ties(stated, constants)
    return tuple(gain for gain, _ in reversed(stated))


def _gain_and_centre(written: GainValue, constants: Constants) -> _GainAndCentre | Unknown:
    """A gain as a number, or of a range ``[low, high]``; UNKNOWN where it is invalid, which is reported."""
    findings = constants.findings
    if isinstance(written.value, Range):
        low, high = (constants.scalar(end) for end in (written.value.low, written.value.high))
        if low is UNKNOWN or high is UNKNOWN:
            return UNKNOWN
        gain = 2 / (high - low) if high > low else math.inf
        if not math.isfinite(gain):
            message = f"a range goes from low to high, this one from {low:g} to {high:g}"
            findings.error("out-of-range", written.span, message, "write [low, high]")
            return UNKNOWN
        return _GainAndCentre(gain, centre=low / 2 + high / 2)  # halved first: the sum may overflow
    value = UNKNOWN if written.value is None else constants.scalar(written.value)
    if value is UNKNOWN:
        return UNKNOWN
    if value < 0:
        findings.error("out-of-range", written.span, f"a gain is not negative, this is {value:g}")
        return UNKNOWN
    return _GainAndCentre(value)


def _members(key: Located[str], kind: GainKind, finder: Finder) -> tuple[int, ...] | Unknown:
    """The indices of what a reference names: of neurons for ``activity``, else of connections."""
    if kind == "activity":
        if not isinstance(parse(key.value), Sum):
            message = f"'{shorten(key.value)}' is a connection; 'activity' is the colour of neurons"
            finder.findings.error("wrong-type", key.span, message, "the colour of connections is 'signal'")
            return UNKNOWN
        found = finder.neurons(key)
    else:
        found = finder.connections(key)
    return UNKNOWN if found is UNKNOWN else tuple(found.tolist())


def _check_ties(stated: list[tuple[StatedGain, Span]], constants: Constants) -> None:
    """Report two references that name as many, overlap, and state different gains: neither goes before the other.
    ``stated`` begins with those that name the fewest."""
    gain_of: dict[int, StatedGain] = {}
    for gain, span in stated:
        members = gain.members or ()
        for member in members:
            other = gain_of.setdefault(member, gain)
            if len(other.members or ()) == len(members) and (other.gain, other.centre) != (gain.gain, gain.centre):
                what = "connections" if "->" in gain.name else "neurons"
                message = f"'{shorten(gain.name)}' and '{shorten(other.name)}' name the same {what}, and as many"
                hint = "where references overlap, the one that names the fewest holds"
                constants.findings.error("repeated-reference", span, message, hint)
                break
