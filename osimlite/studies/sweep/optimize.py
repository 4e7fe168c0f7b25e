"""The best start, or the best numbers, of a model: a search whose points are run like those of a sweep."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.base.files import open_file, prepare_folder, read_file, write_atomically
from osimlite.base.lazy import make_notebook_repr
from osimlite.base.pools import Pool
from osimlite.base.records import dataclass, replace
from osimlite.base.require import require
from osimlite.base.text import format_count
from osimlite.errors import OsimliteError, SettingError, SimulationError
from osimlite.io.document.printer import write
from osimlite.studies.sweep import registry
from osimlite.studies.sweep.measures import measure_name
from osimlite.studies.sweep.plan import Plan
from osimlite.studies.sweep.pools import make_pool
from osimlite.studies.sweep.results import (
    KEY,
    Partial,
    ResultTable,
    damage_told,
    make_schema,
    partial_of,
    protect_results,
    refuse_overwrite,
)
from osimlite.studies.sweep.run import describe_interruption
from osimlite.studies.sweep.runner import FAILED, Block
from osimlite.studies.sweep.search import BudgetExhausted, Search, gradient, method_named
from osimlite.studies.sweep.variables import Floats, refuse_counts
from osimlite.studies.sweep.variants import Variants

HISTORY, BEST, SUMMARY, PAR = "history.parquet", "best.osim", "summary.json", "best.par"
"""What a search writes into its folder."""

Progress = Callable[[float, float], object]
"""Called with the number of evaluations that are done, and of all that are allowed."""


@dataclass(frozen=True)
class Objective:
    """What is wanted of a run.

    Attributes:
        measure: name of a measure, ``module:function``, or a function.
        is_maximized: whether more is better; by default for the measures that are registered so.
    """

    measure: Any
    is_maximized: bool | None = None

    @property
    def sign(self) -> float:
        """What makes a cost of the measure."""
        known = registry.measure_named(measure_name(self.measure))
        wanted = (
            bool(known and known.is_maximized) if self.is_maximized is None else self.is_maximized
        )
        return -1.0 if wanted else 1.0


@dataclass(frozen=True)
class Optimum(ResultTable):
    """The best that was found; as a table, all evaluations.

    Attributes:
        value: of the objective.
        values: of the variables, by name.
        evaluations: that the search took, with those of before.
        evaluation: number of the best.
        ended: why the search ended.
        model: file of the model, with its start as default values and speeds.
        history: file of all evaluations.
    """

    value: float
    values: dict[str, float]
    evaluations: int
    evaluation: int
    ended: str
    model: Path
    history: Path

    _repr_html_ = make_notebook_repr("optimum")

    def _results(self) -> Path:
        return self.history


def optimize(
    plan: Plan,
    objective: Objective,
    folder: str | Path,
    *,
    method: str = "cma",
    budget: int = 1000,
    popsize: int | None = None,
    seed: int = 0,
    sigma: float = 0.25,
    tolerance: float | None = None,
    is_bounded: bool = True,
    start: Sequence[float] | Mapping[str, float] | None = None,
    resume: bool = False,
    force: bool = False,
    workers: int | None = None,
    cluster: str | None = None,
    progress: Progress | None = None,
) -> Optimum:
    """Look for the values of the variables that serve an objective best.

    Args:
        plan: what is run; its measures are kept in the history too.
        objective: what is wanted.
        folder: where `history.parquet`, `best.osim`, `summary.json`, and of a controller
            `best.par`, are written.
        method: one of `METHODS` in :mod:`osimlite.studies.sweep.search`.
        budget: runs that are allowed.
        popsize: runs between two decisions of the method.
        seed: what makes the search the same again.
        sigma: how far from where it begins the method looks at first, as a fraction of the ranges;
            `sobol-cma` has looked all over them before.
        tolerance: of the cost and of the points (as fractions of the ranges), at which the search
            ends.
        is_bounded: whether the ranges are bounds, or say only where to begin.
        start: values to begin at, of all variables or by name; for others those of the model where
            they are within the ranges, else the middle.
        resume: go on with an interrupted search, or with a finished one and a larger budget.
        force: replace what another search has left in the folder.
        workers: as of a sweep.
        cluster: as of a sweep.
        progress: called as runs are done.

    Raises:
        Interrupted: by the keyboard; the search can be resumed.
        SimulationError: no run came to its end.
        OsimliteError: as of a sweep.
    """
    look = method_named(method)
    refuse_counts(plan.variables)
    free = [index for index, item in enumerate(plan.variables) if not item.is_fixed]
    if not free:
        raise SettingError("there is nothing to search: every variable has one value only")
    if budget < 1 or (popsize is not None and popsize < 2):
        raise SettingError(
            "a search has a budget of at least one run, and a population of at least two"
        )
    if not 0 <= seed < 2**32:
        raise SettingError(f"the seed is a whole number from 0 to {2**32 - 1}, not {seed}")
    if tolerance is not None and not (isfinite(tolerance) and tolerance >= 0.0):
        raise SettingError(f"the tolerance is a number from 0 on, not {tolerance:g}")
    if not (isfinite(sigma) and sigma > 0.0):
        raise SettingError(f"the first search distance is positive, not {sigma:g}")
    names = [measure_name(spec) for spec in (objective.measure, *plan.measures)]
    measures = tuple(dict(zip(names, (objective.measure, *plan.measures), strict=True)).values())
    plan = replace(plan, measures=measures)
    variants = Variants(plan)
    point = _resolve_start(plan, variants, free, start, is_bounded)
    wanted = {
        **plan.settings(),
        "objective": names[0],
        "sign": objective.sign,
        "method": method,
        "popsize": popsize,
        "seed": seed,
        "sigma": sigma,
        "tolerance": tolerance,
        "bounded": is_bounded,
        "start": point.tolist(),
    }
    with (
        prepare_folder(folder) as where,
        make_pool(plan, workers=workers, cluster=cluster) as workforce,
    ):
        evaluations = _Evaluations(
            plan, free, objective.sign, is_bounded, budget, workforce, progress
        )
        partial = _open_history(
            where / HISTORY,
            make_schema(plan.columns("evaluation", "batch"), wanted),
            resume,
            force,
            evaluations,
        )
        evaluations.partial, ended = partial, ""
        try:
            with suppress(BudgetExhausted):
                slopes = evaluations.slopes(registry.gradients(plan)) if look is gradient else None
                search = Search(point, sigma, popsize, seed, is_bounded, budget, tolerance, slopes)
                ended = look(evaluations.ask, search)
            partial.finish()
        except KeyboardInterrupt:
            raise describe_interruption(partial, format_count(partial.rows, "run")) from None
        finally:
            partial.close()
    ended = ended or f"as many runs as were allowed: {evaluations.count}"
    return _finish_search(where, plan, variants, evaluations, wanted, ended)


def _resolve_start(
    plan: Plan,
    variants: Variants,
    free: Sequence[int],
    start: Sequence[float] | Mapping[str, float] | None,
    is_bounded: bool,
) -> Floats:
    if not isinstance(start, Mapping):
        if start is not None and len(start) != len(plan.variables):
            raise SettingError(
                f"the start has one number for each of the {len(plan.variables)} variables, not {len(start)}"
            )
        start = dict(zip((item.name for item in plan.variables), start or (), strict=False))
    result, present = [], variants.present()
    for place in free:
        item = plan.variables[place]
        value = start.get(item.name, present[place])
        within = value is not None and (item.low <= value <= item.high or not is_bounded)
        if item.name in start and not within:
            raise SettingError(
                f"'{item.name}' cannot start at {value}, outside {item.low:g} to {item.high:g}"
            )
        if value is not None and item.is_log and value <= 0.0:
            within = False
        result.append(item.fraction(value) if value is not None and within else 0.5)
    return np.array(result)


def read_best_values(folder: str | Path) -> dict[str, float]:
    """The best values that another search has left in its folder, by the names of its variables.

    Raises:
        OsimliteError: there are none.
    """
    path = Path(folder) / SUMMARY
    try:
        return {name: float(value) for name, value in json.loads(read_file(path))["values"].items()}
    except (OsimliteError, ValueError, LookupError, AttributeError, TypeError, RecursionError):
        raise OsimliteError(
            f"'{path}' is not the summary of a search; name the folder of one"
        ) from None


def _open_history(
    path: Path, table: Any, resume: bool, force: bool, evaluations: _Evaluations
) -> Partial:
    """The history, and what is in it already."""
    if path.is_file() and not force and not (resume and partial_of(path).exists()):
        protect_results(path, json.loads(table.metadata[KEY]))
        pq = require("pyarrow.parquet", extra="sweep", purpose="a table of results")
        with damage_told(path), open_file(path) as stream:
            # A program that ends while pyarrow's threads do is killed by their C++ now and then.
            before = pq.ParquetFile(stream, page_checksum_verification=True).read(use_threads=False)
        if resume:
            partial = Partial(path, table)
            for batch in before.to_batches():
                partial.add(batch.columns)
                evaluations.remember(batch)
            return partial
        if before.num_rows > evaluations.budget:
            raise SettingError(
                f"'{path}' has {before.num_rows} runs of this search, more than are asked for now; keep them with "
                "--resume, or replace them with --force"
            )
    if not force and not path.exists() and not partial_of(path).exists():
        refuse_overwrite(path.with_name(name) for name in (BEST, SUMMARY, PAR))
    partial = Partial(path, table, resume=resume)
    partial.read(evaluations.remember)
    return partial


class _Evaluations:
    """Answers what a method asks: from the history while there is one, then by running."""

    partial: Partial

    def __init__(
        self,
        plan: Plan,
        free: Sequence[int],
        sign: float,
        is_bounded: bool,
        budget: int,
        workforce: Pool,
        progress: Progress | None,
    ) -> None:
        self.plan, self.free, self.sign, self.is_bounded = plan, list(free), sign, is_bounded
        self.budget, self.pool, self.progress = budget, workforce, progress
        self.objective = measure_name(plan.measures[0])
        self.count = self.batches = 0
        self.worst = 0.0
        self.best: tuple[float, int, list[float]] | None = None
        self.reason: str | None = None
        self._history: list[tuple[list[float], str, float]] = []

    def remember(self, batch: Any) -> None:
        """Take what was found before."""
        columns = batch.to_pydict()
        values = [columns[item.name] for item in self.plan.variables]
        result = zip(
            zip(*values, strict=True), columns["status"], columns[self.objective], strict=True
        )
        self._note(columns["status"], columns["reason"])
        self._history += [(list(row), status, value) for row, status, value in result]
        # What is there is not forgotten, even if fewer runs are asked for now.
        self.budget = max(self.budget, len(self._history))

    def _note(self, status: Sequence[str], reasons: Sequence[str | None]) -> None:
        """Keep the first reason of a failure."""
        failed = (why for word, why in zip(status, reasons, strict=True) if word == FAILED)
        self.reason = self.reason or next(failed, None)

    def ask(self, points: Floats) -> Floats:
        """Costs (k,) of points (k, d) of the cube of the free variables; of those that the budget allows at least."""
        wanted, points = len(points), points[: self.budget - self.count]
        if len(points) == 0:
            raise BudgetExhausted
        values = self._values(points)
        known = self._history[self.count : self.count + len(points)]
        if any(row != list(new) for (row, _, _), new in zip(known, values.tolist(), strict=False)):
            raise SettingError(
                "the search takes another way than before, so that it cannot go on; another version of its library "
                "may be installed, so start it anew in another folder"
            )
        rest = values[len(known) :]
        if len(rest):
            known = known + self._run(rest, self.count + len(known))
        costs = [self._cost(status, value) for _, status, value in known]
        for number, (cost, row) in enumerate(zip(costs, values.tolist(), strict=True)):
            _, status, value = known[number]
            if status != FAILED and isfinite(value) and (self.best is None or cost < self.best[0]):
                self.best = cost, self.count + number, row
        self.count += len(points)
        self.batches += 1
        if self.progress is not None:
            self.progress(self.count, self.budget)
        if len(points) < wanted:
            raise BudgetExhausted
        return np.array(costs)

    def slopes(self, gradients: Any) -> Callable[[Floats], Floats]:
        """The derivatives of the cost by points (d,) of the cube.

        Args:
            gradients: what finds those of the objective, see
                :func:`osimlite.studies.sweep.registry.gradients`.
        """

        def at(point: Floats) -> Floats:
            (values,) = self._values(point[None])
            stretched = [self.plan.variables[place].stretch(values[place]) for place in self.free]
            found: Floats = gradients.at(values.tolist(), self.free)
            return self.sign * found * stretched

        return at

    def _values(self, points: Floats) -> Floats:
        """Values of all variables (k, v) at points (k, d) of the cube of the free ones."""
        values = np.tile([item.low for item in self.plan.variables], (len(points), 1))
        for column, place in enumerate(self.free):
            item = self.plan.variables[place]
            values[:, place] = (item.at if self.is_bounded else item.beyond)(points[:, column])
        return values

    def _cost(self, status: str, value: float) -> float:
        """Of a run; what fails is worse than anything before."""
        if status == FAILED or not isfinite(value):
            return self.worst + max(1.0, abs(self.worst))
        cost = self.sign * value
        self.worst = max(self.worst, cost)
        return cost

    def _run(self, values: Floats, first: int) -> list[tuple[list[float], str, float]]:
        size = max(1, -(-len(values) // (2 * self.pool.workers)))
        starts = range(0, len(values), size)
        for place in starts:
            self.pool.submit(place, values[place : place + size])
        blocks: dict[int, Block] = dict(self.pool.result() for _ in starts)
        block = Block.join([blocks[place] for place in starts])
        numbers = np.arange(first, first + len(values)), np.full(len(values), self.batches)
        self.partial.add([*numbers, *values.T, *block.columns])
        self._note(block.status, block.reasons)
        return list(
            zip(values.tolist(), block.status, block.measures[self.objective].tolist(), strict=True)
        )


def _finish_search(
    where: Path,
    plan: Plan,
    variants: Variants,
    evaluations: _Evaluations,
    wanted: dict[str, Any],
    ended: str,
) -> Optimum:
    if evaluations.best is None:
        if evaluations.reason:
            raise SimulationError(f"no run came to its end: {evaluations.reason}")
        raise SimulationError(f"'{wanted['objective']}' is not a finite number in any run")
    cost, number, row = evaluations.best
    write(variants.build_model(row), where / BEST)
    if plan.controller is not None:
        write_atomically(where / PAR, variants.controller(row).par())
    value = evaluations.sign * cost
    named = {item.name: x for item, x in zip(plan.variables, row, strict=True)}
    result = Optimum(value, named, evaluations.count, number, ended, where / BEST, where / HISTORY)
    summary = {
        "objective": wanted["objective"],
        "value": value,
        "values": named,
        "evaluation": number,
        "evaluations": evaluations.count,
        "ended": ended,
        "settings": wanted,
    }
    write_atomically(where / SUMMARY, json.dumps(summary, indent=2) + "\n")
    return result
