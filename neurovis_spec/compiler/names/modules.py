"""Modules: which there are, where they come from, and that none of them holds itself.

In: a Spec and its Includes. Out: Modules by name, each with the folder that its paths are relative to, and all
definitions of the spec and its included files. Two definitions of one name are a finding that names both places.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import NamedTuple, TypeVar

from neurovis_spec.compiler.names.unresolved import Gaps, gaps_of
from neurovis_spec.compiler.values.builtin import builtin_definitions
from neurovis_spec.compiler.values.definitions import Definitions, define
from neurovis_spec.diagnostics import Findings, Span
from neurovis_spec.language.includes import Includes
from neurovis_spec.language.library import Library as LanguageLibrary
from neurovis_spec.language.model import opening
from neurovis_spec.language.modules import INCLUDED, ModuleModel
from neurovis_spec.language.spec import Spec
from neurovis_spec.language.yaml.source import Mapping as SourceMapping

T = TypeVar("T")


@dataclass(frozen=True)
class Module:
    """A module, and where it is from: ``own`` is the spec itself, not a file that it includes."""

    name: str
    model: ModuleModel
    folder: Path
    own: bool

    @cached_property
    def gaps(self) -> Gaps:
        """What of it could not be read."""
        return gaps_of(self.model)


class Library(NamedTuple):
    """All modules and definitions in reach, and what of them could not be read (``definitions.gaps``)."""

    modules: Mapping[str, Module]
    definitions: Definitions


def library_of(spec: Spec, includes: Includes, folder: Path, dt: float, findings: Findings) -> Library:
    """The modules and definitions of a spec and of its included files, on top of the built-in definitions."""
    _duplicates(spec, includes, findings)
    builtin = builtin_definitions()
    gaps = gaps_of(spec)
    definitions = builtin
    modules: dict[str, Module] = {}
    for included in includes.files:
        definitions = _joined(definitions, define(included.model, findings, builtin, dt))
        gaps = gaps.joined(gaps_of(included.model).only(INCLUDED))
        for name, model in included.model.modules.items():
            modules.setdefault(name, Module(name, model, included.folder, own=False))
    definitions = _joined(definitions, define(spec, findings, builtin, dt))
    modules.update({name: Module(name, model, folder, own=True) for name, model in spec.modules.items()})
    if not includes.complete:
        gaps = replace(gaps, sections=gaps.sections.union(INCLUDED))
    gaps = gaps.joined(definitions.gaps.only(INCLUDED))
    cyclic = set(_cyclic(modules, findings))
    gaps = gaps.with_names("modules", gaps.names["modules"] | cyclic)
    kept = {name: module for name, module in modules.items() if name not in cyclic}
    for module in modules.values():
        _check_filled(module, findings)
    return Library(kept, replace(definitions, gaps=gaps))


def _check_filled(module: Module, findings: Findings) -> None:
    """A module has neurons, or instances of modules that have some."""
    model = module.model
    lost = module.gaps.names["neurons"] or module.gaps.names["instances"]  # there are some, which are invalid
    if not model.neurons and not model.instances and not model.lost and not lost:
        message = f"the module '{module.name}' has no neurons"
        findings.error("no-neurons", opening(model.source), message, "add a group under its 'neurons'")


def _joined(one: Definitions, other: Definitions) -> Definitions:
    """The definitions of both. What is in the built-in ones alone must not hide another file's."""
    builtin = builtin_definitions()

    def over(first: Mapping[str, T], second: Mapping[str, T], below: Mapping[str, T]) -> dict[str, T]:
        return {**first, **{name: made for name, made in second.items() if below.get(name) is not made}}

    return Definitions(
        over(one.activations, other.activations, builtin.activations),
        over(one.models, other.models, builtin.models),
        over(one.rules, other.rules, builtin.rules),
        one.gaps.joined(other.gaps),
    )


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
