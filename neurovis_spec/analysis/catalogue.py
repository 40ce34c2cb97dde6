"""The catalogue of the measures: what each is called, says, computes, and comes from.

In: ``catalogue.yaml`` beside this module. Out: frozen entries, in order; the page of ``neurovis analyze`` and
docs/measures.md are made from them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import yaml

INTRODUCTION = """# Measures

What the NeuroVis paper measures, and each technique of its Table 1 that measures something, is one call here.
`neurovis analyze SPEC -o FOLDER` makes them all into tables (CSV and JSON), pictures (SVG) and a page that says what
they mean (it needs the extra `analyze`); with `--format json` it prints the tables and what is said of them as one
object, too: `measures`, each with its `notes`, `tables` (as in their JSON files) and `pictures`. In Python each takes
a recording, or a compiled network where it has to run it, and returns a named array: `table["K2", "K3"]`,
`table.row("K2")`, `table.column("last")`, `numpy.asarray(table)`.
`of` chooses neurons (`"K"`, `"C + K"`, `["K1", "O"]`), `start` and `stop` choose steps. The folder of
`neurovis analyze` is `neurovis_spec.analysis.report.analyze(network, folder, recording)`, the object `measure(network,
recording).plain`.

The examples are of use case 1, the last twenty periods, and, where neurons spike, of the one that hears where a sound
is. They are tested:

```python
>>> import neurovis_spec as nv
>>> from neurovis_spec import analysis
>>> network = nv.compile("specs/cpg_rbf.yaml")
>>> recording = network.run()
>>> late = 12_000 - 2_572
>>> sound = nv.compile("specs/sound.yaml").run()

```
"""


@dataclass(frozen=True)
class Measure:
    """``technique`` is what Table 1 of the paper calls it, '' where it is from elsewhere in the paper."""

    key: str
    title: str
    technique: str
    equation: str
    source: str
    meaning: str
    example: str


@cache
def catalogue() -> dict[str, Measure]:
    """All measures by key."""
    entries = yaml.safe_load(Path(__file__).with_name("catalogue.yaml").read_text(encoding="utf-8"))
    return {
        key: Measure(key, **{name: str(text).strip() for name, text in entry.items()}) for key, entry in entries.items()
    }


def document() -> str:
    """docs/measures.md."""
    lines = [INTRODUCTION]
    lines += ["| measure | in Table 1 of the paper | equation |", "| --- | --- | --- |"]
    for one in catalogue().values():
        anchor = one.title.lower().replace(" ", "-").replace(",", "")
        lines.append(
            f"| [{one.title}](#{anchor}) | {one.technique or '–'} | `{one.equation.replace('|', chr(92) + '|')}` |"
        )
    for one in catalogue().values():
        called = f" Table 1 calls it *{one.technique}*." if one.technique else ""
        lines += ["", f"## {one.title}", "", one.meaning, "", f"`{one.equation}`", "", f"Source: {one.source}.{called}"]
        lines += ["", "```python", one.example, "", "```"]
    return "\n".join(lines) + "\n"
