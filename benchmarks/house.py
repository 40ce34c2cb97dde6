"""The house: how many places a reader has to know. Circles of imports, long functions, modules, lines, calls, CPU.

In: nothing; ``--list`` names each circle and each function that is counted. Out: a table, on standard output. Run it
with ``python benchmarks/house.py``. What counts:

- *circles of imports*: sets of modules that import each other, by imports for type checking and in functions, too;
- *functions*: of any kind, nested ones and methods too; their lines from ``def`` to the last one, all parameters,
  ``self`` and ``cls`` among them;
- *lines of code*: neither blank nor comment nor docstring;
- *own functions called*: different ones, ours alone, in the second compile of a spec of two neurons in one process;
- *validate*: seconds of the processor, the process's start included, the least of several, compiled to byte code.
"""

from __future__ import annotations

import argparse
import ast
import io
import sys
import tokenize
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import CodeType, FrameType

import grimp

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

from acyclic import circles
from front_end import COMMAND, EXAMPLE, best, process

import neurovis_spec as nv

ROOT = Path(__file__).resolve().parent.parent
FOLDERS = (ROOT, ROOT / "layouts", ROOT / "renderers", ROOT / "bodies")
PACKAGES = ("neurovis_spec", "neurovis_layouts", "neurovis_renderers", "neurovis_bodies")
TWO_NEURONS = (
    "neurovis: 1\nname: two\nneurons:\n  A: {activation: tanh}\n  B: {bias: 0.5}\nconnections:\n  A -> B: 0.3\n"
)
LINES, PARAMETERS = 50, 8


@dataclass(frozen=True, slots=True)
class Module:
    """A module of ours: its dotted name, where it is, its text."""

    name: str
    path: Path
    text: str


@dataclass(frozen=True, slots=True)
class Function:
    """A function: where it stands, its lines, its parameters."""

    place: str
    lines: int
    parameters: int


def modules() -> list[Module]:
    """All modules of the four packages."""
    found = []
    for folder in FOLDERS:
        for package in PACKAGES:
            for path in sorted((folder / package).rglob("*.py")):
                parts = path.relative_to(folder).with_suffix("").parts
                name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
                found.append(Module(name, path, path.read_text(encoding="utf-8")))
    return found


def functions(module: Module) -> Iterator[Function]:
    """The functions of a module."""
    for node in ast.walk(ast.parse(module.text)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            given = node.args
            names = [one.arg for one in (*given.posonlyargs, *given.args, *given.kwonlyargs)]
            names += [one.arg for one in (given.vararg, given.kwarg) if one]
            lines = (node.end_lineno or node.lineno) - node.lineno + 1
            yield Function(f"{module.name}:{node.lineno} {node.name}", lines, len(names))


def lines_of_code(text: str) -> int:
    """Lines that are neither blank nor comment nor docstring."""
    ignored = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}
    lines: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in ignored:
            lines.update(range(token.start[0], token.end[0] + 1))
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            first = node.body[0] if node.body else None
            if (
                isinstance(first, ast.Expr)
                and isinstance(first.value, ast.Constant)
                and isinstance(first.value.value, str)
            ):
                lines.difference_update(range(first.lineno, (first.end_lineno or first.lineno) + 1))
    return len(lines)


def called() -> int:
    """How many functions of ours the second compile of a small spec calls."""
    nv.compile_text(TWO_NEURONS)
    met: set[CodeType] = set()

    def note(frame: FrameType, event: str, argument: object) -> None:
        if event == "call":
            met.add(frame.f_code)

    sys.setprofile(note)
    try:
        nv.compile_text(TWO_NEURONS)
    finally:
        sys.setprofile(None)
    return sum(any(f"/{package}/" in code.co_filename for package in PACKAGES) for code in met)


def figures(found: list[Module]) -> Mapping[str, tuple[str, list[str]]]:
    """Each figure, and what was counted."""
    around = circles(grimp.build_graph(*PACKAGES, cache_dir=None))
    all_functions = [function for module in found for function in functions(module)]
    long = [function for function in all_functions if function.lines > LINES]
    wide = [function for function in all_functions if function.parameters >= PARAMETERS]
    return {
        "circles of imports, all kinds": (str(len(around)), [" <-> ".join(circle) for circle in around]),
        f"functions over {LINES} lines": (str(len(long)), [f"{one.place}: {one.lines}" for one in long]),
        f"functions with {PARAMETERS} or more parameters": (
            str(len(wide)),
            [f"{one.place}: {one.parameters}" for one in wide],
        ),
        "modules": (str(len(found)), []),
        "own functions called in the second compile of two neurons": (str(called()), []),
        "lines of code": (f"{sum(lines_of_code(module.text) for module in found):,}", []),
        "validate of use case 1, CPU s": (f"{best(process(*COMMAND, 'validate', str(EXAMPLE)), 9):.2f}", []),
    }


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--list", action="store_true", help="name what was counted")
    given = options.parse_args()
    print("| figure | now |\n| --- | --- |")
    for name, (figure, counted) in figures(modules()).items():
        print(f"| {name} | {figure} |")
        if given.list:
            print("".join(f"    {one}\n" for one in counted), end="")


if __name__ == "__main__":
    main()
