"""Optimization of an objective over the variables of a plan.

Evaluations run like the samples of a sweep.
"""

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
from osimlite.studies.sweep.measures import get_measure_name
from osimlite.studies.sweep.plan import Plan
from osimlite.studies.sweep.pools import make_pool
from osimlite.studies.sweep.results import (
    SETTINGS_KEY,
    PartialTable,
    ResultTable,
    get_partial_path,
    make_schema,
    protect_results,
    refuse_overwrite,
    report_damage,
)
from osimlite.studies.sweep.run import describe_interruption
from osimlite.studies.sweep.runner import FAILED, Block
from osimlite.studies.sweep.search import OutOfBudget, Search, find_method, run_lbfgs
from osimlite.studies.sweep.variables import Floats, reject_grid_ranges
from osimlite.studies.sweep.variants import Variants

HISTORY_FILE = "history.parquet"
"""File in the output folder: table of all evaluations."""
BEST_FILE = "best.osim"
"""File in the output folder: the best model."""
SUMMARY_FILE = "summary.json"
"""File in the output folder: best values and settings."""
PAR_FILE = "best.par"
"""File in the output folder: best parameters of a controller, as SCONE reads them."""

Progress = Callable[[float, float], object]
"""Callback with the number of evaluations that are done, and of all that are allowed."""


@dataclass(frozen=True)
class Objective:
    """Measure to optimize.

    Attributes:
        measure: name of a measure, `module:function`, or a function.
        is_maximized: whether to maximize it; by default as the measure is registered, else
            minimize.
    """

    measure: Any
    is_maximized: bool | None = None

    @property
    def sign(self) -> float:
        """Factor that makes a cost of the measure: -1 to maximize, 1 to minimize."""
        registered = registry.find_measure(get_measure_name(self.measure))
        is_maximized = (
            bool(registered and registered.is_maximized)
            if self.is_maximized is None
            else self.is_maximized
        )
        return -1.0 if is_maximized else 1.0


