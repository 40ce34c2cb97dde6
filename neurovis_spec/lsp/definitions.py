"""Activations, models, rules and synapses as an editor shows them: parameters, equations, units, description.

In: Items of a spec, or of the library files that ship. Out: Definitions; those of the spec and the built-in ones look
the same, since they are written in the same language.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Final

from pydantic import ValidationError

from neurovis_spec.compiler.program import ACTIVATION, MODEL, RULE, SYNAPSE
from neurovis_spec.compiler.values.builtin import libraries
from neurovis_spec.compiler.values.units import Sheet, sheet_of
from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.expressions.tree import ExpressionError
from neurovis_spec.language.grammar import Kind
from neurovis_spec.language.library import ActivationModel, DefinitionModel, ModelModel, RuleModel, SynapseModel
from neurovis_spec.language.yaml.source import Mapping as SourceMapping
from neurovis_spec.language.yaml.source import Node
from neurovis_spec.lsp.names import DEFINITIONS, SECTIONS
from neurovis_spec.lsp.outline import Item, outline


@dataclass(frozen=True, slots=True)
class Parameter:
    """A parameter of a definition, with its default as it is written, and its unit behind that."""

    name: str
    default: str
    description: str


@dataclass(frozen=True, slots=True)
class Definition:
    """An activation, a model, a rule or a synapse. ``equations`` are lines ``name = expression``; ``spike`` says
    whether its formulas know that name."""

    kind: Kind
    name: str
    parameters: tuple[Parameter, ...]
    signals: tuple[str, ...]
    equations: tuple[str, ...]
    description: str
    states: tuple[str, ...] = ()
    outputs: tuple[str, ...] = ()
    ports: tuple[str, ...] = ()
    spike: bool = False

    @property
    def taken(self) -> tuple[str, ...]:
        """What of a model can be sent, shown and read at the ends of connections, beside its outputs."""
        return (*self.states, "spike") if self.spike else self.states

    @property
    def usage(self) -> str:
        """How its settings look: ``gaussian(sigma = 1)``."""
        settings = [f"{p.name} = {p.default}" for p in self.parameters] + list(self.signals)
        return f"{self.name}({', '.join(settings)})" if settings else self.name

    @property
    def markdown(self) -> str:
        """Name, equations, description and parameters."""
        parts = [f"**{self.usage}** ({self.kind})"]
        if self.equations:
            parts.append("```\n" + "\n".join(self.equations) + "\n```")
        if self.description:
            parts.append(self.description)
        told = [f"- `{p.name}`: {p.description}" for p in self.parameters if p.description]
        return "\n\n".join([*parts, "\n".join(told)]) if told else "\n\n".join(parts)


def definitions(items: Iterable[Item]) -> Mapping[tuple[str, str], Definition]:
    """The definitions among the items, by section and name."""
    texts: dict[tuple[str, str], dict[tuple[str, ...], str]] = {}
    for item in items:
        if len(item.path) > 1 and item.path[0] in DEFINITIONS:
            path = tuple(str(part) for part in item.path)
            below = texts.setdefault((path[0], path[1]), {})
            if not item.is_key:
                below[path[2:]] = item.text
            elif len(path) > 2:
                below.setdefault(path[2:], "")
    return {(section, name): _definition(section, name, below) for (section, name), below in texts.items()}


@cache
def builtin() -> Mapping[tuple[str, str], Definition]:
    """The definitions that ship with the package and with plug-ins."""
    first_wins = reversed(libraries())
    return {key: value for library in first_wins for key, value in definitions(outline(library.source)).items()}


@cache
def builtin_signals() -> Mapping[str, tuple[str, ...]]:
    """The signals of the built-in rules."""
    return {name: definition.signals for (section, name), definition in builtin().items() if section == "rules"}


def known(kind: Kind, items: Iterable[Item]) -> Mapping[str, Definition]:
    """All definitions of a kind in reach, an author's own before the built-in ones."""
    section = SECTIONS[kind]
    both = {**builtin(), **definitions(items)}
    return {name: definition for (where, name), definition in both.items() if where == section}


#: How definitions of a section are written.
_WRITTEN: Final[Mapping[str, type[DefinitionModel]]] = {
    ACTIVATION.section: ActivationModel,
    MODEL.section: ModelModel,
    RULE.section: RuleModel,
    SYNAPSE.section: SynapseModel,
}


