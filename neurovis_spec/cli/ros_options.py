"""What the commands of ``neurovis ros`` share: which ROS, who may listen, when it ends, how the summary is printed; of
those that listen the page, the recording, the film.

In: texts of the command line. Out: a Meeting, which opens the node and ends with the summary; a Desk, which opens what
is shown and recorded for a block.
"""

from __future__ import annotations

import re
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from datetime import datetime
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal

import click

from neurovis_spec.cli.completion import paths
from neurovis_spec.cli.failure import fault
from neurovis_spec.cli.files import check_target
from neurovis_spec.cli.options import Option, as_one, engine_option, finite, theme_option
from neurovis_spec.interrupts import deferred

if TYPE_CHECKING:
    import socket

    from neurovis_spec.compiled import CompiledNetwork
    from neurovis_spec.ros.files import Rotation
    from neurovis_spec.ros.listening import Listening
    from neurovis_spec.ros.middleware import Node, Ros
    from neurovis_spec.ros.summary import Summary

#: where a command's context has the arguments for ROS itself
_ARGUMENTS: Final = "neurovis.ros"
_REMAPPING: Final = re.compile(r"[A-Za-z_~/][A-Za-z0-9_~/.]*:=.*", re.DOTALL)


def arguments_of_ros(arguments: Sequence[str]) -> tuple[list[str], tuple[str, ...]]:
    """The arguments of a command, and those of ROS itself among them.

    >>> arguments_of_ros(["x.yaml", "--ros-args", "-r", "a:=b", "--", "--steps", "5"])
    (['x.yaml', '--steps', '5'], ('--ros-args', '-r', 'a:=b', '--'))
    >>> arguments_of_ros(["x.yaml", "__name:=y", "--steps", "5", "_gain:=2"])
    (['x.yaml', '--steps', '5'], ('__name:=y', '_gain:=2'))
    """
    rest, found, within = list[str](), list[str](), False
    for word in arguments:
        within = within or word == "--ros-args"
        (found if within or _REMAPPING.fullmatch(word) else rest).append(word)
        within = within and word != "--"
    return rest, tuple(found)


class NodeCommand(click.Command):
    """A command that takes the arguments of ROS, too, as launch files give them."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Set the arguments of ROS aside."""
        rest, ctx.meta[_ARGUMENTS] = arguments_of_ros(args)
        return super().parse_args(ctx, rest)


@dataclass(frozen=True)
class Meeting:
    """How a command meets ROS."""

    ros: Ros | None
    remote: bool
    sim_time: bool
    seconds: float | None
    wait: float
    format: Literal["text", "json"]

    @contextmanager
    def node(self, name: str, namespace: str = "/", anonymous: bool = False) -> Iterator[Node]:
        """A node that is there for a block. Raises MiddlewareError."""
        from neurovis_spec.ros.middleware import NodeOptions, open_node

        context = click.get_current_context(silent=True)
        given: tuple[str, ...] = () if context is None else context.meta.get(_ARGUMENTS, ())
        options = NodeOptions(name, namespace, self.ros, self.remote, self.sim_time, anonymous, given, self.seconds)
        opened = open_node(options, tell)
        try:
            yield opened
        finally:
            with deferred():  # until what was sent is on its way
                opened.close()

    def is_over(self, begun: float) -> bool:
        """Whether its seconds have passed since then (``time.monotonic``)."""
        return self.seconds is not None and time.monotonic() - begun >= self.seconds

    def show(self, summary: Summary) -> None:
        """Print the summary."""
        click.echo(summary.json() if self.format == "json" else summary.text())


def tell(text: str) -> None:
    """A line on standard error."""
    click.echo(text, err=True)


def _version(ctx: click.Context, param: click.Parameter, value: str | None) -> Ros | None:
    return None if value is None else 1 if value == "1" else 2


def meeting_options(wait: float) -> Option:
    """The options that all commands have, as one argument ``meeting``; ``wait`` is the default of ``--wait``."""
    positive = click.FloatRange(min=0)
    return as_one(
        "meeting",
        Meeting,
        click.option(
            "--ros", type=click.Choice(["1", "2"]), callback=_version, help="Which ROS; default: the one that is there."
        ),
        click.option(
            "--seconds", type=positive, callback=finite, metavar="S",
            help="End after S seconds; what is waited for before (a master, a network that announces itself) has S "
            "seconds to come.",
        ),
        click.option(
            "--wait", type=positive, callback=finite, default=wait, show_default=True, metavar="S",
            help="Begin when every topic has a subscriber, at the latest after S seconds.",
        ),
        click.option("--remote", is_flag=True, help="Meet other machines; else this one alone."),
        click.option("--sim-time", is_flag=True, help="Take the time from /clock."),
        click.option(
            "--format", type=click.Choice(["text", "json"]), default="text",
            help="How the summary is printed; json: one object on one line.",
        ),
    )  # fmt: skip


