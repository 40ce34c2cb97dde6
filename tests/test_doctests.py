"""The examples in docstrings are true."""

from __future__ import annotations

import doctest
import pkgutil
from importlib import import_module
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


@pytest.mark.parametrize("name", MODULES)
def test_examples(name: str) -> None:
    assert doctest.testmod(import_module(name)).failed == 0


def test_there_are_examples() -> None:
    finder = doctest.DocTestFinder(exclude_empty=True)
    count = sum(len(test.examples) for name in MODULES for test in finder.find(import_module(name)))
    assert count >= 20
