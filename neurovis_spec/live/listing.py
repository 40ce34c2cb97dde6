"""What the gallery lists: examples, and the specs in a folder.

In: a folder. Out: a Listed for each spec in it. The walk is bounded, follows no links to folders and goes into none
that are hidden, installed or made by programs. What is a spec is told by its keys: it is read when it is looked at.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

#: How deep the walk goes, how many folders it looks into and how many specs it finds at most.
DEEP, FOLDERS, MOST = 4, 500, 100
#: Bytes of a file in which its keys are looked for; of a larger one they stand at the beginning, too.
_LOOKED_AT: Final = 1 << 16
_LEFT_OUT: Final = frozenset({"node_modules", "site-packages", "__pycache__", "build", "dist"})
_SPEC: Final = re.compile(rb"^neurovis[ \t]*:", re.MULTILINE)
#: What an included file does not have.
_NETWORK: Final = re.compile(rb"^(neurons|instances)[ \t]*:", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Listed:
    """A spec that can be opened: what it is called, under which heading it stands, and its file, or its text where it
    has none. ``own`` says whether the user may write it."""

    name: str
    heading: str
    path: Path | None = None
    text: str = ""
    own: bool = False


def specs_in(folder: Path) -> list[Listed]:
    """The specs in a folder, by their paths from there, in order; the nearer first."""
    found: list[Listed] = []
    for path in _files(folder):
        if _is_spec(path):
            name = path.relative_to(folder).as_posix()
            found.append(Listed(name, "in this folder", path, own=os.access(path, os.W_OK)))
            if len(found) == MOST:
                break
    return found


def _files(folder: Path) -> Iterator[Path]:
    """YAML files in a folder and in those within it, level by level."""
    waiting, looked = [(folder, 0)], 0
    while waiting and looked < FOLDERS:
        here, depth = waiting.pop(0)
        looked += 1
        try:
            entries = sorted(os.scandir(here), key=lambda entry: entry.name)
        except OSError:
            continue
        names = {entry.name for entry in entries}
        if depth and "pyvenv.cfg" in names:
            continue
        for entry in entries:
            if entry.name.startswith(".") or entry.name in _LEFT_OUT:
                continue
            try:
                if entry.is_dir(follow_symlinks=False):
                    if depth < DEEP:
                        waiting.append((here / entry.name, depth + 1))
                elif entry.name.endswith((".yaml", ".yml")) and entry.is_file():  # who opens a pipe waits for ever
                    yield here / entry.name
            except OSError:
                continue


def _is_spec(path: Path) -> bool:
    try:
        with path.open("rb") as file:
            begin = file.read(_LOOKED_AT)
    except OSError:
        return False
    return _SPEC.search(begin) is not None and _NETWORK.search(begin) is not None
