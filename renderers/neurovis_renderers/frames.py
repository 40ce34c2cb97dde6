"""Frames: the pictures of a film, one after the other, painted by as many threads as there are processors.

In: a Film, or one in parts. Out: its pictures in order; only a few are made before they are asked for. NumPy lets other
threads run while it works, so threads do for painting what processes would do, and share what frames have in common.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from queue import SimpleQueue

from neurovis_renderers.apart import FRAMES
from neurovis_renderers.canvas import Pixels, paint
from neurovis_renderers.lettering import warn_of_letters
from neurovis_renderers.moving import Moving, Painter, TooDeepError
from neurovis_spec.scene import Film, Progress, still


def frames(film: Film) -> Iterator[Pixels]:
    """The pictures of a film, each made shortly before it is asked for."""
    painters: SimpleQueue[Callable[[int], Pixels]] = SimpleQueue()
    threads = max(1, min(_processors(), -(-film.frames // FRAMES)))
    for paint_frame in _painters(film, threads):
        painters.put(paint_frame)

    def run(begin: int) -> list[Pixels]:
        paint_frame = painters.get()
        try:
            return [paint_frame(frame) for frame in range(begin, min(begin + FRAMES, film.frames))]
        finally:
            painters.put(paint_frame)

    for pictures in _in_order(run, range(0, film.frames, FRAMES), threads):
        yield from pictures


def all_frames(films: Iterator[Film], total: int, progress: Progress | None = None) -> Iterator[Pixels]:
    """The pictures of a film of ``total`` frames that comes in parts."""
    done = 0
    for film in films:
        if not done:
            warn_of_letters(film.scene)
        for picture in frames(film):
            done += 1
            if progress is not None:
                progress(done, total)
            yield picture


def _painters(film: Film, count: int) -> list[Callable[[int], Pixels]]:
    """Functions that paint a frame, for one thread each."""
    try:
        moving = Moving(film)
    except TooDeepError:
        return [lambda frame: paint(still(film, frame))] * count
    return [Painter(moving).paint for _ in range(count)]


def _in_order(run: Callable[[int], list[Pixels]], begins: range, threads: int) -> Iterator[list[Pixels]]:
    """What ``run`` gives for each, in order, of which one more than there are threads is worked on."""
    if threads == 1:
        yield from map(run, begins)
        return
    waiting: deque[Future[list[Pixels]]] = deque()
    with ThreadPoolExecutor(threads) as pool:
        try:
            for begin in begins:
                waiting.append(pool.submit(run, begin))
                if len(waiting) > threads:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:  # whoever asked wants no more, or has been interrupted
            pool.shutdown(wait=True, cancel_futures=True)


def _processors() -> int:
    """How many processors this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not everywhere
        return os.cpu_count() or 1
