"""A kind of definition that the language has not: what it takes to add one, which is what a synapse will take.

Declared, read, settled, checked, put into the program with an operation of its own, stepped by the reference and by
NumPy and C, kept in the State and set in a run, all by the seams that activations, models and rules go through.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, TypeVar

import numpy as np
import pytest
from pydantic import Field

import neurovis_spec as nv
from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiler.events.bound import LocatedPart, make_settable
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.program import Check, Key, Kind, Operation, Owner, Projection, Use
from neurovis_spec.compiler.run_checks import with_checks
from neurovis_spec.compiler.values.arguments import Each, settled_of
from neurovis_spec.compiler.values.constants import Constants
from neurovis_spec.compiler.values.definitions import Definitions, Reading, definition_of
from neurovis_spec.compiler.values.parameters import make_parameters
from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.grammar import IN_RULE
from neurovis_spec.language.library import DefinitionModel, Parts, StateModel
from neurovis_spec.language.located import FormulaField, Located
from neurovis_spec.language.model import Named, names_of
from neurovis_spec.language.places import formula_at
from neurovis_spec.language.shape import read_shape, read_spec
from neurovis_spec.language.unknown import UNKNOWN, Names, Unknown
from neurovis_spec.language.values import LOCAL, Choice, ParameterField
from neurovis_spec.language.yaml.reader import read_text
from neurovis_spec.language.yaml.source import Scalar
from neurovis_spec.runtime import c_step, numpy_operations, reference
from neurovis_spec.runtime.numpy_arrivals import Step
from neurovis_spec.runtime.numpy_code import Cell, emit_change
from neurovis_spec.runtime.simulation import Simulation
from neurovis_spec.runtime.state import State

T = TypeVar("T")
SPEC = """\
neurovis: 1
name: fourth
parameters: {g: {value: 0.5, max: 1}}
neurons: {A: {count: 3, initial: [1, 0.5, 0.25]}, B: {count: 3}}
connections: {A -> A: {weight: 0.5, pattern: one_to_one}, A -> B: {weight: 0.25, pattern: one_to_one, delay: 2}}
"""
LOW_PASS = """\
parameters: {fade: {value: 0.1, max: 1}}
state: {s: {each_step: fade*s + pre}}
echo: s*clip(1/fade, 0, 3)
"""

# ---- the fourth kind ---------------------------------------------------------------------------------------------

ECHO = Kind("echo", "connection", "echo")


class EchoModel(DefinitionModel):
    parameters: Annotated[Named[ParameterField], LOCAL] = Field(default_factory=dict)
    let: Annotated[Named[Annotated[FormulaField, IN_RULE]], LOCAL] = Field(default_factory=dict)
    state: Annotated[Named[Annotated[StateModel, IN_RULE]], LOCAL] = Field(default_factory=dict)
    echo: Annotated[FormulaField, IN_RULE]

    def parts(self) -> Parts:
        return Parts(self.parameters, self.let, self.echo, state=self.state)


@dataclass(frozen=True, slots=True)
class Echo(Operation):
    """What the connections of a projection echo is added to the activities of their targets."""

    projection: int


@reference.perform.register
def _perform(operation: Echo, by: reference.ReferenceStepper, state: State, inputs: FloatArray) -> None:
    projection = by.network.projections[operation.projection]
    for place, connection in enumerate(projection.members.tolist()):
        seen = by.known(projection.uses[0], place, state) | by.seen(projection, place, state)
        given = by.change(projection.uses[0], place, seen, state, {})
        state.activity[by.network.connections.targets[connection]] += given["echo"]


@numpy_operations.emit.register
def _emit(operation: Echo, step: Step) -> None:
    code, projection = step.code, step.network.projections[operation.projection]
    (use,) = projection.uses
    states = {one.name: code.state(use, one.name) for one in use.definition.state}
    cells = {name: Cell(state, f"{state}[:]") for name, state in states.items()}
    seen = code.parameters(use) | numpy_operations.seen_at(step, projection)
    given = emit_change(code, use.definition, seen, cells, step.network.episode)
    targets = code.constant(step.network.connections.targets[projection.members])
    code.line(f"np.add.at(activity, {targets}, {given['echo']})")


@c_step.write.register
def _write(operation: Echo, step: c_step.StepCode) -> None:
    code, projection = step.code, step.network.projections[operation.projection]
    (use,) = projection.uses
    for place, connection in enumerate(projection.members.tolist()):
        stored = step.states(use, place)
        new, given = step.change(use.definition, code.parameters(use, place) | step.seen(projection, place), stored)
        step.store([(stored[name], value) for name, value in new.items()])
        code.line(f"activity[{step.network.connections.targets[connection]}] += {code.text(given['echo'])};")


def with_echo(network: Network, settings: str) -> Network:
    """The network, whose connections from A to B echo with these settings."""
    model, choice, constants = written(settings)
    reading = Reading(ECHO, formula_at(EchoModel, "echo"))
    known = Definitions({ECHO: Names({"low_pass": definition_of(reading, "low_pass", model, constants.findings)})})
    used = sure(settled_of(choice, ECHO, known, constants, Each("connection", {}), 3))
    constants.findings.check()
    use = Use(Owner("echo", 0), used.definition, used.parameters)
    found = [LocatedPart(Key(use.owner, part.name), part.within(3), part) for part in used.parts]
    projections = (Projection(np.arange(3, 6), (use,), {}),)
    network = replace(network, projections=projections, program=(*network.program, Echo(0)))
    return with_checks(replace(network, settable=make_settable(network, tuple(constants.slots), found)))


# ---- what an author has written, and what comes of it ---------------------------------------------------------------


def written(settings: str) -> tuple[EchoModel, Choice, Constants]:
    """The definition, the settings where it is used, and the parameters of the spec."""
    findings = Findings()
    spec = sure(read_spec(sure(read_text(SPEC, "spec", findings)), findings))
    model = sure(read_shape(sure(read_text(LOW_PASS, "echo", findings)), EchoModel, findings))
    constants = Constants(names_of(spec, "parameters", {}), 1.0, findings)
    make_parameters(spec, constants, {})
    node = sure(read_text(settings, "settings", findings)).root
    return model, Choice(Located("low_pass", Scalar("low_pass", node.span)), node), constants


def sure(value: T | Unknown | None) -> T:
    assert value is not None
    assert value is not UNKNOWN
    return value


def by_hand(steps: int, fade: list[float]) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """The activities of B: what arrives after two steps, and its echo."""
    a, rows, s = [np.array([1, 0.5, 0.25])], [], np.zeros(3)
    for k in range(steps):
        a.append(0.5 * a[-1])
        arrived = a[k - 2] if k >= 2 else np.zeros(3)
        s = np.array(fade)[k] * s + arrived
        rows.append(0.25 * arrived + s * min(1 / fade[k], 3))
    return np.array(rows)


@pytest.fixture
def network() -> Network:
    return nv.compile_text(SPEC).network


@pytest.mark.parametrize("backend", ["reference", "numpy", pytest.param("c", marks=pytest.mark.compiler)])
def test_it_is_stepped_kept_and_set(network: Network, backend: str) -> None:
    simulation = Simulation(with_echo(network, "fade: g"), backend=backend)
    rows = []
    for k in range(8):
        if k == 5:
            simulation.set(g=0.25)
        simulation.step()
        rows.append(simulation.activity[3:].copy())
    fades = [0.5] * 5 + [0.25] * 3
    np.testing.assert_allclose(rows, by_hand(8, fades), rtol=1e-15)
    (kept,) = (own for owner, own in simulation.state().cells.items() if owner == Owner("echo", 0))
    assert next(iter(kept)) == "s"
    with pytest.raises(ValueError, match=r"'g' is 2; its bounds are -∞ to 1"):
        simulation.set(g=2)


def test_it_is_checked(network: Network) -> None:
    made = with_echo(network, "fade: [0.5, 0, 0.5]")
    (use,) = made.projections[0].uses
    assert [type(one) for one in use.definition.state][1:] == [Check]
    simulation = Simulation(made, backend="numpy")
    with pytest.warns(RuntimeWarning, match="the echo 'low_pass' divides by 0 for A2 -> B2 after step 0"):
        simulation.step()


def test_what_is_wrong_in_it_is_told(network: Network) -> None:
    with pytest.raises(nv.SpecError, match="'fade' is 3; its bounds are -∞ to 1"):
        with_echo(network, "fade: 3")
    with pytest.raises(nv.SpecError, match="there is no parameter 'fate'"):
        with_echo(network, "fate: 0.5")
