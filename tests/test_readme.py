"""What the pages say is so: their examples compile and run, their links lead somewhere."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import neurovis_spec as nv
from neurovis_spec.cli.commands import COMMANDS
from neurovis_spec.diagnostics import show_text

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = [
    ROOT / name
    for name in (
        "README.md",
        "CONTRIBUTING.md",
        "CHANGELOG.md",
        "docs/architecture.md",
        "docs/bodies.md",
        "docs/editors.md",
        "docs/language.md",
        "docs/measures.md",
        "docs/ros.md",
        "docs/tables.md",
    )
]


def block(language: str) -> str:
    """The only block of this language in the README."""
    blocks = re.findall(r"^```(\w*)\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)
    (found,) = (text for name, text in blocks if name == language)
    return str(found)


def test_the_example_of_the_language_learns() -> None:
    network = nv.compile_text(block("yaml"))
    assert network.warnings == ()
    run = network.run()
    error = np.abs(run["T"] - run["O"])
    assert error[-126:].max() < 0.1 * error[:126].max()


def test_the_finding_is_what_a_misspelling_gets() -> None:
    with pytest.raises(nv.SpecError) as caught:
        nv.compile_text(block("yaml").replace("distance", "distence"), file="follow.yaml")
    assert block("") == show_text(caught.value.diagnostics, caught.value.sources).removesuffix("\n1 error")


def test_the_example_of_the_api_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "specs").symlink_to(ROOT / "specs")
    text = block("python")
    assert "steps=1_000_000)" in text
    exec(compile(text.replace("steps=1_000_000)", "steps=10_000)"), "README.md", "exec"), {})
    assert (tmp_path / "moving.svg").stat().st_size > (tmp_path / "step.svg").stat().st_size


def test_the_table_of_commands_names_each_once() -> None:
    """One that has commands of its own, a row for each of these."""
    assert list(dict.fromkeys(re.findall(r"^\| `neurovis (\w+) ?", README, re.MULTILINE))) == list(COMMANDS)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    for link in re.findall(r"\]\(([^)#]+)", page.read_text(encoding="utf-8")):
        assert link.startswith("https://") or (page.parent / link).exists(), link


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_nobody_is_sent_to_another_project(page: Path) -> None:
    assert not re.search(r"pip install neurovis(?!-spec)", page.read_text(encoding="utf-8"))


def test_what_is_somewhere_is_there() -> None:
    """Each row of the table names something, and a module in which it stands: of the core, or of the engines."""
    page = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    table = page.partition("## Where is")[2].partition("A new key is")[0]
    rows = [line for line in table.splitlines() if line.startswith("| ")][2:]
    assert len(rows) >= 10
    for row in rows:
        paths = re.findall(r"`([a-z_/]+(?:\.py|\.js|/))`", row)
        homes = ROOT / "neurovis_spec", ROOT / "layouts" / "neurovis_layouts"
        places = [home / path for path in paths for home in homes if (home / path).exists()]
        assert len(places) == len(paths), row
        source = "".join(place.read_text(encoding="utf-8") for place in places if place.is_file())
        assert source
        for name in re.findall(r"`((?:\w+\.)?\w+)`", re.sub(r"\.(py|js)`", "", row)):
            assert name.rpartition(".")[2] in source, f"{name} in {row}"
