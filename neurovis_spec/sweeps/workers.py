"""Where the points of a sweep run: here, in processes of this machine, or on a cluster (the extra ``cluster``).

In: a Job and its points. Out: results as they come, each with the place of its point. Processes are spawned, so that
none shares a state with this one; each is given a point at a time, so that it is known what a process did that has been
ended from outside: the point is tried once more, and then it is a failed one. On a cluster, through dask.distributed,
what a worker has not finished when it is lost runs on another; a point that ends worker after worker is a failed one.
"""

from __future__ import annotations

import logging
import os
import signal
import sys
import threading
from asyncio import CancelledError
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager, suppress
from multiprocessing import get_context, parent_process, resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import TypeAlias
from uuid import uuid4

from neurovis_spec.interrupts import ENDING
from neurovis_spec.sweeps.grid import Point, SweepError
from neurovis_spec.sweeps.point import Job, Result, failed, run_point

#: What runs a point.
Run: TypeAlias = Callable[[Job, Point], Result]
#: how often a point is tried whose process is ended
_TRIES = 2
#: how many processes in a row may end before they ask for a point
_STILLBORN = 3
#: seconds within which the scheduler answers
_PATIENCE = 20

#: Runs points: their places and results, as they come.
Runner: TypeAlias = Callable[[Job, Sequence[Point]], Generator[tuple[int, Result], None, None]]


def runner_of(jobs: int, scheduler: str | None) -> Runner:
    """What runs points in so many processes, or on the cluster of a scheduler. Raises SweepError."""
    if scheduler is not None:
        return lambda job, some: on_cluster(job, some, scheduler)
    if jobs < 1:
        raise SweepError(f"a sweep runs in one process at least, not in {jobs}")
    return here if jobs == 1 else lambda job, some: in_processes(job, some, jobs)


def here(job: Job, points: Sequence[Point]) -> Generator[tuple[int, Result], None, None]:
    """One point after the other, in this process."""
    for place, point in enumerate(points):
        yield place, run_point(job, point)


def in_processes(
    job: Job, points: Sequence[Point], count: int, run: Run = run_point
) -> Generator[tuple[int, Result], None, None]:
    """Points in so many processes, which end with the iteration. Raises SweepError where none starts."""
    waiting = deque(range(len(points)))
    tried = [0] * len(points)
    workers = [_Worker(job, run) for _ in range(min(count, len(points)))]
    left, stillborn = len(points), 0
    try:
        while left:
            ready = wait([worker.connection for worker in workers])
            for worker in [worker for worker in workers if worker.connection in ready]:
                place, result = worker.place, worker.receive()
                if result is None:
                    workers.remove(worker)
                    stillborn = 0 if worker.began else stillborn + 1
                    if stillborn == _STILLBORN:
                        raise SweepError("the processes of the sweep do not start", _GUARD)
                    if place is not None and tried[place] < _TRIES:
                        waiting.appendleft(place)
                    elif place is not None:
                        result = failed(job, "worker-died", worker.end())
                    if waiting:
                        workers.append(_Worker(job, run))
                else:
                    stillborn = 0
                    if waiting:
                        tried[waiting[0]] += 1
                        worker.send(waiting[0], points[waiting.popleft()])
                if place is not None and result is not None:
                    left -= 1
                    yield place, result
    finally:
        for worker in workers:
            worker.stop()


_GUARD = 'in a script, call it under: if __name__ == "__main__": (or with jobs=1)'


class _Worker:
    """A process; ``place`` is the point that it runs, ``began`` whether it has got as far as asking for one."""

    def __init__(self, job: Job, run: Run) -> None:
        context = get_context("spawn")
        self.connection, other = context.Pipe()
        self._process: SpawnProcess = context.Process(target=_serve, args=(other, job, run), daemon=True)
        with _unmoved():
            self._process.start()
        other.close()
        self.place: int | None = None
        self.began = False

    def send(self, place: int, point: Point) -> None:
        self.place = place
        with suppress(OSError):  # it has been ended: reading says so
            self.connection.send(point)

    def receive(self) -> Result | None:
        """What it says: a result, or that it is there (an empty one); None where the process has ended."""
        try:
            found = self.connection.recv()
        except (EOFError, OSError):
            return None
        self.began, self.place = True, None
        return found if isinstance(found, Result) else None

    def end(self) -> str:
        """How the process has ended."""
        self._process.join()
        code = self._process.exitcode or 0
        how = f"signal {-code} ended" if code < 0 else "something ended"
        return f"{how} the process of this point; perhaps there was not enough memory"

    def stop(self) -> None:
        self._process.terminate()
        self._process.join()
        self.connection.close()


