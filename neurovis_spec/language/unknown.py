"""Unknown: what anything is worth whose declaration, size or formula is invalid. One cause, one finding.

What is invalid is reported once, where it stands, and is UNKNOWN from there on: what is made of it is UNKNOWN as well,
and a rule speaks of what it knows alone. So a name whose declaration is invalid is found, and nobody complains of it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from enum import Enum
from typing import Final, Literal, TypeAlias, TypeVar

T = TypeVar("T")
Other = TypeVar("Other")


class _Value(Enum):
    UNKNOWN = "unknown"


UNKNOWN: Final = _Value.UNKNOWN
#: The type of UNKNOWN: ``float | Unknown`` is what a formula gives.
Unknown: TypeAlias = Literal[_Value.UNKNOWN]


def known(value: T | Unknown, otherwise: Other) -> T | Other:
    """A value, or another one where it is UNKNOWN."""
    return otherwise if value is UNKNOWN else value


class Names(Mapping[str, T | Unknown]):
    """What names mean in one place: ``declared`` has a value for each, UNKNOWN where the declaration is invalid.

    Where something could not be read that declares names, the table is ``open``: every name may be declared there.

    >>> some = Names({"a": 1, "b": UNKNOWN})
    >>> some.get("a"), some.get("b") is UNKNOWN, some.get("c"), some.opened().get("c") is UNKNOWN, "c" in some.opened()
    (1, True, None, True, True)
    """

    def __init__(self, declared: Mapping[str, T | Unknown] | None = None, is_open: bool = False) -> None:
        self.declared = dict(declared or {})
        self.is_open = is_open

    def __getitem__(self, name: str) -> T | Unknown:
        return self.declared.get(name, UNKNOWN) if self.is_open else self.declared[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.declared)

    def __len__(self) -> int:
        return len(self.declared)

    def may_make(self, name: str) -> bool:
        """Whether something of this name may be made by an invalid declaration: by one of this name, or by one that
        makes several, with a number behind."""
        return any(self.get(one) is UNKNOWN for one in (name, name.rstrip("0123456789")))

    def known(self) -> dict[str, T]:
        """The names whose declarations are in order."""
        return {name: value for name, value in self.declared.items() if value is not UNKNOWN}

    def opened(self, is_open: bool = True) -> Names[T]:
        """The same; where it ``is_open``, any other name may be declared as well."""
        return Names(self.declared, self.is_open or is_open)

    def over(self, other: Names[T]) -> Names[T]:
        """These and others: of two of one name this one, unless only the other is in order."""
        both = {**other.declared, **self.declared, **other.known(), **self.known()}
        return Names(both, self.is_open or other.is_open)
