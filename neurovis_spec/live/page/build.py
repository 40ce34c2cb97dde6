"""Puts the page together: its modules, its style and its frame become ``page.html``, which is what is shipped.

In: the files beside this one. Out: the page beside this folder, which begins with a digest of them. Run ``make page``
after every change: esbuild, which npm installs, makes one small script of the modules. ``--check`` says whether the
page is up to date.
"""

from __future__ import annotations

import hashlib
import subprocess
import sys
from pathlib import Path

from jinja2 import Environment, StrictUndefined

HERE = Path(__file__).parent
TARGET = HERE.parent / "page.html"
ESBUILD = HERE.parents[2] / "node_modules" / ".bin" / "esbuild"


def sources() -> list[Path]:
    """The files that the page is made of."""
    return sorted([*HERE.glob("*.js"), HERE / "style.css", HERE / "frame.html"])


def digest() -> str:
    """A digest of the sources, by which a page says what it was made of."""
    whole = hashlib.sha256()
    for file in sources():
        whole.update(f"{file.name}\n".encode() + file.read_bytes())
    return whole.hexdigest()[:16]


def small(entry: str) -> str:
    """A script or a style with all that it imports, minified."""
    if not ESBUILD.exists():
        sys.exit("esbuild is not here: run make page, which has npm install it")
    options = ("--bundle", "--minify", "--format=esm", "--target=es2022", "--charset=utf8", "--log-level=warning")
    made = subprocess.run([ESBUILD, HERE / entry, *options], check=True, capture_output=True, text=True)
    return made.stdout.strip()


def page() -> str:
    """The page."""
    environment = Environment(undefined=StrictUndefined, autoescape=False, keep_trailing_newline=True)
    frame = environment.from_string((HERE / "frame.html").read_text(encoding="utf-8"))
    return frame.render(digest=digest(), style=small("style.css"), script=small("main.js"))


if __name__ == "__main__":
    text = page()
    if sys.argv[1:] == ["--check"]:
        sys.exit(0 if TARGET.read_text(encoding="utf-8") == text else f"{TARGET.name} is not up to date: run make page")
    TARGET.write_text(text, encoding="utf-8")
