"""The group of all commands: which there are, found late, and how they end.

In: arguments. Out: a command's work, or one clear message on standard error and the exit status. Neither a command's
module nor anything heavy is imported before that command is called, so that ``neurovis --help`` is quick.
"""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib import import_module
from typing import IO, ClassVar, Final, NoReturn

import click

from neurovis_spec.interrupts import Ended
from neurovis_spec.version import __version__

#: Each command is ``neurovis_spec.cli.NAME:command``; the line is what ``neurovis --help`` says of it.
COMMANDS: Final[Mapping[str, str]] = {
    "new": "Write a commented starter spec.",
    "validate": "Show all errors and warnings of specs at once.",
    "explain": "Explain the code of a finding, with examples.",
    "inspect": "Show groups, connections, delays, rules and choices.",
    "docs": "Explain a built-in, a key of the language, a function or a pattern.",
    "fmt": "Format specs canonically, keeping comments.",
    "schema": "Print the JSON Schema of the language, for editors.",
    "lsp": "Answer an editor: findings while typing, completion, hover, rename.",
    "layout": "Compute and write the layout.",
    "run": "Run a network and write a recording.",
    "sweep": "Run a spec over a grid of parameters and seeds, into a table.",
    "analyze": "Measure a run, into tables, pictures and a page.",
    "render": "Draw one step as a picture.",
    "animate": "Draw a run as a moving picture.",
    "live": "Show a network in the browser while it runs.",
    "ros": "Run a network as a node of ROS, or show and record one.",
    "export": "Write a network as source code for a robot.",
}
#: What the language names and this version does not have yet.
LATER: Final = ("import",)
NO_READER: Final = 141  # as a process that SIGPIPE has ended

EPILOG = """\b
Examples:
  neurovis new first
  neurovis validate first.yaml
  neurovis run first.yaml -o first.npz
  neurovis render first.yaml -o first.svg

SPEC is a path, or - for standard input. 'neurovis COMMAND --help' shows a command's options and examples."""


class LateCommands(click.Group):
    """Commands by name, imported when they are called: ``PREFIX`` + name is the module of each."""

    #: what ``--help`` says of each
    TABLE: ClassVar[Mapping[str, str]]
    PREFIX: ClassVar[str] = "neurovis_spec.cli."

    def list_commands(self, ctx: click.Context) -> list[str]:
        """The names, in the order in which one needs them."""
        return list(self.TABLE)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command of this name, imported now."""
        if cmd_name not in self.TABLE:
            return None
        found: click.Command = import_module(f"{self.PREFIX}{cmd_name}").command
        return found

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The lines of TABLE, without importing a command."""
        with formatter.section("Commands"):
            formatter.write_dl(list(self.TABLE.items()))

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """As click does it, but an unknown name is answered with the nearest."""
        name = args[0]
        if name not in self.TABLE and not name.startswith("-"):
            from neurovis_spec.likeness import suggest

            raise click.UsageError(f"no command '{name}'; {suggest(name, self.TABLE, 'the commands are')}", ctx)
        return super().resolve_command(ctx, args)


class Commands(LateCommands):
    """All commands; expected errors become one message and status 1."""

    TABLE = COMMANDS

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """What there is not yet is said to be so."""
        if args[0] in LATER:
            known = f"the commands are: {', '.join(COMMANDS)}"
            raise click.UsageError(f"this version has no command '{args[0]}' yet; {known}", ctx)
        return super().resolve_command(ctx, args)

    def invoke(self, ctx: click.Context) -> object:
        """Call the command. An expected error is shown without a traceback."""
        try:
            with _plain_warnings():
                return super().invoke(ctx)
        except (click.ClickException, click.exceptions.Exit, click.Abort):
            raise
        except BrokenPipeError:
            _silence(sys.stdout)
            raise click.exceptions.Exit(NO_READER) from None
        except Exception as error:
            if isinstance(error.__cause__, KeyboardInterrupt):  # Python 3.11 makes another error of it within a class
                raise error.__cause__ from None
            from neurovis_spec.cli.failure import explain

            failure = explain(error)
            if failure is None:
                raise
            raise failure from error

    def main(
        self,
        args: Sequence[str] | None = None,
        prog_name: str | None = None,
        complete_var: str | None = None,
        standalone_mode: bool = True,
        **extra: object,
    ) -> NoReturn:
        """Run, and end the process with the status that the module ``neurovis_spec.cli`` states."""
        for stream in (sys.stdout, sys.stderr):
            if hasattr(stream, "reconfigure"):
                stream.reconfigure(errors="backslashreplace")
        if "_NEUROVIS_COMPLETE" in os.environ:  # as the README sets it: somebody has pressed the key
            from neurovis_spec.cli.shells import register

            register()
        try:
            result = super().main(args, prog_name, complete_var, standalone_mode=False, **extra)
            status = result if isinstance(result, int) else 0
        except click.ClickException as error:
            status = error.exit_code
            _show(error)
        except OSError as error:  # of what is written before there is a command: --help on a full disk
            from neurovis_spec.cli.failure import fault, said

            status = 1
            _show(fault(said(error)))
        except click.Abort as error:
            cause = error.__cause__
            status = 128 + (cause.number if isinstance(cause, Ended) else Ended().number)
            click.echo(str(cause or "") or "stopped", err=True)
        sys.exit(_flushed(status))


@contextmanager
def _plain_warnings() -> Iterator[None]:
    """Warnings of a run as a line on standard error, without the place in our code."""

    def show(
        message: Warning | str,
        category: type[Warning],
        filename: str,
        lineno: int,
        file: object = None,
        line: str | None = None,
    ) -> None:
        code = f"[{code}]" if (code := getattr(message, "code", "")) else ""
        click.echo(f"{getattr(category, 'prefix', 'warning')}{code}: {message}", err=True)

    with warnings.catch_warnings():
        warnings.showwarning = show
        yield


def _show(error: click.ClickException) -> None:
    try:
        error.show()
    except OSError:  # nobody reads it, or there is no room for it: the status says it all the same
        _silence(sys.stderr)


def _flushed(status: int) -> int:
    """The status, after what is still buffered has been written: a full disk shows only now."""
    try:
        if sys.stdout is not None:
            sys.stdout.flush()
    except BrokenPipeError:
        _silence(sys.stdout)
        return status or NO_READER
    except OSError as error:
        if not status:  # else it is said already, of the first part of what is buffered
            click.echo(f"error: standard output: {error.strerror or error}", err=True)
        _silence(sys.stdout)
        return status or 1
    return status


def _silence(stream: IO[str]) -> None:
    """Send what is still buffered nowhere, so that the interpreter says nothing at its end."""
    with open(os.devnull, "wb") as nowhere:  # noqa: PTH123
        os.dup2(nowhere.fileno(), stream.fileno())


@click.group(cls=Commands, epilog=EPILOG, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="neurovis", message="%(prog)s %(version)s")
def neurovis() -> None:
    """From a YAML spec to a running neural network, a layout and pictures that explain it."""
