"""What a command may write to: a path that can be written, and none of those that it reads.

In: the path of an output, those of the inputs, a compiled network. Out: nothing, or an error before any work is done.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import click

from neurovis_spec.cli.failure import fault
from neurovis_spec.real_paths import CIRCLE, is_circular

if TYPE_CHECKING:
    from neurovis_spec.compiled import CompiledNetwork


def check_target(path: Path | None, inputs: Iterable[tuple[str, str | None]] = (), option: str = "-o") -> None:
    """Refuse a path that cannot be written, or is one of the ``inputs``: what each is, in words, and its path."""
    if path is None:
        return
    refuse_dash(path, "file", option)
    for what, read in inputs:
        if read is not None and read != "-" and (_same(path, Path(read)) or _is_part_of(Path(read), path)):
            raise _refused(path, what, option)
    refuse_circle(path)
    if path.is_dir():
        raise fault(f"{path} is a folder, not a file")
    if not path.parent.is_dir():
        raise fault(f"{path}: there is no folder '{path.parent}'", f"make it: mkdir -p {path.parent}")


def check_folder(path: Path, option: str = "-o") -> None:
    """Refuse a folder that is something else, or that could not be made."""
    refuse_dash(path, "folder", option)
    refuse_circle(path)
    if path.exists() and not path.is_dir():
        raise fault(f"{path} is a file, not a folder", "name a folder; it is made if it is not there")
    if not path.parent.is_dir():
        raise fault(f"{path}: there is no folder '{path.parent}'", f"make it: mkdir -p {path.parent}")


def refuse_dash(path: Path, kind: str, option: str = "-o") -> None:
    """Refuse what means standard output elsewhere, where a file or a folder is asked for."""
    if str(path) == "-":
        raise click.UsageError(f"{option} takes a {kind}: what is written does not go to standard output ('-')")


def refuse_circle(path: Path) -> None:
    """Refuse a path on which links lead round in a circle."""
    if is_circular(path):
        raise fault(f"{path}: {CIRCLE}", "remove these links, or choose another name")


def files_of(inputs: Mapping[str, str]) -> list[tuple[str, str | None]]:
    """What the files of inputs are, in words, and their paths."""
    return [(f"the file of the input '{name}'", path) for name, path in inputs.items()]


def check_files(path: Path | None, network: CompiledNetwork, option: str = "-o", *, layout: bool = False) -> None:
    """Refuse a path that is a file of the spec: one that it includes, or reads data from. ``layout``: what is written
    is a layout file, so it may be the one that the spec names."""
    if path is None:
        return
    memory = network.layout_file
    for file in sorted(network.files):
        is_memory = memory is not None and _same(file, memory)
        if _same(path, file) and not (layout and is_memory):
            what = "the layout file of the spec" if is_memory else f"a file that the spec reads ('{_near(file)}')"
            raise _refused(path, what, option)


def _refused(path: Path, what: str, option: str) -> click.UsageError:
    return click.UsageError(f"{option} {path} is {what}, which would be lost: name another file")


def _same(one: Path, other: Path) -> bool:
    """Whether two paths lead to the same file, through whatever links."""
    if os.path.realpath(one) == os.path.realpath(other):
        return True
    try:
        return one.samefile(other)
    except OSError:
        return False


def _is_part_of(part: Path, path: Path) -> bool:
    """Whether one is the part of a recording, and the other what it was to become: writing that clears the part."""
    from neurovis_spec.runtime.parts import target_of

    target = target_of(part)
    return target is not None and _same(target, path)


def _near(path: Path) -> str:
    """A path as one names it from here."""
    try:
        return str(path.relative_to(Path.cwd()))
    except ValueError:
        return str(path)
