"""Prints ``docs/errors.md``: ``python -m neurovis_spec.codes > docs/errors.md``."""

from __future__ import annotations

from neurovis_spec.codes import page

print(page(), end="")