@dataclass(frozen=True)
class Desk:
    """Where the received steps are shown (``live``: a port), recorded and filmed (paths; "": at a default path). None:
    not at all."""

    live: int | None
    record: str | None
    rotate: Rotation
    force: bool
    theme: str | None
    engine: str | None
    video: str | None
    fps: float

    def __bool__(self) -> bool:
        return any(one is not None for one in (self.live, self.record, self.video))

    def in_the_browser(self) -> Desk:
        """The same, shown at a port that is free."""
        return replace(self, live=0)

    def check(self, played: str | None = None) -> None:
        """Raise what says that it cannot be recorded, filmed or shown where that is wanted, before anything is waited
        for. A recording that is ``played`` cannot be written over."""
        from neurovis_spec.ros.files import in_the_way
        from neurovis_spec.scene.renderers import renderer_for

        if self.record is not None:
            path = self._path(self.record)
            if path.suffix:
                check_target(path, [("the recording that is played", played)], option="--record")
            with _told_of_files():
                in_the_way(path, self.force)
        if self.video is not None:
            renderer_for(".mp4", moving=True)
        if self.video:
            self._check_film(Path(self.video))
        if self.live is not None:
            self._socket(self.live).close()

    @staticmethod
    def _path(record: str, ros: Ros | None = None) -> Path:
        from neurovis_spec.ros.files import refusal

        path = Path(record)
        if (why := refusal(path, ros)) is not None:
            raise fault(f"{path}: {why}")
        return path

    @staticmethod
    def _socket(port: int) -> socket.socket:
        if find_spec("aiohttp") is None:
            raise fault(
                "the live view needs aiohttp", "pip install 'neurovis-spec[live]'; in a clone: pip install '.[live]'"
            )
        from neurovis_spec.cli.live import bound

        return bound("127.0.0.1", port)

    @contextmanager
    def open(
        self, compiled: CompiledNetwork, node: Node, base: str | None = None, backend: str = ""
    ) -> Iterator[Listening]:
        """A network's topics, by default those that its spec says, heard for a block, and shown in the page where that
        is wanted; ``backend`` is the name of the one that makes the steps, where that is known."""
        from neurovis_spec.ros.listening import Listening, Wanted

        path = None if self.record is None else self._path(self.record, node.ros)
        film = self._film(compiled)
        wanted = Wanted(path, self.rotate, self.force, self.live is not None or film is not None, backend)
        with _told_of_files():
            listening = Listening(compiled, node.ros, wanted, tell, node.definition, base)
        with self._page(listening), self._filmed(listening, film):
            listening.start()
            try:
                yield listening
            finally:
                listening.end()

    def _film(self, compiled: CompiledNetwork) -> Path | None:
        """Where the film goes; raises what says that there can be none."""
        if self.video is None:
            return None
        path = Path(self.video or f"{compiled.name}-{datetime.now():%Y%m%d-%H%M%S}.mp4")
        self._check_film(path)
        return path

    def _check_film(self, path: Path) -> None:

        check_target(path, option="--video")
        if path.exists() and not self.force:
            raise fault(f"{path} exists", "--force overwrites it")

    @contextmanager
    def _filmed(self, listening: Listening, path: Path | None) -> Iterator[None]:
        if path is None or listening.source is None:
            yield
            return
        from neurovis_spec.ros.video import Video, shooting

        taken = shooting(listening.compiled, path, self.fps, self.theme, self.engine)
        listening.video = video = Video(taken, listening.source, tell)
        video.start()
        try:
            yield
        finally:
            video.end()

    @contextmanager
    def _page(self, listening: Listening) -> Iterator[None]:
        if self.live is None or listening.source is None:
            yield
            return
        from neurovis_spec.live.show import Show
        from neurovis_spec.ros.page import Page

        show = Show(theme=self.theme, engine=self.engine)
        with Page(listening.compiled, listening.source, show, self._socket(self.live), tell).served() as url:
            tell(f"live: {url}")
            yield


@contextmanager
def _told_of_files() -> Iterator[None]:
    try:
        yield
    except FileExistsError as error:
        raise fault(f"{error.filename} exists", "--force overwrites it") from None


def _rotation(ctx: click.Context, param: click.Parameter, value: str | None) -> Rotation:
    from neurovis_spec.ros.files import Rotation, rotation

    found = Rotation() if value is None else rotation(value)
    if found is None:
        raise click.UsageError(f"--rotate takes a size or seconds (1GiB, 500MB, 60s, 10min), not '{value}'")
    return found


def _film(ctx: click.Context, param: click.Parameter, value: str | None) -> str | None:
    if value and Path(value).suffix.lower() != ".mp4":
        raise click.UsageError(f"--video takes a file that ends in .mp4, not '{value}'")
    return value


def shown_options(always: bool) -> Option:
    """The options of the page and the recording, as one argument ``desk``; ``always``: what is not recorded is seen."""
    default = "; default without --record and --video: one that is free" if always else ""
    return as_one(
        "desk",
        Desk,
        click.option(
            "--live", type=click.IntRange(0, 65535), metavar="PORT",
            help=f"Show it in the browser, at this port; 0: one that is free{default}.",
        ),
        click.option(
            "--record", metavar="FILE", shell_complete=paths,
            help="Record: .mcap, .bag (ROS 1), or a folder without suffix (ROS 2).",
        ),
        click.option(
            "--rotate", metavar="SIZE|SECONDS", callback=_rotation,
            help="Begin a new file at this size or time; default: 1GiB.",
        ),
        click.option("--force", is_flag=True, help="Overwrite a recording or a film that is there."),
        theme_option,
        engine_option,
        click.option(
            "--video", metavar="[FILE]", is_flag=False, flag_value="", shell_complete=paths, callback=_film,
            help="Film it, as .mp4; default: the network's name and the time.",
        ),
        click.option(
            "--fps", type=click.FloatRange(1, 120), callback=finite, default=25.0, show_default=True, metavar="F",
            help="Frames a second of the film.",
        ),
    )  # fmt: skip
