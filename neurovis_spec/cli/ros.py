"""``neurovis ros``: the commands that meet ROS, each imported when it is called."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Final

import click

from neurovis_spec.cli.options import examples

#: Each is ``neurovis_spec.cli.ros_NAME:command``.
COMMANDS: Final[Mapping[str, str]] = {
    "run": "Run a network as a node: inputs from topics, outputs to topics.",
    "view": "Show and record a network that runs elsewhere.",
    "legacy": "Show, record or write as a spec what speaks to the first NeuroVis.",
    "play": "Publish a recording as it came.",
    "export": "Write a network as a package, a node in C++, or a publisher.",
}


class RosCommands(click.Group):
    """Commands by name."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """The names, in the order in which one needs them."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command of this name, imported now."""
        if cmd_name not in COMMANDS:
            return None
        found: click.Command = import_module(f"neurovis_spec.cli.ros_{cmd_name}").command
        return found

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The lines of COMMANDS, without importing a command."""
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


@click.group(cls=RosCommands, epilog=examples("neurovis ros run first.yaml"))
def command() -> None:
    """Run a network as a node of ROS, or show and record one.

    ROS 1 and ROS 2 are both known; what is there is used. 'neurovis ros COMMAND --help' shows a command's options.
    """