def _serve(connection: Connection[object, object], job: Job, run: Run) -> None:
    """What a process does: points, until it is ended."""
    threading.Thread(target=_follow, daemon=True).start()
    with suppress(EOFError, OSError):
        connection.send(Result(()))
        while True:
            point = connection.recv()
            assert isinstance(point, tuple)
            connection.send(run(job, point))


@contextmanager
def _unmoved() -> Iterator[None]:
    """A block in which signals wait; for a process that is started in it they wait for ever. Ctrl-C, which a terminal
    sends to all, is for the process that started the others."""
    if sys.platform == "win32":
        yield
        return
    resource_tracker.ensure_running()  # else starting the first process starts it, and lets signals through
    before = signal.pthread_sigmask(signal.SIG_BLOCK, set(ENDING) - {signal.SIGTERM})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _follow() -> None:
    """End with the process that started this one, however that ends."""
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


def on_cluster(job: Job, points: Sequence[Point], address: str) -> Generator[tuple[int, Result], None, None]:
    """Points on the workers of a scheduler. Raises SweepError where it does not answer, or workers lack NeuroVis."""
    try:
        from distributed import Client, Future, KilledWorker, as_completed
        from distributed.comm import CommClosedError
    except ImportError:
        hint = "pip install 'neurovis-spec[cluster]'"
        raise SweepError("a sweep on a cluster needs dask.distributed, which is not installed", hint) from None
    try:
        client = Client(address, timeout=_PATIENCE, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        message = f"the scheduler at {address} does not answer: {error or type(error).__name__}"
        raise SweepError(message, "an address is like tcp://10.0.0.1:8786") from None
    name = f"neurovis-{uuid4().hex}"
    futures: dict[Future, int] = {}
    with _ended_tasks_untold():
        try:
            # the job is a task of its own: what is merely scattered is gone with the worker that has it
            shared = client.submit(_same, job, key=f"{name}-job")
            for place, point in enumerate(points):
                futures[client.submit(run_point, shared, point, key=f"{name}-{place}")] = place
            for future in as_completed(list(futures), loop=client.loop):
                try:
                    result = future.result()
                except KilledWorker:
                    result = failed(job, "worker-died", "one worker after the other ended while it ran this point")
                yield futures.pop(future), result
                future.release()
        except Exception as error:  # of whatever kind: run_point raises nothing, so it is one of the cluster's
            why = " ".join(str(error).split()) or type(error).__name__
            if isinstance(error, CommClosedError):  # while a result was fetched: the client does not say with whom
                why = f"the client lost the connection to the scheduler: {why}"
            message = f"the cluster gave up: {why}"
            raise SweepError(
                message, "the rows until then are kept; do all of its workers have this version?"
            ) from None
        finally:
            if futures:
                client.cancel(list(futures))
            client.close(timeout=5)


def _same(job: Job) -> Job:
    return job


@contextmanager
def _ended_tasks_untold() -> Iterator[None]:
    """Where the scheduler is lost, dask's client logs a traceback for each task of its own that it ends, before the
    points fail and say why. These are dropped meanwhile, and nothing else that it logs."""
    logger = logging.getLogger("distributed.client")
    logger.addFilter(_is_no_ended_task)
    try:
        yield
    finally:
        logger.removeFilter(_is_no_ended_task)


def _is_no_ended_task(record: logging.LogRecord) -> bool:
    return not (record.exc_info and isinstance(record.exc_info[1], CancelledError))
