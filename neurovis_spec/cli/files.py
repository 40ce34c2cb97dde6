"""Files and standard input as the commands read and write them.

In: a SPEC, a recording or a table as named on the command line, or a path to write. Out: a compiled network, a
recording, an array; or an error that ends the command. What is written can be, and is none of the files that are read:
that is known before any work is done.
"""

from __future__ import annotations

import os
import shlex
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from neurovis_spec.cli.failure import fault
from neurovis_spec.cli.progress import progress
from neurovis_spec.real_paths import CIRCLE, is_circular, real_path, reason_of

if TYPE_CHECKING:
    from neurovis_spec.arrays import FloatArray
    from neurovis_spec.compiled import CompiledNetwork
    from neurovis_spec.compiler.network import Network
    from neurovis_spec.diagnostics import Diagnostic
    from neurovis_spec.keywords import CompileKeywords
    from neurovis_spec.layout import Layout
    from neurovis_spec.runtime.recording import Recording

STDIN: Final = "<stdin>"
#: characters read from standard input: more than the language allows, so that its own limit speaks
_LARGEST: Final = (64 << 20) + 1
#: kinds of files that stand in for the source of an input
_INPUTS: Final = (".csv", ".npy")


def compiled(spec: str, parameters: Mapping[str, float | str] | None = None) -> CompiledNetwork:
    """The network of a SPEC, ``-`` being standard input, with the command's --root, --limit and --body. Raises
    SpecError."""
    with progress("compiling"):
        return compiler(spec, parameters)()


def compiler(spec: str, parameters: Mapping[str, float | str] | None = None) -> Callable[[], CompiledNetwork]:
    """What compiles a SPEC so, also in another thread when the command has long begun. It raises SpecError."""
    from neurovis_spec import api

    how = how_to_compile(parameters)
    if spec != "-":
        return lambda: api.compile(spec, **how)
    return lambda: api.compile_text(standard_input(), file=STDIN, folder=Path.cwd(), **how)


def compiler_in_place(spec: str, parameters: Mapping[str, float | str]) -> Callable[[str], CompiledNetwork]:
    """What compiles a text as if it stood in the file of a SPEC, also when the command has long begun. It raises
    SpecError."""
    from neurovis_spec import api

    how, folder = how_to_compile(parameters), Path(spec).parent
    return lambda text: api.compile_text(text, file=spec, folder=folder, **how)


def how_to_compile(parameters: Mapping[str, float | str] | None = None) -> CompileKeywords:
    """The command's --root, --limit, --body and --no-body, with these values of --set. Raises UsageError."""
    context = click.get_current_context(silent=True)
    given = {} if context is None else context.meta
    path, without = given.get("neurovis.body_file"), given.get("neurovis.bodiless")
    if path is not None and without:
        raise click.UsageError("--body names a body, and --no-body asks for none: give one of them")
    body = not without if path is None else path
    root, limit = given.get("neurovis.root"), given.get("neurovis.limit")
    return {"parameters": parameters, "root": root, "limit": limit, "body": body}


def network_of(spec: str, parameters: Mapping[str, float | str] | None = None) -> CompiledNetwork:
    """``compiled``; that there are warnings is said on standard error."""
    network = compiled(spec, parameters)
    tell_warnings(spec, network.warnings)
    return network


def tell_warnings(spec: str, found: Sequence[Diagnostic]) -> None:
    """Say on standard error how many warnings a SPEC has, and what shows them: in full they stand there alone."""
    if found:
        from neurovis_spec.diagnostics import printable

        how = how_to_compile()
        body = None if isinstance(how["body"], bool) else how["body"]
        given = {"--root": how["root"], "--limit": how["limit"], "--body": body}
        options = [word for name, value in given.items() if value is not None for word in (name, str(value))]
        options += ["--no-body"] if how["body"] is False else []
        line = shlex.join(["neurovis", "validate", spec, *options])
        click.echo(f"{count(len(found), 'warning')}: {printable(line)}", err=True)


