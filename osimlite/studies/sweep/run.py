"""A sweep: every sample run, every result in its place, whatever happens in between."""

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
from osimlite.errors import OsimliteError, SettingError
from osimlite.simulation.interrupts import defer_sigint
from osimlite.studies.sweep.plan import Plan
from osimlite.studies.sweep.pools import make_pool
from osimlite.studies.sweep.results import (
    Partial,
    ResultTable,
    make_schema,
    partial_of,
    protect_results,
)
from osimlite.studies.sweep.runner import Block
from osimlite.studies.sweep.sampling import Samples
from osimlite.studies.sweep.variables import Floats

Progress = Callable[[float, float], object]
"""Called with the number of runs that are done, and of all."""

FIRST_TASK, LARGEST_TASK = 4, 4096
OTHER_TABLES = (".csv", ".tsv", ".txt", ".json", ".xlsx", ".feather", ".arrow", ".sto", ".mot")
"""Endings of files of which nobody expects Parquet."""

AHEAD = 3
"""So many tasks for each worker are under way; a lost worker takes no more with it."""

SAVE_SECONDS = 2.0
"""So often results are saved; at most so much work is done again after the program was killed."""


class Interrupted(OsimliteError):
    """A sweep was stopped before its end; what was done is saved."""

    exit_code = 130


def describe_interruption(partial: Partial, runs: str) -> Interrupted:
    """What is said of a file that is not whole, after so many runs."""
    if partial.rows == 0:
        return Interrupted("interrupted before any run was saved")
    return Interrupted(
        f"interrupted after {runs}, which are in '{partial.partial}'; go on with --resume"
    )


@dataclass
class Outcome(ResultTable):
    """What a sweep did.

    Attributes:
        path: of the results.
        count: of runs in them.
        before: of runs that were there when it began.
        status: how many ended how, of those that it did itself.
        reasons: why runs failed, with their number.
        seconds: that it took.
    """

    path: Path
    count: int
    before: int = 0
    status: Counter[str] = field(default_factory=Counter)
    reasons: Counter[str] = field(default_factory=Counter)
    seconds: float = 0.0

    _repr_html_ = make_notebook_repr("runs")

    def _results(self) -> Path:
        return self.path


def settings(plan: Plan, samples: Samples) -> dict[str, Any]:
    """All that the results of a sweep depend on."""
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

    The rows are in the order of the samples, and the same however many work at them, here or
    elsewhere. Until all are there, they are kept in ``<output>.partial``.

    Args:
        plan: what is run.
        samples: with which numbers.
        output: Parquet file to write.
        resume: go on with an interrupted sweep.
        force: replace results that were made with other settings, or whatever else has that name.
        workers: threads or processes of this machine; by default one for each core.
        cluster: address of a Dask scheduler whose workers do it instead.
        progress: called as runs are done.

    Raises:
        Interrupted: by the keyboard; the sweep can be resumed.
        OsimliteError: the model cannot be simulated, there are results of other settings, or the
            cluster cannot be reached.
    """
    path, started = Path(output), time.perf_counter()
    if path.suffix.lower() in OTHER_TABLES:
        better = path.with_suffix(".parquet").name
        raise SettingError(
            f"the results are a Parquet file, not '{path.name}'; name the file '{better}'"
        )
    wanted = settings(plan, samples)
    table = make_schema(plan.columns("run"), wanted)
    # Who goes on with an interrupted sweep was asked before it began.
    if path.is_file() and not force and not (resume and partial_of(path).exists()):
        protect_results(path, wanted)
        if resume:
            return Outcome(path, samples.count, samples.count)
    with make_pool(plan, workers=workers, cluster=cluster) as workforce:
        partial = Partial(path, table, resume=resume)
        outcome = Outcome(path, samples.count, partial.rows)
        try:
            _Work(samples, workforce, partial, outcome, progress).do()
            partial.finish()
        except KeyboardInterrupt:
            raise describe_interruption(
                partial, f"{partial.rows} of {samples.count} runs"
            ) from None
        finally:
            partial.close()
    outcome.seconds = time.perf_counter() - started
    return outcome


class _Work:
    """Gives out samples, and saves what comes back in their order."""

    def __init__(
        self,
        samples: Samples,
        workforce: Pool,
        partial: Partial,
        outcome: Outcome,
        progress: Progress | None,
    ) -> None:
        self.samples, self.pool, self.partial, self.outcome = samples, workforce, partial, outcome
        self.progress = progress
        self.next = self.saved = partial.rows
        self.under_way = 0
        self.size = FIRST_TASK
        self.done: dict[int, tuple[Floats, Block]] = {}
        self.values: dict[int, Floats] = {}
        self.last_saved = time.monotonic()

    def do(self) -> None:
        try:
            self._tell()
            while self.saved < self.samples.count:
                self._give_out()
                first, block = self.pool.result()
                self.under_way -= 1
                self.done[first] = self.values.pop(first), block
                self._note(block)
                is_last = not self.under_way and self.next >= self.samples.count
                if is_last or time.monotonic() - self.last_saved > SAVE_SECONDS:
                    self._save()
        except BaseException:
            self._save()
            raise

    def _give_out(self) -> None:
        # One run that takes long must not let all that comes after it pile up.
        farthest = self.saved + 64 * max(LARGEST_TASK, self.size)
        while (
            self.next < min(self.samples.count, farthest)
            and self.under_way < AHEAD * self.pool.workers
        ):
            values = self.samples.block(self.next, self.size)
            self.values[self.next] = values
            self.pool.submit(self.next, values)
            self.next += len(values)
            self.under_way += 1

    def _note(self, block: Block) -> None:
        """Let tasks take about as long as they should; the last of them end together."""
        each = max(block.seconds, 1e-6) / max(len(block.status), 1)
        left = self.samples.count - self.next
        fair = -(-left // (AHEAD * self.pool.workers)) if left else 1
        wanted = int(self.pool.task_seconds / each)
        self.size = max(1, min(wanted, 4 * self.size, LARGEST_TASK, max(fair, FIRST_TASK)))
        self.outcome.status.update(block.status)
        self.outcome.reasons.update(
            reason
            for status, reason in zip(block.status, block.reasons, strict=True)
            if status == "failed" and reason
        )
        if len(self.outcome.reasons) > 1000:
            self.outcome.reasons = Counter(dict(self.outcome.reasons.most_common(100)))
        self._tell()

    def _tell(self) -> None:
        if self.progress is not None:
            there = self.outcome.before + sum(self.outcome.status.values())
            self.progress(there, self.samples.count)

    @defer_sigint()
    def _save(self) -> None:
        """Write the rows before which none is missing."""
        values: list[Floats] = []
        blocks: list[Block] = []
        first = self.saved
        while self.saved in self.done:
            own, block = self.done.pop(self.saved)
            values.append(own)
            blocks.append(block)
            self.saved += len(own)
        self.last_saved = time.monotonic()
        if blocks:
            numbers = np.arange(first, self.saved)
            self.partial.add([numbers, *np.concatenate(values).T, *Block.join(blocks).columns])
