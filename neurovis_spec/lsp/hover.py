"""What stands under the pointer, explained.

In: a Document and a place. Out: Markdown and the stretch it is about: a group's size, activation and model, and the
module that it is of; a parameter's value, a module's parameters and inputs, the equation and the description of a
definition, the meaning of a key.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from neurovis_spec.diagnostics import Span
from neurovis_spec.language.expressions.derivative import as_derivative
from neurovis_spec.language.expressions.functions import GIVEN
from neurovis_spec.language.grammar import Role
from neurovis_spec.language.patterns import PATTERNS
from neurovis_spec.language.places import key_at, role_of
from neurovis_spec.language.templates import Hole, pieces
from neurovis_spec.lsp.definitions import known, units_of
from neurovis_spec.lsp.document import Document, described, ports_of
from neurovis_spec.lsp.index import Found, Index
from neurovis_spec.lsp.names import DEFINITIONS, SECTIONS, Name
from neurovis_spec.lsp.outline import Item
from neurovis_spec.lsp.text import Place, holds
from neurovis_spec.manual.words import functions_of

_WORD = re.compile(r"[A-Za-z_]\w*", re.ASCII)


@dataclass(frozen=True, slots=True)
class Hover:
    """Markdown about a stretch of the text."""

    markdown: str
    span: Span


def hover(document: Document, place: Place) -> Hover | None:
    """What there is to say of a place; None where there is nothing."""
    name = document.name_at(place)
    if name is not None:
        told = _name(document, name)
        return None if told is None else Hover(told, name.span)
    item = document.item_at(place)
    if item is None:
        return None
    role = role_of(item.path, item.is_key)
    if role is not None and role.use in ("formula", "template", "setting value") and not item.is_key:
        return _given(item, role, place)
    if role is not None and role.use == "pattern" and item.text in PATTERNS:
        pattern = PATTERNS[item.text]
        settings = ", ".join(pattern.settings)
        return Hover(f"**{item.text}** (pattern): {pattern.about}" + (f" ({settings})" * bool(settings)), item.span)
    if role is not None and role.use in ("sensor", "actuator"):
        return _port(document, item, role.use)
    if role is not None and role.use == "ends" and item.is_key:
        description = document.index.values.get((*item.path, "description"))
        return None if description is None else Hover(f"**{item.text}**\n\n{description.text}", item.span)
    key = key_at(item.path) if item.is_key else None
    return None if key is None else Hover(f"**{key.name}**: {key.description}", item.span)


def _port(document: Document, item: Item, use: Literal["sensor", "actuator"]) -> Hover | None:
    """A sensor or an actuator of the body."""
    base = item.text.partition("[")[0]
    named = {port.name: port for port in ports_of(document, use)}
    port = named.get(item.text) or named.get(base)
    return None if port is None else Hover(f"**{port.name}** ({use}): {described(port)}", item.span)


def _given(item: Item, role: Role, place: Place) -> Hover | None:
    """A function or a constant in an expression."""
    if item.scalar.inner is None:
        return None
    called = functions_of(role)
    for match in _WORD.finditer(item.text):
        span = item.scalar.at(match.start(), match.end())
        if not holds(span, place) or not _in_expression(item.text, role, match.start()):
            continue
        if match[0] in called and item.text[match.end() :].lstrip().startswith("("):
            word = called[match[0]]
            return Hover(f"`{word.usage}`: {word.about}", span)
        if match[0] in GIVEN:
            return Hover(f"`{match[0]}`: {GIVEN[match[0]]}", span)
    return None


def _in_expression(text: str, role: Role, at: int) -> bool:
    """Whether the character ``at`` belongs to an expression: in a label only what stands in braces does."""
    if role.use != "template":
        return True
    return any(isinstance(piece, Hole) and piece.start <= at < piece.end for piece in pieces(text))


def _name(document: Document, name: Name) -> str | None:
    if name.kind in SECTIONS:
        definition = known(name.kind, document.index.all_items).get(name.text)
        return None if definition is None else definition.markdown
    found = document.index.find(name)
    if found is None:
        return _setting(document, name) if name.kind == "local" else None
    declaration = found.declaration
    match declaration.kind:
        case "neuron":
            return _group(document, name, found)
        case "parameter":
            return _parameter(document, declaration)
        case "local":
            return _setting(document, declaration)
        case "input":
            return _input(document, name, declaration)
        case "instance":
            module = document.index.attribute(declaration, "module")
            numbers = document.index.numbers(declaration)
            many = f" ({len(numbers)} of them)" if numbers is not None and len(numbers) < 1_000_000 else ""
            head = f"**{_called(name)}**{many}: instance of the module `{'' if module is None else module.text}`"
            return _described(document, declaration, head)
        case "module":
            return _module(document, declaration)
        case kind:
            return _described(document, declaration, f"**{declaration.text}** ({kind})")


def _called(name: Name) -> str:
    """A name with those of the instances in front of it: ``left1.knee.K``."""
    parts = [name.text]
    via = name.via
    while via is not None:
        parts.append(via.text)
        via = via.via
    return ".".join(reversed(parts))


def _within(document: Document, declaration: Name) -> str:
    """The module that something is declared in, and its file where that is another."""
    module = declaration.scope.module
    return "" if module is None else f" of the module `{module}`{_file(document, declaration)}"


def _file(document: Document, declaration: Name) -> str:
    """The file that something is declared in, where that is another."""
    file = declaration.span.file
    return "" if file == document.file else f" (in {Path(file).name})"


def _module(document: Document, declaration: Name) -> str:
    """A module with its parameters and inputs."""
    index = document.index
    title = index.attribute(declaration, "title")
    lines = [f"**{declaration.text}** (module){_file(document, declaration)}" + (f": {title.text}" if title else "")]
    own: list[str] = []
    for parameter in index.declared("parameter", declaration.text):
        value = index.attribute(parameter, "value") or index.value(parameter)
        own.append(f"- parameter `{parameter.text}`" + ("" if value is None else f" = `{value.text}`"))
    own += [f"- input `{name.text}`" for name in index.declared("input", declaration.text)]
    own += [f"- neurons `{name.text}`" for name in index.declared("neuron", declaration.text) if name.item.is_key]
    return _described(document, declaration, "\n".join([*lines, "", *own]) if own else lines[0])


def _described(document: Document, declaration: Name, head: str) -> str:
    description = document.index.attribute(declaration, "description")
    return head if description is None else f"{head}\n\n{description.text}"


def _group(document: Document, name: Name, found: Found) -> str:
    """A group's size, activation and model: those of the network as it last was, else as written."""
    group, index = found.declaration, document.index.home(found.declaration)
    if not group.item.is_key:  # one of the names of a group
        owner = group.item.path[:-2]
        group = next((other for other in index.declarations if other.item.path == owner), group)
    numbers = index.numbers(group)
    made = _made(document, name, group)
    if numbers is not None and made is not None:
        numbers = range(numbers.start, numbers.start + made)
    named = [item for path, item in index.values.items() if path[:-1] == (*group.item.path, "names")]
    if named:
        size = f"{len(named)} neurons ({named[0].text} … {named[-1].text})"
    elif numbers is None:
        size = "a single neuron"
    elif len(numbers) < 1_000_000:
        ends = f"{group.text}{numbers[0]} … {group.text}{numbers[-1]}" if numbers else ""
        size = f"{len(numbers)} neurons ({ends})" if len(numbers) != 1 else f"1 neuron ({ends})"
    else:
        count = index.attribute(group, "count")
        size = f"{'' if count is None else count.text} neurons"
    facts = {key: _choice(index, group, key) for key in ("activation", "model", "combine", "input", "bias")}
    facts = {"activation": "identity", "model": "static", "combine": "sum"} | {k: v for k, v in facts.items() if v}
    lines = [f"- {key}: `{value}`" for key, value in facts.items()]
    head = f"**{group.text}**: {size}"
    if (called := _called(name)) != group.text:
        head = f"**{called}**: {size}" if name.text == group.text else f"**{called}**, a neuron of {head}"
    head += _within(document, group)
    return _described(document, group, "\n".join([head, "", *lines]))


