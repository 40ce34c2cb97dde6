"""The catalogue of findings: what each code means, with a spec that earns it and one that does not.

In: the ``.yaml`` files beside this one, a chapter each. Out: Codes by name, in the order of the chapters. The command
``explain``, ``docs/errors.md`` and the rules of SARIF are made from it; tests hold every example to its code, and the
catalogue to what the source can say.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from typing import Any, Final, Literal

import yaml

VALIDATE: Final = "neurovis validate spec.yaml"
CHAPTERS: Final = (
    *("text", "shape", "names", "values", "expressions"),
    *("connections", "modules", "files", "layout", "warnings"),
)


@dataclass(frozen=True)
class Code:
    """One code.

    ``meaning`` is a sentence. ``bad`` is a spec whose one finding has this code, ``good`` the same as it should be;
    both may need ``files``, and stand in ``encoding``. ``command`` is what brings the finding about. ``rare`` says, in
    place of the examples, when a code occurs that no short spec can earn.
    """

    name: str
    chapter: str
    severity: Literal["error", "warning"]
    meaning: str
    bad: str | None = None
    good: str | None = None
    files: Mapping[str, str] = field(default_factory=dict)
    command: str = VALIDATE
    encoding: str = "utf-8"
    rare: str | None = None

    def text(self) -> str:
        """The entry for a terminal."""
        lines = [f"{self.severity}[{self.name}]: {self.meaning}"]
        for title, _, block in self._blocks():
            lines += ["", title, "", *(f"  {line}".rstrip() for line in block)]
        return "\n".join([*lines, *self._rest()])

    def markdown(self) -> str:
        """The entry for a page, without a heading."""
        lines = [self.meaning]
        for title, kind, block in self._blocks():
            lines += ["", title, "", f"```{kind}", *block, "```"]
        return "\n".join([*lines, *self._rest()])

    def _blocks(self) -> list[tuple[str, str, list[str]]]:
        """Titles, kinds and lines of what is shown as it is written."""
        blocks = [(f"With the file {name}:", "", text) for name, text in self.files.items()]
        for title, text in (("Wrong:", self.bad), ("Right:", self.good)):
            if text is not None:
                blocks.append((title, "yaml", text))
        return [(title, kind, text.rstrip("\n").split("\n")) for title, kind, text in blocks]

    def _rest(self) -> list[str]:
        lines = [] if self.rare is None else ["", self.rare]
        return lines if self.command == VALIDATE else [*lines, "", f"It is what `{self.command}` answers."]


@cache
def _chapter(name: str) -> Any:
    return yaml.safe_load(files(__name__).joinpath(f"{name}.yaml").read_text(encoding="utf-8"))


@cache
def catalogue() -> Mapping[str, Code]:
    """All codes, in the order of the chapters and of the entries in these."""
    result: dict[str, Code] = {}
    for chapter in CHAPTERS:
        for name, entry in _chapter(chapter)["codes"].items():
            result[name] = Code(name, chapter, "warning" if chapter == "warnings" else "error", **entry)
    return result


def page() -> str:
    """``docs/errors.md``: every code under its chapter."""
    lines = [
        "# Findings",
        "",
        "Every finding has a code: `FILE:LINE:COLUMN: error[CODE]: MESSAGE`. `neurovis explain CODE` prints what is",
        "said of it here, `neurovis explain list` a line for each.",
        "A warning is silenced on its line by a comment at the line's end, `# neurovis: allow CODE`, or several codes",
        "with commas between; `neurovis validate --strict` takes warnings for errors.",
        "",
        "This page is generated: `python -m neurovis_spec.codes > docs/errors.md`.",
    ]
    for chapter in CHAPTERS:
        lines += ["", f"## {_chapter(chapter)['title']}"]
        for code in catalogue().values():
            if code.chapter == chapter:
                lines += ["", f"### {code.name}", "", code.markdown()]
    return "\n".join(lines) + "\n"
