"""The ``body`` section: the body is opened, and every name in it compared with what the body and the network have.

In: the section as written, the inputs and outputs, where files may lie. Out: BodySettings, a value of the Network that
runs read; or findings. Where what a body needs is not installed, its names are not checked, which is a warning.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final, NamedTuple

from neurovis_spec.body import Body, BodyError, BodyMissingError, Port, load_kind, open_body
from neurovis_spec.compiler.body_settings import BodySettings, Moved, Sensed
from neurovis_spec.compiler.events.settable import slots_named
from neurovis_spec.compiler.limits import plural
from neurovis_spec.compiler.names.references import key_of, known_inputs
from neurovis_spec.compiler.names.scope import Surroundings
from neurovis_spec.compiler.network import Output
from neurovis_spec.compiler.values.constants import ALWAYS, Constants, Sight, is_constant, parse_formula
from neurovis_spec.compiler.values.constants import Scope as Together
from neurovis_spec.diagnostics import Findings, Home, Span, shorten
from neurovis_spec.language.body import BodyModel
from neurovis_spec.language.data.files import LARGEST, NamedFile, read_data
from neurovis_spec.language.expressions.tree import Name, names, walk
from neurovis_spec.language.located import Formula, Located
from neurovis_spec.language.model import names_of
from neurovis_spec.language.unknown import UNKNOWN, Unknown
from neurovis_spec.language.yaml.opening import FileFault, fault_of
from neurovis_spec.likeness import suggest
from neurovis_spec.real_paths import real_path

#: More steps of a body within one of the network are a mistake.
MOST_STEPS_WITHIN: Final = 1_000_000
#: Bytes of all files that a body is made of; each is as large as any data file at most.
LARGEST_TOGETHER: Final = 1 << 30
#: What is wrong with places where there is nothing to open.
_NOT_THERE: Final = ("file-missing", "file-unreadable")
#: Where what commands may name is declared.
_HOME: Final = Home((), ("outputs", "parameters"))
#: One number of a sensor, an actuator or an output: ``torso_up[2]``.
_ONE: Final = re.compile(r"(.*)\[\s*([0-9]{1,9})\s*\]", re.DOTALL)


class Clock(NamedTuple):
    """The seconds of a step of the network, and how many steps of the body these are, as the spec says it; ``default``:
    it does not say the seconds."""

    dt: float
    substeps: int | None = None
    written: Formula | None = None
    default: bool = False


@dataclass(frozen=True)
class Place:
    """Where the files of a spec lie, and which folder they may not leave."""

    base: Path
    root: Path


def body_settings(
    model: BodyModel, around: Surroundings, constants: Constants, place: Place | None
) -> BodySettings | None:
    """The ``body`` section of a spec. What is invalid in it is reported and left out. Without a ``place`` the body is
    not opened, and its own names are not checked."""
    findings = constants.findings
    kind, given = next(iter(model.kinds.items()), ("", None))
    substeps = None if model.substeps is None else constants.integer(model.substeps, "'substeps'", 1, MOST_STEPS_WITHIN)
    path = body = None
    if given is not None and len(model.kinds) == 1 and place is not None:
        clock = None
        if constants.timed and substeps is not UNKNOWN:
            time = around.spec.time
            clock = Clock(constants.dt, substeps, model.substeps, time is None or time.dt is None)
        path, body = find_body(kind, given, place, clock, findings)
    sensed = tuple(_sensed_inputs(model, around, None if body is None else body.sensors, findings))
    moved = tuple(_commands(model, around, None if body is None else body.actuators, constants))
    each_episode = model.reset is not None and model.reset.value == "each_episode"
    if given is None or substeps is UNKNOWN:
        return None
    sensors = {} if body is None else {port.name: port.numbers for port in body.sensors}
    return BodySettings(kind, given.value, path, substeps, sensed, moved, each_episode, sensors)


def find_body(
    kind: str, given: Located[str], place: Place, clock: Clock | None, findings: Findings
) -> tuple[Path | None, Body | None]:
    """The file that a body is made of, where its kind takes one, and the body; None where it cannot be opened, or the
    clock is not known."""
    path, ready = _find_file(kind, given, place, findings)
    return path, _open(kind, given, path, clock, findings) if ready and clock is not None else None


def _find_file(kind: str, given: Located[str], place: Place, findings: Findings) -> tuple[Path | None, bool]:
    """The file that a body is made of, None where its kind takes none, and whether all is there that it needs."""
    try:
        loaded = load_kind(kind)
        if not loaded.takes_file:
            return None, True
        if read_data(NamedFile(given.value, place.root, place.base, given.span), findings) is UNKNOWN:
            return None, False
        path = real_path(place.base / given.value)
        return path, _all_sound(loaded.files(path), given, real_path(place.root), findings)
    except BodyMissingError as error:
        _warn_unchecked(error, given, findings)
        return real_path(place.base / given.value), False
    except BodyError as error:
        findings.error("bad-body", given.span, str(error), error.hint)
    except Exception as error:  # whatever somebody's code raises while it looks at a file
        findings.error("bad-body", given.span, f"'{shorten(given.value)}' cannot be opened: {error!r}")
    return None, False


def _all_sound(parts: Iterable[Path], given: Located[str], inside: Path, findings: Findings) -> bool:
    """Whether what lies at the places that a body's file names may be opened: regular files inside the folder, not too
    large, each and together. A place is looked at before the next is asked for, as only then a kind may open it."""
    sizes: dict[Path, int] = {}
    for part in parts:
        real = real_path(part)
        findings.files.setdefault(real, "")
        fault, hint = fault_of(real, LARGEST), None
        if not real.is_relative_to(inside) and real.exists():
            fault = FileFault("path-outside", "lies outside the folder of the spec")
            hint = "data lies in the folder of the main spec or below it (--root names another folder)"
        elif real.is_dir() or (fault is not None and fault.code in _NOT_THERE):
            continue  # whoever opens the body says what is missing, and where else it was looked for
        if fault is not None:
            message = f"'{shorten(given.value)}' names the file '{shorten(part.name)}', which {fault.reason}"
            findings.error(fault.code, given.span, message, hint)
            return False
        sizes[real] = real.stat().st_size
        if sum(sizes.values()) > LARGEST_TOGETHER:
            most = f"{LARGEST_TOGETHER >> 20:,} MiB together"
            findings.error("too-large", given.span, f"'{shorten(given.value)}' names files that are larger than {most}")
            return False
    return True


def _warn_unchecked(error: BodyMissingError, given: Located[str], findings: Findings) -> None:
    findings.warning("body-unchecked", given.span, f"{error}: the names in 'body' are not checked", error.hint)


def _open(kind: str, given: Located[str], path: Path | None, clock: Clock, findings: Findings) -> Body | None:
    """The body; None where it cannot be opened, or where something that it needs is missing, which is a warning. Where
    the clock does not fit, the body is opened with one that does, to check the names all the same."""
    try:
        return open_body(kind, given.value, path, clock.dt, clock.substeps)
    except BodyMissingError as error:
        _warn_unchecked(error, given, findings)
        return None
    except BodyError as error:
        at = clock.written if error.key == "substeps" and clock.written is not None else given
        hint = error.hint
        if error.fitting is not None and clock.default and clock.substeps is not None:
            dt, count = error.fitting
            hint = f"write time: {{dt: {dt / count * clock.substeps:.12g}}}"
        findings.error("bad-body", at.span, str(error), hint)
        if error.fitting is None:
            return None
        return _open(kind, given, path, Clock(*error.fitting), Findings())  # its names are what they are


def _sensed_inputs(
    model: BodyModel, around: Surroundings, ports: Sequence[Port] | None, findings: Findings
) -> Iterator[Sensed]:
    """The inputs that sensors are put into; what is invalid is reported and left out."""
    indices = {entry.name: index for index, entry in enumerate(around.inputs)}
    for name, sensors in model.sensors.items():
        index = indices.get(name)
        key = key_of(model.source, "sensors", name)
        if index is None:
            _report_input(name, key.span, around, findings)
        sizes = [_size(sensor, ports, "sensor", findings) for sensor in sensors]
        known = [size for size in sizes if size is not UNKNOWN]
        if index is None or len(known) < len(sizes):
            continue
        size = around.inputs[index].size
        if ports is not None and sum(known) != size:
            span = sensors[0].span if len(sensors) == 1 else key.span
            are = f"'{shorten(sensors[0].value)}' is" if len(sensors) == 1 else "these sensors are"
            message = f"the input '{name}' takes {plural(size, 'number')}, and {are} {plural(sum(known), 'number')}"
            hint = f"declare the input with size: {sum(known)}"
            if len(sensors) == 1 and size == 1 and sum(known) > 1:
                hint = f"take one of them, as in {shorten(sensors[0].value)}[0], or {hint}"
            findings.error("wrong-size", span, message, hint)
            continue
        yield Sensed(index, tuple(_name_in_run(sensor.value, ports) for sensor in sensors))


def _report_input(name: str, span: Span, around: Surroundings, findings: Findings) -> None:
    """Report a name that is no input of the network: an input of an instance that is bound to one, or none."""
    found = around.scope.input(name)
    if found is UNKNOWN:
        return
    known = tuple(entry.name for entry in around.inputs)
    if found is not None:
        message = f"'{shorten(name)}' takes what the input '{shorten(found.name)}' is"
        findings.error("unknown-input", span, message, f"name '{shorten(found.name)}'")
    else:
        message = f"there is no input '{shorten(name)}'"
        lost = around.scope.undeclared(name)
        findings.error("unknown-input", span, message, partial(known_inputs, name, known), undeclared=lost)


def _size(name: Located[str], ports: Sequence[Port] | None, what: str, findings: Findings) -> int | Unknown:
    """How many numbers a name stands for (0 where the body is not known); UNKNOWN, and a finding, where the body has
    nothing of that name."""
    if ports is None:
        return 0
    sizes = {port.name: port.size for port in ports}
    if name.value in sizes:
        return sizes[name.value]
    one = _ONE.fullmatch(name.value)
    base = name.value if one is None else one[1]
    if one is None or base not in sizes:
        findings.error(
            "unknown-sensor" if what == "sensor" else "unknown-actuator",
            name.span,
            f"the body has no {what} '{shorten(name.value)}'",
            lambda: suggest(base, sizes, f"{what}s") or f"a {what} needs a name in the model, and this has none",
        )
        return UNKNOWN
    if int(one[2]) < sizes[base]:
        return 1
    has = "which is one number" if sizes[base] == 1 else f"of {base}[0] to {base}[{sizes[base] - 1}]"
    findings.error("wrong-size", name.span, f"there is no number {int(one[2])} in the {what} '{shorten(base)}', {has}")
    return UNKNOWN


def _name_in_run(name: str, ports: Sequence[Port] | None) -> str:
    """A sensor or an actuator as runs name it: one number of several as ``name[i]``, a single one by its name alone."""
    sizes = {port.name: port.size for port in ports or ()}
    one = None if name in sizes else _ONE.fullmatch(name)
    if one is None:
        return name
    return one[1] if sizes.get(one[1]) == 1 else f"{one[1]}[{int(one[2])}]"


def _commands(
    model: BodyModel, around: Surroundings, ports: Sequence[Port] | None, constants: Constants
) -> Iterator[Moved]:
    """The commands of the actuators; what is invalid is reported and left out."""
    findings = constants.findings
    told: dict[str, str] = {}
    for name, formula in model.actuators.items():
        key = key_of(model.source, "actuators", name)
        size = _size(key, ports, "actuator", findings)
        if size is not UNKNOWN and size > 1:
            message = f"the actuator '{shorten(name)}' takes {size} numbers, and a command is one"
            findings.error("wrong-size", key.span, message, f"command each of them: {shorten(name)}[0], …")
        called = _name_in_run(name, ports)
        first = told.setdefault(called, name)
        if first != name:
            message = f"the actuator '{shorten(name)}' is commanded twice: first as '{shorten(first)}'"
            findings.error("repeated-reference", key.span, message, "a body takes one command for each actuator")
        command = _command(called, formula, around, constants)
        if command is not UNKNOWN and size is not UNKNOWN:
            yield command


def _command(actuator: str, formula: Formula, around: Surroundings, constants: Constants) -> Moved | Unknown:
    """The command of an actuator; UNKNOWN, and a finding, where it is invalid."""
    findings = constants.findings
    made = {output.name: output for output in around.outputs}
    outputs = names_of(around.spec, "outputs", {**dict.fromkeys(around.spec.outputs, UNKNOWN), **made})
    known = _Bases(Together((outputs, constants.names, ALWAYS)))
    tree = parse_formula(formula, Sight(known, "outputs and parameters", home=_HOME), findings, naming="subscripts")
    if tree is UNKNOWN:
        return UNKNOWN
    constants.read |= names(tree)
    found: dict[str, tuple[str, int, int]] = {}
    indices = {output.name: index for index, output in enumerate(around.outputs)}
    before = findings.errors
    unknown = False
    for node in walk(tree):
        if not isinstance(node, Name) or node.name in found:
            continue
        base, bracket, number = node.name.partition("[")
        span = formula.node.at(node.start, node.end)
        if base in outputs and base in constants.names and not (outputs.is_open or constants.names.is_open):
            message = f"'{base}' is an output and a parameter: which of them is meant is not known"
            findings.error("duplicate-name", span, message, "rename one of them")
        elif base not in outputs.declared and (base in constants.names or base in ALWAYS):
            if bracket:
                findings.error("wrong-size", span, f"'{base}' is one number: nothing is numbered in it")
            unknown |= base not in ALWAYS and constants.names[base] is UNKNOWN
        elif outputs[base] is UNKNOWN:
            unknown = True
        else:
            place = _number(around.outputs[indices[base]], int(number.rstrip("]")) if bracket else None, span, findings)
            if place is not UNKNOWN:
                found[node.name] = (node.name, indices[base], place)
    if findings.errors > before or unknown:
        return UNKNOWN
    if not found and is_constant(tree, (*ALWAYS, *constants.parameters)) and constants.value(formula) is UNKNOWN:
        return UNKNOWN
    parameters = tuple(
        (name, slot) for name, slot in slots_named(tree, constants.settable).items() if name not in found
    )
    return Moved(actuator, tree, tuple(found.values()), parameters, str(formula.value))


def _number(output: Output, number: int | None, span: Span, findings: Findings) -> int | Unknown:
    """The place of a number in an output; UNKNOWN, and a finding, where it is not one, or is not there."""
    if number is None and output.size == 1:
        return 0
    if number is None:
        message = f"the output '{output.name}' is {output.size} numbers, and a command is one"
        findings.error("wrong-size", span, message, f"take one of them: {output.name}[0] to [{output.size - 1}]")
        return UNKNOWN
    if number < output.size:
        return number
    has = "it is one number" if output.size == 1 else f"it has {output.name}[0] to {output.name}[{output.size - 1}]"
    findings.error("wrong-size", span, f"there is no number {number} in the output '{output.name}': {has}")
    return UNKNOWN


@dataclass(frozen=True, slots=True)
class _Bases(Collection[str]):
    """Names, each also with a number behind it."""

    names: Collection[str]

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and name.partition("[")[0] in self.names

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.names)
