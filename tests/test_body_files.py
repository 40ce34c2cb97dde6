"""The files that a body's model names: what is no file, or too large, is refused before anything opens it."""

from __future__ import annotations

import os
import socket
import struct
import zlib
from pathlib import Path

import pytest
from neurovis_bodies import mujoco as kind

import neurovis_spec as nv

SPEC = """\
neurovis: 1
name: still
neurons: {A: {}}
body: {mujoco: whole.xml}
"""
#: How a model names another file; all of these open it.
NAMING = {
    "include": '<include file="{}"/>',
    "model": '<asset><model name="m" file="{}"/></asset>',
    "mesh": '<asset><mesh name="m" file="{}"/></asset>',
    "height field": '<asset><hfield name="m" file="{}" size="1 1 1 1"/></asset>',
    "texture": '<asset><texture name="m" file="{}"/></asset>',
    "side of a texture": '<asset><texture name="m" fileleft="{}"/></asset>',
    "skin": '<asset><skin name="m" file="{}"/></asset>',
    "soft part": '<worldbody><flexcomp name="m" type="gmsh" file="{}"/></worldbody>',
}


def told(folder: Path, model: str) -> list[tuple[str, str]]:
    """The findings of a spec with this model, all of them at the place that names it."""
    (folder / "whole.xml").write_text(f"<mujoco>{model}</mujoco>", encoding="utf-8")
    with pytest.raises(nv.SpecError) as caught:
        nv.compile_text(SPEC, folder=folder)
    assert {(item.span.line, item.span.column) for item in caught.value.diagnostics} == {(4, 16)}
    return [(item.code, item.message) for item in caught.value.diagnostics]


@pytest.fixture(autouse=True)
def _nothing_is_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is refused is refused before MuJoCo, in its process or in ours, sees the model."""

    def tried(model: object) -> str:
        raise AssertionError("MuJoCo was given the model")

    monkeypatch.setattr(kind, "_tried", tried)


@pytest.mark.parametrize("way", NAMING)
def test_a_pipe_that_a_model_names_is_refused_and_never_opened(tmp_path: Path, way: str) -> None:
    os.mkfifo(tmp_path / "pipe.stl")
    (tmp_path / "linked.stl").symlink_to("pipe.stl")
    for name in ("pipe.stl", "linked.stl"):
        words = f"'whole.xml' names the file '{name}', which is no regular file (a device, a pipe or a socket)"
        assert told(tmp_path, NAMING[way].format(name)) == [("file-kind", words)]


def test_a_device_is_refused_where_devices_lie_within_the_root(tmp_path: Path) -> None:
    (tmp_path / "zeros.stl").symlink_to("/dev/zero")
    (tmp_path / "whole.xml").write_text(f"<mujoco>{NAMING['mesh'].format('zeros.stl')}</mujoco>", encoding="utf-8")
    (tmp_path / "spec.yaml").write_text(SPEC, encoding="utf-8")
    with pytest.raises(nv.SpecError) as caught:
        nv.compile(tmp_path / "spec.yaml", root="/")
    assert [item.code for item in caught.value.diagnostics] == ["file-kind"]


def test_a_socket_and_what_an_included_model_names_are_refused_alike(tmp_path: Path) -> None:
    (tmp_path / "part.xml").write_text(f"<mujocoinclude>{NAMING['mesh'].format('s.stl')}</mujocoinclude>")
    with socket.socket(socket.AF_UNIX) as end:
        here = os.open(".", os.O_RDONLY)
        try:
            os.chdir(tmp_path)  # the name of a socket is short
            end.bind("s.stl")
        finally:
            os.fchdir(here)
            os.close(here)
        assert [code for code, _ in told(tmp_path, NAMING["include"].format("part.xml"))] == ["file-kind"]


@pytest.mark.parametrize("way", NAMING)
def test_a_file_of_gigabytes_is_refused(tmp_path: Path, way: str) -> None:
    with (tmp_path / "huge.stl").open("wb") as file:
        file.truncate(3 << 30)  # takes no room
    words = "'whole.xml' names the file 'huge.stl', which is larger than 256 MiB"
    assert told(tmp_path, NAMING[way].format("huge.stl")) == [("too-large", words)]


def test_files_that_are_gigabytes_together_are_refused(tmp_path: Path) -> None:
    meshes = ""
    for number in range(5):
        with (tmp_path / f"{number}.stl").open("wb") as file:
            file.truncate(250 << 20)
        meshes += f'<mesh name="m{number}" file="{number}.stl"/>'
    words = "'whole.xml' names files that are larger than 1,024 MiB together"
    assert told(tmp_path, f"<asset>{meshes}</asset>") == [("too-large", words)]


def png(path: Path, width: int, height: int) -> None:
    """A file that says of itself how large its image is."""
    head = b"IHDR" + struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + struct.pack(">I", 13) + head + struct.pack(">I", zlib.crc32(head)))


@pytest.mark.parametrize(
    ("asset", "words"),
    [
        ('<hfield name="m" nrow="20000" ncol="20000" size="1 1 1 1"/>', "height fields of 400,000,000 points"),
        ('<hfield name="m" file="large.png" size="1 1 1 1"/>', "height fields of 400,000,000 points"),
        ('<texture name="m" type="2d" builtin="flat" width="3e4" height="30000"/>', "textures of 900,000,000 points"),
        ('<texture name="m" builtin="flat" width="8000" height="8000"/>', "textures of 384,000,000 points"),
        ('<texture name="m" type="2d" file="large.png"/>', "textures of 400,000,000 points"),
        (
            "".join(f'<texture name="m{k}" type="2d" builtin="flat" width="9999" height="9999"/>' for k in range(3)),
            "textures of 299,940,003 points",
        ),
    ],
)
def test_what_would_take_gigabytes_once_it_is_made_is_refused(tmp_path: Path, asset: str, words: str) -> None:
    png(tmp_path / "large.png", 20_000, 20_000)
    ((code, message),) = told(tmp_path, f"<asset>{asset}</asset>")
    assert code == "bad-body"
    assert message.startswith(f"the model has {words}: ")
