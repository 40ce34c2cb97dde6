"""Shared libraries out of C: which compiler there is, and a cache of what it has made.

In: the text of one C file. Out: the library, loaded with ctypes. Compiled libraries are kept by the hash of all that
makes them, in the user's cache folder; each is written beside its place and moved there, so that two processes may
compile at once. Where the cache cannot be written, a temporary folder is used, and nothing is kept.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import platform
import shlex
import shutil
import subprocess
import sys
import tempfile
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path

from neurovis_spec import user_cache
from neurovis_spec.language.expressions.emit_c import INEXACT
from neurovis_spec.runtime.environment import for_others

#: No option changes what IEEE 754 says of an operation, but for flags and traps that nobody reads.
FLAGS = (
    "-std=c99",
    "-O2",
    "-ffp-contract=off",
    "-fno-math-errno",
    "-fno-trapping-math",
    "-ftree-vectorize",
    *(f"-fno-builtin-{name}" for name in INEXACT),
)
#: Where Linux tells what the processor can do.
_PROCESSOR = Path("/proc/cpuinfo")
#: The cache holds at most so many bytes; what was used longest ago goes first.
MOST_BYTES = user_cache.MOST_BYTES
_SUFFIX = {"win32": ".dll", "darwin": ".dylib"}.get(sys.platform, ".so")


class CompilerError(ValueError):
    """There is no C compiler, or it cannot make a library."""


@dataclass(frozen=True, slots=True)
class Compiler:
    """A command that compiles C; ``name`` as one would call it, ``stamp`` changes when it is another. What is taken
    ``on_request`` alone is slow when it is first used."""

    command: tuple[str, ...]
    name: str
    stamp: str
    on_request: bool = False


def compiler() -> Compiler:
    """The compiler that is there: ``CC``, else cc, gcc, clang, else that of the package ziglang. Raises
    CompilerError."""
    return _compiler(os.environ.get("CC", ""), os.environ.get("PATH", ""))


def is_asked_for() -> bool:
    """Whether the environment says which compiler to take: without it, who asked has to be told."""
    return bool(os.environ.get("CC", "").strip())


@cache
def _compiler(chosen: str, path: str) -> Compiler:
    if chosen.strip():
        try:
            command = tuple(shlex.split(chosen))
        except ValueError:
            raise CompilerError(f"CC is no command: {chosen!r}") from None
        found = shutil.which(command[0], path=path)
        if found is None:
            raise CompilerError(f"CC names '{command[0]}', which is not there")
        return Compiler((found, *command[1:]), chosen, _stamp(found))
    for name in ("cc", "gcc", "clang"):
        found = shutil.which(name, path=path)
        if found is not None:
            return Compiler((found,), name, _stamp(found))
    try:
        zig = find_spec("ziglang")
    except (ImportError, ValueError):
        zig = None
    if zig is not None and zig.origin is not None:
        # it makes code for this very processor unless it is told otherwise: another machine may share the cache
        command = (sys.executable, "-m", "ziglang", "cc", "-mcpu=baseline")
        return Compiler(command, "ziglang", _stamp(zig.origin), on_request=True)
    raise CompilerError("there is no C compiler; pip install 'neurovis-spec[c]' brings one")


def _stamp(path: str) -> str:
    """Where a file really lies, its size and its age: another where a compiler was replaced."""
    try:
        real = os.path.realpath(path)
        status = Path(real).stat()
    except OSError:
        return path
    return f"{real} {status.st_size} {status.st_mtime_ns}"


@cache
def options() -> tuple[str, ...]:
    """What every text is compiled with: ``FLAGS``, and where this processor can work on four numbers at once, that it
    may. That joins no product to a sum, so the bits stay."""
    try:
        able = platform.machine() == "x86_64" and "avx2" in _PROCESSOR.read_text(encoding="ascii").split()
    except (OSError, UnicodeError):
        able = False
    return (*FLAGS, "-mavx2") if able else FLAGS


def folder() -> Path:
    """Where compiled libraries are kept."""
    return user_cache.folder("c")


def place(text: str) -> Path:
    """Where the library of a text is, once it is compiled. Raises CompilerError."""
    made_by = compiler()
    parts = (
        text,
        *made_by.command,
        made_by.stamp,
        *options(),
        platform.machine(),
        sys.platform,
        str(ctypes.sizeof(ctypes.c_void_p)),
    )
    return folder() / (hashlib.sha256("\0".join(parts).encode()).hexdigest()[:40] + _SUFFIX)


def load(text: str) -> ctypes.CDLL:
    """The library of a text: from the cache, else compiled now. Raises CompilerError."""
    path = place(text)
    try:
        if not user_cache.is_ours(path.parent):
            raise OSError("not a folder that this user alone writes to")
        if not path.is_file():  # who opens a pipe waits for ever
            raise OSError("no file")
        library = ctypes.CDLL(str(path))
    except OSError:  # not there, or no library
        return _compile_and_load(text, path)
    with suppress(OSError):
        os.utime(path)
    return library


def _compile_and_load(text: str, path: Path) -> ctypes.CDLL:
    """Compile into the cache, or where that cannot be, in a temporary folder."""
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        if not user_cache.is_ours(path.parent):
            raise OSError("not a folder that this user alone writes to")
        with tempfile.TemporaryDirectory(dir=path.parent, prefix=".making") as temporary:
            _compile(text, Path(temporary), path.parent / "zig").replace(path)
            library = ctypes.CDLL(str(path))
        user_cache.trim(path.parent, path, MOST_BYTES)
        return library
    except OSError:
        pass
    try:
        with tempfile.TemporaryDirectory(prefix="neurovis", ignore_cleanup_errors=True) as temporary:
            return ctypes.CDLL(str(_compile(text, Path(temporary), Path(temporary) / "zig")))
    except OSError as error:
        raise CompilerError(f"what is compiled cannot be written or loaded: {error}") from None


def _compile(text: str, into: Path, zig: Path) -> Path:
    """Make the library of a text in a folder; ``zig`` is where ziglang may keep what it makes for itself (it waits for
    ever where it cannot write). Raises OSError where the folder cannot be written to, CompilerError where the compiler
    fails."""
    source, library = into / "network.c", into / f"network{_SUFFIX}"
    source.write_text(text, encoding="ascii")
    made_by = compiler()
    command = [*made_by.command, *options(), "-w", "-shared"]
    if sys.platform != "win32":
        command.append("-fPIC")
    command += ["-o", str(library), str(source)]
    if sys.platform != "win32":
        command.append("-lm")
    zig_folders = {"ZIG_GLOBAL_CACHE_DIR": str(zig), "ZIG_LOCAL_CACHE_DIR": str(into / "zig-local")}
    try:
        result = subprocess.run(
            command,
            cwd=into,
            env={**zig_folders, **for_others()},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            check=False,
        )
    except OSError as error:
        raise CompilerError(f"'{made_by.name}' cannot be started: {error.strerror}") from None
    if result.returncode != 0 or not library.exists():
        output = result.stdout.decode(errors="replace").strip().splitlines()
        first = next((line for line in output if "error" in line), output[0] if output else "").strip()[:300]
        why = f"({first})" if first else f"with status {result.returncode}"
        raise CompilerError(f"'{made_by.name}' fails {why}")
    return library
