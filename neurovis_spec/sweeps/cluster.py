"""Points on a cluster, through dask.distributed (the extra ``cluster``).

In: a Job, its points, the address of a scheduler. Out: results as they come, each with the place of its point. What a
worker has not finished when it is lost runs on another; a point that ends worker after worker is a failed one.
"""

from __future__ import annotations

import logging
from asyncio import CancelledError
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager
from uuid import uuid4

from neurovis_spec.sweeps.grid import Point, SweepError
from neurovis_spec.sweeps.point import Job, Result, failed, run_point

#: seconds within which the scheduler answers
_PATIENCE = 20


def on_cluster(job: Job, points: Sequence[Point], address: str) -> Generator[tuple[int, Result], None, None]:
    """Points on the workers of a scheduler. Raises SweepError where it does not answer, or workers lack NeuroVis."""
    try:
        from distributed import Client, Future, KilledWorker, as_completed
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
            message = f"the cluster gave up: {' '.join(str(error).split()) or type(error).__name__}"
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
