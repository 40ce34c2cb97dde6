"""``neurovis new``: a spec to start from."""

from __future__ import annotations

import re
import shlex
from collections.abc import Mapping
from importlib.resources import files as package_files
from pathlib import Path, PurePosixPath

import click

from neurovis_spec.cli.examples import examples_at_hand, starts
from neurovis_spec.cli.failure import fault
from neurovis_spec.cli.files import check_target, writing
from neurovis_spec.cli.options import examples, listed
from neurovis_spec.cli.progress import on_terminal

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,63}")
_NAME_LINE = re.compile(r"^name:[^\n]*$", re.MULTILINE)
_DATA_FILE = re.compile(r"\b(?:file|mujoco): *([^\s,}\]]+)")
_INCLUDED = re.compile(r"^include: *\[([^\]]*)\]", re.MULTILINE)


def _listed() -> tuple[str, ...]:
    """The names of the examples, then those of the manual's networks to start from."""
    return *examples_at_hand(), *(one.name for one in starts())


def _known() -> tuple[str, ...]:
    """The same, with what else finds the networks of the manual."""
    return *_listed(), *(called for one in starts() for called in one.called)


@click.command(epilog=examples("neurovis new first", "neurovis new walking --from cpg_rbf", "neurovis new --from list"))
@click.argument("name", metavar="NAME")
@listed(
    "example",
    _known,
    _listed,
    "--from",
    "example",
    metavar="EXAMPLE",
    text="Copy an example with its data and included files, or a network to start from of the manual (force); 'list' "
    "shows which there are.",
)
@click.option("--open", "browse", is_flag=True, help="Run it at once, and open its page in the browser.")
@click.pass_context
def command(context: click.Context, name: str, example: str | None, browse: bool) -> None:
    """Write a commented starter spec NAME.yaml, or a copy of an example.

    An example with a folder of its own gets one, NAME/NAME.yaml. Nothing is overwritten. On a terminal it
    is said what shows it in the browser.
    """
    target = Path(name.removesuffix(".yaml") + ".yaml")
    if not _NAME.fullmatch(target.stem):
        hint = "a name is an ASCII letter or underscore, then letters, digits and underscores (at most 64)"
        raise fault(f"a spec cannot be called '{target.stem}'", hint, "invalid-name")
    check_target(target)
    if example is None:
        text = package_files("neurovis_spec.cli").joinpath("starter.yaml").read_text(encoding="utf-8")
        wanted = {target: text.replace("starter.", f"{target.stem}.").encode()}
    elif example not in examples_at_hand():
        (text,) = (one.spec for one in starts() if example in (one.name, *one.called))
        wanted = {target: text.encode()}
    else:
        if examples_at_hand()[example].name == example:  # a folder of its own
            target = target.parent / target.stem / target.name
        wanted = copies(example, target)
    wanted[target] = _NAME_LINE.sub(f"name: {target.stem}", wanted[target].decode(), count=1).encode()
    write_new(wanted, target)
    if browse:
        from neurovis_spec.cli.live import command as live

        live.main([str(target), "--open"], prog_name="neurovis live", standalone_mode=False, parent=context.parent)
    elif on_terminal():
        click.echo(f"see it run: {shlex.join(['neurovis', 'live', str(target), '--open'])}", err=True)


def copies(example: str, target: Path) -> dict[Path, bytes]:
    """The files of an example, and where they go: the spec to ``target``, what it reads beside it as it names them."""
    folder = examples_at_hand()[example]
    wanted: dict[Path, bytes] = {}
    waiting = [PurePosixPath(f"{example}.yaml")]
    while waiting:
        path = waiting.pop(0)
        content = folder.joinpath(*path.parts).read_bytes()
        wanted[target.parent / path if wanted else target] = content
        if path.suffix == ".yaml":
            text = content.decode()
            included = [name.strip() for names in _INCLUDED.findall(text) for name in names.split(",")]
            waiting += [path.parent / name for name in (*included, *_DATA_FILE.findall(text))]
    return wanted


def write_new(wanted: Mapping[Path, bytes], target: Path) -> None:
    """Write files; nothing is written if ``target`` is there, or another one with other content."""
    missing = []
    for path, content in wanted.items():
        if path.exists() and (not path.is_file() or path.read_bytes() != content or path == target):
            raise fault(f"{path} is already there", "choose another name, or remove it first")
        if not path.exists():
            missing.append(path)
    for path in missing:
        with writing(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            with path.open("xb") as file:
                file.write(wanted[path])
        click.echo(str(path))
