"""References to connections with single blanks: ``K1+K3->O`` becomes ``K1 + K3 -> O``.

In: the keys of a mapping or a value as written, and the keys on the way to it. Out: the same as it is to be written.
What is no reference to connections stays as it is, since blanks count in a text.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

from neurovis_spec.language.places import Path, role_of
from neurovis_spec.language.references import Arrow, parse

_NAMES: Final = re.compile(r"[A-Za-z0-9_.]+")


def names_connections(path: Path, is_key: bool) -> bool:
    """Whether the text at a path, a key or a value, may name connections."""
    role = role_of(path, is_key)
    return role is not None and role.use == "ends"


def normal(key: str) -> str:
    """A connection's name, quoted or not, with single blanks; anything else as it is.

    >>> normal("K1+K3..K5->O"), normal('"A->B"'), normal("a ->")
    ('K1 + K3..K5 -> O', '"A -> B"', 'a ->')
    """
    quote = key[:1] if key[:1] in ("'", '"') else ""
    bare = key[1:-1] if quote else key
    found = parse(bare)
    ends = (*found.sources.parts, *found.targets.parts) if isinstance(found, Arrow) else ()
    return quote + found.normal + quote if ends and all(_NAMES.fullmatch(part.text) for part in ends) else key


def normal_all(keys: Sequence[str]) -> list[str]:
    """The same for all keys of a mapping; none is changed where two would become the same."""
    changed = [normal(key) for key in keys]
    return changed if len({key.strip("'\"") for key in changed}) == len(keys) else list(keys)
