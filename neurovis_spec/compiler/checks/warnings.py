"""Warnings: what is legal but surely not meant.

In: the Spec of a network without errors, and the network. Out: warnings among the findings. Better none than a false
one: what may be meant (a rate that is a parameter and can be set in a run, a bias of 0 written down) is not reported.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from neurovis_spec.compiler.checks.compiled import Compiled
from neurovis_spec.compiler.checks.doubled import check_doubled
from neurovis_spec.compiler.checks.hidden_definitions import check_hidden
from neurovis_spec.compiler.checks.ignored_settings import check_ignored
from neurovis_spec.compiler.checks.lone_indices import check_lone_indices
from neurovis_spec.compiler.checks.no_op_rules import changes_nothing, check_own_ends
from neurovis_spec.compiler.checks.replaced_weights import check_replaced_weights
from neurovis_spec.compiler.checks.silent_neurons import idle_neurons
from neurovis_spec.compiler.checks.undefined_operations import check_undefined
from neurovis_spec.compiler.checks.unused_parts import check_unused_parts
from neurovis_spec.compiler.limits import plural
from neurovis_spec.compiler.names.references import Section, key_span
from neurovis_spec.compiler.names.scope import Scope
from neurovis_spec.compiler.values.data_files import Files
from neurovis_spec.diagnostics import Findings, Span
from neurovis_spec.language.data.header import AS_TEXTS, NUMBERED
from neurovis_spec.language.sections import ConnectionModel
from neurovis_spec.language.unknown import UNKNOWN
from neurovis_spec.language.yaml.source import Mapping, Node, Packed, Scalar, Sequence


def warn(compiled: Compiled, findings: Findings) -> None:
    """Note everything that is surely not meant in a spec that compiled."""
    _inputs(compiled, findings)
    for section, scopes in compiled.sections():
        _files(section, scopes[0].files, findings)
        _parameters(section, scopes, findings)
    check_lone_indices(compiled, findings)
    check_doubled(compiled, findings)
    check_ignored(compiled, findings)
    check_own_ends(compiled, findings)
    check_unused_parts(compiled, findings)
    check_undefined(compiled, findings)
    check_hidden(compiled, findings)
    check_replaced_weights(compiled, findings)
    _beyond(compiled, findings)
    _events(compiled, findings)
    _theme(compiled, findings)
    _definitions(compiled, findings)
    _modules(compiled, findings)
    _neurons(compiled, findings)
    _outputs(compiled, findings)
    _rates(compiled, findings)
    _episodes(compiled, findings)
    _vain(compiled, findings)


def _beyond(compiled: Compiled, findings: Findings) -> None:
    """Warn of delays and episodes that are too long for a run of the spec's own length."""
    time, steps = compiled.spec.time, compiled.network.steps
    if time is None or time.steps is None:
        return
    hint = "shorten it, or lengthen the run: time: {{steps: {}}}"
    episode = compiled.network.episode
    if time.episode is not None and episode is not None and episode > steps:
        message = f"an episode of {plural(episode, 'step')} does not end in a run of {steps} ('steps')"
        findings.warning("beyond-steps", time.episode.span, message, hint.format(episode))
    for key, body, bundles in compiled.entries():
        late = [bundle for bundle in bundles if (bundle.delays >= steps).any()]
        if not late:
            continue
        longest = max(int(bundle.delays.max()) for bundle in late)
        span = key.span if body.delay is None or body.edges is not None else body.delay.span
        message = f"after a delay of {plural(longest, 'step')} nothing arrives in a run of {steps} ('steps')"
        findings.warning("beyond-steps", span, message, hint.format(longest + 1))


def _theme(compiled: Compiled, findings: Findings) -> None:
    """A theme of the spec's own. Most specs have none: nothing is imported then."""
    render = compiled.spec.render
    if render is not None and render.theme is not None and compiled.network.render.colours:
        from neurovis_spec.compiler.checks.like_colours import check_like_colours

        check_like_colours(render.theme, findings)


