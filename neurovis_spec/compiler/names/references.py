"""What references name: from ``K``, ``K3``, ``K3..K5`` or ``K1 + O`` to neuron indices.

In: the groups and neuron names of a network. Out: tuples of indices, or a finding with the nearest known names.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import chain, islice
from typing import TypeAlias

from neurovis_spec.compiler.limits import PATIENCE
from neurovis_spec.compiler.network import Group
from neurovis_spec.diagnostics import Findings, Home, Span, Undeclared, listed, shorten
from neurovis_spec.language.located import IDENTIFIER, Located
from neurovis_spec.language.modules import ModuleModel
from neurovis_spec.language.references import (
    Arrow,
    NeuronRange,
    NoReference,
    Part,
    StateName,
    Sum,
    parse,
    parse_sum,
    state_of,
)
from neurovis_spec.language.spec import Spec
from neurovis_spec.language.unknown import UNKNOWN, Names, Unknown
from neurovis_spec.language.yaml.source import Mapping as SourceMapping
from neurovis_spec.language.yaml.source import Scalar
from neurovis_spec.likeness import did_you_mean, meant, nearest, suggest

#: What declares neurons, inputs and connections: a spec, or a module.
Section: TypeAlias = Spec | ModuleModel
#: How many names are looked through for one that is like another: it takes a while.
_MANY = 10_000
#: A neuron's number as its name has it: without leading zeros.
_NUMBER = re.compile(r"0|[1-9][0-9]{0,63}")
#: Two names with something between them that is no arrow, two neurons of a group, and what no name holds.
_JOINED = re.compile(r"([\w.]+) *(=>|<-|<=|--+>|- +>|->>|>|→|[‐‑‒–—−] *>|\bto\b) *([\w.]+)")
_FROM_TO = re.compile(r"([A-Za-z_][\w.]*?)([0-9]+) *(?:-|:|–|…|\.\.\.|to) *(?:\1)?([0-9]+)")
_FORMULA = re.compile(r"[*/^()%]|\d *[-+]|[-+] *\d")
_PATH = re.compile(r"[A-Za-z_]\w*(?:/[A-Za-z_]\w*)+")
_DOTTED = re.compile(rf"{IDENTIFIER.pattern}(?:\.{IDENTIFIER.pattern})+")
_QUOTED = re.compile(r"'([^']*)'")


@dataclass(frozen=True)
class Directory:
    """Who is called what in a spec, or in an instance of a module: groups, neurons and instances by the names that they
    have there. What may be named by an invalid declaration is UNKNOWN."""

    groups: Mapping[str, Group]
    neurons: Mapping[str, int]
    #: the number of the first neuron of each counted group
    first: Mapping[str, int]
    #: the groups and instances of which it is not known which neurons they have
    invalid: Names[Group] = field(default_factory=Names)
    #: the instances of a name: all of a counted one, each also by its own name
    instances: Mapping[str, tuple[Directory, ...]] = field(default_factory=dict)
    #: all neurons, those of the instances behind its own
    members: range = range(0)
    #: the inputs that are declared there
    inputs: Collection[str] = ()
    #: the place of its scope among all
    scope: int = 0
    #: the module that it is of
    module: str | None = None
    #: the states that the models of groups have
    states: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @cached_property
    def known(self) -> tuple[str, ...]:
        """Every name that a reference may use; groups first."""
        return tuple(dict.fromkeys([*self.groups, *self.neurons]))

    def name_of_state(self, part: Part) -> StateName | None:
        """A reference that is to a state, and to no neuron or range of neurons."""
        name = state_of(part)
        if name is None or isinstance(name.owner, Arrow):
            return name
        if self.holds(part.text) or self.instance(part.text):
            return None
        owner = name.owner.text
        return None if self.instance(owner) or owner in self.instances else name

    def hint(self, name: str) -> str | None:
        """What an unknown name may be meant for: the nearest names, and the numbers that its group has."""
        head, dot, rest = name.partition(".")
        if dot and head in self.instances:
            hint = self.instances[head][0].hint(rest)
            return None if hint is None else _QUOTED.sub(rf"'{head}.\1'", hint)
        if dot:
            return self._hint_of_instance(head, rest)
        hint = suggest(name, few(name, self.known), "groups and neurons")
        if self.instances and not nearest(name, few(name, self.known)):
            inside = few(name, tuple(self.instances))
            hint = suggest(name, inside, "instances") if not self.known or nearest(name, inside) else hint
        stem = name.rstrip("0123456789")
        if stem in self.first and stem != name:
            first = self.first[stem]
            numbers = f"'{stem}' has the numbers {first} to {first + self.groups[stem].count - 1}"
            hint = numbers if hint is None else f"{hint} {numbers}"
        return hint

    def _hint_of_instance(self, head: str, rest: str) -> str:
        """What ``head`` in ``head.rest`` may be meant for."""
        if self.holds(head):
            if rest in self._states_of(head):
                seen = f"write '{head}', and at a connection that takes {rest} of it send: {rest}"
                return f"{rest} is a state of '{head}', and neurons are named here: {seen}"
            return f"'{head}' is no instance, nothing is in it"
        if not self.instances:
            return "there are no instances here"
        stem = head.rstrip("0123456789")
        if stem in self.instances and f"{stem}1" in self.instances:
            return f"'{stem}' has the numbers 1 to {len(self.instances[stem])}"
        close = nearest(head, few(head, tuple(self.instances)))
        whole = [f"{name}.{rest}" for name in close if self.holds(f"{name}.{rest}")]
        return did_you_mean(whole) if whole else suggest(head, few(head, tuple(self.instances)), "instances") or ""

    def _states_of(self, name: str) -> tuple[str, ...]:
        """The states of a group's model, or of that of a neuron's group."""
        if name in self.groups:
            return self.states.get(name, ())
        index = self.neurons.get(name, -1)
        return next((self.states.get(own, ()) for own, group in self.groups.items() if index in group.indices), ())

    def find(self, name: str) -> tuple[int, ...] | Unknown | None:
        """The neurons of a group, or one neuron; ``left.K`` is K in all instances that ``left`` names. None where there
        is nothing of that name."""
        head, dot, rest = name.partition(".")
        if dot and head in self.instances:
            found = [inner.find(rest) for inner in self.instances[head]]
            known = [one for one in found if isinstance(one, tuple)]
            if len(known) == len(found):
                return tuple(chain.from_iterable(known))
            return UNKNOWN if UNKNOWN in found else None
        if name in self.groups:
            return tuple(self.groups[name].indices)
        if name in self.neurons:
            return (self.neurons[name],)
        return UNKNOWN if self.invalid.may_make(head) else None

    def holds(self, name: str) -> bool:
        """Whether neurons are called so, and it is known which."""
        return isinstance(self.find(name), tuple)

    def meant(self, name: str) -> str | None:
        """The name that an unknown one can only be meant for."""
        head, dot, rest = name.partition(".")
        if not dot:
            return meant(name, few(name, self.known))
        if head not in self.instances:
            right = meant(head, few(head, tuple(self.instances)))
            return f"{right}.{rest}" if right is not None and self.holds(f"{right}.{rest}") else None
        right = self.instances[head][0].meant(rest)
        return None if right is None else f"{head}.{right}"

    def misses(self, name: str) -> bool:
        """Whether there is nothing that a name, or a number of its group, could be of."""
        head, dot, rest = name.partition(".")
        if dot:
            return head not in self.instances or self.instances[head][0].misses(rest)
        return name not in self.instances and name.rstrip("0123456789") not in self.groups and self.find(name) is None

    def undeclared(self, name: str) -> Undeclared:
        """Of a name that is unknown the part that is declared nowhere, and where it should be."""
        head, dot, rest = name.partition(".")
        if dot and head in self.instances:
            return self.instances[head][0].undeclared(rest)
        return Undeclared(head, home_of(self.module))

    def instance(self, name: str) -> tuple[Directory, ...]:
        """The instances that a name means; none where it means something else, or nothing."""
        head, dot, rest = name.partition(".")
        found = self.instances.get(head, ())
        return tuple(one for inner in found for one in inner.instance(rest)) if dot else found

    def feeds(self, name: str) -> bool:
        """Whether a name is that of an input, of this place or of an instance within it."""
        head, dot, rest = name.partition(".")
        return any(inner.feeds(rest) for inner in self.instances.get(head, ())) if dot else name in self.inputs

    def range(self, low: str, high: str) -> tuple[int, ...] | Unknown | str:
        """The neurons of a counted group from one of its numbers to another; a text says why not."""
        found = self._range(low, high)
        return UNKNOWN if isinstance(found, str) and self.find(low) is UNKNOWN else found

    def _range(self, low: str, high: str) -> tuple[int, ...] | str:
        """As ``range``, but that a text also says why not where the declaration is invalid."""
        head, dot, rest = low.partition(".")
        if dot:
            if head not in self.instances:
                return f"there is no instance '{shorten(head)}'"
            found = [inner._range(rest, high.removeprefix(f"{head}.")) for inner in self.instances[head]]
            wrong = next((one for one in found if isinstance(one, str)), None)
            return wrong or tuple(index for one in found if not isinstance(one, str) for index in one)
        for name in sorted((g for g in self.first if low.startswith(g)), key=len, reverse=True):
            start, stop = low[len(name) :], high[len(name) :]
            if not (high.startswith(name) and _NUMBER.fullmatch(start) and _NUMBER.fullmatch(stop)):
                continue
            group, first = self.groups[name], self.first[name]
            a, b = int(start) - first, int(stop) - first
            if not (0 <= a < group.count and 0 <= b < group.count):
                last = first + group.count - 1
                return f"'{name}' has the numbers {first} to {last}"
            if a > b:
                return "the range runs backwards"
            return tuple(range(group.start + a, group.start + b + 1))
        if self.misses(low):
            return f"there is no neuron '{shorten(low)}'"
        return "both ends of a range must be neurons of one counted group"


def home_of(module: str | None, parts: tuple[str, ...] = ("neurons", "instances", "inputs")) -> Home:
    """Where names of a spec, or of a module, are declared: those that groups, instances and inputs share, or others."""
    return Home(() if module is None else ("modules", module), parts)


def few(name: str, known: Collection[str]) -> Collection[str]:
    """The names among which to look for one like ``name``: of very many those that begin like it."""
    if len(known) <= _MANY:
        return known
    begin = name[: max(1, len(name.rstrip("0123456789")) // 2)]
    return tuple(islice((other for other in known if other.startswith(begin)), _MANY))


def known_inputs(name: str, known: Collection[str]) -> str:
    """A help line for an input that is not declared; ``known`` are those that are."""
    if _DOTTED.fullmatch(name):
        return "an input is declared under 'inputs'; activities of neurons arrive by connections"
    if not IDENTIFIER.fullmatch(name):
        return f"name it under 'inputs', as in wave: {{expression: {shorten(name)}}}"
    return suggest(name, few(name, known), "inputs") or "no inputs are declared; add it under 'inputs'"


def other_parameter(name: str, known: Collection[str]) -> str:
    """A help line for a parameter that cannot be set as there is none of that name; ``known`` are the spec's own."""
    there = "the spec has no parameters" if not known else f"parameters of the spec: {listed(known)}"
    if "." in name:
        instance, _, own = name.partition(".")
        where = f"{instance}: {{set: {{{own}: …}}}}"
        return f"parameters of a module are set at its instance, as in {where}; {there}"
    return suggest(name, known, "parameters") or there


