"""Where paths lead, through all links.

In: a path that somebody gave. Out: the one that it leads to, or whether it leads nowhere. ``Path.resolve`` is not for
such paths: it raises RuntimeError for links that lead round in a circle, in some versions of Python.
"""

from __future__ import annotations

import errno
import os
from pathlib import Path
from typing import Final

#: What is said of links that lead nowhere.
CIRCLE: Final = "its symbolic links lead round in a circle"


def real_path(path: str | os.PathLike[str]) -> Path:
    """The absolute path without links, as far as it is there. Links that lead round in a circle are kept: who opens the
    path is told of them (OSError). Raises ValueError for what can be no path, such as one with NUL."""
    return Path(os.path.realpath(path))


def reason_of(error: OSError) -> str:
    """Why a file could not be opened, in words."""
    return CIRCLE if error.errno == errno.ELOOP else error.strerror or str(error)


def is_circular(path: Path) -> bool:
    """Whether links on the way to a path lead round in a circle."""
    try:
        path.stat()
    except OSError as error:
        return error.errno == errno.ELOOP
    return False
