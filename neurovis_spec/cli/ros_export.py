"""``neurovis ros export``: a network as a package of ROS, a node in C++, or a publisher for another controller."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from neurovis_spec.cli.failure import fault
from neurovis_spec.cli.files import folder_option, network_of, write_folder
from neurovis_spec.cli.options import examples, set_option, spec_argument

if TYPE_CHECKING:
    from neurovis_spec.ros.middleware import Ros


@click.command(
    epilog=examples(
        "neurovis ros export first.yaml -o neurovis_first",
        "neurovis ros export first.yaml --ros 1 -o neurovis_first",
        "neurovis ros export first.yaml --to cpp -o neurovis_first",
        "neurovis ros export first.yaml --to publisher -o controller",
    )
)
@spec_argument
@folder_option
@click.option("--ros", type=click.Choice(["1", "2"]), help="For which ROS; default: 2, with --to cpp 1.")
@click.option(
    "--to",
    "form",
    type=click.Choice(["package", "cpp", "publisher"]),
    default="package",
    show_default=True,
    help="package: it runs 'neurovis ros run'. cpp: a node in C++ (roscpp). publisher: for another controller, which "
    "shows itself as this network.",
)
@set_option
def command(
    spec: str,
    output: Path,
    ros: str | None,
    form: Literal["package", "cpp", "publisher"],
    settings: dict[str, float | str],
) -> None:
    """Write a network as a package of ROS: with a launch file, its parameters, and the spec with all that it needs.

    The README beside them says how a package is built and started. package.xml, build files, launch files and
    parameters stay if they are there. A publisher is a header (C++, for ROS 1) and a module (Python, for both).
    """
    if form == "cpp" and ros == "2":
        raise click.UsageError("--to cpp writes a node of ROS 1 (roscpp): leave out --ros 2")
    if find_spec("jinja2") is None:
        raise fault("ros export needs jinja2", "pip install 'neurovis-spec[ros]'; in a clone: pip install '.[ros]'")
    compiled = network_of(spec, settings)
    from neurovis_spec.ros.export import save, texts

    version: Ros = 1 if ros == "1" or form == "cpp" else 2
    write_folder(output, lambda: save(output, texts(compiled, form, version)))
