"""Videos: a Film as MP4 (H.264) or WebM (VP9), written while it is made.

In: a Film, in parts of some frames each. Out: a file in fragments of two seconds, so that what is there can be played
at any time, also when whoever wrote it has been killed. ffmpeg encodes, in a process of its own: that of the package
``imageio-ffmpeg`` (extra ``video``), else the system's. Colours are stated as those of BT.709, four brightnesses to a
colour (4:2:0), which is what everything plays.
"""

from __future__ import annotations

import io
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import suppress
from importlib.util import find_spec
from itertools import chain
from threading import Thread
from typing import BinaryIO, cast

import numpy as np

from neurovis_renderers.canvas import Pixels
from neurovis_renderers.frames import all_frames
from neurovis_spec.scene import Film, Progress, RendererCapabilities, Scene
from neurovis_spec.scene.renderers import RendererError

#: Seconds of a fragment.
_FRAGMENT = 2.0
_ENCODERS = {
    ".mp4": (
        *("-c:v", "libx264", "-preset", "veryfast", "-crf", "16", "-x264-params", "log-level=error"),
        *("-movflags", "frag_keyframe+empty_moov+default_base_moof", "-f", "mp4"),
    ),
    ".webm": (
        *("-c:v", "libvpx-vp9", "-crf", "24", "-b:v", "0", "-deadline", "realtime", "-cpu-used", "6", "-row-mt", "1"),
        *("-f", "webm"),
    ),
}
_COLOURS = (
    *("-vf", "scale=out_color_matrix=bt709:out_range=tv,format=yuv420p", "-color_range", "tv"),
    *("-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709"),
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
        """Write a film that comes in parts to a file, as it is made. Raises RendererError where ffmpeg fails."""
        first = next(films)
        wide, high = (side + side % 2 for side in first.scene.pixels)
        encoder = _Encoder(_command(suffix, (wide, high), first.fps), file)
        try:
            for picture in all_frames(chain([first], films), frames, progress):
                encoder.write(_even(picture))
            encoder.finish()
        finally:
            encoder.end()


def _command(suffix: str, size: tuple[int, int], fps: float) -> list[str]:
    program = ffmpeg()
    if program is None:
        raise RendererError(f"there is no ffmpeg, which films of the kind '{suffix}' need", _HINT)
    raw = ("-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{size[0]}x{size[1]}", "-framerate", f"{fps:.6g}")
    every = max(1, round(_FRAGMENT * fps))
    start = (program, "-hide_banner", "-loglevel", "error", "-nostdin")
    return [*start, *raw, "-i", "pipe:0", "-an", *_COLOURS, "-g", str(every), *_ENCODERS[suffix], "pipe:1"]


def _even(picture: Pixels) -> Pixels:
    """A picture of an even number of rows and columns, as 4:2:0 needs; the last ones are doubled."""
    high, wide = picture.shape[:2]
    if high % 2 or wide % 2:
        picture = np.pad(picture, ((0, high % 2), (0, wide % 2), (0, 0)), mode="edge")
    return picture


class _Encoder:
    """An ffmpeg that is given pictures, and whose output goes to a file."""

    def __init__(self, command: list[str], file: BinaryIO) -> None:
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self._in, self._out, self._err = (cast(io.BufferedRandom, pipe) for pipe in self._pipes())
        self._file, self._failure, self._said = file, list[OSError](), b""
        self._threads = [Thread(target=target, daemon=True) for target in (self._copy, self._listen)]
        for thread in self._threads:
            thread.start()

    def _pipes(self) -> tuple[object, object, object]:
        return self._process.stdin, self._process.stdout, self._process.stderr

    def _copy(self) -> None:
        """What comes out goes to the file at once, so that it can be played."""
        while data := self._out.read1(1 << 16):
            if self._failure:
                continue
            try:
                self._file.write(data)
                self._file.flush()
            except OSError as failure:
                self._failure.append(failure)

    def _listen(self) -> None:
        self._said = self._err.read()[-2000:]

    def write(self, picture: Pixels) -> None:
        """One more picture."""
        if self._failure:
            raise self._failure[0]
        try:
            self._in.write(np.ascontiguousarray(picture).data)
        except BrokenPipeError:
            self.finish()

    def finish(self) -> None:
        """Wait for the end. Raises RendererError, and OSError where the file cannot be written."""
        with suppress(BrokenPipeError):
            self._in.close()
        for thread in self._threads:
            thread.join()
        if self._failure:
            raise self._failure[0]
        if self._process.wait():
            said = self._said.decode("utf-8", "replace").strip().splitlines()
            raise RendererError(f"ffmpeg failed: {said[-1] if said else self._process.returncode}", _HINT)

    def end(self) -> None:
        """Leave no process behind, whatever has happened."""
        if self._process.poll() is None:
            self._process.kill()
        self._process.wait()
        for thread in self._threads:
            thread.join()
        for pipe in (self._in, self._out, self._err):
            with suppress(OSError):
                pipe.close()
