"""Search for a stable gait: find cycles, stabilize the best one, round it, write the walker."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.base.deprecation import make_deprecated_property
from osimlite.base.files import prepare_folder, read_file, write_atomically
from osimlite.base.records import dataclass
from osimlite.base.text import format_count
from osimlite.errors import OsimliteError, SettingError, SimulationError
from osimlite.io.document.printer import write
from osimlite.studies.gait.cycle import sample_states_of_step
from osimlite.studies.gait.cycle_search import Candidate, CycleSearch, ModelCycle, Progress
from osimlite.studies.gait.stability import StabilityOptimization, get_cost
from osimlite.studies.gait.stepmap import TIGHT_ACCURACY, refuse_constraints
from osimlite.studies.gait.steps import WalkerSteps, walk_many
from osimlite.studies.sweep.plan import Plan
from osimlite.studies.sweep.results import refuse_other_settings, refuse_overwrite
from osimlite.studies.sweep.variables import Floats

BEST_FILE = "best.osim"
"""File in the output folder: the model with the most stable cycle, at its initial state."""

CYCLES_FILE = "cycles.csv"
"""File in the output folder: all cycles that were found, the most stable first."""

SUMMARY_FILE = "summary.json"
"""File in the output folder: settings and results of the search."""

START_PHASES = (0.4, 0.5, 0.3, 0.6, 0.2, 0.7, 0.1, 0.8, 0.9)
"""Parts of a step after touch-down at which the written walker may start, in the order of
preference.

The middle of a step is preferred: there only one foot is in contact.
"""

PROOF_WALK_S = 60.0
"""Duration of the walk (s) that checks the written walker."""

PROOF_ACCURACY = 1e-6
"""Accuracy of the integrator in this walk."""

Stage = Callable[[str, float, float], object]
"""Callback with the name of the stage, the amount of work done, and all work of the stage."""


@dataclass(frozen=True, eq=False)
class Gait:
    """Walker with a stable gait.

    Attributes:
        model_cycle: numbers of the model with the gait cycle.
        start: initial value and speed of each coordinate, by name.
        walk: walk from this initial state.
        candidates: number of random walkers that made two steps.
        cycles: number of cycles that the search found from these walkers and during the
            optimization.
        files: files that the search wrote.
    """

    model_cycle: ModelCycle
    start: dict[str, tuple[float, float]]
    walk: WalkerSteps
    candidates: int
    cycles: int
    files: tuple[Path, ...]

    found = make_deprecated_property("model_cycle")


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
    """Search numbers of a model, and an initial state, for the most stable gait cycle.

    Args:
        plan: variables: values and speeds of coordinates, from which random initial states are
            drawn, and numbers of the model.
        folder: output folder for `best.osim`, `cycles.csv` and `summary.json`.
        feet: contacts of each foot; found from the structure of the model by default.
        samples: number of random walkers.
        tries: number of the best random walkers from which a cycle is searched.
        enough: number of cycles after which no more walkers are refined; the optimization of the
            stability finds more.
        budget: number of sets of numbers that the optimization of stability tries.
        stable: largest multiplier that is small enough; below it, the part of perturbed walkers
            that walk counts.
        perturb: largest relative change of values and speeds of the perturbed walkers.
        digits: significant digits to which the numbers of the model are rounded.
        start_digits: significant digits to which the initial state is rounded; None for no
            rounding.
        seed: seed of all random numbers.
        force: whether to overwrite the results of another search in the folder.
        threads: number of threads; by default one per core.
        stage: callback during the work.

    Returns:
        The walker that was written.

    Raises:
        SettingError: an argument is out of bounds, or the folder has results of another search.
        SimulationError: there is no cycle, or rounding the numbers destroys the best one.
        UnsupportedError: the model has constraints.
        OsimliteError: the plan cannot be run, the model does not have two feet, or the folder
            cannot be written.
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
    report = stage or (lambda *_: None)
    with prepare_folder(folder) as output_folder:
        if not force:
            _protect_results(output_folder, settings)
        # Settings are checked and the folder is protected before anything is computed.
        search = CycleSearch(plan, feet, stable=stable, perturb=perturb, threads=threads)
        refuse_constraints(search.variants.base_variant.engine.mechanism)
        candidates = search.find_candidates(
            samples, seed, lambda finished, total: report("random walkers", finished, total)
        )
        if not candidates:
            raise SimulationError(
                f"none of {samples} random walkers made two steps; widen the ranges, or try more walkers (--samples, samples=)"
            )
        cycles = close_candidates(
            search,
            candidates[:tries],
            enough,
            lambda finished, total: report("closing cycles", finished, total),
        )
        improvement = StabilityOptimization(search, min(cycles, key=get_cost), digits)
        # Without numbers to vary there is nothing to optimize, and the best cycle is final.
        if search.names:
            improvement.run(
                budget, seed, lambda finished, total: report("making it stable", finished, total)
            )
        best = round_cycle(search, improvement.best, digits)
        cycles += improvement.cycles
        start, walk = choose_start(search, best, start_digits)
        files = tuple(output_folder / name for name in (BEST_FILE, CYCLES_FILE, SUMMARY_FILE))
        gait = Gait(best, start, walk, len(candidates), len(cycles), files)
        _write_walker(output_folder, search, gait, cycles, settings)
    return gait


