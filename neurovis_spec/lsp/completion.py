"""What may be written at a place: keys with what they mean, names that fit there, words.

In: a Document and a place in it. Out: Completions, each with the stretch of the text that it replaces. The text is most
often broken when somebody types: a character is put at the place, and looked for in what the reader makes of the text
then, which gives the keys that lead there, and what is written up to it (``where``).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final, Literal

from neurovis_spec import plugins
from neurovis_spec.compiler.values.constants import ALWAYS
from neurovis_spec.diagnostics import Span
from neurovis_spec.language.expressions.functions import GIVEN
from neurovis_spec.language.grammar import Role, naming
from neurovis_spec.language.patterns import PATTERNS
from neurovis_spec.language.places import keys_at, role_of, words_at
from neurovis_spec.language.ros_types import all_types, numbers_of
from neurovis_spec.language.templates import Hole, pieces
from neurovis_spec.language.yaml.reader import read_any
from neurovis_spec.language.yaml.source import Scalar
from neurovis_spec.lsp.definitions import Definition, definitions, known
from neurovis_spec.lsp.document import Document, described, ports_of
from neurovis_spec.lsp.index import Index
from neurovis_spec.lsp.names import SECTIONS, Name, Scope, may_be_states, scope_of, setting_of
from neurovis_spec.lsp.outline import Path, nodes_at
from neurovis_spec.lsp.text import Place, Text
from neurovis_spec.manual.words import functions_of

#: A character that nobody writes, and that may be a part of any text.
_MARK: Final = "\ue000"
_COLON: Final = re.compile(r"[\"']?[ \t]*:")

_WORD = re.compile(r"(?:(?<![\w.])[A-Za-z_]\w*\.(?!\.))*(?:(?<!\w)[A-Za-z_]\w*)?$", re.ASCII)
_REST = re.compile(r"\w*", re.ASCII)
#: The instances on the way to a name that is being typed, and the begin of a range that it ends.
_WAY = re.compile(r"(?:(?<![\w.])|(?<=\.\.))(?:[A-Za-z_]\w*\.(?!\.))+$", re.ASCII)
_RANGE = re.compile(r"(?<![\w.])[A-Za-z_][\w.]*\.\.(?=(?:[A-Za-z_]\w*\.)*$)", re.ASCII)
#: What stands before a name of an end of a connection.
_END = re.compile(r"(?<![\w.])(pre|post)\.$", re.ASCII)
_NAMES = re.compile(r"[A-Za-z_]\w*", re.ASCII)
#: Of a larger group only the first and the last neuron are offered; of one that is larger than any, none.
_FEW = 40
_MANY = 999_999
#: What is worked out within a step, where no spike is seen.
_OF_STAGES: Final = ("derivative", "noise")
#: A path that no document has, for asking what a key of a mapping is.
_ANY = "\0"
Sort = Literal["key", "neuron", "parameter", "input", "function", "constant", "definition", "word", "module", "local"]


@dataclass(frozen=True, slots=True)
class Where:
    """Where a place stands.

    ``mapping`` is the path of the mapping of which a key may stand here, ``value`` the path of which the value may;
    None where it cannot be. ``typed`` is what is written before the place, ``rest`` what is written behind it;
    ``colon`` says that a colon follows.
    """

    mapping: Path | None
    value: Path | None
    typed: str
    rest: str
    colon: bool = False


def where(text: Text, place: Place) -> Where | None:
    """Where a place stands; None within a comment or a block text, where nothing is looked for."""
    first, lines = _section(text, place.line)
    line, at = lines[place.line - first], place.column - 1
    blank = " " if line[:at].endswith(":") else ""
    lines[place.line - first] = marked = line[:at] + blank + _MARK + line[at:]
    at += len(blank)
    root = read_any("\n".join(lines), "")
    found = [] if root is None else nodes_at(root, Place(place.line - first + 1, at + 1))
    if not found:
        return None
    path, scalar, is_key = found[-1]
    if not isinstance(scalar, Scalar) or _MARK not in str(scalar.value):
        return None
    span = scalar.span
    begin = span.column - 1 if span.line == place.line - first + 1 else len(marked) - len(marked.lstrip())
    end = span.end_column - 1 if span.end_line == place.line - first + 1 else len(marked)
    before = marked[:begin]
    if span.line != span.end_line and lines[span.line - 1][span.column - 1] in "|>":
        return None
    quoted = marked[begin : begin + 1] in ("'", '"')
    typed, rest = marked[begin + quoted : at], marked[at + 1 : end]
    if quoted:
        rest = rest.rstrip("'\"")
    if is_key:
        return Where(path[:-1], None, typed, rest, _COLON.match(marked, end) is not None)
    own_line = not before.strip(" -?") and not any(
        lines[node.span.line - 1][node.span.column - 1] in "[{" for _, node, _ in found[:-1]
    )
    return Where(path if own_line else None, path or None, typed, rest)


def _section(text: Text, number: int) -> tuple[int, list[str]]:
    """The lines around one that belong to the same key at the top, behind the number of the first of them: what is
    above and below is over there, whatever is open."""
    first, last = number, number + 1
    while first > 1 and _within(text.line(first)):
        first -= 1
    while last <= len(text.lines.starts) and _within(text.line(last)):
        last += 1
    return first, [text.line(line) for line in range(first, last)]


def _within(line: str) -> bool:
    return (line[:1] or " ") in " \t#-]}"


@dataclass(frozen=True, slots=True)
class Completion:
    """A text to be offered: ``insert`` replaces ``span``. ``detail`` is short, ``documentation`` Markdown."""

    label: str
    sort: Sort
    insert: str
    span: Span
    detail: str = ""
    documentation: str = ""


@dataclass(frozen=True, slots=True)
class _Offer:
    """A completion that does not know yet where it stands."""

    label: str
    sort: Sort
    detail: str = ""
    documentation: str = ""


def complete(document: Document, place: Place) -> tuple[Completion, ...]:
    """Everything that fits at a place, in the order in which it is offered; nothing within a block of text."""
    at = where(document.text, place)
    if at is None:
        return ()
    index = document.index
    result: list[Completion] = []
    if at.mapping is not None:
        result += _keys(at, at.mapping, place, document)
        result += _offers(at, place, document, index, (*at.mapping, _ANY), True)
    if at.value is not None:
        result += _offers(at, place, document, index, at.value, False)
    return tuple({(item.label, item.insert): item for item in reversed(result)}.values())[::-1]


def _keys(at: Where, mapping: Path, place: Place, document: Document) -> Iterator[Completion]:
    """The keys of the language that are not written yet, the required ones first."""
    own = (*mapping, at.typed + at.rest)
    span = _span(document.file, place, at.typed, at.rest)
    for key in sorted(keys_at(mapping, library=document.page.library), key=lambda key: not key.required):
        path = (*mapping, key.name)
        if path == own or path not in document.index.keys:
            yield Completion(key.name, "key", key.name if at.colon else key.name + ": ", span, "", key.description)


def _offers(
    at: Where, place: Place, document: Document, index: Index, path: Path, is_key: bool
) -> Iterator[Completion]:
    role, scope = role_of(path, is_key), scope_of(path)
    word = at.typed
    rest = at.rest
    if role is not None and role.use in ("formula", "template", "references", "ends", "settable", "setting value"):
        match = _WORD.search(at.typed)
        word = "" if match is None else match[0].rpartition(".")[2]
        following = _REST.match(at.rest)
        rest = "" if following is None else following[0]
    span = _span(document.file, place, word, rest)
    front = at.typed[: len(at.typed) - len(word)]
    colon = ": " if is_key and not at.colon and role is not None and role.use not in ("ends", "settable") else ""
    for offer in (*_of_role(role, scope, path, front, index, place), *_of_body(role, document)):
        label = offer.label
        yield Completion(label, offer.sort, label + colon, span, offer.detail, offer.documentation)
    for label, about in () if is_key else words_at(path).items():
        yield Completion(label, "word", label, span, about)


def _span(file: str, place: Place, typed: str, rest: str) -> Span:
    return Span(file, place.line, place.column - len(typed), place.line, place.column + len(rest))


def _of_role(role: Role | None, scope: Scope, path: Path, front: str, index: Index, place: Place) -> Iterator[_Offer]:
    """What fits where a text has this role; ``front`` is what stands before the word that is being typed."""
    if role is None:
        return
    match role.use:
        case "template" if not _in_braces(front):
            return
        case "formula" if role.ends and (end := _END.search(front)):
            yield from _at_end(end[1], index)
        case "formula" | "template":
            yield from _formula(role, scope, path, index, place)
        case "ends" | "references":
            yield from _neurons(scope, front, index, single=path[-2:-1] == ("positions",))
            if may_be_states(path):
                yield from _states(scope, front, index)
        case "settable":
            if not front.strip():
                yield from _names(naming("parameter"), scope, path, index)
            yield from _neurons(scope, front, index, single=False)
        case "choice":
            assert role.kind is not None
            yield from _definitions(known(role.kind, index.all_items).values())
        case "setting" | "setting value":
            yield from _settings(role, scope, path, front, index, place)
        case "state":
            shown = path[:2] == ("render", "show")
            yield from _states(scope, f"{path[-1]}.", index) if shown else _states_of(index, path[:-2])
        case "port" | "sent":
            yield from _of_ends(role.use, scope, path, index)
        case "pattern":
            yield from (_Offer(one.name, "definition", one.about) for one in PATTERNS.values())
        case "engine":
            yield from (_Offer(name, "word") for name in ("auto", *plugins.names(plugins.LAYOUTS)))
        case "message":
            yield from (
                _Offer(name, "word", ", ".join(numbers_of(name)[:4])) for name in all_types() if numbers_of(name)
            )
        case "field":
            of = index.values.get((*path[:-1], "type"))
            yield from (_Offer(name, "word") for name in (() if of is None else numbers_of(of.text)))
        case "names":
            yield from _names(role, scope, path, index)


def _names(role: Role, scope: Scope, path: Path, index: Index) -> Iterator[_Offer]:
    """The names of what is declared elsewhere."""
    match role.kind:
        case "input":
            module = _owner(path, scope, index)
            yield from (_Offer(name.text, "input") for name in index.declared("input", module))
            if "instances" not in path:
                yield from _inner_inputs(module, index)
        case "parameter":
            module = _owner(path, scope, index)
            yield from _parameters(index.declared("parameter", module), index)
        case "module":
            yield from _modules(index)
        case "output":
            yield from (_Offer(name.text, "word", "output") for name in index.declared("output"))
        case "local" if scope.definition is not None:
            own = ((name.text, str(name.item.path[2])) for name in index.locals(*scope.definition))
            if "spike" in path:  # what a spike sets and holds
                yield from (_Offer(name, "local", section) for name, section in own if section == "state")
                return
            sent = ((name, section) for name, section in own if section in ("state", "outputs"))
            yield from (_Offer(name, "local", section) for name, section in (*sent, ("activity", "")))
            if _knows_spike(scope.definition, index):
                yield _Offer("spike", "local", GIVEN["spike"])


def _of_body(role: Role | None, document: Document) -> Iterator[_Offer]:
    """The names that a body has, and the kinds of what a command is made of besides parameters."""
    if role is None:
        return
    if role.use == "formula" and role.kind == "output":
        yield from (_Offer(name.text, "word", "output") for name in document.index.declared("output"))
    if role.use not in ("sensor", "actuator"):
        return
    for port in ports_of(document, role.use):
        yield _Offer(port.name, "word", described(port))
        if 1 < port.size <= _FEW:
            yield from (_Offer(name, "word", port.unit) for name in port.numbers)


def _in_braces(front: str) -> bool:
    """Whether an expression in braces is open at the end of a text."""
    found = pieces(front)
    last = found[-1] if found else ""
    return isinstance(last, Hole) and not last.closed


def _modules(index: Index) -> Iterator[_Offer]:
    for name in index.declared("module"):
        told = index.attribute(name, "description") or index.attribute(name, "title")
        yield _Offer(name.text, "module", "", "" if told is None else told.text)


def _owner(path: Path, scope: Scope, index: Index) -> str | None:
    """The module whose parameters and inputs are named: that of the instance in the keys of its ``set`` and ``inputs``,
    else the one around."""
    if path[-4:-3] == ("instances",) and path[-1] == _ANY:
        return index.module_of(str(path[-3]), scope.module)
    return scope.module


def _formula(role: Role, scope: Scope, path: Path, index: Index, place: Place) -> Iterator[_Offer]:
    """Parameters, what is given here, functions. A parameter may use those before it."""
    if scope.definition is None:
        names = index.declared("parameter", scope.module)
        if path[2 * (scope.module is not None) :][:1] == ("parameters",):
            own = path[: 2 + 2 * (scope.module is not None)]
            here = (place.line, place.column)
            names = tuple(n for n in names if (n.span.end_line, n.span.end_column) <= here and n.item.path != own)
        yield from _parameters(names, index)
    else:
        for name in index.locals(*scope.definition):
            if name.item.path[2] != "outputs":  # which formulas do not read
                yield _Offer(name.text, "local", str(name.item.path[2]))
        if path[-1] not in _OF_STAGES and _knows_spike(scope.definition, index):
            yield _Offer("spike", "constant", GIVEN["spike"])
    centred = scope.definition is not None and (*scope.definition, "centre") in index.keys  # a rule of the centre
    for given in (*role.sees, *ALWAYS):
        told = "centre" if centred and given == "weight" else given
        yield _Offer(told, "constant", GIVEN[told])
    for word in functions_of(role).values():
        yield _Offer(word.name, "function", word.usage, word.about)


def _knows_spike(definition: tuple[str, str], index: Index) -> bool:
    """Whether formulas of a definition, by its section and name, know ``spike``."""
    found = definitions(index.all_items).get(definition)
    return found is not None and found.spike


def _inner_inputs(module: str | None, index: Index) -> Iterator[_Offer]:
    """The inputs of instances that come from outside: ``left1.load``."""
    for instance in index.declared("instance", module):
        made = index.module_of(instance.text, module)
        given = index.home(instance).keys
        for name in () if made is None else index.declared("input", made):
            if (*instance.item.path, "inputs", name.text) not in given:
                single = index.numbers(instance) is None
                for one in (instance.text,) if single else _numbered(instance, index):
                    yield _Offer(f"{one}.{name.text}", "input", f"input of {made}")


def _parameters(names: Iterable[Name], index: Index) -> Iterator[_Offer]:
    for name in names:
        value = index.attribute(name, "value") or index.value(name)
        description = index.attribute(name, "description")
        yield _Offer(
            name.text,
            "parameter",
            "" if value is None else f"= {value.text}",
            "" if description is None else description.text,
        )


def _neurons(scope: Scope, front: str, index: Index, single: bool = False, signals: bool = False) -> Iterator[_Offer]:
    """Groups, instances, then neurons; behind a dot those of the instance's module, behind two what may end the range.
    ``single`` leaves groups of several out."""
    low = _RANGE.search(front)
    way = _WAY.search(front)
    module = index.module_at(way[0].split(".")[:-1] if way else (), scope.module)
    if way and module is None:
        return
    if low:
        yield from _ends_of(low[0].removesuffix(".."), scope, index)
        if not way:
            return
    groups = index.declared("neuron", module)
    for group in groups:
        numbers = index.numbers(group)
        if not (single and (numbers is not None or (*group.item.path, "names") in index.home(group).keys)):
            description = index.attribute(group, "description")
            many = "" if numbers is None or len(numbers) > _MANY else f"{len(numbers)} neurons"
            yield _Offer(group.text, "neuron", many, "" if description is None else description.text)
    yield from _instances(module, index)
    if signals:
        yield from (_Offer(name.text, "input", "input") for name in index.declared("input", module))
    for group in groups:
        yield from (_Offer(name, "neuron", f"of {group.text}") for name in _numbered(group, index))


def _states(scope: Scope, front: str, index: Index) -> Iterator[_Offer]:
    """Behind the dot after a group or a neuron: the states of its model."""
    way = _WAY.search(front)
    if way is None:
        return
    *instances, owner, _ = way[0].split(".")
    module = index.module_at(instances, scope.module)
    if index.module_of(owner, module) is not None or (instances and module is None):
        return
    for group in index.declared("neuron", module):
        if group.text == owner or owner in _numbered(group, index):
            yield from _states_of(index.home(group), group.item.path, outputs=True)


def _states_of(index: Index, group: Path, outputs: bool = False) -> Iterator[_Offer]:
    """The states of the model of the group at a path, and its spike and outputs where these are wanted, too."""
    model = _model_of(index, group)
    if model is not None:
        yield from (_Offer(name, "parameter", "state") for name in (model.taken if outputs else model.states))
    if outputs and model is not None:
        yield from (_Offer(name, "parameter", "output") for name in model.outputs)


def _model_of(index: Index, group: Path) -> Definition | None:
    """The model of the group at a path, where it is written."""
    path = (*group, "model")
    told = index.values.get(path)
    inner = (key[-1] for key in index.keys if key[:-1] == path)
    return known("model", index.all_items).get(told.text if told is not None else str(next(inner, "")))


def _at_end(end: str, index: Index) -> Iterator[_Offer]:
    """What there may be at an end of a connection: what the models have that are written here or in use."""
    groups = (_model_of(index, group.item.path) for group in index.declared("neuron"))
    own = (model for (section, _), model in definitions(index.all_items).items() if section == SECTIONS["model"])
    found = {"activity": f"activity at the {end} end"}
    for model in dict.fromkeys((*own, *(model for model in groups if model is not None))):
        for names, what in (
            (model.taken, "state"),
            (model.outputs, "output"),
            ([one.name for one in model.parameters], "parameter"),
        ):
            for name in names:
                found.setdefault(name, f"{what} of {model.name}")
    yield from (_Offer(name, "local", detail) for name, detail in found.items())


def _of_ends(use: Literal["port", "sent"], scope: Scope, path: Path, index: Index) -> Iterator[_Offer]:
    """The ports of the group that a path leads through, or of those that a connection goes to; what those that it
    comes from can send."""
    arrow = next((str(part) for part in path if "->" in str(part)), None)
    if arrow is None:
        groups = [path[: path.index("neurons") + 2]] if "neurons" in path else []
    else:
        named = set(_NAMES.findall(arrow.partition("->")[2 if use == "port" else 0]))
        groups = [
            group.item.path
            for group in index.declared("neuron", scope.module)
            if group.text in named or not named.isdisjoint(_numbered(group, index))
        ]
    found: dict[str, str] = {"drive": "port"} if use == "port" else {"activity": ""}
    for model in (_model_of(index, group) for group in groups):
        if model is not None and use == "port":
            found |= dict.fromkeys(model.ports, "port")
        elif model is not None:
            found |= {**dict.fromkeys(model.taken, "state"), **dict.fromkeys(model.outputs, "output")}
    yield from (_Offer(name, "parameter", detail) for name, detail in found.items())


def _instances(module: str | None, index: Index) -> Iterator[_Offer]:
    for name in index.declared("instance", module):
        made = index.attribute(name, "module")
        detail = "instance" if made is None else f"instance of {made.text}"
        yield _Offer(name.text, "module", detail)
        yield from (_Offer(one, "module", detail) for one in _numbered(name, index))


def _numbered(declaration: Name, index: Index) -> Iterator[str]:
    """The names with numbers of a counted group or instance: of many the first and the last."""
    numbers = index.numbers(declaration) or range(0)
    if len(numbers) <= _MANY:
        few = numbers if len(numbers) <= _FEW else (numbers[0], numbers[-1])
        yield from (f"{declaration.text}{number}" for number in few)


def _ends_of(low: str, scope: Scope, index: Index) -> Iterator[_Offer]:
    """What may end a range that begins with a neuron: those of its group that follow it."""
    *way, name = low.split(".")
    module = index.module_at(way, scope.module)
    for group in () if way and module is None else index.declared("neuron", module):
        numbers = index.numbers(group) or range(0)
        start = name.removeprefix(group.text)
        if name.startswith(group.text) and start.isdecimal() and len(start) < 12 and int(start) in numbers:
            for other in _numbered(group, index):
                if int(other.removeprefix(group.text)) > int(start):
                    yield _Offer(other, "neuron", f"of {group.text}")


def _definitions(found: Iterable[Definition]) -> Iterator[_Offer]:
    for definition in found:
        yield _Offer(definition.name, "definition", definition.usage, definition.markdown)


def _settings(role: Role, scope: Scope, path: Path, front: str, index: Index, place: Place) -> Iterator[_Offer]:
    """The settings of a definition; the value of one: a reference for a signal, else an expression."""
    assert role.kind is not None
    owner, setting = setting_of(path)
    definition = known(role.kind, index.all_items).get(owner)
    if role.use == "setting":
        for parameter in () if definition is None else definition.parameters:
            yield _Offer(parameter.name, "parameter", f"= {parameter.default}", parameter.description)
        for signal in () if definition is None else definition.signals:
            yield _Offer(signal, "input", "signal: neurons or an input")
    elif definition is not None and setting in definition.signals:
        yield from _neurons(scope, front, index, signals=True)
        yield from _states(scope, front, index)
    else:
        yield from _formula(role, Scope(scope.module), path, index, place)
