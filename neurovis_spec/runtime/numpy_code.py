"""NumPy code in the making: lines with identifiers of our own, and the arrays that they refer to by name.

In: typed trees and index arrays. Out: the text of one Python function and its namespace: a generator, which makes a
step each time that it is asked. Names of the author never reach the text: every one of them is replaced by an
identifier made here. What the methods of ``Code`` give, with what they add to the text or to the namespace:

    let("u", "a + b")               'u1'                     the line  u1 = a + b
    constant(array)                 'c2'                     c2 in the namespace
    numbers(key, values)            'c3', or 'v4_' for what can be set: v4_ = variables[3:9], before the steps
    select("activity", [2, 3], 9)   'a5_'                    a5_ = activity[2:4], before the steps
    select("activity", [3, 1], 9)   'activity[c6]'           c6 in the namespace
    position([2, 3], 9)             '[2:4]'                  to be written to: activity[2:4] = …
    slot(3)                         'r3'                     r3 = k % 3, at the head of a step

Of two neurons with an input and a third, which they reach with a delay of one step, the text is as follows; c5 is where
signals arrive, c7 the biases.

    def steps(state, vectors):
        activity = state.activity
        weights = state.weights
        signals = state.signals
        holds = state.conditions.holds
        s0_ = signals[0:2]
        a1_ = activity[0:2]
        for k, s in enumerate(vectors, state.k):
            g4 = s0_
            u6 = bincount(c5, g4, 3)
            u8 = u6 + c7
            u9 = np.array(u8)
            u9[0:2] += s[0:1]
            y10 = u9
            activity[:] = y10
            if holds and holds[0]: activity[holds[0][0]] = holds[0][1]
            multiply(weights, a1_, s0_)
            state.k = k + 1
            yield
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import FloatArray, Indices, IntArray
from neurovis_spec.compiler.events.settable import Variable
from neurovis_spec.compiler.program import Definition, Key, Owner, Use
from neurovis_spec.language.expressions.emit import defined, emit
from neurovis_spec.language.expressions.tree import Name, Tree, Unary, names
from neurovis_spec.runtime.stages import unfolded
from neurovis_spec.runtime.state import Cells, State, constants

_NONE: Mapping[Key, Variable] = {}
#: what states are held (``Conditions.fixed``)
Fixed: TypeAlias = Mapping[Key, tuple[IntArray, FloatArray]]
Functions: TypeAlias = Mapping[str, Callable[[str], str]]
#: makes steps from a state on, one for each vector of inputs; while it does, the arrays of the state stay the same ones
Steps: TypeAlias = Callable[[State, Iterable[FloatArray]], Iterator[None]]


#: the arrays of a state, by which the text names them
_PARTS = ("activity", "outlets", "weights", "signals", "history", "cells")
#: the numbers that can be set, in the conditions of the state
_VARIABLES = "variables"
#: the functions of NumPy that are called so often that they are looked up beforehand
_CALLED = ("bincount", "concatenate", "einsum", "dot", "isfinite", "add", "subtract", "multiply", "divide", "minimum")
#: whether the step is the first one of all, which no other came before
FIRST = "k == 0 and not state.continued"


class Code:
    """Lines of a step, one level deep, and what they need."""

    def __init__(self, dt: float, variables: Mapping[Key, Variable] = _NONE) -> None:
        self.dt, self._variables = dt, variables
        self.namespace: dict[str, object] = {"np": np, **{name: getattr(np, name) for name in _CALLED}}
        self.namespace |= {"held_at": held_at, "hold_cells": hold_cells, "held_among": held_among}
        #: lines before the steps: functions that these call, and what is made of weights that stay
        self.before: list[str] = []
        self.lines: list[str] = []
        self.indent = 1
        #: lines at the head of a step, which depend on its number alone
        self.head_lines: set[str] = set()
        #: identifiers of what is looked up once, before the steps, by its code
        self._views: dict[str, str] = {}
        self._states: dict[Key, str] = {}
        self._count = 0
        #: the identifiers of the names that every expression knows: constants, k and t
        self.common_names = {name: self.constant(np.float64(value)) for name, value in constants(dt).items()}
        self.common_names |= {"k": "k_", "t": "t_"}

    def name(self, prefix: str) -> str:
        """A new identifier."""
        self._count += 1
        return f"{prefix}{self._count}"

    def line(self, text: str) -> None:
        """Append a line."""
        self.lines.append("    " * self.indent + text)

    def let(self, prefix: str, value: str) -> str:
        """Give a value a new identifier."""
        name = self.name(prefix)
        self.line(f"{name} = {value}")
        return name

    def constant(self, value: object) -> str:
        """A value that stays, under a new identifier."""
        name = self.name("c")
        self.namespace[name] = value
        return name

    def parameters(self, use: Use, some: IntArray | None = None) -> dict[str, str]:
        """The parameters of a definition in use, of ``some`` of its members or of all; and the time, where it is in
        another unit there."""
        numbers = {name: self.numbers(Key(use.owner, name), array, some) for name, array in use.parameters.items()}
        return numbers | self.time(use.definition)

    def functions(self, use: Use) -> Functions:
        """The functions of an activation in use, which formulas of a model call."""

        def call(tree: Tree, argument: str) -> str:
            # the argument gets an identifier, so that it is computed once
            x = argument if argument.isidentifier() else self.let("x", argument)
            return self.expression(tree, self.parameters(use) | {"x": x})

        return {name: partial(call, tree) for name, tree in use.definition.functions.items()}

    @contextmanager
    def function(self, name: str, *arguments: str) -> Iterator[None]:
        """What is written meanwhile is the body of a function that the steps can call."""
        outer, indent, self.lines, self.indent = self.lines, self.indent, [], 1
        yield
        body, self.lines, self.indent = self.lines, outer, indent
        self.before += [f"    def {name}({', '.join(arguments)}):", *(f"    {line}" for line in body)]

    def array(self, prefix: str, values: FloatArray) -> str:
        """An array to work in, the same one in all steps."""
        name = self.name(prefix)
        self.namespace[name] = values
        return name

    def state(self, use: Use, name: str) -> str:
        """A state of a definition in use. It is looked up once, before the steps."""
        key = Key(use.owner, name)
        if key not in self._states:
            place = f"cells[{self.constant(use.owner)}][{self.constant(name)}]"
            self._states[key] = self._views[place] = f"v{len(self._views)}_"
        return self._states[key]

    def numbers(self, array: Key, values: FloatArray, some: Indices | None = None, share: bool = True) -> str:
        """An array of the network, or ``some`` of it: where it can be set as it is by now, else a constant; with
        ``share`` one number where all are the same."""
        variable = self._variables.get(array)
        if variable is None:
            numbers = values if some is None else values[some]
            return self.constant(shared(numbers) if share else np.array(numbers, dtype=np.float64))
        start, size = variable
        if size == 1:
            return self.view(_VARIABLES, f"{start}:{start + 1}")
        whole = self.view(_VARIABLES, f"{start}:{start + size}")
        return whole if some is None else self.select(whole, some, size)

    def numbers_of(self, array: Key, values: FloatArray, some: Indices | None, which: str) -> str:
        """The numbers of those of the members, of ``some`` of all or all, that code says: one number where all are the
        same."""
        variable = self._variables.get(array)
        numbers = values if some is None else values[some]
        if (variable is None and isinstance(shared(numbers), np.float64)) or (
            variable is not None and variable.size == 1
        ):
            return self.numbers(array, values, some)
        return f"{self.numbers(array, values, some, share=False)}[{which}]"

    def time(self, definition: Definition) -> dict[str, str]:
        """The time, where it is in another unit in a definition."""
        unit = definition.per_second
        if unit == 1.0:
            return {}
        if "t" in definition.read:
            self._tell_time()
            self.head_lines.add(f"t_{unit:.0f} = t_ * {unit!r}")
        return {"dt": self.constant(np.float64(self.dt * unit)), "t": f"t_{unit:.0f}"}

    def is_set(self, array: Key) -> bool:
        """Whether an array can be set in a run."""
        return array in self._variables

    def select(self, array: str, indices: Indices, size: int, broadcast: bool = False) -> str:
        """Elements of a vector of this size: a slice where they lie in a row, which costs no copy.

        With ``broadcast``, equal indices give a single element.
        """
        first, count = int(indices[0]), len(indices)
        if np.array_equal(indices, np.arange(first, first + count)):
            return array if count == size else self.view(array, f"{first}:{first + count}")
        if broadcast and (indices == first).all():
            return self.view(array, f"{first}:{first + 1}")
        return f"{array}[{self.constant(np.ascontiguousarray(indices, dtype=np.intp))}]"

    def view(self, array: str, part: str) -> str:
        """A slice. Slices of the state's own arrays are taken once, before the steps: they follow all changes.
        Their identifiers begin with the first letter of the array's."""
        if array not in (*_PARTS, _VARIABLES):
            return f"{array}[{part}]"
        return self._views.setdefault(f"{array}[{part}]", f"{array[0]}{len(self._views)}_")

    def position(self, indices: Indices, size: int) -> str:
        """The subscript that ``select`` reads, for writing."""
        return self.select("", indices, size) or "[:]"

    def slot(self, length: int, ago: int = 0) -> str:
        """k mod a length, or a step some steps ago."""
        if length == 1:
            return "0"
        name, step = (f"r{length}_{ago}", f"(k - {ago})") if ago else (f"r{length}", "k")
        self.head_lines.add(f"{name} = {step} % {length}")
        return name

    def expression(self, tree: Tree, known: Mapping[str, str], functions: Functions | None = None) -> str:
        """An expression as code."""
        if (names(tree) & {"k", "t"}) - known.keys():
            self._tell_time()
        return emit(tree, {**self.common_names, **known}, functions or {})

    def _tell_time(self) -> None:
        self.head_lines |= {"k_ = float64(k)", f"t_ = k_ * {self.common_names['dt']}"}

    def fresh(self, prefix: str, tree: Tree, known: Mapping[str, str], functions: Functions | None = None) -> str:
        """The value of an expression under a new identifier, and never an alias of an array that changes."""
        code = self.expression(tree, known, functions)
        # an activation may be x itself, of which the code is that of what it is called with
        return self.let(prefix, f"np.array({code})" if _may_alias(tree) or code.isidentifier() else code)

    def text(self) -> str:
        """The steps as Python text. What stays the same over all of them is looked up before the first."""
        views = [f"    {name} = {code}" for code, name in self._views.items()]
        # sorted, as the line of t_ reads k_
        body = [*(f"    {text}" for text in sorted(self.head_lines)), *self.lines, "    state.k = k + 1", "    yield"]
        text = [*views, *self.before, *body]
        lookups = [f"    {name} = state.{name}" for name in _PARTS if any(name in line for line in text)]
        lookups += [
            f"    {name} = state.conditions.{name}"
            for name in (_VARIABLES, "holds", "fixed")
            if any(name in line for line in text)
        ]
        loop = ["    for k, s in enumerate(vectors, state.k):", *(f"    {line}" for line in body), ""]
        return "\n".join(["def steps(state, vectors):", *lookups, *views, *self.before, *loop])

    def compiled(self) -> Steps:
        """The steps as a function. The text holds our own identifiers only."""
        namespace = {**self.namespace, "float64": np.float64}
        steps = defined("steps", [self.text()], "steps of a network", namespace)
        assert callable(steps)
        return steps


