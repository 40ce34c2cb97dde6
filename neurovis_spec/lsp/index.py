"""Who is called what in a document: declarations, and to which of them a name leads.

In: the Items and Names of a document, and the indices of other files in reach. Out: for a name its declaration and the
part of it that is the declared one (the ``K`` of ``K3``); all names that lead to a declaration. Groups, inputs and
instances of a module share their names. Of another file the modules and the definitions are known here, nothing else.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import chain, count, takewhile
from typing import Final

from neurovis_spec.diagnostics import Span
from neurovis_spec.language.grammar import Kind
from neurovis_spec.lsp.names import SECTIONS, Lookup, Name, names_of
from neurovis_spec.lsp.outline import Item
from neurovis_spec.lsp.text import Text

_NUMBER = re.compile(r"0|[1-9][0-9]*")
#: No name is longer.
_LONGEST = 64
#: The sections of a model with what a connection may read of its ends.
_OF_ENDS: Final = ("state", "outputs", "parameters")
#: The kinds that share one namespace.
SHARED: Final[tuple[Kind, ...]] = ("neuron", "input", "instance")
#: The kinds that a file shares with those that it includes, or that include it.
COMMON: Final[tuple[Kind, ...]] = ("module", *SECTIONS)


@dataclass(frozen=True, slots=True)
class Found:
    """Where a name leads: its declaration, and the place in the name that bears the declared one."""

    declaration: Name
    part: Span


@dataclass(frozen=True)
class Index:
    """The names of one document. ``sizes`` are those of groups whose ``count`` is no plain number, as far as they are
    known; ``builtin_signals`` the signals of the built-in rules; ``others`` know what other files in reach declare."""

    items: tuple[Item, ...]
    text: Text
    file: str = ""
    sizes: Mapping[str, int] = field(default_factory=dict)
    builtin_signals: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    others: tuple[Index, ...] = ()

    @cached_property
    def values(self) -> Mapping[tuple[str | int, ...], Item]:
        """The values by their paths."""
        return {item.path: item for item in self.items if not item.is_key}

    @cached_property
    def keys(self) -> Mapping[tuple[str | int, ...], Item]:
        """The keys by their paths."""
        return {item.path: item for item in self.items if item.is_key}

    @cached_property
    def names(self) -> tuple[Name, ...]:
        """All names, in the order of the document."""
        return tuple(names_of(self.items, self.text, self._lookup))

    def names_in(self, item: Item) -> tuple[Name, ...]:
        """The names of one item."""
        return tuple(names_of((item,), self.text, self._lookup))

    @property
    def _lookup(self) -> Lookup:
        return Lookup(
            self.module_of,
            self._is_signal,
            lambda name: ("outputs", name) in self.keys,
            self._models_with.get,
            self._model_of,
            self._joining_with.get,
        )

    def _with(self, sections: Collection[str], parts: Collection[str]) -> Mapping[str, tuple[str, str]]:
        """The definition of some sections, by its section and its name, that alone declares something there, by the
        name of that."""
        found: dict[str, set[tuple[str, str]]] = {}
        for item in self.all_items:
            path = item.path
            if item.is_key and len(path) == 4 and path[0] in sections and path[2] in parts:
                found.setdefault(str(path[3]), set()).add((str(path[0]), str(path[1])))
        return {name: definition for name, (definition, *others) in found.items() if not others}

    @cached_property
    def _models_with(self) -> Mapping[str, str]:
        """The model that alone declares a state, an output or a parameter, by the name of that."""
        return {name: model for name, (_, model) in self._with(("models",), _OF_ENDS).items()}

    @cached_property
    def _joining_with(self) -> Mapping[str, tuple[str, str]]:
        """The rule or synapse that alone declares a state, by the name of that."""
        return self._with(("synapses", "rules"), ("state",))

    def _model_of(self, name: str, module: str | None) -> str | None:
        """The model that a group names, which is called so or of which this is a neuron, in a module; None where it
        names none. Names are found by it, so that it goes by the keys alone."""
        neurons = ("neurons",) if module is None else ("modules", module, "neurons")
        for home in (self, *(() if module is None else self.others)):
            for path in ((*neurons, name), (*neurons, name.rstrip("0123456789"))):
                named = home.values.get((*path, "model"))
                if named is not None:
                    return named.text
                settings = (str(key[-1]) for key in home.keys if key[:-1] == (*path, "model"))
                if (found := next(settings, None)) is not None:
                    return found
        return None

    @cached_property
    def declarations(self) -> tuple[Name, ...]:
        """Those names that declare something."""
        return tuple(name for name in self.names if name.declares)

    @cached_property
    def _declared(self) -> Mapping[tuple[Kind, str | None, tuple[str, str] | None, str], Name]:
        result: dict[tuple[Kind, str | None, tuple[str, str] | None, str], Name] = {}
        for name in self.declarations:
            result.setdefault((name.kind, name.scope.module, name.scope.definition, name.text), name)
        return result

    def declared(self, kind: Kind, module: str | None = None) -> tuple[Name, ...]:
        """The declarations of a kind in a module (None: the spec itself), wherever that is."""
        found = tuple(name for name in self.declarations if name.kind == kind and name.scope.module == module)
        if module is not None or kind in COMMON:
            found += tuple(name for other in self.others for name in other.declared(kind, module))
        return found

    def locals(self, section: str, definition: str) -> tuple[Name, ...]:
        """What an own definition declares: parameters, states, signals, intermediate values."""
        wanted = (section, definition)
        return tuple(n for n in self.declarations if n.kind == "local" and n.scope.definition == wanted)

    @property
    def all_items(self) -> Iterator[Item]:
        """The items of all files in reach, the document's own last."""
        return chain(*(other.items for other in self.others), self.items)

    def home(self, declaration: Name) -> Index:
        """The index of the file that declares something."""
        if declaration.span.file == self.file:
            return self
        return next((other for other in self.others if other.file == declaration.span.file), self)

    def find(self, name: Name) -> Found | None:
        """Where a name leads; None where no file in reach declares it."""
        found = self._find(name)
        if found is None and is_common(name):
            found = next((found for other in self.others if (found := other.find(name)) is not None), None)
        return found

    def _find(self, name: Name) -> Found | None:
        if name.declares:
            key = (name.kind, name.scope.module, name.scope.definition, name.text)
            return Found(self._declared.get(key, name), name.span)
        kinds: tuple[Kind, ...] = SHARED if name.kind == "neuron" else (name.kind,)
        for kind in kinds:
            exact = self._declared.get((kind, name.scope.module, name.scope.definition, name.text))
            if exact is not None:
                return Found(exact, name.span)
        for kind in kinds:
            if kind in ("neuron", "instance"):
                counted = self._counted(kind, name.text, name.scope.module)
                if counted is not None:
                    return Found(counted, _head(name, len(counted.text)))
        return None

    def uses(self, declaration: Name) -> Iterator[tuple[Name, Span]]:
        """All names that lead to a declaration, itself among them, with the part that bears the declared name."""
        for name in self.names:
            found = self.find(name)
            if found is not None and same(found.declaration, declaration):
                yield name, found.part

    def attribute(self, declaration: Name, key: str) -> Item | None:
        """The value of a key of what a name declares."""
        return self.home(declaration).values.get((*declaration.item.path, key))

    def value(self, declaration: Name) -> Item | None:
        """The value of what a name declares, where that is a single one."""
        return self.home(declaration).values.get(declaration.item.path)

    def numbers(self, declaration: Name) -> range | None:
        """The numbers of a counted group or instance; None where it is single or has names. An open end is far away."""
        home = self.home(declaration)
        if home is not self:
            return home.numbers(declaration)
        path = declaration.item.path
        if (*path, "count") not in self.keys or not declaration.item.is_key:
            return None
        start = self._integer((*path, "first"), 0 if (*path, "first") in self.keys else 1)
        count = self._integer((*path, "count"), -1)
        if count < 0:
            count = self.sizes.get(declaration.text, 1_000_000) if declaration.scope.module is None else 1_000_000
        return range(start, start + count)

    def _integer(self, path: tuple[str | int, ...], otherwise: int) -> int:
        item = self.values.get(path)
        value = None if item is None else item.scalar.value
        return value if isinstance(value, int) and not isinstance(value, bool) else otherwise

    def _counted(self, kind: Kind, text: str, module: str | None) -> Name | None:
        """The counted group (or instance) of which this is a neuron: the longest name that fits."""
        for length in range(min(len(text), _LONGEST) - 1, 0, -1):
            group = self._declared.get((kind, module, None, text[:length]))
            if group is None or not _NUMBER.fullmatch(text, length):
                continue
            numbers = self.numbers(group)
            if numbers is not None and int(text[length : length + 12]) in numbers:
                return group
        return None

    @cached_property
    def _modules(self) -> Mapping[tuple[str | None, str], str]:
        """The modules of the instances, by the module in which these stand, and their names."""
        result = {}
        for path, item in self.values.items():
            if path[-3:-2] == ("instances",) and path[-1] == "module":
                outer = str(path[1]) if len(path) == 5 and path[0] == "modules" else None
                result[outer, str(path[-2])] = item.text
                listed = (self.values.get((*path[:-1], "names", number)) for number in count())
                result.update({(outer, one.text): item.text for one in takewhile(bool, listed) if one})
        return result

    def module_of(self, instance: str, outer: str | None = None) -> str | None:
        """The module of an instance, or of one of a counted one (``left2``), that stands in the module ``outer``."""
        length = len(instance)
        while length and (outer, instance[:length]) not in self._modules and instance[length - 1].isdigit():
            length -= 1
        found = self._modules.get((outer, instance[:length]))
        if found is None and outer is not None:
            found = next((found for other in self.others if (found := other.module_of(instance, outer))), None)
        return found

    def module_at(self, way: Iterable[str], outer: str | None = None) -> str | None:
        """The module at the end of a way through instances, as ``left1.knee``; ``outer`` where there is none."""
        for instance in way:
            outer = self.module_of(instance, outer)
            if outer is None:
                return None
        return outer

    def _is_signal(self, rule: str, setting: str) -> bool:
        for index in (self, *self.others):
            if ("rules", rule) in index.keys:
                wanted = ("rules", rule, "signals")
                return any(path[:3] == wanted and item.text == setting for path, item in index.values.items())
        return setting in self.builtin_signals.get(rule, ())


def same(one: Name, other: Name) -> bool:
    """Whether two names are one: the same characters of the same file, for the same purpose."""
    return one.span == other.span and one.kind == other.kind


def is_common(name: Name) -> bool:
    """Whether what a name leads to may be declared in another file: a part of a module, or a definition."""
    return name.scope.module is not None or name.scope.definition is not None or name.kind in COMMON


def _head(name: Name, length: int) -> Span:
    """The first characters of a name."""
    return name.span.within(0, length) if name.exact else name.span
