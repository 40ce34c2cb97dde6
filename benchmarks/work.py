"""How much work grows with a network, counted: no clock says whether something is done anew for each of many.

In: nothing. Out: a table, on standard output, of what is counted and of how much of it there may be; status 1 where
there is more. Run it with ``python benchmarks/work.py``, after a change of what it names:

- *calls*: of functions, while twice as many connections are laid out, as a multiple of those for half of them;
- *lines*: run while frames of twice as many connections are reflected, as such a multiple;
- *lines compared with frames*: for a way round 400 of them;
- *routes*: of connections among boxes that others would stand in, each to be made once;
- *names compared in full*: with thousands of known ones, where one or all of them are misspelt;
- *names compared at all*: where 500 are misspelt, of which few get a hint;
- *names gone through*: where 300 inputs are warned of, for one of them;
- *groups made out*, *formulas looked at*: of a hundred groups that are alike but for numbers;
- *instances counted*: of more than there may be;
- *calls of a step*: of a run in array code, in which NumPy makes three of its own, and one checks.
"""

from __future__ import annotations

import random
import sys
from collections.abc import Callable, Iterator
from difflib import SequenceMatcher
from pathlib import Path
from types import FrameType, ModuleType
from typing import TYPE_CHECKING, NamedTuple
from unittest import mock

from neurovis_layouts.layered import flips
from neurovis_layouts.layered.levels import Levels, Node, Segment
from neurovis_layouts.routing import obstacles, route_all
from neurovis_layouts.routing.detours import Detours

import neurovis_spec as nv
from neurovis_spec import likeness
from neurovis_spec.compiler.names import size_estimate
from neurovis_spec.compiler.neurons.groups import Builder
from neurovis_spec.diagnostics import MOST_HINTS
from neurovis_spec.language.expressions import undefined
from neurovis_spec.language.unknown import Names
from neurovis_spec.likeness import nearest

if TYPE_CHECKING:
    from _typeshed import TraceFunction

HEAD = "neurovis: 1\nname: many\n"


class Count(NamedTuple):
    """What was counted, how much of it there was, and how much there may be."""

    what: str
    found: float
    most: float


def calls(task: Callable[[], object], weight: Callable[[FrameType, str], int]) -> int:
    """The weights of all calls that a task makes, each known by its frame and kind."""
    count = 0

    def note(frame: FrameType, event: str, _given: object) -> None:
        nonlocal count
        count += weight(frame, event)

    sys.setprofile(note)
    try:
        task()
    finally:
        sys.setprofile(None)
    return count


def lines_run(task: Callable[[], object], module: ModuleType) -> int:
    """How many lines of a module are run by a task."""
    count = 0

    def note(frame: FrameType, event: str, _given: object) -> TraceFunction | None:
        nonlocal count
        count += event == "line"
        return note if frame.f_code.co_filename == module.__file__ else None

    sys.settrace(note)
    try:
        task()
    finally:
        sys.settrace(None)
    return count


def layouts() -> Iterator[Count]:
    """Loops of one neuron, and connections that share both ends: twice as many."""
    groups = {"loops": "neurons: {A: {bias: 1}}\n", "parallel connections": "neurons: {A: {bias: 1}, B: {}}\n"}
    for what, neurons in groups.items():
        entry = f"  - A -> {'A' if what == 'loops' else 'B'}: 1\n"
        few, many = (
            calls(nv.compile_text(f"{HEAD}{neurons}connections:\n" + entry * count).layout, _called)
            for count in (20, 40)
        )
        yield Count(f"calls, {what}", many / few, 2.6)


def _called(_frame: FrameType, event: str) -> int:
    return event in ("call", "c_call")


def ways_round() -> Iterator[Count]:
    """Ways between any two of 400 frames in a square."""
    centres = [(4.0 * i, 4.0 * j) for i in range(20) for j in range(20)]
    frames = [(frozenset({k}), (x - 1.5, y - 1.5, x + 1.5, y + 1.5)) for k, (x, y) in enumerate(centres)]
    detours, draw = Detours(obstacles.Walls(frames, len(centres)), centres, None), random.Random(1)
    ways = [tuple(draw.sample(range(400), 2)) for _ in range(200)]
    with mock.patch.object(obstacles, "meetings", wraps=obstacles.meetings) as compared:
        assert all(detours.route(a, b, True) for a, b in ways)
    found = sum(len(call.args[0]) * len(call.args[2]) for call in compared.call_args_list)
    yield Count("lines compared with frames for a way", found / len(ways), 80_000)


