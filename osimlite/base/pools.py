"""Pools of workers that process tasks: local processes, or the workers of a Dask cluster."""

from __future__ import annotations

import logging
import signal
import sys
import time
import warnings
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
from osimlite.base.cores import count_cores
from osimlite.base.require import protect_processes, require
from osimlite.errors import DoubtfulWarning, OsimliteError, ResultWarning, SettingError

MAX_TASK_LOSSES = 20
"""Largest number of times that a task is submitted again after its worker was lost."""

CLUSTER_TIMEOUT_S = 30
"""Time within which a cluster must have its first worker (s)."""

WORKER_COUNT_AGE_S = 1.0
"""Smallest time between two queries for the number of worker threads of a cluster (s)."""


class ClusterLostError(OsimliteError):
    """Error for a cluster that cannot be reached any more; finished results are saved."""


class WorkerLostError(OsimliteError):
    """Error for a process that ended during a task, which ends the pool."""


class Pool(Protocol):
    """Pool of workers that accepts tasks, such as samples, and queues their results.

    Attributes:
        task_seconds: duration that a task should have (s).
    """

    task_seconds: float

    @property
    def workers(self) -> int:
        """Number of tasks that can run at a time; it can change."""

    def submit(self, tag: Any, values: Any) -> None:
        """Submit a task.

        Args:
            tag: identifies the task in `result`.
            values: argument of the work; in a sweep, samples (k, d).
        """

    def result(self, timeout: float | None = None) -> tuple[Any, Any]:
        """Return the next finished task.

        Args:
            timeout: longest time to wait (s); None waits without limit.

        Returns:
            The tag of the task and its result, in a sweep a block of results.

        Raises:
            OsimliteError: the task failed.
            TimeoutError: no task finished in time.
        """

    def close(self) -> None:
        """Cancel the tasks that have not begun."""


@contextmanager
def open_process_pool(
    work: Callable[[Any], Any], *, workers: int | None = None, cluster: str | None = None
) -> Iterator[Pool]:
    """Open a pool of local processes or of the workers of a cluster, and close it at the end.

    Args:
        work: function that runs for each task; it must be picklable.
        workers: number of local processes; default one for each core.
        cluster: address of a Dask scheduler; default local processes.

    Yields:
        Open pool, which accepts tasks.

    Raises:
        SettingError: both a cluster and a number of workers are given, or the number is below one.
        OsimliteError: the cluster cannot be reached.
        MissingDependency: dask.distributed is not installed.
    """
    if cluster is not None and workers is not None:
        raise SettingError("a cluster has a fixed number of workers; remove --workers")
    pool: Pool = (
        ProcessPool(work, count_workers(workers)) if cluster is None else ClusterPool(work, cluster)
    )
    with closing(pool):
        yield pool


def count_workers(workers: int | None) -> int:
    """Return the requested number of workers, by default the number of cores.

    Raises:
        SettingError: the number is below one.
    """
    if workers is not None and workers < 1:
        raise SettingError(f"the number of workers must be at least 1, not {workers}")
    return workers or count_cores()


class LocalPool:
    """Executor that queues finished tasks."""

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
        """Start a task in a worker thread or process.

        Args:
            tag: value that is returned with the result.
            values: argument of the work.
        """
        # Processes that start now inherit the blocked signal, so that Ctrl-C does not reach them.
        with _delay_interrupts(), _report_lost_workers():
            future = self._executor.submit(self._work, values)
        future.add_done_callback(lambda finished_future: self._done.put((tag, finished_future)))

    def result(self, timeout: float | None = None) -> tuple[Any, Any]:
        """Return the tag and the result of the next finished task.

        Returns:
            The tag of the task and its result.
        """
        tag, future = _get_from_queue(self._done, timeout)
        with _report_lost_workers():
            return tag, future.result()

    def close(self) -> None:
        """Cancel the tasks that have not begun, and wait for the others."""
        self._executor.shutdown(cancel_futures=True)


@contextmanager
def _report_lost_workers() -> Iterator[None]:
    """Raise WorkerLostError with advice if a process has ended.

    Raises:
        WorkerLostError: a process of the pool has ended.
    """
    try:
        yield
    except BrokenExecutor:
        # New processes import the main module of the program again.
        raise WorkerLostError(
            "a worker process of the sweep has ended unexpectedly; in a script, start the sweep "
            "under if __name__ == '__main__':, and continue an interrupted sweep with --resume"
        ) from None


class ProcessPool(LocalPool):
    """Pool of processes, for work that holds Python's global lock."""

    def __init__(self, work: Callable[[Any], Any], count: int) -> None:
        protect_processes()
        # Windows can wait for 61 processes at most. Ctrl-C is for the main process only.
        executor = ProcessPoolExecutor(min(count, 61), get_context("spawn"), _prepare_worker)
        super().__init__(executor, work, count)


