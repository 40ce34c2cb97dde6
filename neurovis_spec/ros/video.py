"""The film of what arrives: the newest step, so many times a second, handed to a process that draws and encodes.

In: a ReceivedSource, and how it is drawn. Out: an MP4 in fragments, which can be played whatever becomes of either
process. Drawing holds nothing up: where the other process is busy, frames are left out here and repeated there.
"""

from __future__ import annotations

import pickle
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Event, Thread
from typing import IO, Final, cast

from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.compiler.drawing.drawing_settings import RenderSettings
from neurovis_spec.compiler.network import Network
from neurovis_spec.layout.model import Layout
from neurovis_spec.ros.received import ReceivedSource
from neurovis_spec.runtime.environment import for_others
from neurovis_spec.scene.gains import Gains

#: seconds for the other process to draw what it still has, at the end
_REST: Final = 30.0


@dataclass(frozen=True, slots=True, eq=False)
class Shooting:
    """What is drawn, how, how many times a second, and into which file."""

    network: Network
    layout: Layout
    gains: Gains
    settings: RenderSettings
    fps: float
    path: Path


def shooting(compiled: CompiledNetwork, path: Path, fps: float, theme: str | None, engine: str | None) -> Shooting:
    """A film of a network, drawn as its page is. Raises LayoutRefusalError."""
    layout, settings = compiled.placed(engine), compiled.settings_for(theme)
    return Shooting(compiled.network, layout, compiled.gains_for(None), settings, fps, path)


class Video:
    """A film that is made from ``start`` to ``end``; it begins with the first message."""

    def __init__(self, shooting: Shooting, source: ReceivedSource, tell: Callable[[str], None]) -> None:
        self.path, self._shooting, self._source, self._tell = shooting.path, shooting, source, tell
        self._end = Event()
        self._thread = Thread(target=self._shoot, name="video", daemon=True)
        #: whether there is a film
        self.begun = False

    def start(self) -> None:
        """Begin."""
        # in a session of its own: Ctrl-C is for us
        self._process = subprocess.Popen(
            [sys.executable, "-m", "neurovis_spec.ros.filming"],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            env=for_others(),
            start_new_session=True,
        )
        self._thread.start()

    def end(self) -> None:
        """Have the last step drawn, and the file closed."""
        self._end.set()
        self._thread.join(_REST)
        try:
            self._process.wait(_REST)
        except subprocess.TimeoutExpired:
            self._tell(f"{self.path}: what was still to be drawn is left out")
            self._process.kill()
            self._process.wait()
        self._thread.join(1.0)

    def _shoot(self) -> None:
        frames = cast("IO[bytes]", self._process.stdin)
        try:
            pickle.dump(self._shooting, frames)
            self._follow(frames)
            frames.close()
        except OSError:  # it has ended, and says why
            pass
        with suppress(OSError):
            frames.close()
        said = cast("IO[bytes]", self._process.stderr).read().decode("utf-8", "replace").strip()
        if said:
            self._tell(f"{self.path}: {said.splitlines()[-1]}")

    def _follow(self, frames: IO[bytes]) -> None:
        fps, number = self._shooting.fps, 0
        while not self._source.begun:
            if self._end.wait(0.02) and not self._source.begun:
                return
        self.begun = True
        begun = time.monotonic()
        while True:
            pickle.dump((number, self._source.newest()), frames)
            frames.flush()
            if self._end.is_set():
                return
            self._end.wait(begun + (number + 1) / fps - time.monotonic())
            number = max(number + 1, int((time.monotonic() - begun) * fps))