def reflections() -> Iterator[Count]:
    """Two frames, one below the other, their neurons connected in the opposite order."""

    def reflected(count: int) -> set[int]:
        across = [float(i) for i in range(count)]
        nodes = [
            Node(
                rank, tuple((rank * count + i, x, 0.0) for i, x in enumerate(across)), (float(count), 0.0), framed=True
            )
            for rank in (0, 1)
        ]
        segments = [Segment(0, x, 1, -x, 1.0) for x in across]
        return flips.reflected(Levels(nodes, [[0], [1]], [segments]), [[0], [1]], {0})[2]

    assert reflected(20) == {0}
    few, many = (lines_run(lambda count=count: reflected(count), flips) for count in (200, 400))  # type: ignore[misc]
    yield Count("lines, frames reflected", many / few, 3)


def routes() -> Iterator[Count]:
    """Boxes that others would stand in become frames before any connection is drawn beside them."""
    draw = random.Random(2)
    pairs = sorted({(draw.randrange(24), draw.randrange(24)) for _ in range(60)})
    text = HEAD + "neurons:\n" + "".join(f"  A{i}: {{bias: 1, box: box {i % 3}}}\n" for i in range(24))
    text += "layout: {engine: layered}\nconnections:\n" + "".join(f"  - A{a} -> A{b}: 1\n" for a, b in pairs)

    def routed(frame: FrameType, event: str) -> int:
        return len(frame.f_locals["edges"]) if event == "call" and frame.f_code is route_all.__code__ else 0

    yield Count("routes of a connection among boxes", calls(nv.compile_text(text).layout, routed) / len(pairs), 1)


def names() -> Iterator[Count]:
    """Misspelt names beside thousands of known ones."""
    for stem, wrong in (("gain", "gian"), ("activation", "atcivation"), ("K", "L")):
        known = [f"{stem}{number}_" for number in range(4000)]
        with mock.patch.object(SequenceMatcher, "ratio", autospec=True, side_effect=SequenceMatcher.ratio) as compared:
            for number in range(0, 4000, 400):
                nearest(f"{wrong}{number}_", known)
        yield Count(f"names like {stem}0_ of 4,000 compared in full", compared.call_count / 10, 400)
    groups = ", ".join(f"group_{number}_x: {{}}" for number in range(2000))
    misspelt = ", ".join(f"gruop_{number}_x -> group_0_x: 1" for number in range(2000))
    with mock.patch.object(SequenceMatcher, "ratio", autospec=True, side_effect=SequenceMatcher.ratio) as compared:
        refused(f"neurons: {{{groups}}}\nconnections: {{{misspelt}}}\n")
    yield Count("names compared in full, all of 2,000 misspelt", compared.call_count, 3_500)


def hints() -> Iterator[Count]:
    """500 misspelt names of each kind beside 500 known ones."""
    names = [f"group_{number}_x" for number in range(500)]

    def listed(entry: str) -> str:
        return "{" + ", ".join(entry.format(number, f"gruop_{number}_x") for number in range(500)) + "}\n"

    neurons = "neurons: {" + ", ".join(f"{name}: {{}}" for name in names) + "}\n"
    inputs = "inputs: {" + ", ".join(f"{name}: {{size: 1}}" for name in names) + "}\n"
    parameters = "parameters: {" + ", ".join(f"{name}: 1" for name in names) + "}\n"
    module = "modules: {m: {inputs: {a: {size: 1}}, neurons: {B: {input: a}}}}\n"
    bound = listed("m{0}: {{module: m, inputs: {{a: {1}}}}}")
    specs = {
        "connections": neurons + "connections: " + listed("group_0_x -> {1}: 1"),
        "outputs": neurons + "outputs: " + listed("o{0}: {1}"),
        "targets of rules": neurons
        + "connections: "
        + listed("group_{0}_x -> group_0_x: {{plasticity: {{delta: {{target: {1}}}}}}}"),
        "inputs": inputs + "neurons: " + listed("n{0}: {{input: {1}}}"),
        "inputs of instances": inputs + module + "neurons: {A: {}}\ninstances: " + bound,
        "subscriptions": inputs + "neurons: {A: {}}\nros: {subscribe: " + listed("{1}: {{topic: /t{0}}}") + "}",
        "parameters": parameters + "neurons: " + listed("n{0}: {{bias: 2*{1}}}"),
        "parameters that are set": parameters + "neurons: {A: {}}\nevents: [{at: 3, set: " + listed("{1}: 1") + "}]",
        "activations": "neurons: " + listed("n{0}: {{activation: {1}}}"),
        "modules": module + "neurons: {A: {}}\ninstances: " + listed("m{0}: {{module: {1}}}"),
    }
    for what, spec in specs.items():
        with mock.patch.object(likeness, "alike", wraps=likeness.alike) as compared:
            refused(spec)
        found = sum(bool(call.args[1]) for call in compared.call_args_list)
        yield Count(f"names compared at all, {what}", found, 2 * MOST_HINTS + 50)


