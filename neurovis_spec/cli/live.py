"""``neurovis live``: a network in the browser while it runs."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal
from urllib.parse import quote

import click

from neurovis_spec.cli.completion import paths
from neurovis_spec.cli.failure import fault
from neurovis_spec.cli.files import compiler, compiler_in_place, network_of, recording_of
from neurovis_spec.cli.options import (
    as_one,
    backend_option,
    body_options,
    check_only,
    compile_options,
    engine_option,
    examples,
    only_option,
    run_option,
    set_option,
    start_option,
    theme_option,
)
from neurovis_spec.cli.progress import progress

if TYPE_CHECKING:
    import socket
    from collections.abc import Callable

    from neurovis_spec.compiled import CompiledNetwork
    from neurovis_spec.live.access import Access
    from neurovis_spec.live.desk import Desk, Written
    from neurovis_spec.live.live import Edited
    from neurovis_spec.live.run import Run
    from neurovis_spec.live.show import Show
    from neurovis_spec.live.watch import Watch
    from neurovis_spec.runtime.recording import Recording

#: what tells a recording from a spec where one is given in its place
_RECORDINGS = (".npz", ".csv", ".mcap", ".bag")


@dataclass(frozen=True)
class Played:
    """What is shown: a recording, or a run that goes on from one."""

    recording: str | None
    run: int | None
    start: str | None
    only: Literal["weights"] | None


@dataclass(frozen=True)
class Door:
    """Where the page is served, who is shown in, and the view that is opened."""

    host: str
    port: int
    viewers: bool
    browse: bool
    view: str | None


@dataclass(frozen=True)
class Drawn:
    """How it is drawn, and what computes."""

    theme: str | None
    engine: str | None
    backend: str | None


played_options: Final = as_one(
    "played",
    Played,
    click.option(
        "--recording", metavar="FILE", shell_complete=paths, help="Play this recording; without it the network is run."
    ),
    run_option,
    start_option,
    only_option,
)
door_options: Final = as_one(
    "door",
    Door,
    click.option(
        "--host", default="127.0.0.1", metavar="H", help="Where to listen; default: 127.0.0.1, this machine alone."
    ),
    click.option("--port", type=click.IntRange(0, 65535), default=0, metavar="P", help="Default: one that is free."),
    click.option("--viewers", is_flag=True, help="Print a second URL, on standard error, for those who only look on."),
    click.option("--open", "browse", is_flag=True, help="Open the page in the browser."),
    click.option("--view", metavar="NAME", help="Open the page where it stood when this view was saved in it."),
)


@click.command(
    epilog=examples(
        "neurovis live",
        "neurovis live first.yaml",
        "neurovis live first.yaml --watch --open",
        'neurovis live first.yaml --view "after the lesion"',
        "neurovis live first.yaml --recording first.npz",
        "neurovis live first.yaml --from first.npz --viewers",
        "neurovis live first.yaml --from first.npz --only weights",
    )
)
@click.argument("specs", metavar="[SPEC]", nargs=-1, shell_complete=paths)
@played_options
@click.option("--watch", is_flag=True, help="Show the spec anew whenever it, or a file that it names, is saved.")
@door_options
@as_one("drawn", Drawn, theme_option, engine_option, backend_option)
@set_option
@body_options
@compile_options
def command(
    specs: tuple[str, ...], played: Played, watch: bool, door: Door, drawn: Drawn, settings: dict[str, float | str]
) -> None:
    """Show a network in the browser while it runs; without SPEC a gallery to choose from.

    One line on standard output is the URL of the page, with the token that opens it. The network runs in real time by
    its dt, goes on past time.steps, and can be stopped, stepped back and turned in the page. Ctrl-C ends it. The
    gallery has the examples, and the specs in this folder and those within it.
    """
    if len(specs) > 1:
        raise click.UsageError(f"live shows one network, and {len(specs)} specs are given: start it once for each")
    if played.recording is not None and played.start is not None:
        raise click.UsageError("--from begins a run, and --recording plays one that was made: give one of them")
    check_only(played.only, played.start)
    spec = specs[0] if specs else None
    if spec is None:
        _check_alone(played, door.view, watch, settings)
    if watch and spec == "-":
        raise click.UsageError("standard input cannot be watched: give the path of a spec")
    if find_spec("aiohttp") is None:
        raise fault(
            "the live view needs aiohttp", "pip install 'neurovis-spec[live]'; in a clone: pip install '.[live]'"
        )
    if spec is None:
        _show_gallery(drawn, door)
        return
    from neurovis_spec.live.desk import Written
    from neurovis_spec.live.live import Edited
    from neurovis_spec.live.show import Beginning, Show

    network, recording = _network(spec, played, settings, watch or played.start is not None)
    in_place = None if spec == "-" or _is_recording(spec) else Written(Path(spec), compiler_in_place(spec, settings))
    if door.view is not None:
        _check_view(door.view, spec, in_place, network)
    begin = Beginning(recording_of(played.start), played.only is not None)
    show = Show(recording, begin, drawn.theme, drawn.engine, drawn.backend)
    _show(network, show, in_place, Edited(Path(spec), compiler(spec, settings)) if watch else None, door)


def _check_alone(played: Played, view: str | None, watch: bool, settings: dict[str, float | str]) -> None:
    """Refuse what only means something of one spec."""
    recorded = {"--recording": played.recording, "--from": played.start}
    given: dict[str, object] = {**recorded, "--view": view, "--watch": watch, "--set": settings}
    for option, value in given.items():
        if value:
            raise click.UsageError(f"{option} is of a spec: give one, or leave the option out for the gallery")


def _check_view(name: str, spec: str, in_place: Written | None, network: CompiledNetwork) -> None:
    """Refuse a view that is not in the file, or a file that is wrong; tell what of it is left out."""
    from neurovis_spec.diagnostics import Findings, show_text
    from neurovis_spec.likeness import suggest
    from neurovis_spec.live.saved_views import file_beside, views_in

    if in_place is None:
        raise click.UsageError(f"'{spec}' has no file of views: --view needs the path of a spec")
    path, findings = file_beside(in_place.path), Findings()
    views = views_in(path, network.network, findings)
    findings.check()
    if name not in views:
        raise fault(f"there is no view '{name}' in {path}", suggest(name, views, "views") or "save one in the page")
    if told := findings.sorted():
        click.echo(show_text(told, findings.sources), err=True)


def _show_gallery(drawn: Drawn, door: Door) -> None:
    from neurovis_spec.cli.gallery import show_gallery
    from neurovis_spec.live.access import PAGE, PICTURE, STREAM, Access
    from neurovis_spec.live.show import Show

    sock = bound(door.host, door.port)
    access = Access(door.host, sock.getsockname()[1], door.viewers, (PAGE, STREAM, PICTURE))
    sys.setswitchinterval(0.0005)
    show_gallery(
        Show(None, theme=drawn.theme, engine=drawn.engine, backend=drawn.backend),
        access,
        sock,
        announcing(access, door),
    )


def _network(
    spec: str, played: Played, settings: dict[str, float | str], runs: bool
) -> tuple[CompiledNetwork, Recording | None]:
    """The network, and the recording of it that is played, if one is."""
    if not _is_recording(spec):
        recording = recording_of(played.recording, played.run)
        return network_of(spec, settings), recording
    if played.recording is not None or runs:
        raise click.UsageError(f"'{spec}' is a recording: SPEC is the spec that it was made of")
    from neurovis_spec import api

    recording = recording_of(spec, played.run)
    assert recording is not None
    if not recording.spec:
        hint = f"name it: neurovis live SPEC --recording {spec}; a .mcap or .bag holds its spec"
        raise fault(f"{spec} is a recording that does not hold its spec", hint)
    return api.compile_text(recording.spec, file=f"{spec} (spec)", parameters=settings, body=False), recording


def _is_recording(spec: str) -> bool:
    return Path(spec).suffix.lower() in _RECORDINGS or Path(spec).is_dir()


def _show(network: CompiledNetwork, show: Show, in_place: Written | None, edited: Edited | None, door: Door) -> None:
    import asyncio

    from neurovis_spec.live.access import Access
    from neurovis_spec.live.desk import Desk
    from neurovis_spec.live.live import Edits, serve

    with progress("laying out"):
        stage = show.stage(network)
    sock = bound(door.host, door.port)
    access = Access(door.host, sock.getsockname()[1], door.viewers)

    def desk(run: Run, tell: Callable[[str], None]) -> Desk:
        return Desk(network, show.engine, show.view, run, tell, in_place)

    def edits(run: Run, tell: Callable[[str], None], desk: Desk) -> Watch:
        assert edited is not None
        return Edits(show, edited, run, tell, desk).watch()

    # frames are due 60 times a second: threads must not wait for each other as long as Python lets them
    sys.setswitchinterval(0.0005)
    asyncio.run(serve(stage, sock, access, announcing(access, door), desk, None if edited is None else edits))


def announcing(access: Access, door: Door) -> Callable[[], None]:
    """What tells where the page is."""

    def announce() -> None:
        url = access.url() + ("" if door.view is None else f"#saved={quote(door.view)}")
        click.echo(url)
        sys.stdout.flush()
        if door.viewers:
            click.echo(f"viewers: {access.url(owner=False)}", err=True)
        if door.browse:
            import webbrowser

            webbrowser.open(url)

    return announce


def bound(host: str, port: int) -> socket.socket:
    """A socket where the page is served."""
    import errno

    from neurovis_spec.live.live import listen

    try:
        return listen(host, port)
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            raise fault(f"port {port} of {host} is in use", "leave --port out for one that is free") from None
        raise fault(f"cannot listen at {host}, port {port}: {error.strerror or error}") from None
