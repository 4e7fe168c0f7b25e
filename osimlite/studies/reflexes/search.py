"""The search for parameters with which a scenario goes best: CMA-ES, all candidates of a generation at once."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from osimlite.base.files import make_folder, write_atomically
from osimlite.base.records import dataclass
from osimlite.base.require import require
from osimlite.errors import SettingError
from osimlite.studies.reflexes.parameters import par_line, read_par
from osimlite.studies.reflexes.scenario import Scenario

BEST = "best.par"
FEWEST = 4
"""Candidates that CMA-ES learns anything from."""


@dataclass(frozen=True, eq=False)
class Generation:
    """Where a search is.

    Attributes:
        number: of the generation.
        best: result of the best candidate of all.
        median: of this generation.
        longest: how long its longest walk took, s.
        per_minute: generations.
    """

    number: int
    best: float
    median: float
    longest: float
    per_minute: float

    def __str__(self) -> str:
        rate = f"{self.per_minute:.3g} generations/min"
        return f"{self.number:5d}  best {self.best:.6g}  median {self.median:.6g}  longest {self.longest:.2f} s  {rate}"


def search_parameters(
    scenario: Scenario,
    folder: str | Path,
    *,
    generations: int | None = None,
    population: int | None = None,
    seed: int | None = None,
    resume: bool = False,
    tell: Callable[[Generation], None] | None = None,
) -> dict[str, float]:
    """Look for parameters whose result is least; the best is written whenever it gets better, Ctrl-C ends the search.

    Args:
        scenario: whose.
        folder: for ``best.par``, which SCONE reads, too.
        generations: how many; as the scenario says if None, as the next two.
        population: candidates of each.
        seed: the same seed, the same search.
        resume: whether it begins with the file that is in the folder.
        tell: is told of each generation.

    Returns:
        The best parameters.

    Raises:
        MissingDependency: cma is not installed.
        SettingError: nothing is looked for, there are too few candidates, or the folder has the
            best of another search.
    """
    generations = scenario.generations if generations is None else generations
    population = scenario.population if population is None else population
    seed = scenario.seed if seed is None else seed
    if population < FEWEST or generations < 1:
        raise SettingError(
            f"a search takes {FEWEST} candidates in a generation at least, and one generation"
        )
    strategy = require("cma", extra="optimize", purpose="the search for parameters")
    own = scenario.parameters()
    if not own:
        raise SettingError("the scenario has no parameters, which are written as 1~0.1<0,2>")
    path = Path(folder) / BEST
    if not resume and path.exists():
        raise SettingError(
            f"'{path}' exists already: continue it with --resume, or name another folder"
        )
    best, least = np.array([each.mean for each in own]), np.inf
    if resume:
        known, names = read_par(path), [each.name for each in own]
        for name in sorted({*known} ^ {*names}):
            whose = "the scenario" if name in known else f"'{path}'"
            raise SettingError(f"{whose} has no parameter '{name}': they are of different searches")
        # As it was written there, a mean can be beyond the bounds of now.
        own = [
            each._replace(
                mean=float(np.clip(known[each.name][1], each.low, each.high)),
                std=known[each.name][2],
            )
            for each in own
        ]
        best = np.array([known[name][0] for name in names])
        least = float(
            scenario.walk(
                {each.name: value for each, value in zip(own, best, strict=True)}
            ).results[0]
        )
    make_folder(Path(folder))
    scale = np.array([each.std if each.std > 0.0 else 1e-6 for each in own])
    middle = np.array([each.mean for each in own])
    lows, highs = (
        (np.array([getattr(each, end) for each in own]) - middle) / scale for end in ("low", "high")
    )
    options = {"bounds": [lows, highs], "popsize": population, "seed": seed + 1, "verbose": -9}
    es = strategy.CMAEvolutionStrategy(np.zeros(len(own)), 1.0, options)
    begin = time.perf_counter()
    try:
        for number in range(1, generations + 1):
            points = np.array(es.ask())
            values = middle + scale * points
            walked = scenario.walk(
                {each.name: values[:, k] for k, each in enumerate(own)}, population
            )
            es.tell(list(points), walked.results.tolist())
            place = int(np.argmin(walked.results))
            if walked.results[place] < least:
                best, least = values[place], float(walked.results[place])
                mean = middle + scale * es.result.xfavorite
                stds = scale * es.sigma * np.sqrt(np.diag(es.C))
                found = [
                    each._replace(mean=m, std=s) for each, m, s in zip(own, mean, stds, strict=True)
                ]
                write_atomically(path, "".join(map(par_line, found, best)))
            if tell is not None:
                rate = 60.0 * number / (time.perf_counter() - begin)
                tell(
                    Generation(
                        number,
                        least,
                        float(np.median(walked.results)),
                        float(walked.times.max()),
                        rate,
                    )
                )
            if es.stop():
                break
    except KeyboardInterrupt:
        pass
    return dict(zip((each.name for each in own), best.tolist(), strict=True))
