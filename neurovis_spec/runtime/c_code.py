"""C in the making: lines with identifiers of our own, and the tables of numbers that they read.

In: typed trees, arrays, indices that are numbers or code. Out: the body of a function, and tables to stand before it.
Names of the author never reach the text. A ``Place`` is an index: a number where neurons or connections are written out
one by one, else the code of a loop's variable. So ``3`` gives ``u1 = 0.5*activity[3]``, and ``"p"``
``u1 = t0[p]*activity[4 + p]`` (t0: a table; 4 + p: indices that are regular).

The lines read these identifiers: ``k`` the step, ``kd`` and ``td`` the step and the time as numbers, ``s`` the inputs
and noise of the step, ``x`` the numbers that can be set, ``t0``, ``t1``, … tables, and the arrays of a State by their
names. They come from the struct ``p`` of the caller (tables that are too long for the text from ``p->given``) at the
head of a function: in a loop whose index is ``p`` it is hidden.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Container, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from neurovis_spec.arrays import PIECE, FloatArray, Indices, pieces
from neurovis_spec.compiler.events.settable import Variable
from neurovis_spec.compiler.program import Key, Owner, Use
from neurovis_spec.language.expressions.emit_c import Drawn, Emitter, Made, Value
from neurovis_spec.language.expressions.tree import Tree, names
from neurovis_spec.runtime.state import constants, kept_as

Place: TypeAlias = int | str
Table: TypeAlias = npt.NDArray[np.float64] | npt.NDArray[np.int32] | npt.NDArray[np.uint16]

#: items of a table in a line of the text
_ROW = 16
_NO_CALLS: Mapping[str, Made] = {}


def state_name(owner: Owner, number: int) -> str:
    """The identifier of the array of a state of an owner."""
    return f"{kept_as(owner.kind)}{owner.number}_{number}"


def _is_regular(indices: Indices, first: int, stride: int) -> bool:
    """Whether indices go on from the first one by the same stride."""
    ahead = stride * np.arange(PIECE)
    return all(
        np.array_equal(some, first + stride * number * PIECE + ahead[: len(some)])
        for number, some in enumerate(pieces(indices))
    )


def plus(start: int, place: Place) -> Place:
    """An index so many places on."""
    if isinstance(place, int):
        return start + place
    return f"{start} + {place}" if start else place


class Tables:
    """Constant arrays, each once. Those of more than ``longest`` items are not written into the text but passed in at
    run time: ``passed_in`` holds them in order."""

    def __init__(self, real: str, longest: int | None) -> None:
        self._real, self._longest = real, longest
        self._names: dict[tuple[str, bytes], str] = {}
        self._text: dict[str, str] = {}
        self.passed_in: list[Table] = []
        self._pointer_lines: dict[str, str] = {}

    def name(self, values: FloatArray | Indices) -> str:
        """The identifier of an array of numbers or indices."""
        array, kind = self._array(values)
        key = array.dtype.char, hashlib.sha256(array.data).digest()
        if key not in self._names:
            name = self._names[key] = f"t{len(self._names)}"
            if self._longest is not None and len(array) > self._longest:
                item = f"p->given[{len(self.passed_in)}]"
                self._pointer_lines[name] = f"const {kind} *restrict const {name} = (const {kind} *){item};"
                self.passed_in.append(array)
            else:
                self._text[name] = f"static const {kind} {name}[{len(array)}] = {{\n{self._items(array)}\n}};"
        return self._names[key]

    def _array(self, values: FloatArray | Indices) -> tuple[Table, str]:
        """The array as it is kept, indices as narrow as they can be, and the type of its items."""
        if values.dtype.kind == "f":
            return np.ascontiguousarray(values, np.float64), self._real
        if values.min(initial=0) >= 0 and values.max(initial=0) < 1 << 16:
            return np.ascontiguousarray(values, np.uint16), "uint16_t"
        return np.ascontiguousarray(values, np.int32), "int32_t"

    def _items(self, array: Table) -> str:
        items = array.tolist()
        emitter = Emitter(self._real)
        texts = [emitter.text(item) if isinstance(item, float) else str(item) for item in items]
        return ",\n".join("    " + ", ".join(texts[i : i + _ROW]) for i in range(0, len(texts), _ROW))

    def text(self, used: Container[str]) -> str:
        """The definitions of those that are used."""
        return "\n\n".join(text for name, text in self._text.items() if name in used)

    def pointer_lines(self) -> dict[str, str]:
        """For each array that is passed in, the line that declares a pointer to it."""
        return self._pointer_lines


@dataclass(frozen=True, slots=True)
class Form:
    """What a step has to handle. Arrays in quotes are those of its code."""

    #: neuron by neuron, without loops
    written_out: bool = False
    #: neurons with ``initial`` take it at step 0, where the argument ``first`` is not 0
    first: bool = False
    #: the step may follow one that was made in the same call and in a form like this, which the argument ``follows``
    #: says: nothing has come between them
    follows: bool = False
    #: neurons whose byte of ``held`` is set have the activity ``holding``
    held: bool = False
    #: so do states of models, whose bytes and numbers stand behind those of all neurons (``Network.state_places``)
    fixed: bool = False
    #: so do those of rules and synapses, behind these
    fixed_joined: bool = False
    #: connections whose byte of ``gone`` is set are left out
    gone: bool = False
    #: so are, of those that add to states of shared synapses, those whose byte of ``cut`` is set
    cut: bool = False
    #: connections whose byte of ``still`` is set do not learn
    still: bool = False
    #: what a connection has sent before its step in ``lost`` never arrives
    lost: bool = False
    #: what arrives after one step along weights that do not change is not sent: the neuron that it arrives at sums it,
    #: from the activities of the step ``before`` and the weights ``packed`` in its order
    fused: bool = False
    #: what loops over connections store is checked: ``odd`` is NaN after a step where some of it is not finite, else 0
    watched: bool = False


class Code:
    """Lines of a function, indented by one level."""

    def __init__(self, emitter: Emitter, tables: Tables, dt: float, variables: Mapping[Key, Variable]) -> None:
        self.emitter, self.tables, self._variables = emitter, tables, variables
        self.lines: list[str] = []
        self.indent = 1
        self._count = 0
        #: identifiers whose values stay
        self._constant: set[str] = set()
        #: lines at the head of the function, by the identifier that each declares; one may read those before it
        self.head: dict[str, str] = {}
        #: in a loop over rows of connections their order: connection ``q`` is number ``e`` of it
        self.order: Indices | None = None
        #: what every expression may name; kd and td are k and t as numbers, declared at the head where they are read
        self.common_names: dict[str, Value] = {**constants(dt), "k": "kd", "t": "td"}
        self._dt = dt

    @property
    def real(self) -> str:
        """The type of numbers."""
        return self.emitter.real

    def line(self, text: str) -> None:
        """Append a line."""
        self.lines.append("    " * self.indent + text)

    @contextmanager
    def block(self, head: str) -> Iterator[None]:
        """Lines within braces."""
        self.line(f"{head} {{".lstrip())
        self.indent += 1
        yield
        self.indent -= 1
        self.line("}")

    def loop(self, index: str, count: int | str, first: int | str = 0, step: int = 1, type_: str = "int32_t") -> str:
        """The head of a loop."""
        further = f"{index}++" if step == 1 else f"{index} += {step}"
        return f"for ({type_} {index} = {first}; {index} < {count}; {further})"

    def name(self, prefix: str) -> str:
        """A new identifier."""
        self._count += 1
        return f"{prefix}{self._count}"

    def let(self, prefix: str, value: Value) -> Value:
        """Give code an identifier; a number stays one."""
        if isinstance(value, float) or value in self._constant:
            return value
        name = self.name(prefix)
        self._constant.add(name)
        self.line(f"const {self.real} {name} = {value};")
        return name

    def variable(self, prefix: str, value: Value) -> str:
        """Give a value an identifier that can be assigned to."""
        name = self.name(prefix)
        self.line(f"{self.real} {name} = {self.text(value)};")
        return name

    def text(self, value: Value) -> str:
        """A value as code."""
        return self.emitter.text(value)

    def at(self, indices: Indices, place: Place) -> Place:
        """An element of an array of indices: ``first + stride*place`` where they are regular, else one of a table."""
        if isinstance(place, int):
            return int(indices[place])
        first = int(indices[0])
        if len(indices) == 1:
            return first
        stride, last = int(indices[1]) - first, len(indices) - 1
        if int(indices[-1]) == first + stride * last and _is_regular(indices, first, stride):
            if stride == 0:
                return first
            offset = place if stride == 1 else f"{stride}*{place}"
            return f"{first} + {offset}" if first else offset
        return f"{self.tables.name(indices)}[{place}]"

    def number(self, values: FloatArray, place: Place) -> Value:
        """An element of an array of numbers; where all are the same, that one."""
        if isinstance(place, int):
            return float(values[place])
        # by their bits: 0.0 and −0.0 are two numbers, and NaN is like itself
        bits = np.ascontiguousarray(values, dtype=np.float64).view(np.int64)
        return float(values[0]) if (bits == bits[0]).all() else f"{self.tables.name(values)}[{place}]"

    def settable(self, array: Key, values: FloatArray, members: Indices | None, place: Place) -> Value:
        """An element of an array of the network, of its ``members`` or of all; its current value where it can be
        set in a run."""
        variable = self._variables.get(array)
        if variable is None:
            return self.number(values if members is None else values[members], place)
        if variable.size == 1:
            return f"x[{variable.start}]"
        indices = np.arange(variable.size) if members is None else members.astype(np.int64)
        return f"x[{self.at(variable.start + indices, place)}]"

    def is_set(self, array: Key) -> bool:
        """Whether an array can be set in a run."""
        return array in self._variables

    def parameters(self, use: Use, place: Place) -> dict[str, Value]:
        """The parameters of a definition in use."""
        return {
            name: self.settable(Key(use.owner, name), values, None, place) for name, values in use.parameters.items()
        }

    def value(
        self, tree: Tree, known: Mapping[str, Value], calls: Mapping[str, Made] = _NO_CALLS, drawn: Drawn | None = None
    ) -> Value:
        """An expression as a number or code. ``known``: the values of its names; ``calls`` and ``drawn``: what makes
        the values of the functions of its place (``f`` of a model) and of its draws."""
        read = names(tree) & {"k", "t"}
        if read:
            self.head["kd"] = f"const {self.real} kd = ({self.real})k;"
        if "t" in read:
            self.head["td"] = f"const {self.real} td = kd * {self.emitter.literal(self._dt)[0]};"
        return self.emitter.value(tree, {**self.common_names, **known}, calls, drawn)

    def remainder(self, divisor: int) -> str:
        """k mod a number."""
        if divisor == 1:
            return "0"
        name = f"r{divisor}"
        self.head[name] = f"const int32_t {name} = (int32_t)(k % {divisor});"
        return name


def words_of(lines: Iterable[str]) -> set[str]:
    """All identifiers in some lines, but for members of a struct."""
    return set(re.findall(r"(?<!->)(?<![\w.])[A-Za-z_]\w*", "\n".join(lines)))


def function(code: Code, head: str, pointer_lines: Mapping[str, str]) -> list[str]:
    """A function of the lines of ``code``. Before them stand the lines of ``pointer_lines``, which name the arrays, and
    those of ``code.head``, as far as they are used."""
    pointers, heads = _used_lines(code, pointer_lines)
    return [head, "{", *(f"    {line}" for line in (*pointers, *heads)), *code.lines, "}"]


def function_of_arrays(
    code: Code, type_: str, name: str, parameters: str, pointer_lines: Mapping[str, str]
) -> list[str]:
    """The same of a function of these ``parameters``, which it hands over to one that has the arrays as parameters,
    too: of pointers that are none compilers do not believe that they are ``restrict``."""
    pointers, heads = _used_lines(code, pointer_lines)
    declared = [line.removesuffix(";").partition(" = ") for line in pointers]
    given = [one.split()[-1].lstrip("*") for one in parameters.split(", ")]
    inner = ", ".join([parameters, *(declaration for declaration, _, _ in declared)])
    handed = ", ".join([*given, *(value for _, _, value in declared)])
    return [
        *(f"static inline {type_} {name}_of({inner})", "{", *(f"    {line}" for line in heads), *code.lines, "}", ""),
        *(f"static {type_} {name}({parameters})", "{"),
        f"    {'' if type_ == 'void' else 'return '}{name}_of({handed});",
        "}",
    ]


def _used_lines(code: Code, pointer_lines: Mapping[str, str]) -> tuple[list[str], list[str]]:
    """Those of ``pointer_lines`` and of ``code.head`` that are used."""
    used = words_of(code.lines)
    for name in reversed(list(code.head)):  # last first: a line at the head may read those before it
        if name in used:
            used |= words_of([code.head[name]])
    pointers, heads = ([line for name, line in lines.items() if name in used] for lines in (pointer_lines, code.head))
    return pointers, heads
