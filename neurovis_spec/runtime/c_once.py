"""What is kept once for many connections, as C: where it lies, and how it comes from the State and goes back there.

In: a Once. Out: lines of C over the arrays of both. ``once`` is an array of all of these states, one behind the other.
"""

from __future__ import annotations

from collections.abc import Iterator

from neurovis_spec.compiler.program import Key
from neurovis_spec.runtime.c_code import Code, state_name
from neurovis_spec.runtime.kept_once import Kept, Once


def size(once: Once) -> int:
    """How many numbers are kept."""
    return sum(len(kept.first) for kept in once.kept.values())


def _starts(once: Once) -> Iterator[tuple[Kept, int]]:
    """Where each state begins among all."""
    start = 0
    for kept in once.kept.values():
        yield kept, start
        start += len(kept.first)


def pointer_lines(once: Once) -> dict[str, str]:
    """For each state that is kept once the line that gives it its name."""
    found = ((state_name(kept.owner, kept.number), start) for kept, start in _starts(once))
    return {name: f"double *restrict const {name} = p->once + {start};" for name, start in found}


def gather(once: Once, code: Code) -> None:
    """Each state from the first of its connections; gives whether it is that of all of them, and what it is made of, by
    its bits."""
    code.line("uint64_t differ = 0;")
    for key, kept in once.kept.items():
        own, whole = state_name(kept.owner, kept.number), _whole(once, key)
        with code.block(code.loop("p", len(kept.first))):
            code.line(f"{own}[p] = {whole}[{code.at(kept.first, 'p')}];")
        _compare(code, len(kept.of), f"{own} + {code.at(kept.of, 'q')}", f"{whole} + q")
        if kept.weights is not None:
            first = kept.weights[kept.first][kept.of]
            _compare(code, len(first), f"weights + {code.at(first, 'q')}", f"weights + {code.at(kept.weights, 'q')}")
    code.line("return !differ;")


def _compare(code: Code, count: int, first: str, second: str) -> None:
    """So many pairs of numbers, of which code says where they are for each ``q``."""
    with code.block(code.loop("q", count)):
        code.line("uint64_t one, other;")
        code.line(f"memcpy(&one, {first}, sizeof one);")
        code.line(f"memcpy(&other, {second}, sizeof other);")
        code.line("differ |= one ^ other;")


def scatter(once: Once, code: Code) -> None:
    """Each state to all of its connections."""
    for key, kept in once.kept.items():
        with code.block(code.loop("q", len(kept.of))):
            own = f"{state_name(kept.owner, kept.number)}[{code.at(kept.of, 'q')}]"
            code.line(f"{_whole(once, key)}[q] = {own};")


def _whole(once: Once, key: Key) -> str:
    """The array of a state in the State."""
    assert key.owner is not None
    kept = once.whole.projections[key.owner.number].use.definition.kept
    return state_name(key.owner, [one.name for one in kept].index(key.name))
