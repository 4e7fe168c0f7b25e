"""Check and time paths along geodesics: speeds, moment arms, continuity of lengths, and cost.

    python benchmarks/geodesics.py

A path runs between two points around one or two wrap surfaces. The points have random positions on
either side of the surfaces. The table has a row for each combination of surfaces:

- bent: number of poses in which the path touches a surface;
- median, 99.9 %, > 1e-9: errors of speeds (m/s) and moment arms (m) against differences of lengths:
  median, 0.999 quantile, and number of poses with a larger error than 1e-9;
- jumps: how often a length changes in a small step by more than the end points move;
- geodesic, as OpenSim: processor time (us) by which bent paths take longer than straight ones,
  along geodesics and with OpenSim's wrapping algorithms in osimlite;
- OpenSim: the same of OpenSim's own code (us). These times were measured once: of one PathWrap on
  the machine of shared/oracle/muscles, of two on the machine of the other columns at that time.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table

import osimlite
from osimlite.schema.muscles import PathActuator
from osimlite.schema.paths import PathPoint, PathWrap
from osimlite.simulation.paths import Paths

SIZES: dict[str, dict[str, Any]] = {
    # The cylinder is long, so that no path leaves it at an end.
    "Cylinder": {"radius": 0.03, "length": 9.0},
    "Sphere": {"radius": 0.04},
    "Ellipsoid": {"dimensions": (0.03, 0.05, 0.04)},
    "Torus": {"inner_radius": 0.015, "outer_radius": 0.05},
}
"""Sizes of the surfaces (m)."""

SECOND_POSITION = {"translation": (0.09, 0.01, 0.02), "xyz_body_rotation": (0.4, -0.3, 0.2)}
"""Position (m) and orientation (rad) of a second surface; the first is at the origin."""


class Surfaces(NamedTuple):
    """Wrap surfaces of a path.

    Attributes:
        surfaces: class and quadrant of each surface.
        opensim_time: time of OpenSim (us) in words, empty if it was not measured.
    """

    surfaces: list[str]
    opensim_time: str


CASES = {
    "cylinder": Surfaces(["Cylinder all"], "3"),
    "cylinder with a side": Surfaces(["Cylinder y"], "3"),
    "sphere": Surfaces(["Sphere all"], ""),
    "ellipsoid": Surfaces(["Ellipsoid all"], "7 to 27"),
    "torus": Surfaces(["Torus all"], "13"),
    "cylinder and ellipsoid": Surfaces(["Cylinder all", "Ellipsoid all"], "35"),
    "two cylinders": Surfaces(["Cylinder all", "Cylinder all"], "17"),
    "two ellipsoids": Surfaces(["Ellipsoid all", "Ellipsoid all"], ""),
    "ellipsoid and sphere": Surfaces(["Ellipsoid all", "Sphere all"], ""),
    "sphere and ellipsoid": Surfaces(["Sphere all", "Ellipsoid all"], ""),
    "sphere and cylinder": Surfaces(["Sphere all", "Cylinder all"], ""),
    "cylinder and sphere": Surfaces(["Cylinder all", "Sphere all"], ""),
    "ellipsoid and cylinder": Surfaces(["Ellipsoid all", "Cylinder all"], ""),
    "ellipsoid with a side": Surfaces(["Ellipsoid y"], ""),
}

POSE_COUNT = 1500
"""Number of random poses in which derivatives are compared."""

SWEEP_COUNT = 150
"""Number of lines between random poses along which jumps are counted."""

SWEEP_STEPS = 400

DIFFERENCE_STEPS = (2e-4, 2e-5, 4e-6, 1e-6)
"""Steps of differences (m), tried in this order until the error is small.

