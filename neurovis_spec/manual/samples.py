"""Examples of the keys, from ``examples.yaml`` beside this module.

In: the path of a key. Out: a part of a spec that shows it. The tests compile every one of them.
"""

from __future__ import annotations

from functools import cache
from importlib.resources import files

from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.yaml.reader import read_text
from neurovis_spec.language.yaml.source import Mapping, Scalar


@cache
def examples() -> dict[str, str]:
    """Path of a key to a part of a spec, in the order of the file."""
    text = files("neurovis_spec.manual").joinpath("examples.yaml").read_text(encoding="utf-8")
    findings = Findings()
    document = read_text(text, "examples.yaml", findings)
    findings.check()
    assert document is not None
    assert isinstance(document.root, Mapping)
    return {
        entry.name: str(entry.value.value).rstrip()
        for entry in document.root.entries
        if isinstance(entry.value, Scalar)
    }


def example(path: str) -> str | None:
    """The example of a key, else that of its section; none where there is nothing to show."""
    while path:
        found = examples().get(path)
        if found is not None:
            return found
        path = path.rpartition(".")[0]
    return None
