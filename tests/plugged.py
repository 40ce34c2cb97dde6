"""A folder with plug-ins that is on the path for a while, and the command line with them."""

from __future__ import annotations

import functools
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from neurovis_spec.cli.commands import neurovis


@contextmanager
def plugged(site: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """In this folder, whose distributions are found; afterwards none of it is known any more."""
    monkeypatch.chdir(site)
    monkeypatch.syspath_prepend(site)
    before = set(sys.modules)
    forget()
    yield
    forget()
    for name in set(sys.modules) - before:
        if str(getattr(sys.modules[name], "__file__", "")).startswith(str(site)):
            del sys.modules[name]


def forget() -> None:
    """What is found or read once in a process is found and read anew, by functions and by methods of classes."""
    for name, module in list(sys.modules.items()):
        for value in list(vars(module).values()) if name.startswith("neurovis_") else ():
            methods = list(vars(value).values()) if isinstance(value, type) else ()
            for function in (value, *(getattr(method, "__func__", method) for method in methods)):
                if isinstance(function, type(functools.cache(len))):
                    function.cache_clear()


def call(*arguments: str) -> Result:
    """A command; what it raises is raised here."""
    result = CliRunner().invoke(neurovis, arguments)
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result