A difference is wrong where the path touches a surface, or changes the side, within its step.
"""

MAX_ERROR = 1e-9
"""Error of a derivative (m/s, m) that counts as rounding of the differences."""

JUMP_FACTOR = 1.01
"""Change of a length, relative to the motion of the end points, above which it is a jump."""

END_COORDINATES = [3, 4, 5, 9, 10, 11]
"""Indices of the translations among the coordinates of the two free joints."""

TIMING_ROUNDS = 5
"""Repetitions of each timing; the fastest counts."""

EndPoints = np.ndarray
"""Positions of both end points in ground (6,), m."""


def make_model(surfaces: Sequence[str]) -> osimlite.Model:
    """Make a model with a path between two free bodies around surfaces of ground.

    Args:
        surfaces: class and quadrant of each surface, for example "Cylinder all".
    """
    model = osimlite.Model(name="m")
    force = PathActuator(name="p")
    for name in "AB":
        body = model.add(osimlite.Body(name=name, mass=1.0, inertia=(1, 1, 1, 0, 0, 0)))
        joint = osimlite.FreeJoint(name=f"j{name}")
        for index, coordinate in enumerate(joint.coordinates):
            coordinate.name = f"{name}{index}"
        model.add(joint.between(model.ground, body))
        point = PathPoint(name=name, socket_parent_frame=f"/bodyset/{name}")
        force.geometry_path.path_point_set.objects.append(point)
    for index, words in enumerate(surfaces):
        surface_class, quadrant = words.split()
        position: dict[str, Any] = SECOND_POSITION if index else {}
        surface = getattr(osimlite, f"Wrap{surface_class}")(
            name=f"w{index}", quadrant=quadrant, **SIZES[surface_class], **position
        )
        model.ground.wrap_object_set.objects.append(surface)
        wrap = PathWrap(name=f"w{index}", wrap_object=surface.name)
        force.geometry_path.path_wrap_set.objects.append(wrap)
    model.add(force)
    return model


def to_coordinates(ends: EndPoints) -> np.ndarray:
    """Return the coordinates (12,) at which the end points have these positions.

    The same function maps velocities of the end points to speeds, as no body rotates.
    """
    q = np.zeros(12)
    q[END_COORDINATES] = ends
    return q


def draw_end_points(rng: np.random.Generator, case: str) -> EndPoints:
    """Draw random end points on either side of the surfaces."""
    distances = rng.uniform((0.08, 0.15), (0.2, 0.3))
    offsets = rng.uniform(-0.06, 0.06, 4)
    first = (-distances[0], *offsets[:2])
    second = (distances[1], *offsets[2:])
    if case == "torus":
        # Paths run through the hole of a torus, along z.
        return np.concatenate([np.roll(first, 2), np.roll(second, 2)])
    return np.concatenate([first, second])


def count_jumps(length: Callable[[EndPoints], float], start: EndPoints, end: EndPoints) -> int:
    """Count the jumps of a length while the end points move along straight lines.

    Args:
        length: length of the path (m) at end points.
        start: end points at the start.
        end: end points at the end.
    """
    step = (end - start) / SWEEP_STEPS
    changes = np.diff([length(start + k * step) for k in range(SWEEP_STEPS + 1)])
    # A length cannot change by more than both ends move.
    motion = np.linalg.norm(step[:3]) + np.linalg.norm(step[3:])
    return int(np.sum(np.abs(changes) > JUMP_FACTOR * motion))


def differentiate_length(
    length: Callable[[EndPoints], float], ends: EndPoints, velocity: EndPoints, step: float
) -> float:
    """Return the rate of a length (m/s) by central differences, extrapolated twice (Richardson).

    Args:
        length: length of the path (m) at end points.
        ends: end points.
        velocity: velocities of the end points (m/s).
        step: largest step of the differences (s).
    """
    full, half, quarter = (
        (length(ends + step / k * velocity) - length(ends - step / k * velocity)) * k / (2 * step)
        for k in (1, 2, 4)
    )
    # The weights cancel the errors of second and fourth order.
    return (64 * quarter - 20 * half + full) / 45


def measure_evaluation(paths: Paths, poses: Sequence[np.ndarray]) -> float:
    """Return the processor time to compute the path in one pose (us)."""
    speeds = np.zeros(12)
    times = []
    for _ in range(TIMING_ROUNDS):
        start = time.process_time()
        for q in poses:
            paths.system.measure_paths(q, speeds, 0)
        times.append((time.process_time() - start) / len(poses))
    return 1e6 * min(times)


def measure_error(
    paths: Paths,
    length: Callable[[EndPoints], float],
    ends: EndPoints,
    velocity: EndPoints,
) -> float:
    """Return the error of the speed (m/s) and of the moment arms (m) in one pose.

    Args:
        paths: path of the model.
        length: its length (m) at end points.
        ends: end points.
        velocity: velocities of the end points (m/s).
    """
    (name,) = paths.names
    coordinates = [info.path for info in paths.mechanism.coordinates]
    q = to_coordinates(ends)
    moment_arms = paths.moment_arms(q)[name]
    speed = paths.speeds(q, to_coordinates(velocity))[name]
    # A moment arm is the negative derivative of the length by a coordinate.
    speed_by_moment_arms = -sum(
        moment_arms.get(coordinates[index], 0.0) * rate
        for index, rate in zip(END_COORDINATES, velocity, strict=True)
    )
    error = np.inf
    for step in DIFFERENCE_STEPS:
        # Smaller steps have larger rounding errors: they are used only where they must be.
        if error > MAX_ERROR:
            rate = differentiate_length(length, ends, velocity, step)
            error = min(error, max(abs(rate - speed_by_moment_arms), abs(rate - speed)))
    return error


def measure_case(case: str) -> list[str]:
    """Return the row of the table for a case of `CASES`."""
    surfaces, opensim_time = CASES[case]
    model = make_model(surfaces)
    rng = np.random.default_rng(1)
    geodesic = osimlite.paths(model, wrapping="geodesic")
    as_opensim = osimlite.paths(model, wrapping="opensim")
    (name,) = geodesic.names

    def length(ends: EndPoints) -> float:
        return geodesic.lengths(to_coordinates(ends))[name]

    poses = [draw_end_points(rng, case) for _ in range(POSE_COUNT)]
    errors = [measure_error(geodesic, length, ends, rng.normal(size=6) / 3.0) for ends in poses]
    jumps = sum(
        count_jumps(length, draw_end_points(rng, case), draw_end_points(rng, case))
        for _ in range(SWEEP_COUNT)
    )
    all_coordinates = [to_coordinates(ends) for ends in poses]
    # A path that touches no surface has two points, its ends.
    bent = [q for q in all_coordinates if len(geodesic.points(q)[name]) > 2]
    # Both ends are far away from the surfaces on the same side: the path touches none.
    straight = [to_coordinates(np.array((0.3, 0.0, 0.3, 0.3, 0.2, 0.3)))] * len(bent)
    times = [
        # The difference is the cost of the surfaces alone.
        measure_evaluation(paths, bent) - measure_evaluation(paths, straight)
        for paths in (geodesic, as_opensim)
    ]
    return [
        case,
        str(len(bent)),
        *(f"{value:.0e}" for value in np.quantile(errors, (0.5, 0.999))),
        str(sum(error > MAX_ERROR for error in errors)),
        str(jumps),
        *(f"{value:.1f}" for value in times),
        opensim_time,
    ]


def main() -> None:
    """Print the table."""
    table = Table(
        title=f"Paths in {POSE_COUNT} poses and along {SWEEP_COUNT} sweeps",
        caption="errors of speeds and moment arms in m/s and m; last three columns: times in us",
    )
    headings = (
        "surfaces",
        "bent",
        "median",
        "99.9 %",
        "> 1e-9",
        "jumps",
        "geodesic",
        "as OpenSim",
        "OpenSim",
    )
    for heading in headings:
        table.add_column(heading, justify="right")
    for case in CASES:
        table.add_row(*measure_case(case))
    Console(width=120).print(table)


if __name__ == "__main__":
    main()
