"""Basin of attraction of a gait cycle: from which perturbed states a walker still walks."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from osimlite.base.records import dataclass
from osimlite.errors import ModelError, OsimliteError, SettingError
from osimlite.simulation.batches import BatchEngine, Floats, Ints
from osimlite.studies.gait.cycle import Cycle
from osimlite.studies.gait.starts import lift_to_depth
from osimlite.studies.gait.stepmap import StepMap
from osimlite.studies.gait.steps import WalkerSteps, measure_along_slope, walk_many

SWEEP_ACCURACY = 1e-5
"""Accuracy of the integrator where many walkers make many steps; cycles need a tighter one."""

WALKERS_PER_REPORT = 64
"""Walkers that are simulated between two reports of progress."""

Progress = Callable[[int, int], object]
"""Callback with the number of walkers that have been simulated, and of all."""


@dataclass(frozen=True, eq=False)
class Axis:
    """Entry of the state that varies along one side of the grid.

    Attributes:
        label: name with its unit.
        state_index: index in the state.
        values: values on the grid (k,) (rad, m, rad/s or m/s).
    """

    label: str
    state_index: int
    values: Floats


@dataclass(frozen=True, eq=False)
class Basin:
    """Number of steps that walkers make from a grid of initial states.

    Attributes:
        x: entry of the state that varies along the columns.
        y: entry of the state that varies along the rows.
        steps: steps before the fall, at most `target_steps` (rows, columns).
        target_steps: number of steps after which a walker counts as walking.
        center: values of x and y on the cycle.
    """

    x: Axis
    y: Axis
    steps: Ints
    target_steps: int
    center: tuple[float, float]

    @property
    def part(self) -> float:
        """Part of the initial states, 0 to 1, from which the walker walks."""
        return float((self.steps >= self.target_steps).mean())


def sample_perturbed_starts(
    step_map: StepMap, state: ArrayLike, max_change: float, count: int, seed: int
) -> Floats:
    """Return random initial states (count, y) near a state.

    Each value and speed is multiplied by a uniform random number between 1 - `max_change` and
    1 + `max_change`, except along neutral directions. Then the walker is lifted or lowered until
    the penetration of the stance foot is as before.

    Args:
        step_map: step map of the walker.
        state: state (y,), preferably in single support.
        max_change: largest relative change, for example 0.05.
        count: number of initial states.
        seed: seed of the random numbers.
    """
    # Only the part of the change along `basis` is applied: the rest changes nothing of the motion.
    center = np.array(state, dtype=float)
    change = (
        np.random.default_rng(seed).uniform(-max_change, max_change, (count, len(center))) * center
    )
    engine, footing = step_map.engine, step_map.footing
    _, depths = measure_along_slope(engine, center[None])
    # In single support only the stance foot penetrates the ground; its penetration is kept.
    deepest = [
        max(float(depths[0, engine.contacts.index(name)]) for name in foot) for foot in footing.feet
    ]
    foot = int(np.argmax(deepest))
    return lift_to_depth(
        engine, footing, center + change @ (step_map.basis @ step_map.basis.T), deepest[foot], foot
    )


def simulate_walks(
    step_map: StepMap,
    cycle: Cycle,
    states: Floats,
    target_steps: int,
    *,
    accuracy: float = SWEEP_ACCURACY,
    progress: Progress | None = None,
) -> list[WalkerSteps]:
    """Simulate walkers for one and a half times the duration of a number of steps on the cycle.

    Args:
        step_map: step map of the walker.
        cycle: gait cycle, which gives the duration of a step.
        states: initial states (W, y).
        target_steps: number of steps.
        accuracy: accuracy of the integrator.
        progress: callback after each part of the walkers.

    Returns:
        The walk of each walker.
    """
    result: list[WalkerSteps] = []
    for first_walker in range(0, len(states), WALKERS_PER_REPORT):
        result += walk_many(
            step_map.engine,
            states[first_walker : first_walker + WALKERS_PER_REPORT],
            1.5 * target_steps * cycle.period,
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
    target_steps: int = 20,
    accuracy: float = SWEEP_ACCURACY,
    progress: Progress | None = None,
) -> Basin:
    """Simulate walkers from a grid of initial states around a cycle.

    Args:
        step_map: step map of the walker.
        cycle: gait cycle.
        x: coordinate that varies along the columns, or its speed as `NAME/speed`. The default is
            the speed of the first joint of the leg that touches down.
        y: coordinate that varies along the rows; the default is the same speed of the other leg.
        reach: half the width of the grid (rad, m, rad/s or m/s).
        grid: number of values along each side.
        target_steps: number of steps after which a walker counts as walking.
        accuracy: accuracy of the integrator.
        progress: callback after each part of the walkers.

    Returns:
        Number of steps from each initial state of the grid.

    Raises:
        OsimliteError: a coordinate is unknown or locked, or the legs are not alike, so that there
            are no defaults.
    """
    selected = find_basin_offsets(step_map.engine, x, y)
    defaults = (0, 0) if None not in selected else _find_leg_speeds(step_map)
    # If the user selects the default of one axis for the other one, the axes exchange defaults.
    default_offsets = [
        default_pair[0] if default_pair[0] not in selected else default_pair[1]
        for default_pair in (defaults, defaults[::-1])
    ]
    offsets = [
        default_pair if offset is None else offset
        for offset, default_pair in zip(selected, default_offsets, strict=True)
    ]
    axes = [
        _make_axis(step_map.engine, offset, float(cycle.state[offset]), reach, grid)
        for offset in offsets
    ]
    columns, rows = np.meshgrid(axes[0].values, axes[1].values)
    # Other entries of the state remain those of the cycle.
    states = np.tile(cycle.state, (grid * grid, 1))
    states[:, offsets[0]], states[:, offsets[1]] = columns.ravel(), rows.ravel()
    # A changed angle would push the foot into the ground or lift it, so that the height is
    # corrected.
    starts = lift_to_depth(step_map.engine, step_map.footing, states)
    walks = simulate_walks(
        step_map, cycle, starts, target_steps, accuracy=accuracy, progress=progress
    )
    step_counts = np.array([min(len(walk.steps), target_steps) for walk in walks], dtype=np.int64)
    return Basin(
        axes[0],
        axes[1],
        step_counts.reshape(grid, grid),
        target_steps,
        (float(cycle.state[offsets[0]]), float(cycle.state[offsets[1]])),
    )


def _find_leg_speeds(step_map: StepMap) -> tuple[int, int]:
    """Return the offsets in the state of the speeds of the first joints of the two legs.

    Raises:
        OsimliteError: the legs are not alike.
    """
    dof_count = len(step_map.engine.order)
    if step_map.exchange is None:
        raise OsimliteError(
            "the legs are not alike; name what the basin is drawn over with --basin-x and --basin-y"
        )
    # The first coordinate that the exchange moves is the hip: coordinates are ordered from the root
    # outwards.
    hip = next(k for k in range(dof_count) if step_map.exchange[k] != k)
    return dof_count + hip, dof_count + int(step_map.exchange[hip])


def find_basin_offsets(
    engine: BatchEngine, x: str = "", y: str = ""
) -> tuple[int | None, int | None]:
    """Find the entries of the state that a basin varies by name.

    Args:
        engine: engine of the model.
        x: coordinate, or its speed as `NAME/speed`; "" for the default.
        y: second coordinate or speed; "" for the default.

    Returns:
        Offsets in the state; None for a default.

    Raises:
        SettingError: there is no such coordinate, it is locked, or both are the same.
    """
    offsets = _find_index(engine, x) if x else None, _find_index(engine, y) if y else None
    if offsets[0] is not None and offsets[0] == offsets[1]:
        raise SettingError(
            f"'{x}' and '{y}' are the same variable; a basin needs two different ones"
        )
    return offsets


def _find_index(engine: BatchEngine, name: str) -> int:
    """Return the index in the state of a coordinate, or of its speed (`NAME/speed`).

    Raises:
        SettingError: the coordinate does not exist, or is locked.
    """
    coordinate, slash, quantity = name.rpartition("/")
    is_speed = bool(slash) and quantity == "speed"
    try:
        coordinate_index = engine.mechanism.coordinate_index(coordinate if is_speed else name)
    except ModelError as error:
        # The name is wrong and not the model.
        raise SettingError(error.message) from None
    if coordinate_index not in engine.order:
        raise SettingError(f"'{name}' is locked; name a coordinate that moves")
    return engine.order.index(coordinate_index) + (len(engine.order) if is_speed else 0)


def _make_axis(
    engine: BatchEngine, offset: int, value: float, half_width: float, grid: int
) -> Axis:
    """Return the axis of a state entry, with values up to `half_width` to either side of its own."""
    dof_count = len(engine.order)
    info = engine.mechanism.coordinates[engine.order[offset % dof_count]]
    unit = "rad" if info.motion_type == "rotational" else "m"
    label = f"{info.name} ({unit})" if offset < dof_count else f"speed of {info.name} ({unit}/s)"
    return Axis(label, offset, value + np.linspace(-half_width, half_width, grid))
