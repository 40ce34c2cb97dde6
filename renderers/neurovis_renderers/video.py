"""Videos: a Film as MP4 (H.264) or WebM (VP9), written while it is made.

In: a Film, in parts of some frames each. Out: a file in fragments of a second, so that what is there can be played
at any time, also when whoever wrote it has been killed. ffmpeg encodes, in a process of its own that writes the file:
that of the package ``imageio-ffmpeg`` (extra ``video``), else the system's. Colours are stated as those of BT.709, four
brightnesses to a colour (4:2:0), which is what everything plays.
"""

from __future__ import annotations

import errno
import io
import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import suppress
from importlib.util import find_spec
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory, TemporaryFile
from typing import BinaryIO, cast

import numpy as np

from neurovis_renderers.canvas import Pixels
from neurovis_renderers.frames import all_frames
from neurovis_spec.scene import Film, Progress, RendererCapabilities, Scene
from neurovis_spec.scene.renderers import RendererError

#: Seconds of a fragment.
_FRAGMENT = 1.0
#: Colours, which are halved across and down, are kept finer than brightness would need; without frames that look ahead
#: (B) an MP4 in fragments begins at 0, and without a WebM's lag (25 by default) as little as can be is on the way.
_ENCODERS = {
    ".mp4": (
        *("-c:v", "libx264", "-preset", "veryfast", "-crf", "16", "-bf", "0"),
        *("-x264-params", "log-level=error:chroma-qp-offset=-6"),
        *("-movflags", "frag_keyframe+empty_moov+default_base_moof", "-f", "mp4"),
    ),
    ".webm": (
        *("-c:v", "libvpx-vp9", "-crf", "16", "-b:v", "0", "-deadline", "realtime", "-cpu-used", "6", "-row-mt", "1"),
        *("-lag-in-frames", "0", "-cluster_time_limit", str(round(1000 * _FRAGMENT)), "-f", "webm"),
    ),
}
#: How the colours are made of those of screens, and said to be made: no player has to guess.
_COLOURS = (
    "scale=out_color_matrix=bt709:out_range=tv:flags=accurate_rnd+full_chroma_int,format=yuv420p,"
    "setparams=range=tv:colorspace=bt709:color_primaries=bt709:color_trc=bt709"
)
_HINT = 'install ffmpeg, or the extra: pip install "neurovis-spec[video]"'


def ffmpeg() -> str | None:
    """The ffmpeg that is there, if any is."""
    if find_spec("imageio_ffmpeg") is not None:
        import imageio_ffmpeg

        with suppress(RuntimeError):  # it brings none for this platform, and none is installed
            return str(imageio_ffmpeg.get_ffmpeg_exe())
    return shutil.which("ffmpeg")


class VideoRenderer:
    """Films as MP4 and WebM."""

    name = "video"

    def __init__(self) -> None:
        kinds = frozenset(_ENCODERS)
        there = find_spec("imageio_ffmpeg") is not None or shutil.which("ffmpeg") is not None
        self.capabilities = RendererCapabilities(
            films=kinds, streams=kinds, missing={} if there else dict.fromkeys(kinds, _HINT)
        )

    def draw(self, scene: Scene, suffix: str) -> bytes:
        """Stills are made by others. Raises ValueError."""
        raise ValueError("this renderer makes no stills")

    def animate(self, film: Film, suffix: str, progress: Progress | None = None) -> bytes:
        """The film as the content of a file."""
        file = io.BytesIO()
        self.stream(iter([film]), film.frames, suffix, file, progress)
        return file.getvalue()

    def stream(
        self, films: Iterator[Film], frames: int, suffix: str, file: BinaryIO, progress: Progress | None = None
    ) -> None:
        """Write a film that comes in parts to a file, as it is made: to its path, since an index at the end takes a
        file in which ffmpeg can go back. Raises RendererError where ffmpeg fails."""
        where = getattr(file, "name", None)
        if isinstance(where, str | os.PathLike):
            _write(films, frames, suffix, os.fspath(where), progress)
            return
        with TemporaryDirectory() as folder:
            path = Path(folder) / f"film{suffix}"
            _write(films, frames, suffix, str(path), progress)
            with path.open("rb") as made:
                shutil.copyfileobj(made, file)


def _write(films: Iterator[Film], frames: int, suffix: str, path: str, progress: Progress | None) -> None:
    """Write a film to the file of this path."""
    first = next(films)
    wide, high = (side + side % 2 for side in first.scene.pixels)
    command = _command(suffix, (wide, high), first.fps, path)
    with TemporaryFile() as said:
        # in a session of its own: Ctrl-C is for us
        encoder = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=said, start_new_session=True)
        pictures = cast(io.BufferedWriter, encoder.stdin)
        try:
            with suppress(BrokenPipeError):  # it has ended, and says why
                for picture in all_frames(chain([first], films), frames, progress):
                    pictures.write(np.ascontiguousarray(_even(picture)).data)
                pictures.close()
            status = encoder.wait()
        finally:  # leave no process behind, whatever has happened
            encoder.kill()
            with suppress(BrokenPipeError):
                pictures.close()
            encoder.wait()
        if status:
            said.seek(0)
            lines = said.read()[-2000:].decode("utf-8", "replace").strip().splitlines()
            raise _failure("\n".join(lines), status)


def _failure(said: str, status: int) -> Exception:
    """What ffmpeg has failed at: there is no room for the film, or this ffmpeg lacks what films of the kind need."""
    for number in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG):
        if os.strerror(number) in said:
            return OSError(number, os.strerror(number))
    last = said.splitlines()[-1] if said else status
    return RendererError(f"ffmpeg failed: {last}", _HINT if "nknown encoder" in said else None)


def _command(suffix: str, size: tuple[int, int], fps: float, path: str) -> list[str]:
    program = ffmpeg()
    if program is None:
        raise RendererError(f"there is no ffmpeg, which films of the kind '{suffix}' need", _HINT)
    raw = ("-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{size[0]}x{size[1]}", "-framerate", f"{fps:.6g}")
    every = max(1, round(_FRAGMENT * fps))
    start = (program, "-hide_banner", "-loglevel", "error", "-nostdin", "-y")
    made = ("-an", "-vf", _COLOURS, "-g", str(every), *_ENCODERS[suffix], "-flush_packets", "1")
    return [*start, *raw, "-i", "pipe:0", *made, f"file:{path}"]


def _even(picture: Pixels) -> Pixels:
    """A picture of an even number of rows and columns, as 4:2:0 needs; the last ones are doubled."""
    high, wide = picture.shape[:2]
    if high % 2 or wide % 2:
        picture = np.pad(picture, ((0, high % 2), (0, wide % 2), (0, 0)), mode="edge")
    return picture
