"""Signals that ask a process to end: Ctrl-C (SIGINT), SIGTERM, SIGHUP, SIGQUIT.

In: a signal. Out: an exception in the main thread, at once or, where work can be brought to a good end, after it.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Final

#: those that this system knows
ENDING: Final = tuple(
    signal.Signals[name] for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT") if name in signal.Signals.__members__
)


class Ended(KeyboardInterrupt):
    """A signal has asked for an end; ``number`` says which."""

    def __init__(self, number: int = signal.SIGINT, message: str = "") -> None:
        super().__init__(*([message] if message else []))
        self.number = number


def raise_at_signals() -> None:
    """Have each of these signals raise Ended; not those that are ignored (nohup).

    Ctrl-C as well: where a KeyboardInterrupt of Python's own comes up in code that was compiled from text, as in the
    making of a dataclass, Python kills the process at its end though it was caught, and the exit status is lost."""
    for number in ENDING:
        if signal.getsignal(number) in (signal.SIG_DFL, signal.default_int_handler):
            signal.signal(number, _raise)


def _raise(number: int, frame: FrameType | None) -> None:
    raise Ended(number)


class Asked:
    """Whether a signal has asked for an end; ``number`` says which, 0 for none."""

    def __init__(self) -> None:
        self.number = 0

    def __bool__(self) -> bool:
        return self.number != 0


@contextmanager
def heeded() -> Iterator[Asked]:
    """A block in which the first signal only asks, and a second one has its effect at once. A signal that would have no
    handler of this process keeps its effect, and so does everything in other threads."""
    asked = Asked()
    if threading.current_thread() is not threading.main_thread():
        yield asked
        return
    before = {number: handler for number in ENDING if callable(handler := signal.getsignal(number))}

    def note(number: int, frame: FrameType | None) -> None:
        if asked:
            before[signal.Signals(number)](number, frame)
        else:
            asked.number = number

    for number in before:
        signal.signal(number, note)
    try:
        yield asked
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def deferred() -> Iterator[Asked]:
    """A block in which the first signal only asks: it has its effect at the end of the block."""
    with heeded() as asked:
        yield asked
    if asked:
        handler = signal.getsignal(asked.number)
        if callable(handler):
            handler(asked.number, None)
