"""The definitions that need no declaration: YAML files of packages, ours among them, read like anybody's.

In: the entry point group ``neurovis.libraries``; each names a package whose ``.yaml`` files hold definitions. Out:
Definitions, and the library models with their descriptions. Reading is done once in a process; the result is frozen.
"""

from __future__ import annotations

from functools import cache
from importlib.resources import files

from neurovis_spec import plugins
from neurovis_spec.compiler.definitions import Definitions, define
from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.library import Library
from neurovis_spec.language.reader import read_text
from neurovis_spec.language.shape import read_library


@cache
def libraries() -> tuple[Library, ...]:
    """The library files as models, in the order of the entry points' names and of the files'. Raises SpecError if one
    is at fault."""
    result = []
    for name in plugins.names(plugins.LIBRARIES):
        folder = files(plugins.package(plugins.LIBRARIES, name))
        for file in sorted((f for f in folder.iterdir() if f.name.endswith(".yaml")), key=lambda f: f.name):
            result.append(_read(file.read_text(encoding="utf-8"), f"{name}/{file.name}"))
    return tuple(result)


def _read(text: str, name: str) -> Library:
    findings = Findings()
    document = read_text(text, name, findings)
    library = None if document is None else read_library(document, findings)
    findings.check()
    assert library is not None
    return library


@cache
def builtin_definitions() -> Definitions:
    """Every built-in activation, model and rule. Raises SpecError if one of ours is at fault."""
    definitions = Definitions()
    for library in libraries():
        findings = Findings()
        definitions = define(library, findings, definitions)
        findings.check()
    return definitions
