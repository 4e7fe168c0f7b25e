"""Pools of workers that share a list of work: processes of this machine, or the workers of a Dask cluster."""

from __future__ import annotations

import logging
import signal
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import (
    BrokenExecutor,
    CancelledError,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
)
from contextlib import closing, contextmanager, suppress
from multiprocessing import get_context
from queue import SimpleQueue
from typing import Any, Protocol

import osimlite
from osimlite.base.cores import cores
from osimlite.base.require import protect_processes, require
from osimlite.errors import OsimliteError, SettingError

MOST_LOSSES = 20
"""A task that was lost with its worker so often is not tried again."""

PATIENCE = 30
"""So long a cluster may take to have its first worker, s."""


WORKER_COUNT_AGE_S = 1.0
"""A cluster is asked for its number of worker threads at most once in this time."""


class ClusterLostError(OsimliteError):
    """The cluster cannot be reached any more; what was done is kept."""


class WorkerLostError(OsimliteError):
    """A process has ended in the midst of its work, and takes all others with it."""


class Pool(Protocol):
    """Takes work, such as samples, and puts what came of it into a queue."""

    task_seconds: float  # how long a task should take

    @property
    def workers(self) -> int:
        """How much can be worked on at a time; may change."""

    def submit(self, tag: Any, values: Any) -> None:
        """Have it done; the values of a sweep are samples (k, d)."""

    def result(self, timeout: float | None = None) -> tuple[Any, Any]:
        """The next tag that is done, and what came of it, of samples a block.

        Raises:
            OsimliteError: it could not be done; TimeoutError: nothing was done in time.
        """

    def close(self) -> None:
        """Stop what has not begun."""


@contextmanager
def processes(
    work: Callable[[Any], Any], *, workers: int | None = None, cluster: str | None = None
) -> Iterator[Pool]:
    """Make a pool of processes, here or on a cluster, that do one thing with all that is submitted.

    Args:
        work: what is done; it can be pickled.
        workers: processes here; by default one for each core.
        cluster: address of a Dask scheduler.

    Raises:
        SettingError: a cluster is named and a number of workers, or the number is below one.
        OsimliteError: the cluster cannot be reached.
        MissingDependency: dask.distributed is not installed.
    """
    if cluster is not None and workers is not None:
        raise SettingError(
            "a cluster has the workers that were started for it; leave out --workers"
        )
    made: Pool = (
        ProcessPool(work, count_workers(workers)) if cluster is None else ClusterPool(work, cluster)
    )
    with closing(made):
        yield made


def count_workers(workers: int | None) -> int:
    """Return the number of workers that is asked for, or by default that of the cores.

    Raises:
        SettingError: the number is below one.
    """
    if workers is not None and workers < 1:
        raise SettingError(f"there is at least one worker, not {workers}")
    return workers or cores()


class LocalPool:
    """An executor whose finished work queues up."""

    task_seconds = 0.25

    def __init__(
        self,
        executor: ThreadPoolExecutor | ProcessPoolExecutor,
        work: Callable[[Any], Any],
        count: int,
    ):
        self.workers = count
        self._executor, self._work = executor, work
        self._done: SimpleQueue[tuple[Any, Any]] = SimpleQueue()

    def submit(self, tag: Any, values: Any) -> None:
        """Have it done."""
        # Processes that begin now inherit that Ctrl-C is not for them.
        with _sigint_held(), _losses_told():
            future = self._executor.submit(self._work, values)
        future.add_done_callback(lambda done: self._done.put((tag, done)))

    def result(self, timeout: float | None = None) -> tuple[Any, Any]:
        """The next that is done."""
        tag, future = _next(self._done, timeout)
        with _losses_told():
            return tag, future.result()

    def close(self) -> None:
        """Stop what has not begun, and wait for the rest."""
        self._executor.shutdown(cancel_futures=True)


@contextmanager
def _losses_told() -> Iterator[None]:
    try:
        yield
    except BrokenExecutor:
        # New processes run the module anew that the program began with.
        raise WorkerLostError(
            "a process of the sweep has ended; a script begins a sweep under if __name__ == '__main__':, and what "
            "was ended from outside goes on with --resume"
        ) from None


class ProcessPool(LocalPool):
    """Processes, for what keeps Python's lock."""

    def __init__(self, work: Callable[[Any], Any], count: int) -> None:
        protect_processes()
        # Windows can wait for no more. Ctrl-C is for the process that gives out the work.
        executor = ProcessPoolExecutor(min(count, 61), get_context("spawn"), _leave_sigint)
        super().__init__(executor, work, count)


