"""What a picture calls groups and entries: as their neurons are labelled, and instances by their modules.

In: a network. Out: names for a legend. The discs of a picture show labels, so a legend speaks of ``d`` where a group
DL has the labels d0 to d11, unless another group has such labels, too; and what a module declares is one thing for all
of its instances: ``leg.K``.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

from neurovis_spec.compiler.network import Group, Network
from neurovis_spec.layout.labels import parts_of

_NAME = re.compile(r"[A-Za-z_]\w*(?:\.(?!\.)[A-Za-z_]\w*)*", re.ASCII)
_NUMBER = re.compile(r"_?\d+$")


@dataclass(frozen=True)
class Names:
    """What groups and neurons are called, and of which module instances are; by their names."""

    called: Mapping[str, str]
    modules: Mapping[str, str]

    def reference(self, text: str) -> str:
        """A reference, or the name of an entry, in the words of the picture.

        >>> Names({"DL": "d", "leg.K": "leg.knee"}, {"left1": "leg"}).reference("DL + left1.K -> O")
        'd + leg.knee -> O'
        """
        inside = ""

        def word(match: re.Match[str]) -> str:
            nonlocal inside
            path, _, own = match[0].rpartition(".")
            if path in self.modules:
                inside = self.modules[path]
                name = f"{inside}.{own}"
                return self.called.get(name, name)
            if inside and match[0] not in self.called:  # left1.K -> O is what a module declares as K -> O
                name = f"{inside}.{match[0]}"
                return self.called.get(name, name).removeprefix(f"{inside}.")
            return self.called.get(match[0], match[0])

        return _NAME.sub(word, text)


def unit_of(group: Group) -> str:
    """The name of a group; that of a group in an instance is by its module."""
    return group.name if group.module is None else f"{group.module}.{group.name.rpartition('.')[2]}"


def names_of(network: Network) -> Names:
    """What a picture of a network calls what is in it."""
    neurons, parts = network.neurons, parts_of(network.neurons)
    labels: dict[str, list[tuple[str, str]]] = {}
    called: dict[str, str] = {}
    for group in neurons.groups:
        for index in group.indices:
            (base, number), label = parts[index], neurons.labels[index]
            stem = base if number else _NUMBER.sub("", label)
            labels.setdefault(unit_of(group), []).append((label, stem))
        if group.module is None and group.count > 1:
            called |= {neurons.names[index]: neurons.labels[index] for index in group.indices}
    for name, some in labels.items():
        whole, stems = {label for label, _ in some}, {stem for _, stem in some}
        words = whole if len(whole) == 1 else stems
        path, dot, own = name.rpartition(".")
        called[name] = f"{path}{dot}{words.pop() if len(words) == 1 and all(words) else own}"
    often = Counter(called.values())
    called = {name: word if often[word] == 1 else name for name, word in called.items()}
    modules = {instance.path: instance.module for instance in network.instances}
    modules |= {instance.declared: instance.module for instance in network.instances}
    return Names(called, modules)