def _events(compiled: Compiled, findings: Findings) -> None:
    """Events that come too late, or are lost among others. Most specs have none: nothing is imported then."""
    spec, network = compiled.spec, compiled.network
    if spec.events:
        from neurovis_spec.compiler.checks.event_warnings import check_events

        steps = None if spec.time is None or spec.time.steps is None else network.steps
        directory, constants = compiled.population.directory, compiled.scopes[0].constants
        check_events(spec.events, directory, constants, steps, findings)


def _inputs(compiled: Compiled, findings: Findings) -> None:
    """Inputs that neither a group nor a rule reads; of a module those that are read in no instance."""
    network = compiled.network
    n = len(network.neurons)
    read = set(network.neurons.input.tolist())
    for plasticity in network.plasticity:
        for signal in plasticity.signals.values():
            read.update(place - n for place in set(signal.tolist()))
    for section, scopes in compiled.sections():
        handed = {outer.value for instance in section.instances.values() for outer in instance.inputs.values()}
        for name in section.inputs.keys() - handed:
            made = [scope.inputs.known()[name] for scope in scopes if name in scope.inputs]
            if all(read.isdisjoint(range(entry.start, entry.start + entry.size)) for entry in made):
                message = f"nothing reads the input '{name}'"
                findings.warning("unused-input", key_span(section, "inputs", name), message, _READ.format(name))


_READ: Final = "give it to a group, as in {{input: {0}}}, or to a rule as a signal, or remove it"


def _files(section: Section, files: Files, findings: Findings) -> None:
    """Files of inputs that begin with the numbers of their columns. The file has been read: nothing is read again."""
    for model in section.inputs.values():
        table = UNKNOWN if model.file is None else files.table_at(model.file)
        if model.file is not None and table is not UNKNOWN and table.numbered:
            findings.warning("numbered-columns", model.file.span, NUMBERED, AS_TEXTS)


def _parameters(section: Section, scopes: list[Scope], findings: Findings) -> None:
    """Parameters that no expression reads."""
    used = {name for scope in scopes for name in scope.constants.read}
    for name in section.parameters:
        if name not in used:
            message = f"no expression uses the parameter '{name}'"
            findings.warning("unused-parameter", key_span(section, "parameters", name), message, "remove it, or use it")


def _definitions(compiled: Compiled, findings: Findings) -> None:
    """Activations, models and rules of the spec's own that are not used. What a module names counts as used, even if it
    has no instance."""
    network = compiled.network
    used = {
        "activations": {group.activation for group in network.neurons.groups},
        "models": {group.model for group in network.neurons.groups},
        "rules": {plasticity.rule.name for plasticity in network.plasticity},
    }
    modules = [library.source.get("modules") for library in (compiled.spec, *compiled.included)]
    named = {text for node in modules if node is not None for text in _texts(node)}
    for section, names in used.items():
        node = compiled.spec.source.get(section)
        for entry in node.entries if isinstance(node, Mapping) else ():
            if entry.name not in names | named:
                message = f"nobody uses the {section.removesuffix('s')} '{entry.name}'"
                findings.warning("unused-definition", entry.key.span, message, "remove it, or use it")


def _modules(compiled: Compiled, findings: Findings) -> None:
    """Modules of the spec's own that have no instance; those of an included file may be there for others."""
    inside = {
        instance.module.value
        for module in compiled.library.modules.known().values()
        for instance in module.model.instances.values()
    }
    for name, module in compiled.library.modules.known().items():
        if module.own and name not in compiled.used and name not in inside:
            message = f"the module '{name}' has no instance"
            findings.warning("unused-module", key_span(compiled.spec, "modules", name), message, _INSTANCE)


_INSTANCE: Final = "add one under 'instances', or remove it"