class ClusterPool:
    """The workers of a Dask cluster. A task that is lost with its worker is done by another.

    Args:
        work: what is done; it goes with every task, so that a new worker needs nothing from others.
        address: of the scheduler.
    """

    task_seconds = 1.0

    def __init__(self, work: Callable[[Any], Any], address: str) -> None:
        distributed = require("distributed", extra="sweep", purpose="a sweep on a cluster")
        _check_address(address)
        # It has pages to say of a scheduler that has gone, which is one sentence here.
        logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
        self._work, self._address = work, address
        self._done: SimpleQueue[tuple[Any, Any]] = SimpleQueue()
        self._tasks: dict[Any, tuple[Any, Any, int, Any]] = {}
        self._threads, self._asked = 0, 0.0
        try:
            self._client: Any = distributed.Client(
                address, timeout=min(10, PATIENCE), set_as_default=False
            )
        except (OSError, ValueError, TimeoutError) as error:
            reason = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise ClusterLostError(
                f"there is no Dask scheduler at '{address}' ({reason}); start one with: dask scheduler"
            ) from None
        try:
            self._client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError:
            self._client.close()
            raise ClusterLostError(
                f"the Dask scheduler at '{address}' has no workers; start them with: dask worker {address}"
            ) from None

    @property
    def workers(self) -> int:
        """Threads of all workers, at least one."""
        if time.monotonic() - self._asked > WORKER_COUNT_AGE_S:
            # A scheduler that does not answer may come back: the client tries for a while, and
            # `result` raises an error if it gives up.
            with suppress(OSError, TimeoutError):
                self._threads = sum(self._client.nthreads().values())
            self._asked = time.monotonic()
        return max(1, self._threads)

    def submit(self, tag: Any, values: Any) -> None:
        """Have it done."""
        self._submit(tag, values, 0)

    def _submit(self, tag: Any, values: Any, losses: int) -> None:
        try:
            future = self._client.submit(
                elsewhere, self._work, values, osimlite.__version__, pure=False
            )
        except Exception as error:
            if type(error).__name__ == "ClosedClientError":
                raise self._lost() from None
            raise
        self._tasks[future.key] = tag, values, losses, future
        future.add_done_callback(self._done.put)

    def result(self, timeout: float | None = None) -> tuple[Any, Any]:
        """The next that is done."""
        from distributed.scheduler import KilledWorker

        while True:
            future = _next(self._done, timeout)
            tag, values, losses, _ = self._tasks.pop(future.key)
            try:
                return tag, future.result(timeout=60)
            except KilledWorker:
                if losses + 1 >= MOST_LOSSES:
                    raise OsimliteError(
                        "the same task has ended worker after worker; look into their logs, then go on with --resume"
                    ) from None
                self._submit(tag, values, losses + 1)
            except (CancelledError, OSError, TimeoutError):
                raise self._lost() from None
            except OsimliteError as error:
                error.message = f"on the cluster: {error.message}"
                raise
            except Exception as error:
                if type(error).__name__ in ("FutureCancelledError", "CommClosedError"):
                    raise self._lost() from None
                raise OsimliteError(
                    f"a worker cannot do its task ({type(error).__name__}: {error}); it needs the modules that are "
                    "here, then go on with --resume"
                ) from error

    def _lost(self) -> ClusterLostError:
        return ClusterLostError(
            f"the Dask scheduler at '{self._address}' has gone; go on with --resume"
        )

    def close(self) -> None:
        """Stop what has not begun."""
        # Futures that are let go are cancelled.
        self._tasks.clear()
        self._client.close()


def _check_address(address: str) -> None:
    """Stop before a client is made, which takes long to give up."""
    core = require("distributed.core", extra="sweep", purpose="a sweep on a cluster")
    comm = require("distributed.comm", extra="sweep", purpose="a sweep on a cluster")
    try:
        comm.get_address_host_port(core.coerce_to_address(address))
    except ValueError as error:
        raise SettingError(
            f"'{address}' is no address of a Dask scheduler ({error}); give one such as tcp://127.0.0.1:8786"
        ) from None


def _next(queue: SimpleQueue[Any], timeout: float | None) -> Any:
    from queue import Empty

    try:
        return queue.get(timeout=timeout)
    except Empty:
        raise TimeoutError from None


def _leave_sigint() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)


@contextmanager
def _sigint_held() -> Iterator[None]:
    """Let interruptions by the keyboard wait, where the system has masks."""
    if sys.platform == "win32":
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def elsewhere(work: Callable[[Any], Any], values: Any, version: str) -> Any:
    """Do work that another program gives; what a worker of a cluster does.

    Raises:
        OsimliteError: that program has another version of osimlite, or the work cannot be done.
    """
    if version != osimlite.__version__:
        raise OsimliteError(
            f"a worker has osimlite {osimlite.__version__}, and the sweep was begun by {version}; install the same"
        )
    return work(values)
