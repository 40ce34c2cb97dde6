"""Writes the tables of docs/language.md anew: ``python docs/make_language.py``, or ``make docs``.

In: the page, whose prose is written by hand, with tables between ``<!-- NAME … -->`` and ``<!-- end -->``. Out: the
same page, its tables made from the models, the library and the tables that the compiler works with.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from neurovis_spec.language.patterns import PATTERNS
from neurovis_spec.manual.builtins import Builtin, builtins
from neurovis_spec.manual.keys import keys_of
from neurovis_spec.manual.networks import starts
from neurovis_spec.manual.words import functions, names

PAGE = Path(__file__).parent / "language.md"
_PART = re.compile(r"(<!-- (\w+)(?: ([\w.]+))? -->\n)(?:(?!<!--).)*?(<!-- end -->)", re.DOTALL)


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A table in Markdown."""
    head = tuple(head)
    lines = [f"| {' | '.join(head)} |", f"|{' --- |' * len(head)}"]
    lines += [f"| {' | '.join(cell.replace('|', chr(92) + '|') or '–' for cell in row)} |" for row in rows]
    return "\n".join(lines)


def code(text: str) -> str:
    """A text as code, nothing as nothing."""
    return f"`{text}`" if text else ""


def key_table(section: str) -> str:
    """The keys of a section that this version reads."""
    rows = [
        (code(key.name), key.kind, "required" if key.required else code(key.default), key.about)
        for key in keys_of(section if section != "top" else "")
    ]
    return table(("key", "value", "default", "meaning"), rows)


def ours(kind: str) -> list[Builtin]:
    """The built-in definitions of a kind, without those that packages on this machine bring along."""
    return [one for one in builtins() if one.kind == kind and one.origin == "builtin"]


def activation_table(_: str) -> str:
    """The built-in activations: a line each."""
    rows = [(code(one.name), code(_settings(one)), code(_value(one)), one.about) for one in ours("activation")]
    return table(("activation", "parameters", "value", "meaning"), rows)


def definitions(kind: str) -> str:
    """The built-in models, rules or synapses: a line each, then all of them as they ship."""
    chosen = ours(kind)
    settings = [", ".join(filter(None, (_settings(one), *one.signals))) for one in chosen]
    head = (kind, "parameters, signals" if kind == "rule" else "parameters", "meaning")
    rows = [(code(one.name), code(text), one.about) for one, text in zip(chosen, settings, strict=True)]
    shipped = "\n\n".join("\n".join(f"  {line}".rstrip() for line in one.yaml.splitlines()) for one in chosen)
    return f"{table(head, rows)}\n\nAs they ship:\n\n```yaml\n{kind}s:\n{shipped}\n```"


def _settings(builtin: Builtin) -> str:
    return ", ".join(f"{name}: {default}" for name, default, _ in builtin.parameters)


def _value(builtin: Builtin) -> str:
    return next(line.split(": ", 1)[1] for line in builtin.yaml.splitlines() if line.startswith("  value: "))


def pattern_table(_: str) -> str:
    """The patterns that this version reads."""
    rows = [(code(one.use), one.about) for one in PATTERNS.values()]
    return table(("pattern", "connects"), rows)


def function_table(_: str) -> str:
    """The functions of expressions."""
    return table(("function", "is"), [(code(one.usage), one.about) for one in functions()])


def name_table(_: str) -> str:
    """What expressions may name beside parameters."""
    return table(("name", "is"), [(code(one.usage), one.about) for one in names()])


def network(name: str) -> str:
    """A network to start from."""
    (spec,) = (one.spec for one in starts() if one.name == name)
    return f"```yaml\n{spec}```"


PARTS: Mapping[str, Callable[[str], str]] = {
    "keys": key_table,
    "activations": activation_table,
    "definitions": definitions,
    "patterns": pattern_table,
    "functions": function_table,
    "names": name_table,
    "network": network,
}


def made(page: str) -> str:
    """The page with its tables made anew."""

    def anew(part: re.Match[str]) -> str:
        opening, name, section, closing = part.groups()
        return f"{opening}{PARTS[name](section or '')}\n{closing}"

    return _PART.sub(anew, page)


if __name__ == "__main__":
    PAGE.write_text(made(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
