"""``neurovis ros play``: a recording, as if it came just now."""

from __future__ import annotations

import sys
import time
import warnings
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import click

from neurovis_spec.cli.completion import paths
from neurovis_spec.cli.failure import fault
from neurovis_spec.cli.options import examples, finite
from neurovis_spec.cli.ros_options import Desk, Meeting, meeting_options, shown_options, tell
from neurovis_spec.interrupts import heeded

if TYPE_CHECKING:
    from neurovis_spec.compiled import CompiledNetwork
    from neurovis_spec.ros.bags import Bag


@click.command(
    epilog=examples(
        "neurovis ros play run.mcap",
        "neurovis ros play run.bag --speed 0.5 --loop",
        "neurovis ros play run.mcap --live 8080",
    )
)
@click.argument("file", metavar="FILE", shell_complete=paths)
@click.option(
    "--speed",
    type=click.FloatRange(min=0, min_open=True),
    callback=finite,
    default=1.0,
    metavar="X",
    help="So many times as fast.",
)
@click.option("--loop", is_flag=True, help="Begin again at its end.")
@click.option("--network", metavar="NAME", help="Which network is shown or recorded, where the file holds several.")
@shown_options(always=False)
@meeting_options(wait=2)
def command(file: str, speed: float, loop: bool, network: str | None, desk: Desk, meeting: Meeting) -> None:
    """Publish a recording (.mcap, .bag, a folder of ros2 bag) on its topics, as it came.

    Messages are sent in the order of the file, at the distances at which they came. A recording of one ROS is converted
    where the other one is there. Ctrl-C ends it.
    """
    from neurovis_spec.ros.bags import read_bag
    from neurovis_spec.ros.play import Playback, Player
    from neurovis_spec.ros.summary import Summary

    desk.check(played=file)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        bag = read_bag(Path(file))
    for warning in caught:
        tell(f"warning: {warning.message}")
    if not bag.topics:
        raise fault(f"{file}: it holds no topics")
    compiled, base = _network(bag, file, network) if desk else (None, None)
    playback = Playback(speed, loop, meeting.wait, meeting.seconds, meeting.sim_time)
    sys.setswitchinterval(0.0005)
    with meeting.node("neurovis_play", anonymous=True) as node, ExitStack() as stack, heeded() as asked:
        listening = None if compiled is None else stack.enter_context(desk.open(compiled, node, base))
        player = Player(bag, node, playback, tell, None if listening is None else listening.put)
        tell(f"ready: {file}, ROS {node.ros}, {len(bag.topics)} topics")
        player.wait(lambda: bool(asked))
        begun = time.monotonic()
        player.run(lambda: bool(asked))
        seconds = time.monotonic() - begun
        if listening is not None:
            listening.end()
        shown, skipped = (0, 0) if listening is None else listening.shown
        counts = player.counts
        if listening is not None:
            counts |= {stream.topic: stream.counts for stream in listening.streams.values()}
        summary = Summary(
            network=bag.about.get("network", ""), hash=bag.about.get("hash", ""), ros=node.ros, seconds=seconds,
            reconnects=node.reconnects, shown=shown, skipped=skipped, topics=counts,
            files=() if listening is None else listening.paths,
        )  # fmt: skip
    meeting.show(summary)


def _network(bag: Bag, file: str, name: str | None) -> tuple[CompiledNetwork, str]:
    """The network of a recording, and what the names of its topics begin with."""
    from neurovis_spec.ros.announced import compiled_from
    from neurovis_spec.ros.play import spec_of

    found = spec_of(bag, name)
    if found is None:
        raise fault(f"{file}: it holds no spec of a network, so it can neither be shown nor recorded anew")
    text, base = found
    return compiled_from(text, file), base
