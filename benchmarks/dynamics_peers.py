"""Networks of ``benchmarks/dynamics.py`` in Brian2 and PyRates.

In: the tool, the network, a ``.npz`` with its numbers (dt, steps, and what differs by neuron and by connection), the
method. Out: the activities of all steps in a ``.npy``; on standard output the seconds of the loop and how many times
the derivatives were evaluated. It runs in a Python of its own: these tools need another NumPy than we do.

Brian2 is ``cpp_standalone``, compiled with -O2, and tells the time of its loop itself. Where a network has connections,
what arrives is a variable that is ``summed`` from synapses, once a step. PyRates computes by NumPy; what is timed
is its integration, without what it takes to write its code. Its ``heun`` is left out: version 1.2.3 has both slopes in
one buffer.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable

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
}
SENT = {"wilson_cowan": "a", "jansen_rit": "5/(1 + exp(0.56*(6 - (y1 - y2))))", "ctrnn": "tanh(v)"}
#: what is kept of a neuron, from its states
SHOWN: dict[str, Callable[..., object]] = {
    "wilson_cowan": lambda a: a,
    "jansen_rit": lambda y1, y2: y1 - y2,
    "ctrnn": np.tanh,
}
KEPT = {"wilson_cowan": ("a",), "jansen_rit": ("y1", "y2"), "ctrnn": ("v",)}
PARAMETERS = {"wilson_cowan": ("p", "s", "h"), "jansen_rit": ("p",), "ctrnn": ("p", "tau")}
STAGES = {"euler": 1, "heun": 2, "rk4": 4}


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
            lines += ["u : 1", f"sent = {SENT[network]} : 1"]
        cells = b.NeuronGroup(1 if together else len(given["p"]), "\n".join(lines), method=method)
        links = []
        if together:
            cells.a0, cells.a1 = given["initial"]
        else:
            for name in parameters:
                setattr(cells, name, given[name])
            setattr(cells, EQUATIONS[network][0][0], given["initial"])
            made = b.Synapses(cells, cells, "w : 1 (constant)\nu_post = w*sent_pre : 1 (summed)")
            made.connect(i=given["sources"], j=given["targets"])
            made.w = given["weights"]
            links.append(made)
        kept = ("a0", "a1") if together else KEPT[network]
        monitor = b.StateMonitor(cells, kept, record=True)
        net = b.Network(cells, monitor, *links)
        net.run(steps * dt * b.second)
        b.device.build(directory=folder, compile=True, run=True, with_output=False)
        columns = [np.array(getattr(monitor, name)).T for name in kept]
        shown = np.hstack(columns) if together else SHOWN[network](*columns)
        return np.asarray(shown), float(b.device._last_run_time), STAGES[method] * steps


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
    equations = [f"d/dt * {name} = {formula}" for name, formula in EQUATIONS[network]]
    variables: dict[str, object] = {name: "variable(0.0)" for name, _ in EQUATIONS[network]}
    sent = SENT[network] if SENT[network].isidentifier() else "sent"
    if sent == "sent":
        equations.append(f"sent = {SENT[network]}")
    variables |= {sent: "output(0.0)", "u": "input(0.0)", **dict.fromkeys(PARAMETERS[network], 0.0)}
    first = EQUATIONS[network][0][0]
    node = NodeTemplate(name="cell", operators=[OperatorTemplate(name="o", equations=equations, variables=variables)])
    links = zip(given["sources"].tolist(), given["targets"].tolist(), given["weights"].tolist(), strict=True)
    edges = [(f"n{i}/o/{sent}", f"n{j}/o/u", None, {"weight": w}) for i, j, w in links]
    n = len(given["p"])
    circuit = CircuitTemplate(name="net", nodes={f"n{i}": node for i in range(n)}, edges=edges)
    values = {f"n{i}/o/{name}": float(given[name][i]) for name in PARAMETERS[network] for i in range(n)}
    circuit.update_var(node_vars=values | {f"n{i}/o/{first}": float(given["initial"][i]) for i in range(n)})
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


def main(tool: str, network: str, path: str, method: str, output: str) -> None:
    given = dict(np.load(path))
    shown, seconds, evaluations = {"brian2": brian, "pyrates": pyrates}[tool](network, given, method)
    np.save(output, shown)
    print(seconds, evaluations)


main(*sys.argv[1:])
