"""``neurovis ros run``: a network as the node of a robot."""

from __future__ import annotations

import sys
from contextlib import nullcontext

import click

from neurovis_spec.cli.failure import fault
from neurovis_spec.cli.files import network_of
from neurovis_spec.cli.options import backend_option, examples, finite, set_option, spec_argument
from neurovis_spec.cli.ros_options import Desk, Meeting, NodeCommand, meeting_options, shown_options, tell
from neurovis_spec.interrupts import heeded


@click.command(
    cls=NodeCommand,
    epilog=examples(
        "neurovis ros run first.yaml",
        "neurovis ros run first.yaml --rate 100 --seconds 60",
        "neurovis ros run first.yaml --live 8080 --record run.mcap",
        "neurovis ros run first.yaml --ros 1 --steps 1000 --wait 5 --format json",
    ),
)
@spec_argument
@click.option("--steps", type=click.IntRange(min=1), metavar="N", help="End after N steps.")
@click.option(
    "--rate",
    type=click.FloatRange(min=0, min_open=True),
    callback=finite,
    metavar="HZ",
    help="Steps a second; default: the spec's ros.rate, else 1/dt.",
)
@backend_option
@set_option
@shown_options(always=False)
@meeting_options(wait=0)
def command(
    spec: str,
    steps: int | None,
    rate: float | None,
    backend: str | None,
    settings: dict[str, float | str],
    desk: Desk,
    meeting: Meeting,
) -> None:
    """Run a network as a node: inputs from topics, a step every 1/rate seconds, outputs to topics.

    The section 'ros' of the spec says which topics. Activities, weights and the spec itself are published, too; other
    nodes can set the parameters. Ctrl-C ends the run: safe outputs are sent, and a summary is printed.
    """
    desk.check()
    compiled = network_of(spec, settings)
    from neurovis_spec.ros.run import NodeRun, Schedule
    from neurovis_spec.runtime.backend import ready

    network = compiled.network
    made = ready(network, backend)
    schedule = Schedule(rate or network.ros.rate, steps, meeting.seconds, meeting.wait, made)
    sys.setswitchinterval(0.0005)  # steps are due, and threads must not wait for each other as long as Python lets them
    with meeting.node(network.name, network.ros.namespace) as node, heeded() as asked:
        with desk.open(compiled, node, backend=made.name) if desk else nullcontext() as listening:
            run = NodeRun(compiled, node, schedule, tell, listening)
            tell(f"ready: {node.name}, ROS {node.ros}, {schedule.rate:g} steps a second")
            run.wait(lambda: bool(asked))
            run.run(lambda: bool(asked))
        summary = run.summary()
    meeting.show(summary)
    if run.why is not None:
        raise fault(run.why, "it is to stop the run: on_timeout in the section ros.subscribe of the spec")
