"""Warnings: what is legal but surely not meant.

In: the Spec of a network without errors, and the network. Out: warnings among the findings. Better none than a false
one: what may be meant (a rate that is a parameter and can be set in a run, a bias of 0 written down) is not reported.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

from neurovis_spec.compiler.checks.compiled import Compiled
from neurovis_spec.compiler.checks.connections import check_beyond_run, check_doubled, check_no_effect, check_rounded
from neurovis_spec.compiler.checks.definitions import check_formulas, check_hidden, check_modules, check_unused
from neurovis_spec.compiler.checks.lone_indices import check_lone_indices
from neurovis_spec.compiler.checks.neurons import check_neurons
from neurovis_spec.compiler.checks.rules import check_rules
from neurovis_spec.compiler.checks.undefined_operations import check_undefined
from neurovis_spec.compiler.names.references import key_span
from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.data.csv_table import AS_TEXTS, NUMBERED
from neurovis_spec.language.unknown import UNKNOWN


def warn(compiled: Compiled, findings: Findings) -> None:
    """Note everything that is surely not meant in a spec that compiled."""
    for check in _CHECKS:
        if not compiled.keys.isdisjoint(check.of):
            check.warn(compiled, findings)


def _flows(compiled: Compiled, findings: Findings) -> None:
    """How states are integrated. Most specs have none with a derivative: nothing is imported then."""
    time = compiled.spec.time
    if compiled.network.integration is not None or (time is not None and time.integrate is not None):
        from neurovis_spec.compiler.checks.flowing import check_flowing

        check_flowing(compiled, findings)


def _units(compiled: Compiled, findings: Findings) -> None:
    """Units that do not fit. Most specs have none: nothing is imported then."""
    definitions = (made.values() for library in compiled.libraries for made in library.definitions.values())
    if any(one.unit is not None for section, _ in compiled.sections for one in section.parameters.values()) or any(
        model.parts().units for models in definitions for model in models
    ):
        from neurovis_spec.compiler.checks.units import check_units

        check_units(compiled, findings)


def _theme(compiled: Compiled, findings: Findings) -> None:
    """A theme of the spec's own. Most specs have none: nothing is imported then."""
    render = compiled.spec.render
    if render is not None and render.theme is not None and compiled.network.render.colours:
        from neurovis_spec.compiler.checks.like_colours import check_like_colours

        check_like_colours(render.theme, findings)


def _figure(compiled: Compiled, findings: Findings) -> None:
    """Views that show nothing, or the same once more."""
    models = () if compiled.spec.render is None else compiled.spec.render.figure
    for number, (model, panel) in enumerate(zip(models, compiled.network.render.figure, strict=False)):
        if panel.view == "body" and compiled.spec.body is None and compiled.network.body is None:
            message = "this network has no body: the view stays empty"
            findings.warning("no-effect", model.view.span, message, "remove it, or give the network a 'body'")
        elif panel in compiled.network.render.figure[:number]:
            message = f"the view '{panel.view}' is there twice, and shows the same"
            findings.warning("no-effect", model.view.span, message, "remove one of them")


def _events(compiled: Compiled, findings: Findings) -> None:
    """Events that come too late, or are lost among others. Most specs have none: nothing is imported then."""
    from neurovis_spec.compiler.checks.event_warnings import check_events

    spec = compiled.spec
    steps = None if spec.time is None or spec.time.steps is None else compiled.network.steps
    check_events(spec.events, compiled, steps, findings)


def _inputs(compiled: Compiled, findings: Findings) -> None:
    """Inputs that neither a group nor a rule reads; of a module those that are read in no instance."""
    network = compiled.network
    n = len(network.neurons) + network.outlet_count
    read = set(network.neurons.input.tolist()).union(*(one.tolist() for one in network.neurons.port_input.values()))
    for projection in network.projections:
        for signal in projection.signals.values():
            read.update(place - n for place in set(signal.tolist()))
    for section, scopes in compiled.sections:
        handed = {outer.value for instance in section.instances.values() for outer in instance.inputs.values()}
        tables = [scope.inputs.known() for scope in scopes]
        for name in section.inputs.keys() - handed:
            made = [table[name] for table in tables if name in table]
            if all(read.isdisjoint(range(entry.start, entry.start + entry.size)) for entry in made):
                message = f"nothing reads the input '{name}'"
                findings.warning("unused-input", key_span(section, "inputs", name), message, _READ.format(name))


