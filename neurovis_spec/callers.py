"""Whose line a warning is about: that of the caller's program, whichever of our functions it is that warns.

In: the call stack. Out: a ``stacklevel``.
"""

from __future__ import annotations

from inspect import currentframe


def callers_level() -> int:
    """The ``stacklevel`` by which ``warnings.warn``, called where this is called, points at the line that called this
    package."""
    frame, level = currentframe(), 0
    while frame is not None and str(frame.f_globals.get("__name__", "")).partition(".")[0] == "neurovis_spec":
        frame, level = frame.f_back, level + 1
    return level
