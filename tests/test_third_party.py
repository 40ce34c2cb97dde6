"""One of each, added as a third party would: the package of ``docs/architecture.md``, found through entry points alone.

The page's examples are written to a folder as an installed distribution, and each is used through the command line,
with this folder on the path; once in a process of its own.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from plugged import call, plugged

import neurovis_spec as nv

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "architecture.md"
EXAMPLE = re.compile(r"^`([\w./]+)`\n\n```\w+\n(.*?)^```$", re.MULTILINE | re.DOTALL)
SPEC = """\
neurovis: 1
name: guest
time: {steps: 12}
inputs: {push: {expression: sin(k)}}
neurons: {A: {input: push}, B: {activation: {swish: {beta: 2}}}}
connections:
  A -> B: {weight: 0.5, delay: 0, plasticity: {unlearning: {rate: 0.1}}}
  B -> B: 0.25
"""


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the distribution ``acme``, as an installer leaves it, and ``guest.yaml``."""
    folder = tmp_path_factory.mktemp("site")
    for path, content in EXAMPLE.findall(PAGE.read_text(encoding="utf-8")):
        target = folder / ("acme-1.0.dist-info" if path == "entry_points.txt" else "") / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(content, encoding="utf-8")
    (folder / "acme" / "__init__.py").touch()
    metadata = "Metadata-Version: 2.1\nName: acme\nVersion: 1.0\n"
    (folder / "acme-1.0.dist-info" / "METADATA").write_text(metadata, encoding="utf-8")
    (folder / "guest.yaml").write_text(SPEC, encoding="utf-8")
    return folder


