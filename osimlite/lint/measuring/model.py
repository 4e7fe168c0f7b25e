"""Measure the paths and muscles of a model."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from osimlite.errors import UnsupportedError
from osimlite.lint.measures import (
    LengthOnSurface,
    Measures,
    MeasuringPose,
    NoMachineCodeError,
    find_swept_coordinates,
    merge_measures,
)
from osimlite.lint.measuring.jumps import find_jumps
from osimlite.lint.measuring.muscles import compute_reach, compute_start, find_fibers
from osimlite.lint.measuring.points import measure_moving_points
from osimlite.lint.measuring.sweeps import Sweep, sweep_coordinates
from osimlite.lint.measuring.wrapping import compare_wrappings
from osimlite.mechanics.multibody.constraints import Coupler, Lock, PrescribedCoordinate
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.model import Model
from osimlite.simulation.elements.builder import GEODESIC
from osimlite.simulation.elements.geometries.paths.geometry_path import ThroughPoints
from osimlite.simulation.engines.linking import READY_CODE
from osimlite.simulation.engines.machine_code import has_machine_code
from osimlite.simulation.paths import Paths

NEEDS_MACHINE_CODE = (
    "with this many wrap surfaces, the measurements take minutes in Python: install osimlite where a C++ compiler is "
    "found, or run: pip install 'osimlite[jit]'"
)
"""Reason why paths around many surfaces are not measured."""

MAX_LOOP_CONSTRAINTS = 8
"""Largest number of constraints other than couplers of a model that is measured.

