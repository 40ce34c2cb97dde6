"""What the sections at the end of a spec may name, ``body`` and ``ros``: they say how a network meets the world.

In: nothing; this is a value that the compiler makes for those who read these sections.
"""

from __future__ import annotations

from dataclasses import dataclass

from neurovis_spec.compiler.names.scope import Scope
from neurovis_spec.compiler.network import Input, Output
from neurovis_spec.language.spec import Spec


@dataclass(frozen=True)
class Surroundings:
    """What a section may name: the inputs of the network, or of the spec itself, and its outputs."""

    spec: Spec
    scope: Scope
    inputs: tuple[Input, ...]
    outputs: tuple[Output, ...]
