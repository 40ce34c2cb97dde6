"""Names that two packages define: what a spec means by one of them is not what its author may think.

In: the definitions that a spec names. Out: a warning where an installed package defines one of that name, too, which is
not used. A definition of the spec's own has another warning (``replaces-builtin``).
"""

from __future__ import annotations

from collections.abc import Iterator

from neurovis_spec.compiler.checks.compiled import Compiled
from neurovis_spec.compiler.values.builtin import installed
from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.values import Choice


def check_hidden(compiled: Compiled, findings: Findings) -> None:
    """Warn at each such name."""
    hidden = installed().hidden
    own = (compiled.spec, *compiled.included)
    for section, choice in _choices(compiled) if hidden else ():
        name = choice.name.value
        found = hidden.get((section, name))
        if found is not None and not any(name in getattr(library, section) for library in own):
            message = f"'{name}' is that of {found.owner}; {found.place} defines one, too, which is not used"
            hint = "rename it in that package, or define here what is meant"
            findings.warning("hidden-definition", choice.name.span, message, hint)


def _choices(compiled: Compiled) -> Iterator[tuple[str, Choice]]:
    """What groups and connections name, with the section that defines such."""
    for section, _ in compiled.sections():
        for group in section.neurons.values():
            if group.activation is not None:
                yield "activations", group.activation
            if group.model is not None:
                yield "models", group.model
        for _, body in section.connections:
            if body.plasticity is not None:
                yield "rules", body.plasticity
