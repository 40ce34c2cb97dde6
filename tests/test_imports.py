"""How circles of imports are found (``make test`` holds the contracts), and how little is imported: a quick start."""

from __future__ import annotations

import ast
import builtins
import re
import subprocess
import sys
from pathlib import Path

import pytest
from acyclic import AcyclicContract
from grimp import ImportGraph

from neurovis_spec.cli.commands import COMMANDS

ROOT = Path(__file__).parents[1]
HEAVY = {"numpy", "pydantic", "networkx", "yaml", "scipy", "PIL", "rich", "neurovis_layouts", "neurovis_renderers"}


def loaded(code: str) -> set[str]:
    """The modules that a fresh interpreter has after running ``code``."""
    shown = "\nimport sys\nprint('\\n'.join(sys.modules), file=sys.stderr)"
    done = subprocess.run([sys.executable, "-c", code + shown], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return set(done.stderr.split())


def command(*arguments: str) -> str:
    """Code that runs the command line and goes on."""
    return (
        "from neurovis_spec.cli.commands import neurovis\n"
        f"try: neurovis.main({list(arguments)!r}, prog_name='neurovis')\n"
        "except SystemExit as end: assert not end.code, end"
    )


def test_a_circle_of_imports_is_found_and_named(capsys: pytest.CaptureFixture[str]) -> None:
    graph = ImportGraph()
    for importer, imported, line in (("a.x", "a.y", 3), ("a.y", "b", 5), ("b", "a.x", 7), ("b", "c", 8), ("d", "d", 1)):
        graph.add_import(importer=importer, imported=imported, line_number=line, line_contents="")
    contract = AcyclicContract("none", {}, {})
    broken = contract.check(graph, verbose=False)
    contract.render_broken_contract(broken)
    assert not broken.kept
    assert capsys.readouterr().out.splitlines() == [
        "These modules import each other: a.x <-> a.y <-> b",
        "- a.x -> a.y (line 3)",
        "- a.y -> b (line 5)",
        "- b -> a.x (line 7)",
        "",
    ]


def test_importing_the_package_imports_next_to_nothing() -> None:
    modules = loaded("import neurovis_spec\nneurovis_spec.__version__")
    assert {name for name in modules if name.startswith("neurovis_")} == {"neurovis_spec", "neurovis_spec.version"}
    assert not modules & (HEAVY | {"click", "importlib.metadata"})


def test_help_and_version_import_no_command_and_list_no_entry_point() -> None:
    for option in ("--help", "--version"):
        modules = loaded(command(option))
        assert not modules & (HEAVY | {"importlib.metadata"})
        assert not {f"neurovis_spec.cli.{name}" for name in COMMANDS} & modules


@pytest.mark.parametrize("name", COMMANDS)
def test_the_help_of_a_command_imports_nothing_heavy(name: str) -> None:
    assert not loaded(command(name, "--help")) & (HEAVY | {"importlib.metadata"})


def test_validating_imports_nothing_that_runs_lays_out_or_draws() -> None:
    """The engine that the spec names is asked what it can do, by the problem, for which nothing is loaded that lays
    out."""
    modules = loaded(command("validate", "specs/cpg_rbf.yaml"))
    assert not modules & {"networkx", "scipy", "PIL", "rich", "neurovis_renderers"}
    assert {name for name in modules if name.startswith("neurovis_layouts.")} == {"neurovis_layouts.layered"}
    later = ("runtime.", "layout.", "scene.", "describe")
    parts = ("engines", "foreseen", "geometry", "labels", "makes", "model", "naming", "problem", "refusals")
    asking = {f"layout.{name}" for name in parts}
    found = {name.removeprefix("neurovis_spec.") for name in modules}
    assert not {name for name in found if name.startswith(later)} - asking


def test_validating_asks_no_engine_where_the_spec_names_none() -> None:
    modules = loaded(command("validate", "specs/hebbian.yaml"))
    assert not {name for name in modules if name.startswith(("neurovis_layouts", "neurovis_spec.layout"))}


def test_validating_imports_no_more_than_the_spec_needs() -> None:
    """This spec has no events, no body, no comment that allows, one table as ``.csv`` and no mistake."""
    modules = loaded(command("validate", "specs/cpg_rbf.yaml"))
    kinds = {f"neurovis_spec.language.data.{kind}" for kind in ("edge_list", "mtx", "npy")}
    own = {f"neurovis_spec.{name}" for name in ("compiler.events.events", "compiler.body_settings", "language.allow")}
    assert not modules & (kinds | own | {"difflib", "json", "numpy.ma"})


def test_a_command_looks_for_no_plug_in_of_pydantic(tmp_path: Path) -> None:
    """That would read what every installed package says of itself, before each command."""
    folder = tmp_path / "acme-1.dist-info"
    folder.mkdir()
    (folder / "METADATA").write_text("Name: acme\nVersion: 1\n", encoding="utf-8")
    (folder / "entry_points.txt").write_text("[pydantic]\nacme = acme_plugin\n", encoding="utf-8")
    (tmp_path / "acme_plugin.py").write_text("new_schema_validator = lambda *_: (None, None, None)\n", encoding="utf-8")
    found = f"import sys\nsys.path.insert(0, {str(tmp_path)!r})\n"
    assert "acme_plugin" in loaded(f"{found}import neurovis_spec.language.spec")
    called = "sys.argv[1:] = ['schema']\nfrom neurovis_spec.cli import main\ntry: main()\nexcept SystemExit: pass"
    assert "acme_plugin" not in loaded(found + called)


def test_running_imports_nothing_that_lays_out_or_draws() -> None:
    modules = loaded(command("run", "specs/ring.yaml", "--steps", "3"))
    assert not modules & {"networkx", "scipy", "PIL", "rich", "neurovis_layouts", "neurovis_renderers"}


def test_the_public_names_are_there_and_an_unknown_one_is_not() -> None:
    import neurovis_spec

    for name in neurovis_spec.__all__:
        assert getattr(neurovis_spec, name) is not None
    with pytest.raises(AttributeError, match="compil_text"):
        neurovis_spec.compil_text  # noqa: B018


def test_every_public_name_is_found_where_it_is_looked_for() -> None:
    """The names that types are checked with are those that an import gives."""
    import neurovis_spec

    assert set(neurovis_spec._HOMES) | {"__version__"} == set(neurovis_spec.__all__)


#: What an author calls: what it says that it raises can be caught as ``nv.NAME``.
CALLED = (
    "api", "compiled", "keywords", "pipeline", "runtime/recorder", "runtime/recording", "runtime/simulation",
    "sweeps/sweep", "sweeps/table",
)  # fmt: skip


def docstrings(module: str) -> str:
    """Those of what is public in a module."""
    tree = ast.parse((ROOT / "neurovis_spec" / f"{module}.py").read_text(encoding="utf-8"))
    public = [
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef)
        and not (isinstance(node, ast.FunctionDef) and re.match(r"_[^_]", node.name))
    ]
    return "\n".join(ast.get_docstring(node) or "" for node in public)


def test_every_name_that_the_docs_say_is_there() -> None:
    import neurovis_spec

    pages = [ROOT / "README.md", *(ROOT / "docs").glob("*.md"), *(ROOT / "docs").glob("*.ipynb")]
    texts = {path.name: path.read_text(encoding="utf-8") for path in pages}
    texts |= {module: docstrings(module) for module in CALLED}
    missing = {
        f"{where}: {name}"
        for where, text in texts.items()
        for name in re.findall(r"\b(?:nv|neurovis_spec)\.([A-Za-z_]\w*)\b(?![/.])", text)
        if not hasattr(neurovis_spec, name) and not (ROOT / "neurovis_spec" / name).exists()
    }
    missing |= {
        f"{where}: {name}"
        for where, text in texts.items()
        for name in re.findall(r"\b[A-Z]\w*Error\b", text)
        if not hasattr(neurovis_spec, name) and not hasattr(builtins, name)
    }
    assert missing == {"live.md: TraitError"}  # of traitlets
