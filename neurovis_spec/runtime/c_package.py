"""An exported network as a folder: header, source, an example, how to build it, and what it costs.

In: a Network, the State that it begins in, the type of numbers, a folder. Out: files. What somebody else has written
there is left alone: an example and a CMakeLists.txt that are there stay; any other file that is not ours is refused.
"""

from __future__ import annotations

import warnings
from collections.abc import Collection, Iterable, Mapping
from pathlib import Path

import numpy as np

from neurovis_spec.arrays import Indices
from neurovis_spec.compiler.flows import ports_read_by
from neurovis_spec.compiler.limits import plural
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import AT_SPIKE, RULE, SYNAPSE, Definition, Port, is_activation
from neurovis_spec.language.expressions.emit_c import INEXACT
from neurovis_spec.language.expressions.functions import FUNCTIONS
from neurovis_spec.language.expressions.tree import Call, Tree, walk
from neurovis_spec.runtime.c_export import Exported
from neurovis_spec.runtime.c_names import words
from neurovis_spec.runtime.c_plan import STAGES
from neurovis_spec.runtime.c_settable import ExportError
from neurovis_spec.runtime.events import takes_spikes
from neurovis_spec.runtime.files import replacing
from neurovis_spec.runtime.stages import (
    Formulas,
    Part,
    apart,
    formed_at,
    signal_of,
    unfolded,
)
from neurovis_spec.runtime.state import State

#: What gcc and clang are told, so that the bits are those of the backend c: no operation is joined to another, and no
#: function worked out by the compiler.
_EXACT = " ".join(("-O2", "-ffp-contract=off", *(f"-fno-builtin-{function}" for function in INEXACT)))
#: the words in a file by which we know that we wrote it
_MARK = "by neurovis export"


class FixedWarning(UserWarning):
    """Parameters that can be set in a run, and not in what is exported."""

    prefix = "note"


def files(network: Network, start: State | None = None, real: str = "double") -> dict[str, str]:
    """The texts of all files by name. Warns (FixedWarning) of parameters that keep their values. Raises ExportError."""
    exported = Exported(network, start, real)
    tell_fixed(exported)
    return {
        f"{exported.name}.h": exported.header(),
        f"{exported.name}.c": exported.source(),
        "README.md": _readme(exported),
        "main.c": _example(exported),
        "CMakeLists.txt": _cmake(exported),
    }


def tell_fixed(exported: Exported) -> None:
    """Warn of each parameter that keeps its value."""
    for line in _fixed(exported):
        warnings.warn(f"{line}; export with --set for another", FixedWarning, stacklevel=4)


def _fixed(exported: Exported) -> list[str]:
    """For each parameter that could be set in a run, and keeps its value in C, what it is and why."""
    values = exported.network.parameters
    return [
        f"'{words(name)}' is structural in C and keeps its value, {values[name]:g}: {why} follows it"
        for name, why in exported.kept_parameters.items()
    ]


def write(
    folder: Path, texts: dict[str, str], users: Collection[str] = ("main.c", "CMakeLists.txt"), mark: str = _MARK
) -> tuple[list[Path], list[Path]]:
    """Write the files, by their paths in the folder; those that begin with ``#!`` can be executed. Of the files that
    are there the ``users`` stay, as a user may have changed them, and those with our ``mark`` are replaced. Gives what
    was written, and what was there and stays. Raises ExportError for a file of somebody else's in the way, OSError."""
    if folder.exists() and not folder.is_dir():
        raise ExportError(f"{folder} is not a folder: name one; it is made if it is not there")
    written, kept = dict[Path, str](), []
    for name, text in texts.items():
        path = folder / name
        if not path.exists() or _holds(path, text):
            written[path] = text
        elif name in users:
            kept.append(path)
        elif path.is_file() and mark in path.read_text(encoding="utf-8", errors="replace"):
            written[path] = text
        else:
            raise ExportError(f"{path} was not made {mark} and would be lost: name another folder")
    folder.mkdir(parents=True, exist_ok=True)
    for path, text in written.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as file:
            file.write(text.encode())
        if text.startswith("#!"):
            path.chmod(path.stat().st_mode | 0o111)
    return list(written), kept


