"""The definitions that need no declaration: YAML files of packages, ours among them, read like anybody's.

In: the entry point group ``neurovis.libraries``; each names a package whose ``.yaml`` files hold definitions. Out:
Definitions, and the library models with their descriptions. Reading is done once in a process; the result is frozen.

What a spec means does not depend on what else is installed: ours come first, and a package that defines a name a second
time is warned of and not heard. A spec of one's own may still replace a built-in.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from typing import NamedTuple

from neurovis_spec import plugins
from neurovis_spec.compiler.values.definitions import Definitions, define
from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.library import Library
from neurovis_spec.language.shape import read_library
from neurovis_spec.language.yaml.reader import read_text

#: the entry point of our own library
OURS = "builtin"
_NOT_INSTALLED = "neurovis is not installed here, only found on the path: run 'pip install -e .' in its folder"


class Hidden(NamedTuple):
    """A definition in ``place`` that is not used: ``owner``, which comes before it, defines one of that name."""

    owner: str
    place: str


class Installed(NamedTuple):
    """The library files as models, and the definitions that are left out of them, by section and name."""

    libraries: tuple[Library, ...]
    hidden: Mapping[tuple[str, str], Hidden]


@cache
def installed() -> Installed:
    """All library files: ours, then in the order of the entry points' names, and of the files'; each without what one
    before it defines already. Raises SpecError if one is invalid, PluginError if ours are not registered: the source
    tree is on the path, but the package is not installed."""
    known = plugins.names(plugins.LIBRARIES)
    if OURS not in known:
        raise plugins.PluginError(_NOT_INSTALLED)
    result: list[Library] = []
    owners: dict[tuple[str, str], str] = {}
    hidden: dict[tuple[str, str], Hidden] = {}
    for name in sorted(known, key=lambda name: (name != OURS, name)):
        package = plugins.package(plugins.LIBRARIES, name)
        for file in sorted((f for f in files(package).iterdir() if f.name.endswith(".yaml")), key=lambda f: f.name):
            library = _library_of_text(file.read_text(encoding="utf-8"), f"{name}/{file.name}")
            result.append(_without_known(library, f"{package}/{file.name}", owners, hidden))
    return Installed(tuple(result), hidden)


def libraries() -> tuple[Library, ...]:
    """The library files as models."""
    return installed().libraries


def _without_known(
    library: Library, place: str, owners: dict[tuple[str, str], str], hidden: dict[tuple[str, str], Hidden]
) -> Library:
    """The library without the definitions that ``owners`` has already, which are ``hidden``; the others are reported as
    of ``place``."""
    kept: dict[str, dict[str, object]] = {}
    for section, definitions in library.definitions.items():
        kept[section] = {}
        for name, definition in definitions.items():
            owner = owners.setdefault((section, name), place)
            if owner == place:
                kept[section][name] = definition
            else:
                hidden.setdefault((section, name), Hidden(owner, place))
    return library.model_copy(update=kept)


def _library_of_text(text: str, name: str) -> Library:
    findings = Findings()
    document = read_text(text, name, findings)
    library = None if document is None else read_library(document, findings)
    findings.check()
    assert library is not None
    return library


@cache
def builtin_definitions() -> Definitions:
    """Every built-in activation, model and rule. Raises SpecError if one of ours is invalid."""
    definitions = Definitions()
    for library in libraries():
        findings = Findings()
        definitions = definitions.over(define(library, findings, definitions))
        findings.check()
    return definitions
