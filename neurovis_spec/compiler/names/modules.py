"""Modules: which there are, where they come from, and that none of them holds itself.

In: a Spec and its Includes. Out: Modules by name, each with the folder that its paths are relative to, and all
definitions of the spec and its included files. Two definitions of one name are a finding that names both places.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from neurovis_spec.compiler.values.builtin import builtin_definitions
from neurovis_spec.compiler.values.definitions import Around, Definitions, define
from neurovis_spec.diagnostics import Findings, Span
from neurovis_spec.language.includes import Includes
from neurovis_spec.language.library import Library as LanguageLibrary
from neurovis_spec.language.model import names_of, opening
from neurovis_spec.language.modules import INCLUDED, ModuleModel
from neurovis_spec.language.spec import Spec
from neurovis_spec.language.unknown import UNKNOWN, Names
from neurovis_spec.language.yaml.source import Mapping as SourceMapping


@dataclass(frozen=True)
class Module:
    """A module, and where it is from: ``own`` is the spec itself, not a file that it includes."""

    name: str
    model: ModuleModel
    folder: Path
    own: bool


class Library(NamedTuple):
    """All modules and definitions in reach."""

    modules: Names[Module]
    definitions: Definitions


def library_of(spec: Spec, includes: Includes, folder: Path, dt: float, findings: Findings) -> Library:
    """The modules and definitions of a spec and of its included files, on top of the built-in definitions."""
    _duplicates(spec, includes, findings)
    builtin = builtin_definitions()
    around = Around(dt, spec.parameters)
    definitions = define(spec, findings, builtin, around).over(builtin)
    own = {name: Module(name, model, folder, own=True) for name, model in spec.modules.items()}
    modules = names_of(spec, "modules", own)
    is_open = not includes.complete
    for included in includes.files:
        file = included.model
        definitions = definitions.over(define(file, findings, builtin, around))
        others = {name: Module(name, model, included.folder, own=False) for name, model in file.modules.items()}
        modules = modules.over(names_of(file, "modules", others))
        is_open = is_open or "include" in file.unknown
    for module in modules.known().values():
        _check_filled(module, findings)
    cyclic = dict.fromkeys(_cyclic(modules.known(), findings), UNKNOWN)
    return Library(Names({**modules, **cyclic}, modules.is_open).opened(is_open), definitions.opened(is_open))


def _check_filled(module: Module, findings: Findings) -> None:
    """A module has neurons, or instances of modules that have some."""
    model = module.model
    declared = names_of(model, "neurons", model.neurons), names_of(model, "instances", model.instances)
    if not any(declared) and model.sound:
        message = f"the module '{module.name}' has no neurons"
        findings.error("no-neurons", opening(model.source), message, "add a group under its 'neurons'")


def _duplicates(spec: Spec, includes: Includes, findings: Findings) -> None:
    """Two definitions of one name, in files of which each is in order by itself."""
    for section in INCLUDED:
        first: dict[str, Span] = {}
        for library in (*(included.model for included in includes.files), spec):
            for name, span in _named(library, section):
                place = first.setdefault(name, span)
                if place is not span and place.file != span.file:
                    what = section.removesuffix("s")
                    message = f"the {what} '{name}' is defined already, in {place.file}:{place.line}:{place.column}"
                    findings.error("duplicate-definition", span, message, "choose another name")


def _named(library: LanguageLibrary, section: str) -> Iterator[tuple[str, Span]]:
    node = library.source.get(section)
    for entry in node.entries if isinstance(node, SourceMapping) else ():
        yield entry.name, entry.key.span


def _cyclic(modules: Mapping[str, Module], findings: Findings) -> Iterator[str]:
    """The modules that hold themselves, directly or through others; a finding for each cycle."""
    done: set[str] = set()
    for root in modules:
        way: dict[str, None] = {}  # in order, the innermost last
        waiting = [(root, 0)]
        while waiting:
            name, depth = waiting.pop()
            while len(way) > depth:
                done.add(way.popitem()[0])
            if name in done:
                continue
            way[name] = None
            for instance in modules[name].model.instances.values():
                used = instance.module.value
                if used in way:
                    before = [*way]
                    names = [*before[before.index(used) :], used]
                    shown = names if len(names) <= 8 else [*names[:4], "…", *names[-3:]]
                    message = f"these modules hold each other: {' -> '.join(shown)}"
                    if len(names) == 2:
                        message = f"the module '{used}' holds itself"
                    findings.error("module-cycle", instance.module.span, message, "no network is that large")
                    yield from names
                elif used in modules and used not in done:
                    waiting.append((used, depth + 1))
        done.update(way)
