"""What a group of neurons is given and its model does not read: an activation, or whatever drives it.

In: what a spec without errors became. Out: a warning at each such key. A model reads the activation where its
``activity`` calls ``f``, and what drives a neuron where one of its formulas reads ``drive``.
"""

from __future__ import annotations

from collections.abc import Iterator

from neurovis_spec.compiler.checks.compiled import Compiled
from neurovis_spec.compiler.program import Model
from neurovis_spec.diagnostics import Findings, Span
from neurovis_spec.language.expressions.tree import Call, Tree, names, walk
from neurovis_spec.language.sections import GroupModel

#: the keys of a group that make its drive
_DRIVING = ("input", "bias", "noise", "combine")


def check_ignored(compiled: Compiled, findings: Findings) -> None:
    """Warn of what the model of a group leaves out of account."""
    told: set[Span] = set()
    population = compiled.population
    for kind, group in zip(population.kinds, population.models, strict=True):
        for span, message, hint in _ignored(kind.model, group):
            if span not in told:
                told.add(span)
                findings.warning("no-effect", span, message, hint)


def _ignored(model: Model, group: GroupModel) -> Iterator[tuple[Span, str, str]]:
    """The place of each key that the model does not read, and what to say there."""
    activation = group.activation
    if activation is not None and not _calls_f(model.activity):
        message = f"the model '{model.name}' does not use the activation '{activation.name.value}'"
        yield activation.name.span, message, "remove it, or take a model whose activity is f(…)"
    if any("drive" in names(tree) for tree in _formulas(model)):
        return
    for key in _DRIVING:
        entry = group.source.entry(key)
        if entry is not None:
            message = f"the model '{model.name}' does not read its drive: '{key}' changes nothing"
            yield entry.key.span, message, "remove it, or take a model that reads 'drive'"


def _calls_f(tree: Tree) -> bool:
    return any(isinstance(node, Call) and node.function == "f" for node in walk(tree))


def _formulas(model: Model) -> Iterator[Tree]:
    yield model.activity
    yield from (tree for _, tree in model.let)
    for state in model.state:
        yield from (tree for tree in (state.each_step, state.each_episode) if tree is not None)