def each_of_many() -> Iterator[Count]:
    """What is the same for many groups, inputs and instances, and for many steps."""
    text = "inputs:\n" + "".join(f"  s{i}: {{size: 1}}\n" for i in range(300)) + "neurons: {A: {bias: 1}}\n"
    known = calls(
        lambda: nv.compile_text(HEAD + text), _of(Names.known, lambda frame: len(frame.f_locals["self"].declared))
    )
    yield Count("names gone through for an input", known / 300, 20)
    text = "".join(f"  A{i}: {{bias: 1}}\n  B{i}: {{activation: tanh, bias: {i}}}\n" for i in range(50))
    text = f"{HEAD}neurons:\n{text}  C: {{activation: {{leaky_relu: {{slope: 0.5}}}}, bias: 1}}\n"
    yield Count("groups made out, of 101", calls(lambda: nv.compile_text(text), _of(Builder._neuron_type)), 3)
    yield Count("formulas looked at, of 101 groups", calls(lambda: nv.compile_text(text), _of(undefined.hazards)), 20)
    rows = "".join(f"  i{i}: {{module: m}}\n" for i in range(400))
    many = f"modules: {{m: {{neurons: {{A: {{bias: 1}}}}}}}}\ninstances:\n{rows}"
    with mock.patch.object(size_estimate, "MOST_INSTANCES", 100):
        found = calls(lambda: refused(many), _of(size_estimate._counted))
    yield Count("instances counted, of 400 where 100 may be", found, 150)
    network = nv.compile(Path(__file__).resolve().parent.parent / "specs" / "cpg_rbf.yaml")
    network.run(1, backend="numpy")
    few, more = (
        calls(lambda steps=steps: network.run(steps, backend="numpy"), _of(None))  # type: ignore[misc]
        for steps in (2560, 5120)
    )
    yield Count("calls of a step of array code", (more - few) / 2560, 6)


def _of(
    function: Callable[..., object] | None, weight: Callable[[FrameType], int] = lambda _: 1
) -> Callable[[FrameType, str], int]:
    """Calls of one function, or of any that is Python, weighed by their frames."""
    code = None if function is None else function.__code__
    return lambda frame, event: weight(frame) if event == "call" and code in (None, frame.f_code) else 0


def refused(spec: str) -> None:
    """Compile a spec that is defective."""
    try:
        nv.compile_text(HEAD + spec)
    except nv.SpecError:
        return
    raise AssertionError("a defective spec was compiled")


def main() -> int:
    """Count, and print a table. Gives the exit status."""
    nv.compile_text(HEAD + "neurons: {A: {bias: 1}}\n").layout()  # whatever is imported does not count
    more = 0
    print("| what | found | at most |\n| --- | --- | --- |")
    for part in (layouts, ways_round, reflections, routes, names, hints, each_of_many):
        for what, found, most in part():
            print(f"| {what} | {round(found, 2):,} | {most:,} |{'' if found <= most else ' <- more'}", flush=True)
            more += found > most
    return int(more > 0)


if __name__ == "__main__":
    sys.exit(main())
