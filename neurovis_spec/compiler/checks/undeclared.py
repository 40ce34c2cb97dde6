"""Names that are used and declared nowhere: one cause, one finding.

In: the findings of a spec that miss a name, the files in which its declaration should stand. Out: one finding for each
name. Where it is used several times, and another one like it is declared and never used, the declaration is misspelt,
and the finding stands there; else it stands at the first use and says where the others are.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice
from typing import Final, NamedTuple

from neurovis_spec.diagnostics import Diagnostic, Findings, Home, Mark, meant, shorten, slips
from neurovis_spec.language.located import IDENTIFIER
from neurovis_spec.language.yaml.reader import comments
from neurovis_spec.language.yaml.source import AnyList, Mapping, Node, Scalar

#: The most lines, and the most names, that a message lists.
_SHOWN: Final = 5
#: How many declarations are looked through for one that is never used.
_MANY: Final = 10_000
_WORD: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_REST_OF_LINE: Final = re.compile(r"[^\r\n]*")
_DIGITS: Final = "0123456789"


class _Use(NamedTuple):
    """A finding that misses a name."""

    mark: Mark
    told: Diagnostic
    name: str
    home: Home

    @property
    def stem(self) -> str:
        """The counted declaration that would make a name with a number behind it."""
        return self.name.rstrip(_DIGITS) if "neurons" in self.home.parts else self.name


def gather_undeclared(files: Collection[Mapping], findings: Findings) -> None:
    """Make one finding of those that miss the same name in a file. ``files`` are the spec and those that it
    includes."""
    uses = [_Use(mark, told, *lost) for mark, (told, lost) in findings.missing().items()]
    if len(uses) < 2:
        return
    declarations = _Declarations(files, findings)
    uses = _without_misspelt(uses, declarations, findings)
    groups: dict[tuple[str, Home, str], list[_Use]] = {}
    for use in uses:
        name = use.name if use.stem in declarations.stems(use.home) else use.stem
        groups.setdefault((name, use.home, use.told.span.file), []).append(use)
    for group in groups.values():
        if len(group) > 1:
            findings.fold([use.mark for use in group], _at_first_use(group))


def _without_misspelt(uses: list[_Use], declarations: _Declarations, findings: Findings) -> list[_Use]:
    """Report the declarations that are misspelt; the uses of other names."""
    for counted in (True, False):
        groups: dict[tuple[str, tuple[str, ...]], list[_Use]] = {}
        for use in uses:
            groups.setdefault((use.stem if counted else use.name, use.home.within), []).append(use)
        uses = []
        for (name, _), group in groups.items():
            declared = declarations.like(name, group, counted) if len(group) > 1 else None
            if declared is None:
                uses += group
            else:
                findings.fold([use.mark for use in group], _at_declaration(name, declared, group))
    return sorted(uses, key=lambda use: use.told.span)


def _at_declaration(name: str, declared: Scalar, uses: Sequence[_Use]) -> Diagnostic:
    here = declared.span
    first = min((use.told.span for use in uses), key=lambda span: (span.file != here.file, span))
    place = first.seen_from(here) if first.file == here.file else f"{first.file}:{first.line}"
    message = (
        f"'{shorten(name)}' is used {len(uses)} times (first in {place}) and nowhere declared; "
        f"'{declared.value}' is declared and never used"
    )
    return Diagnostic("misspelt-declaration", message, declared.span, hint=f"did you mean '{shorten(name)}'?")


def _at_first_use(uses: Sequence[_Use]) -> Diagnostic:
    """The finding at the first of the uses, in their order, that says where the others are."""
    first, others = uses[0].told, uses[1:]
    names = [f"'{shorten(name)}'" for name in dict.fromkeys(use.name for use in others) if name != uses[0].name]
    lines = list(dict.fromkeys(use.told.span.seen_from(first.span) for use in others))
    message = first.message + (f", nor {_some(names)}" if names else "")
    count = "one more use" if len(others) == 1 else f"{len(others)} more uses"
    return replace(first, message=f"{message}; {count}: {_some(lines)}")


def _some(words: Sequence[str]) -> str:
    return ", ".join(words[:_SHOWN]) + (", …" if len(words) > _SHOWN else "")


@dataclass(frozen=True)
class _Declarations:
    """What files declare, and which of it is never used."""

    files: Collection[Mapping]
    findings: Findings

    def stems(self, home: Home) -> frozenset[str]:
        """The names that are declared at a home, without the numbers behind them."""
        return frozenset(str(declared.value).rstrip(_DIGITS) for declared in self._at(home, counted=False))

    def like(self, name: str, uses: Iterable[_Use], counted: bool) -> Scalar | None:
        """The declaration that is never used and can only be meant for this name. ``counted``: it makes several."""
        homes = dict.fromkeys(use.home for use in uses)
        declared = dict.fromkeys(one for home in homes for one in self._at(home, counted))
        unused = {str(one.value): one for one in declared if self._unused(one)}
        near = [other for other in unused if len(name) > 1 and slips(name, other) < 2]
        right = near[0] if len(near) == 1 else meant(name, unused) if unused else None
        return None if right is None else unused[right]

    def _at(self, home: Home, counted: bool) -> Iterator[Scalar]:
        found = (
            one for file in self.files for part in home.parts for one in _declared(file, home.within, part, counted)
        )
        return islice(found, _MANY)

    def _unused(self, declared: Scalar) -> bool:
        name = str(declared.value)
        uses = self._words[name] if IDENTIFIER.fullmatch(name) else sum(text.count(name) for text in self._texts)
        return uses == 1 and not self.findings.is_invalid(declared.span)

    @cached_property
    def _texts(self) -> tuple[str, ...]:
        return tuple(_without_comments(text) for text in self.findings.sources.values())

    @cached_property
    def _words(self) -> Counter[str]:
        """How often each name occurs; one with a number behind it is one of its group, too."""
        words = Counter(word for text in self._texts for word in _WORD.findall(text))
        for word, times in list(words.items()):
            stem = word.rstrip(_DIGITS)
            words[stem] += times if stem != word else 0
        return words


def _without_comments(text: str) -> str:
    parts, at = list[str](), 0
    for begin in comments(text):
        parts.append(text[at:begin])
        end = _REST_OF_LINE.match(text, begin)
        at = begin if end is None else end.end()
    return "".join([*parts, text[at:]])


def _declared(file: Mapping, within: tuple[str, ...], part: str, counted: bool) -> Iterator[Scalar]:
    """The names that a part of a mapping declares: all, or those that make several with numbers behind."""
    node: Node | None = file
    for key in (*within, *part.split(".")):
        node = node.get(key) if isinstance(node, Mapping) else None
    if not counted and isinstance(node, AnyList):
        yield from _texts(node)
    for entry in node.entries if isinstance(node, Mapping) else ():
        keys = entry.value if isinstance(entry.value, Mapping) else None
        if not counted or (keys is not None and keys.entry("count") is not None):
            yield entry.key
        if not counted and part == "neurons" and keys is not None:
            yield from _texts(keys.get("names"))


def _texts(node: Node | None) -> Iterator[Scalar]:
    for item in node.items if isinstance(node, AnyList) else ():
        if isinstance(item, Scalar) and isinstance(item.value, str):
            yield item
