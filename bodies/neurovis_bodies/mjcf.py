"""The files that a model of MuJoCo names: included models, meshes, textures, height fields.

In: the path of a file in MJCF. Out: where each file that it names may lie. Nothing but the text is read, and only so
far as it is XML that has no definitions of its own (no DOCTYPE), so that whoever opens it later reads the same.
"""

from __future__ import annotations

from collections.abc import Iterator
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
_FOLDERS: Final = {"texture": ("texturedir", "assetdir"), "": ("meshdir", "assetdir")}


@dataclass
class _Text:
    """What a file says: elements that name files, with these names; the folders that ``compiler`` names."""

    named: list[tuple[str, str]] = field(default_factory=list)
    folders: dict[str, list[str]] = field(default_factory=dict)

    def begin(self, element: str, attributes: dict[str, str]) -> None:
        """An element begins."""
        if element == "compiler":
            for key in ("meshdir", "texturedir", "assetdir"):
                if key in attributes:
                    self.folders.setdefault(key, []).append(attributes[key])
        for key, value in attributes.items():
            if key.startswith("file"):  # of a texture also fileright, fileup, …
                self.named.append((element, value))


def files_of(path: Path) -> Iterator[Path]:
    """Where the files may lie that a model names, those of the models in it, too; the model itself is left out.

    A name is looked for beside the first model and beside the one that names it, in the folders that either gives for
    files of its kind. Raises BodyError.
    """
    first = _read(path)
    seen = {path}
    waiting = [(path, first)]
    folders = {key: list(values) for key, values in first.folders.items()}
    while waiting:
        own, text = waiting.pop()
        for key, values in text.folders.items():
            folders.setdefault(key, []).extend(values)
        for element, name in text.named:
            _check_relative(name, own)
            keys = () if element in _MODELS else _FOLDERS.get(element, _FOLDERS[""])
            within = [Path(), *(Path(folder) for key in keys for folder in folders.get(key, ()))]
            for base in dict.fromkeys((path.parent, own.parent)):
                for folder in within:
                    place = base / folder / name
                    yield place
                    if element in _MODELS and place not in seen and place.is_file():
                        seen.add(place)
                        if len(seen) > MOST_FILES:
                            raise BodyError(f"the model consists of more than {MOST_FILES:,} files")
                        waiting.append((place, _read(place)))


def _check_relative(name: str, own: Path) -> None:
    """Whatever lies elsewhere on the machine is not the model's."""
    if "\0" in name or Path(name).is_absolute() or PureWindowsPath(name).drive or name.startswith(("/", "\\")):
        raise BodyError(f"'{own.name}' names the file '{name[:80]}', which is no path relative to the model")


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
