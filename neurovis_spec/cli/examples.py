"""The examples that are shipped, and the networks of the manual to start from.

In: nothing. Out: their names, files and texts.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from importlib.resources import files as package_files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from neurovis_spec.manual.networks import Start


def example_folder() -> Traversable:
    """Where the examples are: in an installed package beside the code, in a checkout in ``specs/``."""
    package = package_files("neurovis_spec")
    inside = package.joinpath("examples")
    return inside if inside.is_dir() else Path(str(package)).parent / "specs"


def examples_at_hand() -> Mapping[str, Traversable]:
    """The examples by name, with the folder of each: that of all, or one of its own with the same name."""
    folder = example_folder()
    found: dict[str, Traversable] = {}
    for entry in folder.iterdir() if folder.is_dir() else ():
        if entry.name.endswith(".yaml"):
            found[entry.name.removesuffix(".yaml")] = folder
        elif entry.is_dir() and entry.joinpath(f"{entry.name}.yaml").is_file():
            found[entry.name] = entry
    return dict(sorted(found.items()))


def example_specs() -> Mapping[str, Path]:
    """The files of the examples, by name."""
    found = ((name, folder.joinpath(f"{name}.yaml")) for name, folder in examples_at_hand().items())
    return {name: path for name, path in found if isinstance(path, Path)}


def starts() -> Iterable[Start]:
    """The manual's networks to start from."""
    from neurovis_spec.manual import networks

    return networks.starts()
