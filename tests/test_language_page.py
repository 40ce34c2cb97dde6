"""The language reference: its tables are those of the program, its examples compile, its claims hold."""

from __future__ import annotations

import re
import runpy
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.integrate import solve_ivp

import neurovis_spec as nv
from neurovis_spec.arrays import FloatArray
from neurovis_spec.language.data.files import LARGEST
from neurovis_spec.language.data.table import MOST_CELLS
from neurovis_spec.language.expressions.functions import RESERVED
from neurovis_spec.language.tables import DATA_FILES
from neurovis_spec.manual.keys import keys

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "language.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```yaml\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
WHOLE = [block for block in BLOCKS if block.startswith("neurovis:")]
PARTS = [block for block in BLOCKS if not block.startswith("neurovis:")]
REST = {
    "neurovis": "neurovis: 1",
    "name": "name: example",
    "neurons": "neurons: {A: {}, B: {}, O: {}, T: {}, K: {count: 4}}",
}
#: Warnings that a part of a spec, or a built-in written down again, causes.
PARTIAL = {"idle-neuron", "unused-definition", "unused-input", "unused-parameter", "unused-module", "replaces-builtin"}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with the files that the examples name."""
    data = tmp_path / "data"
    data.mkdir()
    np.savetxt(data / "sensed.csv", [[0.5], [0.25]], delimiter=",")
    (data / "spikes.csv").write_text("time,index,t_ms,id\n0.001,1,1,1\n")
    np.savetxt(data / "pairs.csv", [[0, 0.5], [-0.5, 0]], delimiter=",")
    np.savetxt(data / "centres.csv", np.eye(2, 4), delimiter=",")
    np.savez_compressed(data / "trained.npz", weights=np.ones((2, 4)), bias=np.zeros(4))
    (data / "feedback.mtx").write_text("%%MatrixMarket matrix coordinate pattern general\n4 2 2\n1 1\n4 2\n")
    cells = "name,class,x,y,leak,bias\nP,inner,0,0,0.2,1\nQ,extra,1,0,,2\n"
    (data / "cells.csv").write_text(cells, encoding="utf-8")
    worm = "Source\tTarget\tType\tN\tdelay_ms\trate\nAVAL\tAVAR\tchemical\t3\t1\t\nAVAR\tAVBL\tgap\t1\t\t\n"
    (data / "worm.tsv").write_text(worm, encoding="utf-8")
    (data / "edges.csv").write_text("from,to,weight,delay\nK1,O,0.5,1\nK2,O,,2\n", encoding="utf-8")
    shutil.copy(ROOT / "specs" / "walk" / "hexapod.xml", tmp_path)
    (tmp_path / "library").mkdir()
    (included,) = (block for block in PARTS if block.startswith("# library/legs.yaml\n"))
    (tmp_path / "library" / "legs.yaml").write_text(included, encoding="utf-8")
    return tmp_path


def test_the_tables_are_those_of_the_program() -> None:
    made: Callable[[str], str] = runpy.run_path(str(ROOT / "docs" / "make_language.py"))["made"]
    assert made(PAGE) == PAGE, "run: make docs"


@pytest.mark.parametrize("text", WHOLE, ids=lambda text: str(yaml.safe_load(text)["name"]))
def test_a_whole_spec_compiles_and_runs_without_a_warning(text: str) -> None:
    network = nv.compile_text(text)
    assert network.warnings == ()
    run = network.run(200)
    assert np.isfinite(run.activity).all()


@pytest.mark.parametrize("text", PARTS, ids=lambda text: "-".join(yaml.safe_load(text)))
def test_a_part_of_a_spec_compiles_and_runs(text: str, folder: Path) -> None:
    there = yaml.safe_load(text)
    whole = "\n".join([text, *(line for key, line in REST.items() if key not in there)])
    network = nv.compile_text(whole, folder=folder)
    assert {finding.code for finding in network.warnings} <= PARTIAL
    network.run(3)


def test_there_are_examples_of_every_section() -> None:
    shown = {key for block in BLOCKS for key in yaml.safe_load(block)}
    assert shown >= {key.name for key in keys() if "." not in key.path} - {
        "title",
        "description",
        "authors",
        "license",
        "references",
        "ros",
    }


def test_every_key_and_built_in_is_on_the_page() -> None:
    for key in keys():
        if key.path not in ("rules.state.initial", "rules.state.each_step", "rules.state.each_episode"):
            assert f"`{key.name}`" in PAGE, key.path


def test_the_example_of_the_whole_learns() -> None:
    run = nv.compile_text(WHOLE[0]).run()
    error = np.abs(run["T"] - run["O"])
    assert error[-126:].max() < 0.1 * error[:126].max()


def test_the_example_of_episodes_learns() -> None:
    for seed in range(3):
        run = nv.compile_text(example("episodes"), seed=seed).run()
        assert abs(run["O"][0] - 1) > 0.4
        assert abs(run["O"][-1] - 1) < 0.1


def example(name: str) -> str:
    (text,) = (block for block in WHOLE if f"\nname: {name}\n" in block)
    return str(text)


def test_the_reservoir_learns() -> None:
    run = nv.compile_text(example("reservoir")).run()
    error = np.abs(run["T"] - run["O"])
    assert error[-200:].mean() < 0.2 * np.abs(run["T"]).mean()


def test_the_force_network_learns_its_sine() -> None:
    network = nv.compile_text(example("force"))
    run = network.run()
    assert np.sqrt(np.mean(run["e"][3000:] ** 2)) < 0.02
    assert np.std(run["z"][3000:]) > 0.6
    simulation = network.simulator()
    rates = []
    for _ in range(50):
        simulation.step()
        rates.append(simulation.activity[:100].copy())
    entry = network.network.connections.entries.index("R -> K")
    made = simulation.state().weights[network.network.connections.entry.whole() == entry].reshape(100, 100)
    np.testing.assert_allclose(np.linalg.inv(made), np.eye(100) + np.array(rates).T @ np.array(rates), atol=1e-9)


def test_sangers_rule_finds_principal_components_in_their_order() -> None:
    run = nv.compile_text(example("sanger")).run()
    found = run.weights[-1].reshape(4, 4)[[0, 2]]
    mixing = np.array([[1, 0.5, 0, 0.3], [0, 0.6, -0.6, 0.2], [0.1, 0, 0.1, -0.3]])
    wanted = np.linalg.eigh(mixing.T @ mixing)[1][:, :1:-1].T
    for own, one in zip(found, wanted, strict=True):
        assert abs(own @ one) > 0.99
        assert 0.95 < np.linalg.norm(own) < 1.05


def test_the_map_orders_itself() -> None:
    places = nv.compile_text(example("kohonen")).run(states=["all"])["places"]
    order = np.sign(np.diff(places[-1]))
    assert abs(order.sum()) == 11
    assert np.sort(places[-1])[[0, -1]] == pytest.approx([0.1, 0.9], abs=0.08)
    assert abs(np.sign(np.diff(places[0])).sum()) < 11


def test_the_hopfield_network_mends_two_mistakes() -> None:
    assert nv.compile_text(example("hopfield")).run()["N"][-1].tolist() == [1, 1, 1, 1, -1, -1, -1, -1]


def test_the_neuron_becomes_selective() -> None:
    answers = nv.compile_text(example("selectivity")).run()["N"][-2:]
    assert sorted(answers.tolist()) == pytest.approx([0, 2], abs=0.2)


def test_the_vehicle_turns_to_the_light() -> None:
    vehicle = nv.compile_text(example("vehicle")).simulator()
    for _ in range(3):
        left, right = np.asarray(vehicle.step(light=[1, 0.2])["motors"]).tolist()
    assert right > left  # the light is on the left


def test_the_oscillators_fall_into_step() -> None:
    """Coupled they keep the same time, half a period apart; each by itself has its own."""

    def beats(coupling: float) -> tuple[int, int, float]:
        run = nv.compile_text(example("gait"), coupling=coupling).run()
        left, right = run["left.C1"][-1000:], run["right.C1"][-1000:]
        rises = [int((np.diff(np.sign(leg)) > 0).sum()) for leg in (left, right)]
        return rises[0], rises[1], float(np.corrcoef(left, right)[0, 1])

    left, right, alike = beats(0.03)
    assert left == right == 16
    assert alike < -0.95
    left, right, alike = beats(0)
    assert right - left == 2
    assert abs(alike) < 0.5


def largest_error(name: str, of: str, method: str, exact: FloatArray) -> float:
    """How far the neuron of an example is at most from a solution, integrated by this method."""
    text = example(name).replace("}\n", f", integrate: {method}}}\n", 1)
    return float(np.abs(nv.compile_text(text).run()[of] - exact).max())


def test_the_two_populations_oscillate_as_the_page_says() -> None:
    def flow(t: float, x: FloatArray) -> FloatArray:
        gain, threshold = np.array([1.3, 2.0]), np.array([4.0, 3.7])
        drive = x @ np.array([[16.0, 15.0], [-12.0, -3.0]]) + [1.25, 0.0]
        shares = 1 / (1 + np.exp(-gain * (drive - threshold))) - 1 / (1 + np.exp(gain * threshold))
        return np.asarray((-x + (1 - x) * shares) / 10)

    at = np.arange(3001) * 0.1
    exact = solve_ivp(flow, (0, 300), [0.1, 0.1], "DOP853", at, rtol=1e-11, atol=1e-13).y[0]
    late = exact[1000:]
    assert (late.min(), late.max()) == pytest.approx((0.10, 0.27), abs=0.005)
    (rises,) = np.nonzero((late[1:] > 0.18) & (late[:-1] <= 0.18))
    assert np.diff(rises) * 0.1 == pytest.approx(50, abs=1)
    for method, error in (("rk4", 1.2e-8), ("heun", 3e-4), ("euler", 0.13)):
        assert largest_error("wilson_cowan", "E", method, exact) == pytest.approx(error, rel=0.1)


def test_the_coupled_oscillators_keep_one_time() -> None:
    def rounds(coupling: float) -> FloatArray:
        run = nv.compile_text(example("hopf_pair"), coupling=coupling).run(states=["N.phase"])
        return np.asarray(np.unwrap(run["N.phase"][2500:], axis=0) / (2 * np.pi))

    alone, together = rounds(0), rounds(1)
    assert (alone[-1] - alone[0]) / 5 == pytest.approx([1, 1.1], abs=1e-6)
    assert (together[-1] - together[0]) / 5 == pytest.approx([1.05, 1.05], abs=0.005)
    assert (together[-1, 1] - together[-1, 0]) % 1 * 2 * np.pi == pytest.approx(0.7, abs=0.05)


def test_the_three_cells_settle_where_the_page_says() -> None:
    run = nv.compile_text(example("three_cells")).run()
    assert [run[cell][-1] for cell in "ABC"] == pytest.approx([-52.5, -57.5, -62.3], abs=0.05)
    assert 1 / (1 + np.exp((-52 - run["A"][-1]) / 2)) == pytest.approx(0.44, abs=0.005)


def test_the_wave_travels_as_the_page_says() -> None:
    text = example("swimming")
    phases = nv.compile_text(text).run()["phase"]
    assert np.diff(phases[-1]) == pytest.approx([-0.785] * 7, abs=1e-3)
    (start,) = (phases[0],)
    segments = np.arange(8)
    lags = 2 * np.pi / 8 * (segments[:, None] - segments)  # of the target, a row, to the source
    beside = np.abs(segments[:, None] - segments) == 1

    def flow(t: float, x: FloatArray) -> FloatArray:
        theta, r, speed = x.reshape(3, 8)
        pulls = np.where(beside, 4 * r * np.sin(theta - theta[:, None] - lags), 0)
        return np.concatenate((2 * np.pi + pulls.sum(axis=1), speed, 20 * (5 * (1 - r) - speed)))

    exact = solve_ivp(flow, (0, 2), np.concatenate((start, np.zeros(16))), rtol=1e-11, atol=1e-12).y[:8, -1]
    assert phases[200] == pytest.approx(exact, abs=1e-4)
    two = text.replace("  N -> N:\n", "  N1..N7 -> N2..N8:\n").replace("{band: {width: 1}}", "one_to_one")
    two = two.replace("lag*(j - i)", "lag") + "\n"
    there = two[two.index("  N1..N7") : two.index("outputs")]
    back = there.replace("N1..N7 -> N2..N8", "N2..N8 -> N1..N7").replace("lag: lag", "lag: -lag")
    assert nv.compile_text(two.replace(there, there + back)).run()["phase"][-1] == pytest.approx(phases[-1], abs=1e-9)


def test_a_ring_both_ways_is_made_as_the_page_says() -> None:
    def pairs(entries: str) -> set[tuple[int, int]]:
        text = f"neurovis: 1\nname: x\nneurons: {{N: {{count: 8, bias: 1}}}}\nconnections:\n{entries}"
        found = nv.compile_text(text).network.connections
        return set(zip(found.sources.whole().tolist(), found.targets.whole().tolist(), strict=True))

    ring = {(i, (i + step) % 8) for i in range(8) for step in (1, -1)}
    assert pairs("- N -> N: {pattern: ring}\n- N2..N8 + N1 -> N: {pattern: one_to_one}") == ring
    assert pairs("- N -> N: {pattern: ring, symmetric: true}") == ring
    chain = {(i, j) for i, j in ring if abs(i - j) == 1}
    assert pairs("- N -> N: {pattern: {band: {width: 1}}}") == chain
    assert pairs("- N -> N: {pattern: chain}\n- N2..N8 -> N1..N7: {pattern: one_to_one}") == chain


def test_the_half_centre_takes_turns_as_the_page_says() -> None:
    run = nv.compile_text(example("half_centre")).run()["N"][500:]
    left, right = (np.nonzero((cell[1:] > 0) & (cell[:-1] <= 0))[0] * 0.2 for cell in run.T)
    assert np.diff(left) == pytest.approx(np.full(len(left) - 1, 106), abs=0.5)
    assert right[right > left[0]][0] - left[0] == pytest.approx(53, abs=1)
    alone = nv.compile_text(example("half_centre"), inhibition=0).run()["N"]
    assert np.ptp(alone[-500:]) < 1


def test_the_noise_has_the_deviation_that_the_page_says() -> None:
    assert round(float(nv.compile_text(example("noise")).run()["X"][250:].std()), 2) == 2.01


def test_the_squids_axon_fires_when_the_page_says() -> None:
    """Beside a solution in two parts, before and from the current on."""
    at = np.arange(5001) * 0.01
    tight = {"method": "DOP853", "rtol": 1e-10, "atol": 1e-11}
    first = solve_ivp(squid_axon, (0, 5), [-65, 0.0529, 0.5961, 0.3177], t_eval=at[:501], args=(0.0,), **tight).y
    then = solve_ivp(squid_axon, (5, 50), first[:, -1], t_eval=at[500:], args=(10.0,), **tight).y
    exact = np.concatenate((first[0], then[0, 1:]))
    (fires,) = np.nonzero((exact[1:] > 0) & (exact[:-1] <= 0))
    assert (fires * 0.01).tolist() == pytest.approx([6.90, 21.82, 36.47])
    for method, error in (("rk4", 1.2e-4), ("euler", 5.2)):
        assert largest_error("hodgkin_huxley", "axon", method, exact) == pytest.approx(error, rel=0.05)


def squid_axon(t: float, x: FloatArray, current: float) -> list[float]:
    """The equations of Hodgkin and Huxley, by the formulas of the paper."""
    v, m, h, n = x
    return [
        current - 120 * m**3 * h * (v - 50) - 36 * n**4 * (v + 77) - 0.3 * (v + 54.387),
        0.1 * (v + 40) / (1 - np.exp(-(v + 40) / 10)) * (1 - m) - 4 * np.exp(-(v + 65) / 18) * m,
        0.07 * np.exp(-(v + 65) / 20) * (1 - h) - h / (1 + np.exp(-(v + 35) / 10)),
        0.01 * (v + 55) / (1 - np.exp(-(v + 55) / 10)) * (1 - n) - 0.125 * np.exp(-(v + 65) / 80) * n,
    ]


def test_the_names_of_parameters_that_are_taken() -> None:
    line = next(line for line in PAGE.splitlines() if line.startswith("A parameter may not be called"))
    assert set(re.findall(r"`(\w+)`", line)) == set(RESERVED)


@pytest.mark.parametrize(
    ("short", "long"),
    [
        (
            "neurons: {A: {}, B: {bias: 1}}\nconnections: {B -> A: }",
            "neurons: {A: {}, B: {bias: 1}}\nconnections: {B -> A: {}}",
        ),
        ("neurons: {A: {bias: 1, activation: {gaussian: }}}", "neurons: {A: {bias: 1, activation: gaussian}}"),
        (
            "neurons: {A: {bias: 1}}\nconnections: {A -> A: {plasticity: {hebbian: }}}",
            "neurons: {A: {bias: 1}}\nconnections: {A -> A: {plasticity: hebbian}}",
        ),
    ],
)
def test_settings_alone_may_be_missing(short: str, long: str) -> None:
    head = "neurovis: 1\nname: x\n"
    assert nv.compile_text(head + short).hash == nv.compile_text(head + long).hash


@pytest.mark.parametrize("text", ["neurons: {A: }", "neurons: {A: {bias: }}", "neurons: {A: {}}\nparameters:"])
def test_no_other_value_may_be_missing(text: str) -> None:
    with pytest.raises(nv.SpecError):
        nv.compile_text(f"neurovis: 1\nname: x\n{text}")


def test_what_the_page_allows_is_silent() -> None:
    (text,) = (block for block in BLOCKS if "neurovis: allow" in block)
    network = nv.compile_text(f"neurovis: 1\nname: x\nneurons: {{A: {{bias: 1}}}}\n{text}")
    assert network.warnings == ()


def test_an_expression_that_is_set_reads_the_values_before() -> None:
    run = nv.compile_text(
        "neurovis: 1\nname: x\nparameters: {gain: 1, other: 5}\nneurons: {A: {bias: gain}, B: {bias: other}}\n"
        "events: [{at: 1, set: {gain: 2*gain, other: gain}}, {at: 2, set: {other: gain}}]"
    ).run(3)
    assert (run["A"].tolist(), run["B"].tolist()) == ([1, 2, 2], [5, 1, 2])


def test_the_data_files_are_those_that_are_read() -> None:
    section = PAGE.partition("### Data files")[2].partition("\n### ")[0]
    assert tuple(re.findall(r"^\| `(\.\w+)`", section, re.MULTILINE)) == DATA_FILES
    assert f"{MOST_CELLS:,} cells" in section
    assert f"{LARGEST >> 20} MiB" in section


def test_links_within_the_page_lead_somewhere() -> None:
    titles = re.findall(r"^#+ (.*)$", PAGE, re.MULTILINE)
    anchors = {re.sub(r"[^\w -]", "", title).lower().replace(" ", "-") for title in titles}
    links = re.findall(r"\]\(#([\w-]+)\)", PAGE)
    assert len(links) > 20
    assert set(links) <= anchors
