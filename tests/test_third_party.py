"""One of each, added as a third party would: the package of ``docs/architecture.md``, found through entry points alone.

The page's examples are written to a folder as an installed distribution, and each is used through the command line
of a process that has this folder on its path.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

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


def call(site: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    path = os.pathsep.join([str(site), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, "-m", "neurovis_spec", *arguments]
    return subprocess.run(command, cwd=site, capture_output=True, text=True, env={**os.environ, "PYTHONPATH": path})


def good(site: Path, *arguments: str) -> str:
    done = call(site, *arguments)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


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


def test_an_activation_and_a_rule(site: Path) -> None:
    assert good(site, "validate", "guest.yaml") == "guest.yaml: ok (2 neurons, 2 connections)\n"
    good(site, "run", "guest.yaml", "-o", "guest.csv")
    table = np.loadtxt(site / "guest.csv", delimiter=",", skiprows=1)
    a, b, weight = table[:, 2], table[:, 3], table[:, 4]
    drive = weight * a + 0.25 * np.concatenate([[0], b[:-1]])
    np.testing.assert_allclose(b, drive / (1 + np.exp(-2 * drive)), rtol=0, atol=1e-12)
    np.testing.assert_allclose(np.diff(weight), -0.1 * (a * b)[:-1], rtol=0, atol=1e-12)
    assert weight[0] == 0.5


def test_new_names_are_among_the_suggestions(site: Path) -> None:
    (site / "typo.yaml").write_text(SPEC.replace("swish", "swihs"), encoding="utf-8")
    done = call(site, "validate", "typo.yaml")
    assert done.returncode == 1
    assert "did you mean 'swish'?" in done.stderr


def test_a_layout_engine(site: Path) -> None:
    assert "engine: diagonal" in good(site, "layout", "guest.yaml", "--engine", "diagonal")
    assert json.loads(good(site, "layout", "guest.yaml", "--engine", "diagonal", "--metrics"))["neurons"] == 2
    in_spec = SPEC + "layout: {engine: diagonal}\n"
    (site / "placed.yaml").write_text(in_spec, encoding="utf-8")
    text = good(site, "layout", "placed.yaml")
    assert re.search(r"A: \[0, 0\]", text)
    assert re.search(r"B: \[1, 1\]", text)
    good(site, "render", "placed.yaml", "-o", "placed.svg")
    assert (site / "placed.svg").read_text(encoding="utf-8").count("data-connection=") == 2


def test_a_layout_engine_is_asked_for_no_more_than_it_declares(site: Path) -> None:
    pinned = SPEC + "layout: {engine: diagonal, positions: {A: [3, 3]}}\n"
    (site / "pinned.yaml").write_text(pinned, encoding="utf-8")
    done = call(site, "layout", "pinned.yaml")
    assert (done.returncode, done.stdout) == (1, "")
    assert "error[layout-pins-unsupported]: the engine 'diagonal' cannot keep pinned positions" in done.stderr


def test_a_renderer(site: Path) -> None:
    good(site, "render", "guest.yaml", "-o", "guest.tsv", "--step", "0")
    title, *lines = (site / "guest.tsv").read_text(encoding="utf-8").splitlines()
    assert "guest" in title
    assert [line.split("\t")[0] for line in lines] == ["A", "B"]
    assert lines[0].split("\t")[-1] == "#969696", "A is 0 at step 0"
    done = call(site, "animate", "guest.yaml", "-o", "guest.tsv")
    assert done.returncode == 1
    assert "films" in done.stderr


def test_a_backend(site: Path) -> None:
    lines = good(site, "run", "--backend", "list").splitlines()
    note = "slow: computes everything twice and compares; the numbers of the reference up to rounding"
    assert f"checked available {note}" in lines
    assert "backend checked" in good(site, "run", "guest.yaml", "--backend", "checked", "-o", "checked.csv")
    good(site, "run", "guest.yaml", "--backend", "numpy", "-o", "numpy.csv")
    assert (site / "checked.csv").read_bytes() == (site / "numpy.csv").read_bytes()


def test_a_format(site: Path) -> None:
    good(site, "run", "guest.yaml", "-o", "guest.json")
    assert json.loads((site / "guest.json").read_text(encoding="utf-8"))["neurons"] == ["A", "B"]
    good(site, "render", "guest.yaml", "--recording", "guest.json", "--step", "5", "-o", "a.svg")
    good(site, "render", "guest.yaml", "--step", "5", "-o", "b.svg")
    assert (site / "a.svg").read_bytes() == (site / "b.svg").read_bytes()
    (site / "other.json").write_text("{}", encoding="utf-8")
    done = call(site, "render", "guest.yaml", "--recording", "other.json", "-o", "c.svg")
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr.startswith("error: other.json: no recording")


def test_a_body(site: Path) -> None:
    body = "outputs: {back: B}\nbody: {cart: '4', substeps: 3, sensors: {push: place}, actuators: {push: -back}}\n"
    (site / "cart.yaml").write_text(SPEC.replace("{push: {expression: sin(k)}}", "{push: {}}") + body, encoding="utf-8")
    assert good(site, "validate", "cart.yaml") == "cart.yaml: ok (2 neurons, 2 connections)\n"
    shown = good(site, "inspect", "cart.yaml")
    assert "place  1     m     push" in shown
    assert "push  1     N     -1 … 1  -back" in shown
    good(site, "run", "cart.yaml", "-o", "cart.csv")
    table = np.genfromtxt(site / "cart.csv", delimiter=",", names=True)
    (place,) = (name for name in table.dtype.names or () if name.endswith("place"))
    assert 0.1 < table[place][0] < 0.2
    np.testing.assert_array_equal(table["A"], table[place])
    (site / "slip.yaml").write_text((site / "cart.yaml").read_text().replace("push: place", "push: plaec"))
    done = call(site, "validate", "slip.yaml")
    assert "error[unknown-sensor]: the body has no sensor 'plaec'" in done.stderr
    assert "did you mean 'place'?" in done.stderr
    (site / "soft.yaml").write_text((site / "cart.yaml").read_text().replace("'4'", "soft"))
    assert "error[bad-body]: 'soft' is no stiffness" in call(site, "validate", "soft.yaml").stderr
