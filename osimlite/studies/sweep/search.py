"""Search methods: functions that approach the smallest cost on the unit cube.

All are deterministic: with the same seed and the same costs they ask for the same points, so that
an interrupted search continues where it was.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.require import require
from osimlite.base.text import suggest_or_list
from osimlite.errors import SettingError
from osimlite.studies.sweep.sampling import Sobol
from osimlite.studies.sweep.variables import Floats

CostFunction = Callable[[Floats], Floats]
"""Function that returns the costs (k,) of points (k, d); it raises `OutOfBudget` to end the search."""


class OutOfBudget(Exception):
    """The search has used all evaluations that are allowed."""


class Search(NamedTuple):
    """Settings of a search.

    Attributes:
        start: first point (d,), as fractions of the ranges.
        sigma: initial step size, as a fraction of the ranges.
        popsize: number of points per batch; None for the default of the method.
        seed: seed of the random numbers.
        is_bounded: whether points stay within the cube.
        budget: number of evaluations that are allowed.
        tolerance: change of cost and of points at which the search ends; None for the default of
            the method.
        gradient: function that returns the gradient (d,) of the cost at a point, or None.
    """

    start: Floats
    sigma: float
    popsize: int | None
    seed: int
    is_bounded: bool
    budget: int
    tolerance: float | None = None
    gradient: Callable[[Floats], Floats] | None = None


def run_cma(compute_costs: CostFunction, search: Search, *, keeps_best: bool = False) -> str:
    """Minimize with covariance matrix adaptation (CMA-ES, Hansen's pycma).

    Args:
        compute_costs: cost function.
        search: settings.
        keeps_best: whether the first population contains the first point, and each later one the
            best point so far as a parent.

    Returns:
        Reason for the end of the search, as text.
    """
    strategy = require("cma", extra="optimize", purpose="the search by cma")
    _require_two_variables(search)
    # A generator of its own, with seed NaN, keeps pycma from seeding the global one of numpy.
    source = np.random.RandomState(search.seed)
    options: dict[str, Any] = {
        "verbose": -9,
        "verb_log": 0,
        "verb_disp": 0,
        "randn": source.randn,
        "seed": np.nan,
    }
    if search.popsize is not None:
        options["popsize"] = search.popsize
    if search.is_bounded:
        options["bounds"] = [0.0, 1.0]
    if search.tolerance is not None:
        options |= {"tolfun": search.tolerance, "tolx": search.tolerance}
    if keeps_best:
        options["CMA_elitist"] = True
    es = strategy.CMAEvolutionStrategy(search.start, search.sigma, options)
    if keeps_best:
        # The start is the best point so far; the first population contains it as it is.
        es.inject([search.start], force=True)
    while not es.stop():
        points = es.ask()
        es.tell(points, compute_costs(np.array(points)).tolist())
    return "converged: " + ", ".join(str(reason) for reason in es.stop())


def run_sobol_cma(compute_costs: CostFunction, search: Search) -> str:
    """Run CMA-ES from the best of two populations of Sobol points and the start.

    With a small budget and a cost of many valleys, as that of a walker, this gets farther than
    CMA-ES from the start alone, and never ends worse than it began. With thousands of evaluations
    CMA-ES alone may get farther. The number of Sobol points does not depend on the budget, so that
    a search can continue with a larger one.

    Args:
        compute_costs: cost function.
        search: settings.

    Returns:
        Reason for the end of the search, as text.
    """
    _require_two_variables(search)
    # The default size of a population in CMA-ES.
    size = search.popsize or 4 + int(3.0 * np.log(len(search.start)))
    points = Sobol(search.seed, len(search.start)).draw_points(0, SOBOL_POPULATIONS * size)
    # With the start among the points the search never ends worse than it began.
    points[0] = search.start
    costs = np.concatenate(
        [compute_costs(points[offset : offset + size]) for offset in range(0, len(points), size)]
    )
    best_point = points[int(np.argmin(costs))]
    return run_cma(compute_costs, search._replace(start=best_point, popsize=size), keeps_best=True)


def run_differential_evolution(compute_costs: CostFunction, search: Search) -> str:
    """Minimize with differential evolution (scipy).

    Args:
        compute_costs: cost function.
        search: settings.

    Returns:
        Reason for the end of the search, as text.

    Raises:
        SettingError: the search is not bounded.
    """
    optimize = require(
        "scipy.optimize", extra="sweep", purpose="the search by differential evolution"
    )
    if not search.is_bounded:
        raise SettingError(
            "differential evolution stays within the ranges; use the method 'cma' to leave them"
        )
    rng = np.random.default_rng(search.seed)
    size = len(search.start)
    # scipy needs a population of at least five.
    first_population = rng.random((max(5, search.popsize or 10 * size), size))
    first_population[0] = search.start
    result = optimize.differential_evolution(
        # A vectorized function receives the points as columns.
        lambda points: compute_costs(np.atleast_2d(points.T)),
        [(0.0, 1.0)] * size,
        init=first_population,
        # A generation has several evaluations, so that the budget ends the search first.
        maxiter=search.budget,
        tol=search.tolerance if search.tolerance is not None else 0.01,
        atol=search.tolerance or 0.0,
        vectorized=True,
        updating="deferred",
        # The final search by L-BFGS-B would evaluate one point at a time.
        polish=False,
        rng=rng,
    )
    return f"converged: {result.message}"


def run_nelder_mead(compute_costs: CostFunction, search: Search) -> str:
    """Minimize with the simplex method of Nelder and Mead (scipy).

    It evaluates one point at a time.

    Args:
        compute_costs: cost function.
        search: settings.

    Returns:
        Reason for the end of the search, as text.
    """
    optimize = require("scipy.optimize", extra="sweep", purpose="the search by Nelder and Mead")
    size = len(search.start)
    tolerance = search.tolerance if search.tolerance is not None else 1e-6
    simplex = np.tile(search.start, (size + 1, 1))
    for k in range(size):
        simplex[k + 1, k] += (
            # A step that would leave the range goes the other way.
            search.sigma if simplex[k + 1, k] + search.sigma <= 1.0 else -search.sigma
        )
    result = optimize.minimize(
        lambda point: float(compute_costs(point[None])[0]),
        search.start,
        method="Nelder-Mead",
        bounds=[(0.0, 1.0)] * size if search.is_bounded else None,
        options={
            "initial_simplex": simplex,
            # The budget ends the search by an exception; scipy's limits are out of reach.
            "maxfev": 10**9,
            "maxiter": 10**9,
            "xatol": tolerance,
            "fatol": tolerance,
        },
    )
    return f"converged: {result.message}"


def run_lbfgs(compute_costs: CostFunction, search: Search) -> str:
    """Minimize with L-BFGS-B (scipy) and exact gradients, one point at a time.

    It finds a local minimum, which may be far from the global one.

    Args:
        compute_costs: cost function.
        search: settings with a gradient.

    Returns:
        Reason for the end of the search, as text.
    """
    optimize = require("scipy.optimize", extra="sweep", purpose="the search by gradients")
    tolerance = 1e-9 if search.tolerance is None else search.tolerance
    result = optimize.minimize(
        lambda point: float(compute_costs(point[None])[0]),
        search.start,
        jac=search.gradient,
        method="L-BFGS-B",
        bounds=[(0.0, 1.0)] * len(search.start) if search.is_bounded else None,
        # The budget ends the search by an exception here, too.
        options={"ftol": tolerance, "gtol": tolerance, "maxfun": 10**9, "maxiter": 10**9},
    )
    return f"converged: {result.message}"


METHODS: dict[str, Callable[[CostFunction, Search], str]] = {
    "sobol-cma": run_sobol_cma,
    "cma": run_cma,
    "differential-evolution": run_differential_evolution,
    "nelder-mead": run_nelder_mead,
    "gradient": run_lbfgs,
}
"""Search methods by the names that users write."""


SOBOL_POPULATIONS = 2
"""Number of populations of Sobol points before CMA-ES."""


def find_method(name: str) -> Callable[[CostFunction, Search], str]:
    """Return a search method by its name.

    Raises:
        SettingError: the name is unknown.
    """
    if name not in METHODS:
        raise SettingError(f"there is no method '{name}'{suggest_or_list(name, METHODS)}")
    return METHODS[name]


def _require_two_variables(search: Search) -> None:
    """Refuse a single variable, whose covariance matrix CMA-ES cannot adapt.

    Raises:
        SettingError: the search has fewer than two variables.
    """
    if len(search.start) < 2:
        raise SettingError(
            "the method 'cma' needs at least two variables; use the method 'nelder-mead' for one variable"
        )