def show(found: Sequence[Diagnostic], sources: Mapping[str, str]) -> None:
    """Write findings to standard error, with the lines of these texts."""
    if found:
        from neurovis_spec.diagnostics import show_text

        click.echo(show_text(found, sources), err=True)


def standard_input() -> str:
    """The text of standard input. Raises SpecError where it is not UTF-8, UsageError where it is closed."""
    from neurovis_spec.diagnostics import Diagnostic, Span, SpecError

    if sys.stdin is None:
        raise click.UsageError("standard input is closed: give a path for SPEC, or send a spec to '-'")
    data = sys.stdin.buffer.read(_LARGEST)
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        before = data[: error.start].decode("utf-8")
        line, column = before.count("\n") + 1, error.start and len(before) - before.rfind("\n")
        span = Span(STDIN, line, column or 1, line, (column or 1) + 1)
        message = f"the byte 0x{data[error.start]:02x} is not UTF-8"
        shown = {STDIN: data.decode("utf-8", "replace")}
        raise SpecError([Diagnostic("invalid-utf8", message, span, hint="save the text as UTF-8")], shown) from None


def earlier_layout(path: Path) -> Layout | None:
    """The layout in a file, if it is there: all that it says, of neurons that are gone as well. Raises SpecError for
    what is no layout file."""
    from neurovis_spec.diagnostics import Findings, Span
    from neurovis_spec.language.yaml.opening import FileFault, read_bytes
    from neurovis_spec.language.yaml.reader import LARGEST
    from neurovis_spec.layout.file import parse_bytes

    data = read_bytes(path, LARGEST)
    findings = Findings()
    layout = None
    if not isinstance(data, FileFault):
        layout = parse_bytes(data, str(path), findings)
    elif data.code != "file-missing":
        findings.error(data.code, Span(str(path), 1, 1, 1, 1), f"the file {data.reason}")
    findings.check()
    return layout


def recording_of(path: str | None, run: int | None = None) -> Recording | None:
    """A recording, if one is named, and of several runs in it the one with this number. Raises RecordingError,
    UsageError."""
    if path is None:
        if run is not None:
            raise click.UsageError("--run says which run of a recording is meant: name one by --recording")
        return None
    from neurovis_spec import api

    return api.load(path, run=run)


def tables(named: Mapping[str, str], network: Network) -> dict[str, FloatArray]:
    """Input name to array (steps, columns) of the ``.csv`` and ``.npy`` files, none of which is opened before every
    name is known. Raises InputError, or SpecError with all findings."""
    if not named:
        return {}
    from neurovis_spec.diagnostics import Findings, Span
    from neurovis_spec.language.data.files import NamedFile, read_table
    from neurovis_spec.language.unknown import UNKNOWN
    from neurovis_spec.runtime.inputs import check_names

    check_names(network, named)
    findings = Findings()
    arrays: dict[str, FloatArray] = {}
    for name, text in named.items():
        place = Span(text, 1, 1, 1, 1)
        path = real_path(text)
        table = read_table(NamedFile(path.name, path.parent, path.parent, place), findings, inside=True, kinds=_INPUTS)
        if table is UNKNOWN:
            continue
        if table.numbered:
            from neurovis_spec.language.data.csv_table import AS_TEXTS, NUMBERED

            findings.warning("numbered-columns", place, NUMBERED, AS_TEXTS)
        arrays[name] = table.values
    findings.check()
    show(findings.sorted(), findings.sources)
    return arrays


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

    refuse_dash(folder, "folder")
    refuse_circle(folder)
    with writing(folder):
        try:
            written, kept = write()
        except ExportError as error:
            raise fault(str(error)) from error
    for path in written:
        click.echo(path)
    for path in kept:
        click.echo(f"{path} stays as it is", err=True)


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """A block that writes a file; what the system refuses is said of this path, or of another one for which there is no
    room, such as a checkpoint beside it."""
    from neurovis_spec.runtime.files import FULL

    try:
        yield
    except BrokenPipeError:
        raise
    except OSError as error:
        full = error.filename if error.errno in FULL else None
        raise fault(f"{full or path} cannot be written: {reason_of(error)}") from error


