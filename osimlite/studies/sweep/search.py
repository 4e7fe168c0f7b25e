"""Methods that look for the least cost, each as a function that asks for the costs of points of the unit cube.

All are deterministic: with the same seed and the same answers they ask the same questions, which is
how an interrupted search goes on.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from osimlite.base.require import require
from osimlite.base.text import suggest_or_list
from osimlite.errors import SettingError
from osimlite.studies.sweep.sampling import Sobol
from osimlite.studies.sweep.variables import Floats

Ask = Callable[[Floats], Floats]
"""Costs (k,) of points (k, d); raises `BudgetExhausted` when no more are wanted."""


class BudgetExhausted(Exception):
    """There have been as many evaluations as were allowed."""


class Search(NamedTuple):
    """How to search."""

    start: Floats  # first point (d,)
    sigma: float  # how far from it to look at first, as a fraction of the ranges
    popsize: int | None  # points that are asked for together, or None for what suits the method
    seed: int  # what makes it the same again
    is_bounded: bool  # whether points stay within the cube
    budget: int  # evaluations that are allowed
    # of cost and points, at which the search ends; None for that of the method
    tolerance: float | None = None
    # derivatives (d,) of the cost at a point, if it has any
    slopes: Callable[[Floats], Floats] | None = None


def cma(ask: Ask, search: Search, *, keeps_best: bool = False) -> str:
    """Covariance matrix adaptation (Hansen's pycma); why it ended.

    Args:
        ask: tells costs.
        search: how.
        keeps_best: let the first point be one of the first population, and the best so far a parent
            of every other.
    """
    strategy = require("cma", extra="optimize", purpose="the search by cma")
    _needs_two(search)
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
        es.inject([search.start], force=True)
    while not es.stop():
        points = es.ask()
        es.tell(points, ask(np.array(points)).tolist())
    return "converged: " + ", ".join(str(reason) for reason in es.stop())


def sobol_cma(ask: Ask, search: Search) -> str:
    """A look at two populations of Sobol's points and the start, then cma from the best of them; why it ended.

    Where the budget is small and the cost has many valleys, as that of a walker has, this gets
    farther than cma from the start alone, and never ends worse than it began; with thousands of
    runs, cma alone may get farther. The look does not depend on the budget, so that a search can go
    on with a larger one.
    """
    _needs_two(search)
    size = search.popsize or 4 + int(3.0 * np.log(len(search.start)))
    points = Sobol(search.seed, len(search.start)).points(0, LOOKS * size)
    points[0] = search.start
    costs = np.concatenate(
        [ask(points[first : first + size]) for first in range(0, len(points), size)]
    )
    best = points[int(np.argmin(costs))]
    return cma(ask, search._replace(start=best, popsize=size), keeps_best=True)


def differential_evolution(ask: Ask, search: Search) -> str:
    """Differential evolution (scipy's); why it ended."""
    optimize = require(
        "scipy.optimize", extra="sweep", purpose="the search by differential evolution"
    )
    if not search.is_bounded:
        raise SettingError(
            "differential evolution stays within the ranges; take --method cma to leave them"
        )
    rng, size = np.random.default_rng(search.seed), len(search.start)
    first = rng.random((max(5, search.popsize or 10 * size), size))
    first[0] = search.start
    result = optimize.differential_evolution(
        lambda points: ask(np.atleast_2d(points.T)),
        [(0.0, 1.0)] * size,
        init=first,
        maxiter=search.budget,
        tol=search.tolerance if search.tolerance is not None else 0.01,
        atol=search.tolerance or 0.0,
        vectorized=True,
        updating="deferred",
        polish=False,
        rng=rng,
    )
    return f"converged: {result.message}"


def nelder_mead(ask: Ask, search: Search) -> str:
    """The simplex of Nelder and Mead (scipy's); why it ended. One run at a time."""
    optimize = require("scipy.optimize", extra="sweep", purpose="the search by Nelder and Mead")
    size, tolerance = len(search.start), search.tolerance if search.tolerance is not None else 1e-6
    simplex = np.tile(search.start, (size + 1, 1))
    for k in range(size):
        simplex[k + 1, k] += (
            search.sigma if simplex[k + 1, k] + search.sigma <= 1.0 else -search.sigma
        )
    result = optimize.minimize(
        lambda point: float(ask(point[None])[0]),
        search.start,
        method="Nelder-Mead",
        bounds=[(0.0, 1.0)] * size if search.is_bounded else None,
        options={
            "initial_simplex": simplex,
            "maxfev": 10**9,
            "maxiter": 10**9,
            "xatol": tolerance,
            "fatol": tolerance,
        },
    )
    return f"converged: {result.message}"


def gradient(ask: Ask, search: Search) -> str:
    """Limited-memory quasi-Newton steps within bounds (scipy's L-BFGS-B) by exact derivatives; why it ended.

    One run at a time; to where nothing near is better, which may be far from the best.
    """
    optimize = require("scipy.optimize", extra="sweep", purpose="the search by gradients")
    tolerance = 1e-9 if search.tolerance is None else search.tolerance
    result = optimize.minimize(
        lambda point: float(ask(point[None])[0]),
        search.start,
        jac=search.slopes,
        method="L-BFGS-B",
        bounds=[(0.0, 1.0)] * len(search.start) if search.is_bounded else None,
        options={"ftol": tolerance, "gtol": tolerance, "maxfun": 10**9, "maxiter": 10**9},
    )
    return f"converged: {result.message}"


METHODS: dict[str, Callable[[Ask, Search], str]] = {
    "sobol-cma": sobol_cma,
    "cma": cma,
    "differential-evolution": differential_evolution,
    "nelder-mead": nelder_mead,
    "gradient": gradient,
}


LOOKS = 2
"""Populations of points spread over the ranges, before cma begins."""


def method_named(name: str) -> Callable[[Ask, Search], str]:
    """A method by its name.

    Raises:
        SettingError: there is none.
    """
    if name not in METHODS:
        raise SettingError(f"there is no method '{name}'{suggest_or_list(name, METHODS)}")
    return METHODS[name]


def _needs_two(search: Search) -> None:
    if len(search.start) < 2:
        raise SettingError("cma searches two variables or more; take --method nelder-mead for one")