class Cell(NamedTuple):
    """Where something that lasts is kept, for all members, as code. Of weights from 0 to 1, say:
    ``Cell("w0_", "weights[0:3]", lambda value: f"np.clip({value}, 0, 1)")``."""

    #: its value now
    now: str
    #: what is assigned to
    place: str
    #: of the code of a new value that of what is kept of it
    kept: Callable[[str], str] = str
    #: of that of a new value, before anything is made of it, what it is where states are held
    held: Callable[[str], str] | None = None


def emit_change(
    code: Code,
    definition: Definition,
    seen: Mapping[str, str],
    cells: Mapping[str, Cell],
    episode: int | None,
    functions: Functions | None = None,
) -> dict[str, str]:
    """Emit the new value of all that lasts of a definition, from old values at once, then its change at an episode's
    end. Gives the identifiers of what does not last, which is made from the new states. ``seen``: what formulas see
    besides their own. What flows begins with its initial states: they stay at the first step."""
    change = _Change(code, definition, seen, cells, functions)
    fleeting_names = change.replace(
        definition.steps, {one.name: one.each_step for one in definition.fleeting}, definition.staying
    )
    ends = {one.name: one.each_episode for one in definition.lasting}
    if episode is not None and any(tree is not None for tree in ends.values()):
        code.line(f"if (k + 1) % {episode} == 0:")
        code.indent += 1
        for name, made in fleeting_names.items():
            if name not in cells:  # it may be a state itself, which is about to change
                code.line(f"{made} = np.array({made})")
        change.replace(ends, {})
        code.indent -= 1
    return fleeting_names


