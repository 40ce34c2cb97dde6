"""Arguments and options that several commands share.

In: texts of the command line. Out: checked values; what cannot be one is wrong usage (status 2), with the nearest
known names where a name is wanted.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import click

from neurovis_spec import plugins
from neurovis_spec.cli.completion import input_files, one_of, paths, settings
from neurovis_spec.likeness import suggest

Command: TypeAlias = Callable[..., object]
#: What gives a command an option, or several.
Option: TypeAlias = Callable[[Command], Command]
Callback = Callable[[click.Context, click.Parameter, str | None], str | None]


class FirstStep(click.IntRange):
    """The number of a step. ``--from`` takes a file elsewhere: who gives one is told what it is called here."""

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """The number. Raises BadParameter."""
        try:
            number = int(str(value))
        except ValueError:
            is_file = Path(str(value)).suffix.lower() in (".npz", ".csv")
            hint = f": did you mean --recording {value}?" if is_file else ""
            self.fail(f"'{value}' is no number of a step{hint}", param, ctx)
        return int(super().convert(number, param, ctx))


def several(*options: Option) -> Option:
    """Options in this order, as one decorator."""

    def add(command: Command) -> Command:
        for option in reversed(options):
            command = option(command)
        return command

    return add


def as_one(name: str, made: type, *options: Option) -> Option:
    """Options that a command takes together, as the argument ``name``: an object of the class ``made``, whose
    annotated fields they are called like."""

    def add(command: Command) -> Command:
        @functools.wraps(command)
        def with_one(**values: object) -> object:
            own = {field: values.pop(field) for field in made.__annotations__}
            return command(**values, **{name: made(**own)})

        return several(*options)(with_one)

    return add


def _pair(text: str, form: str) -> tuple[str, str]:
    """The two sides of ``name=…``."""
    name, _, value = (part.strip() for part in text.partition("="))
    if not name or not value:
        raise click.BadParameter(f"'{text}' is not of the form {form}")
    return name, value


def _once(pairs: Iterable[tuple[str, str]]) -> dict[str, str]:
    """Name to text; a name that is there twice is wrong usage, as a key is that a spec has twice."""
    result: dict[str, str] = {}
    for name, text in pairs:
        if name in result:
            raise click.BadParameter(f"'{name}' is given twice, as '{result[name]}' and as '{text}'")
        result[name] = text
    return result


def _settings(ctx: click.Context, param: click.Parameter, values: tuple[str, ...]) -> dict[str, float | str]:
    """Name to number, or to a number with a unit."""
    from neurovis_spec.language.units import measured

    settings: dict[str, float | str] = {}
    for name, text in _once(_pair(value, "name=value") for value in values).items():
        if measured(text) is not None:
            settings[name] = text
            continue
        try:
            number = float(text)
        except ValueError:
            number = math.nan
        if not math.isfinite(number) or "_" in text:
            raise click.BadParameter(f"'{text}' is not a finite number")
        settings[name] = number
    return settings


def ranges(ctx: click.Context, param: click.Parameter, values: tuple[str, ...]) -> dict[str, str]:
    """Name to range."""
    return _once(_pair(value, "name=RANGE") for value in values)


def _files(ctx: click.Context, param: click.Parameter, values: tuple[str, ...]) -> dict[str, str]:
    """Name to path."""
    return _once(_pair(value, "name=FILE") for value in values)


def known(what: str, names: Callable[[], Iterable[str]]) -> Callback:
    """A check for an option whose value is one of ``names()``, which is not called before there is a value."""

    def check(ctx: click.Context, param: click.Parameter, value: str | None) -> str | None:
        if value is not None:
            there = tuple(names())
            if value not in there:
                raise click.BadParameter(f"there is no {what} '{value}'; {suggest(value, there, 'there are')}")
        return value

    return check


def listed(
    what: str,
    names: Callable[[], Iterable[str]],
    lines: Callable[[], Iterable[str]],
    *declared: str,
    metavar: str,
    text: str,
) -> Option:
    """An option whose value is one of ``names()``, or 'list': that prints ``lines()`` and ends the command, whatever
    else it is given or lacks. It is ``declared`` as for ``click.option``, and explained by a text."""

    def values() -> Iterable[str]:
        return ("list", *names())

    checked = known(what, values)

    def answer(ctx: click.Context, param: click.Parameter, value: str | None) -> str | None:
        if value == "list" and not ctx.resilient_parsing:  # as it is for completion
            click.echo("\n".join(lines()))
            ctx.exit()
        return checked(ctx, param, value)

    return click.option(
        *declared, metavar=metavar, callback=answer, is_eager=True, shell_complete=one_of(values), help=text
    )


def _backends() -> Iterable[str]:
    return ("auto", *plugins.names(plugins.BACKENDS))


def _lines_of_backends() -> Iterable[str]:
    from neurovis_spec.runtime.backend import listing

    return listing()


def _engines() -> Iterable[str]:
    return ("auto", *plugins.names(plugins.LAYOUTS))


def _themes() -> Iterable[str]:
    from neurovis_spec.themes import THEMES

    return THEMES


def _noted(ctx: click.Context, param: click.Parameter, value: object) -> object:
    """Keep how the spec is to be compiled with the command: ``files.how_to_compile`` asks for it."""
    ctx.meta[f"neurovis.{param.name}"] = value
    return value


#: Where the files of a spec may lie, and how large it may become.
compile_options = several(
    click.option(
        "--root",
        type=click.Path(path_type=Path, exists=True, file_okay=False),
        metavar="DIR",
        expose_value=False,
        callback=_noted,
        help="Data files and included files may lie anywhere below; default: the folder of the spec.",
    ),
    click.option(
        "--limit",
        type=click.IntRange(min=1),
        metavar="N",
        expose_value=False,
        callback=_noted,
        help="The most connections, ten million by default, and the most neurons where N is above their million.",
    ),
)
#: Which body the network has.
body_options = several(
    click.option(
        "--body",
        "body_file",
        type=click.Path(path_type=Path),
        metavar="FILE",
        expose_value=False,
        callback=_noted,
        shell_complete=paths,
        help="Give the network the body of this YAML file (body: {…}) in place of the spec's.",
    ),
    click.option(
        "--no-body",
        "bodiless",
        is_flag=True,
        expose_value=False,
        callback=_noted,
        help="Leave out the spec's body: inputs are what their sources say.",
    ),
)
spec_argument = several(click.argument("spec", metavar="SPEC", shell_complete=paths), compile_options)
specs_argument = click.argument("specs", metavar="SPEC...", nargs=-1, required=True, shell_complete=paths)


set_option = click.option(
    "--set",
    "settings",
    metavar="name=value",
    multiple=True,
    callback=_settings,
    shell_complete=settings,
    help="Give a parameter another value. Repeatable, once for each.",
)
input_option = click.option(
    "--input",
    "inputs",
    metavar="name=FILE",
    multiple=True,
    callback=_files,
    shell_complete=input_files,
    help="Replace the source of an input by a .csv or .npy file, one row a step. Repeatable, once for each.",
)


def need_run(inputs: Mapping[str, str], recording: str | None) -> None:
    """Refuse inputs where a recording is drawn: nothing is run that could take them."""
    if inputs and recording is not None:
        raise click.UsageError("--input is for a run, and with --recording nothing is run: give one of the two")


backend_option = listed(
    "backend",
    _backends,
    _lines_of_backends,
    "--backend",
    metavar="B",
    text="What computes; default (auto): what made the steps that it goes on from, else C where a compiler is, else "
    "numpy (NEUROVIS_BACKEND names another). 'list' shows which there are.",
)
engine_option = click.option(
    "--engine",
    metavar="E",
    callback=known("layout engine", _engines),
    shell_complete=one_of(_engines),
    help="Layout engine, such as layered, circular, grid or manual; else the spec's.",
)
effort_option = click.option(
    "--effort",
    type=click.Choice(("quick", "normal", "best")),
    help="How long layered may look for fewer crossings; default: normal.",
)
theme_option = click.option(
    "--theme",
    metavar="T",
    callback=known("theme", _themes),
    shell_complete=one_of(_themes),
    help="default, dark, print or paper; else the spec's.",
)
run_option = click.option(
    "--run",
    type=click.IntRange(min=1),
    metavar="N",
    help="Of a recording in which the network began anew, its N-th run; default: the last.",
)


@dataclass(frozen=True)
class Running:
    """What is run, as the command line says it."""

    steps: int | None
    settings: dict[str, float | str]
    inputs: dict[str, str]
    backend: str | None


def running_options(text: str) -> Option:
    """How long a network runs, with what and by what, as one argument ``running``; ``text`` explains ``--steps``."""
    steps = click.option("--steps", type=click.IntRange(1, 2**53), metavar="N", help=text)
    return as_one("running", Running, steps, set_option, input_option, backend_option)


start_option = click.option(
    "--from",
    "start",
    metavar="RECORDING",
    shell_complete=paths,
    help="Begin with the last weights and activities of this recording; states of models begin anew, but in a network "
    "with derivatives, where the recording has them (run --states all).",
)
only_option = click.option(
    "--only",
    type=click.Choice(["weights"]),
    help="With --from take nothing but the weights of connections that learn: a new trial.",
)


def check_only(only: str | None, start: str | None) -> None:
    """Refuse to take some of a recording where none is given. Raises UsageError."""
    if only is not None and start is None:
        raise click.UsageError("--only says what is taken of a recording: give one with --from")


def finite(ctx: click.Context, param: click.Parameter, value: float | None) -> float | None:
    """For options that take a number: NaN passes every range."""
    if value is not None and not math.isfinite(value):
        raise click.BadParameter(f"{value} is not a finite number.")
    return value


def output_option(text: str, *, required: bool = False) -> Option:
    """``-o FILE``."""
    kind = click.Path(path_type=Path)
    return click.option("-o", "--output", type=kind, metavar="FILE", required=required, help=text)


def examples(*lines: str) -> str:
    """The examples at the end of a command's help, a line each."""
    return "\b\nExamples:\n" + "\n".join(f"  {line}" for line in lines)