class ClusterPool:
    """Pool of the workers of a Dask cluster; a task whose worker is lost is submitted again.

    Args:
        work: function that runs for each task. It is sent with every task, so that new workers can
            join at any time.
        address: address of the scheduler.
    """

    task_seconds = 1.0

    def __init__(self, work: Callable[[Any], Any], address: str) -> None:
        distributed = require("distributed", extra="sweep", purpose="a sweep on a cluster")
        _check_address(address)
        # Dask logs pages about a lost scheduler; one error message replaces them.
        logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
        self._work, self._address = work, address
        self._done: SimpleQueue[tuple[Any, Any]] = SimpleQueue()
        self._tasks: dict[Any, tuple[Any, Any, int, Any]] = {}
        self._threads = 0
        self._query_time = 0.0
        try:
            self._client: Any = distributed.Client(
                address, timeout=min(10, CLUSTER_TIMEOUT_S), set_as_default=False
            )
        except (OSError, ValueError, TimeoutError) as error:
            reason = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise ClusterLostError(
                f"there is no Dask scheduler at '{address}' ({reason}); start one with: dask scheduler"
            ) from None
        try:
            self._client.wait_for_workers(1, timeout=CLUSTER_TIMEOUT_S)
        except TimeoutError:
            self._client.close()
            raise ClusterLostError(
                f"the Dask scheduler at '{address}' has no workers; start them with: dask worker {address}"
            ) from None

    @property
    def workers(self) -> int:
        """Threads of all workers, at least one."""
        if time.monotonic() - self._query_time > WORKER_COUNT_AGE_S:
            # A scheduler that does not answer can come back: the client retries for some time, and
            # `result` raises an error if it gives up.
            with suppress(OSError, TimeoutError):
                self._threads = sum(self._client.nthreads().values())
            self._query_time = time.monotonic()
        return max(1, self._threads)

    def submit(self, tag: Any, values: Any) -> None:
        """Start a task on the cluster.

        Args:
            tag: value that is returned with the result.
            values: argument of the work.
        """
        self._submit_task(tag, values, 0)

    def _submit_task(self, tag: Any, values: Any, losses: int) -> None:
        """Submit a task that has lost its worker `losses` times."""
        try:
            future = self._client.submit(
                run_remote_task, self._work, values, osimlite.__version__, pure=False
            )
        except Exception as error:
            if type(error).__name__ == "ClosedClientError":
                raise self._make_lost_error() from None
            raise
        self._tasks[future.key] = tag, values, losses, future
        future.add_done_callback(self._done.put)

    def result(self, timeout: float | None = None) -> tuple[Any, Any]:
        """Return the tag and the result of the next finished task.

        Returns:
            The tag of the task and its result.

        Raises:
            OsimliteError: the task crashed several workers, a worker cannot run it, or the task
                itself raised the error.
            ClusterLostError: the scheduler does not answer any more.
            TimeoutError: no task finishes before `timeout` (s) ends.
        """
        from distributed.scheduler import KilledWorker

        while True:
            future = _get_from_queue(self._done, timeout)
            tag, values, losses, _ = self._tasks.pop(future.key)
            try:
                return tag, future.result(timeout=60)
            except KilledWorker:
                if losses + 1 >= MAX_TASK_LOSSES:
                    raise OsimliteError(
                        f"a task crashed {MAX_TASK_LOSSES} workers; read their logs, then continue with --resume"
                    ) from None
                self._submit_task(tag, values, losses + 1)
            except (CancelledError, OSError, TimeoutError):
                raise self._make_lost_error() from None
            except OsimliteError as error:
                error.message = f"on the cluster: {error.message}"
                raise
            except Exception as error:
                if type(error).__name__ in ("FutureCancelledError", "CommClosedError"):
                    raise self._make_lost_error() from None
                raise OsimliteError(
                    f"a worker cannot run its task ({type(error).__name__}: {error}); install the modules of this "
                    "machine there, then continue with --resume"
                ) from error

    def _make_lost_error(self) -> ClusterLostError:
        """Return the error for a scheduler that does not answer any more."""
        return ClusterLostError(
            f"the Dask scheduler at '{self._address}' does not answer any more; continue with --resume"
        )

    def close(self) -> None:
        """Cancel the tasks that have not begun."""
        # Dask cancels futures that nothing refers to.
        self._tasks.clear()
        self._client.close()


def _check_address(address: str) -> None:
    """Check an address before a client is created, because a client takes long to give up.

    Raises:
        SettingError: it is not the address of a scheduler.
    """
    core = require("distributed.core", extra="sweep", purpose="a sweep on a cluster")
    comm = require("distributed.comm", extra="sweep", purpose="a sweep on a cluster")
    try:
        comm.get_address_host_port(core.coerce_to_address(address))
    except ValueError as error:
        raise SettingError(
            f"'{address}' is not an address of a Dask scheduler ({error}); use one such as tcp://127.0.0.1:8786"
        ) from None


def _get_from_queue(queue: SimpleQueue[Any], timeout: float | None) -> Any:
    """Return the next item of a queue, and wait until there is one.

    Raises:
        TimeoutError: the queue has no item before the timeout (s) ends.
    """
    from queue import Empty

    try:
        return queue.get(timeout=timeout)
    except Empty:
        raise TimeoutError from None


def _prepare_worker() -> None:
    """Ignore Ctrl-C in this process, and print warnings of osimlite as the commands do."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # The main process shows the messages of results.
    warnings.simplefilter("ignore", ResultWarning)
    format_other_warning = warnings.formatwarning

    def format_warning(
        message: Warning | str,
        category: type[Warning],
        filename: str,
        lineno: int,
        line: str | None = None,
    ) -> str:
        if issubclass(category, DoubtfulWarning):
            return f"osimlite: {message}\n"
        return format_other_warning(message, category, filename, lineno, line)

    warnings.formatwarning = format_warning


@contextmanager
def _delay_interrupts() -> Iterator[None]:
    """Delay Ctrl-C until the context ends, on systems with signal masks."""
    if sys.platform == "win32":
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def run_remote_task(work: Callable[[Any], Any], values: Any, version: str) -> Any:
    """Run a task on a worker of a cluster.

    Args:
        work: function of the task.
        values: argument of the function.
        version: version of osimlite that submitted the task.

    Returns:
        Result of the function.

    Raises:
        OsimliteError: the version differs from that of the worker, or the work fails.
    """
    if version != osimlite.__version__:
        raise OsimliteError(
            f"a worker has osimlite {osimlite.__version__}, but the sweep was started by osimlite {version}; "
            "install the same version on all workers"
        )
    return work(values)
