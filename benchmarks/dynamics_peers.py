"""Networks of ``benchmarks/dynamics.py`` in Brian2 and PyRates.

In: the tool, the network, a ``.npz`` with its numbers (dt, steps, and what differs by neuron and by connection), the
method. Out: the activities of all steps in a ``.npy``; on standard output the seconds of the loop and how many times
the derivatives were evaluated. It runs in a Python of its own: these tools need another NumPy than we do.

Brian2 is ``cpp_standalone``, compiled with -O2, and tells the time of its loop itself; of several runs the quickest
counts. Where a network has connections, what arrives is a variable that is ``summed`` from synapses, once a step.
PyRates computes by NumPy; what is timed is its integration, without what it takes to write its code. Its ``heun`` is
left out: version 1.2.3 has both slopes in one buffer.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

#: the derivatives of a neuron, with u for what arrives, p for its bias; what it sends
EQUATIONS = {
    "wilson_cowan": (("a", "(-a + (1 - a)*(1/(1 + exp(-s*(u + p - h))) - 1/(1 + exp(s*h))))/0.01"),),
    "jansen_rit": (
        ("y0", "y3"),
        ("y1", "y4"),
        ("y2", "y5"),
        ("y3", "325*5/(1 + exp(0.56*(6 - (y1 - y2)))) - 200*y3 - 10000*y0"),
        ("y4", "325*(u + p + 108*5/(1 + exp(0.56*(6 - 135*y0)))) - 200*y4 - 10000*y1"),
        ("y5", "37125*5/(1 + exp(0.56*(6 - 33.75*y0))) - 100*y5 - 2500*y2"),
    ),
    "ctrnn": (("v", "(u + p - v)/tau"),),
    "kuramoto": (("theta", "2*pi*p + u"),),
    "worm": (("v", "10*(-35 - v) + u + q + p"), ("s", "1/(1 + exp(-0.125*(v + 35)))*(1 - s) - 5*s")),
}
SENT = {"wilson_cowan": "a", "jansen_rit": "5/(1 + exp(0.56*(6 - (y1 - y2))))", "ctrnn": "tanh(v)"}


class Coupling(NamedTuple):
    """What connections of a kind bring to a variable, by states of both ends, the weight and a parameter."""

    into: str
    signal: str
    source: str
    target: str
    parameter: str = ""


#: of networks with synapses, by the number that ``kinds`` has for a connection; of the others it is w*sent_pre
COUPLINGS = {
    "kuramoto": (Coupling("u", "sin(theta_pre - theta_post)", "theta", "theta"),),
    "worm": (
        Coupling("u", "s_pre*(reversal - v_post)", "s", "v", "reversal"),
        Coupling("q", "v_pre - v_post", "v", "v"),
    ),
}
#: what is kept of a neuron, from its states
SHOWN: dict[str, Callable[..., object]] = {
    "wilson_cowan": lambda a: a,
    "jansen_rit": lambda y1, y2: y1 - y2,
    "ctrnn": np.tanh,
    "kuramoto": np.cos,
    "worm": lambda v: v,
}
KEPT = {"wilson_cowan": ("a",), "jansen_rit": ("y1", "y2"), "ctrnn": ("v",), "kuramoto": ("theta",), "worm": ("v",)}
PARAMETERS = {
    "wilson_cowan": ("p", "s", "h"), "jansen_rit": ("p",), "ctrnn": ("p", "tau"), "kuramoto": ("p",), "worm": ("p",),
}  # fmt: skip
STAGES = {"euler": 1, "heun": 2, "rk4": 4}
REPEATS = 9


def brian(network: str, given: dict[str, np.ndarray], method: str) -> tuple[np.ndarray, float, int]:
    import brian2 as b  # type: ignore[import-not-found, unused-ignore]

    steps, dt = int(given["steps"]), float(given["dt"])
    with tempfile.TemporaryDirectory() as folder:
        b.set_device("cpp_standalone", directory=folder, build_on_run=False)
        b.prefs.codegen.cpp.extra_compile_args_gcc = ["-O2", "-w"]
        b.defaultclock.dt = dt * b.second
        parameters = PARAMETERS[network]
        lines = [f"d{name}/dt = ({formula})/second : 1" for name, formula in EQUATIONS[network]]
        lines += [f"{name} : 1 (constant)" for name in parameters]
        together = network == "wilson_cowan"  # two populations: one set of equations, which is exact at stages
        if together:
            lines = _wilson_cowan(given)
        else:
            lines += [f"{one.into} : 1" for one in COUPLINGS.get(network, ())]
            lines += ["u : 1", f"sent = {SENT[network]} : 1"] if network in SENT else []
        cells = b.NeuronGroup(1 if together else len(given["p"]), "\n".join(lines), method=method)
        links = []
        if together:
            cells.a0, cells.a1 = given["initial"]
        else:
            for name in parameters:
                setattr(cells, name, given[name])
            setattr(cells, EQUATIONS[network][0][0], given["initial"])
            for name, _ in EQUATIONS[network][1:]:
                setattr(cells, name, given.get(name, 0.0))
            links = _synapses(network, given, cells)
        kept = ("a0", "a1") if together else KEPT[network]
        monitor = b.StateMonitor(cells, kept, record=True)
        net = b.Network(cells, monitor, *links)
        net.run(steps * dt * b.second)
        b.device.build(directory=folder, compile=True, run=True, with_output=False)
        took = [float(b.device._last_run_time)]
        for _ in range(REPEATS):
            b.device.run(with_output=False)
            took.append(float(b.device._last_run_time))
        columns = [np.array(getattr(monitor, name)).T for name in kept]
        shown = np.hstack(columns) if together else SHOWN[network](*columns)
        return np.asarray(shown), min(took), STAGES[method] * steps


def _synapses(network: str, given: dict[str, np.ndarray], cells: object) -> list[object]:
    """The connections, those of each kind together."""
    import brian2 as b

    made = []
    for kind, one in enumerate(COUPLINGS.get(network, (Coupling("u", "sent_pre", "", ""),))):
        some = given.get("kinds", np.zeros(len(given["weights"]))) == kind
        parameter = f"\n{one.parameter} : 1 (constant)" if one.parameter else ""
        lines = f"w : 1 (constant){parameter}\n{one.into}_post = w*({one.signal}) : 1 (summed)"
        links = b.Synapses(cells, cells, lines)
        links.connect(i=given["sources"][some], j=given["targets"][some])
        links.w = given["weights"][some]
        if one.parameter:
            setattr(links, one.parameter, given[one.parameter][some])
        made.append(links)
    return made


def _wilson_cowan(given: dict[str, np.ndarray]) -> list[str]:
    """Both populations as the equations of one neuron."""
    (_, formula), lines = EQUATIONS["wilson_cowan"][0], []
    for target in (0, 1):
        arriving = [
            f"({w!r})*a{i}"
            for w, i, j in zip(given["weights"].tolist(), given["sources"], given["targets"], strict=True)
            if j == target
        ]
        here = {"a": f"a{target}", "u": f"({' + '.join(arriving)})"}
        here |= {name: repr(float(given[name][target])) for name in "psh"}
        written = "".join(here.get(word, word) for word in _words(formula))
        lines.append(f"da{target}/dt = ({written})/second : 1")
    return lines


def _words(formula: str) -> list[str]:
    """A formula in names and what is between them."""
    import re

    return re.findall(r"[A-Za-z_]\w*|[^A-Za-z_]+", formula)


def pyrates(network: str, given: dict[str, np.ndarray], method: str) -> tuple[np.ndarray, float, int]:
    import scipy.integrate  # type: ignore[import-not-found, unused-ignore]  # noqa: F401  # or it is timed, too
    from pyrates import CircuitTemplate, NodeTemplate, OperatorTemplate  # type: ignore[import-not-found, unused-ignore]
    from pyrates.backend.base.base_backend import BaseBackend  # type: ignore[import-not-found, unused-ignore]

    steps, dt = int(given["steps"]), float(given["dt"])
    if network in COUPLINGS:
        operators, edges = [_operator(network, *one) for one in EQUATIONS[network]], _edges(network, given)
    else:
        equations = [f"d/dt * {name} = {formula}" for name, formula in EQUATIONS[network]]
        variables: dict[str, object] = {name: "variable(0.0)" for name, _ in EQUATIONS[network]}
        sent = SENT[network] if SENT[network].isidentifier() else "sent"
        if sent == "sent":
            equations.append(f"sent = {SENT[network]}")
        variables |= {sent: "output(0.0)", "u": "input(0.0)", **dict.fromkeys(PARAMETERS[network], 0.0)}
        operators = [OperatorTemplate(name="o", equations=equations, variables=variables)]
        links = zip(given["sources"].tolist(), given["targets"].tolist(), given["weights"].tolist(), strict=True)
        edges = [(f"n{i}/o/{sent}", f"n{j}/o/u", None, {"weight": w}) for i, j, w in links]
    node = NodeTemplate(name="cell", operators=operators)
    n = len(given["p"])
    circuit = CircuitTemplate(name="net", nodes={f"n{i}": node for i in range(n)}, edges=edges)
    values = {f"n{i}/o/{name}": float(given[name][i]) for name in PARAMETERS[network] for i in range(n)}
    first, *further = [name for name, _ in EQUATIONS[network]]
    begins = {first: given["initial"]} | {name: given[name] for name in further if name in given}
    values |= {f"n{i}/{_place(network, name)}": float(of[i]) for name, of in begins.items() for i in range(n)}
    circuit.update_var(node_vars=values)
    took, evaluated, integrate = [0.0], [0], BaseBackend.run

    def timed(self: object, func: Callable[..., object], *arguments: object, **more: object) -> object:
        def counted(*of: object) -> object:
            evaluated[0] += 1
            return func(*of)

        start = time.process_time()
        found = integrate(self, func if method == "euler" else counted, *arguments, **more)
        took[0] = time.process_time() - start
        return found

    BaseBackend.run = timed
    adaptive = {} if method == "euler" else {"method": method, "rtol": 1e-8, "atol": 1e-10}
    outputs = {f"{name}_{i}": f"n{i}/o/{name}" for name in KEPT[network] for i in range(n)}
    table = circuit.run(
        simulation_time=steps * dt,
        step_size=dt,
        outputs=outputs,
        solver="euler" if method == "euler" else "scipy",
        verbose=False,
        in_place=False,
        **adaptive,
    )
    columns = [table[[f"{name}_{i}" for i in range(n)]].to_numpy() for name in KEPT[network]]
    return np.asarray(SHOWN[network](*columns)), took[0], steps if method == "euler" else evaluated[0]


def _operator(network: str, name: str, formula: str) -> object:
    """The equation of a state; an operator has one output. That of the first state, to which all comes, is "o"."""
    from pyrates import OperatorTemplate

    into = [one.into for one in COUPLINGS[network]]
    read = [*into, *PARAMETERS[network], *(state for state, _ in EQUATIONS[network] if state != name)]
    variables: dict[str, object] = {name: "output(0.0)"}
    for one in read:
        if one in _words(formula):
            variables[one] = 0.0 if one in PARAMETERS[network] else "input(0.0)"
    where, _ = _place(network, name).split("/")
    return OperatorTemplate(name=where, equations=[f"d/dt * {name} = {formula}"], variables=variables)


def _edges(network: str, given: dict[str, np.ndarray]) -> list[tuple[str, str, object, dict[str, object]]]:
    """The connections with synapses, an edge each with a template of its kind."""
    from pyrates import EdgeTemplate, OperatorTemplate

    def template(one: Coupling, value: float, number: int) -> EdgeTemplate:
        variables: dict[str, object] = {"brought": "output(0.0)"}
        variables |= dict.fromkeys((f"{one.source}_pre", f"{one.target}_post"), "input(0.0)")
        variables |= {one.parameter: value} if one.parameter else {}
        operator = OperatorTemplate(name=f"c{number}", equations=[f"brought = {one.signal}"], variables=variables)
        return EdgeTemplate(name=f"e{number}", operators=[operator])

    made: dict[tuple[int, float], EdgeTemplate] = {}
    kinds, edges = given.get("kinds", np.zeros(len(given["weights"]), dtype=np.int64)), []
    for e, (i, j, kind) in enumerate(zip(given["sources"], given["targets"], kinds, strict=True)):
        one = COUPLINGS[network][kind]
        value = float(given[one.parameter][e]) if one.parameter else 0.0
        if (kind, value) not in made:  # of two templates of one name it would take the first
            made[kind, value] = template(one, value, len(made))
        used = made[kind, value]
        at = f"{used.name}/c{used.name[1:]}"
        values: dict[str, object] = {"weight": float(given["weights"][e]), f"{at}/{one.source}_pre": "source"}
        values[f"{at}/{one.target}_post"] = f"n{j}/{_place(network, one.target)}"
        ends = f"n{i}/{_place(network, one.source)}", f"n{j}/o/{one.into}"
        edges.append((*ends, used, values))
    return edges


def _place(network: str, state: str) -> str:
    """Where a state is in a neuron: its operator, and its name."""
    return f"{'o' if state == EQUATIONS[network][0][0] else state}/{state}"


def main(tool: str, network: str, path: str, method: str, output: str) -> None:
    given = dict(np.load(path))
    shown, seconds, evaluations = {"brian2": brian, "pyrates": pyrates}[tool](network, given, method)
    np.save(output, shown)
    print(seconds, evaluations)


main(*sys.argv[1:])