@dataclass(frozen=True)
class Optimum(ResultTable):
    """Result of an optimization; as a table, all its evaluations.

    Attributes:
        value: best value of the objective.
        values: best values of the variables by name.
        evaluations: number of evaluations, with those before a resumption.
        evaluation: number of the best evaluation.
        ended: why the search ended.
        model: file of the best model, with its initial state as default values and speeds.
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

    def _get_results_path(self) -> Path:
        """Return the path of the table of evaluations."""
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
    """Search the values of the variables with the best objective.

    Args:
        plan: plan of the runs; its measures are columns of the history, too.
        objective: measure to optimize.
        folder: output folder for `history.parquet`, `best.osim`, `summary.json`, and `best.par` of
            a controller.
        method: one of `METHODS` in :mod:`osimlite.studies.sweep.search`.
        budget: number of runs that are allowed.
        popsize: number of runs per batch; by default that of the method.
        seed: seed of the random numbers, so that a search can be repeated.
        sigma: initial step size, as a fraction of the ranges; `sobol-cma` samples all of the ranges
            first.
        tolerance: change of the cost and of the points (as fractions of the ranges) at which the
            search ends; by default that of the method.
        is_bounded: whether the ranges are bounds; otherwise they only define the scale.
        start: values to start from, of all variables in their order or by name. Others start from
            the model if its values are within the ranges, else from the middle.
        resume: whether to continue an interrupted search, or a finished one with a larger budget.
        force: whether to overwrite the results of another search in the folder.
        workers: number of threads or processes; by default one per core.
        cluster: address of a Dask scheduler whose workers run the evaluations; None for workers on
            this machine.
        progress: callback during the search.

    Returns:
        Best value of the objective with the values of the variables, the number of evaluations, why
        the search ended, and the paths of the best model and the history.

    Raises:
        SweepInterruption: the user has pressed Ctrl-C; the search can be resumed.
        SimulationError: no run has succeeded.
        SettingError: an argument is out of bounds, every variable has one value only, or the
            folder has results of other settings.
        OsimliteError: the model cannot be simulated, or the cluster cannot be reached.
    """  # noqa: DOC501 - a function makes the SweepInterruption
    minimize = find_method(method)
    reject_grid_ranges(plan.variables)
    free_indices = [index for index, variable in enumerate(plan.variables) if not variable.is_fixed]
    if not free_indices:
        raise SettingError("there is nothing to search: every variable has one value only")
    if budget < 1 or (popsize is not None and popsize < 2):
        raise SettingError(
            "a search needs a budget of at least 1 run, and a population of at least 2"
        )
    if not 0 <= seed < 2**32:
        raise SettingError(f"the seed must be a whole number from 0 to {2**32 - 1}, not {seed}")
    if tolerance is not None and not (isfinite(tolerance) and tolerance >= 0.0):
        raise SettingError(f"the tolerance must be a number of at least 0, not {tolerance:g}")
    if not (isfinite(sigma) and sigma > 0.0):
        raise SettingError(f"sigma must be positive, not {sigma:g}")
    names = [get_measure_name(spec) for spec in (objective.measure, *plan.measures)]
    # The objective comes first, and only once if the plan has it, too.
    measures = tuple(dict(zip(names, (objective.measure, *plan.measures), strict=True)).values())
    plan = replace(plan, measures=measures)
    variants = Variants(plan)
    point = _resolve_start(plan, variants, free_indices, start, is_bounded)
    settings = {
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
        prepare_folder(folder) as output_folder,
        make_pool(plan, workers=workers, cluster=cluster) as workforce,
    ):
        evaluations = _Evaluations(
            plan, free_indices, objective.sign, is_bounded, budget, workforce, progress
        )
        partial = _open_history(
            output_folder / HISTORY_FILE,
            make_schema(plan.columns("evaluation", "batch"), settings),
            resume,
            force,
            evaluations,
        )
        evaluations.partial, ending = partial, ""
        try:
            with suppress(OutOfBudget):
                slopes = (
                    evaluations.make_gradient(registry.make_gradients(plan))
                    if minimize is run_lbfgs
                    else None
                )
                search = Search(point, sigma, popsize, seed, is_bounded, budget, tolerance, slopes)
                ending = minimize(evaluations.evaluate, search)
            # The table becomes a Parquet file only when the search has ended by itself.
            partial.finish()
        except KeyboardInterrupt:
            raise describe_interruption(partial, format_count(partial.rows, "run")) from None
        finally:
            partial.close()
    ending = ending or f"the budget of {evaluations.count} runs is used up"
    return _finish_search(output_folder, plan, variants, evaluations, settings, ending)


def _resolve_start(
    plan: Plan,
    variants: Variants,
    free_indices: Sequence[int],
    start: Sequence[float] | Mapping[str, float] | None,
    is_bounded: bool,
) -> Floats:
    """Return the first point (f,) as fractions of the ranges of the free variables.

    Raises:
        SettingError: a sequence does not have one value for each variable, or a start value is
            outside its range.
    """
    if not isinstance(start, Mapping):
        if start is not None and len(start) != len(plan.variables):
            raise SettingError(
                f"the start must have one number for each variable ({len(plan.variables)}), found {len(start)}"
            )
        start = dict(zip((variable.name for variable in plan.variables), start or (), strict=False))
    result = []
    current_values = variants.list_current_values()
    for index in free_indices:
        variable = plan.variables[index]
        value = start.get(variable.name, current_values[index])
        is_within = value is not None and (variable.low <= value <= variable.high or not is_bounded)
        if variable.name in start and not is_within:
            raise SettingError(
                f"'{variable.name}' cannot start at {value}, outside {variable.low:g} to {variable.high:g}"
            )
        # A logarithmic range cannot express this value, even for an unbounded search.
        if value is not None and variable.is_log and value <= 0.0:
            is_within = False
        result.append(variable.compute_fraction(value) if value is not None and is_within else 0.5)
    return np.array(result)


def read_best_values(folder: str | Path) -> dict[str, float]:
    """Read the best values of a search from its folder.

    Args:
        folder: output folder of the search.

    Returns:
        Value per name of a variable.

    Raises:
        OsimliteError: the folder has no summary of a search.
    """
    path = Path(folder) / SUMMARY_FILE
    try:
        return {name: float(value) for name, value in json.loads(read_file(path))["values"].items()}
    except (OsimliteError, ValueError, LookupError, AttributeError, TypeError, RecursionError):
        raise OsimliteError(
            f"'{path}' is not the summary of a search; name the results folder of a search"
        ) from None


def _open_history(
    path: Path, table: Any, resume: bool, force: bool, evaluations: _Evaluations
) -> PartialTable:
    """Open the history for new rows, and give the rows that it has to the evaluations.

    Returns:
        Table to which new rows of the history are added.

    Raises:
        SettingError: the history has other settings, or more runs than the budget.
    """
    if path.is_file() and not force and not (resume and get_partial_path(path).exists()):
        protect_results(path, json.loads(table.metadata[SETTINGS_KEY]))
        pq = require("pyarrow.parquet", extra="sweep", purpose="a table of results")
        with report_damage(path), open_file(path) as stream:
            # If the program ends while pyarrow's threads still run, C++ sometimes aborts it.
            earlier_table = pq.ParquetFile(stream, page_checksum_verification=True).read(
                use_threads=False
            )
        if resume:
            partial = PartialTable(path, table)
            for batch in earlier_table.to_batches():
                partial.add(batch.columns)
                evaluations.add_history(batch)
            return partial
        # A smaller budget must not discard finished evaluations.
        if earlier_table.num_rows > evaluations.budget:
            raise SettingError(
                f"'{path}' has {format_count(earlier_table.num_rows, 'run')} of this search, "
                f"more than the budget now; keep them with "
                "--resume, or replace them with --force"
            )
    if not force and not path.exists() and not get_partial_path(path).exists():
        refuse_overwrite(path.with_name(name) for name in (BEST_FILE, SUMMARY_FILE, PAR_FILE))
    partial = PartialTable(path, table, resume=resume)
    partial.read(evaluations.add_history)
    return partial


class _Evaluations:
    """Cost function of a search: costs come from earlier sessions first, then from simulations.

    Args:
        plan: plan with the objective as its first measure.
        free_indices: indices of the variables that vary.
        sign: factor that makes a cost of the objective: -1 to maximize, 1 to minimize.
        is_bounded: whether points are clipped to the ranges.
        budget: number of evaluations that are allowed.
        workforce: pool of workers.
        progress: callback during the search.

    Attributes:
        count: number of evaluations that the method has requested.
        batches: number of batches of evaluations that the method has requested.
        worst: largest cost so far.
        best: smallest cost, number of this evaluation and values of the variables; None before any
            success.
        reason: first reason of a failure.
    """

    partial: PartialTable

    def __init__(
        self,
        plan: Plan,
        free_indices: Sequence[int],
        sign: float,
        is_bounded: bool,
        budget: int,
        workforce: Pool,
        progress: Progress | None,
    ) -> None:
        self.plan = plan
        self.free = list(free_indices)
        self.sign = sign
        self.is_bounded = is_bounded
        self.budget = budget
        self.pool = workforce
        self.progress = progress
        self.objective = get_measure_name(plan.measures[0])
        self.count = self.batches = 0
        self.worst = 0.0
        self.best: tuple[float, int, list[float]] | None = None
        self.reason: str | None = None
        self._history: list[tuple[list[float], str, float]] = []

    def add_history(self, batch: Any) -> None:
        """Add rows of an earlier session."""
        columns = batch.to_pydict()
        values = [columns[variable.name] for variable in self.plan.variables]
        result = zip(
            zip(*values, strict=True), columns["status"], columns[self.objective], strict=True
        )
        self._note_failure(columns["status"], columns["reason"])
        self._history += [(list(row), status, value) for row, status, value in result]
        # All rows of the history count, even if the budget is smaller than before.
        self.budget = max(self.budget, len(self._history))

    def _note_failure(self, status: Sequence[str], reasons: Sequence[str | None]) -> None:
        """Keep the first reason of a failure."""
        failed = (
            reason
            for run_status, reason in zip(status, reasons, strict=True)
            if run_status == FAILED
        )
        self.reason = self.reason or next(failed, None)

    def evaluate(self, points: Floats) -> Floats:
        """Return the costs (k,) of points (k, d) of the cube of the free variables.

        Raises:
            OutOfBudget: the budget does not suffice for all points; those that it allows are
                evaluated.
            SettingError: a resumed search requests other points than before.
        """
        requested = len(points)
        points = points[: self.budget - self.count]
        if len(points) == 0:
            raise OutOfBudget
        values = self._compute_values(points)
        # A deterministic method requests the same points again when it is resumed.
        evaluated = self._history[self.count : self.count + len(points)]
        # Even a rounding difference means that the method continues differently from the history.
        if any(
            row != list(requested_row)
            for (row, _, _), requested_row in zip(evaluated, values.tolist(), strict=False)
        ):
            raise SettingError(
                "the search cannot continue, because it requests other points than before; another version of its "
                "library may be installed. Start the search again in another folder"
            )
        # Points beyond the history are simulated.
        new_values = values[len(evaluated) :]
        if len(new_values):
            evaluated = evaluated + self._run_samples(new_values, self.count + len(evaluated))
        costs = [self._compute_cost(status, value) for _, status, value in evaluated]
        for number, (cost, row) in enumerate(zip(costs, values.tolist(), strict=True)):
            _, status, value = evaluated[number]
            # Only finished runs can be the best; penalties of failures only guide the method.
            if status != FAILED and isfinite(value) and (self.best is None or cost < self.best[0]):
                self.best = cost, self.count + number, row
        self.count += len(points)
        self.batches += 1
        if self.progress is not None:
            self.progress(self.count, self.budget)
        if len(points) < requested:
            raise OutOfBudget
        return np.array(costs)

    def make_gradient(self, gradients: Any) -> Callable[[Floats], Floats]:
        """Return the function that computes the gradient of the cost at a point (d,) of the cube.

        Args:
            gradients: derivatives of the objective, see
                :func:`osimlite.studies.sweep.registry.make_gradients`.
        """

        def compute_gradient(point: Floats) -> Floats:
            (values,) = self._compute_values(point[None])
            stretched = [
                self.plan.variables[index].differentiate(values[index]) for index in self.free
            ]
            slopes: Floats = gradients.evaluate(values.tolist(), self.free)
            return self.sign * slopes * stretched

        return compute_gradient

    def _compute_values(self, points: Floats) -> Floats:
        """Return the values of all variables (k, v) at points (k, d) of the cube of the free ones."""
        # Fixed variables have equal bounds.
        values = np.tile([variable.low for variable in self.plan.variables], (len(points), 1))
        for column, index in enumerate(self.free):
            variable = self.plan.variables[index]
            values[:, index] = (variable.interpolate if self.is_bounded else variable.extrapolate)(
                points[:, column]
            )
        return values

    def _compute_cost(self, status: str, value: float) -> float:
        """Return the cost of a run.

        A failure costs more than anything before, so that methods avoid it.
        """
        if status == FAILED or not isfinite(value):
            return self.worst + max(1.0, abs(self.worst))
        cost = self.sign * value
        self.worst = max(self.worst, cost)
        return cost

    def _run_samples(
        self, values: Floats, first_number: int
    ) -> list[tuple[list[float], str, float]]:
        """Run samples (k, v) on the pool, and save them.

        Returns:
            Values, status and objective of each run.
        """
        # Two tasks per worker balance runs of different duration.
        size = max(1, -(-len(values) // (2 * self.pool.workers)))
        starts = range(0, len(values), size)
        for start in starts:
            self.pool.submit(start, values[start : start + size])
        blocks: dict[int, Block] = dict(self.pool.result() for _ in starts)
        block = Block.join([blocks[start] for start in starts])
        numbers = (
            np.arange(first_number, first_number + len(values)),
            np.full(len(values), self.batches),
        )
        self.partial.add([*numbers, *values.T, *block.columns])
        self._note_failure(block.status, block.reasons)
        return list(
            zip(values.tolist(), block.status, block.measures[self.objective].tolist(), strict=True)
        )


def _finish_search(
    output_folder: Path,
    plan: Plan,
    variants: Variants,
    evaluations: _Evaluations,
    settings: dict[str, Any],
    ending: str,
) -> Optimum:
    """Write the best model, parameters and summary.

    Returns:
        Result of the search, with the paths of the files.

    Raises:
        SimulationError: no run has come to its end, or the objective is finite in none.
    """
    if evaluations.best is None:
        if evaluations.reason:
            raise SimulationError(f"no run came to its end: {evaluations.reason}")
        raise SimulationError(f"'{settings['objective']}' is not a finite number in any run")
    cost, number, row = evaluations.best
    write(variants.build_model(row), output_folder / BEST_FILE)
    if plan.controller is not None:
        write_atomically(output_folder / PAR_FILE, variants.make_controller(row).par())
    value = evaluations.sign * cost
    values_by_name = {variable.name: x for variable, x in zip(plan.variables, row, strict=True)}
    result = Optimum(
        value,
        values_by_name,
        evaluations.count,
        number,
        ending,
        output_folder / BEST_FILE,
        output_folder / HISTORY_FILE,
    )
    summary = {
        "objective": settings["objective"],
        "value": value,
        "values": values_by_name,
        "evaluation": number,
        "evaluations": evaluations.count,
        "ended": ending,
        "settings": settings,
    }
    write_atomically(output_folder / SUMMARY_FILE, json.dumps(summary, indent=2) + "\n")
    return result