def _check_numbers(settings: Mapping[str, Any]) -> None:
    """Check the settings before the search, which takes minutes.

    Raises:
        SettingError: a setting is out of bounds.
    """
    for name, minimum in (("samples", 1), ("tries", 1), ("enough", 1), ("budget", 0)):
        if settings[name] < minimum:
            raise SettingError(
                f"'{name}' must be a whole number of at least {minimum}, not {settings[name]}"
            )
    for name in ("stable", "perturb"):
        if not (isfinite(settings[name]) and settings[name] > 0.0):
            raise SettingError(f"'{name}' must be a positive number, not {settings[name]:g}")
    for name in ("digits", "start_digits"):
        if settings[name] is not None and not 1 <= settings[name] <= 17:
            raise SettingError(
                f"'{name}' must be a whole number from 1 to 17, not {settings[name]}"
            )
    # Every turn of the search for stability has a seed of its own, of 32 bits at most.
    max_seed = 2**32 - 1 - settings["budget"]
    if not 0 <= settings["seed"] <= max_seed:
        raise SettingError(
            f"the seed must be a whole number from 0 to {max_seed}, not {settings['seed']}"
        )


def _protect_results(folder: Path, settings: dict[str, Any]) -> None:
    """Refuse to overwrite the results of another search.

    Raises:
        SettingError: the folder has such results.
    """
    summary = folder / SUMMARY_FILE
    try:
        earlier_settings = dict(json.loads(read_file(summary))["settings"])
    except (OsimliteError, ValueError, LookupError, TypeError, RecursionError):
        refuse_overwrite(folder / name for name in (BEST_FILE, CYCLES_FILE, SUMMARY_FILE))
    else:
        refuse_other_settings(summary, earlier_settings, settings)


def close_candidates(
    search: CycleSearch,
    candidates: Sequence[Candidate],
    enough: int,
    progress: Progress | None = None,
) -> list[ModelCycle]:
    """Search cycles from candidates, in their order.

    Args:
        search: search with the plan.
        candidates: candidates, the best first.
        enough: number of cycles after which no more are searched.
        progress: callback with the number of candidates that were tried, and of all.

    Returns:
        Cycles in the order of their candidates, at least one.

    Raises:
        SimulationError: no candidate leads to a cycle.
    """
    cycles: list[ModelCycle] = []
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
            f"no gait cycle was found from {format_count(len(candidates), 'random walker')} that made two steps; try more "
            "walkers (--samples, samples=), refine more of the best ones (--tries, tries=), or vary other quantities"
        )
    return cycles


