"""The examples in docstrings are true."""

from __future__ import annotations

import doctest
import pkgutil
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType

import neurovis_layouts
import neurovis_renderers
import pytest

import neurovis_spec


def modules(package: ModuleType) -> list[str]:
    found = pkgutil.walk_packages(package.__path__, f"{package.__name__}.")
    return [module.name for module in found if not module.name.endswith("__main__")]


#: what imports a ROS, which need not be there
WITH_ROS = ("neurovis_spec.ros.ros1", "neurovis_spec.ros.ros2")
PACKAGES = (neurovis_spec, neurovis_layouts, neurovis_renderers)
MODULES = [name for package in PACKAGES for name in modules(package) if name not in WITH_ROS]


def has_examples(name: str) -> bool:
    """Whether anything in the source of a module begins as an example does."""
    source = find_spec(name)
    return source is not None and source.origin is not None and ">>> " in Path(source.origin).read_text("utf-8")


WITH_EXAMPLES = [name for name in MODULES if has_examples(name)]


@pytest.mark.parametrize("name", WITH_EXAMPLES)
def test_examples(name: str) -> None:
    assert doctest.testmod(import_module(name)).failed == 0


def test_there_are_examples() -> None:
    assert len(WITH_EXAMPLES) > 50


def test_every_module_can_be_imported() -> None:
    assert all(import_module(name).__name__ == name for name in MODULES)
