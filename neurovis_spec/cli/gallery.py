"""The gallery of ``neurovis live`` without SPEC: the examples, and the specs in the working folder.

In: how they are drawn, where the page is served. Out: what the gallery lists, and what compiles and opens it.
"""

from __future__ import annotations

import asyncio
import os
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from neurovis_spec import api, pipeline
from neurovis_spec.cli.examples import example_specs, starts

if TYPE_CHECKING:
    import socket

    from neurovis_spec.compiled import CompiledNetwork
    from neurovis_spec.live.access import Access
    from neurovis_spec.live.desk import Desk
    from neurovis_spec.live.listing import Listed
    from neurovis_spec.live.rooms import Opened
    from neurovis_spec.live.run import Run
    from neurovis_spec.live.show import Show


def listed_in(folder: Path) -> tuple[Listed, ...]:
    """The specs in a folder, then the examples, then the networks to start from; each file once."""
    return tuple(_once((*_own(folder), *_examples())))


def _own(folder: Path) -> Iterable[Listed]:
    from neurovis_spec.live.listing import specs_in

    return specs_in(folder)


def _examples() -> Iterator[Listed]:
    from neurovis_spec.live.listing import Listed

    for name, path in example_specs().items():
        yield Listed(name, "examples", path)
    for start in starts():
        yield Listed(start.title, "to start from", text=start.spec)


def _once(listed: Iterable[Listed]) -> Iterator[Listed]:
    seen: set[str] = set()
    for one in listed:
        real = one.text if one.path is None else os.path.realpath(one.path)
        if real not in seen:
            seen.add(real)
            yield one


def compile_listed(listed: Listed) -> CompiledNetwork:
    """The network of what is listed. Raises SpecError."""
    if listed.path is None:
        return api.compile_text(listed.text, file=listed.name)
    here = Path.cwd()
    return api.compile(listed.path.relative_to(here) if listed.path.is_relative_to(here) else listed.path)


def draw_listed(listed: Listed) -> tuple[str, Iterable[Path]]:
    """A small picture of what is listed, and the files that it was made of. Raises SpecError."""
    compiled = compile_listed(listed)
    layout, network = compiled.placed(), compiled.network
    bare = replace(network, render=replace(network.render, legend=False, title=False))
    own = () if listed.path is None else (listed.path,)
    return pipeline.svg_at_rest(replace(compiled, network=bare), layout), (*own, *compiled.files)


def opener(show: Show) -> Callable[[Listed], Opened]:
    """What opens what is listed, from any thread."""
    from neurovis_spec.live.desk import Desk, Written

    def opened(listed: Listed) -> Opened:
        network, path = compile_listed(listed), listed.path
        stage = show.stage(network)

        def again(text: str) -> CompiledNetwork:
            assert path is not None
            return api.compile_text(text, file=str(path), folder=path.parent)

        written = Written(path, again) if path is not None and listed.own else None

        def desk(run: Run, tell: Callable[[str], None]) -> Desk:
            return Desk(network, show.engine, show.view, run, tell, written)

        return stage, desk

    return opened


def show_gallery(show: Show, access: Access, sock: socket.socket, announce: Callable[[], None]) -> None:
    """Serve the gallery of the working folder until a signal asks for an end. Raises Ended."""
    from neurovis_spec.live.gallery import Gallery, serve

    gallery = Gallery(access, listed_in(Path.cwd()), draw_listed, opener(show))
    asyncio.run(serve(gallery, sock, announce))
