"""Compiling and running exported C beside the reference."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.network import Network
from neurovis_spec.runtime.c_export import Exported
from neurovis_spec.runtime.state import State

STRICT = ("-Wall", "-Wextra", "-Wpedantic", "-Werror", "-ffp-contract=off")
LANGUAGES: Mapping[str, Sequence[str]] = {"C99": ("gcc", "-std=c99"), "C++17": ("g++", "-std=c++17", "-xc++")}


def compiled(
    network: Network, folder: Path, language: str = "C99", start: State | None = None, real: str = "double"
) -> Controller:
    """A network exported, compiled strictly, and loaded."""
    made = Exported(network, start, real)
    folder.mkdir(exist_ok=True)
    (folder / f"{made.name}.h").write_text(made.header(), encoding="ascii")
    (folder / f"{made.name}.c").write_text(made.source(), encoding="ascii")
    return built(made, folder, language)


def built(made: Exported, folder: Path, language: str = "C99") -> Controller:
    """The code that lies in a folder, compiled strictly, and loaded."""
    source = (folder / f"{made.name}.c").read_text(encoding="ascii")
    size = f"""
#ifdef __cplusplus
extern "C"
#endif
size_t size_of_state(void);
size_t size_of_state(void) {{ return sizeof({made.name}_state); }}
"""
    (folder / "with_size.c").write_text(source + size, encoding="ascii")
    command, *rest = LANGUAGES[language]
    if shutil.which(command) is None:
        pytest.fail(f"this test needs {command}")
    library = folder / "controller.so"
    subprocess.run(
        [command, *rest, *STRICT, "-O1", "-shared", "-fPIC", "with_size.c", "-o", str(library), "-lm"],
        cwd=folder,
        check=True,
    )
    return Controller(made, ctypes.CDLL(str(library)))


class Controller:
    """An exported controller and its state."""

    def __init__(self, made: Exported, library: ctypes.CDLL) -> None:
        self.made, self.library = made, library
        library.size_of_state.restype = ctypes.c_size_t
        self.memory = (ctypes.c_char * library.size_of_state()).from_buffer_copy(b"\xa5" * library.size_of_state())
        self.kind = np.dtype(np.float32 if made.real == "float" else np.float64)
        self._call("init")(ctypes.addressof(self.memory))

    def _call(self, name: str) -> Callable[..., int]:
        called = getattr(self.library, f"{self.made.name}_{name}")
        called.restype = ctypes.c_int
        return lambda *arguments: int(called(*(ctypes.c_void_p(a) if isinstance(a, int) else a for a in arguments)))

    def step(self, inputs: FloatArray | None = None) -> None:
        """A step; ``inputs`` are those without a source, in order."""
        given = None if inputs is None else np.ascontiguousarray(inputs, dtype=self.kind)
        self._call("step")(ctypes.addressof(self.memory), 0 if given is None else given.ctypes.data, 0)

    def set(self, name: str, value: float) -> bool:
        """Set a parameter."""
        kind = ctypes.c_float if self.made.real == "float" else ctypes.c_double
        return bool(self._call(f"set_{name}")(ctypes.addressof(self.memory), kind(value)))

    @property
    def activity(self) -> FloatArray:
        """The activities of now."""
        n = len(self.made.network.neurons)
        return np.frombuffer(self.memory, self.kind, n).astype(np.float64)

    @property
    def weights(self) -> FloatArray:
        """The weights of now."""
        n, m = len(self.made.network.neurons), len(self.made.network.connections)
        return np.frombuffer(self.memory, self.kind, m, n * self.kind.itemsize).astype(np.float64)