def key_of(section: SourceMapping, part: str, name: str) -> Located[str]:
    """The key ``name`` of the part ``part`` of a section, as a text with its place; the section's where it has none."""
    node = section.get(part)
    entry = node.entry(name) if isinstance(node, SourceMapping) else None
    return Located(name, Scalar(name, section.span) if entry is None else entry.key)


def key_span(section: Section, part: str, name: str) -> Span:
    """Where an entry of a part of a section has its name."""
    return key_of(section.source, part, name).span


def check_keys(
    section: SourceMapping, part: str, kept: Collection[str], directory: Directory, findings: Findings
) -> None:
    """The references that are keys of a part of a section and whose values are invalid, which ``kept`` are not."""
    node = section.get(part)
    for entry in node.entries if isinstance(node, SourceMapping) else ():
        if entry.name not in kept and not directory.instance(entry.name):
            resolve_end(Located(entry.name, entry.key), directory, findings)


def resolve_part(part: Part, text: Located[str], directory: Directory, findings: Findings) -> tuple[int, ...] | Unknown:
    """One reference within a text: a group, a neuron or a range."""
    span = text.node.at(part.start, part.end)
    if isinstance(part, NoReference):
        findings.error(part.code, span, part.message, part.hint)
        return UNKNOWN
    if isinstance(part, NeuronRange):
        found = directory.range(part.low.text, part.high.text)
        if isinstance(found, str):
            hint = _range_help(part.low.text, part.high.text, directory)
            lost = directory.undeclared(part.low.text) if directory.misses(part.low.text) else None
            message = f"'{shorten(part.text)}' is no range: {found}"
            findings.error("bad-range", span, message, hint, undeclared=lost)
        return UNKNOWN if isinstance(found, str) else found
    result = directory.find(part.text)
    if result is None:
        right = None if findings.many else directory.meant(part.text)
        _report_unknown(part.text, span, directory, findings)
        result = None if right is None else directory.find(right)
    return UNKNOWN if result is None else result


