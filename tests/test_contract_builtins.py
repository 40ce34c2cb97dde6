"""A package whose definitions have the names of built-in ones, or of another package's."""

from __future__ import annotations

from pathlib import Path

import pytest

from neurovis_spec import plugins
from neurovis_spec.compiler import builtin

THEIRS = """\
neurovis: 1
activations:
  tanh: {value: 2 * x}
  NAME: {value: x}
"""


@pytest.mark.parametrize("entry", ["acme", "zebra"])
def test_a_package_cannot_replace_a_built_in(entry: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Only a spec's own definitions replace built-in ones: wherever its entry point sorts, a package's is left out."""
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
    with pytest.warns(RuntimeWarning) as caught:
        libraries = builtin.libraries.__wrapped__()
    said = [str(warning.message) for warning in caught]
    assert len(said) == 2
    assert said[0].startswith(f"'tanh' in the activations of {entry}_lib/more.yaml is not used: neurovis_spec.library/")
    assert f"{entry}_lib/other.yaml is not used: {entry}_lib/more.yaml defines it" in said[1]
    ours = [library for library in libraries if "tanh" in library.activations]
    assert [library.source.span.file for library in ours] == ["builtin/activations.yaml"]
    assert sum("twofold" in library.activations for library in libraries) == 1
