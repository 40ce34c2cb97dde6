"""The page: what was measured, in plain words, with its pictures, as one HTML file that opens offline.

In: readings with their entries of the catalogue. Out: the bytes of the page. It is made by jinja2 (the extra
``analyze``) from ``page.html`` beside this module.
"""

from __future__ import annotations

import math
from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from neurovis_spec.analysis.catalogue import Measure
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.runtime.named_array import NamedArray
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.scene.model import Theme
from neurovis_spec.scene.texts import number
from neurovis_spec.version import __version__

if TYPE_CHECKING:
    import jinja2

PAGE = "index.html"
#: The longest table that the page shows.
_ROWS, _COLUMNS, _PAIRS = 14, 8, 3


@dataclass(frozen=True)
class Shown:
    """A measure, and what it found."""

    measure: Measure
    tables: Mapping[str, NamedArray]
    pictures: Mapping[str, bytes]
    notes: tuple[str, ...]

    @property
    def images(self) -> list[tuple[str, str]]:
        """The pictures, each its name and itself as a URL."""
        kind = "data:image/svg+xml;base64,"
        return [(name, kind + b64encode(content).decode()) for name, content in self.pictures.items()]

    @property
    def short(self) -> list[NamedArray]:
        """The tables that are short enough for the page."""
        found = [table for table in self.tables.values() if table.rows.name != table.columns.name]
        return [t for t in found if 0 < len(t.rows.labels) <= _ROWS and 0 < len(t.columns.labels) <= _COLUMNS
                and t.columns.name == "quantity"]  # fmt: skip

    @property
    def said(self) -> list[str]:
        """The pairs with the largest numbers."""
        return [
            line for table in self.tables.values() if table.rows == table.columns for line in [largest(table)] if line
        ]


def largest(table: NamedArray) -> str:
    """The pairs of different neurons with the largest numbers, in words."""
    values, names = table.values, table.rows.labels
    places = [(i, j) for i in range(len(names)) for j in range(i) if math.isfinite(values[i, j]) and values[i, j]]
    if not places:
        return ""
    places.sort(key=lambda at: -abs(float(values[at])))
    unit = f" {table.unit}" if table.unit else ""
    shown = [f"{names[j]} and {names[i]} ({number(float(values[i, j]))}{unit})" for i, j in places[:_PAIRS]]
    return f"{table.name[:1].upper()}{table.name[1:]}, the largest: {', '.join(shown)}."


def page_of(
    readings: Sequence[Shown], network: CompiledNetwork, recording: Recording, theme: Theme, settings: Mapping[str, str]
) -> bytes:
    """The page. Raises ImportError without jinja2."""
    template = environment().from_string(Path(__file__).with_name("page.html").read_text(encoding="utf-8"))
    text = template.render(
        readings=readings,
        title=network.network.title or network.name,
        name=network.name,
        hash=network.hash,
        version=__version__,
        theme=theme,
        settings=settings,
        size=f"{len(recording.neurons):,} neurons, {len(recording.sources):,} connections",
    )
    return text.encode()


def environment() -> jinja2.Environment:
    """Where templates are made from; what comes from a spec is escaped. Raises ImportError without jinja2."""
    try:
        import jinja2
    except ImportError as error:
        message = "jinja2 is not installed: pip install 'neurovis-spec[analyze]'"
        raise ImportError(message, name="jinja2") from error
    made = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    made.filters["number"] = lambda value: number(float(value)) if np.isfinite(value) else "–"
    return made
