"""The functions of formulas in C: what the step calls, for whole arrays.

In: nothing. Out: a Library. What is computed beside the step (inputs that are expressions, clamps, what follows a
parameter that is set) is computed by it, so that it has the last bits that the step and an exported controller would
give it; NumPy's functions have others. It is compiled once, for all networks. Of ``exp`` it is

    NV_PUBLIC double nv_one_exp(double a)
    {
        return exp(a);
    }

    NV_PUBLIC void nv_all_exp(int64_t count, const double *a, double *out)
    {
        for (int64_t i = 0; i < count; i++)
            out[i] = nv_one_exp(a[i]);
    }
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, reduce
from typing import Final

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.language.expressions.emit_c import Emitter
from neurovis_spec.language.expressions.functions import FUNCTIONS, Library
from neurovis_spec.language.expressions.tree import Call, Chain, Name, Tree
from neurovis_spec.runtime import c_library
from neurovis_spec.runtime.c_code import words_of

_HEAD: Final = """#include <math.h>
#include <stdint.h>

#ifdef _WIN32
#define NV_PUBLIC __declspec(dllexport)
#else
#define NV_PUBLIC
#endif
"""
_ARGUMENTS: Final = ("a", "b", "c")
_REMAINDER: Final = "remainder"


def library() -> Library:
    """The functions, compiled by the compiler that is there. Raises CompilerError."""
    return _loaded(c_library.place(text()), text())


@cache
def _loaded(place: object, source: str) -> Library:
    """The functions of a library that lies at a place, by this compiler."""
    compiled = c_library.load(source)
    functions = {name: _Function.of(compiled, name, len(names)) for name, names in _parameters().items()}
    calls = {name: functions[name].over_all if FUNCTIONS[name].most is None else functions[name] for name in FUNCTIONS}
    return Library(calls, functions[_REMAINDER])


@cache
def text() -> str:
    """The C of all functions: of each one for numbers, ``nv_one_NAME``, and one for arrays, ``nv_all_NAME``."""
    emitter, bodies = Emitter(), list[str]()
    for name, names in _parameters().items():
        value = emitter.text(emitter.value(_tree(name, names), {one: one for one in names}))
        numbers = ", ".join(f"double {own}" for own in names)
        arrays = "".join(f", const double *{own}" for own in names)
        items = ", ".join(f"{own}[i]" for own in names)
        bodies += [
            f"NV_PUBLIC double nv_one_{name}({numbers})\n{{\n    return {value};\n}}\n",
            f"NV_PUBLIC void nv_all_{name}(int64_t count{arrays}, double *out)\n{{\n"
            f"    for (int64_t i = 0; i < count; i++)\n        out[i] = nv_one_{name}({items});\n}}\n",
        ]
    return "\n".join([_HEAD, emitter.helpers(words_of(bodies)), "", *bodies])


def _parameters() -> dict[str, tuple[str, ...]]:
    """The names of the arguments of each; of one that takes any number, those of two."""
    functions = {name: _ARGUMENTS[: entry.most or entry.least] for name, entry in FUNCTIONS.items()}
    return functions | {_REMAINDER: _ARGUMENTS[:2]}


def _tree(name: str, names: tuple[str, ...]) -> Tree:
    """The call of a function with these arguments."""
    arguments = tuple(Name(own) for own in names)
    return Chain(("%",), arguments) if name == _REMAINDER else Call(name, arguments)


@dataclass(frozen=True, slots=True)
class _Function:
    """A function on numbers or arrays, which broadcast."""

    one: Callable[..., float]
    every: Callable[..., None]

    @classmethod
    def of(cls, compiled: ctypes.CDLL, name: str, count: int) -> _Function:
        """That of a library, by its name and the number of its arguments."""
        one, every = getattr(compiled, f"nv_one_{name}"), getattr(compiled, f"nv_all_{name}")
        one.argtypes, one.restype = [ctypes.c_double] * count, ctypes.c_double
        every.argtypes, every.restype = [ctypes.c_int64, *[ctypes.c_void_p] * (count + 1)], None
        return cls(one, every)

    def __call__(self, *values: FloatArray) -> FloatArray:
        shape = np.broadcast_shapes(*(np.shape(value) for value in values))
        if shape == ():
            return np.asarray(self.one(*map(float, values)))
        arrays = [np.ascontiguousarray(np.broadcast_to(value, shape), dtype=np.float64) for value in values]
        out = np.empty(shape)
        self.every(out.size, *(array.ctypes.data for array in arrays), out.ctypes.data)
        return out

    def over_all(self, *values: FloatArray) -> FloatArray:
        """One of any number of arguments, two at a time."""
        return reduce(self, values)
