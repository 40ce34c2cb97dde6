"""The tour, docs/tour.ipynb: all of its cells run, in a kernel, and show what they say."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

DOCS = Path(__file__).parents[1] / "docs"
WIDGET = "application/vnd.jupyter.widget-view+json"


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory) -> list[Mapping[str, object]]:
    """The cells with code, with their outputs."""
    notebook = nbformat.read(DOCS / "tour.ipynb", as_version=4)  # type: ignore[no-untyped-call]
    own = str(tmp_path_factory.mktemp("kernel"))
    client = NotebookClient(notebook, timeout=120, resources={"metadata": {"path": str(DOCS)}})
    client.execute(env={**os.environ, "IPYTHONDIR": own, "JUPYTER_RUNTIME_DIR": own})
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


def outputs(ran: list[Mapping[str, object]], source: str) -> list[dict[str, object]]:
    """What the cell that holds this line gives."""
    (cell,) = [cell for cell in ran if source in str(cell["source"]).split("\n")]
    found = cell["outputs"]
    assert isinstance(found, list)
    return found


def test_a_network_a_layout_and_a_figure_are_pictures(ran: list[Mapping[str, object]]) -> None:
    for line in ("network", 'network.layout("circular")', "hexapod.layout()", 'SVG(filename=out / "figure.svg")'):
        data = outputs(ran, line)[-1]["data"]
        assert isinstance(data, dict)
        assert str(data["image/svg+xml"]).lstrip().startswith("<svg")


def test_a_recording_and_a_live_view_are_widgets(ran: list[Mapping[str, object]]) -> None:
    for line in ("recording", "view", "nv.compile_text(SPEC + EVENTS).run()"):
        data = outputs(ran, line)[-1]["data"]
        assert isinstance(data, dict)
        assert WIDGET in data


def test_the_mistake_is_shown_as_findings(ran: list[Mapping[str, object]]) -> None:
    (found,) = outputs(ran, 'nv.compile_text(SPEC.replace("distance", "distence").replace("rate: eta", "rate: etta"))')
    (told,) = found["traceback"] if isinstance(found["traceback"], list) else []
    assert "did you mean 'distance'?" in told
    assert "2 errors" in told


def test_numbers_are_as_the_text_says(ran: list[Mapping[str, object]]) -> None:
    said = "".join(str(output.get("text", "")) for cell in ran for output in cell["outputs"])  # type: ignore[attr-defined]
    assert "(2000,) (2000, 4)" in said
    assert "eta is now 0.02" in said
    assert "learned after" in said
    assert "0 0.3 False" in said


def test_nothing_stays_behind_in_it() -> None:
    """The notebook is kept without outputs, so that none of them can be old."""
    notebook = nbformat.read(DOCS / "tour.ipynb", as_version=4)  # type: ignore[no-untyped-call]
    assert all(not cell.outputs and cell.execution_count is None for cell in notebook.cells if cell.cell_type == "code")
