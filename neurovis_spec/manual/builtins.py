"""The built-in definitions as they ship: description, parameters, and the YAML itself.

In: the library files, ours and those of packages. Out: a Builtin for each definition.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Final, Literal, TypeAlias, get_args

from neurovis_spec import plugins
from neurovis_spec.compiler.program import AT_SPIKE, DRIVE, MODEL, RULE, SPIKE, SYNAPSE
from neurovis_spec.compiler.program import Kind as DefinitionKind
from neurovis_spec.compiler.values.builtin import builtin_definitions, libraries
from neurovis_spec.language.expressions.tree import names
from neurovis_spec.language.library import ActivationModel, Library, ModelModel, RuleModel, SynapseModel, TimedModel
from neurovis_spec.language.values import ParameterModel
from neurovis_spec.language.yaml.source import Entry, Mapping

Kind: TypeAlias = Literal["activation", "model", "rule", "synapse"]
_NUMBER: Final = re.compile(r"[-+.\de]+")
_Definition: TypeAlias = ActivationModel | ModelModel | RuleModel | SynapseModel


@dataclass(frozen=True, slots=True)
class Builtin:
    """A definition that needs no declaration. ``parameters``: name, default, meaning; ``yaml``: the definition as it
    stands in its file, its description left out; ``origin``: the entry point that brings it, ``builtin`` for ours;
    ``time``: what of the section ``time`` it needs, as a rule that changes weights at the end of an episode alone;
    ``ends``: in which unit its time is, of a model also what arrives where, and what it gives beside its activity."""

    kind: Kind
    name: str
    about: str
    parameters: tuple[tuple[str, str, str], ...]
    signals: tuple[str, ...]
    yaml: str
    origin: str
    time: str = ""
    ends: tuple[tuple[str, str], ...] = ()

    @property
    def use(self) -> str:
        """How it is written where it is used, with all that may be set; what follows from other parameters of its own
        (``VT + 5*DT``) is left to do so."""
        settings = [f"{name}: {default}" for name, default, _ in self.parameters if _NUMBER.fullmatch(default)]
        settings += [f"{signal}: T" for signal in self.signals]
        choice = f"{{{self.name}: {{{', '.join(settings)}}}}}" if settings else self.name
        time = f"time: {{{self.time}}}\n" if self.time else ""
        if self.kind in ("rule", "synapse"):
            key = "plasticity" if self.kind == "rule" else "synapse"
            neurons, port = _joined(RULE if self.kind == "rule" else SYNAPSE, self.name)
            time = time or ("time: {dt: 0.001}\n" if neurons else "")
            return f"{time}{neurons}connections: {{K -> O: {{weight: 0.1, {port}{key}: {choice}}}}}"
        return f"{time}neurons: {{K: {{{self.kind}: {choice}}}}}"


def _joined(kind: DefinitionKind, name: str) -> tuple[str, str]:
    """The neurons that a rule or a synapse joins where it is shown in use, if it reads more of them than what they send
    (of the first model that flows and has all of that, and fires where it waits for spikes), and their port for what
    only a spike brings."""
    known = builtin_definitions()
    definition = known.of(kind).known()[name].definition
    needed = {end.name for end in definition.end_names}
    waits, signal = SPIKE in needed, definition.given.each_step
    for other, (model, _) in known.of(MODEL).known().items() if needed else ():
        there = {MODEL.gives, *model.parameters, *(one.name for one in model.kept)}
        if model.flows and needed <= there and (model.spikes or not waits):
            brings = waits and (kind == RULE or signal is None or AT_SPIKE["on_pre"] in names(signal))
            port = f"port: {model.ports[0].name}, " if brings else ""
            told = ", T: {}" if definition.signals else ""
            return f"neurons: {{K: {{model: {other}}}, O: {{model: {other}}}{told}}}\n", port
    return "", ""


@cache
def builtins() -> tuple[Builtin, ...]:
    """All of them: activations, models, rules and synapses, each in the order of the files."""
    found = [builtin for library in libraries() for builtin in _of(library)]
    order = get_args(Kind)
    return tuple(sorted(found, key=lambda builtin: order.index(builtin.kind)))


def _of(library: Library) -> list[Builtin]:
    text = _text(library.source.span.file)
    result: list[Builtin] = []
    for name, activation in library.activations.items():
        result.append(_builtin("activation", name, activation, (), text, library))
    for name, model in library.models.items():
        result.append(_builtin("model", name, model, (), text, library))
    for name, rule in library.rules.items():
        signals = tuple(signal.value for signal in rule.signals)
        result.append(_builtin("rule", name, rule, signals, text, library))
    for name, synapse in library.synapses.items():
        result.append(_builtin("synapse", name, synapse, (), text, library))
    return result


def _text(file: str) -> list[str]:
    """The lines of a library file, which is named by its entry point and its own name."""
    package, _, name = file.partition("/")
    folder = files(plugins.package(plugins.LIBRARIES, package))
    return folder.joinpath(name).read_text(encoding="utf-8").splitlines()


def _builtin(
    kind: Kind, name: str, model: _Definition, signals: tuple[str, ...], text: list[str], library: Library
) -> Builtin:
    section = library.source.get(f"{kind}s")
    entry = section.entry(name) if isinstance(section, Mapping) else None
    assert entry is not None
    about = "" if model.description is None else " ".join(model.description.value.split())
    parameters = tuple((key, *_shown(parameter)) for key, parameter in model.parameters.items())
    origin = library.source.span.file.partition("/")[0]
    return Builtin(kind, name, about, parameters, signals, _excerpt(entry, text), origin, _time(model), _ends(model))


def _time(model: _Definition) -> str:
    """What it needs that ``time`` says."""
    if isinstance(model, TimedModel) and _flows(model):
        return "dt: 0.001" if model.unit_of_time == "s" else "dt: 0.01 ms"
    parts = model.parts()
    return "episode: 100" if parts.each_step is None and parts.each_episode is not None else ""


def _flows(model: TimedModel) -> bool:
    parts = model.parts()
    states = (parts.state or {}).values()
    return parts.derivative is not None or any(state.derivative is not None for state in states)


def _ends(model: _Definition) -> tuple[tuple[str, str], ...]:
    """The unit of time of a definition, and of a model its ports, outputs and what it sends, where it has any that it
    need not have."""
    if not isinstance(model, TimedModel):
        return ()
    unit = "milliseconds" if model.unit_of_time == "ms" else "seconds"
    timed = (("time", unit),) if _flows(model) else ()
    if not isinstance(model, ModelModel):
        return timed
    ports = [DRIVE]
    for port in model.ports:
        told = ", ".join(word for word in ("" if port.combine == "sum" else port.combine, port.unit) if word)
        ports.append(f"{port.name.value} ({told})" if told else port.name.value)
    rows = (
        *timed,
        ("ports", ", ".join(ports) if model.ports else ""),
        ("outputs", ", ".join(model.outputs)),
        ("sent", "" if model.send is None else model.send.value),
    )
    return tuple((name, told) for name, told in rows if told)


def _shown(parameter: ParameterModel) -> tuple[str, str]:
    value = parameter.value.value
    unit = "" if parameter.unit is None else f" ({parameter.unit.value})"
    return (value if isinstance(value, str) else f"{value:g}", f"{parameter.about}{unit}".lstrip())


def _excerpt(entry: Entry, text: list[str]) -> str:
    """The lines of an entry: as far as they stand further to the right than its key. The description is shown apart."""
    first = entry.key.span.line - 1
    margin = entry.key.span.column - 1
    lines = [text[first][margin:]]
    for line in text[first + 1 :]:
        if line.strip() and len(line) - len(line.lstrip()) <= margin:
            break
        lines.append(line[margin:])
    return re.sub(r"^  description:.*\n?(^ {3,}.*\n?)*", "", "\n".join(lines), flags=re.MULTILINE).rstrip()
