"""Sweep: run every sample, and save the results in order, also through interruptions."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.base.lazy import make_notebook_repr
from osimlite.base.pools import Pool
from osimlite.base.records import dataclass, field
from osimlite.base.text import format_count
from osimlite.errors import OsimliteError, SettingError
from osimlite.simulation.interrupts import defer_sigint
from osimlite.studies.sweep.plan import Plan
from osimlite.studies.sweep.pools import make_pool
from osimlite.studies.sweep.results import (
    PartialTable,
    ResultTable,
    get_partial_path,
    make_schema,
    protect_results,
)
from osimlite.studies.sweep.runner import Block
from osimlite.studies.sweep.sampling import Samples
from osimlite.studies.sweep.variables import Floats

Progress = Callable[[float, float], object]
"""Callback with the number of runs that are done, and of all."""

INITIAL_TASK_SIZE = 4
"""Samples of the first tasks, from which the duration of a run is measured."""
MAX_TASK_SIZE = 4096
"""Most samples of a task."""
OTHER_TABLE_ENDINGS = (
    ".csv",
    ".tsv",
    ".txt",
    ".json",
    ".xlsx",
    ".feather",
    ".arrow",
    ".sto",
    ".mot",
)
"""Endings of other table formats, which a Parquet file must not have."""

TASKS_PER_WORKER = 3
"""Tasks per worker that are submitted at a time; few, because a lost worker loses them."""

SAVE_SECONDS = 2.0
"""Interval (s) at which results are saved, which bounds the work that is lost if the program is
killed.
"""


class SweepInterruption(OsimliteError):
    """Error of an interrupted sweep or search, whose results so far are saved."""

    exit_code = 130


def describe_interruption(partial: PartialTable, runs_text: str) -> SweepInterruption:
    """Return the error for an interrupted sweep or search.

    Args:
        partial: table with the rows so far.
        runs_text: number of runs as text.
    """
    if partial.rows == 0:
        return SweepInterruption("interrupted before any run was saved")
    return SweepInterruption(
        f"interrupted after {runs_text}, which are in '{partial.partial}'; continue with --resume"
    )


@dataclass
class Outcome(ResultTable):
    """Outcome of a sweep.

    Attributes:
        path: Parquet file of the results.
        count: number of runs in it.
        before: number of runs that existed before.
        status: number of new runs by status.
        reasons: number of failed runs by reason.
        seconds: duration of the sweep (s).
    """

    path: Path
    count: int
    before: int = 0
    status: Counter[str] = field(default_factory=Counter)
    reasons: Counter[str] = field(default_factory=Counter)
    seconds: float = 0.0

    _repr_html_ = make_notebook_repr("runs")

    def _get_results_path(self) -> Path:
        """Return the path of the table of results."""
        return self.path


def collect_settings(plan: Plan, samples: Samples) -> dict[str, Any]:
    """Return all settings on which the results of a sweep depend.

    Args:
        plan: plan of the runs.
        samples: samples of the sweep.

    Returns:
        Value per setting, as data for JSON.
    """
    return {
        **plan.settings(),
        "sampler": samples.sampler,
        "samples": samples.count,
        "seed": samples.seed,
    }


def sweep(
    plan: Plan,
    samples: Samples,
    output: str | Path,
    *,
    resume: bool = False,
    force: bool = False,
    workers: int | None = None,
    cluster: str | None = None,
    progress: Progress | None = None,
) -> Outcome:
    """Run all samples of a plan, and write one row for each.

    The rows are in the order of the samples, and do not depend on the number and kind of workers.
    Until all are done, they are in `<output>.partial`.

    Args:
        plan: plan of the runs.
        samples: samples to run.
        output: Parquet file to write.
        resume: whether to continue an interrupted sweep.
        force: whether to overwrite results of other settings, or any other file of this name.
        workers: number of threads or processes; by default one per core.
        cluster: address of a Dask scheduler whose workers run the samples instead.
        progress: callback during the sweep.

    Returns:
        Path of the results, numbers of new runs by status, reasons of failures, and the duration.

    Raises:
        SweepInterruption: the user has pressed Ctrl-C; the sweep can be resumed.
        SettingError: the name of the output is that of another kind of table, or there are results
            of other settings.
        OsimliteError: the model cannot be simulated, or the cluster cannot be reached.
    """  # noqa: DOC501 - a function makes the SweepInterruption
    path = Path(output)
    started = time.perf_counter()
    if path.suffix.lower() in OTHER_TABLE_ENDINGS:
        parquet_name = path.with_suffix(".parquet").name
        raise SettingError(
            f"the results are a Parquet file, not '{path.name}'; name the file '{parquet_name}'"
        )
    settings = collect_settings(plan, samples)
    table = make_schema(plan.columns("run"), settings)
    # With a partial file, finished results of other settings were confirmed before the interruption.
    if path.is_file() and not force and not (resume and get_partial_path(path).exists()):
        protect_results(path, settings)
        # The sweep is complete already.
        if resume:
            return Outcome(path, samples.count, samples.count)
    with make_pool(plan, workers=workers, cluster=cluster) as workforce:
        partial = PartialTable(path, table, resume=resume)
        outcome = Outcome(path, samples.count, partial.rows)
        try:
            _Dispatcher(samples, workforce, partial, outcome, progress).run()
            partial.finish()
        except KeyboardInterrupt:
            raise describe_interruption(
                partial, f"{partial.rows} of {format_count(samples.count, 'run')}"
            ) from None
        finally:
            partial.close()
    outcome.seconds = time.perf_counter() - started
    return outcome


class _Dispatcher:
    """Distributor of samples to workers, which saves the results in the order of the samples.

    Args:
        samples: samples to run.
        workforce: pool of workers.
        partial: table for the rows.
        outcome: outcome to update.
        progress: callback during the sweep.
    """

    def __init__(
        self,
        samples: Samples,
        workforce: Pool,
        partial: PartialTable,
        outcome: Outcome,
        progress: Progress | None,
    ) -> None:
        self.samples = samples
        self.pool = workforce
        self.partial = partial
        self.outcome = outcome
        self.progress = progress
        self.next = self.saved = partial.rows
        self.pending_count = 0
        self.size = INITIAL_TASK_SIZE
        self.done: dict[int, tuple[Floats, Block]] = {}
        self.values: dict[int, Floats] = {}
        self.last_saved = time.monotonic()

    def run(self) -> None:
        """Run all samples; results so far are saved even if an exception ends it."""
        try:
            self._report_progress()
            while self.saved < self.samples.count:
                self._submit_tasks()
                first_sample, block = self.pool.result()
                self.pending_count -= 1
                self.done[first_sample] = self.values.pop(first_sample), block
                self._record_block(block)
                is_last = not self.pending_count and self.next >= self.samples.count
                if is_last or time.monotonic() - self.last_saved > SAVE_SECONDS:
                    self._save_rows()
        # Also Ctrl-C: results so far are worth keeping.
        except BaseException:
            self._save_rows()
            raise

    def _submit_tasks(self) -> None:
        """Submit tasks until the workers have enough of them."""
        # Results after a slow run wait in memory for it, so that their number must be bounded.
        farthest = self.saved + 64 * max(MAX_TASK_SIZE, self.size)
        while (
            self.next < min(self.samples.count, farthest)
            and self.pending_count < TASKS_PER_WORKER * self.pool.workers
        ):
            values = self.samples.make_block(self.next, self.size)
            self.values[self.next] = values
            self.pool.submit(self.next, values)
            self.next += len(values)
            self.pending_count += 1

    def _record_block(self, block: Block) -> None:
        """Update the outcome, and adapt the size of tasks to the duration of runs.

        The last tasks are smaller, so that all workers end at about the same time.
        """
        # The clock may not advance during very short tasks.
        seconds_per_run = max(block.seconds, 1e-6) / max(len(block.status), 1)
        remaining_count = self.samples.count - self.next
        fair_size = (
            -(-remaining_count // (TASKS_PER_WORKER * self.pool.workers)) if remaining_count else 1
        )
        timed_size = int(self.pool.task_seconds / seconds_per_run)
        self.size = max(
            1, min(timed_size, 4 * self.size, MAX_TASK_SIZE, max(fair_size, INITIAL_TASK_SIZE))
        )
        self.outcome.status.update(block.status)
        self.outcome.reasons.update(
            reason
            for status, reason in zip(block.status, block.reasons, strict=True)
            if status == "failed" and reason
        )
        # Reasons that contain numbers differ from run to run and must not fill the memory.
        if len(self.outcome.reasons) > 1000:
            self.outcome.reasons = Counter(dict(self.outcome.reasons.most_common(100)))
        self._report_progress()

    def _report_progress(self) -> None:
        """Report how many runs are finished, those of earlier sessions included."""
        if self.progress is not None:
            finished_count = self.outcome.before + sum(self.outcome.status.values())
            self.progress(finished_count, self.samples.count)

    @defer_sigint()
    def _save_rows(self) -> None:
        """Write the rows before which no row is missing."""
        values: list[Floats] = []
        blocks: list[Block] = []
        first_row = self.saved
        # Only rows without a gap before them are written.
        while self.saved in self.done:
            block_values, block = self.done.pop(self.saved)
            values.append(block_values)
            blocks.append(block)
            self.saved += len(block_values)
        self.last_saved = time.monotonic()
        if blocks:
            numbers = np.arange(first_row, self.saved)
            self.partial.add([numbers, *np.concatenate(values).T, *Block.join(blocks).columns])
