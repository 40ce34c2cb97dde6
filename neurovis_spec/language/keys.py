"""Keys: compares the keys of a mapping with those that the language knows there.

In: a Mapping as written. Out: the same, in which a misspelt key is reported and renamed to the one key that it can be
meant for; so its value is checked as well, and what it declares is not reported as missing elsewhere.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator
from collections.abc import Mapping as AnyMapping
from types import MappingProxyType
from typing import Final, NamedTuple

from neurovis_spec.diagnostics import Findings, Home, Undeclared, shorten
from neurovis_spec.language.unknown import UNKNOWN, Names, Unknown
from neurovis_spec.language.yaml.source import Entry, Mapping, Scalar
from neurovis_spec.likeness import did_you_mean, meant, nearest, slips, suggest

_NAMES: Final = r"[A-Za-z_][\w.]*(?: *(?:->|\+) *[A-Za-z_][\w.]*)*"
_APART: Final = re.compile(
    rf"(?P<key>{_NAMES})"
    r"(?: *(?P<sign>=(?!=)|:(?=\S)) *(?P<value>.+)| +(?P<word>[^\s\[{+*/%^<>=!-]\S*)| *(?P<more>[\[{].*|- .*))",
    re.ASCII | re.DOTALL,
)
#: A key behind which a bracket opens.
_OPENED: Final = re.compile(rf"(?P<key>{_NAMES}) *(?P<sign>:?)(?P<rest>[\[{{].*)", re.ASCII | re.DOTALL)


class Keys(NamedTuple):
    """A mapping whose unknown keys were reported. ``unknown`` are known keys that one of these may be meant for: it
    cannot be said whether they are given, and with which value."""

    mapping: Mapping
    unknown: frozenset[str]

    def lack(self, name: str) -> bool:
        """Whether a key is surely not there."""
        return self.mapping.entry(name) is None and name not in self.unknown


class Words(NamedTuple):
    """What is said of an unknown key. ``foreign``: the message and the hint for one that is no misspelling; ``home``: a
    hint for one that is like none of the known ones; ``elsewhere``: what other languages call the known ones."""

    foreign: Callable[[str], tuple[str, str | None] | None] = lambda name: None
    home: Callable[[str], str | None] = lambda name: None
    elsewhere: AnyMapping[str, str] = MappingProxyType({})


def read_keys(data: Mapping, known: Collection[str], findings: Findings, words: Words | None = None) -> Keys:
    """Report the unknown keys of a mapping."""
    data = mend_torn(data, "unknown-key", findings)
    unknown = {name for name in known if data.entry(name) is None} if data.is_open else set[str]()
    if all(entry.name in known for entry in data.entries):
        return Keys(data, frozenset(unknown))
    mapping = Mapping(tuple(_read(data, known, findings, words or Words(), unknown)), data.span, data.is_open)
    return Keys(mapping, frozenset(unknown))


def _read(
    data: Mapping, known: Collection[str], findings: Findings, words: Words, unknown: set[str]
) -> Iterator[Entry]:
    free = {name: None for name in known if data.entry(name) is None}  # what is there already is not meant
    for entry in data.entries:
        name, span = entry.name, entry.key.span
        foreign = None if name in known else words.foreign(name) or _joined(entry, known)
        right = None
        if foreign is not None:
            findings.error("unknown-key", span, *foreign)
            unknown.update({name if (parts := apart(name)) is None else parts.key} & set(known))
        elif name not in known and findings.many:
            findings.error("unknown-key", span, _unknown(name))
        elif words.elsewhere.get(name.casefold()) in free and name not in known:
            right = words.elsewhere[name.casefold()]
            findings.error("unknown-key", span, _unknown(name), did_you_mean([right]))
        elif name not in known:
            close = nearest(name, known)
            # a key of another place is hardly a misspelling by two slips
            home = None if any(slips(name, one) == 1 for one in close) else words.home(name)
            hint, right = home, None if home else meant(name, free)
            if home is None and close:
                hint = did_you_mean(sorted(close, key=lambda one: one not in free))
            findings.error("unknown-key", span, _unknown(name), hint or suggest(name, known, "known here"))
            if right is None:
                unknown.update(close)
        if right is not None:
            del free[right]
        yield entry if right is None else Entry(entry.key._replace(value=right, inner=None, written=None), entry.value)


def settings_of(
    settings: Mapping,
    known: Collection[str],
    what: str,
    none: str,
    findings: Findings,
    home: Home | None = None,
) -> Names[Entry]:
    """The settings of a definition or a pattern by the names that it knows, which are declared at ``home``. An unknown
    one (of ``what``; ``none`` is said where none are known) is reported, and taken for the one that it can only be
    meant for; those that it may be meant for are UNKNOWN."""
    found: dict[str, Entry | Unknown] = {entry.name: entry for entry in settings.entries if entry.name in known}
    for entry in settings.entries:
        if entry.name in known:
            continue
        hint = suggest(entry.name, known, "known here") or none
        message = f"there is no {what} '{shorten(entry.name)}'"
        lost = None if home is None else Undeclared(entry.name, home)
        findings.error("unknown-parameter", entry.key.span, message, hint, undeclared=lost)
        free = [name for name in known if found.get(name, UNKNOWN) is UNKNOWN]
        right = meant(entry.name, free)
        found.update(dict.fromkeys(nearest(entry.name, free), UNKNOWN) if right is None else {right: entry})
    return Names(found, settings.is_open)


class Apart(NamedTuple):
    """A key and its value that YAML reads otherwise, what is wrong between them, and what to write."""

    key: str
    value: str
    message: str
    hint: str | None

    @property
    def told(self) -> str:
        """Both in one."""
        return self.message if self.hint is None else f"{self.message}: {self.hint}"


def apart(text: str) -> Apart | None:
    """A text that is a key and a value all the same: ``bias:1``, ``bias = 1``, ``bias 1``, ``A -> B [1]``.

    >>> print(apart("bias:1").told, "|", apart("A -> B 1").told, "|", apart("a text of words"))
    a blank is missing after 'bias:': write bias: 1 | ':' is missing after 'A -> B': write A -> B: 1 | None
    """
    match = _APART.fullmatch(text)
    if match is None:
        return None
    key, sign, value = match["key"], match["sign"], match["value"] or match["word"] or match["more"]
    return _apart(key, sign or "", value)


def _apart(key: str, sign: str, value: str) -> Apart:
    name = shorten(key)
    message = f"':' is missing after '{name}'"
    if sign:
        message = f"a blank is missing after '{name}:'" if sign == ":" else f"'=' stands behind '{name}' for ':'"
    hint = None if value.startswith("- ") else f"write {shorten(f'{key}: {value}', 60)}"
    return Apart(key, value, message, hint)


def mend_torn(data: Mapping, code: str, findings: Findings) -> Mapping:
    """A mapping in which an entry without a colon behind its key is that key: of ``A {bias: 1}`` YAML makes the key
    ``A {bias`` and the text ``1}``. It is reported, and its value unread."""
    if not any("{" in entry.name or "[" in entry.name for entry in data.entries):
        return data
    found = [(entry, _torn(entry)) for entry in data.entries]
    if all(parts is None for _, parts in found):
        return data
    entries = []
    for entry, parts in found:
        if parts is not None:
            findings.error(code, entry.key.span, parts.message, parts.hint)
            findings.unread(entry.value.span)
            key = entry.key._replace(value=parts.key, inner=None)
            entry = Entry(key, Scalar(True, entry.value.span, None))
        entries.append(entry)
    return Mapping(tuple(entries), data.span, data.is_open)


def _torn(entry: Entry) -> Apart | None:
    """The key and the value of an entry whose key, as YAML takes it, opens a bracket that its value closes."""
    value, match = entry.value, _OPENED.fullmatch(entry.name) if entry.key.inner == 0 else None
    if match is None or not isinstance(value, Scalar) or not isinstance(value.value, str) or value.inner != 0:
        return None
    opening, closing = match["rest"][0], "}" if match["rest"][0] == "{" else "]"
    if entry.name.count(opening) <= entry.name.count(closing) or value.value.count(opening) >= value.value.count(
        closing
    ):
        return None
    return _apart(match["key"], match["sign"], f"{match['rest']}: {value.value}")


def joined(entry: Entry) -> Apart | None:
    """The key and the value that YAML reads as a key without a value."""
    value = entry.value
    return apart(entry.name) if isinstance(value, Scalar) and value.value is None else None


def _joined(entry: Entry, known: Collection[str]) -> tuple[str, str | None] | None:
    """What is said of a key and a value that YAML reads as one word: a message and a hint."""
    found = joined(entry)
    return None if found is None or found.key not in known else (_unknown(entry.name), found.told)


def _unknown(name: str) -> str:
    return f"unknown key '{shorten(name)}'"