Published models of shoulders and knees have up to six. Every pose must be assembled with them, and
a check should take seconds.
"""

MIDDLE_PART = 0.5
"""Middle part of a range in which fiber lengths are computed; at its ends most muscles reach a limit."""


# Poses that cannot be computed give NaN, which the measurements ignore.
@np.errstate(all="ignore")
def measure_model(
    model: Model,
    *,
    compiles: bool,
    earlier: tuple[Measures, Measures] | None = None,
    mechanism: Mechanism | None = None,
) -> Measures:
    """Measure the paths and muscles of a model.

    Args:
        model: model to measure.
        compiles: whether to compile kernels that are in no library or cache yet; for a model with
            few surfaces that takes longer than running them as Python.
        earlier: earlier measurements when some paths differed or were missing, and those of them that
            are still valid.
        mechanism: mechanism of the model; built by default.

    Returns:
        The new measurements, together with earlier ones that are still valid.

    Raises:
        UnsupportedError: a path, a joint or a constraint cannot be computed.
        ModelError: the model is invalid.
        SimulationError: the constraints allow no default pose, or there are no lengths in it.
        NoMachineCodeError: the model has many surfaces, and kernels run as Python only.
    """
    earlier_measures, unchanged_measures = earlier if earlier is not None else (None, None)
    # Without machine code, the measurement of models with many surfaces is postponed.
    if compiles and not has_machine_code():
        raise NoMachineCodeError(NEEDS_MACHINE_CODE)
    # `READY_CODE` uses machine code only if it has been compiled before.
    code = None if compiles else READY_CODE
    # Paths with valid earlier measurements need not be measured again.
    paths = Paths(
        model,
        code=code,
        left_out=unchanged_measures.swept if unchanged_measures is not None else (),
        mechanism=mechanism,
    )
    has_surfaces = any(
        isinstance(route, ThroughPoints) and route.surfaces for route in paths.routes.values()
    )
    # The same paths along geodesics, which are the reference for OpenSim's wrapping.
    geodesic_paths = paths.rewrap_paths(model, GEODESIC, code) if has_surfaces else None
    _check_loop_count(paths.mechanism)
    start = paths.mechanism.assemble({})
    default = np.array(list(paths.lengths(start).values()))
    sweeps = sweep_coordinates(
        paths,
        start,
        set() if unchanged_measures is None else find_swept_coordinates(unchanged_measures),
    )
    if earlier_measures is not None and {
        sweep.coordinate_index for sweep in sweeps
    } != find_swept_coordinates(earlier_measures):
        # The earlier measurements used other poses; all paths must be measured in the same ones.
        return measure_model(model, compiles=compiles, mechanism=mechanism)
    starts, reaches = [], []
    ends = dict(
        zip(
            paths.names,
            zip(default, _find_length_extremes(sweeps, default), strict=True),
            strict=True,
        )
    )
    for fibers in find_fibers(model, paths.mechanism, ends):
        length, ((shortest, shortest_pose), (longest, longest_pose)) = ends[fibers.path]
        begun = compute_start(fibers, length)
        starts += [begun] if begun is not None else []
        reaches += [
            compute_reach(fibers, shortest, True, shortest_pose),
            compute_reach(fibers, longest, False, longest_pose),
        ]
    flags_by_coordinate = {sweep.coordinate_index: sweep.is_moving for sweep in sweeps}
    result = Measures(
        {
            name: tuple(index for index, is_moving in flags_by_coordinate.items() if is_moving[k])
            for k, name in enumerate(paths.names)
        },
        [*compare_wrappings(geodesic_paths, paths, start, sweeps)]
        if geodesic_paths is not None
        else [],
        [*find_jumps(paths, sweeps)],
        [*_find_bad_surface_lengths(paths, start, sweeps)],
        [*measure_moving_points(paths)],
        starts,
        reaches,
    )
    return result if unchanged_measures is None else merge_measures(unchanged_measures, result)


def _find_bad_surface_lengths(
    paths: Paths, start: Array, sweeps: list[Sweep]
) -> Iterator[LengthOnSurface]:
    """Yield the first negative or NaN length of each path on each surface."""
    poses = [MeasuringPose(), *(sweep.pose(value) for sweep in sweeps for value in sweep.values)]
    all_poses = np.concatenate([start[None], *(sweep.poses for sweep in sweeps)])
    for name, surface, lengths in paths.system.measure_all_on_surfaces(all_poses, paths.routes):
        for k in np.flatnonzero(~(lengths >= 0.0))[:1]:
            yield LengthOnSurface(name, surface, float(lengths[k]), poses[k])


def _check_loop_count(mechanism: Mechanism) -> None:
    """Check that poses can be assembled within the time of a check.

    Couplers do not count: a spine has a hundred of them, and they are solved at once.

    Raises:
        UnsupportedError: more than `MAX_LOOP_CONSTRAINTS` constraints close loops.
    """
    count = sum(
        not isinstance(constraint, Coupler | Lock | PrescribedCoordinate)
        for constraint in mechanism.constraints
    )
    if count > MAX_LOOP_CONSTRAINTS:
        raise UnsupportedError(
            f"{count} constraints close loops; models with more than {MAX_LOOP_CONSTRAINTS} are "
            "not measured"
        )


def _find_length_extremes(
    sweeps: list[Sweep], default: Array
) -> Iterator[tuple[tuple[float, MeasuringPose], tuple[float, MeasuringPose]]]:
    """Yield least and largest length of each path with their poses, in the middle of the ranges."""
    poses = [MeasuringPose()]
    rows = [default[None]]
    for sweep in sweeps:
        low, high = sweep.info.range
        # Rounded, so that values at the bounds of the middle part belong to it.
        middle_indices = np.flatnonzero(
            np.round(np.abs((sweep.values - low) / (high - low) - 0.5), 9) <= 0.5 * MIDDLE_PART
        )
        poses += [sweep.pose(value) for value in sweep.values[middle_indices]]
        rows.append(sweep.lengths[middle_indices])
    lengths = np.concatenate(rows)
    # Poses in which a path has no length are left out, unless it has none in the default pose.
    unknown = np.isnan(lengths) & ~np.isnan(default)
    ends = (
        np.argmin(np.where(unknown, np.inf, lengths), axis=0),
        np.argmax(np.where(unknown, -np.inf, lengths), axis=0),
    )
    for path, (shortest_index, longest_index) in enumerate(zip(*ends, strict=True)):
        yield (
            (float(lengths[shortest_index, path]), poses[shortest_index]),
            (float(lengths[longest_index, path]), poses[longest_index]),
        )
