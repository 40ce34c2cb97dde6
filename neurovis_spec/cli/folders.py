"""Folders of files, as the commands write them that export a network.

In: a folder, what writes files into it. Out: the files, and a line for each.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import click

from neurovis_spec.cli.failure import fault
from neurovis_spec.cli.files import writing

folder_option = click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="DIR",
    required=True,
    help="The folder for the files, made if it is not there.",
)


def write_folder(folder: Path, write: Callable[[], tuple[list[Path], list[Path]]]) -> None:
    """Write files, and say which were written; on standard error, which were there and stay. Raises Failure."""
    from neurovis_spec.runtime.c_settable import ExportError

    with writing(folder):
        try:
            written, kept = write()
        except ExportError as error:
            raise fault(str(error)) from error
    for path in written:
        click.echo(path)
    for path in kept:
        click.echo(f"{path} stays as it is", err=True)
