"""From a cycle that closes to one that lasts: the numbers of a model are led to where a small push dies away."""

from __future__ import annotations

from contextlib import suppress
from operator import attrgetter

import numpy as np

from osimlite.errors import OsimliteError
from osimlite.studies.gait.cycle_search import CycleSearch, Found, Progress
from osimlite.studies.sweep.search import BudgetExhausted, Search, cma, nelder_mead
from osimlite.studies.sweep.variables import Floats

FIRST_REACH, WORST = 0.05, 100.0
"""How far a turn looks at first, as a part of the ranges, and what numbers without a cycle cost."""

TOLERANCE = 1e-4
"""Of cost and fractions, at which a turn ends."""

cost = attrgetter("cost")


class Improvement:
    """Leads a cycle to the numbers at which it costs least.

    The search (cma) goes in turns, each from the best so far. As long as no cycle is stable enough,
    the numbers are not
    rounded: the valley of small multipliers is narrow, and between rounded numbers it has steps on
    which a search stays. From then on they are, so that the region that counts is that of the
    numbers which will be written.

    Args:
        search: that knows the cycle of a model.
        found: where to begin.
        digits: that the numbers will have.

    Attributes:
        cycles: found on the way.
    """

    def __init__(self, search: CycleSearch, found: Found, digits: int) -> None:
        self.cycles: list[Found] = []
        self._search, self._first, self._digits = search, found, digits
        self._costs: dict[bytes, float] = {}
        self._written: list[Found] = []

    @property
    def best(self) -> Found:
        """The cycle that costs least, of rounded numbers as soon as one of those is stable enough."""
        written = min(self._written, key=cost, default=self._first)
        return written if self._is_enough(written) else min((self._first, *self.cycles), key=cost)

    def run(self, budget: int, seed: int, progress: Progress | None = None) -> None:
        """Search.

        Args:
            budget: how many sets of numbers may be tried.
            seed: of the first turn; each has its own.
            progress: called with how many have been.
        """
        look = cma if len(self._first.fractions) > 1 else nelder_mead
        tried = 0

        def ask(points: Floats) -> Floats:
            nonlocal tried
            if tried >= budget or self._is_enough(self.best) != rounds:
                raise BudgetExhausted
            tried += len(points)
            if progress is not None:
                progress(min(tried, budget), budget)
            return np.array([self._cost(point, rounds) for point in points])

        while tried < budget:
            rounds = self._is_enough(self.best)
            with suppress(BudgetExhausted):
                look(
                    ask,
                    Search(self.best.fractions, FIRST_REACH, None, seed, True, budget, TOLERANCE),
                )
            seed += 1

    def _is_enough(self, found: Found) -> bool:
        return found.cost < self._search.stable

    def _cost(self, fractions: Floats, rounds: bool) -> float:
        """Of the cycle there, which is found from the nearest that is known; much if there is none."""
        if rounds:
            fractions = self._search.round_fractions(fractions, self._digits)
        key = fractions.tobytes()
        if key not in self._costs:
            near = min((self._first, *self.cycles), key=lambda each: _is_far(each, fractions))
            try:
                result = self._search.find_cycle(fractions, near.cycle.state)
            except (OsimliteError, np.linalg.LinAlgError):
                self._costs[key] = WORST + _is_far(near, fractions)
            else:
                self._costs[key] = result.cost
                self.cycles.append(result)
                if rounds:
                    self._written.append(result)
        return self._costs[key]


def _is_far(found: Found, fractions: Floats) -> float:
    return float(np.linalg.norm(found.fractions - fractions))