def round_cycle(search: CycleSearch, model_cycle: ModelCycle, digits: int) -> ModelCycle:
    """Return the rounded numbers of a model with their cycle, computed with full accuracy.

    Args:
        search: search with the plan.
        model_cycle: numbers of the model with their gait cycle.
        digits: number of significant digits.

    Raises:
        SimulationError: the model with rounded numbers has no cycle near.
    """
    try:
        return search.find_cycle(
            search.round_fractions(model_cycle.fractions, digits),
            model_cycle.cycle.state,
            fine=True,
        )
    except OsimliteError as error:
        raise SimulationError(
            f"with parameters that are rounded to {format_count(digits, 'digit')}, there is no gait cycle; keep more digits "
            f"(--digits, digits=). {error.message}"
        ) from None


def choose_start(
    search: CycleSearch, model_cycle: ModelCycle, digits: int | None
) -> tuple[dict[str, tuple[float, float]], WalkerSteps]:
    """Choose an initial state within a step of a cycle, and simulate the walk from it.

    It is at the first of several phases of the step from which, after rounding, the walker walks
    without a scuff. If none of them does, it is at the first phase.

    Args:
        search: search with the plan.
        model_cycle: numbers of the model with their gait cycle.
        digits: significant digits of values and speeds; None for no rounding.

    Returns:
        Value (rad or m) and speed of each coordinate, by name, and the walk.
    """
    step_map = search.make_step_map(model_cycle.fractions, model_cycle.cycle.state, TIGHT_ACCURACY)
    engine = step_map.engine
    ordered = sorted(START_PHASES)
    # States are sampled in the order of time, and then sorted by preference.
    states = sample_states_of_step(step_map, model_cycle.cycle, ordered)[
        [ordered.index(part) for part in START_PHASES]
    ]
    # Rounding errors would be written as digits.
    states[np.abs(states) < 1e-12] = 0.0
    if digits is not None:
        states = np.array(
            [[float(f"{number:.{digits}g}") for number in row] for row in states.tolist()]
        )
    # The file has values and speeds of coordinates only; auxiliary states start from their defaults.
    states = engine.state.restart_auxiliary(states)
    walks = walk_many(
        engine,
        states,
        PROOF_WALK_S,
        footing=search.footing,
        accuracy=PROOF_ACCURACY,
        threads=search.threads,
    )
    # The first walk in the order of preference that neither falls nor scuffs.
    best = max(range(len(walks)), key=lambda k: (walks[k].walks and not walks[k].scuffs, -k))
    return _name_values(engine, states[best]), walks[best]


def _name_values(engine: Any, state: Floats) -> dict[str, tuple[float, float]]:
    """Return value and speed of each coordinate of a state by name."""
    names = [engine.mechanism.coordinates[index].name for index in engine.order]
    values = state[: len(names)]
    speeds = state[len(names) : 2 * len(names)]
    return dict(zip(names, zip(values.tolist(), speeds.tolist(), strict=True), strict=True))


def _write_walker(
    folder: Path,
    search: CycleSearch,
    gait: Gait,
    cycles: Sequence[ModelCycle],
    settings: dict[str, Any],
) -> None:
    """Write model, table of cycles and summary of a search."""
    model = search.make_model(gait.model_cycle.fractions, gait.start)
    write(model, folder / BEST_FILE)
    heads = [*search.names, "largest_multiplier", "walking", "step_length_m", "period_s", "scuffs"]
    rows = [",".join(heads)]
    for model_cycle in sorted(cycles, key=get_cost):
        cycle = model_cycle.cycle
        numbers = [
            *model_cycle.numbers.values(),
            cycle.largest,
            model_cycle.walking,
            cycle.length,
            cycle.period,
            cycle.scuffs,
        ]
        rows.append(",".join(repr(number) for number in numbers))
    write_atomically(folder / CYCLES_FILE, "\n".join(rows) + "\n")
    result, walk = gait.model_cycle, gait.walk
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
    write_atomically(folder / SUMMARY_FILE, json.dumps(summary, indent=2) + "\n")