def count(number: int, word: str) -> str:
    """A number with thousands apart, and its noun.

    >>> count(12000, "step"), count(1, "step")
    ('12,000 steps', '1 step')
    """
    return f"{number:,} {word}{'' if number == 1 else 's'}"


def check_target(path: Path | None, inputs: Iterable[tuple[str, str | None]] = (), option: str = "-o") -> None:
    """Refuse a path that cannot be written, or is one of the ``inputs``: what each is, in words, and its path."""
    if path is None:
        return
    refuse_dash(path, "file", option)
    for what, read in inputs:
        if read is not None and read != "-" and (_same(path, Path(read)) or _is_part_of(Path(read), path)):
            raise _refused(path, what, option)
    refuse_circle(path)
    if path.is_dir():
        raise fault(f"{path} is a folder, not a file")
    if not path.parent.is_dir():
        raise fault(f"{path}: there is no folder '{path.parent}'", f"make it: mkdir -p {path.parent}")


def check_folder(path: Path, option: str = "-o") -> None:
    """Refuse a folder that is something else, or that could not be made."""
    refuse_dash(path, "folder", option)
    refuse_circle(path)
    if path.exists() and not path.is_dir():
        raise fault(f"{path} is a file, not a folder", "name a folder; it is made if it is not there")
    if not path.parent.is_dir():
        raise fault(f"{path}: there is no folder '{path.parent}'", f"make it: mkdir -p {path.parent}")


def refuse_dash(path: Path, kind: str, option: str = "-o") -> None:
    """Refuse what means standard output elsewhere, where a file or a folder is asked for."""
    if str(path) == "-":
        raise click.UsageError(f"{option} takes a {kind}: what is written does not go to standard output ('-')")


def refuse_circle(path: Path) -> None:
    """Refuse a path on which links lead round in a circle."""
    if is_circular(path):
        raise fault(f"{path}: {CIRCLE}", "remove these links, or choose another name")


def files_of(inputs: Mapping[str, str]) -> list[tuple[str, str | None]]:
    """What the files of inputs are, in words, and their paths."""
    return [(f"the file of the input '{name}'", path) for name, path in inputs.items()]


def check_files(path: Path | None, network: CompiledNetwork, option: str = "-o", *, layout: bool = False) -> None:
    """Refuse a path that is a file of the spec: one that it includes, or reads data from. ``layout``: what is written
    is a layout file, so it may be the one that the spec names."""
    if path is None:
        return
    memory = network.layout_file
    for file in sorted(network.files):
        is_memory = memory is not None and _same(file, memory)
        if _same(path, file) and not (layout and is_memory):
            what = "the layout file of the spec" if is_memory else f"a file that the spec reads ('{_near(file)}')"
            raise _refused(path, what, option)


def _refused(path: Path, what: str, option: str) -> click.UsageError:
    return click.UsageError(f"{option} {path} is {what}, which would be lost: name another file")


def _same(one: Path, other: Path) -> bool:
    """Whether two paths lead to the same file, through whatever links."""
    if os.path.realpath(one) == os.path.realpath(other):
        return True
    try:
        return one.samefile(other)
    except OSError:
        return False


def _is_part_of(part: Path, path: Path) -> bool:
    """Whether one is the part of a recording, and the other what it was to become: writing that clears the part."""
    from neurovis_spec.runtime.parts import target_of

    target = target_of(part)
    return target is not None and _same(target, path)


def _near(path: Path) -> str:
    """A path as one names it from here."""
    try:
        return str(path.relative_to(Path.cwd()))
    except ValueError:
        return str(path)
