"""Gaps: names whose declarations are invalid, so that nobody complains that they are unknown as well.

In: a Spec as far as it could be read. Out: for each section the names that it declares and that were left out, and the
sections that are invalid as a whole, or that a misspelled key may have been meant for. One cause, one finding.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace

from neurovis_spec.diagnostics import nearest
from neurovis_spec.language.library import Library
from neurovis_spec.language.model import lost_names
from neurovis_spec.language.modules import INCLUDED, ModuleModel
from neurovis_spec.language.sections import GroupModel
from neurovis_spec.language.spec import Spec
from neurovis_spec.language.yaml.source import Node, Packed, Scalar, Sequence

SECTIONS = ("parameters", "inputs", "neurons", "instances", "modules", "activations", "models", "rules")
_NAMING = frozenset({"count", "first", "names"})


@dataclass(frozen=True)
class Gaps:
    """What may have been declared: names by section, and sections of which nothing is known."""

    names: Mapping[str, frozenset[str]] = field(default_factory=lambda: dict.fromkeys(SECTIONS, frozenset()))
    sections: frozenset[str] = frozenset()

    def cover(self, section: str, name: str) -> bool:
        """Whether a name that is unknown in a section may be one whose declaration is invalid."""
        return section in self.sections or name in self.names[section]

    def with_names(self, section: str, names: Iterable[str]) -> Gaps:
        """The same, with these names of a section."""
        return replace(self, names={**self.names, section: frozenset(names)})

    def with_section(self, section: str) -> Gaps:
        """The same, with a section of which nothing is known."""
        return replace(self, sections=self.sections | {section})

    def cover_reference(self, name: str) -> bool:
        """The same for a reference: a group invalid may make any neuron that is called like it, with a number behind,
        and so may an instance."""
        if not self.sections.isdisjoint(("neurons", "instances")):
            return True
        head = name.partition(".")[0]
        lost = self.names["neurons"] | self.names["instances"]
        return head in lost or head.rstrip("0123456789") in lost

    def only(self, sections: Collection[str]) -> Gaps:
        """The gaps of these sections."""
        names = {section: self.names[section] if section in sections else frozenset[str]() for section in self.names}
        return Gaps(names, self.sections.intersection(sections))

    def joined(self, other: Gaps) -> Gaps:
        """The gaps of both."""
        names = {section: self.names[section] | other.names[section] for section in SECTIONS}
        return Gaps(names, self.sections | other.sections)


def _names_neurons(group: GroupModel, key: str) -> bool:
    """Whether a key of a group that was left out may have said which neurons there are."""
    if key in GroupModel.model_fields:
        return key in _NAMING
    close = nearest(key, GroupModel.model_fields)
    if close:
        return not _NAMING.isdisjoint(close)
    if group.count is not None or group.names is not None:
        return False
    value = group.source.get(key)  # a key of some other language: a number may be how many there are
    return not isinstance(value, Scalar) or (
        isinstance(value.value, (int, float)) and not isinstance(value.value, bool)
    )


def _texts(node: Node | None) -> frozenset[str] | None:
    """The texts of a list; None where it is none."""
    if not isinstance(node, (Sequence, Packed)):
        return None
    return frozenset(item.value for item in node.items if isinstance(item, Scalar) and isinstance(item.value, str))


def gaps_of(library: Library | ModuleModel) -> Gaps:
    """The gaps of a spec, of a module, or of a file of definitions."""
    whole = set(library.lost.intersection(SECTIONS))
    for key in library.lost.difference(SECTIONS):
        whole.update(nearest(key, SECTIONS))
    if "include" in library.lost:
        whole.update(INCLUDED)
    names: dict[str, frozenset[str]] = {}
    for section in SECTIONS:
        kept: dict[str, object] = getattr(library, section, {})
        names[section] = frozenset(lost_names(library.source, section, kept))
    if isinstance(library, (Spec, ModuleModel)):
        for name, group in library.neurons.items():
            if any(_names_neurons(group, key) for key in group.lost):
                names["neurons"] |= {name}
            if "names" in group.lost:
                texts = _texts(group.source.get("names"))
                names["neurons"] |= texts or frozenset()
                if texts is None:
                    whole.add("neurons")
    return Gaps(names, frozenset(whole))
