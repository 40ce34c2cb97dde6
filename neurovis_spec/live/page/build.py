"""Puts the page together: its modules, its style and its frame become ``page.html``, which is what is shipped.

In: the files beside this one. Out: the page beside this folder. Run it after every change:
``python neurovis_spec/live/page/build.py``. Modules become one script: their imports and exports go, so every name at
the top of a module must be unique among all of them, which is checked. Comments stand on lines of their own.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

from jinja2 import Environment, StrictUndefined

HERE = Path(__file__).parent
TARGET = HERE.parent / "page.html"
FIRST = "main.js"

_IMPORT = re.compile(r"^import \{[^}]*\} from '\./([\w-]+\.js)';\n", re.MULTILINE)
_TOP = re.compile(r"^(?:export )?(?:async )?(?:function|class|const|let) +(?:\{([^}]*)\}|(\w+))", re.MULTILINE)
_MORE = re.compile(r"^(?:const|let) +(\w+ = [^(\[{;\n]*(?:, \w+ = [^(\[{;\n]*)+);", re.MULTILINE)
_BLOCK = re.compile(r"^ *(?:/\*\*(?:[^*]|\*(?!/))*\*/|//.*)\n", re.MULTILINE)
_TYPE = re.compile(r"/\*\* @(?:type|param) \{[^*]*\} ?\w*? ?\*/ ?")


class BuildError(ValueError):
    """Modules that cannot become one script."""


def order(first: str, seen: list[str]) -> list[str]:
    """The modules that ``first`` needs, each after those that it needs itself."""
    if first not in seen:
        for needed in _IMPORT.findall((HERE / first).read_text(encoding="utf-8")):
            order(needed, seen)
        seen.append(first)
    return seen


def names(text: str) -> list[str]:
    """The names at the top of a module."""
    found = []
    for several, one in _TOP.findall(text):
        found += [name.strip() for name in several.split(",")] if several else [one]
    for line in _MORE.findall(text):
        found += [entry.split("=")[0].strip() for entry in line.split(",")[1:]]
    return found


def script() -> str:
    """All modules as one script."""
    parts, known = [], dict[str, str]()
    for module in order(FIRST, []):
        text = (HERE / module).read_text(encoding="utf-8")
        for name in names(text):
            if known.setdefault(name, module) != module:
                raise BuildError(f"'{name}' is at the top of {module} and of {known[name]}")
        parts.append(small(re.sub(r"^export ", "", _IMPORT.sub("", text), flags=re.MULTILINE)))
    return "\n" + "".join(parts)


def small(text: str) -> str:
    """A script or a style without comments, indentation and empty lines."""
    lines = (line.strip() for line in _TYPE.sub("", _BLOCK.sub("", text)).split("\n"))
    return "".join(f"{line}\n" for line in lines if line)


def page() -> str:
    """The page."""
    environment = Environment(undefined=StrictUndefined, autoescape=False, keep_trailing_newline=True)
    frame = environment.from_string((HERE / "frame.html").read_text(encoding="utf-8"))
    return frame.render(style="\n" + small((HERE / "style.css").read_text(encoding="utf-8")), script=script())


if __name__ == "__main__":
    text = page()
    if sys.argv[1:] == ["--check"]:
        sys.exit(0 if TARGET.read_text(encoding="utf-8") == text else f"{TARGET} is not up to date: run {__file__}")
    TARGET.write_text(text, encoding="utf-8")
