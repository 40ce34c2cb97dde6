"""What went wrong, in words: from an exception to the message that ends a command with status 1.

In: an exception. Out: a Failure to raise in its place, or None for one that no input may cause (a mistake of ours,
whose traceback is wanted).
"""

from __future__ import annotations

from typing import IO, Any

import click

from neurovis_spec.diagnostics import SpecError, printable, show_text
from neurovis_spec.real_paths import reason_of


class Failure(click.ClickException):
    """A text for standard error; status 1."""

    exit_code = 1

    def show(self, file: IO[Any] | None = None) -> None:
        """Print the text as it is."""
        click.echo(self.message, file=file, err=file is None)


def fault(message: str, hint: str | None = None, code: str = "") -> Failure:
    """A Failure in the form of a finding: ``error[CODE]: MESSAGE`` and a help line."""
    head = f"error[{code}]" if code else "error"
    lines = [f"{head}: {printable(message)}"] + ([f"help: {printable(hint)}"] if hint else [])
    return Failure("\n".join(lines))


def explain(error: Exception) -> Failure | None:
    """The Failure that says what an expected error means, or None."""
    if isinstance(error, SpecError):
        return Failure(show_text(error.diagnostics, error.sources))
    if isinstance(error, OSError):
        return fault(said(error))
    if isinstance(error, MemoryError):
        return fault("there is not enough memory for this")
    from neurovis_spec.layout.model import LayoutRefusalError

    if isinstance(error, LayoutRefusalError):
        if error.diagnostic is not None:
            return Failure(show_text((error.diagnostic,), error.sources))
        return fault(str(error), error.hint, error.code)
    if isinstance(error, _input_errors()):
        hint = getattr(error, "hint", None)
        return fault(str(error), hint if isinstance(hint, str) else None)
    return None


def said(error: OSError) -> str:
    """The path and the system's words for an error.

    >>> said(FileNotFoundError(2, "No such file or directory", "x.npz"))
    'x.npz: No such file or directory'
    """
    words = reason_of(error)
    return f"{error.filename}: {words}" if isinstance(error.filename, str) else words


def _input_errors() -> tuple[type[Exception], ...]:
    """What running and drawing raise where the input is invalid; imported when something has gone wrong."""
    from neurovis_spec.body import BodyError
    from neurovis_spec.plugins import PluginError
    from neurovis_spec.ros.middleware import MiddlewareError
    from neurovis_spec.runtime.backend import BackendError
    from neurovis_spec.runtime.errors import RecordingError, UnknownNameError
    from neurovis_spec.runtime.inputs import InputError
    from neurovis_spec.runtime.simulation import ParameterError
    from neurovis_spec.scene.renderers import RendererError
    from neurovis_spec.sweeps.grid import SweepError

    return (
        *(RendererError, BackendError, BodyError, InputError, ParameterError, PluginError, RecordingError, SweepError),
        *(MiddlewareError, UnknownNameError),
    )
