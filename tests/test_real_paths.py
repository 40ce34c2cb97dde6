"""Symbolic links that lead round in a circle: whatever path of an author's they are on, that is said."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest
from click.testing import CliRunner
from small_specs import SMALL

import neurovis_spec as nv
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.real_paths import is_circular, real_path

ROOT = Path(__file__).parent.parent
ROUND = "lead round in a circle"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """With small.yaml, and two links to each other for each suffix."""
    monkeypatch.chdir(tmp_path)
    Path("small.yaml").write_text(SMALL, encoding="utf-8")
    for suffix in ("", ".yaml", ".npz", ".csv", ".mcap", ".svg"):
        Path(f"a{suffix}").symlink_to(f"b{suffix}")
        Path(f"b{suffix}").symlink_to(f"a{suffix}")
    return tmp_path


SAID = {
    "validate a.yaml": ROUND,
    "run small.yaml -o a.npz": ROUND,
    "run small.yaml -o a/x.npz": ROUND,
    "run small.yaml --checkpoint a": ROUND,
    "run small.yaml --from a.npz": ROUND,
    "run small.yaml --input push=a.csv": ROUND,
    "run small.yaml --body a.yaml": ROUND,
    "run a.yaml": ROUND,
    "run a/x.yaml": ROUND,
    "fmt a.yaml": ROUND,
    "validate reads.yaml": ROUND,
    "validate includes.yaml": ROUND,
    "sweep small.yaml --over seed=0..1 --metric mean(Y) -o a.csv": ROUND,
    "sweep small.yaml --over seed=0..1 --metric mean(Y) --body a.yaml": ROUND,
    "analyze small.yaml -o a": ROUND,
    "render small.yaml -o a.svg": ROUND,
    "render small.yaml --recording a.npz -o x.svg": ROUND,
    "animate small.yaml -o a.svg": ROUND,
    "layout small.yaml -o a.yaml": ROUND,
    "layout small.yaml --update a.yaml": ROUND,
    "export small.yaml --to c -o a": ROUND,
    "export small.yaml --to c -o a/x": ROUND,
    "ros export small.yaml -o a": ROUND,
    "ros play a.mcap": ROUND,
    "live small.yaml --recording a.npz": ROUND,
    "new a": ROUND,
}


@pytest.mark.parametrize("line", SAID)
def test_links_in_a_circle_are_told(folder: Path, line: str) -> None:
    group = "neurovis: 1\nname: x\nneurons: {N: {count: 2}}\n"
    Path("reads.yaml").write_text(f"{group}connections: {{N -> N: {{matrix: {{file: a.csv}}}}}}\n", encoding="utf-8")
    Path("includes.yaml").write_text(f"include: [a.yaml]\n{group}", encoding="utf-8")
    before = sorted(folder.iterdir())
    result = CliRunner().invoke(neurovis, line.split())
    assert isinstance(result.exception, SystemExit), result.exception
    assert result.exit_code == 1
    assert SAID[line] in result.stderr
    assert sorted(folder.iterdir()) == before
    assert all(path.is_symlink() for path in before if path.stem in "ab")


def test_what_python_saves_goes_round_no_circle(folder: Path) -> None:
    network = nv.compile("small.yaml")
    for save in (network.run(3).save, network.layout().save, network.render):
        with pytest.raises(OSError, match=ROUND):
            save("a.svg" if save == network.render else "a.npz")
    assert Path("a.npz").is_symlink()


def test_a_path_leads_where_links_lead_and_none_in_a_circle_is_followed(folder: Path) -> None:
    Path("link.yaml").symlink_to("small.yaml")
    assert real_path("link.yaml") == folder.resolve() / "small.yaml"
    assert real_path("absent/../x") == folder.resolve() / "x"
    assert real_path("a.csv").name in ("a.csv", "b.csv")
    assert [is_circular(Path(name)) for name in ("a", "a/x", "link.yaml", "absent")] == [True, True, False, False]


def test_no_path_of_an_author_is_resolved_otherwise() -> None:
    """``Path.resolve`` raises RuntimeError for such links."""
    own = {"bodies/neurovis_bodies/gymnasium.py"}  # where packages are installed
    for part in ("neurovis_spec", "layouts", "renderers", "bodies"):
        for path in (ROOT / part).rglob("*.py"):
            source = path.read_text(encoding="utf-8")
            if ".resolve(" in source and str(path.relative_to(ROOT)) not in own:
                calls = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Attribute)]
                assert "resolve" not in [node.attr for node in calls], path
