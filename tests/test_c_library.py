"""The cache of compiled libraries: shared, bounded, and not needed."""

from __future__ import annotations

import ctypes
import json
import os
import shutil
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from networks_by_hand import cpg_rbf

from neurovis_spec.runtime import c_library
from neurovis_spec.runtime.backend import ENVIRONMENT_VARIABLE, available, choose_backend, listing
from neurovis_spec.runtime.c_library import folder, load, place

pytestmark = pytest.mark.compiler

TEXT = "int answer(void);\nint answer(void) { return %d; }\n"


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return folder()


def test_what_was_compiled_is_not_compiled_again(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert load(TEXT % 42).answer() == 42
    assert [path.name for path in cache.iterdir()] == [place(TEXT % 42).name]
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: pytest.fail("it was compiled again"))
    assert load(TEXT % 42).answer() == 42


def test_where_the_cache_cannot_be_written_a_temporary_folder_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert load(TEXT % 43).answer() == 43


def test_a_broken_library_is_made_anew(cache: Path) -> None:
    cache.mkdir(parents=True)
    place(TEXT % 44).write_bytes(b"half")
    assert load(TEXT % 44).answer() == 44


@pytest.mark.parametrize("kind", ["a pipe", "a link to a pipe", "a device", "a file without bytes", "a folder"])
def test_what_is_no_library_is_not_opened(kind: str, cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A pipe in the place of a library would have every run wait for ever."""
    cache.mkdir(mode=0o700, parents=True)
    kept = place(TEXT % 48)
    if kind == "a pipe":
        os.mkfifo(kept)
    elif kind == "a link to a pipe":
        os.mkfifo(cache / "pipe")
        kept.symlink_to(cache / "pipe")
    elif kind == "a device":
        kept.symlink_to("/dev/zero")
    elif kind == "a folder":
        kept.mkdir()
    else:
        kept.touch()

    def opened(path: str) -> ctypes.CDLL:
        assert Path(path).is_file()
        return library(path)

    library = ctypes.CDLL
    monkeypatch.setattr(ctypes, "CDLL", opened)
    assert load(TEXT % 48).answer() == 48
    assert load(TEXT % 48).answer() == 48
    assert kept.is_file() == (kind != "a folder")  # which stays: nothing of a user's is removed


def test_the_cache_is_bounded_and_the_oldest_goes(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    load(TEXT % 1)
    monkeypatch.setattr(c_library, "MOST_BYTES", 2 * place(TEXT % 1).stat().st_size)
    for number in (2, 3, 4):
        load(TEXT % number)
    assert {path.name for path in cache.iterdir()} == {place(TEXT % number).name for number in (3, 4)}


def test_a_compiler_loads_no_library_of_the_wheels_of_ros(
    cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiler = tmp_path / "cc"
    compiler.write_text(f'#!/bin/sh\nenv > {tmp_path}/environment\nexec gcc "$@"\n')
    compiler.chmod(0o755)
    monkeypatch.setenv("CC", str(compiler))
    monkeypatch.setenv("LD_LIBRARY_PATH", "/nowhere")
    for number, (wheels, given) in enumerate(((None, True), ("1", False))):
        if wheels is not None:
            monkeypatch.setenv("_ROS_WHEELS_BOOTSTRAP_COMPLETE", wheels)
        assert load(TEXT % (50 + number)).answer() == 50 + number
        told = (tmp_path / "environment").read_text()
        assert ("LD_LIBRARY_PATH=/nowhere" in told) == given
        assert "_ROS_WHEELS" not in told


def test_several_may_compile_the_same_at_once(cache: Path) -> None:
    found: list[int] = []
    threads = [threading.Thread(target=lambda: found.append(load(TEXT % 45).answer())) for _ in range(4)]
    program = f"from neurovis_spec.runtime.c_library import load; print(load({TEXT % 45!r}).answer())"
    other = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == [45] * 4
    assert other.communicate()[0].strip() == "45"
    assert len(list(cache.iterdir())) == 1


def test_without_a_compiler_the_listing_says_why(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr(c_library, "find_spec", lambda name: None)
    c_library._compiler.cache_clear()
    assert not available("c").available
    assert "pip install 'neurovis-spec[c]'" in next(line for line in listing() if line.startswith("c unavailable: "))
    monkeypatch.setenv("CC", "no-such-compiler -m64")
    assert "no-such-compiler" in available("c").note


def test_a_library_that_somebody_else_may_have_put_there_is_not_loaded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where others may write to the cache, it is passed over: what it holds would run as this user."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    text = "int answer(void) { return 42; }\n"
    kept = c_library.place(text)
    assert c_library.load(text).answer() == 42
    assert kept.exists()
    before = kept.stat().st_mtime_ns
    kept.parent.chmod(0o777)
    assert c_library.load(text).answer() == 42
    assert kept.stat().st_mtime_ns == before


def test_without_any_other_compiler_that_of_the_package_ziglang_is_taken(
    cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Code for any machine of this kind, since several may share the cache; and it keeps its own things in ours."""
    package = tmp_path / "packages" / "ziglang"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text("")
    compiler = next(found for name in ("cc", "gcc", "clang") if (found := shutil.which(name)))
    (package / "__main__.py").write_text(
        "import json, os, subprocess, sys\n"
        "said = {'arguments': sys.argv[1:3], 'cache': os.environ['ZIG_GLOBAL_CACHE_DIR']}\n"
        f"open({str(tmp_path / 'said')!r}, 'w').write(json.dumps(said))\n"
        f"path = {{**os.environ, 'PATH': {str(Path(compiler).parent)!r}}}\n"
        f"sys.exit(subprocess.call([{compiler!r}, *sys.argv[3:]], env=path))\n"
    )
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.syspath_prepend(str(package.parent))
    monkeypatch.setenv("PYTHONPATH", str(package.parent))
    c_library._compiler.cache_clear()
    assert load(TEXT % 47).answer() == 47
    assert available("c").note.endswith("compiled by ziglang")
    monkeypatch.delenv(ENVIRONMENT_VARIABLE)
    assert choose_backend(cpg_rbf())[0] == "numpy"  # it takes seconds when it is first used: who wants it asks for it
    said = json.loads((tmp_path / "said").read_text())
    assert said == {"arguments": ["cc", "-mcpu=baseline"], "cache": str(cache / "zig")}
