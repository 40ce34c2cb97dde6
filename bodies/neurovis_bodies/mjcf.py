"""The files that a model of MuJoCo names: included models, meshes, textures, height fields.

In: the path of a file in MJCF. Out: where each file that it names may lie, if the model makes no more points of
textures and height fields than memory is good for. Nothing but the text and the sizes of images is read, and the text
only so far as it is XML that has no definitions of its own (no DOCTYPE), so that whoever opens it later reads the same.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path, PureWindowsPath
from typing import Final
from xml.parsers import expat

from neurovis_spec.body import BodyError

#: bytes of a file in MJCF: those of large scenes have some hundred thousand
LARGEST: Final = 16 << 20
#: models that are part of others, and how deep
MOST_FILES: Final = 1000
#: what is read as a model of its own
_MODELS: Final = ("include", "model")
#: where the files of the other elements are looked for, by keys of ``compiler``
_FOLDERS: Final = {
    "texture": ("texturedir", "assetdir"),
    "hfield": ("meshdir", "assetdir"),
    "": ("meshdir", "assetdir"),
}
#: what is made of points: which keys say of how many, what they are called, how many there are at most in all, as
#: MuJoCo takes some 6 bytes for one of a texture and 16 for one of a height field
_POINTS: Final = {
    "texture": (("width", "height"), "textures", 1 << 28),
    "hfield": (("nrow", "ncol"), "height fields", 1 << 26),
}
#: how an image begins that is compressed (PNG), and how many bytes say how large it is
_PNG: Final = b"\x89PNG\r\n\x1a\n"
_PNG_HEAD: Final = 24


@dataclass
class _Text:
    """What a file says: the names of files by the kind of the element that names them, the folders that ``compiler``
    names, how many points are made. MuJoCo takes a backslash for a slash, everywhere."""

    files: dict[str, list[str]] = field(default_factory=dict)
    folders: dict[str, list[str]] = field(default_factory=dict)
    #: what it says of how many points textures and height fields have, that are in no file
    points: dict[str, float] = field(default_factory=dict)

    def begin(self, element: str, attributes: dict[str, str]) -> None:
        """An element begins."""
        kind = element if element in (*_MODELS, *_FOLDERS) else ""
        for key, value in attributes.items():
            path = value.replace("\\", "/")
            if element == "compiler" and key.endswith("dir"):
                self.folders.setdefault(key, []).append(path)
            elif key.startswith("file"):  # of a texture also fileright, fileup, …
                self.files.setdefault(kind, []).append(path)
        if element in _POINTS:
            sides = 1 if element == "hfield" or attributes.get("type", "cube") == "2d" else 6
            made = math.prod(_number(attributes.get(key)) for key in _POINTS[element][0])
            self.points[element] = self.points.get(element, 0.0) + sides * made

    def named(self, kinds: Iterable[str]) -> list[str]:
        """The names of files that elements of these kinds give."""
        return [name for kind in kinds for name in self.files.get(kind, ())]


def files_of(path: Path) -> Iterator[Path]:
    """Where the files may lie that a model names, those of the models in it, too; the model itself is left out.

    A name is looked for beside the first model and beside the one that names it, in the folders that any of them gives
    for files of its kind. No file is opened before its place was given. Raises BodyError, also where the model has too
    many points.
    """
    texts = {path: _read(path)}
    read, waiting = {Path(os.path.realpath(path))}, [path]
    while waiting:
        own = waiting.pop()
        for place in _places(path, own, texts[own].named(_MODELS), ()):
            yield place
            real = Path(os.path.realpath(place))
            if real not in read and real.is_file():
                if len(texts) == MOST_FILES:
                    raise BodyError(f"the model consists of more than {MOST_FILES:,} files")
                texts[place] = _read(place)
                read.add(real)
                waiting.append(place)
    for kind, keys in _FOLDERS.items():
        folders = [folder for one in texts.values() for key in keys for folder in one.folders.get(key, ())]
        points = sum(text.points.get(kind, 0.0) for text in texts.values())
        for own, text in texts.items():
            for name in text.named((kind,)):
                images = [0.0]
                for place in _places(path, own, (name,), folders):
                    yield place
                    images.append(_points_of(place) if kind in _POINTS else 0.0)
                points += max(images)
        _check_points(kind, points)


def _check_points(kind: str, points: float) -> None:
    """Refuse more points than memory is good for. Raises BodyError."""
    _, called, most = _POINTS.get(kind, ((), "", math.inf))
    if points > most:
        raise BodyError(f"the model has {called} of {points:,.0f} points: {most:,} are the most")


def _points_of(place: Path) -> float:
    """How many points an image has by what it says at its beginning; 0 where it is none, or not compressed: then it is
    as large as its file."""
    try:
        if not place.is_file():
            return 0.0
        with place.open("rb") as file:
            head = file.read(_PNG_HEAD)
    except OSError:
        return 0.0  # whoever opens it later says so
    if len(head) < _PNG_HEAD or not head.startswith(_PNG):
        return 0.0
    return float(math.prod(int.from_bytes(head[at : at + 4], "big") for at in (16, 20)))


def _number(written: str | None) -> float:
    """A number as it is written; 0 where it is none, as MuJoCo will say."""
    try:
        number = float(written or 0)
    except ValueError:
        return 0.0
    return number if 0 < number < math.inf else 0.0


def _places(first: Path, own: Path, names: Iterable[str], folders: Iterable[str]) -> Iterator[Path]:
    """Where files of these names may lie that a model names which is a part of the first."""
    within = [Path(), *(Path(folder) for folder in folders)]
    for name in names:
        if "\0" in name or Path(name).is_absolute() or PureWindowsPath(name).drive:
            raise BodyError(f"'{own.name}' names the file '{name[:80]}', which is no path relative to the model")
        for place in (base / folder / name for base in (first.parent, own.parent) for folder in within):
            yield place
            yield Path(os.path.normpath(place))  # as MuJoCo does, which knows of no links


def _read(path: Path) -> _Text:
    try:
        with path.open("rb") as file:
            data = file.read(LARGEST + 1)
    except OSError as error:
        raise BodyError(f"'{path.name}' cannot be read: {error.strerror or error}") from None
    if len(data) > LARGEST:
        raise BodyError(f"'{path.name}' has more than {LARGEST >> 20} MB: no model is as large")
    found = _Text()
    parser = expat.ParserCreate("utf-8")  # whatever the file says of itself: MuJoCo reads no other encoding
    parser.StartElementHandler = found.begin
    parser.StartDoctypeDeclHandler = lambda *_: _refuse_doctype(path)
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        reason = expat.ErrorString(error.code)
        message = f"'{path.name}' is no XML: {reason}, line {error.lineno}, column {error.offset + 1}"
        raise BodyError(message, "a model is a file in MJCF, the XML of MuJoCo") from None
    return found


def _refuse_doctype(path: Path) -> None:
    raise BodyError(f"'{path.name}' has a DOCTYPE, which MJCF does not know", "remove it")
