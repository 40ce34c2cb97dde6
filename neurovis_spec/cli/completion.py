"""What a shell offers for an argument or the value of an option.

In: the command line as far as it is typed. Out: CompletionItems, of click's kinds: texts, or "the shell's own files".
Nothing is imported, listed or read before somebody presses the key.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final, TypeAlias

import click

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

    Items: TypeAlias = list[CompletionItem[str]]

#: A callback for ``shell_complete`` of click's parameters.
Complete: TypeAlias = "Callable[[click.Context, click.Parameter, str], Items]"

#: The largest spec that is read for the names in it while somebody waits for a key, in bytes.
_LARGEST: Final = 1 << 20


def paths(ctx: click.Context, param: click.Parameter, incomplete: str) -> Items:
    """Files and folders, as the shell itself completes them."""
    from click.shell_completion import CompletionItem

    return [CompletionItem(incomplete, type="file")]


def one_of(names: Callable[[], Iterable[str]]) -> Complete:
    """The names that begin as what is typed; ``names()`` is called then."""

    def complete(ctx: click.Context, param: click.Parameter, incomplete: str) -> Items:
        return _items(name for name in names() if name.startswith(incomplete))

    return complete


def settings(ctx: click.Context, param: click.Parameter, incomplete: str) -> Items:
    """``name=`` for the parameters of the spec on the line."""
    return _items(f"{name}=" for name in _names_in(ctx, "parameters") if f"{name}=".startswith(incomplete))


def axes(ctx: click.Context, param: click.Parameter, incomplete: str) -> Items:
    """``name=`` for what a sweep of the spec on the line can be over."""
    return _items(f"{name}=" for name in ("seed", *_names_in(ctx, "parameters")) if f"{name}=".startswith(incomplete))


def input_files(ctx: click.Context, param: click.Parameter, incomplete: str) -> Items:
    """``name=`` for the inputs of the spec on the line, behind the sign the files."""
    name, sign, path = incomplete.partition("=")
    if sign:
        return _items(f"{name}={one}" for one in _entries(path))
    return _items(f"{one}=" for one in _names_in(ctx, "inputs") if one.startswith(name))


def _items(values: Iterable[str]) -> Items:
    from click.shell_completion import CompletionItem

    return [CompletionItem(value) for value in values]


def _names_in(ctx: click.Context, section: str) -> tuple[str, ...]:
    """The keys of a section of the spec on the line, none where it cannot be read in a moment: it is not compiled."""
    from neurovis_spec.diagnostics import Findings
    from neurovis_spec.language.yaml.reader import read_file
    from neurovis_spec.language.yaml.source import Mapping

    spec = ctx.params.get("spec") or next(iter(ctx.args), None)  # an option without its value ends click's parsing
    if not isinstance(spec, str):
        return ()
    path = Path(spec)
    try:
        if not path.is_file() or path.stat().st_size > _LARGEST:
            return ()
    except (OSError, ValueError):
        return ()
    document = read_file(path, spec, Findings())
    found = None if document is None else document.root.get(section)
    return tuple(entry.name for entry in found.entries) if isinstance(found, Mapping) else ()


def _entries(typed: str) -> Iterator[str]:
    """What lies where a path that begins so leads, folders with their slash; hidden files only if asked for."""
    folder, start = os.path.split(typed)
    try:
        found = sorted(Path(folder or ".").expanduser().iterdir())
    except (OSError, RuntimeError, ValueError):
        return
    for entry in found:
        if entry.name.startswith(start) and (start or not entry.name.startswith(".")):
            yield os.path.join(folder, entry.name) + ("/" if entry.is_dir() else "")  # noqa: PTH118
