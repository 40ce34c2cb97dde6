"""A package whose definitions have the names of built-in ones, or of another package's."""

from __future__ import annotations

from pathlib import Path

import pytest

import neurovis_spec as nv
from neurovis_spec import plugins
from neurovis_spec.compiler.checks import definitions as hidden
from neurovis_spec.compiler.values import builtin

THEIRS = """\
neurovis: 1
activations:
  tanh: {value: 2 * x}
  NAME: {value: x}
"""


@pytest.mark.parametrize("entry", ["acme", "zebra"])
def test_a_package_cannot_replace_a_built_in(entry: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Only a spec's own definitions replace built-in ones: wherever its entry point sorts, a package's is left out."""
    builtin.builtin_definitions()  # kept by the process: what is installed here only for a moment must not be
    package = tmp_path / f"{entry}_lib"
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "more.yaml").write_text(THEIRS.replace("NAME", "twofold"), encoding="utf-8")
    (package / "other.yaml").write_text(THEIRS.replace("NAME", "twofold").replace("tanh", "half"), encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(plugins, "names", lambda group: tuple(sorted((entry, builtin.OURS))))
    monkeypatch.setattr(
        plugins, "package", lambda group, name: f"{name}_lib" if name == entry else "neurovis_spec.library"
    )
    found = builtin.installed.__wrapped__()
    libraries = found.libraries
    assert set(found.hidden) == {("activations", "tanh"), ("activations", "twofold")}
    assert found.hidden["activations", "tanh"].place == f"{entry}_lib/more.yaml"
    assert found.hidden["activations", "tanh"].owner.startswith("neurovis_spec.library/")
    assert found.hidden["activations", "twofold"] == (f"{entry}_lib/more.yaml", f"{entry}_lib/other.yaml")
    ours = [library for library in libraries if "tanh" in library.activations]
    assert [library.source.span.file for library in ours] == ["builtin/activations.yaml"]
    assert sum("twofold" in library.activations for library in libraries) == 1
    monkeypatch.setattr(hidden, "installed", lambda: found)
    network = nv.compile_text(
        "neurovis: 1\nname: x\nmodules: {m: {neurons: {A: {activation: tanh, bias: 1}}}}\ninstances: {a: {module: m}}\n"
        "neurons: {B: {activation: sin, bias: 1}}\n"
    )
    (told,) = network.warnings
    assert (told.code, told.span.line) == ("hidden-definition", 3)
    assert f"{entry}_lib/more.yaml defines one, too, which is not used" in told.message
    allowed = "neurons:\n  A: {activation: tanh, bias: 1}   # neurovis: allow hidden-definition\n"
    assert not nv.compile_text("neurovis: 1\nname: x\n" + allowed).warnings
    own = nv.compile_text(
        "neurovis: 1\nname: x\nactivations: {tanh: {value: x}}\nneurons: {A: {activation: tanh, bias: 1}}\n"
    )
    assert [one.code for one in own.warnings] == ["replaces-builtin"]


def test_a_source_tree_that_is_not_installed_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    """Built-ins are found through entry points; without any a spec fails at the first name that it takes from them."""
    monkeypatch.setattr(plugins, "names", lambda group: ())
    with pytest.raises(plugins.PluginError, match="not installed here, only found on the path: run 'pip install"):
        builtin.installed.__wrapped__()
