"""The files of a recording that goes on from file to file: ``NAME.mcap``, ``NAME-1.mcap``, ….

In: the path of the first. Out: the paths of those that go on where it ends.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from neurovis_spec.runtime.errors import RecordingError


def place(path: Path, number: int) -> Path:
    """The path of the file with a number, from 0; of a folder, the file in it."""
    if not path.suffix:
        return path / f"{path.name}_{number}.mcap"
    return path if not number else path.with_name(f"{path.stem}-{number}{path.suffix}")


def following(path: Path, about: Mapping[str, str], about_of: Callable[[Path], Mapping[str, str]]) -> Iterator[Path]:
    """The further files of a recording, by what each says ``about`` itself: it is one of the same recording."""
    number = 1
    while "recording" in about and place(path, number).is_file():
        try:
            said = about_of(place(path, number))
        except RecordingError:
            return
        if said.get("recording") != about["recording"]:
            return
        yield place(path, number)
        number += 1
