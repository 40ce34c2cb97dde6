"""Measures: expressions of a run, such as ``rms(O - T, last=129) < 0.01``.

In: the text of an expression whose names may be references to neurons and outputs (``left1.K3``), with ``rms``,
``mean``, ``min``, ``max`` and ``rate`` over the last N steps, and ``count`` over the neurons of a group. Out: a
Formula: the counts and the windows, and a tree in which each of them is a name; or an ExpressionError. Names are not
looked up here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Final, Literal, TypeAlias, cast, get_args

from neurovis_spec.language.expressions import mistakes
from neurovis_spec.language.expressions.functions import FUNCTIONS
from neurovis_spec.language.expressions.lexer import Token
from neurovis_spec.language.expressions.parser import Parser
from neurovis_spec.language.expressions.tree import ExpressionError, Name, Number, Tree, walk
from neurovis_spec.likeness import suggest

#: What a window is summed up by.
Summary: TypeAlias = Literal["rms", "mean", "min", "max"]
SUMMARIES: Final[tuple[Summary, ...]] = get_args(Summary)
#: The name that stands for window i in the tree of a Formula; no author can write it.
PLACE: Final[Callable[[int], str]] = "window {}".format
#: The name that stands for count i.
COUNTED: Final[Callable[[int], str]] = "count {}".format
#: What the name of neurons has before it where their spikes are meant.
SPIKES: Final = "spikes of "
RATE: Final = "rate"
COUNT: Final = "count"

_HOW: Final = "write '{0}(x, last=N)', of the last N steps, or '{0}(x)', of the whole run"


@dataclass(frozen=True)
class Window:
    """``rms(x, last=N)``: what is summed up, how, and over how many steps (None: all), from ``start`` to ``end`` of the
    text."""

    summary: Summary
    tree: Tree
    last: int | None
    start: int
    end: int

    @property
    def called(self) -> str:
        """As it is written: a rate is the mean of how many fire a second."""
        return RATE if isinstance(self.tree, Name) and self.tree.name.startswith(SPIKES) else self.summary


@dataclass(frozen=True)
class Count:
    """``count(E > 0.5)``: of how many neurons of a group something is true at a step, from ``start`` to ``end`` of the
    text."""

    tree: Tree
    start: int
    end: int


@dataclass(frozen=True)
class Formula:
    """A measure as it is written: a count may stand in a window, and both in the ``tree``, as names."""

    text: str
    tree: Tree
    windows: tuple[Window, ...]
    counts: tuple[Count, ...] = ()

    @cached_property
    def longest(self) -> int:
        """How many steps have to be made before it has a value."""
        return max((window.last or 1 for window in self.windows), default=1)


def parse_measure(text: str) -> Formula:
    """The formula of a measure. Raises ExpressionError.

    >>> formula = parse_measure("rms(O - T, last=9) < max(a, b)")
    >>> formula.tree.left.name, formula.windows[0].summary, formula.windows[0].last
    ('window 0', 'rms', 9)
    """
    parser = _Parser(text)
    tree = parser.whole()
    return Formula(text, tree, tuple(parser.windows), tuple(parser.counts))


class _Parser(Parser):
    """The parser of expressions, with windows."""

    def __init__(self, text: str) -> None:
        super().__init__(text, False, {"rms": 1, "mean": 1, RATE: 1, COUNT: 1}, "references")
        self.windows: list[Window] = []
        self.counts: list[Count] = []
        self._within: Token | None = None
        self._counting: Token | None = None

    def call(self, name: Token) -> Tree:
        commas, sign = self._inside()
        if name.text in ("rms", "mean", RATE) or (name.text in SUMMARIES and (sign is not None or not commas)):
            return self._window(name)
        if name.text == COUNT and sign is None:
            return self._count(name)
        if sign is not None and self.arity(name.text) is not None:
            message, hint = f"the arguments of '{name.text}' have no names", "write the values alone"
            raise ExpressionError("foreign-operator", message, sign.start, sign.end, hint)
        if sign is not None:
            raise mistakes.unknown_function(name, (*self.extra_functions, *FUNCTIONS), SUMMARIES)
        return super().call(name)

    def _count(self, name: Token) -> Tree:
        if self._counting is not None:
            message, hint = "'count' stands inside 'count'", "one alone can be counted; write the two side by side"
            raise ExpressionError("bad-window", message, name.start, name.end, hint)
        self._counting = name
        found = super().call(name)
        self._counting = None
        if len(found.parts) != 1:
            return found  # which has been noted
        (tree,) = found.parts
        if any(isinstance(node, Name) and node.name.startswith("window ") for node in walk(tree)):
            message = "a summary over steps stands inside 'count'"
            hint = "count what is true at a step, and sum that up: mean(count(E > 0.5), last=N)"
            raise ExpressionError("bad-window", message, name.start, self.end, hint)
        self.counts.append(Count(tree, name.start, self.end))
        return Name(COUNTED(len(self.counts) - 1), name.start, self.end)

    def _inside(self) -> tuple[int, Token | None]:
        """How many commas the parentheses that begin here have, and the first sign behind an argument's name."""
        depth = commas = 0
        for token in self.tokens[self.at :]:
            depth += (token.text == "(") - (token.text == ")")
            if depth == 0:
                break
            if depth == 1 and token.text == "=":
                return commas, token
            commas += depth == 1 and token.text == ","
        return commas, None

    def _keyword(self) -> bool:
        """Whether the name of an argument stands here."""
        return self.token.kind == "name" and self.tokens[self.at + 1].text == "="

    def _window(self, name: Token) -> Tree:
        if self._within is not None:
            message = f"'{name.text}' over steps stands inside '{self._within.text}' over steps"
            hint = "one alone can be computed; write the two in one expression, side by side"
            raise ExpressionError("bad-window", message, name.start, name.end, hint)
        opening = self.advance()
        values: list[Tree] = []
        last: int | None = None
        self._within = name
        with self.deeper(opening):
            while not (self.is_operator(")") and not values):
                if self._keyword():
                    last = self._last(name, last)
                else:
                    values.append(self.conditional())
                if not self.is_operator(","):
                    break
                self.advance()
        end = self.close(opening).end
        self._within = None
        if len(values) != 1:
            given = "nothing" if not values else f"{len(values)} values"
            message = f"'{name.text}' over steps is of one value, here of {given}"
            raise ExpressionError("bad-window", message, name.start, end, _HOW.format(name.text))
        summary = name.text
        if summary == RATE:
            summary, values = "mean", [self._spikes(name, values[0], end)]
        self.windows.append(Window(cast(Summary, summary), values[0], last, name.start, end))
        return Name(PLACE(len(self.windows) - 1), name.start, end)

    def _spikes(self, name: Token, value: Tree, end: int) -> Tree:
        """What a rate is of, the neurons of a reference."""
        if isinstance(value, Name):
            return Name(SPIKES + value.name, value.start, value.end)
        message, hint = "'rate' is of neurons that spike", "write 'rate(E, last=N)', with a neuron or a group"
        raise ExpressionError("bad-window", message, name.start, end, hint)

    def _last(self, name: Token, before: int | None) -> int:
        """``last=N``."""
        word = self.advance()
        sign = self.advance()
        if word.text != "last":
            message = f"'{name.text}' has no argument '{word.text}'"
            hint = suggest(word.text, ("last",), "its arguments are") or _HOW.format(name.text)
            raise ExpressionError("bad-window", message, word.start, word.end, hint)
        if before is not None:
            raise ExpressionError("bad-window", "'last' is given twice", word.start, word.end)
        begin = self.token
        tree = self.conditional() if not (self.is_operator(")", ",") or self.at_end()) else None
        value = tree.value if isinstance(tree, Number) else 0.0
        if tree is None or value < 1 or value != int(value) or value > 2**53:
            place = (sign.start, sign.end) if tree is None else (begin.start, self.end)
            raise ExpressionError("bad-window", "'last' takes a number of steps, from 1 on", *place, "as in last=100")
        return int(value)
