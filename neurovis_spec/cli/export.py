"""``neurovis export``: a network in another form, for a robot or as tables."""

from __future__ import annotations

from pathlib import Path

import click

from neurovis_spec.cli.completion import paths
from neurovis_spec.cli.files import folder_option, network_of, recording_of, write_folder
from neurovis_spec.cli.options import examples, set_option, spec_argument


@click.command(
    epilog=examples(
        "neurovis export first.yaml --to c -o controller",
        "neurovis export first.yaml --to c --float -o controller",
        "neurovis export first.yaml --to c --from first.npz -o controller",
        "neurovis export first.yaml --to csv --from first.npz -o tables",
    )
)
@spec_argument
@click.option(
    "--to",
    "form",
    type=click.Choice(["c", "csv"]),
    required=True,
    help="The format: c, C99 that is C++17, too; csv, tables.",
)
@folder_option
@click.option("--float", "single", is_flag=True, help="Numbers of 32 bits instead of 64.")
@click.option(
    "--from",
    "start",
    metavar="RECORDING",
    shell_complete=paths,
    help="Begin with the last weights and activities of this recording: what was learned is kept.",
)
@set_option
def command(
    spec: str, form: str, output: Path, single: bool, start: str | None, settings: dict[str, float | str]
) -> None:
    """Write a network as source code for a robot, or as tables.

    To c: NAME.h and NAME.c need nothing but libm: no heap, no variables that change but a struct of the caller's. The
    README beside them says what a step takes; main.c and CMakeLists.txt are an example, and stay if they are there.

    To csv: neurons.csv has names, positions, biases and boxes, edges.csv a row for each connection, in the columns that
    the spec names for its own edge files; a spec reads both back.
    """
    if single and form == "csv":
        raise click.UsageError("--float is of numbers in C; tables have them as they are")
    network, before = network_of(spec, settings), recording_of(start)
    write_folder(output, lambda: network.export(output, form, start=before, real="float" if single else "double"))
