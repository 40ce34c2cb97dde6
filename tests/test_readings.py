"""What the paper reads off its pictures can be read off ours: from the SVG alone, in all themes, whoever looks at it.

A line or a disc is told from another where their colours differ by enough for a reader without or with any of three
deficiencies of colour vision; a thickness where the width in the file does.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from colour_vision import VISIONS, difference

import neurovis_spec as nv
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.runtime.recording import Recording
from neurovis_spec.scene import THEMES, Theme

SPECS = Path(__file__).parents[1] / "specs"
NS = "{http://www.w3.org/2000/svg}"
#: Far enough apart to be called another colour, and to be told at all.
OTHER, TOLD = 20, 5
PERIOD = 129


class Reader:
    """Reads pictures of steps of a run."""

    def __init__(self, spec: str, folder: Path) -> None:
        self.network: CompiledNetwork = nv.compile(SPECS / spec)
        self.recording: Recording = self.network.run()
        self._folder = folder

    def see(self, step: int, theme: str = "default") -> ET.Element:
        file = self._folder / "x.svg"
        self.network.render(file, step=step, theme=theme, recording=self.recording)
        return ET.fromstring(file.read_bytes())


def discs(picture: ET.Element) -> dict[str, str]:
    """The colour of each neuron."""
    found = (g for g in picture.iter(NS + "g") if "data-neuron" in g.attrib)
    return {g.attrib["data-neuron"]: next(g.iter(NS + "circle")).attrib["fill"] for g in found}


def lines(picture: ET.Element) -> dict[str, tuple[str, float]]:
    """The colour and the width of each connection."""
    result = {}
    for g in picture.iter(NS + "g"):
        if "data-connection" in g.attrib:
            path = next(p for p in g.iter(NS + "path") if p.attrib.get("class") != "glow")
            result[g.attrib["data-connection"]] = path.attrib["stroke"], float(path.attrib["stroke-width"])
    return result


def glows(picture: ET.Element) -> int:
    """How many connections glow."""
    return sum(path.attrib.get("class") == "glow" for path in picture.iter(NS + "path"))


def apart(one: str, other: str) -> float:
    """How far two colours are apart for the reader to whom they are nearest."""
    return min(difference(one, other, vision) for vision in VISIONS)


def sign(theme: Theme, colour: str) -> int:
    return -1 if difference(colour, theme.negative) < difference(colour, theme.positive) else 1


@pytest.fixture(scope="module")
def rhythm(tmp_path_factory: pytest.TempPathFactory) -> Reader:
    return Reader("cpg_rbf.yaml", tmp_path_factory.mktemp("rhythm"))


@pytest.fixture(scope="module", params=sorted(THEMES))
def theme(request: pytest.FixtureRequest) -> Theme:
    return THEMES[request.param]


def test_c2_drives_c1_and_c1_inhibits_c2(rhythm: Reader, theme: Theme) -> None:
    """At a step of a period both lines have a colour, and not the same: where C1 and C2 are both active, and alike."""
    one, other = (rhythm.recording[name][-PERIOD:] for name in ("C1", "C2"))
    alike = int(rhythm.recording.step[-PERIOD:][np.argmax(np.minimum(one, other))])
    drawn = lines(rhythm.see(alike, theme.name))
    driving, inhibiting = drawn["C2 -> C1"][0], drawn["C1 -> C2"][0]
    assert apart(driving, theme.zero) >= OTHER
    assert apart(inhibiting, theme.zero) >= OTHER
    assert (sign(theme, driving), sign(theme, inhibiting)) == (1, -1)


def test_k2_to_o_turns_from_a_thin_to_the_thickest_inhibition(rhythm: Reader) -> None:
    early, late = (
        {name: width for name, (_, width) in lines(rhythm.see(step)).items() if name.endswith("-> O")}
        for step in (100, 11_999)
    )
    assert early["K2 -> O"] <= 1.2
    assert late["K2 -> O"] >= 4
    assert max(late, key=late.__getitem__) == "K2 -> O"


def test_kernels_that_are_awake_are_told_from_those_that_sleep(rhythm: Reader, theme: Theme) -> None:
    told = 0
    for step in range(11_000, 11_000 + PERIOD, 32):
        fills = discs(rhythm.see(step, theme.name))
        active = {f"K{i}": float(rhythm.recording[f"K{i}"][step]) for i in range(1, 9)}
        for awake in (name for name, a in active.items() if a > 0.15):
            for asleep in (name for name, a in active.items() if a < 0.005):
                assert apart(fills[awake], fills[asleep]) >= TOLD
                told += 1
    assert told > 20


def test_what_learns_glows_and_what_has_learned_does_not(rhythm: Reader) -> None:
    assert max(glows(rhythm.see(step)) for step in range(60, 140, 30)) >= 3
    assert not any(glows(rhythm.see(step)) for step in range(11_000, 11_000 + PERIOD, 32))


def test_o_remembers(tmp_path: Path, theme: Theme) -> None:
    """I is grey again, and O stays as it was; a negative touch turns it over."""
    reader = Reader("short_term_memory.yaml", tmp_path)
    after: Iterator[dict[str, str]] = (discs(reader.see(step, theme.name)) for step in (60, 190, 260))
    signs = []
    for fills in after:
        assert apart(fills["I"], theme.zero) < 1
        assert apart(fills["O"], theme.zero) >= OTHER
        signs.append(sign(theme, fills["O"]))
    assert signs == [1, 1, -1]


def test_the_weight_of_the_reflex_is_seen_to_grow(tmp_path: Path) -> None:
    """The hexapod learns to step high earlier: what a leg tells the one behind it gets heavier."""
    reader = Reader("hexapod/hexapod.yaml", tmp_path)
    early, late = (lines(reader.see(step)) for step in (0, int(reader.recording.step[-1])))
    names = [name for name in early if name.split(" -> ")[0].endswith(".dp") and name.endswith(".dp")]
    assert len(names) == 4
    assert max(late[name][1] - early[name][1] for name in names) >= 1.5
