"""What the commands of ``neurovis ros`` share: which ROS, who may listen, when it ends, how the summary is printed.

In: texts of the command line. Out: a Meeting, which opens the node and ends with the summary.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

import click

from neurovis_spec.cli.options import Option, as_one, finite
from neurovis_spec.interrupts import deferred

if TYPE_CHECKING:
    from neurovis_spec.ros.middleware import Node, Ros
    from neurovis_spec.ros.summary import Summary

#: where a command's context has the arguments for ROS itself
_ARGUMENTS: Final = "neurovis.ros"
_REMAPPING: Final = re.compile(r"[A-Za-z_~/][A-Za-z0-9_~/.]*:=.*", re.DOTALL)


def arguments_of_ros(arguments: Sequence[str]) -> tuple[list[str], tuple[str, ...]]:
    """The arguments of a command, and those of ROS itself among them.

    >>> arguments_of_ros(["x.yaml", "--ros-args", "-r", "a:=b", "--", "--steps", "5"])
    (['x.yaml', '--steps', '5'], ('--ros-args', '-r', 'a:=b', '--'))
    >>> arguments_of_ros(["x.yaml", "__name:=y", "--steps", "5", "_gain:=2"])
    (['x.yaml', '--steps', '5'], ('__name:=y', '_gain:=2'))
    """
    rest, found, within = list[str](), list[str](), False
    for word in arguments:
        within = within or word == "--ros-args"
        (found if within or _REMAPPING.fullmatch(word) else rest).append(word)
        within = within and word != "--"
    return rest, tuple(found)


class NodeCommand(click.Command):
    """A command that takes the arguments of ROS, too, as launch files give them."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Set the arguments of ROS aside."""
        rest, ctx.meta[_ARGUMENTS] = arguments_of_ros(args)
        return super().parse_args(ctx, rest)


@dataclass(frozen=True)
class Meeting:
    """How a command meets ROS."""

    ros: Ros | None
    remote: bool
    sim_time: bool
    seconds: float | None
    wait: float
    format: Literal["text", "json"]

    @contextmanager
    def node(self, name: str, namespace: str = "/", anonymous: bool = False) -> Iterator[Node]:
        """A node that is there for a block. Raises MiddlewareError."""
        from neurovis_spec.ros.middleware import NodeOptions, open_node

        context = click.get_current_context(silent=True)
        given: tuple[str, ...] = () if context is None else context.meta.get(_ARGUMENTS, ())
        options = NodeOptions(name, namespace, self.ros, self.remote, self.sim_time, anonymous, given, self.seconds)
        opened = open_node(options, tell)
        try:
            yield opened
        finally:
            with deferred():  # until what was sent is on its way
                opened.close()

    def show(self, summary: Summary) -> None:
        """Print the summary."""
        click.echo(summary.json() if self.format == "json" else summary.text())


def tell(text: str) -> None:
    """A line on standard error."""
    click.echo(text, err=True)


def _version(ctx: click.Context, param: click.Parameter, value: str | None) -> Ros | None:
    return None if value is None else 1 if value == "1" else 2


def meeting_options(wait: float) -> Option:
    """The options that all commands have, as one argument ``meeting``; ``wait`` is the default of ``--wait``."""
    positive = click.FloatRange(min=0)
    return as_one(
        "meeting",
        Meeting,
        click.option(
            "--ros", type=click.Choice(["1", "2"]), callback=_version, help="Which ROS; default: the one that is there."
        ),
        click.option(
            "--seconds", type=positive, callback=finite, metavar="S",
            help="End after S seconds; what is waited for before (a master, a network that announces itself) has S "
            "seconds to come.",
        ),
        click.option(
            "--wait", type=positive, callback=finite, default=wait, show_default=True, metavar="S",
            help="Begin when every topic has a subscriber, at the latest after S seconds.",
        ),
        click.option("--remote", is_flag=True, help="Meet other machines; else this one alone."),
        click.option("--sim-time", is_flag=True, help="Take the time from /clock."),
        click.option(
            "--format", type=click.Choice(["text", "json"]), default="text",
            help="How the summary is printed; json: one object on one line.",
        ),
    )  # fmt: skip