@pytest.fixture
def installed(site: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The folder, found in this process as well."""
    with plugged(site, monkeypatch):
        yield site


def good(*arguments: str) -> str:
    done = call(*arguments)
    assert (done.exit_code, done.stderr) == (0, "")
    return done.stdout


def test_in_a_process_of_its_own_it_is_found_as_well(site: Path) -> None:
    path = os.pathsep.join([str(site), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, "-m", "neurovis_spec", "validate", "guest.yaml"]
    done = subprocess.run(command, cwd=site, capture_output=True, text=True, env={**os.environ, "PYTHONPATH": path})
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == "guest.yaml: ok (2 neurons, 2 connections)\n"


def test_the_page_has_one_of_each(site: Path) -> None:
    points = (site / "acme-1.0.dist-info" / "entry_points.txt").read_text(encoding="utf-8")
    groups = re.findall(r"^\[(.*)\]$", points, re.MULTILINE)
    assert groups == [
        f"neurovis.{kind}" for kind in ("libraries", "layouts", "renderers", "backends", "formats", "bodies")
    ]


def test_without_the_package_nothing_of_it_is_known(site: Path) -> None:
    with pytest.raises(nv.SpecError) as caught:
        nv.compile(site / "guest.yaml")
    assert "unknown-activation" in {found.code for found in caught.value.diagnostics}


def test_an_activation_and_a_rule(installed: Path) -> None:
    assert good("validate", "guest.yaml") == "guest.yaml: ok (2 neurons, 2 connections)\n"
    good("run", "guest.yaml", "-o", "guest.csv")
    table = np.loadtxt(installed / "guest.csv", delimiter=",", skiprows=1)
    a, b, weight = table[:, 2], table[:, 3], table[:, 4]
    drive = weight * a + 0.25 * np.concatenate([[0], b[:-1]])
    np.testing.assert_allclose(b, drive / (1 + np.exp(-2 * drive)), rtol=0, atol=1e-12)
    np.testing.assert_allclose(np.diff(weight), -0.1 * (a * b)[:-1], rtol=0, atol=1e-12)
    assert weight[0] == 0.5


def test_new_names_are_among_the_suggestions(installed: Path) -> None:
    (installed / "typo.yaml").write_text(SPEC.replace("swish", "swihs"), encoding="utf-8")
    done = call("validate", "typo.yaml")
    assert done.exit_code == 1
    assert "did you mean 'swish'?" in done.stderr


def test_a_layout_engine(installed: Path) -> None:
    assert "engine: diagonal" in good("layout", "guest.yaml", "--engine", "diagonal")
    assert json.loads(good("layout", "guest.yaml", "--engine", "diagonal", "--metrics"))["neurons"] == 2
    in_spec = SPEC + "layout: {engine: diagonal}\n"
    (installed / "placed.yaml").write_text(in_spec, encoding="utf-8")
    text = good("layout", "placed.yaml")
    assert re.search(r"A: \[0, 0\]", text)
    assert re.search(r"B: \[1, 1\]", text)
    good("render", "placed.yaml", "-o", "placed.svg")
    assert (installed / "placed.svg").read_text(encoding="utf-8").count("data-connection=") == 2


def test_a_layout_engine_is_asked_for_no_more_than_it_declares(installed: Path) -> None:
    pinned = SPEC + "layout: {engine: diagonal, positions: {A: [3, 3]}}\n"
    (installed / "pinned.yaml").write_text(pinned, encoding="utf-8")
    done = call("layout", "pinned.yaml")
    assert (done.exit_code, done.stdout) == (1, "")
    assert "error[layout-pins-unsupported]: the engine 'diagonal' cannot keep pinned positions" in done.stderr


def test_a_renderer(installed: Path) -> None:
    good("render", "guest.yaml", "-o", "guest.tsv", "--step", "0")
    title, *lines = (installed / "guest.tsv").read_text(encoding="utf-8").splitlines()
    assert "guest" in title
    assert [line.split("\t")[0] for line in lines] == ["A", "B"]
    assert lines[0].split("\t")[-1] == "#969696", "A is 0 at step 0"
    done = call("animate", "guest.yaml", "-o", "guest.tsv")
    assert done.exit_code == 1
    assert "films" in done.stderr


def test_a_backend(installed: Path) -> None:
    lines = good("run", "--backend", "list").splitlines()
    note = "slow: computes everything twice and compares; the numbers of the reference up to rounding"
    assert f"checked available {note}" in lines
    assert "backend checked" in good("run", "guest.yaml", "--backend", "checked", "-o", "checked.csv")
    good("run", "guest.yaml", "--backend", "numpy", "-o", "numpy.csv")
    assert (installed / "checked.csv").read_bytes() == (installed / "numpy.csv").read_bytes()


def test_a_format(installed: Path) -> None:
    good("run", "guest.yaml", "-o", "guest.json")
    assert json.loads((installed / "guest.json").read_text(encoding="utf-8"))["neurons"] == ["A", "B"]
    good("render", "guest.yaml", "--recording", "guest.json", "--step", "5", "-o", "a.svg")
    good("render", "guest.yaml", "--step", "5", "-o", "b.svg")
    assert (installed / "a.svg").read_bytes() == (installed / "b.svg").read_bytes()
    (installed / "other.json").write_text("{}", encoding="utf-8")
    done = call("render", "guest.yaml", "--recording", "other.json", "-o", "c.svg")
    assert (done.exit_code, done.stdout) == (1, "")
    assert done.stderr.startswith("error: other.json: no recording")


def test_a_body(installed: Path) -> None:
    body = "outputs: {back: B}\nbody: {cart: '4', substeps: 3, sensors: {push: place}, actuators: {push: -back}}\n"
    cart = SPEC.replace("{push: {expression: sin(k)}}", "{push: {}}") + body
    (installed / "cart.yaml").write_text(cart, encoding="utf-8")
    assert good("validate", "cart.yaml") == "cart.yaml: ok (2 neurons, 2 connections)\n"
    shown = good("inspect", "cart.yaml")
    assert "place  1     m     push" in shown
    assert "push  1     N     -1 … 1  -back" in shown
    good("run", "cart.yaml", "-o", "cart.csv")
    table = np.genfromtxt(installed / "cart.csv", delimiter=",", names=True)
    (place,) = (name for name in table.dtype.names or () if name.endswith("place"))
    assert 0.1 < table[place][0] < 0.2
    np.testing.assert_array_equal(table["A"], table[place])
    (installed / "slip.yaml").write_text((installed / "cart.yaml").read_text().replace("push: place", "push: plaec"))
    done = call("validate", "slip.yaml")
    assert "error[unknown-sensor]: the body has no sensor 'plaec'" in done.stderr
    assert "did you mean 'place'?" in done.stderr
    (installed / "soft.yaml").write_text((installed / "cart.yaml").read_text().replace("'4'", "soft"))
    assert "error[bad-body]: 'soft' is no stiffness" in call("validate", "soft.yaml").stderr