def _neurons(compiled: Compiled, findings: Findings) -> None:
    """Neurons that stay at 0 for ever; a finding for each group as it is written."""
    spec, network = compiled.spec, compiled.network
    if any(event.clamp for event in spec.events):
        return  # what is clamped is active from outside
    written = {scope.called(name): (scope, name) for scope in compiled.scopes for name in scope.section.neurons}
    told: set[Span] = set()
    for group, members, driven in idle_neurons(network):
        scope, own = written[group.name]
        model, span = scope.section.neurons[own], key_span(scope.section, "neurons", own)
        if span in told or model.bias is not None or model.initial is not None:
            continue
        told.add(span)
        names = [network.neurons.names[member] for member in members]
        shown = f"'{group.name}'" if len(names) == group.count else ", ".join(f"'{name}'" for name in names[:5])
        if len(names) > 5 and len(names) < group.count:
            shown += " and others"
        outside = "from outside " if driven else ""
        message = (
            f"nothing {outside}reaches {shown}, and there is no input, bias, initial or noise: the activity stays 0"
        )
        hint = "connect something to it, or give it an input, a bias, an initial or a noise"
        findings.warning("idle-neuron", span, message, hint)


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


def _rates(compiled: Compiled, findings: Findings) -> None:
    """Rules whose rate is 0, and which therefore change no weight. A rate that names a parameter can be set later."""
    bodies = {key.span: body for section, _ in compiled.sections() for key, body in section.connections}
    for bundle in compiled.bundles:
        body, learning = bodies.get(bundle.key), bundle.learning
        if body is None or learning is None or "rate" not in learning.parameters:
            continue
        if learning.parameters["rate"].any() or not changes_nothing(learning.rule, learning.parameters):
            continue
        span, constant = _rate(body)
        if constant:
            message = f"the rate of '{learning.rule.name}' is 0: no weight will change"
            findings.warning("zero-rate", span, message, "give it a rate, or leave the plasticity out")


def _episodes(compiled: Compiled, findings: Findings) -> None:
    """Rules that change weights at the end of an episode alone, where there are no episodes."""
    if compiled.network.episode is not None:
        return
    late = {bundle.key: bundle.learning.rule for bundle in compiled.bundles if bundle.learning is not None}
    for section, _ in compiled.sections():
        for key, body in section.connections:
            rule = late.get(key.span)
            if rule is not None and rule.each_step is None and body.plasticity is not None:
                message = (
                    f"'{rule.name}' changes weights at the end of an episode, and there are none: no weight will change"
                )
                hint = "say how many steps an episode has, as in time: {episode: 100}"
                findings.warning("no-effect", body.plasticity.name.span, message, hint)


def _vain(compiled: Compiled, findings: Findings) -> None:
    """What an entry of connections says and what makes no difference to it, or all weights 0."""
    apart: dict[Span, bool] = {}
    for bundle in compiled.bundles:
        apart[bundle.key] = bundle.apart and apart.get(bundle.key, True)
    for section, _ in compiled.sections():
        for key, body in section.connections:
            if body.self is not None and body.self.value and apart.get(key.span, False):
                message = "'self: true' changes nothing: no neuron is in both ends of this connection"
                findings.warning("no-effect", body.self.span, message, "remove it")
            scale = body.scale
            if scale is not None and scale.indegree is not None and not scale.indegree.value:
                findings.warning("no-effect", scale.indegree.span, "'indegree: false' scales nothing", "remove it")
            for formula in () if scale is None else (scale.norm, scale.spectral_radius):
                if formula is not None and formula.value == 0:
                    message = "scaled to 0, all weights of this entry are 0"
                    findings.warning("no-effect", formula.span, message, "give it another number, or 'weight: 0'")


def _rate(body: ConnectionModel) -> tuple[Span, bool]:
    """The place of a rule's rate (of the rule's name, if it is the default), and whether it is a constant number."""
    assert body.plasticity is not None
    for entry in body.plasticity.settings:
        if entry.name == "rate":
            constant = isinstance(entry.value, Scalar) and not isinstance(entry.value.value, str)
            return entry.value.span, constant
    return body.plasticity.name.span, True


def _texts(node: Node) -> Iterator[str]:
    """Every text of a node, keys included."""
    waiting = [node]
    while waiting:
        node = waiting.pop()
        match node:
            case Scalar(value=str() as text):
                yield text
            case Mapping(entries=entries):
                yield from (entry.name for entry in entries)
                waiting += [entry.value for entry in entries]
            case Packed(texts=texts):
                yield from texts
            case Sequence(items=items):
                waiting += items
