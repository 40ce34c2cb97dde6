"""Labels: what the neurons of a group are called in a picture.

In: the texts as written, with expressions in braces. Out: a text for each neuron, or findings at the very character.
An expression knows the parameters, ``i`` and ``n`` (as in ``bias``) and, in a module, the ``number`` of the instance:
1 for ``left1``, and for an instance that is not counted.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.names.scope import Scope
from neurovis_spec.compiler.values.constants import Value
from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.located import Formula, Located
from neurovis_spec.language.templates import Hole, pieces
from neurovis_spec.language.unknown import UNKNOWN, Unknown

#: the most characters of a label: it is one line of a picture, and a description may say the rest
_LONGEST: Final = 1000


def check_length(label: Located[str], findings: Findings) -> bool:
    """Whether a label, as written, is no longer than one may be; a finding if it is."""
    if len(label.value) <= _LONGEST:
        return True
    message = f"this label has {len(label.value):,} characters; {_LONGEST:,} are the most"
    findings.error("label-too-long", label.span, message, "shorten it, and say the rest under 'description'")
    return False


def labels_of(texts: Sequence[Located[str]], n: int, scope: Scope) -> tuple[str, ...] | Unknown:
    """The labels of n neurons: of one text, or of one each; UNKNOWN where an expression has none."""
    short = [check_length(text, scope.constants.findings) for text in texts]
    if not all(short):
        return UNKNOWN
    parts = [pieces(text.value) for text in texts]
    if all(isinstance(piece, str) for part in parts for piece in part):
        plain = tuple("".join(map(str, part)) for part in parts)
        return plain * n if len(plain) == 1 else plain
    each = np.arange(n, dtype=np.float64)
    if len(texts) == 1:
        return _filled(texts[0], parts[0], each, n, scope)
    found = [
        _filled(*both, each[place : place + 1], n, scope) for place, both in enumerate(zip(texts, parts, strict=True))
    ]
    sound = [labels for labels in found if labels is not UNKNOWN]
    return tuple(label for labels in sound for label in labels) if len(sound) == len(found) else UNKNOWN


def _filled(
    text: Located[str], parts: Sequence[str | Hole], i: FloatArray, n: int, scope: Scope
) -> tuple[str, ...] | Unknown:
    """A text for each of the neurons ``i``."""
    columns: list[list[str] | Unknown] = [
        [piece] * len(i) if isinstance(piece, str) else _values(text, piece, i, n, scope) for piece in parts
    ]
    known = [column for column in columns if column is not UNKNOWN]
    return tuple(map("".join, zip(*known, strict=True))) if len(known) == len(columns) else UNKNOWN


def _values(text: Located[str], hole: Hole, i: FloatArray, n: int, scope: Scope) -> list[str] | Unknown:
    """What an expression gives for each of the neurons ``i``, as a text."""
    constants = scope.constants
    if not hole.closed:
        place = text.node.at(hole.start - 1, hole.start)
        constants.findings.error("unbalanced-parenthesis", place, "'{' is not closed", "write {{ for a brace")
        return UNKNOWN
    extra: dict[str, Value | Unknown] = {"i": i, "n": float(n)}
    if scope.module is not None and "number" not in constants.parameters:
        extra["number"] = float(scope.number or 1)
    formula: Formula = Located(text.value[hole.start : hole.end], text.node.part(hole.start, hole.end))
    value = constants.value(formula, extra)
    return UNKNOWN if value is UNKNOWN else [_number_text(one) for one in np.broadcast_to(value, i.shape).tolist()]


def _number_text(value: float) -> str:
    """A number in a label: integers in full, others to six digits."""
    return str(int(value)) if value.is_integer() and abs(value) < 1e15 else f"{value:.6g}"
