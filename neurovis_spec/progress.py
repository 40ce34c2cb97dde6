"""Progress: how long work tells whoever waits for it how far it is."""

from __future__ import annotations

from typing import Protocol


class Progress(Protocol):
    """Called now and then with what is done and what there is to do (steps, frames)."""

    def __call__(self, done: int, total: int, /) -> None: ...  # noqa: D102
