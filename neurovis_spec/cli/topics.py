"""Topics of the manual as text for a terminal.

In: Topics. Out: lines. A topic has a head, a text, tables where there is something to list, and an example.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence
from typing import Final

from neurovis_spec.cli.tables import table
from neurovis_spec.language.grammar import Role
from neurovis_spec.language.patterns import PATTERNS, Pattern
from neurovis_spec.manual.builtins import Builtin, builtins
from neurovis_spec.manual.keys import Key, example, keys, keys_of
from neurovis_spec.manual.networks import Start, starts
from neurovis_spec.manual.topics import Topic
from neurovis_spec.manual.words import Word, functions, names

_WIDTH: Final = 100
_KINDS: Final = {
    "activation": "an activation",
    "model": "a neuron model",
    "rule": "a plasticity rule",
    "synapse": "a synapse",
}


def text_of(found: Sequence[Topic]) -> str:
    """One topic, or all that a name may mean; of a key that many sections have, a line each, but for a section of that
    name."""
    same = [topic for topic in found if isinstance(topic, Key) and topic.path != topic.name]
    if len(same) <= 2:
        return "\n\n\n".join(map(explained, found))
    others = [explained(topic) for topic in found if topic not in same]
    rows = table([(key.path, key.about) for key in same])
    return "\n\n\n".join([*others, f"{same[0].name}, a key of several sections\n\n{rows}"])


def explained(topic: Topic) -> str:
    """The text of one topic."""
    match topic:
        case Builtin():
            return _builtin(topic)
        case Key():
            return _key(topic)
        case Pattern():
            use = indented(f"connections: {{K -> L: {{weight: 0.1, pattern: {topic.use}}}}}")
            return f"{topic.name}, a pattern of connections\n\n{filled(topic.about)}\n\n{use}"
        case Word():
            kind = "a function of expressions" if "(" in topic.usage else "a name in expressions"
            return f"{topic.usage}, {kind}\n\n{filled(topic.about)}"
        case Start():
            also = [filled(f"also: {', '.join(topic.called)}")] if topic.called else []
            head = f"{topic.name}, a network to start from: {topic.title}"
            return "\n\n".join([head, filled(topic.about), *also, indented(topic.spec.rstrip())])


def _builtin(builtin: Builtin) -> str:
    parts = [f"{builtin.name}, {_KINDS[builtin.kind]}", filled(builtin.about)]
    if builtin.parameters:
        parts.append(table(builtin.parameters, ("parameter", "default", "")))
    if builtin.ends:
        parts.append(table(builtin.ends))
    if builtin.signals:
        parts.append(filled(f"signals, each a neuron, a group or an input: {', '.join(builtin.signals)}"))
    shipped = f"{builtin.kind}s:\n{indented(builtin.yaml)}"
    return "\n\n".join([*parts, "as it ships:", indented(shipped), "in use:", indented(builtin.use)])


def _key(key: Key) -> str:
    head = [key.path, "a key"]
    if key.kind:
        head.append(key.kind)
    if key.default or key.required:
        head.append("required" if key.required else f"by default {key.default}")
    parts = [", ".join(head), filled(key.about)]
    role = key.role or Role("text")
    choices = [one.name for one in builtins() if role.use == "choice" and one.kind == role.kind]
    if role.use == "pattern":
        choices = [*PATTERNS]
    if role.use in ("formula", "template") and (role.sees or role.draws):
        draws = "; they may draw random numbers" if role.draws else ""
        seen = (*role.sees, *(("pre.X", "post.X") if role.ends else ()))
        parts.append(filled(f"its expressions know parameters, {', '.join(seen)}{draws}"))
    if choices:
        parts.append(filled(f"built in: {', '.join(choices)}"))
    below = keys_of(key.path)
    if below:
        rows = [(one.name, one.kind, "required" if one.required else one.default, one.about) for one in below]
        parts.append(table(rows, ("key", "value", "default", "")))
    shown = example(key.path)
    if shown is not None:
        parts.append(indented(shown))
    return "\n\n".join(parts)


def contents() -> str:
    """All names, by what they are."""
    parts = [_listed("keys of a spec", (key.name for key in keys_of("")))]
    for key in keys():
        below = keys_of(key.path)
        if below:
            parts.append(_listed(f"keys of {key.path}", (one.name for one in below)))
    for kind in _KINDS:
        parts.append(_listed(f"{kind}s", (one.name for one in builtins() if one.kind == kind)))
    parts.append(_listed("patterns", PATTERNS))
    parts.append(_listed("functions", (one.name for one in functions())))
    parts.append(_listed("names in expressions", (one.name for one in names())))
    parts.append(_listed("networks to start from", (name for one in starts() for name in (one.name, *one.called))))
    return "\n".join([*parts, "", "'neurovis docs NAME' explains each of them."])


def _listed(title: str, found: Iterable[str]) -> str:
    return f"{title}\n{filled(', '.join(found))}"


def filled(text: str) -> str:
    """A text in lines, indented by two."""
    return textwrap.fill(text, _WIDTH, initial_indent="  ", subsequent_indent="  ", break_on_hyphens=False)


def indented(text: str) -> str:
    """Lines as they are, indented by two."""
    return textwrap.indent(text, "  ")
