"""A recording that does not fit into memory is refused before any memory is taken."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest
from click.testing import CliRunner

import neurovis_spec as nv
from neurovis_spec.cli.commands import neurovis
from neurovis_spec.runtime import memory
from neurovis_spec.runtime.errors import RecordingError

TEXT = "neurovis: 1\nname: x\nneurons: {A: {count: 2, bias: 0.1}}\n"


def test_so_many_steps_that_no_memory_holds_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The input's fault (1), with the size and the way out; what is written to a file is not held in memory, and the
    disk has to have the room. Nothing is written."""
    monkeypatch.setattr(memory, "available", lambda: 8 * 2**30)
    monkeypatch.setattr("neurovis_spec.runtime.memory.shutil.disk_usage", lambda path: SimpleNamespace(free=8 * 2**30))
    (tmp_path / "x.yaml").write_text(TEXT, encoding="utf-8")
    target = tmp_path / "x.npz"
    on_disk = "36.4 TiB of the disk while it is written", ("-o", str(target))
    for where, output in (("21.8 TiB of memory", ()), on_disk):
        result = CliRunner().invoke(neurovis, ["run", str(tmp_path / "x.yaml"), "--steps", "1000000000000", *output])
        assert result.exit_code == 1
        message = f"a recording of 1,000,000,000,000 steps takes {where}, and 8.0 GiB are free"
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
    monkeypatch.setattr(memory, "SMALL", 0)
    network = nv.compile_text(TEXT)
    assert len(network.run(100)) == 100
    with pytest.raises(RecordingError, match=r"2\.4 KiB of memory, and 2\.3 KiB are free"):
        network.run(101)
    assert len(network.run(1000, every=10)) == 100


def test_what_is_free_is_a_number_of_bytes() -> None:
    """Where the system tells, there is room for a small recording; where it does not, nothing is refused."""
    room = memory.available()
    assert room is None or room > 2**20


def test_small_runs_are_never_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "available", lambda: 0)
    network = nv.compile_text(TEXT)
    assert len(network.run(10)) == 10
    memory.check_room(memory.SMALL // 24, 1, 2)
    with pytest.raises(RecordingError, match="and 0 bytes are free"):
        memory.check_room(memory.SMALL // 24 + 1, 1, 2)


#: the lines of /proc/self/cgroup, files of groups (limit, taken, cache in use and not), and what is free
GROUPS = [
    ("0::/", {"": ("max", 5, 1, 1)}, None),
    ("0::/", {"": (1000, 1000, 300, 600)}, 900),
    ("0::/", {"": (1000, 1500, 100, 100)}, 0),
    ("0::/a/b", {"a/b": ("max", 10, 0, 0), "a": (1000, 400, 50, 50), "": (9000, 10, 0, 0)}, 700),
    ("4:memory:/x", {"memory/x": (1000, 990, 300, 600), "memory": (2**63 - 4096, 0, 0, 0)}, 910),
    ("4:memory:/nowhere\n0::/", {"memory": (1000, 990, 0, 600)}, 610),
    ("1:cpu:/", {"memory": (1, 1, 0, 0)}, None),
]


@pytest.mark.parametrize(("lines", "groups", "free"), GROUPS)
def test_the_page_cache_counts_as_free_whatever_group_has_the_limit(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    lines: str,
    groups: dict[str, tuple[str | int, int, int, int]],
    free: int | None,
) -> None:
    for name, (limit, taken, active, inactive) in groups.items():
        folder = tmp_path / name
        folder.mkdir(parents=True, exist_ok=True)
        first = name.startswith("memory")
        names = ("memory.limit_in_bytes", "memory.usage_in_bytes") if first else ("memory.max", "memory.current")
        prefix = "total_" if first else ""
        for file, value in zip(names, (limit, taken), strict=True):
            (folder / file).write_text(f"{value}\n")
        (folder / "memory.stat").write_text(f"anon 7\n{prefix}active_file {active}\n{prefix}inactive_file {inactive}\n")
    (tmp_path / "cgroup").write_text(lines + "\n")
    (tmp_path / "meminfo").write_text("MemTotal: 9000000 kB\nMemFree: 10 kB\nMemAvailable: 8000000 kB\n")
    monkeypatch.setattr(memory, "_CGROUPS_FILE", tmp_path / "cgroup")
    monkeypatch.setattr(memory, "_CGROUP_MOUNT", tmp_path)
    monkeypatch.setattr(memory, "_MEMORY", tmp_path / "meminfo")
    assert memory.available() == (8_000_000 * 1024 if free is None else free)
