"""Workers that run samples: threads, processes or a Dask cluster, with the same results."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager
from functools import partial

from osimlite.base.pools import LocalPool, Pool, count_workers, open_process_pool
from osimlite.studies.sweep.plan import Plan
from osimlite.studies.sweep.runner import Block, Runner
from osimlite.studies.sweep.variables import Floats


@contextmanager
def make_pool(
    plan: Plan, *, workers: int | None = None, cluster: str | None = None
) -> Iterator[Pool]:
    """Open a pool of workers for a plan; without a cluster, on this machine.

    Args:
        plan: plan to run.
        workers: number of threads or processes; by default one per core.
        cluster: address of a Dask scheduler, such as `tcp://127.0.0.1:8786`; None for workers on
            this machine.

    Yields:
        Pool that runs samples of the plan; it is closed at the end of the context.

    Raises:
        SettingError: the settings exclude each other.
        OsimliteError: the cluster cannot be reached.
        MissingDependency: dask.distributed is not installed.
    """
    # Other engines hold Python's lock, so that threads would not run in parallel.
    if cluster is None and plan.engine == "compiled":
        with closing(ThreadPool(plan, count_workers(workers))) as threads:
            yield threads
        return
    # An invalid plan fails here, not in a worker.
    Runner(plan)
    with open_process_pool(
        partial(run_packed, plan.pack()), workers=workers, cluster=cluster
    ) as pool:
        yield pool


class ThreadPool(LocalPool):
    """Pool of threads: the compiled engine releases Python's lock, so that they run in parallel.

    Args:
        plan: plan to run.
        count: number of threads.
    """

    def __init__(self, plan: Plan, count: int) -> None:
        # An invalid plan fails here; otherwise this runner serves the first thread.
        unused_runners = [Runner(plan)]

        def begin() -> None:
            try:
                _local.runner = unused_runners.pop()
            except IndexError:
                _local.runner = Runner(plan)

        executor = ThreadPoolExecutor(count, initializer=begin)
        super().__init__(executor, lambda values: _thread_runner(plan).run(values), count)


_local = threading.local()


def _thread_runner(plan: Plan) -> Runner:
    """Return the runner of this thread, which is cached."""
    cached: Runner | None = getattr(_local, "runner", None)
    # A thread of a process may serve another plan later.
    if cached is None or cached.plan is not plan:
        cached = _local.runner = Runner(plan)
    return cached


def run_packed(packed: bytes, values: Floats) -> Block:
    """Run samples of a packed plan in a worker process.

    Args:
        packed: plan from `Plan.pack`.
        values: values of the variables of the samples (k, d).

    Returns:
        Results of the samples, in their order.

    Raises:
        OsimliteError: the plan cannot be run.
    """
    # Unpacking and compiling a plan takes longer than most runs.
    if getattr(_local, "packed", None) != packed:
        _local.packed = packed
        _local.plan = Plan.unpack(packed)
    return _thread_runner(_local.plan).run(values)
