"""Includes: the files whose modules and definitions a spec uses.

In: the paths that a spec names under ``include``, the folders they may lie in. Out: the included files as models, each
once however often it is named, in the order in which they are met, with the folder that their own paths are relative
to. Findings about what an included file holds point into that file.
"""

from __future__ import annotations

import os.path
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, NamedTuple, TypeAlias

from neurovis_spec.diagnostics import Findings, shorten
from neurovis_spec.language.data.files import NamedFile, locate
from neurovis_spec.language.located import Located
from neurovis_spec.language.shape import read_included
from neurovis_spec.language.spec import IncludedModel, Spec
from neurovis_spec.language.unknown import UNKNOWN
from neurovis_spec.language.yaml.opening import FileFault, read_bytes
from neurovis_spec.language.yaml.reader import LARGEST, read_content
from neurovis_spec.real_paths import real_path

#: The most files that a spec may include, and how deep files may include one another.
MOST: Final = 1000
DEEPEST: Final = 64
#: Gives at most so many bytes of a file, or says why not.
ReadBytes: TypeAlias = Callable[[Path, int], bytes | FileFault]


class Included(NamedTuple):
    """An included file: what it holds, and the folder that its paths are relative to."""

    model: IncludedModel
    folder: Path


class Includes(NamedTuple):
    """All included files. ``complete`` says whether each of them could be read."""

    files: tuple[Included, ...] = ()
    complete: bool = True


def read_includes(spec: Spec, folder: Path, root: Path, findings: Findings, read: ReadBytes = read_bytes) -> Includes:
    """The files that a spec includes, and those that these include; ``read`` gives the bytes of a file.

    Codes: those of data files (``path-outside``, ``file-missing``, …), ``include-cycle``, ``too-many``, ``too-deep``,
    and whatever is found in the files.
    """
    reader = _Reader(root, findings, read)
    own = folder / Path(spec.source.span.file).name
    reader.follow(spec.include, spec.source.span.file, folder, (real_path(own),))
    return Includes(tuple(reader.found), reader.complete and "include" not in spec.unknown)


@dataclass
class _Reader:
    root: Path
    findings: Findings
    bytes_of: ReadBytes
    found: list[Included] = field(default_factory=list)
    read: set[Path] = field(default_factory=set)
    complete: bool = True

    def follow(self, paths: tuple[Located[str], ...], file: str, folder: Path, way: tuple[Path, ...]) -> None:
        """Read these paths, named in ``file``; ``way`` are the files that led here."""
        for path in paths:
            # what is wrong within a file that could be read is UNKNOWN in that file; nothing more is, because of it
            done = self._one(path, file, folder, way)  # which follows paths of its own
            self.complete &= done

    def _one(self, path: Located[str], file: str, folder: Path, way: tuple[Path, ...]) -> bool:
        """Read one file; whether it could be read."""
        place = locate(NamedFile(path.value, self.root, folder, path.span), self.findings)
        if place is UNKNOWN:
            return False
        if place in way:
            names = [step.name for step in (*way[way.index(place) :], place)]
            message = f"these files include each other: {' -> '.join(_few(names))}"
            self.findings.error("include-cycle", path.span, message, "move what both need into a file of its own")
            return False
        if place in self.read:
            return True
        self.read.add(place)
        if len(self.read) > MOST:
            if len(self.read) == MOST + 1:
                self.findings.error("too-many", path.span, f"a spec includes at most {MOST:,} files")
            return False
        if len(way) > DEEPEST:
            self.findings.error("too-deep", path.span, f"files include one another at most {DEEPEST} deep")
            return False
        data = self.bytes_of(place, LARGEST)
        if isinstance(data, FileFault):
            self.findings.error(data.code, path.span, f"the file '{shorten(path.value)}' {data.reason}")
            return False
        name = os.path.normpath(Path(file).parent / path.value)
        document = read_content(data, name, self.findings)
        model = None if document is None else read_included(document, self.findings)
        if model is None:
            return False
        self.follow(model.include, name, place.parent, (*way, place))
        self.found.append(Included(model, place.parent))
        return True


def _few(names: list[str]) -> Iterator[str]:
    """The names of a long way, its middle left out."""
    return iter(names if len(names) <= 8 else [*names[:4], "…", *names[-3:]])
