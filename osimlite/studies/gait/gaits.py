"""A walker that keeps on walking: found, rounded, put on its way, written."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.base.files import prepare_folder, read_file, write_atomically
from osimlite.base.records import dataclass
from osimlite.errors import OsimliteError, SettingError, SimulationError
from osimlite.io.document.printer import write
from osimlite.studies.gait.cycle_search import (
    Candidate,
    CycleSearch,
    Found,
    Progress,
    sample_states_of_step,
)
from osimlite.studies.gait.stability import Improvement, cost
from osimlite.studies.gait.stepmap import TIGHT, refuse_constraints
from osimlite.studies.gait.steps import Walk, walk_many
from osimlite.studies.sweep.plan import Plan
from osimlite.studies.sweep.results import refuse_others, refuse_overwrite
from osimlite.studies.sweep.variables import Floats

BEST, CYCLES, SUMMARY = "best.osim", "cycles.csv", "summary.json"
"""What a search writes into its folder."""

PHASES = (0.4, 0.5, 0.3, 0.6, 0.2, 0.7, 0.1, 0.8, 0.9)
"""Parts of a step after the heel strike at which a walk may begin, the most wanted first."""

WALK_SECONDS, WALK_ACCURACY = 60.0, 1e-6
"""How long the walker that is written walks before it is believed."""

Stage = Callable[[str, float, float], object]
"""Called with what is being done, how much of it, and of how much."""


@dataclass(frozen=True, eq=False)
class Gait:
    """A walker that was found."""

    found: Found  # its numbers and its cycle
    # value and speed of each coordinate at the start, by name
    start: dict[str, tuple[float, float]]
    walk: Walk  # from there
    candidates: int  # how many of the random walkers made two steps
    cycles: int  # how many cycles were found among them, and on the way to the most stable
    files: tuple[Path, ...]  # that were written


def find_gait(
    plan: Plan,
    folder: str | Path,
    *,
    feet: Sequence[str] | None = None,
    samples: int = 65536,
    tries: int = 40,
    enough: int = 5,
    budget: int = 300,
    stable: float = 0.6,
    perturb: float = 0.1,
    digits: int = 3,
    start_digits: int | None = None,
    seed: int = 0,
    force: bool = False,
    threads: int | None = None,
    stage: Stage | None = None,
) -> Gait:
    """Look for numbers of a model, and a start, with which it walks in the most stable cycle that is found.

    Args:
        plan: what is varied: values and speeds of coordinates, from which random starts are drawn,
            and numbers of the model.
        folder: where `best.osim`, `cycles.csv` and `summary.json` are written.
        feet: contacts of each foot; found by the structure of the model if left out.
        samples: random walkers.
        tries: how many of the best are led to a cycle.
        enough: cycles after which no more of them are.
        budget: sets of numbers that are tried on the way to the most stable cycle.
        stable: largest multiplier that is small enough; below it, what counts is how many walk from
            near the cycle.
        perturb: how near: every value and speed is changed by this part at most.
        digits: that the numbers of the model are rounded to.
        start_digits: that the start is rounded to; None for all of them.
        seed: what makes the search the same again.
        force: replace what another search has left in the folder.
        threads: how many work.
        stage: called as work is done.

    Raises:
        SettingError: a number has no meaning, or the folder has files of another search.
        SimulationError: no cycle was found, or the best is lost when the numbers are rounded.
        UnsupportedError: constraints act on the model.
        OsimliteError: the plan cannot be run, the model has no two feet, or the folder cannot be
            written to.
    """
    settings = {
        **plan.settings(),
        "feet": None if feet is None else list(feet),
        "samples": samples,
        "tries": tries,
        "enough": enough,
        "budget": budget,
        "stable": stable,
        "perturb": perturb,
        "digits": digits,
        "start_digits": start_digits,
        "seed": seed,
    }
    _check_numbers(settings)
    tell = stage or (lambda *_: None)
    with prepare_folder(folder) as where:
        if not force:
            _protect_results(where, settings)
        search = CycleSearch(plan, feet, stable=stable, perturb=perturb, threads=threads)
        refuse_constraints(search.variants.given.engine.mechanism)
        candidates = search.find_candidates(
            samples, seed, lambda done, of: tell("random walkers", done, of)
        )
        if not candidates:
            raise SimulationError(
                f"none of {samples} random walkers made two steps; widen the ranges, or draw more (--samples)"
            )
        cycles = close_candidates(
            search, candidates[:tries], enough, lambda done, of: tell("closing cycles", done, of)
        )
        improvement = Improvement(search, min(cycles, key=cost), digits)
        if search.names:
            improvement.run(budget, seed, lambda done, of: tell("making it stable", done, of))
        best = round_cycle(search, improvement.best, digits)
        cycles += improvement.cycles
        start, walk = choose_start(search, best, start_digits)
        files = tuple(where / name for name in (BEST, CYCLES, SUMMARY))
        gait = Gait(best, start, walk, len(candidates), len(cycles), files)
        _write_walker(where, search, gait, cycles, settings)
    return gait


def _check_numbers(given: Mapping[str, Any]) -> None:
    """Stop at settings that mean nothing before the search, which takes minutes."""
    for name, least in (("samples", 1), ("tries", 1), ("enough", 1), ("budget", 0)):
        if given[name] < least:
            raise SettingError(f"'{name}' is a whole number from {least} on, not {given[name]}")
    for name in ("stable", "perturb"):
        if not (isfinite(given[name]) and given[name] > 0.0):
            raise SettingError(f"'{name}' is a positive number, not {given[name]:g}")
    for name in ("digits", "start_digits"):
        if given[name] is not None and not 1 <= given[name] <= 17:
            raise SettingError(f"'{name}' is a whole number from 1 to 17, not {given[name]}")
    # Every turn of the search for stability has a seed of its own, of 32 bits at most.
    most = 2**32 - 1 - given["budget"]
    if not 0 <= given["seed"] <= most:
        raise SettingError(f"the seed is a whole number from 0 to {most}, not {given['seed']}")


def _protect_results(folder: Path, wanted: dict[str, Any]) -> None:
    """Stop before the walker of another search is lost.

    Raises:
        SettingError: there is one.
    """
    summary = folder / SUMMARY
    try:
        before = dict(json.loads(read_file(summary))["settings"])
    except (OsimliteError, ValueError, LookupError, TypeError, RecursionError):
        refuse_overwrite(folder / name for name in (BEST, CYCLES, SUMMARY))
    else:
        refuse_others(summary, before, wanted)


def close_candidates(
    search: CycleSearch,
    candidates: Sequence[Candidate],
    enough: int,
    progress: Progress | None = None,
) -> list[Found]:
    """The cycles that candidates are led to.

    Args:
        search: that found them.
        candidates: the best first.
        enough: cycles after which no more are looked for.
        progress: called with how many have been led, and of how many.

    Raises:
        SimulationError: none comes to a cycle.
    """
    cycles: list[Found] = []
    for number, candidate in enumerate(candidates):
        if progress is not None:
            progress(number, len(candidates))
        result = search.close_cycle(candidate)
        if result is not None:
            cycles.append(result)
        if len(cycles) == enough:
            break
    if not cycles:
        raise SimulationError(
            f"none of the {len(candidates)} best random walkers that made two steps comes to a cycle; draw more "
            "(--samples), lead more of them on (--tries), or vary other numbers"
        )
    return cycles


def round_cycle(search: CycleSearch, found: Found, digits: int) -> Found:
    """The cycle, to its last digits, of the model whose numbers are rounded.

    Raises:
        SimulationError: there is none.
    """
    try:
        return search.find_cycle(
            search.round_fractions(found.fractions, digits), found.cycle.state, fine=True
        )
    except OsimliteError as error:
        raise SimulationError(
            f"with numbers of {digits} digits the cycle is lost; keep more. {error.message}"
        ) from None


def choose_start(
    search: CycleSearch, found: Found, digits: int | None
) -> tuple[dict[str, tuple[float, float]], Walk]:
    """A start between two steps of a cycle, by the names of the coordinates, and the walk from there.

    Of some moments of the step, the first is taken from which, after rounding, it walks on without
    a scuff.

    Args:
        search: that found it.
        found: a model with its cycle.
        digits: that values and speeds are rounded to; None for all of them.
    """
    step_map = search.step_map(found.fractions, found.cycle.state, TIGHT)
    engine, ordered = step_map.engine, sorted(PHASES)
    states = sample_states_of_step(step_map, found.cycle, ordered)[
        [ordered.index(part) for part in PHASES]
    ]
    states[np.abs(states) < 1e-12] = 0.0
    if digits is not None:
        states = np.array(
            [[float(f"{number:.{digits}g}") for number in row] for row in states.tolist()]
        )
    # A file says where coordinates start, and the auxiliary states follow.
    states = engine.state.restart_auxiliary(states)
    walks = walk_many(
        engine,
        states,
        WALK_SECONDS,
        footing=search.footing,
        accuracy=WALK_ACCURACY,
        threads=search.threads,
    )
    best = max(range(len(walks)), key=lambda k: (walks[k].walks and not walks[k].scuffs, -k))
    return _name_values(engine, states[best]), walks[best]


def _name_values(engine: Any, state: Floats) -> dict[str, tuple[float, float]]:
    names = [engine.mechanism.coordinates[place].name for place in engine.order]
    values, speeds = state[: len(names)], state[len(names) : 2 * len(names)]
    return dict(zip(names, zip(values.tolist(), speeds.tolist(), strict=True), strict=True))


def _write_walker(
    folder: Path, search: CycleSearch, gait: Gait, cycles: Sequence[Found], settings: dict[str, Any]
) -> None:
    model = search.model(gait.found.fractions, gait.start)
    write(model, folder / BEST)
    heads = [*search.names, "largest_multiplier", "walking", "step_length_m", "period_s", "scuffs"]
    rows = [",".join(heads)]
    for each in sorted(cycles, key=cost):
        cycle = each.cycle
        numbers = [
            *each.numbers.values(),
            cycle.largest,
            each.walking,
            cycle.length,
            cycle.period,
            cycle.scuffs,
        ]
        rows.append(",".join(repr(number) for number in numbers))
    write_atomically(folder / CYCLES, "\n".join(rows) + "\n")
    result, walk = gait.found, gait.walk
    summary = {
        "numbers": result.numbers,
        "start": {
            name: {"value": value, "speed": speed} for name, (value, speed) in gait.start.items()
        },
        "largest_multiplier": result.cycle.largest,
        "walking": result.walking,
        "step_length_m": result.cycle.length,
        "period_s": result.cycle.period,
        "residual": result.cycle.residual,
        "walk": {
            "steps": len(walk.steps),
            "scuffs": len(walk.scuffs),
            "end_s": walk.end,
            "ending": walk.ending,
        },
        "candidates": gait.candidates,
        "settings": settings,
    }
    write_atomically(folder / SUMMARY, json.dumps(summary, indent=2) + "\n")
