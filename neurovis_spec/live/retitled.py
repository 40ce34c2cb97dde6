"""A spec of which nothing but the title was edited: nothing of it has to be compiled, laid out or run anew.

In: what is shown, the file of its spec. Out: the same with the new title, and with the layouts and gains that are known
of it; None where the text differs elsewhere, or where anything stands in another line or column than before.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Final, TypeVar

from neurovis_spec.compilation import Compilation
from neurovis_spec.diagnostics import Findings, Span
from neurovis_spec.language.shape import read_spec
from neurovis_spec.language.yaml.reader import read_file
from neurovis_spec.language.yaml.source import Mapping

_KEY: Final = "title"
#: What follows from a compilation, and is the same with another title.
_FOLLOWS: Final = ("gains", "_layouts", "_recorded")

C = TypeVar("C", bound=Compilation)


def retitled(shown: C, path: Path) -> C | None:
    """``shown`` with the title that the file says by now."""
    name, findings = shown.spec.name.span.file, Findings()
    document = read_file(path, name, findings)
    spec = None if document is None else read_spec(document, findings)
    before, after = shown.sources.get(name), findings.sources.get(name)
    if spec is None or before is None or after is None or findings.sorted():
        return None
    then, now = _title(shown.spec.source), _title(spec.source)
    around = None if then is None else _around(before, then)
    if then is None or now is None or around is None or around != _around(after, now):
        return None
    if any(one.span.file == name and then.line <= one.span.line <= then.end_line for one in shown.warnings):
        return None
    title = ", ".join(text.value for text in spec.title or ()) or shown.network.name
    network = replace(shown.network, title=title)
    made = replace(shown, network=network, spec=spec, sources={**shown.sources, name: after})
    made.__dict__.update({key: value for key, value in shown.__dict__.items() if key in _FOLLOWS})
    made.__dict__["problem"] = shown.problem
    return made


def _title(root: Mapping) -> Span | None:
    """Where the value of the title stands."""
    node = root.get(_KEY)
    return None if node is None else node.span


def _around(text: str, title: Span) -> tuple[list[str], str, int, str, list[str]] | None:
    """What stands around the title; None where what follows it in its line may be more than a comment."""
    lines = text.split("\n")
    first, last = lines[title.line - 1], lines[title.end_line - 1]
    rest = last[title.end_column - 1 :].strip()
    if rest and not rest.startswith("#"):
        return None
    return lines[: title.line - 1], first[: title.column - 1], title.end_line, rest, lines[title.end_line :]