def _range_help(low: str, high: str, directory: Directory) -> str | None:
    """A help line for ends between which there is no range."""
    if high.isdecimal():
        whole = f"{low}..{low.rstrip('0123456789')}{high}"
        return f"write {shorten(whole, 200)}"
    instance, _, own = high.partition(".")
    if own and directory.instance(low) and directory.instance(instance):
        return f"name each instance, as in {low}.{own} + {high}"
    return None


def _report_unknown(name: str, span: Span, directory: Directory, findings: Findings) -> None:
    """Report a name that is no neuron or group: it is an instance, an input, a connection, or nothing."""
    inside = directory.instance(name)
    if inside:
        some = next(iter((*inside[0].groups, *inside[0].instances)), None)
        hint = None if some is None else f"name a group or a neuron in it, as in {name}.{some}"
        findings.error("unknown-neuron", span, f"'{shorten(name)}' is an instance, not a neuron", hint)
        return
    if directory.feeds(name):
        path, dot, own = name.rpartition(".")
        hint = f"connect a neuron that takes it in: {{input: {own}}}{f' in the module of {path!r}' if dot else ''}"
        findings.error("unknown-neuron", span, f"'{shorten(name)}' is an input, not a neuron", hint)
        return
    if "->" in name:
        message = f"'{shorten(name)}' is a connection, and neurons are wanted here"
        findings.error("unknown-neuron", span, message, "name a group, a neuron or a range")
        return
    message = f"there is no neuron or group '{shorten(name)}'"
    lost = directory.undeclared(name)
    findings.error("unknown-neuron", span, message, lambda: _several(name) or directory.hint(name), undeclared=lost)


