"""``neurovis live``: a network in the browser while it runs."""

from __future__ import annotations

import sys
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import click

from neurovis_spec.cli.completion import paths
from neurovis_spec.cli.failure import fault
from neurovis_spec.cli.files import compiler, compiler_in_place, network_of, recording_of
from neurovis_spec.cli.options import (
    backend_option,
    body_options,
    compile_options,
    engine_option,
    examples,
    run_option,
    set_option,
    theme_option,
)

if TYPE_CHECKING:
    import socket
    from collections.abc import Callable

    from neurovis_spec.compiled import CompiledNetwork
    from neurovis_spec.live.run import Run
    from neurovis_spec.live.watch import Watch
    from neurovis_spec.runtime.recording import Recording

#: what tells a recording from a spec where one is given in its place
_RECORDINGS = (".npz", ".csv", ".mcap", ".bag")


@click.command(
    epilog=examples(
        "neurovis live first.yaml",
        "neurovis live first.yaml --watch --open",
        "neurovis live first.yaml --recording first.npz",
        "neurovis live first.yaml --from first.npz --viewers",
    )
)
@click.argument("specs", metavar="SPEC", nargs=-1, required=True, shell_complete=paths)
@click.option(
    "--recording", metavar="FILE", shell_complete=paths, help="Play this recording; without it the network is run."
)
@run_option
@click.option(
    "--from",
    "start",
    metavar="RECORDING",
    shell_complete=paths,
    help="Begin with the last weights and activities of this recording; states of models begin anew.",
)
@click.option("--watch", is_flag=True, help="Show the spec anew whenever it, or a file that it names, is saved.")
@click.option(
    "--host", default="127.0.0.1", metavar="H", help="Where to listen; default: 127.0.0.1, this machine alone."
)
@click.option("--port", type=click.IntRange(0, 65535), default=0, metavar="P", help="Default: one that is free.")
@click.option("--viewers", is_flag=True, help="Print a second URL, on standard error, for those who only look on.")
@click.option("--open", "browse", is_flag=True, help="Open the page in the browser.")
@theme_option
@engine_option
@backend_option
@set_option
@body_options
@compile_options
def command(
    specs: tuple[str, ...],
    recording: str | None,
    run: int | None,
    start: str | None,
    watch: bool,
    host: str,
    port: int,
    viewers: bool,
    browse: bool,
    theme: str | None,
    engine: str | None,
    backend: str | None,
    settings: dict[str, float],
) -> None:
    """Show a network in the browser while it runs.

    One line on standard output is the URL of the page, with the token that opens it. The network runs in real time by
    its dt, goes on past time.steps, and can be stopped, stepped back and turned in the page. Ctrl-C ends it.
    """
    if len(specs) > 1:
        raise click.UsageError(f"live shows one network, and {len(specs)} specs are given: start it once for each")
    if recording is not None and start is not None:
        raise click.UsageError("--from begins a run, and --recording plays one that was made: give one of them")
    (spec,) = specs
    if watch and spec == "-":
        raise click.UsageError("standard input cannot be watched: give the path of a spec")
    if find_spec("aiohttp") is None:
        raise fault(
            "the live view needs aiohttp", "pip install 'neurovis-spec[live]'; in a clone: pip install '.[live]'"
        )
    network, played = _network(spec, recording, run, settings, watch or start is not None)
    compile = None if spec == "-" or _is_recording(spec) else compiler_in_place(spec, settings)
    _show(network, played, recording_of(start), compiler(spec, settings) if watch else None,
          compile, spec, host, port, viewers, browse, theme, engine, backend)  # fmt: skip


def _network(
    spec: str, recording: str | None, run: int | None, settings: dict[str, float], runs: bool
) -> tuple[CompiledNetwork, Recording | None]:
    """The network, and the recording of it that is played, if one is."""
    if not _is_recording(spec):
        played = recording_of(recording, run)
        return network_of(spec, settings), played
    if recording is not None or runs:
        raise click.UsageError(f"'{spec}' is a recording: SPEC is the spec that it was made of")
    from neurovis_spec import api

    played = recording_of(spec, run)
    assert played is not None
    if not played.spec:
        hint = f"name it: neurovis live SPEC --recording {spec}; a .mcap or .bag holds its spec"
        raise fault(f"{spec} is a recording that does not hold its spec", hint)
    return api.compile_text(played.spec, file=f"{spec} (spec)", parameters=settings, body=False), played


def _is_recording(spec: str) -> bool:
    return Path(spec).suffix.lower() in _RECORDINGS or Path(spec).is_dir()


def _show(
    network: CompiledNetwork,
    recording: Recording | None,
    start: Recording | None,
    again: Callable[[], CompiledNetwork] | None,
    compile: Callable[[str], CompiledNetwork] | None,
    spec: str,
    host: str,
    port: int,
    viewers: bool,
    browse: bool,
    theme: str | None,
    engine: str | None,
    backend: str | None,
) -> None:
    import asyncio

    from neurovis_spec.live.access import Access
    from neurovis_spec.live.desk import Desk, Written
    from neurovis_spec.live.live import Edits, serve
    from neurovis_spec.live.show import Show

    show = Show(recording, start, theme, engine, backend)
    stage = show.stage(network)
    sock = bound(host, port)
    access = Access(host, sock.getsockname()[1], viewers)

    def announce() -> None:
        click.echo(access.url())
        sys.stdout.flush()
        if viewers:
            click.echo(f"viewers: {access.url(owner=False)}", err=True)
        if browse:
            import webbrowser

            webbrowser.open(access.url())

    def desk(run: Run, tell: Callable[[str], None]) -> Desk:
        return Desk(network, engine, show.view, run, tell, None if compile is None else Written(Path(spec), compile))

    def edits(run: Run, tell: Callable[[str], None], desk: Desk) -> Watch:
        assert again is not None
        return Edits(show, again, partial(_files, spec), network, run, tell, desk).watch()

    # frames are due 60 times a second: threads must not wait for each other as long as Python lets them
    sys.setswitchinterval(0.0005)
    asyncio.run(serve(stage, sock, access, announce, desk, None if again is None else edits))


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


def _files(spec: str, network: CompiledNetwork) -> list[Path]:
    """The files that an edit may change."""
    return [Path(spec), *network.files]