class _Change(NamedTuple):
    """What ``emit_change`` is given."""

    code: Code
    definition: Definition
    seen: Mapping[str, str]
    cells: Mapping[str, Cell]
    functions: Functions | None

    def replace(
        self,
        trees: Mapping[str, Tree | None],
        fleeting: Mapping[str, Tree | None],
        staying: Collection[str] = (),
    ) -> dict[str, str]:
        """Emit all right-hand sides, then all changes; gives the identifiers of what is ``fleeting``. What is
        ``staying`` keeps its value at the first step."""
        code, cells, functions = self.code, self.cells, self.functions
        known = dict(self.seen)
        known |= {
            name: cell.now if cell.now.isidentifier() else code.let("v", cell.now)
            for name, cell in cells.items()
            if name not in fleeting
        }
        for name, value in unfolded(self.definition.let, [*trees.values(), *fleeting.values()]).let:
            known[name] = code.fresh("m", value, known, functions)
        new = {name: code.fresh("n", tree, known, functions) for name, tree in trees.items() if tree is not None}
        for name in new:
            if name in staying:
                new[name] = code.let("n", f"np.array({known[name]}) if {FIRST} else {new[name]}")
        for name, made in new.items():
            held = cells[name].held
            if held is not None:
                code.line(f"if fixed: {made} = {held(made)}")
        given = {
            name: code.let("y", code.expression(tree, known | new, functions))
            for name, tree in fleeting.items()
            if tree is not None
        }
        for name, made in (new | given).items():
            if name in cells:
                code.line(f"{cells[name].place} = {cells[name].kept(made)}")
        return given


