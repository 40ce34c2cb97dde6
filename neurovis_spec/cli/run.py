"""``neurovis run``: a run of a network, recorded or summed up."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Final, Literal

import click

from neurovis_spec.cli.completion import paths
from neurovis_spec.cli.files import (
    check_files,
    check_target,
    count,
    files_of,
    network_of,
    recording_of,
    tables,
    writing,
)
from neurovis_spec.cli.options import (
    Running,
    as_one,
    body_options,
    check_only,
    compile_options,
    examples,
    only_option,
    output_option,
    running_options,
    start_option,
)
from neurovis_spec.cli.progress import progress

if TYPE_CHECKING:
    from neurovis_spec.compiled import CompiledNetwork
    from neurovis_spec.keywords import RunKeywords
    from neurovis_spec.runtime.recording import Recording
    from neurovis_spec.runtime.step_check import StepCheck
    from neurovis_spec.runtime.until import Until

#: activities shown where nothing is written to a file
_MOST_SHOWN = 20


@dataclass(frozen=True)
class Keeping:
    """What of a run is recorded, from where it goes on and what ends it, as the command line says it."""

    every: int
    start: str | None
    only: Literal["weights"] | None
    states: tuple[str, ...]
    neurons: tuple[str, ...]
    weights: tuple[str, ...]
    signals: Literal["all", "none"]
    until: str | None
    checkpoint: Path | None

    def keywords(self, network: CompiledNetwork, backend: str | None) -> RunKeywords:
        """The same, as ``run`` takes it. Raises SpecError, RecordingError."""
        return {
            "backend": backend,
            "every": self.every,
            "start": recording_of(self.start),
            "only": self.only,
            "until": None if self.until is None else network.until(self.until),
            "states": self.states,
            "neurons": self.neurons,
            "weights": self.weights or "plastic",
            "signals": self.signals,
            "checkpoint": self.checkpoint,
        }


keeping_options: Final = as_one(
    "keeping",
    Keeping,
    click.option(
        "--every", type=click.IntRange(1, 2**53), default=1, metavar="K", help="Record every K-th step only; default 1."
    ),
    start_option,
    only_option,
    click.option(
        "--states",
        metavar="REF",
        multiple=True,
        help="Record a state or output of models (K.v), a state of rules ('(K -> O).eligibility') or what an input is "
        "given (push.given) as well, or 'all' states. Repeatable.",
    ),
    click.option(
        "--neurons", metavar="REFS", multiple=True, help="Record these neurons only, such as 'O + K'; default: all."
    ),
    click.option(
        "--weights",
        metavar="REF",
        multiple=True,
        help="Record the weights that can change of these connections only, such as 'K -> O', or 'none'; default: "
        "'plastic', all. Repeatable.",
    ),
    click.option(
        "--signals",
        type=click.Choice(["all", "none"]),
        default="all",
        help="Record by what pictures colour lines where that is no weight times an activity, such as the signals of "
        "synapses, the default, or none.",
    ),
    click.option(
        "--until",
        metavar="EXPR",
        help="End at the first step after which this is true: an expression of neurons, outputs, parameters, k and t, "
        "with rms, mean, min and max over the last N steps. Steps are the most there are.",
    ),
    click.option(
        "--checkpoint",
        type=click.Path(path_type=Path),
        metavar="FILE",
        shell_complete=paths,
        help="Go on exactly from FILE, if it is there; write the run's state to it at the end, also after Ctrl-C.",
    ),
)


@dataclass(frozen=True)
class Checking:
    """Whether the length of the steps is checked."""

    step: bool

    def check(self, keeping: Keeping, output: Path | None) -> None:
        """Refuse what the check does not do."""
        asked = {"-o": output, "--from": keeping.start, "--states": keeping.states, "--neurons": keeping.neurons}
        asked |= {"--until": keeping.until, "--checkpoint": keeping.checkpoint}
        for name, value in asked.items():
            if self.step and value:
                raise click.UsageError(f"--check-step compares runs from the first step on: it goes without {name}")


checking_option: Final = as_one(
    "checking",
    Checking,
    click.option(
        "--check-step",
        "step",
        is_flag=True,
        help="Run with dt, dt/2 and dt/4, and print for each group how far the runs are apart and the order that this "
        "shows.",
    ),
)


@click.command(
    epilog=examples(
        "neurovis run first.yaml",
        "neurovis run first.yaml --steps 4000 --set gain=0.5 -o first.npz",
        "neurovis run first.yaml --input touch=touch.csv --every 10 -o first.csv",
        "neurovis run first.yaml --from first.npz -o second.npz",
        "neurovis run first.yaml --from first.npz --only weights -o second.npz",
        'neurovis run first.yaml --steps 100000 --until "rms(O, last=100) < 0.01"',
        "neurovis run first.yaml --steps 500 --check-step",
        "neurovis run --backend list",
    )
)
@click.argument("spec", metavar="SPEC", shell_complete=paths)
@running_options("Steps to run; default: the spec's time.steps.")
@keeping_options
@checking_option
@output_option("Write the recording here (.npz, .csv, .mcap); without it a summary is printed.")
@body_options
@compile_options
def command(spec: str, running: Running, keeping: Keeping, checking: Checking, output: Path | None) -> None:
    """Run a network and write a recording.

    A recording holds the activity of every neuron and every weight that can change, at every step, or what of it
    --every, --neurons, --weights and --signals choose; and the states that the outputs of the spec or --states name.
    Without -o nothing is written, and the last step's values are printed. Ctrl-C ends a run, as do SIGTERM, SIGHUP and
    SIGQUIT; its recording holds the steps until then. If a run is killed, a part beside the file holds them
    (.x.npz.part), which is read where the file is not there.

    With --checkpoint a run is made in parts: each goes on exactly where the last one ended, --steps counts the steps to
    be made now, and the parts together are bit for bit the run in one go, as they are made by one backend.

    With --check-step nothing is recorded. The run is made again with half and a quarter of the step, in which all that
    is counted in steps (delays, events, rows of tables) takes as long as before. Of a method of order p the difference
    between two of the runs falls by 2^p. What is per step or random (each_step, noise, learning, a delay in steps
    between what flows), and what it reaches, has no order.
    """
    checking.check(keeping, output)
    check_only(keeping.only, keeping.start)
    network = _network(spec, running, keeping, output)
    steps, arrays = running.steps, tables(running.inputs, network.network)
    if checking.step:
        with progress("running") as bar:
            check = network.check_step(steps, arrays, backend=running.backend, every=keeping.every, progress=bar)
        _print_check(network, check)
        return
    options, begun = keeping.keywords(network, running.backend), perf_counter()
    until = options["until"]
    assert not isinstance(until, str)
    if output is not None:
        with writing(output), progress("running") as bar:
            by = network.run_to(output, steps, arrays, **(options | {"progress": bar}))
        _tell(until)
        click.echo(f"{output}: {_summary(network, steps, perf_counter() - begun, by, until)}")
        return
    with progress("running") as bar:
        recording = network.run(steps, arrays, last=until is not None, **(options | {"progress": bar}))
    _tell(until)
    summary = _summary(network, steps, perf_counter() - begun, recording.backend, until)
    _print(network, recording, summary, keeping.states)


def _network(spec: str, running: Running, keeping: Keeping, output: Path | None) -> CompiledNetwork:
    """The network that is run, once it is known that what is written replaces nothing that is read."""
    read = [("the spec itself", spec), ("the recording that the run goes on from", keeping.start)]
    read += files_of(running.inputs)
    check_target(output, read)
    others = [*read, ("the recording", None if output is None else str(output))]
    check_target(keeping.checkpoint, others, "--checkpoint")
    _check_format(output)
    network = network_of(spec, running.settings)
    check_files(output, network)
    check_files(keeping.checkpoint, network, "--checkpoint")
    return network


def _tell(until: Until | None) -> None:
    """How a run ended that was to end early."""
    if until is not None and until.ending is not None:
        click.echo(f"until {until.measure.text}: {until.ending}", err=True)


def _summary(network: CompiledNetwork, steps: int | None, seconds: float, backend: str, until: Until | None) -> str:
    steps = network.network.steps if steps is None else steps
    if until is not None and until.ending is not None:
        steps = until.ending.made
    return f"{count(steps, 'step')} in {seconds:.2f} s, backend {backend}"


def _check_format(output: Path | None) -> None:
    """Refuse a suffix that no format has before anything is run."""
    if output is not None:
        from neurovis_spec.runtime.recording import for_path

        for_path(output)


def _print(network: CompiledNetwork, recording: Recording, summary: str, asked: tuple[str, ...]) -> None:
    """The outputs at the last step recorded, or the activities where the spec names none."""
    from neurovis_spec.cli.tables import number, table

    click.echo(f"{network.name}: {summary}")
    names = [output.name for output in network.network.outputs if output.name in recording]
    what = "outputs" if names else "activities"
    rows = []
    for name in [*(names or recording.columns[:_MOST_SHOWN]), *asked]:
        values = recording[name][-1:].ravel().tolist()
        rows.append((name, " ".join(number(value) for value in values[:_MOST_SHOWN])))
    click.echo(f"{what} at step {recording.step[-1]}:")
    click.echo(table(rows))
    if recording.spiking is not None:
        from neurovis_spec.analysis import group_firing

        found = group_firing(recording)
        rates = [(name, number(found[name, "rate"])) for name in found.rows.labels[:_MOST_SHOWN]]
        click.echo(f"{count(len(recording.spike_steps), 'spike')}; rates a neuron and a second:")
        click.echo(table(rates))
    if recording.weights.shape[1]:
        least, most = recording.weights[-1].min(), recording.weights[-1].max()
        click.echo(f"{count(recording.weights.shape[1], 'changing weight')}: {number(least)} to {number(most)}")


def _print_check(network: CompiledNetwork, check: StepCheck) -> None:
    """How far runs with shorter steps are from each other."""
    from neurovis_spec.cli.tables import number, table

    by = network.network.integration
    what = "" if by is None else f"{by.method}, "
    steps = " s, ".join(number(check.dt / parts) for parts in (1, 2, 4))
    click.echo(f"{network.name}: {count(check.steps, 'step')} of {steps} s, {what}backend {check.backend}")
    rows = []
    for one in check.errors:
        order = f"none: {one.why}" if one.order is None else f"{one.order:.2f}"
        rows.append((one.name, f"{one.first:.2e}", f"{one.second:.2e}", order))
    click.echo(table(rows, ("", "max |Δ| dt, dt/2", "dt/2, dt/4", "order")))
    if check.hint:
        click.echo(f"help: {check.hint}")
