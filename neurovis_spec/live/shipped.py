"""The page as ``page/build.py`` has put it together.

In: nothing. Out: its text.
"""

from __future__ import annotations

from pathlib import Path


def page() -> str:
    """The page: one file that asks nobody else for anything."""
    return (Path(__file__).parent / "page.html").read_text(encoding="utf-8")