def units_of(section: str, name: str, roots: Iterable[Node | None]) -> Sheet | None:
    """The units of a definition that is written in one of these texts, or a built-in one; None where it is not sound at
    this moment."""
    kind = next(kind for kind in (ACTIVATION, MODEL, RULE, SYNAPSE) if kind.section == section)
    model = next((made for root in roots if (made := _written(section, name, root)) is not None), None)
    built_in = (library.definitions[section] for library in libraries())
    model = model or next((made[name] for made in built_in if name in made), None)
    try:
        return None if model is None else sheet_of(kind, name, model)
    except ExpressionError:
        return None


def _written(section: str, name: str, root: Node | None) -> DefinitionModel | None:
    """A definition in a text, as far as it can be read."""
    made = root.get(section) if isinstance(root, SourceMapping) else None
    node = made.get(name) if isinstance(made, SourceMapping) else None
    try:
        return None if node is None else _WRITTEN[section].model_validate(node, context=Findings())
    except ValidationError:
        return None


def _definition(section: str, name: str, texts: Mapping[tuple[str, ...], str]) -> Definition:
    parameters = []
    for path, text in texts.items():
        if len(path) == 2 and path[0] == "parameters":
            default = f"{texts.get((*path, 'value'), text)} {texts.get((*path, 'unit'), '')}".rstrip()
            parameters.append(Parameter(path[1], default, texts.get((*path, "description"), "")))
    signals = tuple(text for path, text in texts.items() if path[:1] == ("signals",) and text)
    description = " ".join(texts.get(("description",), "").split())
    states = tuple(dict.fromkeys(path[1] for path in texts if path[:1] == ("state",) and len(path) > 1))
    outputs = tuple(path[1] for path in texts if path[:1] == ("outputs",) and len(path) == 2)
    ports = tuple(
        text if len(path) == 1 or path[1].isdecimal() else path[1]  # one, a list, or a mapping
        for path, text in texts.items()
        if path[:1] == ("ports",) and len(path) < 3
    )
    kind, equations = DEFINITIONS[section], _equations(section, texts)
    spike = kind == "synapse" or any("on_pre" in path or "on_post" in path or path[0] == "spike" for path in texts)
    return Definition(kind, name, tuple(parameters), signals, equations, description, states, outputs, ports, spike)


_AT_SPIKES: Final = {"on_pre": "when a spike arrives", "on_post": "when the target fires"}


def _equations(section: str, texts: Mapping[tuple[str, ...], str]) -> tuple[str, ...]:
    lines: list[str] = []
    late: list[str] = []
    for path, text in texts.items():
        match path:
            case ("let" | "outputs", name):
                lines.append(f"{name} = {text}")
            case ("state", name, "derivative"):
                lines.append(f"d{name}/dt = {text}")
            case ("state", name, "noise"):
                late.append(f"d{name}/dt with noise of {text}")
            case ("state", name, "jump"):
                lines.append(f"{name} = {name} + {text} where spikes arrive")
            case ("state", name, "on_pre" | "on_post" as when):
                lines.append(f"{name} = {text} {_AT_SPIKES[when]}")
            case ("weight" | "centre" as what, "on_pre" | "on_post" as when):
                lines.append(f"{what} = {text} {_AT_SPIKES[when]}")
            case ("spike", "when"):
                late.append(f"it fires where {text}")
            case ("spike", "set", name):
                late.append(f"{name} = {text} when it fires")
            case ("spike", "refractory"):
                late.append(f"it rests for {text} then")
            case ("state", name, "initial"):
                late.append(f"{name} = {text} at the beginning")
            case ("state", name, "each_step"):
                lines.append(f"{name} = {text}")
            case ("state", name, "each_episode"):
                late.append(f"{name} = {text} at an episode's end")
            case ("value",) if section == "activations":
                lines.append(f"f(x) = {text}")
            case ("activity",):
                lines.append(f"activity = {text}")
            case ("signal",):
                lines.append(f"signal = {text}")
            case ("weight" | "centre" as what, "each_step"):
                lines.append(f"{what} = {text}")
            case ("weight" | "centre" as what, "derivative"):
                lines.append(f"d{what}/dt = {text}")
            case ("weight" | "centre" as what, "each_episode"):
                late.append(f"{what} = {text} at an episode's end")
    return tuple(lines + late)
