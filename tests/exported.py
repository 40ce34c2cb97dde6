"""Compiling and running exported C beside the reference."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Callable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from pathlib import Path

import numpy as np
import pytest

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.runtime.recording import Recording

STRICT = ("-Wall", "-Wextra", "-Wpedantic", "-Werror", "-ffp-contract=off")
LANGUAGES: Mapping[str, Sequence[str]] = {"C99": ("gcc", "-std=c99"), "C++17": ("g++", "-std=c++17", "-xc++")}


def exported(
    network: CompiledNetwork,
    folder: Path,
    language: str = "C99",
    start: Recording | None = None,
    real: str = "double",
) -> Controller:
    """A network exported, compiled strictly, and loaded."""
    network.export(folder, start=start, real=real)
    return built(network, folder, language, real)


def built(network: CompiledNetwork, folder: Path, language: str = "C99", real: str = "double") -> Controller:
    """The code that lies in a folder, compiled strictly, and loaded."""
    (header,) = folder.glob("*.h")
    name = header.stem
    source = (folder / f"{name}.c").read_text(encoding="ascii")
    size = f"""
#ifdef __cplusplus
extern "C"
#endif
size_t size_of_state(void);
size_t size_of_state(void) {{ return sizeof({name}_state); }}
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
    n, m = len(network.network.neurons), len(network.network.connections)
    return Controller(name, n, m, real, ctypes.CDLL(str(library)))


class Controller:
    """An exported controller and its state."""

    def __init__(self, name: str, neurons: int, connections: int, real: str, library: ctypes.CDLL) -> None:
        self.name, self.neurons, self.connections, self.library = name, neurons, connections, library
        library.size_of_state.restype = ctypes.c_size_t
        self.memory = (ctypes.c_char * library.size_of_state()).from_buffer_copy(b"\xa5" * library.size_of_state())
        self.kind = np.dtype(np.float32 if real == "float" else np.float64)
        self._call("init")(ctypes.addressof(self.memory))

    def _call(self, name: str) -> Callable[..., int]:
        called = getattr(self.library, f"{self.name}_{name}")
        called.restype = ctypes.c_int
        return lambda *arguments: int(called(*(ctypes.c_void_p(a) if isinstance(a, int) else a for a in arguments)))

    def step(self, inputs: FloatArray | None = None, outputs: int = 0) -> FloatArray:
        """A step; ``inputs`` are those without a source, in order. Gives the numbers of its ``outputs``, so many."""
        given = None if inputs is None else np.ascontiguousarray(inputs, dtype=self.kind)
        out = np.full(outputs, np.nan, dtype=self.kind)
        start = out.ctypes.data if outputs else 0
        self._call("step")(ctypes.addressof(self.memory), 0 if given is None else given.ctypes.data, start)
        return out.astype(np.float64)

    def set(self, name: str, value: float) -> bool:
        """Set a parameter."""
        kind = ctypes.c_float if self.kind.itemsize == 4 else ctypes.c_double
        return bool(self._call(f"set_{name}")(ctypes.addressof(self.memory), kind(value)))

    @property
    def activity(self) -> FloatArray:
        """The activities of now."""
        return np.frombuffer(self.memory, self.kind, self.neurons).astype(np.float64)

    @property
    def weights(self) -> FloatArray:
        """The weights of now."""
        return np.frombuffer(self.memory, self.kind, self.connections, self.neurons * self.kind.itemsize).astype(
            np.float64
        )

    def fired(self) -> AbstractSet[int]:
        """The neurons that have fired in the last step."""
        mask = (ctypes.c_ubyte * self.neurons)(*([7] * self.neurons))
        count = self._call("fired")(ctypes.addressof(self.memory), ctypes.addressof(mask))
        assert set(mask) <= {0, 1}
        assert sum(mask) == count
        return {neuron for neuron, one in enumerate(mask) if one}
