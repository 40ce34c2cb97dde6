"""``neurovis ros legacy``: a controller of the first NeuroVis, shown, recorded, and written as a spec."""

from __future__ import annotations

import sys
import time
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import click

from neurovis_spec.cli.completion import paths
from neurovis_spec.cli.failure import fault
from neurovis_spec.cli.files import check_target
from neurovis_spec.cli.options import examples
from neurovis_spec.cli.ros_options import Desk, Meeting, meeting_options, shown_options, tell
from neurovis_spec.compiler.limits import plural
from neurovis_spec.interrupts import heeded

if TYPE_CHECKING:
    from neurovis_spec.ros.listening import Listening


@click.command(
    epilog=examples(
        "neurovis ros legacy",
        "neurovis ros legacy -o robot.yaml --seconds 10",
        "neurovis ros legacy --record robot.bag --network robot",
    )
)
@click.option("-o", "--output", metavar="SPEC", shell_complete=paths, help="Write the network as a spec, at the end.")
@click.option("--namespace", default="/neurovis", show_default=True, metavar="NS", help="Where its topics are.")
@click.option("--network", default="legacy", show_default=True, metavar="NAME", help="How the network is called.")
@shown_options(always=False)
@meeting_options(wait=0)
def command(output: str | None, namespace: str, network: str, desk: Desk, meeting: Meeting) -> None:
    """Listen to a controller that speaks to the first NeuroVis: its network is shown, recorded, or written as a spec.

    Without -o and --record it is shown in the browser. Nothing in the controller has to be changed. Ctrl-C ends it.
    """
    from neurovis_spec.ros.legacy import LegacyListener
    from neurovis_spec.ros.summary import Summary

    if output is None:
        desk = desk or desk.in_the_browser()
    desk.check()
    check_target(None if output is None else Path(output))
    sys.setswitchinterval(0.0005)
    with meeting.node("neurovis_legacy", anonymous=True) as node, ExitStack() as stack, heeded() as asked:
        listener, listening = LegacyListener(node, namespace, network, tell, bool(desk)), None

        def shown() -> Listening:
            opened = stack.enter_context(desk.open(listener.compiled(), node))
            listener.to(opened)
            tell(f"{plural(len(listener.legacy.names), 'neuron')}, {plural(len(listener.legacy.edges), 'connection')}")
            return opened

        listener.look()
        tell(f"ready: {namespace}, ROS {node.ros}")
        begun = time.monotonic()
        while not (asked or node.ended or meeting.is_over(begun)):
            listener.hear(0.05)
            if not listener.known and listener.settled:
                listener.know()
                listening = shown() if desk else None
        if not listener.known and desk.record is not None and listener.legacy.described:
            listener.know()
            listening = shown()
        if listening is not None:
            listening.end()
        listener.end()
        if not listener.legacy.names:
            raise fault(f"no network was described under {namespace}", "its controller publishes neuronName")
        compiled = listener.compiled() if listening is None else listening.compiled
        if output is not None:
            _write(listener.legacy.spec(network), output)
        seen, skipped = (0, 0) if listening is None else listening.shown
        files = () if listening is None else listening.paths
        summary = Summary(
            network=compiled.name, hash=compiled.hash, ros=node.ros, seconds=time.monotonic() - begun,
            reconnects=node.reconnects, shown=seen, skipped=skipped,
            files=(*files, *(() if output is None else (output,))), topics=listener.counts,
        )  # fmt: skip
    meeting.show(summary)


def _write(text: str, path: str) -> None:
    from neurovis_spec.runtime.files import replacing

    with replacing(path) as file:
        file.write(text.encode())
