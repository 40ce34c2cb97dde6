"""Names that are used and declared nowhere: one cause, one finding.

In: the findings of a spec that miss a name, the files in which its declaration should stand. Out: one finding for each
name. Where it is used several times, and another one is declared and never used that can only be a slip of it, the
declaration is misspelt, and the finding stands there; else it stands at the first use and says where the others are.

A group with ``count: 6`` that is named K declares the neurons K1 … K6: ``K`` is the *stem* of ``K3``. So a use of K3
may miss a declaration of K3, or, among groups with a count alone (``only_groups``), one of K. Findings are replaced by
``findings.fold``: one takes the place of several, which are known by their marks.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice
from typing import Final, NamedTuple

from neurovis_spec.diagnostics import Diagnostic, Findings, Home, Mark, shorten
from neurovis_spec.language.located import IDENTIFIER
from neurovis_spec.language.yaml.reader import comments
from neurovis_spec.language.yaml.source import AnyList, Mapping, Node, Scalar
from neurovis_spec.likeness import meant, slips

#: The most lines, and the most names, that a message lists.
_SHOWN: Final = 5
#: How many declarations are looked through for one that is never used.
_MOST_DECLARATIONS: Final = 10_000
_WORD: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_REST_OF_LINE: Final = re.compile(r"[^\r\n]*")
_DIGITS: Final = "0123456789"
#: Where a name is used no more often than this, the uses may be the slip.
_FEW_USES: Final = 3
#: A name of so many letters is a slip away from many others.
_SHORT: Final = 3
#: What tells names of one series apart: numbers, and letters by themselves, as in ``h3``, ``gain_b``, ``gainB``.
_MEMBER: Final = re.compile(r"[0-9]+|(?<![A-Za-z])[A-Za-z](?![A-Za-z])|(?<=[a-z])[A-Z](?![A-Za-z])")


class _Use(NamedTuple):
    """A finding that misses a name."""

    mark: Mark
    finding: Diagnostic
    name: str
    #: where it would be declared
    home: Home

    @property
    def stem(self) -> str:
        """Of a neuron the name without the number behind it; of anything else the name."""
        return self.name.rstrip(_DIGITS) if "neurons" in self.home.parts else self.name


def gather_undeclared(files: Collection[Mapping], findings: Findings) -> None:
    """Make one finding of those that miss the same name in a file; of a name that means something else, say what.
    ``files`` are the spec and those that it includes."""
    declarations = _Declarations(files, findings)
    uses = [_Use(mark, finding, *missed) for mark, (finding, missed) in findings.missing().items()]
    for index, use in enumerate(uses):
        hint = _hint_for_other_kind(use, declarations)
        if hint is not None:
            finding = replace(use.finding, hint=hint)
            findings.fold([use.mark], finding)
            uses[index] = use._replace(finding=finding)
    uses = _report_misspelt(uses, declarations, findings)
    groups: dict[tuple[str, Home, str], list[_Use]] = {}
    for use in uses:
        # where K is declared, K7 and K8 are missed each by itself; else both miss K
        name = use.name if use.stem in declarations.stems(use.home) else use.stem
        groups.setdefault((name, use.home, use.finding.span.file), []).append(use)
    for group in groups.values():
        if len(group) > 1:
            findings.fold([use.mark for use in group], _at_first_use(group, declarations.unused_near(group)))


def _hint_for_other_kind(use: _Use, declarations: _Declarations) -> str | None:
    """Of a name in the place of a parameter, that is an input, a neuron or an instance: what to do instead."""
    code, name, within = use.finding.code, use.name, use.home.within
    if code not in ("unknown-name", "unknown-parameter") or use.home.parts != ("parameters",):
        return None
    in_event_or_override = code == "unknown-parameter"
    if any(declared.value == name for declared in declarations.declared_at(Home(within, ("inputs",)))):
        if in_event_or_override:
            return f"'{name}' is an input: let its expression use a parameter, and set that one"
        hint = f"'{name}' is an input, which neurons take in with input: {name}; for a weight that follows it: "
        return f"{hint}a product with a neuron that does (combine: product), or a rule"
    if any(declared.value == name for declared in declarations.declared_at(Home(within, ("neurons", "instances")))):
        if in_event_or_override:
            return f"'{name}' is no parameter: neurons are clamped, with clamp: {{{name}: …}}"
        return f"formulas see no activities: what '{name}' does arrives by a connection"
    return None


def _report_misspelt(uses: list[_Use], declarations: _Declarations, findings: Findings) -> list[_Use]:
    """Report the declarations that are misspelt. Returns the uses of other names, in the order of the text."""
    for only_groups in (True, False):
        groups: dict[tuple[str, tuple[str, ...]], list[_Use]] = {}
        for use in uses:
            groups.setdefault((use.stem if only_groups else use.name, use.home.within), []).append(use)
        uses = []
        for (name, _), group in groups.items():
            declared = declarations.misspelt_for(name, group, only_groups) if len(group) > 1 else None
            if declared is None:
                uses += group
            else:
                findings.fold([use.mark for use in group], _at_declaration(name, declared, group))
    return sorted(uses, key=lambda use: use.finding.span)


def _at_declaration(name: str, declared: Scalar, uses: Sequence[_Use]) -> Diagnostic:
    """The finding at a misspelt declaration, for all uses of what it should be called."""
    here = declared.span
    first = min((use.finding.span for use in uses), key=lambda span: (span.file != here.file, span))
    place = first.seen_from(here) if first.file == here.file else f"{first.file}:{first.line}"
    message = (
        f"'{shorten(name)}' is used {len(uses)} times (first in {place}) and nowhere declared; "
        f"'{declared.value}' is declared and never used"
    )
    hint = f"did you mean '{shorten(name)}'?"
    if len(uses) <= _FEW_USES:
        spans = (use.finding.span for use in uses)
        lines = [span.seen_from(here) if span.file == here.file else f"{span.file}:{span.line}" for span in spans]
        hint += f" or is '{shorten(name)}' ({_first_of(list(dict.fromkeys(lines)))}) meant to be '{declared.value}'?"
    return Diagnostic("misspelt-declaration", message, declared.span, hint=hint)


def _at_first_use(uses: Sequence[_Use], unused: Scalar | None) -> Diagnostic:
    """The finding at the first of the uses, in their order, that says where the others are. ``unused`` is a declaration
    that might be meant."""
    first, others = uses[0].finding, uses[1:]
    names = [f"'{shorten(name)}'" for name in dict.fromkeys(use.name for use in others) if name != uses[0].name]
    spans = (use.finding.span for use in others)
    lines = list(dict.fromkeys(span.seen_from(first.span) for span in spans if span != first.span))
    message = first.message + (f", nor {_first_of(names)}" if names else "")
    count = "one more use" if len(others) == 1 else f"{len(others)} more uses"
    hint = first.hint
    if unused is not None and f"'{unused.value}'" not in (hint or ""):
        line = unused.span.seen_from(first.span) if unused.span.file == first.span.file else f"in {unused.span.file}"
        hint = f"{hint or ''} '{unused.value}' ({line}) is declared and never used".strip()
    return replace(first, message=f"{message}; {count}" + (f": {_first_of(lines)}" if lines else ""), hint=hint)


def _first_of(words: Sequence[str]) -> str:
    """A list of words as a text, cut where it is too long for a message."""
    return ", ".join(words[:_SHOWN]) + (", …" if len(words) > _SHOWN else "")


@dataclass(frozen=True)
class _Declarations:
    """What files declare, and which of it is never used."""

    files: Collection[Mapping]
    findings: Findings

    def stems(self, home: Home) -> frozenset[str]:
        """The names that are declared at a home, without the numbers behind them."""
        return frozenset(str(declared.value).rstrip(_DIGITS) for declared in self.declared_at(home))

    def misspelt_for(self, name: str, uses: Iterable[_Use], only_groups: bool) -> Scalar | None:
        """The declaration, of all or of ``only_groups`` with a count, that can only be this name misspelt."""
        homes = dict.fromkeys(use.home for use in uses)
        declared = dict.fromkeys(scalar for home in homes for scalar in self.declared_at(home, only_groups))
        alike = {str(scalar.value): scalar for scalar in declared if _may_be_slip(name, str(scalar.value))}
        # a name that is used is right
        unused = [other for other, scalar in alike.items() if self._is_unused(scalar)]
        # a single one that is one slip away, else the one that is surely meant
        one_slip_away = [other for other in unused if slips(name, other) < 2]
        misspelt = one_slip_away[0] if len(one_slip_away) == 1 else meant(name, unused) if unused else None
        # where another declared name is as near, used or not, the uses may be a slip of that one
        if misspelt is None or any(slips(name, other) <= slips(name, misspelt) for other in alike if other != misspelt):
            return None
        return alike[misspelt]

    def unused_near(self, uses: Sequence[_Use]) -> Scalar | None:
        """The first declaration that is never used, and is a slip away from the name of these uses."""
        name, homes = uses[0].name, dict.fromkeys(use.home for use in uses)
        declared = (scalar for home in homes for scalar in self.declared_at(home))
        close = (scalar for scalar in declared if len(name) > 1 and slips(name, str(scalar.value)) < 2)
        return next((scalar for scalar in close if self._is_unused(scalar)), None)

    def declared_at(self, home: Home, only_groups: bool = False) -> Iterator[Scalar]:
        """What is declared at a home, or of it only the groups with a count."""
        found = (
            scalar
            for file in self.files
            for part in home.parts
            for scalar in _declared(file, home.within, part, only_groups)
        )
        return islice(found, _MOST_DECLARATIONS)

    def _is_unused(self, declared: Scalar) -> bool:
        name = str(declared.value)
        uses = self._words[name] if IDENTIFIER.fullmatch(name) else sum(text.count(name) for text in self._source_texts)
        # the one occurrence is its own declaration
        return uses == 1 and not self.findings.is_invalid(declared.span)

    @cached_property
    def _source_texts(self) -> tuple[str, ...]:
        """The texts of all files without their comments."""
        return tuple(_without_comments(text) for text in self.findings.sources.values())

    @cached_property
    def _words(self) -> Counter[str]:
        """How often each name occurs; one with a number behind it is one of its group, too."""
        words = Counter(word for text in self._source_texts for word in _WORD.findall(text))
        for word, times in list(words.items()):
            stem = word.rstrip(_DIGITS)
            words[stem] += times if stem != word else 0
        return words


def _may_be_slip(name: str, other: str) -> bool:
    """Whether one name may be the other one misspelt: neither is short, and they are no two of a series."""
    letters = min(sum(letter.isalpha() for letter in one) for one in (name, other))
    return letters > _SHORT and _MEMBER.sub("", name) != _MEMBER.sub("", other)


def _without_comments(text: str) -> str:
    parts, at = list[str](), 0
    for begin in comments(text):
        parts.append(text[at:begin])
        end = _REST_OF_LINE.match(text, begin)
        at = begin if end is None else end.end()
    return "".join([*parts, text[at:]])


def _declared(file: Mapping, within: tuple[str, ...], part: str, only_groups: bool) -> Iterator[Scalar]:
    """The names that a part of a mapping declares, or of these only those of groups with a count."""
    node: Node | None = file
    for key in (*within, *part.split(".")):
        node = node.get(key) if isinstance(node, Mapping) else None
    if not only_groups and isinstance(node, AnyList):
        yield from _string_items(node)
    for entry in node.entries if isinstance(node, Mapping) else ():
        keys = entry.value if isinstance(entry.value, Mapping) else None
        if not only_groups or (keys is not None and keys.entry("count") is not None):
            yield entry.key
        if not only_groups and part == "neurons" and keys is not None:
            yield from _string_items(keys.get("names"))


def _string_items(node: Node | None) -> Iterator[Scalar]:
    for item in node.items if isinstance(node, AnyList) else ():
        if isinstance(item, Scalar) and isinstance(item.value, str):
            yield item