def _made(document: Document, name: Name, group: Name) -> int | None:
    """How many neurons a group of an instance has in the network as it last was; the same in each of a counted one."""
    if name.via is None or document.network is None:
        return None
    index = document.index
    way = [group.text]
    via: Name | None = name.via
    while via is not None:
        found = index.find(via)
        numbers = None if found is None else index.numbers(found.declaration)
        whole = found is not None and numbers is not None and found.declaration.text == via.text
        way.append(f"{via.text}{numbers.start}" if whole and numbers is not None else via.text)
        via = via.via
    wanted = ".".join(reversed(way))
    return next((one.count for one in document.network.neurons.groups if one.name == wanted), None)


def _choice(index: Index, group: Name, key: str) -> str:
    """A choice as it is written, with its settings: ``gaussian(sigma = 40)``."""
    path = (*group.item.path, key)
    plain = index.values.get(path)
    if plain is not None:
        return plain.text
    chosen = next((entry for entry in index.keys if entry[:-1] == path), None)
    if chosen is None:
        return ""
    settings = [f"{p[-1]} = {item.text}" for p, item in index.values.items() if p[:-1] == chosen]
    return f"{chosen[-1]}({', '.join(settings)})" if settings else str(chosen[-1])


def _parameter(document: Document, declaration: Name) -> str:
    index, network = document.index, document.network
    value = index.attribute(declaration, "value") or index.value(declaration)
    written = "" if value is None else value.text
    head = f"**{declaration.text}** = `{written}`"
    if network is not None and declaration.scope.module is None and isinstance(value and value.scalar.value, str):
        known_value = network.parameters.get(declaration.text)
        head += "" if known_value is None else f" = {known_value:g}"
    low, high = index.attribute(declaration, "min"), index.attribute(declaration, "max")
    if low is not None or high is not None:
        head += f" (from {'-∞' if low is None else low.text} to {'∞' if high is None else high.text})"
    return _described(document, declaration, head + _within(document, declaration))


