"""``python -m neurovis_spec`` is ``neurovis``."""

from __future__ import annotations

from neurovis_spec.cli import main

if __name__ == "__main__":
    main()
