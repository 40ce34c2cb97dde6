"""Prints docs/measures.md: ``python -m neurovis_spec.analysis > docs/measures.md``."""

from neurovis_spec.analysis.catalogue import document

print(document(), end="")
