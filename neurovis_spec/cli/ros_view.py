"""``neurovis ros view``: a network that runs elsewhere, shown and recorded."""

from __future__ import annotations

import sys
import time
from functools import partial
from typing import TYPE_CHECKING

import click

from neurovis_spec.cli.completion import paths
from neurovis_spec.cli.failure import fault
from neurovis_spec.cli.files import count, network_of
from neurovis_spec.cli.options import examples, set_option
from neurovis_spec.cli.ros_options import Desk, Meeting, meeting_options, shown_options, tell
from neurovis_spec.interrupts import heeded

if TYPE_CHECKING:
    from collections.abc import Callable

    from neurovis_spec.compiled import CompiledNetwork
    from neurovis_spec.ros.listening import Listening
    from neurovis_spec.ros.middleware import Node, Subscription
    from neurovis_spec.ros.summary import Summary

#: seconds between two looks at the parameters of the other node, and at who else announces itself
_LOOK = 1.0


@click.command(
    epilog=examples(
        "neurovis ros view",
        "neurovis ros view first.yaml --live 8080",
        "neurovis ros view --record run.mcap --rotate 10min",
    )
)
@click.argument("spec", metavar="[SPEC]", required=False, shell_complete=paths)
@click.option("--network", metavar="NAME", help="Which network, where several announce themselves.")
@set_option
@shown_options(always=True)
@meeting_options(wait=0)
def command(
    spec: str | None, network: str | None, settings: dict[str, float | str], desk: Desk, meeting: Meeting
) -> None:
    """Show and record a network that runs elsewhere, on a robot.

    Without SPEC it is the one that announces itself. The page shows the newest step, and goes back over those that
    came; the recording has every message. Where the network's node takes parameters, the page sets them. Ctrl-C ends
    it.
    """
    from neurovis_spec.ros.listening import ACTIVITY

    desk = desk or desk.in_the_browser()
    desk.check()
    begun = time.monotonic()
    base = None
    compiled = None if spec is None else network_of(spec, settings)
    sys.setswitchinterval(0.0005)
    with meeting.node("neurovis_view", anonymous=True) as node, heeded() as asked:

        def stopped() -> bool:
            return bool(asked) or node.ended or meeting.is_over(begun)

        if compiled is None:
            compiled, base = _announced(node, network, stopped)
        with desk.open(compiled, node, base) as listening:
            subscriptions = _subscribed(node, listening, desk)
            tell(f"ready: {compiled.name}, ROS {node.ros}, {subscriptions[0].topic.removesuffix(ACTIVITY)}")
            begun = time.monotonic()
            _follow(node, listening, stopped, alone=spec is None and network is None)
            for subscription in subscriptions:
                subscription.close()
            listening.end()
            silent = [one.topic for one in subscriptions if not listening.streams[one.topic].counts.received]
            if silent:
                tell(f"nothing came on {', '.join(silent)}")
            summary = _summary(node, listening, time.monotonic() - begun)
    meeting.show(summary)


def _announced(node: Node, network: str | None, stopped: Callable[[], bool]) -> tuple[CompiledNetwork, str]:
    """The network that announces itself, and what its topics begin with. Raises Failure where none does."""
    from neurovis_spec.ros.announced import find

    tell("waiting for a network that announces itself")
    found = find(node, network, stopped)
    if found is None:
        raise fault("no network has announced itself", "name its spec: neurovis ros view SPEC")
    compiled, base = found
    if compiled.warnings:
        tell(f"{count(len(compiled.warnings), 'warning')} in the spec of {compiled.name}")
    return compiled, base


def _subscribed(node: Node, listening: Listening, desk: Desk) -> list[Subscription]:
    """All that the network sends, on its way to the page and the recording."""
    from neurovis_spec.ros.middleware import DISPLAY, RECORDER

    quality = DISPLAY if desk.record is None else RECORDER
    return [
        node.subscription(topic, stream.type, quality, partial(listening.put, topic))
        for topic, stream in listening.streams.items()
    ]


def _follow(node: Node, listening: Listening, stopped: Callable[[], bool], alone: bool) -> None:
    """Until the end look for the parameters of the other node, and, if there is to be one network ``alone``, for
    others."""
    from neurovis_spec.ros.announced import Others
    from neurovis_spec.ros.listening import SPEC, base_of
    from neurovis_spec.ros.steering import ViewSteering

    compiled, reconnects = listening.compiled, node.reconnects
    steering = ViewSteering(compiled.network, node, base_of(compiled))
    others = Others(node, f"{listening.base}/{SPEC}", tell)
    due = time.monotonic()
    while not stopped():
        if node.reconnects != reconnects:
            reconnects = node.reconnects
            listening.anew()
        source = listening.source
        if time.monotonic() >= due:
            due = time.monotonic() + _LOOK
            if alone:
                others.look()
            if source is not None and source.begun and steering.look() and not source.capabilities.takes:
                source.steer(steering)
        time.sleep(0.02)


def _summary(node: Node, listening: Listening, seconds: float) -> Summary:
    from neurovis_spec.ros.summary import Summary

    compiled, (shown, skipped) = listening.compiled, listening.shown
    return Summary(
        network=compiled.name, hash=compiled.hash, ros=node.ros, seconds=seconds, reconnects=node.reconnects,
        shown=shown, skipped=skipped, files=listening.paths, topics=listening.counts,
    )  # fmt: skip
