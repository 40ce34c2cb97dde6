"""The compiler: from a Spec to a Network, one stage after the other.

In: a Spec, as far as it could be read, the folder of its data files, parameters to set. Out: a Network, or None with
findings. All findings come at once: what is invalid is UNKNOWN to later stages (``language/unknown.py``), which report
nothing that follows from it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from neurovis_spec.arrays import IntArray
from neurovis_spec.compiler.body_settings import BodySettings
from neurovis_spec.compiler.canonical import content_hash
from neurovis_spec.compiler.checks.compiled import Compiled
from neurovis_spec.compiler.checks.warnings import warn
from neurovis_spec.compiler.connections.connect import Connected, connect, join
from neurovis_spec.compiler.connections.entries import Bundle
from neurovis_spec.compiler.drawing.sections import layout_settings, render_settings
from neurovis_spec.compiler.events.bound import found_in, make_settable, own_weights
from neurovis_spec.compiler.limits import MOST_SIGNALS, Limits, amount
from neurovis_spec.compiler.lower import Cycle, assign_levels, make_populations, make_program, make_projections
from neurovis_spec.compiler.names.expand import Expander, constants_of
from neurovis_spec.compiler.names.finder import Finder, finder_of
from neurovis_spec.compiler.names.modules import library_of
from neurovis_spec.compiler.names.outputs import make_outputs
from neurovis_spec.compiler.names.references import other_parameter
from neurovis_spec.compiler.names.scope import Scope, Surroundings
from neurovis_spec.compiler.network import Input, Instance, Network, Output
from neurovis_spec.compiler.neurons.noise import make_noises
from neurovis_spec.compiler.neurons.populate import Census, populate, without_neurons
from neurovis_spec.compiler.ros_settings import RosSettings
from neurovis_spec.compiler.run_checks import with_checks
from neurovis_spec.compiler.values.constants import Constants, Sight, parse_formula
from neurovis_spec.compiler.values.data_files import Files
from neurovis_spec.compiler.values.parameters import make_parameters
from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.expressions.functions import CONSTANTS
from neurovis_spec.language.includes import Includes, ReadBytes
from neurovis_spec.language.model import names_of, opening
from neurovis_spec.language.spec import Spec, is_library
from neurovis_spec.language.unknown import UNKNOWN, known
from neurovis_spec.language.yaml.opening import read_bytes

if TYPE_CHECKING:
    from neurovis_spec.compiler.events.events import Event


@dataclass(frozen=True)
class Request:
    """How a spec is to be compiled: where its files lie, what is set, how large it may become."""

    base: Path
    root: Path
    parameters: Mapping[str, float] = field(default_factory=dict)
    seed: int | None = None
    limits: Limits = field(default_factory=Limits)
    #: how included files are read, and those that were; the data files by the folder that paths are relative to
    read: ReadBytes = read_bytes
    includes: Includes = field(default_factory=Includes)
    files: Mapping[Path, Files] = field(default_factory=dict)
    #: whether the network has a body: that of the spec, or that of this file
    body: bool | Path = True


def compile_spec(spec: Spec, request: Request, findings: Findings) -> Network | None:
    """The network of a spec; None where it is invalid (the findings say why)."""
    before = findings.errors
    name = known(spec.name.value, "")
    seed = request.seed if request.seed is not None else 0 if spec.seed is None else spec.seed.value
    constants = Constants(names_of(spec, "parameters", {}), 1.0, findings)
    dt_known = _step_length(spec, constants)
    library = library_of(spec, request.includes, request.base, constants.dt, findings)
    make_parameters(spec, constants, request.parameters)
    _check_given(spec, constants, request.parameters)
    steps, episode = _clock(spec, constants)
    expander = Expander(library, request.root, findings, constants.dt, files={**request.files}, limits=request.limits)
    expansion = expander.expand(spec, constants, request.base)
    scopes, inputs = expansion.scopes, expansion.inputs
    census = populate(scopes, request.limits, seed)
    _check_unused(expander, request.limits, seed)
    if not len(census.neurons):
        _report_no_neurons(spec, census, findings)
        census = without_neurons(census)
    layout = layout_settings(spec.layout, scopes, census, findings)
    made = connect(scopes, census, request.limits, seed)
    bundles = made.bundles
    finder = finder_of(census, made, findings)
    render = render_settings(spec.render, finder, constants)
    outputs = make_outputs(spec, finder)
    if spec.render is not None and spec.render.figure:
        from neurovis_spec.compiler.drawing.figure import figure_of

        render = replace(render, figure=figure_of(spec, census, outputs, finder))
    ros = _ros(spec, inputs, outputs, scopes[0], constants)
    body = _body(spec, request, inputs, outputs, scopes[0], constants, dt_known=dt_known)
    noises = make_noises(census, sum(entry.size for entry in inputs))
    expansion.depend()
    level = _levels(made, census, findings)
    if level is None or not made.complete or findings.errors > before or not _under_way(bundles, findings):
        _read_events(spec, finder, constants)
        return None
    projections, rules = make_projections(bundles)
    connections = join(made, rules)
    populations = make_populations(census, made.targets.compact(), level)
    program = make_program(populations, projections)
    slots = tuple(constants.slots)
    network = Network(
        name=name,
        title=", ".join(text.value for text in spec.title or ()) or name,
        description="\n".join(text.value for text in spec.description or ()),
        dt=constants.dt,
        dt_given=spec.time is not None and spec.time.dt is not None,
        steps=steps,
        episode=episode,
        seed=seed,
        parameters=dict(constants.parameters),
        structural=frozenset(constants.structural),
        neurons=census.neurons,
        connections=connections,
        inputs=inputs,
        outputs=outputs,
        populations=populations,
        projections=projections,
        program=program,
        layout=layout,
        render=render,
        hash="",  # of all the rest
        noises=noises,
        instances=_instances(scopes, census),
        numbering=own_weights(slots, bundles, connections.weights.whole()),
        ros=ros,
        body=body,
    )
    settable = make_settable(network, slots, found_in(network, census, bundles))
    network = replace(network, hash=content_hash(network), settable=settable)
    eventful = _eventful(spec, network, finder, constants)
    if eventful is not None and not findings.failed:  # the shape may have been invalid
        files = tuple(file.model for file in request.includes.files)
        warn(Compiled(spec, scopes, library, expander.used, eventful, bundles, census, files), findings)
    return None if eventful is None else with_checks(eventful)


def _ros(
    spec: Spec, inputs: tuple[Input, ...], outputs: tuple[Output, ...], root: Scope, constants: Constants
) -> RosSettings:
    """The ``ros`` section. Most specs have none: nothing that reads it is imported then."""
    if spec.ros is None:
        return RosSettings(rate=1 / constants.dt)
    from neurovis_spec.compiler.ros import ros_settings

    return ros_settings(spec.ros, Surroundings(spec, root, inputs, outputs), constants)


def _body(
    spec: Spec,
    request: Request,
    inputs: tuple[Input, ...],
    outputs: tuple[Output, ...],
    root: Scope,
    constants: Constants,
    *,
    dt_known: bool,
) -> BodySettings | None:
    """The ``body`` section, of the spec or of the file that is asked for. Most specs have none: nothing that reads it
    is imported then."""
    if spec.body is None and isinstance(request.body, bool):
        return None
    from neurovis_spec.compiler.body import Place, body_settings

    around, made = Surroundings(spec, root, inputs, outputs), None
    if spec.body is not None:  # where it is not wanted it is not opened, but it reads parameters all the same
        place = Place(request.base, request.root) if request.body is True else None
        made = body_settings(spec.body, around, constants, place, dt_known=dt_known)
    if not isinstance(request.body, Path):
        return made if request.body else None
    from neurovis_spec.language.shape import read_body

    other, folder = read_body(request.body, constants.findings), request.body.parent
    if other is None:
        return None
    return body_settings(other, around, constants, Place(folder, folder), dt_known=dt_known)


def _check_unused(expander: Expander, limits: Limits, seed: int) -> None:
    """Check each module without an instance by compiling it alone, with its own parameters. Modules that occur in
    others come last, as they are checked with these; all together must keep the limits of one network."""
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
        made = connect(scopes, census, limits, seed)
        make_noises(census, 0)
        layout_settings(None, scopes, census, expander.findings)
        neurons -= len(census.neurons)
        connections -= sum(len(bundle.sources) for bundle in made.bundles)


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
    events = _read_events(spec, finder, constants)
    if constants.findings.errors > before:
        return None
    made = with_changes(network, events, constants)
    return None if constants.findings.errors > before else made


def _read_events(spec: Spec, finder: Finder, constants: Constants) -> tuple[Event, ...]:
    """The events of a spec. Most specs have none: nothing that reads them is imported then."""
    if not spec.events:
        return ()
    from neurovis_spec.compiler.events.events import EventReader

    return EventReader(finder, constants).read(spec.events)


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


def _levels(made: Connected, census: Census, findings: Findings) -> IntArray | None:
    """The level of each neuron; None where neurons wait for each other, which is reported: a cycle of connections that
    are in order is one whatever becomes of the others."""
    level = assign_levels(len(census.neurons), made.sources, made.targets, made.delays)
    if not isinstance(level, Cycle):
        return level
    path = [census.neurons.names[neuron] for neuron in level.neurons]
    shown = path if len(path) <= 12 else [*path[:6], "…", *path[-5:]]
    message = f"these neurons wait for each other within one step: {' -> '.join(shown)}"
    ends = np.cumsum([len(bundle.sources) for bundle in made.bundles])
    bundle = made.bundles[int(np.searchsorted(ends, level.connection, side="right"))]
    findings.error("delay-0-cycle", bundle.key, message, "give one of these connections a delay of at least 1")
    return None


def _under_way(bundles: tuple[Bundle, ...], findings: Findings) -> bool:
    """Whether the signals under way fit into memory: delays of all connections together."""
    total = 0
    for bundle in bundles:
        total += int(bundle.delays.sum())
        if total > MOST_SIGNALS:
            message = f"{amount(total)} signals would be under way at once (connections times delay); "
            findings.error("too-many", bundle.key, f"{message}{MOST_SIGNALS:,} are the most")
            return False
    return True


def _step_length(spec: Spec, constants: Constants) -> bool:
    """dt, before anything else: parameters may use it, so it uses none of them. Whether it is in order, or left out."""
    if spec.time is None or spec.time.dt is None:
        return spec.time is None or "dt" not in spec.time.unknown
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


def _check_given(spec: Spec, constants: Constants, given: Mapping[str, float]) -> None:
    """Report names that the caller sets and that are no parameters of the spec."""
    for name in given:
        if name not in spec.parameters:
            node = spec.source.entry("parameters")
            span = opening(spec.source) if node is None else node.key.span
            hint = other_parameter(name, spec.parameters)
            constants.findings.error("unknown-parameter", span, f"there is no parameter '{name}' to be set", hint)


def _clock(spec: Spec, constants: Constants) -> tuple[int, int | None]:
    """The default run length and the length of an episode."""
    time = spec.time
    steps, episode = 1000, None
    if time is not None and time.steps is not None:
        steps = known(constants.integer(time.steps, "'steps'", 1, structural=False), steps)
    if time is not None and time.episode is not None:
        episode = known(constants.integer(time.episode, "'episode'", 1), None)
    return steps, episode
