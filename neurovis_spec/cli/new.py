"""``neurovis new``: a spec to start from."""

from __future__ import annotations

import re
from collections.abc import Iterable
from importlib.resources import files as package_files
from importlib.resources.abc import Traversable
from pathlib import Path

import click

from neurovis_spec.cli.failure import fault
from neurovis_spec.cli.files import check_target, writing
from neurovis_spec.cli.options import examples, known

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,63}")
_NAME_LINE = re.compile(r"^name:[^\n]*$", re.MULTILINE)
_DATA_FILE = re.compile(r"\bfile: *([^\s,}\]]+)")


def example_folder() -> Traversable:
    """Where the examples are: in an installed package beside the code, in a checkout in ``specs/``."""
    package = package_files("neurovis_spec")
    inside = package.joinpath("examples")
    return inside if inside.is_dir() else Path(str(package)).parent / "specs"


def example_names() -> Iterable[str]:
    """The names of the examples."""
    folder = example_folder()
    if not folder.is_dir():
        return ()
    return sorted(entry.name.removesuffix(".yaml") for entry in folder.iterdir() if entry.name.endswith(".yaml"))


@click.command(
    epilog=examples("neurovis new first", "neurovis new walking --from cpg_rbf", "neurovis new try --from list")
)
@click.argument("name", metavar="NAME")
@click.option(
    "--from",
    "example",
    metavar="EXAMPLE",
    callback=known("example", lambda: ("list", *example_names())),
    help="Copy an example with its data files; 'list' shows which there are.",
)
def command(name: str, example: str | None) -> None:
    """Write a commented starter spec NAME.yaml, or a copy of an example.

    Nothing is overwritten.
    """
    if example == "list":
        click.echo("\n".join(example_names()))
        return
    target = Path(name.removesuffix(".yaml") + ".yaml")
    if not _NAME.fullmatch(target.stem):
        hint = "a name is an ASCII letter or underscore, then letters, digits and underscores (at most 64)"
        raise fault(f"a spec cannot be called '{target.stem}'", hint, "invalid-name")
    check_target(target)
    if example is None:
        text = package_files("neurovis_spec.cli").joinpath("starter.yaml").read_text(encoding="utf-8")
        wanted = {target: text.replace("starter.", f"{target.stem}.").encode()}
    else:
        wanted = copies(example, target)
    wanted[target] = _NAME_LINE.sub(f"name: {target.stem}", wanted[target].decode(), count=1).encode()
    write_new(wanted)


def copies(example: str, target: Path) -> dict[Path, bytes]:
    """The files of an example, and where they go: the spec to ``target``, its data files beside it as it names them."""
    folder = example_folder()
    content = folder.joinpath(f"{example}.yaml").read_bytes()
    wanted = {target: content}
    for name in _DATA_FILE.findall(content.decode()):
        wanted[target.parent / name] = folder.joinpath(*name.split("/")).read_bytes()
    return wanted


def write_new(wanted: dict[Path, bytes]) -> None:
    """Write files none of which is there yet with other content; else nothing is written."""
    missing = []
    for path, content in wanted.items():
        if path.exists() and (not path.is_file() or path.read_bytes() != content or path.suffix == ".yaml"):
            raise fault(f"{path} is already there", "choose another name, or remove it first")
        if not path.exists():
            missing.append(path)
    for path in missing:
        with writing(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            with path.open("xb") as file:
                file.write(wanted[path])
        click.echo(str(path))
