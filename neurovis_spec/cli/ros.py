"""``neurovis ros``: the commands that meet ROS, each imported when it is called."""

from __future__ import annotations

import click

from neurovis_spec.cli.commands import LateCommands
from neurovis_spec.cli.options import examples


class RosCommands(LateCommands):
    """Those of ROS."""

    PREFIX = "neurovis_spec.cli.ros_"
    TABLE = {  # noqa: RUF012
        "run": "Run a network as a node: inputs from topics, outputs to topics.",
        "view": "Show and record a network that runs elsewhere.",
        "legacy": "Show, record or write as a spec what speaks to the first NeuroVis.",
        "play": "Publish a recording as it came.",
        "export": "Write a network as a package, a node in C++, or a publisher.",
    }


@click.group(cls=RosCommands, epilog=examples("neurovis ros run first.yaml"))
def command() -> None:
    """Run a network as a node of ROS, or show and record one.

    ROS 1 and ROS 2 are both known; what is there is used. 'neurovis ros COMMAND --help' shows a command's options.
    """
