"""A network as something for ROS to have: a package that runs it, a node in C++, or a publisher for a controller.

In: a CompiledNetwork, which of these, for which ROS. Out: the texts of the files by their paths. Nothing of ROS is
needed for that.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Final, Literal, TypeAlias

import numpy as np

from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.compiler.ros_settings import RosSettings
from neurovis_spec.ros.export_node import node_files
from neurovis_spec.ros.middleware import Ros
from neurovis_spec.ros.templates import plain_line, render
from neurovis_spec.runtime.c_names import prefix
from neurovis_spec.runtime.c_package import write

Form: TypeAlias = Literal["package", "cpp", "publisher"]
#: files that are the author's as soon as they are there
YOURS: Final = frozenset(
    ("package.xml", "setup.py", "setup.cfg", "CMakeLists.txt", "config/parameters.yaml", "launch/network.launch")
) | {"launch/network.launch.xml"}
_MARK: Final = "by neurovis"


@dataclass(frozen=True, slots=True)
class Setting:
    """A parameter that a node starts with, and what it is."""

    name: str
    value: float
    about: str


def texts(compiled: CompiledNetwork, form: Form, ros: Ros) -> dict[str, str]:
    """The files of a package, a node or a publisher, by their paths. Raises ExportError where C cannot be made of the
    network."""
    if form == "publisher":
        return publisher(compiled)
    return _node(compiled) if form == "cpp" else _package(compiled, ros)


def save(folder: Path, made: dict[str, str]) -> tuple[list[Path], list[Path]]:
    """Write the files; what was written, and what was there and stays. Raises ExportError for a file of somebody else's
    in the way, OSError."""
    return write(folder, made, YOURS, _MARK)


def publisher(compiled: CompiledNetwork) -> dict[str, str]:
    """A header for C++, and a module for Python, that show another controller as this network."""
    values = _values(compiled)
    name = str(values["c"])
    found = dict[str, str]()
    for end in ("hpp", "py"):
        given = files("neurovis_spec.ros").joinpath("publisher", f"neurovis_publisher.{end}").read_text("utf-8")
        text = given.replace("NAME_", f"{name}_") + render(f"network.{end}", values)
        found[f"{name}_publisher.{end}"] = text
    return found


def _package(compiled: CompiledNetwork, ros: Ros) -> dict[str, str]:
    values = _values(compiled) | {"node": False, "executable": "run"}
    spec = f"# Made by neurovis ros export: a spec with all that it needs.\n{compiled.text()}"
    made = {name: render(f"ros{ros}/{name}", values) for name in ("package.xml", "README.md")}
    if ros == 1:
        made |= {
            "CMakeLists.txt": render("ros1/CMakeLists.txt", values),
            "scripts/run": render("ros1/run", values),
            "launch/network.launch": render("ros1/network.launch", values),
            "network.yaml": spec,
        }
    else:
        package = str(values["package"])
        made |= {
            "setup.py": render("ros2/setup.py", values),
            "setup.cfg": render("ros2/setup.cfg", values),
            "launch/network.launch.xml": render("ros2/network.launch.xml", values),
            f"{package}/run.py": render("ros2/run.py", values),
            f"{package}/__init__.py": f'"""The network {compiled.network.name}. Made by neurovis ros export."""\n',
            f"{package}/network.yaml": spec,
            f"resource/{package}": "",
        }
    return made | _parameters(values, ros)


def _node(compiled: CompiledNetwork) -> dict[str, str]:
    values = _values(compiled)
    messages = [*packages_of(compiled.network.ros), "diagnostic_msgs"]
    values |= {"node": True, "executable": f"{values['c']}_node", "messages": sorted(set(messages))}
    made = {name: render(f"ros1/{name}", values) for name in ("package.xml",)}
    made["launch/network.launch"] = render("ros1/network.launch", values)
    header = f"{values['c']}_publisher.hpp"
    made[header] = publisher(compiled)[header]
    return made | node_files(compiled.network, values) | _parameters(values, 1)


def _parameters(values: dict[str, object], ros: Ros) -> dict[str, str]:
    return {"config/parameters.yaml": render(f"ros{ros}/parameters.yaml", values)} if values["parameters"] else {}


def _values(compiled: CompiledNetwork) -> dict[str, object]:
    """What templates insert."""
    network, spec = compiled.network, compiled.spec
    c, text = prefix(network.name), compiled.text()
    settings = []
    for name, value in network.parameters.items():
        if name not in network.structural and name in network.settable.index:
            written = spec.parameters.get(name)
            settings.append(Setting(name, value, "" if written is None else written.about))
    depth = network.ros.depth_at(network.ros.rate)
    return {
        "package": f"neurovis_{c}",
        "c": c,
        "macro": c.upper(),
        "network": network.name,
        "about": plain_line(network.title or f"The network {network.name}"),
        "namespace": network.ros.namespace,
        "hash": network.hash,
        "neurons": len(network.neurons),
        "weights": len(np.atleast_1d(network.changing)),
        "reliable": network.ros.reliability == "reliable",
        "depth": depth,
        "rate": network.ros.rate,
        "queue": depth if network.ros.reliability == "best_effort" else max(2000, depth),
        "latched": network.ros.durability == "transient_local",
        "messages": packages_of(network.ros),
        "parameters": settings,
        "spec": text.splitlines(keepends=True) or [""],
    }


def packages_of(settings: RosSettings) -> list[str]:
    """The packages of the message types of a network."""
    types = [*(one.type for one in settings.subscribe), *(one.type for one in settings.publish)]
    return sorted({"std_msgs", *(type_.partition("/")[0] for type_ in types)})