def _holds(path: Path, text: str) -> bool:
    return path.is_file() and path.read_bytes() == text.encode()


def size_of_state(exported: Exported) -> int:
    """The bytes of the struct on common machines."""
    network = exported.network
    number = 4 if exported.real == "float" else 8
    numbers = sum(max(len(member.begin), 1) for member in exported.members)
    size = -(-numbers * number // 8) * 8 + 8 + len(network.settable.slots)  # the numbers, k and chosen
    if len(exported.phases) > 1:
        size = -(-size // 4) * 4 + 4  # phase
    if exported.holding:  # held and lesioned
        size += exported.clampable + len(network.neurons) * exported.marks_lesioned
    return -(-size // 8) * 8


def _calls(trees: Iterable[Tree | None]) -> int:
    """The functions of the library that some expressions call."""
    found = (node for tree in trees if tree is not None for node in walk(tree))
    called = (FUNCTIONS.get(node.function) for node in found if isinstance(node, Call))
    return sum(row is not None and row.agree == "rounding" for row in called)


def _calls_a_step(definition: Definition) -> int:
    """The functions of the library that a definition calls at a step."""
    given = (*definition.gives[:1], *definition.outputs)  # without what checks an activation
    made = () if definition.kind.lasting else (one.each_step for one in given)
    return _calls([*(tree for _, tree in definition.let), *definition.steps.values(), *made])


def _trees_of(*made: Formulas) -> list[Tree]:
    """All trees of some formulas."""
    return [tree for formulas in made for _, tree in (*formulas.let, *formulas.trees)]


def _calls_a_stage(part: Part) -> int:
    """The functions of the library that a neuron calls at a stage of the integration."""
    trees = _trees_of(*(taken.formulas for taken in part.taken), part.derivatives, part.slopes)
    activations = sum(is_activation(node) for tree in trees for node in walk(tree))
    return _calls(trees) + activations * _calls_a_step(part.population.activation.definition)


def _signals(network: Network, formulas: Mapping[int, Formulas], ports: Iterable[tuple[Port, Indices]]) -> int:
    """How many functions of the library are called by what synapses bring to ports, by the formulas of projections; of
    each port these connections."""
    formed = (one for port, places in ports for one in formed_at(network, port.incoming[places]))
    return sum(_calls(_trees_of(formulas[one.number])) * len(one.places) for one in formed if one.number in formulas)


def _of_synapses(network: Network) -> int:
    """How many functions synapses call once a step: for their states, and for ports that are read at an update."""
    synapses = {number: one for number, one in enumerate(network.projections) if one.kind == SYNAPSE}
    functions = 0
    for one in synapses.values():
        definition = one.use.definition
        changes = [tree for state in definition.state for tree in (state.each_step, state.each_episode)]
        functions += _calls([*(tree for _, tree in unfolded(definition.let, changes).let), *changes]) * len(one.members)
    for population in network.populations:
        read = ports_read_by(population.model.definition).once
        ports = [(port, np.arange(len(port.incoming))) for port in population.ports if port.name in read]
        functions += _signals(network, {number: signal_of(one) for number, one in synapses.items()}, ports)
    return functions


def _integration(exported: Exported) -> tuple[int, list[str]]:
    """How many functions the integration calls in a step, and what else it takes; none where nothing flows."""
    network = exported.network
    plan = exported.built.plan
    if plan is None:
        return 0, []
    by, parts = plan.operation, plan.of_stage
    stages = len(STAGES[by.method]) * by.substeps
    joined = [(one, len(one.projection.members)) for one in plan.contacts]
    states = sum(len(part.flows) * len(part.population.members) for part in parts)
    states += sum(len(one.flows) * count for one, count in joined)
    signals = sum(len(apart(port)[1]) for part in parts for port in part.ports)
    functions = stages * sum(_calls_a_stage(part) * len(part.population.members) for part in parts)
    functions += stages * sum(_calls(_trees_of(one.derivatives, one.slopes)) * count for one, count in joined)
    signal = {one.number: one.signal for one, _ in joined}
    for part in parts:
        for made in (*(taken.formulas for taken in part.taken), part.derivatives):
            functions += stages * _signals(network, signal, [(port, apart(port)[1]) for port in made.ports])
        for through in part.through:
            back = {one.number: one.back for one, _ in joined}
            functions += stages * _calls(_trees_of(through.slope)) * len(part.population.members)
            functions += stages * _signals(network, back, [(through.port, apart(through.port)[1])])
    how = f"{by.method}, {plural(by.substeps, 'substep')}" if by.substeps > 1 else by.method
    anew = f", and {plural(signals, 'signal')} made anew" if signals else ""
    kept = sum(len(member.begin) for member in exported.members if member.name == "work")
    lines = [f"- {plural(stages, 'stage')} ({how}): at each {plural(states, 'derivative')}{anew}"]
    if kept:
        lines.append(f"- {plural(kept, 'number')} kept between stages, in the struct (`state.work`)")
    return functions, lines


def _of_spikes(exported: Exported) -> list[str]:
    """What spikes make of a step, at worst; none where nobody fires."""
    network, spiking = exported.network, exported.spiking
    if spiking is None:
        return []
    visited = np.zeros(len(network.connections), dtype=np.bool_)
    for population in network.populations:
        for port in population.ports:
            if takes_spikes(network, port):
                visited[port.incoming] = True
    for one in network.projections:
        if any(one.use.definition.has(phase) for phase in AT_SPIKE):
            visited[one.members] = True
    may = f"{plural(len(spiking.neurons), 'neuron')} may fire; {plural(int(visited.sum()), 'connection')} of these"
    return [
        f"- spikes: {may} wait for them, and take time",
        "  where one comes. What is counted here is the worst case, a step in which all fire; all else takes the same",
        "  time in each step",
    ]


def _learning(network: Network, centres: bool) -> int:
    """How many connections have a rule that changes their weights, or their centres."""
    rules = (one for one in network.projections if one.kind == RULE)
    changed = {number for one in rules if one.use.definition.moves_centre == centres for number in one.members.tolist()}
    return len(changed)


def _cost(exported: Exported) -> str:
    """What a step takes, a line each."""
    network = exported.network
    functions = 0
    for population in network.populations:
        each = _calls_a_step(population.model.definition)
        if population.model.definition.reads_activation:
            each += _calls_a_step(population.activation.definition)
        functions += each * len(population.members)
    for projection in network.projections:
        if projection.kind == RULE:
            functions += _calls_a_step(projection.rule.definition) * len(projection.members)
    functions += _of_synapses(network)
    functions += sum(
        _calls([one.expression]) * (one.size if one.indexed or one.is_drawn else 1) for one in network.inputs
    )
    at_stages, stages = _integration(exported)
    drawn = sum(len(noise.members) for noise in network.noises)
    drawn += sum(entry.size for entry in network.inputs if entry.is_drawn)
    lines = [
        f"- {plural(len(network.connections), 'connection')}: a multiplication and an addition each",
        *_of_spikes(exported),
        *stages,
        f"- {functions + at_stages} calls of functions such as exp and tanh",
    ]
    weights, centres = (_learning(network, centres) for centres in (False, True))
    if weights:
        lines.append(f"- {weights} weights that learn")
    if centres:
        lines.append(f"- {centres} centres that learn")
    if drawn:
        lines.append(f"- {drawn} random numbers")
    return "\n".join(lines)


def _readme(exported: Exported) -> str:
    name, network = exported.name, exported.network
    neurons, connections = plural(len(network.neurons), "neuron"), plural(len(network.connections), "connection")
    fired = _fired(exported)
    kept = "".join(f"\n{line}. `--set` of the export gives it another.\n" for line in _fixed(exported))
    return f"""# {words(network.title or network.name)}

Made by neurovis export: a network of {neurons} and {connections} as C99 (or C++17). It needs libm
and nothing else: no heap, no files, no variables that change but the struct that you hand over.

```c
{name}_state state;
{name}_inputs in = {{0}};
{name}_outputs out;

{name}_init(&state);
{name}_step(&state, &in, &out);   /* once a step, every {network.dt:g} s */
```

{fired}\
After call k, `state.activity` is a[k - 1] and `state.weights` w[k], in the order of a recording. Events of the spec
apply at their steps. A copy of the struct is a copy of all that the run carries.

{_interface(exported)}

Each gives 1, or 0 where the value cannot be taken; then nothing has changed.
{kept}
## Cost

The state takes {size_of_state(exported)} bytes where a pointer has 8. A step takes

{_cost(exported)}

## Building

    cc -std=c99 {_EXACT} -c {name}.c
    cmake -B build && cmake --build build && build/{name}_example

`-ffp-contract=off` keeps a compiler from joining a product and a sum, which rounds otherwise than the reference does,
and `-fno-builtin-exp` and its like from working out functions itself; so the numbers are those of
`neurovis run --backend c`, bit for bit where the C library is the same.
"""


def _fired(exported: Exported) -> str:
    """How a caller asks who has fired; "" where nobody can."""
    if exported.spiking is None:
        return ""
    name = exported.name
    return f"""Spikes are events of a step. Who has fired in the last one is asked behind the call, before the next:

```c
unsigned char fired[{name.upper()}_NEURONS];
int32_t count = {name}_fired(&state, fired);   /* how many; fired[i]: whether neuron i has */
```

"""


def _interface(exported: Exported) -> str:
    """What goes in and comes out, and what can be set, by its name in C."""
    inputs = "\n".join(
        f"- `in->{c_name}`: {entry.size} number{'s' * (entry.size > 1)} for {words(entry.name)}"
        for c_name, entry in zip(exported.input_names, exported.inputs, strict=True)
    )
    outputs = "\n".join(
        f"- `out->{c_name}`: {entry.size} number{'s' * (entry.size > 1)} of {words(entry.name)}"
        for c_name, entry in zip(exported.output_names, exported.network.outputs, strict=True)
    )
    sets = "\n".join(
        f"- `{exported.name}_set_{c_name}`: {words(parameter)}"
        for parameter, c_name in zip(exported.settable, exported.settable_names, strict=True)
    )
    return f"""## Inputs

{inputs or "None: all inputs have a source of their own."}

## Outputs

{outputs or "The spec names none; read `state.activity`."}

## Parameters

{sets or "None can be set."}"""


def _example(exported: Exported) -> str:
    name, network = exported.name, exported.network
    lines = [
        f"/* An example, made by neurovis export: ten steps of {name}. */",
        f'#include "{name}.h"',
        "",
        "#include <stdio.h>",
        "#include <string.h>",
        "",
        "int main(void)",
        "{",
        f"    static {name}_state state;",
        f"    {name}_inputs in;",
        f"    {name}_outputs out;",
        "    memset(&in, 0, sizeof in);",
        f"    {name}_init(&state);",
        "    for (int k = 0; k < 10; k++) {",
    ]
    lines += [f"        in.{c_name}[0] = 0; /* what a sensor says */" for c_name in exported.input_names[:1]]
    lines += [f"        {name}_step(&state, &in, &out);"]
    if network.outputs:
        lines.append(f'        printf("%d %g\\n", k, (double)out.{exported.output_names[0]}[0]);')
    else:
        lines.append('        printf("%d %g\\n", k, (double)state.activity[0]);')
    return "\n".join([*lines, "    }", "    return 0;", "}", ""])


def _cmake(exported: Exported) -> str:
    name = exported.name
    return f"""# made by neurovis export
cmake_minimum_required(VERSION 3.10)
project({name} C)

add_library({name} STATIC {name}.c)
target_include_directories({name} INTERFACE "${{CMAKE_CURRENT_SOURCE_DIR}}")
set_target_properties({name} PROPERTIES C_STANDARD 99 C_STANDARD_REQUIRED ON)
if(CMAKE_C_COMPILER_ID MATCHES "GNU|Clang")
  # the same bits as the reference: no operation is joined to another, and no function worked out by the compiler
  target_compile_options({name} PRIVATE {_EXACT})
endif()
if(UNIX)
  target_link_libraries({name} PUBLIC m)
endif()

add_executable({name}_example main.c)
target_link_libraries({name}_example PRIVATE {name})
"""
