"""How far from its cycle a walker may start and still walk."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from osimlite.base.records import dataclass
from osimlite.errors import OsimliteError
from osimlite.simulation.batches import BatchEngine, Floats, Ints
from osimlite.studies.gait.cycle import Cycle
from osimlite.studies.gait.starts import lift_to_depth
from osimlite.studies.gait.stepmap import StepMap
from osimlite.studies.gait.steps import Walk, measure_along_slope, walk_many

SWEEP_ACCURACY = 1e-5
"""Of the integrator, where many walkers walk many steps."""

AT_ONCE = 64
"""So many walkers between two reports of progress."""

Progress = Callable[[int, int], object]
"""Called with the number of walkers that have walked, and of all."""


@dataclass(frozen=True, eq=False)
class Axis:
    """One entry of the state that is changed."""

    label: str  # what it is called, with its unit
    place: int  # in the state
    values: Floats  # (k,)


@dataclass(frozen=True, eq=False)
class Basin:
    """How many steps walkers make from a grid of starts."""

    x: Axis  # what changes along the columns
    y: Axis  # what changes along the rows
    steps: Ints  # made before the fall, at most `wanted` (rows, columns)
    wanted: int  # as many steps count as walking
    center: tuple[float, float]  # values of x and y on the cycle

    @property
    def part(self) -> float:
        """Which part of the starts walks."""
        return float((self.steps >= self.wanted).mean())


def sample_perturbed_starts(
    step_map: StepMap, state: ArrayLike, part: float, count: int, seed: int
) -> Floats:
    """Random starts (count, y) near a state.

    Every value and every speed, as far as it is not neutral, is multiplied by a number that lies
    within `part` of 1; then the walker is lifted or lowered until the foot that stands is as deep
    in the ground as it was.

    Args:
        step_map: of the walker.
        state: best one at which a single foot stands (y,).
        part: 0.05 for five per cent.
        count: how many starts.
        seed: of the random numbers.
    """
    here = np.array(state, dtype=float)
    change = np.random.default_rng(seed).uniform(-part, part, (count, len(here))) * here
    engine, footing = step_map.engine, step_map.footing
    _, depths = measure_along_slope(engine, here[None])
    deepest = [
        max(float(depths[0, engine.contacts.index(name)]) for name in foot) for foot in footing.feet
    ]
    foot = int(np.argmax(deepest))
    return lift_to_depth(
        engine, footing, here + change @ (step_map.basis @ step_map.basis.T), deepest[foot], foot
    )


def walks_from(
    step_map: StepMap,
    cycle: Cycle,
    states: Floats,
    wanted: int,
    *,
    accuracy: float = SWEEP_ACCURACY,
    progress: Progress | None = None,
) -> list[Walk]:
    """Let walkers walk as long as a walker on the cycle takes for a number of steps, and half as long again.

    Args:
        step_map: of the walker.
        cycle: its cycle.
        states: starts (W, y).
        wanted: number of steps.
        accuracy: of the integrator.
        progress: called now and then.
    """
    result: list[Walk] = []
    for first in range(0, len(states), AT_ONCE):
        result += walk_many(
            step_map.engine,
            states[first : first + AT_ONCE],
            1.5 * wanted * cycle.period,
            footing=step_map.footing,
            accuracy=accuracy,
            threads=step_map.threads,
        )
        if progress is not None:
            progress(len(result), len(states))
    return result


def find_basin(
    step_map: StepMap,
    cycle: Cycle,
    x: str = "",
    y: str = "",
    *,
    reach: float = 0.5,
    grid: int = 21,
    wanted: int = 20,
    accuracy: float = SWEEP_ACCURACY,
    progress: Progress | None = None,
) -> Basin:
    """Let walkers start on a grid around a cycle.

    Args:
        step_map: of the walker.
        cycle: its cycle.
        x: what changes along the columns: a coordinate, or with ``/speed`` behind its name its
            speed. By default the speed of the first joint of the leg that strikes.
        y: likewise along the rows; by default of the other leg.
        reach: how far from the cycle, rad, m or per second.
        grid: values of each.
        wanted: steps after which a walker walks.
        accuracy: of the integrator.
        progress: called now and then.

    Raises:
        OsimliteError: there is no such coordinate, or nothing to take by default.
    """
    named = basin_places(step_map.engine, x, y)
    defaults = (0, 0) if None not in named else _leg_speeds(step_map)
    # A default that is named for the other axis gives way to the other default.
    free = [other[0] if other[0] not in named else other[1] for other in (defaults, defaults[::-1])]
    places = [other if place is None else place for place, other in zip(named, free, strict=True)]
    axes = [
        _axis(step_map.engine, place, float(cycle.state[place]), reach, grid) for place in places
    ]
    columns, rows = np.meshgrid(axes[0].values, axes[1].values)
    states = np.tile(cycle.state, (grid * grid, 1))
    states[:, places[0]], states[:, places[1]] = columns.ravel(), rows.ravel()
    starts = lift_to_depth(step_map.engine, step_map.footing, states)
    walks = walks_from(step_map, cycle, starts, wanted, accuracy=accuracy, progress=progress)
    made = np.array([min(len(walk.steps), wanted) for walk in walks], dtype=np.int64)
    return Basin(
        axes[0],
        axes[1],
        made.reshape(grid, grid),
        wanted,
        (float(cycle.state[places[0]]), float(cycle.state[places[1]])),
    )


def _leg_speeds(step_map: StepMap) -> tuple[int, int]:
    """Places of the speeds of the first joints of the two legs."""
    n = len(step_map.engine.order)
    if step_map.exchange is None:
        raise OsimliteError(
            "the legs are not alike; name what the basin is drawn over with --basin-x and --basin-y"
        )
    first = next(k for k in range(n) if step_map.exchange[k] != k)
    return n + first, n + int(step_map.exchange[first])


def basin_places(engine: BatchEngine, x: str = "", y: str = "") -> tuple[int | None, int | None]:
    """Where in a state the numbers are that a basin changes by name; None where the default is to be taken.

    Raises:
        OsimliteError: there is no such coordinate, it is locked, or both are the same.
    """
    places = _find_index(engine, x) if x else None, _find_index(engine, y) if y else None
    if places[0] is not None and places[0] == places[1]:
        raise OsimliteError(f"'{x}' and '{y}' are the same number; a basin is drawn over two")
    return places


def _find_index(engine: BatchEngine, name: str) -> int:
    coordinate, slash, kind = name.rpartition("/")
    is_speed = bool(slash) and kind == "speed"
    place = engine.mechanism.coordinate_index(coordinate if is_speed else name)
    if place not in engine.order:
        raise OsimliteError(f"'{name}' is locked; name a coordinate that moves")
    return engine.order.index(place) + (len(engine.order) if is_speed else 0)


def _axis(engine: BatchEngine, place: int, value: float, reach: float, grid: int) -> Axis:
    n = len(engine.order)
    info = engine.mechanism.coordinates[engine.order[place % n]]
    unit = "rad" if info.motion_type == "rotational" else "m"
    label = f"{info.name} ({unit})" if place < n else f"speed of {info.name} ({unit}/s)"
    return Axis(label, place, value + np.linspace(-reach, reach, grid))