def held_at(
    fixed: Fixed, key: Key, value: FloatArray | float, count: int, some: IntArray | None = None
) -> FloatArray | float:
    """The new value of a state of so many members, ``some`` of all or all, in whose places of those that are held."""
    if key not in fixed:
        return value
    result = np.array(np.broadcast_to(value, (count,)))
    positions, values = _among(some, *fixed[key])
    result[positions] = values
    return result


def hold_cells(fixed: Fixed, owners: Collection[Owner], cells: Cells) -> None:
    """Have the states of some owners that are held what they are held at."""
    for (owner, name), (positions, values) in fixed.items():
        if owner is not None and owner in owners:
            cells[owner][name][positions] = values


def held_among(fixed: Fixed, starts: Mapping[Key, tuple[int, IntArray | None]]) -> tuple[IntArray, FloatArray]:
    """Where those of some states that lie one behind the other are held, and at what; of each state where it starts,
    and of which members it is, None for all."""
    places, held = [np.zeros(0, dtype=np.int64)], [np.zeros(0)]
    for key, (start, some) in starts.items():
        if key in fixed:
            positions, values = _among(some, *fixed[key])
            places.append(start + positions)
            held.append(values)
    return np.concatenate(places), np.concatenate(held)


def _among(some: IntArray | None, positions: IntArray, values: FloatArray) -> tuple[IntArray, FloatArray]:
    """Which of ``some`` members, None for all, in any order, are at these positions, and what is held there."""
    if some is None:
        return positions, values
    there = np.flatnonzero(np.isin(some, positions))
    return there, values[np.searchsorted(positions, some[there])]


def _may_alias(tree: Tree) -> bool:
    """Whether the value of an expression is that of a name, and no new array."""
    while isinstance(tree, Unary) and tree.operator == "+":
        tree = tree.operand
    return isinstance(tree, Name)


def shared(array: FloatArray) -> FloatArray | np.float64:
    """One number if all are the same, else the array."""
    if len(array) and (array == array[0]).all():
        return np.float64(array[0])
    return np.ascontiguousarray(array, dtype=np.float64)


def any_given(array: npt.NDArray[np.float64]) -> bool:
    """Whether a number is not 0 (NaN counts)."""
    return bool((array != 0).any())