def _input(document: Document, name: Name, declaration: Name) -> str:
    index = document.index.home(declaration)
    expression, file = index.attribute(declaration, "expression"), index.attribute(declaration, "file")
    source = f"`{expression.text}`" if expression else f"the file `{file.text}`" if file else "from outside"
    if any(path[:3] == (*declaration.item.path, "values") for path in index.values):
        source = "values, one row a step"
    size = None
    if document.network is not None and declaration.scope.module is None:
        size = next((entry.size for entry in document.network.inputs if entry.name == declaration.text), None)
    head = f"**{_called(name)}** (input{'' if size is None else f', size {size}'}): {source}"
    head += _within(document, declaration)
    return _described(document, declaration, head)


def _setting(document: Document, name: Name) -> str | None:
    """A parameter, signal, state or intermediate value of a definition."""
    if name.scope.definition is None:
        return None
    section, owner = name.scope.definition
    definition = known(DEFINITIONS[section], document.index.all_items).get(owner)
    if definition is None:
        return None
    for parameter in definition.parameters:
        if parameter.name == name.text:
            told = f"**{name.text}** (parameter of {owner}, default `{parameter.default}`)"
            return f"{told}\n\n{parameter.description}" if parameter.description else told
    if name.text in definition.signals:
        return f"**{name.text}** (signal of {owner}): neurons or an input, of size 1 or of the size of the target"
    if name.text == "spike" and definition.spike:
        return f"`spike`: {GIVEN['spike']}"
    own = (f"{name.text} =", f"d{name.text}/dt ")
    lines = [line for line in definition.equations if line.startswith(own)]
    if not lines:
        return None
    told = (
        f"**{name.text}** of {owner}{_unit(document, section, owner, name.text)}\n\n```\n" + "\n".join(lines) + "\n```"
    )
    flow = as_derivative(name.text, lines[0].partition(" = ")[2]) if section != "activations" else None
    return told if flow is None else f"{told}\n\nAs an equation, which is integrated: `derivative: {flow}`"


def _unit(document: Document, section: str, owner: str, name: str) -> str:
    """In which unit something is in a definition, as it is declared or as it follows from formulas; "" where that is
    not known."""
    sheet = units_of(section, owner, (page.root for page in (document.page, *document.reach)))
    written = "" if sheet is None else sheet.written.get(name, "")
    if sheet is None or written or name not in sheet.known:
        return f", in {written}" if written else ""
    found = sheet.told(sheet.known[name])
    return ", without unit" if found == "1" else f", in {found} (derived)"
