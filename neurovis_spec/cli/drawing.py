"""What ``render`` and ``animate`` share: which network, of which run, how it looks and what of it is shown.

In: texts of the command line. Out: a Drawing, which compiles the network and reads its files, once it is known that
what is written replaces none of them.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from neurovis_spec.cli.completion import one_of, paths
from neurovis_spec.cli.files import check_files, check_target, files_of, network_of, recording_of, show, tables
from neurovis_spec.cli.options import (
    as_one,
    body_options,
    engine_option,
    finite,
    input_option,
    need_run,
    run_option,
    set_option,
    spec_argument,
    theme_option,
)

if TYPE_CHECKING:
    from neurovis_spec.compiled import CompiledNetwork
    from neurovis_spec.keywords import PictureKeywords


@dataclass(frozen=True)
class Drawing:
    """What is drawn, as the command line says it."""

    spec: str
    recording: str | None
    run: int | None
    inputs: dict[str, str]
    theme: str | None
    views: tuple[str, ...]
    engine: str | None
    collapse: tuple[str, ...]
    focus: str | None
    paths: str | None
    min_weight: float | None
    full: bool
    size: tuple[int, int] | None
    settings: dict[str, float | str]

    def made_for(self, output: Path) -> tuple[CompiledNetwork, PictureKeywords]:
        """The network, and how it is drawn into a file. Raises UsageError where it would replace what is read."""
        need_run(self.inputs, self.recording)
        read = [("the recording that is drawn", self.recording), *files_of(self.inputs)]
        check_target(output, [("the spec itself", self.spec), *read])
        network = network_of(self.spec, self.settings)
        check_files(output, network)
        return network, {
            "recording": recording_of(self.recording, self.run),
            "inputs": tables(self.inputs, network.network) or None,
            "theme": self.theme,
            "engine": self.engine,
            "view": self.views or None,
            "collapse": self.collapse,
            "focus": self.focus,
            "paths": self.paths,
            "min_weight": self.min_weight,
            "full": self.full,
            "size": self.size,
        }


def show_warnings(network: CompiledNetwork, given: PictureKeywords, effort: str | None = None) -> None:
    """Write the warnings about the layout, where one was drawn, to standard error."""
    if network.needs_layout(given["view"]):
        show(network.drawn(given["engine"], effort, given["size"]).warnings, network.sources)


def _size(ctx: click.Context, param: click.Parameter, value: str | None) -> tuple[int, int] | None:
    """Width and height, of WIDTHxHEIGHT."""
    from neurovis_spec.keywords import size_of

    if value is None:
        return None
    sides = value.lower().replace("×", "x").split("x")
    if len(sides) != 2 or not all(side.isascii() and side.isdecimal() for side in sides):
        raise click.BadParameter(f"'{value}' is not of the form WIDTHxHEIGHT, such as 800x600")
    try:
        return size_of([int(side) for side in sides])
    except ValueError as fault:
        raise click.BadParameter(str(fault)) from None


def _views() -> Iterable[str]:
    from neurovis_spec.language.words import VIEWS

    return VIEWS


drawing_options: Final = as_one(
    "drawing",
    Drawing,
    spec_argument,
    click.option(
        "--recording",
        metavar="FILE",
        shell_complete=paths,
        help="Show steps of this recording; without it the network is run.",
    ),
    run_option,
    input_option,
    theme_option,
    click.option(
        "--view",
        "views",
        metavar="V",
        multiple=True,
        shell_complete=one_of(_views),
        help="network, pathways (a group a glyph), matrix, traces, raster, weights or body; 'traces: C1, C2' or "
        "'weights: K -> O' says of what. Repeatable, from top to bottom; default: the spec's figure, else the network, "
        "with its body where there is one.",
    ),
    click.option(
        "--collapse",
        metavar="REF",
        multiple=True,
        help="Draw a group or an instance as one glyph, its connections added up. Repeatable.",
    ),
    click.option("--focus", metavar="REFS", help="Show these neurons with all that they are connected to."),
    click.option("--path", "paths", metavar="'A -> B'", help="Show the shortest directed paths from A to B."),
    click.option(
        "--min-weight",
        type=click.FloatRange(min=0),
        callback=finite,
        metavar="X",
        help="Leave out connections with |w| below X.",
    ),
    click.option("--full", is_flag=True, help="Draw all connections, however many there are."),
    click.option(
        "--size",
        metavar="WxH",
        callback=_size,
        help="Width and height in pixels, such as 400x1200, for which it is laid out; default: the spec's.",
    ),
    engine_option,
    set_option,
    body_options,
)
