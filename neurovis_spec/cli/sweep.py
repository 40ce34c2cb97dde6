"""``neurovis sweep``: many runs of a spec, into a table."""

from __future__ import annotations

import os
from contextlib import nullcontext
from pathlib import Path
from time import perf_counter

import click

from neurovis_spec.cli.completion import axes, paths
from neurovis_spec.cli.files import (
    STDIN,
    check_files,
    check_target,
    count,
    files_of,
    how_to_compile,
    standard_input,
    tables,
    tell_warnings,
    writing,
)
from neurovis_spec.cli.options import (
    Running,
    body_options,
    compile_options,
    examples,
    output_option,
    ranges,
    running_options,
)
from neurovis_spec.cli.progress import progress


@click.command(
    epilog=examples(
        'neurovis sweep first.yaml --over gain=0:1:11 --metric "rms(O, last=100)"',
        'neurovis sweep first.yaml --over gain=0.001:0.1:log20 --over seed=0..9 --metric "error=rms(O - T, last=514)" '
        "-o sweep.csv",
        'neurovis sweep first.yaml --over seed=0..999 --metric "mean(O)" --scheduler tcp://10.0.0.1:8786 -o x.parquet',
    )
)
@click.argument("spec", metavar="SPEC", shell_complete=paths)
@click.option(
    "--over",
    metavar="name=RANGE",
    multiple=True,
    required=True,
    callback=ranges,
    shell_complete=axes,
    help="Let a parameter, or the seed, take these values: a:b:N (N numbers evenly from a to b), a:b:logN (by equal "
    "factors), a..b (integers) or a,b,c. Repeatable: the points are all combinations, the last varying first.",
)
@click.option(
    "--metric",
    "metrics",
    metavar="[name=]EXPR",
    multiple=True,
    required=True,
    help="Measure each run: an expression of neurons, outputs, parameters, k and t after the last step, with rms, "
    "mean, min and max over the last N steps, or over all. Repeatable, a column each.",
)
@running_options("Steps of a run; default: time.steps.")
@click.option(
    "--jobs", type=click.IntRange(1, 4096), metavar="N", help="Run in N processes; default: one for each processor."
)
@click.option("--scheduler", metavar="ADDRESS", help="Run on the cluster of this scheduler of dask.distributed.")
@output_option("Write the table here (.csv or .parquet), each row as it comes; without it the table is printed.")
@body_options
@compile_options
def command(
    spec: str,
    over: dict[str, str],
    metrics: tuple[str, ...],
    running: Running,
    jobs: int | None,
    scheduler: str | None,
    output: Path | None,
) -> None:
    """Run a spec over a grid of parameters and seeds, into a table.

    The table has a row for each point: its values, its metrics, and the finding where it failed. The rows of a file are
    not run again: what was ended, by Ctrl-C or otherwise, goes on where it was when it is called again. It goes by the
    columns and the values of the grid: where the spec has changed, name another file.
    """
    read = files_of(running.inputs)
    check_target(output, [("the spec itself", spec), *read])
    both = next((name for name in over if name in running.settings), None)
    if both is not None:
        raise click.UsageError(f"'{both}' is given by --over and by --set")
    if jobs is not None and scheduler is not None:
        raise click.UsageError("--jobs is of this machine, --scheduler of a cluster: give one of them")
    from neurovis_spec.runtime.course import Course
    from neurovis_spec.sweeps.point import Source
    from neurovis_spec.sweeps.sweep import carried_out, planned
    from neurovis_spec.sweeps.table import check_suffix

    if output is not None:
        check_suffix(output)
    source = Source(standard_input(), STDIN, Path.cwd()) if spec == "-" else spec
    course, how = Course(running.steps, backend=running.backend), how_to_compile(running.settings)
    with progress("compiling"):
        plan = planned(source, over, metrics, course, how)
    tell_warnings(spec, plan.network.warnings)
    check_files(output, plan.network)
    arrays = tables(running.inputs, plan.network.network)
    begun, many = perf_counter(), jobs or min(_processors(), len(plan.points))
    with writing(output) if output is not None else nullcontext(), progress("sweeping") as bar:
        table = carried_out(plan, arrays, jobs=many, scheduler=scheduler, path=output, progress=bar)
    wrong = sum(error is not None for error in table["error"])
    if wrong:
        click.echo(f"{count(wrong, 'point')} of {len(table):,} failed: the column 'error' says why", err=True)
    if output is None:
        click.echo(str(table), nl=False)
    else:
        click.echo(f"{output}: {count(len(table), 'row')} in {perf_counter() - begun:.2f} s")


def _processors() -> int:
    """How many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
