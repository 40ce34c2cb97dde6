"""A recording that does not fit into memory is refused before any memory is taken."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest
from click.testing import CliRunner

import neurovis_spec as nv
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.runtime import memory
from neurovis_spec.runtime.recording import RecordingError

TEXT = "neurovis: 1\nname: x\nneurons: {A: {count: 2, bias: 0.1}}\n"


def test_so_many_steps_that_no_memory_holds_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The input's fault (1), with the size and the way out; what is written to a file is not held in memory, and the
    disk has to have the room. Nothing is written."""
    monkeypatch.setattr(memory, "available", lambda: 8 * 2**30)
    monkeypatch.setattr("neurovis_spec.runtime.memory.shutil.disk_usage", lambda path: SimpleNamespace(free=8 * 2**30))
    (tmp_path / "x.yaml").write_text(TEXT, encoding="utf-8")
    target = tmp_path / "x.npz"
    for where, output in (("memory", ()), ("the disk", ("-o", str(target)))):
        result = CliRunner().invoke(neurovis, ["run", str(tmp_path / "x.yaml"), "--steps", "1000000000000", *output])
        assert result.exit_code == 1
        message = f"a recording of 1,000,000,000,000 steps takes 21.8 TiB of {where}, and 8.0 GiB are free"
        assert message in result.output
        assert "--every 10000" in result.output
        assert not target.exists()


def test_more_steps_than_numbers_can_count_are_wrong_usage(tmp_path: Path) -> None:
    """Steps are counted exactly, as doubles as well."""
    (tmp_path / "x.yaml").write_text(TEXT, encoding="utf-8")
    result = CliRunner().invoke(neurovis, ["run", str(tmp_path / "x.yaml"), "--steps", str(10**30)])
    assert result.exit_code == 2


def test_fewer_rows_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is recorded counts, not what is run."""
    monkeypatch.setattr(memory, "available", lambda: 2400)
    network = nv.compile_text(TEXT)
    assert len(network.run(100)) == 100
    with pytest.raises(RecordingError, match=r"2\.4 KiB of memory, and 2\.3 KiB are free"):
        network.run(101)
    assert len(network.run(1000, every=10)) == 100


def test_what_is_free_is_a_number_of_bytes() -> None:
    """Where the system tells, there is room for a small recording; where it does not, nothing is refused."""
    room = memory.available()
    assert room is None or room > 2**20
