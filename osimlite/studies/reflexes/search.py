"""CMA-ES search for the parameters of a scenario; all candidates of a generation walk at once."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from osimlite.base.files import make_folder, write_atomically
from osimlite.base.records import dataclass
from osimlite.base.require import require
from osimlite.errors import SettingError
from osimlite.studies.reflexes.parameters import format_par_line, read_par
from osimlite.studies.reflexes.scenario import Scenario

BEST_FILE = "best.par"
"""File in the output folder with the best parameters, which SCONE reads too."""
MIN_POPULATION = 4
"""Fewest candidates per generation: with fewer, CMA-ES has too few to rank and to recombine."""


@dataclass(frozen=True, eq=False)
class Generation:
    """State of a search after one generation, for reports of progress.

    Attributes:
        number: number of the generation, from 1.
        best: smallest result of all candidates so far.
        median: median result of this generation.
        longest: duration of the longest walk of this generation (s).
        per_minute: generations per minute of elapsed time since the start.
    """

    number: int
    best: float
    median: float
    longest: float
    per_minute: float

    def __str__(self) -> str:
        rate = f"{self.per_minute:.3g} generations/min"
        return f"{self.number:5d}  best {self.best:.6g}  median {self.median:.6g}  longest motion {self.longest:.2f} s  {rate}"


def search_parameters(
    scenario: Scenario,
    folder: str | Path,
    *,
    generations: int | None = None,
    population: int | None = None,
    seed: int | None = None,
    resume: bool = False,
    report: Callable[[Generation], None] | None = None,
) -> dict[str, float]:
    """Minimize the result of a scenario over its parameters with CMA-ES.

    The file `best.par` is rewritten whenever the best result improves. Ctrl-C ends the search and
    returns the best parameters so far. The search also ends where CMA-ES stops by its own criteria.

    Args:
        scenario: scenario to optimize.
        folder: output folder for `best.par`; created if necessary.
        generations: number of generations; by default that of the scenario.
        population: candidates per generation; by default that of the scenario.
        seed: seed of the random numbers, so that a search can be repeated; by default that of the
            scenario.
        resume: whether to continue from the `best.par` in the folder.
        report: function that is called with the state of the search after each generation.

    Returns:
        Best value of each parameter, by name.

    Raises:
        MissingDependency: cma is not installed.
        SettingError: the scenario has no parameters, there are too few candidates or generations,
            the folder has the result of another search, or its parameters are not those of the
            scenario.
    """
    generations = scenario.generations if generations is None else generations
    population = scenario.population if population is None else population
    seed = scenario.seed if seed is None else seed
    if population < MIN_POPULATION or generations < 1:
        raise SettingError(
            f"a search needs at least {MIN_POPULATION} candidates in each generation, and at least one generation"
        )
    strategy = require("cma", extra="optimize", purpose="the search for parameters")
    parameters = scenario.parameters()
    if not parameters:
        raise SettingError(
            "the scenario has no parameters to optimize; write a parameter as 1~0.1<0,2> (mean, standard deviation, bounds)"
        )
    path = Path(folder) / BEST_FILE
    if not resume and path.exists():
        raise SettingError(
            f"'{path}' exists already: continue it with --resume, or name another folder"
        )
    best_values = np.array([parameter.mean for parameter in parameters])
    best_result = np.inf
    if resume:
        saved_parameters = read_par(path)
        names = [parameter.name for parameter in parameters]
        # A parameter that only one side has would silently start from its mean, or be lost.
        for name in sorted({*saved_parameters} ^ {*names}):
            place_text = "the scenario" if name in saved_parameters else f"'{path}'"
            raise SettingError(
                f"{place_text} has no parameter '{name}', so it belongs to another search; resume with its own scenario"
            )
        # The scenario may have other bounds than when the file was written.
        parameters = [
            parameter._replace(
                mean=float(
                    np.clip(saved_parameters[parameter.name][1], parameter.low, parameter.high)
                ),
                std=saved_parameters[parameter.name][2],
            )
            for parameter in parameters
        ]
        best_values = np.array([saved_parameters[name][0] for name in names])
        best_result = float(
            scenario.walk(
                {
                    parameter.name: value
                    for parameter, value in zip(parameters, best_values, strict=True)
                }
            ).results[0]
        )
    make_folder(Path(folder))
    # CMA-ES works on (value - mean) / std, so that its initial step size is 1 for all parameters.
    # A standard deviation of 0 (a mean of 0 without one) becomes tiny, not a division by zero.
    scale = np.array([parameter.std if parameter.std > 0.0 else 1e-6 for parameter in parameters])
    means = np.array([parameter.mean for parameter in parameters])
    lows, highs = (
        (np.array([getattr(parameter, end) for parameter in parameters]) - means) / scale
        for end in ("low", "high")
    )
    # The package takes seed 0 as "draw one from the clock".
    cma_seed = seed + 1
    options = {"bounds": [lows, highs], "popsize": population, "seed": cma_seed, "verbose": -9}
    es = strategy.CMAEvolutionStrategy(np.zeros(len(parameters)), 1.0, options)
    start_time = time.perf_counter()
    try:
        for number in range(1, generations + 1):
            points = np.array(es.ask())
            values = means + scale * points
            walked = scenario.walk(
                {parameter.name: values[:, k] for k, parameter in enumerate(parameters)}, population
            )
            es.tell(list(points), walked.results.tolist())
            index = int(np.argmin(walked.results))
            if walked.results[index] < best_result:
                best_values = values[index]
                best_result = float(walked.results[index])
                # SCONE continues from mean and standard deviation in the file, not from the best.
                # The mean of the distribution is a better start for a later search than the best
                # sample.
                mean = means + scale * es.result.xfavorite
                stds = scale * es.sigma * np.sqrt(np.diag(es.C))
                written_parameters = [
                    parameter._replace(mean=m, std=s)
                    for parameter, m, s in zip(parameters, mean, stds, strict=True)
                ]
                write_atomically(
                    path, "".join(map(format_par_line, written_parameters, best_values))
                )
            if report is not None:
                rate = 60.0 * number / (time.perf_counter() - start_time)
                report(
                    Generation(
                        number,
                        best_result,
                        float(np.median(walked.results)),
                        float(walked.times.max()),
                        rate,
                    )
                )
            if es.stop():
                break
    # The best parameters are in the file already; the caller continues with them.
    except KeyboardInterrupt:
        pass
    return dict(
        zip((parameter.name for parameter in parameters), best_values.tolist(), strict=True)
    )
