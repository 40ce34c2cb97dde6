"""The compiler: from a Spec to a Network, one stage after the other.

In: a Spec, as far as it could be read, the folder of its data files, parameters to set. Out: a Network, or None with
findings. All findings come at once: what is invalid is UNKNOWN to later stages (``language/unknown.py``), which report
nothing that follows from it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from neurovis_spec.compiler.canonical import content_hash
from neurovis_spec.compiler.checks.compiled import Compiled
from neurovis_spec.compiler.checks.definitions import check_dt, check_slopes, check_slopes_through, integrated
from neurovis_spec.compiler.checks.warnings import warn
from neurovis_spec.compiler.connections.connect import Connected, connect, join, tying
from neurovis_spec.compiler.connections.entries import Bundle
from neurovis_spec.compiler.drawing.drawing_settings import LayoutSettings, RenderSettings
from neurovis_spec.compiler.drawing.sections import check_style, layout_settings, line_style, render_settings
from neurovis_spec.compiler.events.bound import found_in, make_settable, own_weights
from neurovis_spec.compiler.flows import BY_SLOPE, plain_flow, sent_by
from neurovis_spec.compiler.levels import Cycle, Order, held_at, order_of
from neurovis_spec.compiler.limits import MOST_SIGNALS, MOST_SUBSTEPS, Limits, amount
from neurovis_spec.compiler.lower import Integration, make_populations, make_program
from neurovis_spec.compiler.names.expand import Expander, constants_of
from neurovis_spec.compiler.names.finder import Finder, finder_of
from neurovis_spec.compiler.names.modules import Library, library_of
from neurovis_spec.compiler.names.outputs import make_outputs
from neurovis_spec.compiler.names.references import Directory, other_parameter
from neurovis_spec.compiler.names.scope import Expansion, Scope, Surroundings
from neurovis_spec.compiler.network import Input, Instance, Network, Noise, Output
from neurovis_spec.compiler.neurons.noise import make_noises
from neurovis_spec.compiler.neurons.populate import Census, populate, without_neurons
from neurovis_spec.compiler.projections import make_projections
from neurovis_spec.compiler.ros_settings import RosSettings
from neurovis_spec.compiler.run_checks import with_checks
from neurovis_spec.compiler.taken import Side, read_at, reads_past
from neurovis_spec.compiler.values.constants import Constants, Sight, parse_formula
from neurovis_spec.compiler.values.data_files import Files
from neurovis_spec.compiler.values.parameters import make_parameters
from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.expressions.functions import CONSTANTS
from neurovis_spec.language.includes import Includes, ReadBytes
from neurovis_spec.language.located import value_or
from neurovis_spec.language.model import names_of, opening
from neurovis_spec.language.spec import Spec, is_library
from neurovis_spec.language.units import measured
from neurovis_spec.language.unknown import UNKNOWN, known
from neurovis_spec.language.yaml.opening import read_bytes

if TYPE_CHECKING:
    from neurovis_spec.compiler.body_settings import BodySettings
    from neurovis_spec.compiler.events.events import Event


@dataclass(frozen=True)
class Request:
    """How a spec is to be compiled: where its files lie, what is set, how large it may become."""

    #: the folder that its paths are relative to
    base: Path
    #: the folder that its files may not lie outside of
    root: Path
    #: values of parameters, by name, in place of those of the spec; a text is a number with a unit
    parameters: Mapping[str, float | str] = field(default_factory=dict)
    #: in place of that of the spec
    seed: int | None = None
    limits: Limits = field(default_factory=Limits)
    #: how included files are read, and those that were
    read: ReadBytes = read_bytes
    includes: Includes = field(default_factory=Includes)
    #: the data files by the folder that paths are relative to
    files: Mapping[Path, Files] = field(default_factory=dict)
    #: whether the network has a body: that of the spec, or that of this file
    body: bool | Path = True


class _Declared(NamedTuple):
    """What the sections declare that the others name. What of it is invalid is reported."""

    seed: int
    constants: Constants
    steps: int
    episode: int | None
    integration: Integration
    library: Library
    #: the names of the modules that have an instance
    modules_used: set[str]
    expansion: Expansion
    census: Census


class _Sections(NamedTuple):
    """What the sections come to, but for the events. All of them are valid."""

    declared: _Declared
    connected: Connected
    order: Order
    #: resolves what events name
    finder: Finder
    outputs: tuple[Output, ...]
    noises: tuple[Noise, ...]
    layout: LayoutSettings
    render: RenderSettings
    ros: RosSettings
    body: BodySettings | None


def compile_spec(spec: Spec, request: Request, findings: Findings) -> Network | None:
    """The network of a spec; None where it is invalid (the findings say why)."""
    sections = _compile_sections(spec, request, findings)
    if sections is None:
        return None
    network = _assemble(spec, sections)
    declared, bundles = sections.declared, sections.connected.bundles
    eventful = _eventful(spec, network, sections.finder, declared.constants)
    if eventful is not None and not findings.failed:  # the shape may have been invalid
        files = tuple(file.model for file in request.includes.files)
        scopes, library, used = declared.expansion.scopes, declared.library, declared.modules_used
        warn(Compiled(spec, scopes, library, used, eventful, bundles, declared.census, files), findings)
    return None if eventful is None else with_checks(eventful)


def _compile_sections(spec: Spec, request: Request, findings: Findings) -> _Sections | None:
    """Every section but the events; None where anything is invalid. Then the events are only checked."""
    before = findings.errors
    declared = _declare(spec, request, findings)
    constants, census = declared.constants, declared.census
    scopes, inputs = declared.expansion.scopes, declared.expansion.inputs
    layout = layout_settings(spec.layout, scopes, census, findings)
    style = line_style(spec.render)
    connected = connect(scopes, census, request.limits, declared.seed, style)
    files, used = [file.model for file in request.includes.files], integrated(census.groups, connected.bundles)
    check_dt(spec, files, used, [scope.section for scope in scopes], findings)
    if declared.integration.method in BY_SLOPE:
        check_slopes(spec, files, used, findings)
        check_slopes_through(spec, files, census, connected.bundles, findings)
    finder = finder_of(census, connected, findings)
    render = render_settings(spec.render, finder, constants)
    if style is not None:
        check_style(style, connected, findings)
    outputs = make_outputs(spec, finder)
    if spec.render is not None and spec.render.figure:
        from neurovis_spec.compiler.drawing.figure import figure_of

        render = replace(render, figure=figure_of(spec, census, inputs, outputs, finder))
    around = Surroundings(spec, scopes[0], inputs, outputs)
    ros = _ros(around, finder.directory, constants)
    body = _body(around, request, constants)
    noises = make_noises(census, sum(entry.size for entry in inputs))
    declared.expansion.depend()  # last, as every section may have made parameters of instances structural
    order = _order(connected, census, inputs, noises, findings)
    valid = connected.complete and findings.errors == before
    if order is None or not valid or not _signals_fit(connected.bundles, len(census.neurons), findings):
        _read_events(spec, finder, inputs, constants)  # for its findings alone
        return None
    return _Sections(
        declared=declared,
        connected=connected,
        order=order,
        finder=finder,
        outputs=outputs,
        noises=noises,
        layout=layout,
        render=render,
        ros=ros,
        body=body,
    )


def _declare(spec: Spec, request: Request, findings: Findings) -> _Declared:
    """Parameters, definitions, modules, inputs and neurons; modules without an instance are checked as a whole."""
    seed = 0 if spec.seed is None else spec.seed.value
    seed = seed if request.seed is None else request.seed
    constants = Constants(names_of(spec, "parameters", {}), 1.0, findings)
    constants.timed = _step_length(spec, constants)
    library = library_of(spec, request.includes, request.base, constants.dt, findings)
    make_parameters(spec, constants, request.parameters)
    _check_names_set(spec, constants, request.parameters)
    steps, episode, integration = _clock(spec, constants)
    expander = Expander(library, request.root, findings, constants.dt, files={**request.files}, limits=request.limits)
    expansion = expander.expand(spec, constants, request.base)
    census = populate(expansion.scopes, request.limits, seed)
    _check_modules_without_instance(expander, request.limits, seed)
    if not len(census.neurons):
        _report_no_neurons(spec, census, findings)
        census = without_neurons(census)
    return _Declared(
        seed=seed,
        constants=constants,
        steps=steps,
        episode=episode,
        integration=integration,
        library=library,
        modules_used=expander.used,
        expansion=expansion,
        census=census,
    )


def _assemble(spec: Spec, sections: _Sections) -> Network:
    """The network that valid sections make, but for its events."""
    declared, connected = sections.declared, sections.connected
    constants, census = declared.constants, declared.census
    name = known(spec.name.value, "")
    populations = make_populations(census, connected.wired, sections.order)
    projected = make_projections(connected, populations)
    stages = sections.order.stages
    lagging = None if stages is None else stages.lagging
    connections = join(connected, projected.rules, lagging, sections.render.style)
    slots = tuple(constants.slots)
    network = Network(
        name=name,
        title=", ".join(text.value for text in spec.title or ()) or name,
        description="\n".join(text.value for text in spec.description or ()),
        dt=constants.dt,
        dt_given=spec.time is not None and spec.time.dt is not None,
        dt_unit=_unit_of_dt(spec),
        steps=declared.steps,
        episode=declared.episode,
        seed=declared.seed,
        parameters=dict(constants.parameters),
        structural=frozenset(constants.structural),
        neurons=census.neurons,
        connections=connections,
        inputs=declared.expansion.inputs,
        outputs=sections.outputs,
        populations=populations,
        projections=projected.projections,
        program=make_program(populations, projected, sections.order, declared.integration, tying(connections)),
        layout=sections.layout,
        render=sections.render,
        hash="",  # of all the rest
        noises=sections.noises,
        instances=_instances(declared.expansion.scopes, census),
        numbering=own_weights(slots, connected.bundles, connections.weights),
        ros=sections.ros,
        body=sections.body,
    )
    settable = make_settable(network, slots, found_in(network, census, connected.bundles))
    return replace(network, hash=content_hash(network), settable=settable)


def _ros(around: Surroundings, directory: Directory, constants: Constants) -> RosSettings:
    """The ``ros`` section. Most specs have none: nothing that reads it is imported then."""
    if around.spec.ros is None:
        return RosSettings(rate=1 / constants.dt)
    from neurovis_spec.compiler.ros import ros_settings

    return ros_settings(around.spec.ros, around, directory, constants)


def _body(around: Surroundings, request: Request, constants: Constants) -> BodySettings | None:
    """The ``body`` section, of the spec or of the file that is asked for. Most specs have none: nothing that reads it
    is imported then."""
    model, body_of_spec = around.spec.body, None
    if model is not None:  # where it is not wanted it is not opened, but it reads parameters all the same
        from neurovis_spec.compiler.body import Place, body_settings

        place = Place(request.base, request.root) if request.body is True else None
        body_of_spec = body_settings(model, around, constants, place)
    if isinstance(request.body, Path):
        return _body_of_file(request.body, around, constants)
    return body_of_spec if request.body else None


def _body_of_file(path: Path, around: Surroundings, constants: Constants) -> BodySettings | None:
    """The ``body`` section of another file, whose paths are relative to its own folder."""
    from neurovis_spec.compiler.body import Place, body_settings
    from neurovis_spec.language.shape import read_body

    model = read_body(path, constants.findings)
    if model is None:
        return None
    return body_settings(model, around, constants, Place(path.parent, path.parent))


def _check_modules_without_instance(expander: Expander, limits: Limits, seed: int) -> None:
    """Check each module without an instance by compiling it alone, with its own parameters. Modules that occur in
    others come last, as they are checked with these. All together have the limits of one network; when these are used
    up, the others are left unchecked."""
    modules = expander.library.modules.known()
    inner = {instance.module.value for module in modules.values() for instance in module.model.instances.values()}
    neurons, connections = limits.neurons, limits.connections
    for name in sorted(modules, key=inner.__contains__):
        if name in expander.used or min(neurons, connections) < 0:
            continue
        module = modules[name]
        constants = constants_of(module, expander.dt, expander.findings)
        make_parameters(module.model, constants, {})
        scopes = expander.expand(module.model, constants, module.folder, name).scopes
        census = populate(scopes, limits, seed)
        connected = connect(scopes, census, limits, seed)
        make_noises(census, 0)  # this and the layout for their findings alone
        layout_settings(None, scopes, census, expander.findings)
        neurons -= len(census.neurons)
        connections -= sum(len(bundle.sources) for bundle in connected.bundles)


def _instances(scopes: tuple[Scope, ...], census: Census) -> tuple[Instance, ...]:
    return tuple(
        Instance(scope.path, scope.module, members.start, len(members), scope.declared, scope.number)
        for scope, members in zip(scopes, (directory.members for directory in census.directories), strict=True)
        if scope.module is not None
    )


def _eventful(spec: Spec, network: Network, finder: Finder, constants: Constants) -> Network | None:
    """The network with what its events change; its hash says that they are there."""
    if not spec.events:
        return network
    from neurovis_spec.compiler.events.timeline import with_changes

    before = constants.findings.errors
    events = _read_events(spec, finder, network.inputs, constants)
    if constants.findings.errors > before:
        return None
    changed = with_changes(network, events, constants)
    return None if constants.findings.errors > before else changed


def _read_events(spec: Spec, finder: Finder, inputs: tuple[Input, ...], constants: Constants) -> tuple[Event, ...]:
    """The events of a spec. Most specs have none: nothing that reads them is imported then."""
    if not spec.events:
        return ()
    from neurovis_spec.compiler.events.events import EventReader

    return EventReader(finder, constants, {entry.name: entry for entry in inputs}).read(spec.events)


def _report_no_neurons(spec: Spec, census: Census, findings: Findings) -> None:
    """Without neurons nothing else can be checked; if that is because groups are invalid, it is said already."""
    if any(directory.invalid or directory.invalid.is_open for directory in census.directories):
        return
    node = spec.source.entry("neurons")
    span = opening(spec.source) if node is None else node.key.span
    message, hint = "a network needs at least one neuron", "add a group under 'neurons'"
    if is_library(spec.source):
        if spec.source.entry("name") is None:
            return  # which is said, with what the file is good for
        hint += "; or leave out its name: specs use what it holds with include: [FILE]"
    findings.error("no-neurons", span, message, hint, key="neurons")  # also where the name is missing there


def _order(
    connected: Connected, census: Census, inputs: tuple[Input, ...], noises: tuple[Noise, ...], findings: Findings
) -> Order | None:
    """The levels of all neurons; None where neurons wait for each other, which is reported: a cycle of connections that
    are in order is one whatever becomes of the others."""
    held = held_at(census.neurons, inputs, noises) if census.models.flow else {}
    order = order_of(census.models.different, census.models.of, connected.wired, held, census.units)
    if not isinstance(order, Cycle):
        return order
    names = (*census.neurons.names, "the integration")
    if order.algebraic:
        names = _outputs_of(order, connected, census)
    path = [names[node] for node in order.neurons]
    shown = " -> ".join(path if len(path) <= 12 else [*path[:6], "…", *path[-5:]])
    key = connected.bundle_of(order.closing).key
    if order.algebraic:
        message = f"what these neurons send reads each other within one stage: {shown}"
        findings.error("algebraic-loop", key, message, "a state with a derivative, or delay: 1, breaks it")
        return None
    hint = "give one of these connections a delay of at least 1"
    if len(census.neurons) in order.neurons:
        hint += "; what reaches a derivative without delay, and does not flow itself, is made before the integration"
    findings.error("delay-0-cycle", key, f"these neurons wait for each other within one step: {shown}", hint)
    return None


def _outputs_of(cycle: Cycle, connected: Connected, census: Census) -> tuple[str, ...]:
    """What all neurons are called, those of a cycle with what is taken of them along it: ``K1.rate``."""
    names = [*census.neurons.names]
    for neuron, target, connection in zip(cycle.neurons, cycle.neurons[1:], cycle.connections, strict=False):
        model, bundle = census.models.different[census.models.of[neuron]], connected.bundle_of(connection)
        taken = [sent_by(model, bundle.route.sends)]
        if bundle.synapse is not None:
            sides: tuple[Side, ...] = ("post", "pre") if neuron == target else ("pre",)
            read = [read_at(side, bundle.synapse.definition, bundle.route.sends) for side in sides]
            taken = [name for names_read in read for name in names_read if not plain_flow(model, name)]
        names[neuron] = f"{names[neuron]}.{sent_by(model, taken[0])}"
    return tuple(names)


def _signals_fit(bundles: tuple[Bundle, ...], neurons: int, findings: Findings) -> bool:
    """Whether the signals under way fit into memory: delays of all connections together. With a synapse nothing is
    under way; in its place, and for a rule that reads ``pre``, what all neurons send is kept for as long as the delay
    is."""
    total = 0
    for bundle in bundles:
        kept, wanted = neurons * int(bundle.delays.max(initial=0)), list[tuple[int, str]]()
        if bundle.synapse is None:
            total += int(bundle.delays.sum())
            wanted.append((total, "signals would be under way at once (connections times delay)"))
        else:
            wanted.append((kept, "numbers would be kept for a synapse (neurons times delay)"))
        if any(reads_past(one.rule) for one in bundle.rules):
            wanted.append((kept, "numbers would be kept for a rule that reads 'pre' (neurons times delay)"))
        for much, what in wanted:
            if much > MOST_SIGNALS:
                findings.error("too-many", bundle.key, f"{amount(much)} {what}; {MOST_SIGNALS:,} are the most")
                return False
    return True


def _step_length(spec: Spec, constants: Constants) -> bool:
    """dt, before anything else: parameters may use it, so it uses none of them. Whether it is in order, or left out."""
    if spec.time is None or spec.time.dt is None:
        return "time" not in spec.unknown if spec.time is None else "dt" not in spec.time.unknown
    known = "'dt' comes before the parameters, which may use it; known here"
    if parse_formula(spec.time.dt, Sight(CONSTANTS, known), constants.findings) is UNKNOWN:
        return False
    dt = constants.scalar(spec.time.dt)
    if dt is UNKNOWN:
        return False
    if not dt > 0:
        message = f"'dt' is seconds a step and above 0, this is {dt:g}"
        constants.findings.error("out-of-range", spec.time.dt.span, message)
        return False
    constants.dt = dt
    return True


def _unit_of_dt(spec: Spec) -> str:
    """The unit in which ``dt`` is written, s where that says none."""
    written = None if spec.time is None or spec.time.dt is None else spec.time.dt.node.value
    found = measured(written) if isinstance(written, str) else None
    return "s" if found is None else found.unit


def _check_names_set(spec: Spec, constants: Constants, values: Mapping[str, float | str]) -> None:
    """Report names that the caller sets and that are no parameters of the spec."""
    for name in values:
        if name not in spec.parameters:
            node = spec.source.entry("parameters")
            span = opening(spec.source) if node is None else node.key.span
            hint = other_parameter(name, spec.parameters)
            constants.findings.error("unknown-parameter", span, f"there is no parameter '{name}' to be set", hint)


def _clock(spec: Spec, constants: Constants) -> tuple[int, int | None, Integration]:
    """The default run length, the length of an episode, and how states are integrated."""
    time = spec.time
    steps, episode, integration = 1000, None, Integration()
    if time is not None and time.steps is not None:
        steps = known(constants.integer(time.steps, "'steps'", 1, structural=False), steps)
    if time is not None and time.episode is not None:
        episode = known(constants.integer(time.episode, "'episode'", 1), None)
    if time is not None and time.integrate is not None:
        by = time.integrate
        parts = 1 if by.substeps is None else known(constants.integer(by.substeps, "'substeps'", 1, MOST_SUBSTEPS), 1)
        integration = Integration(value_or(by.method, integration.method), parts)
    return steps, episode, integration