def _several(name: str) -> str | None:
    """How several references are joined, or a range is written, where a text has them in another way."""
    parts = [part.strip() for part in name.strip("[]{}() ").split(",")]
    whole = " + ".join(map(shorten, parts))
    if len(parts) > 1 and all(parts):
        return f"references are joined with '+': {shorten(whole, 200)}"
    if match := _FROM_TO.fullmatch(name):
        return f"a range is written {match[1]}{match[2]}..{match[1]}{match[3]}"
    if _PATH.fullmatch(name):
        return f"parts of instances are named with points: {name.replace('/', '.')}"
    if _FORMULA.search(name) and any(map(str.isalnum, name)):
        return "a name is wanted here: what is computed of activities is a neuron of its own"
    return None


def resolve(
    texts: Iterable[Located[str]], directory: Directory, findings: Findings, *, instances: bool = False
) -> tuple[int, ...] | Unknown:
    """Several references, in the order written; a neuron named twice is a finding. With ``instances`` the name of an
    instance stands for all of its neurons."""
    return _resolve([(part, text) for text in texts for part in parse_sum(text.value)], directory, findings, instances)


def resolve_end(text: Located[str], directory: Directory, findings: Findings) -> tuple[int, ...] | Unknown:
    """References joined with ``+``."""
    return resolve((text,), directory, findings)


def resolve_sum(found: Sum, text: Located[str], directory: Directory, findings: Findings) -> tuple[int, ...] | Unknown:
    """References joined with ``+`` within a text: an end of a connection."""
    return _resolve([(part, text) for part in found.parts], directory, findings)


def arrow_of(text: Located[str], findings: Findings) -> Arrow | Unknown:
    """A text that is to name connections, taken apart; UNKNOWN, and a finding, where it is no ``FROM -> TO``."""
    found = parse(text.value)
    if isinstance(found, Arrow):
        return found
    hint = found.hint if isinstance(found, NoReference) else _as_arrow(text.value) or "write FROM -> TO"
    findings.error("bad-connection", text.span, f"'{shorten(text.value)}' is no connection", hint)
    return UNKNOWN


def _as_arrow(text: str) -> str | None:
    """How to write what joins two names in another way."""
    match = _JOINED.fullmatch(text.strip())
    if match is None:
        return None
    first, sign, second = match.groups()
    return f"write {second} -> {first}" if sign in ("<-", "<=") else f"write {first} -> {second}"


def _resolve(
    written: Iterable[tuple[Part, Located[str]]], directory: Directory, findings: Findings, instances: bool = False
) -> tuple[int, ...] | Unknown:
    """The neurons of parts of texts, in the order written; UNKNOWN where one is invalid, or names neurons that are
    named before it. With ``instances`` the name of an instance stands for all of its neurons."""
    result: list[int] = []
    seen: set[int] = set()
    before = findings.errors
    failed = False
    for part, text in written:
        if findings.errors - before >= PATIENCE:
            return UNKNOWN
        inside = directory.instance(part.text) if instances else ()
        found: tuple[int, ...] | Unknown = tuple(index for one in inside for index in one.members)
        if not inside:
            found = resolve_part(part, text, directory, findings)
        if found is UNKNOWN:
            failed = True
            continue
        if not seen.isdisjoint(found):
            span = text.node.at(part.start, part.end)
            findings.error("repeated-reference", span, f"'{shorten(part.text)}' names neurons that are named before it")
            failed = True
        seen.update(found)
        result.extend(found)
    return UNKNOWN if failed else tuple(result)