_READ: Final = "give it to a group, as in {{input: {0}}}, or to a rule as a signal, or remove it"


def _files(compiled: Compiled, findings: Findings) -> None:
    """Files of inputs that begin with the numbers of their columns. The file has been read: nothing is read again."""
    for section, scopes in compiled.sections:
        for model in section.inputs.values():
            table = UNKNOWN if model.file is None else scopes[0].files.table_at(model.file)
            if model.file is not None and table is not UNKNOWN and table.numbered:
                findings.warning("numbered-columns", model.file.span, NUMBERED, AS_TEXTS)


def _parameters(compiled: Compiled, findings: Findings) -> None:
    """Parameters that no expression reads."""
    for section, scopes in compiled.sections:
        used = {name for scope in scopes for name in scope.constants.read}
        for name in section.parameters.keys() - used:
            message, span = f"no expression uses the parameter '{name}'", key_span(section, "parameters", name)
            findings.warning("unused-parameter", span, message, "remove it, or use it")


def _outputs(compiled: Compiled, findings: Findings) -> None:
    """Outputs that are called like neurons, but are others."""
    spec, network = compiled.spec, compiled.network
    for output in network.outputs:
        group, neuron = network.group_index.get(output.name), network.neuron_index.get(output.name)
        own = list(group.indices) if group is not None else [] if neuron is None else [neuron]
        if own and own != output.neurons.tolist():
            what = "neuron" if len(own) == 1 else "group"
            message = f"the output '{output.name}' is called like a {what}, and is another one"
            hint = f"give it another name, or write {output.name}: {output.name}"
            findings.warning("misleading-output", key_span(spec, "outputs", output.name), message, hint)


def _reset(compiled: Compiled, findings: Findings) -> None:
    """A body of MuJoCo that is reset where an episode ends, in a run without episodes; those of other kinds may end
    episodes themselves."""
    body = compiled.spec.body
    if body is None or body.reset is None or body.reset.value == "never" or compiled.network.episode is not None:
        return
    if body.mujoco is None:
        return
    message = "the body is reset at the end of an episode, and there are none: it will not be"
    findings.warning(
        "no-effect", body.reset.span, message, "say how many steps an episode has, as in time: {episode: 100}"
    )


class _Check(NamedTuple):
    """A check, and what it is ``of``: without any of these sections, in the spec, in modules that are used and in files
    that are included, there is nothing to warn of."""

    warn: Callable[[Compiled, Findings], None]
    of: tuple[str, ...]


_DEFINITIONS = ("activations", "models", "rules", "synapses")
#: All checks, in the order in which findings of one place are told.
_CHECKS = (
    _Check(_inputs, ("inputs",)),
    _Check(_files, ("inputs",)),
    _Check(_parameters, ("parameters",)),
    _Check(check_lone_indices, ("neurons", "instances")),
    _Check(check_doubled, ("connections",)),
    _Check(check_beyond_run, ("time",)),
    _Check(check_no_effect, ("connections",)),
    _Check(check_rounded, ("connections", "instances")),
    _Check(check_neurons, ("neurons",)),
    _Check(check_rules, ("connections",)),
    _Check(check_formulas, _DEFINITIONS),
    _Check(_units, ("parameters", *_DEFINITIONS)),
    _Check(check_unused, _DEFINITIONS),
    _Check(check_modules, ("modules",)),
    _Check(check_hidden, ("neurons", "connections")),
    _Check(check_undefined, ("neurons", "connections")),
    _Check(_flows, ("neurons", "instances")),
    _Check(_events, ("events",)),
    _Check(_theme, ("render",)),
    _Check(_figure, ("render",)),
    _Check(_outputs, ("outputs",)),
    _Check(_reset, ("body",)),
)
