"""Optimization of the stability of a gait cycle over numbers of the model."""

from __future__ import annotations

from contextlib import suppress
from operator import attrgetter

import numpy as np

from osimlite.errors import OsimliteError
from osimlite.studies.gait.cycle_search import CycleSearch, ModelCycle, Progress
from osimlite.studies.sweep.search import OutOfBudget, Search, run_cma, run_nelder_mead
from osimlite.studies.sweep.variables import Floats

INITIAL_STEP = 0.05
"""Initial step size of a round of the search, as a part of the ranges."""

FAILURE_COST = 100.0
"""Cost of numbers without a cycle; the distance to the nearest cycle is added to guide the search."""

TURN_TOLERANCE = 1e-4
"""Change of cost and of fractions at which a round of the search ends."""

get_cost = attrgetter("cost")
"""Function that returns the cost of a cycle, as a key of `min` and `sorted`."""


class StabilityOptimization:
    """Minimization of the cost of a cycle with CMA-ES in rounds, each from the best cycle so far.

    As long as no cycle is stable enough, numbers are not rounded: the valley of small multipliers
    is narrow, and between rounded numbers it has steps on which a search stalls. From then on
    numbers are rounded, so that the cost is that of the numbers which will be written.

    Args:
        search: search that computes the cycle of a model.
        model_cycle: numbers of the model with the gait cycle to start from.
        digits: significant digits of the numbers that will be written.

    Attributes:
        cycles: cycles that were found.
    """

    def __init__(self, search: CycleSearch, model_cycle: ModelCycle, digits: int) -> None:
        self.cycles: list[ModelCycle] = []
        self._search = search
        self._first = model_cycle
        self._digits = digits
        self._costs: dict[bytes, float] = {}
        self._written: list[ModelCycle] = []

    @property
    def best(self) -> ModelCycle:
        """Cycle with the lowest cost; of rounded numbers as soon as one of those is stable enough."""
        rounded_best = min(self._written, key=get_cost, default=self._first)
        return (
            rounded_best
            if self._is_enough(rounded_best)
            else min((self._first, *self.cycles), key=get_cost)
        )

    def run(self, budget: int, seed: int, progress: Progress | None = None) -> None:
        """Search until the budget is spent.

        With a single number, Nelder-Mead replaces CMA-ES, which needs two.

        Args:
            budget: number of sets of numbers that are tried.
            seed: seed of the first round; each further round adds 1.
            progress: callback with the number of sets that were tried, and of all.
        """
        minimize = run_cma if len(self._first.fractions) > 1 else run_nelder_mead
        tried_count = 0

        def compute_costs(points: Floats) -> Floats:
            nonlocal tried_count
            if tried_count >= budget or self._is_enough(self.best) != rounds:
                raise OutOfBudget
            tried_count += len(points)
            if progress is not None:
                progress(min(tried_count, budget), budget)
            return np.array([self._evaluate_cost(point, rounds) for point in points])

        while tried_count < budget:
            # A round ends by an exception when its first stable cycle switches to rounded numbers.
            rounds = self._is_enough(self.best)
            with suppress(OutOfBudget):
                minimize(
                    compute_costs,
                    Search(
                        self.best.fractions, INITIAL_STEP, None, seed, True, budget, TURN_TOLERANCE
                    ),
                )
            # With another seed the next round tries other points.
            seed += 1

    def _is_enough(self, model_cycle: ModelCycle) -> bool:
        """Return whether a cycle is as stable as the search requires."""
        return model_cycle.cost < self._search.stable

    def _evaluate_cost(self, fractions: Floats, rounds: bool) -> float:
        """Return the cost of the cycle at some fractions, searched from the nearest known cycle."""
        if rounds:
            fractions = self._search.round_fractions(fractions, self._digits)
        key = fractions.tobytes()
        # Rounding maps many points of the search to the same numbers.
        if key not in self._costs:
            nearest = min(
                (self._first, *self.cycles),
                key=lambda earlier_cycle: _compute_distance(earlier_cycle, fractions),
            )
            try:
                result = self._search.find_cycle(fractions, nearest.cycle.state)
            except (OsimliteError, np.linalg.LinAlgError):
                self._costs[key] = FAILURE_COST + _compute_distance(nearest, fractions)
            else:
                self._costs[key] = result.cost
                self.cycles.append(result)
                if rounds:
                    self._written.append(result)
        return self._costs[key]


def _compute_distance(model_cycle: ModelCycle, fractions: Floats) -> float:
    """Return the distance between the numbers of a cycle and some fractions."""
    return float(np.linalg.norm(model_cycle.fractions - fractions))
