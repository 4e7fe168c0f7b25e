"""Paths along geodesics: are speeds and moment arms derivatives, are lengths continuous, what does a path cost?

Two ends at random places on either side of surfaces. A jump is counted where a length changes on a
short way by more than the ends move. Where a surface is met, or another way gets shorter, within
the step of a difference, smaller steps are taken. OpenSim's own times are those of one PathWrap on
the machine of shared/oracle/muscles, and of two on that of the table.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

import osimlite
from osimlite.schema.muscles import PathActuator
from osimlite.schema.paths import PathPoint, PathWrap

SIZES: dict[str, dict[str, Any]] = {
    "Cylinder": {"radius": 0.03, "length": 9.0},
    "Sphere": {"radius": 0.04},
    "Ellipsoid": {"dimensions": (0.03, 0.05, 0.04)},
    "Torus": {"inner_radius": 0.015, "outer_radius": 0.05},
}
APART = {"translation": (0.09, 0.01, 0.02), "xyz_body_rotation": (0.4, -0.3, 0.2)}
CASES = {
    "cylinder": (["Cylinder all"], "3"),
    "cylinder with a side": (["Cylinder y"], "3"),
    "sphere": (["Sphere all"], ""),
    "ellipsoid": (["Ellipsoid all"], "7 to 27"),
    "torus": (["Torus all"], "13"),
    "cylinder and ellipsoid": (["Cylinder all", "Ellipsoid all"], "35"),
    "two cylinders": (["Cylinder all", "Cylinder all"], "17"),
    "two ellipsoids": (["Ellipsoid all", "Ellipsoid all"], ""),
    "ellipsoid and sphere": (["Ellipsoid all", "Sphere all"], ""),
    "sphere and ellipsoid": (["Sphere all", "Ellipsoid all"], ""),
    "sphere and cylinder": (["Sphere all", "Cylinder all"], ""),
    "cylinder and sphere": (["Cylinder all", "Sphere all"], ""),
    "ellipsoid and cylinder": (["Ellipsoid all", "Cylinder all"], ""),
    "ellipsoid with a side": (["Ellipsoid y"], ""),
}
POSES, SWEEPS, STEPS = 1500, 150, 400
H, EXACT = (2e-4, 2e-5, 4e-6, 1e-6), 1e-9
MOVING = [3, 4, 5, 9, 10, 11]
Ends = np.ndarray


def made(kinds: list[str]) -> osimlite.Model:
    """A path between two free bodies around surfaces of ground."""
    model, force = osimlite.Model(name="m"), PathActuator(name="p")
    for name in "AB":
        body = model.add(osimlite.Body(name=name, mass=1.0, inertia=(1, 1, 1, 0, 0, 0)))
        joint = osimlite.FreeJoint(name=f"j{name}")
        for number, coordinate in enumerate(joint.coordinates):
            coordinate.name = f"{name}{number}"
        model.add(joint.between(model.ground, body))
        point = PathPoint(name=name, socket_parent_frame=f"/bodyset/{name}")
        force.geometry_path.path_point_set.objects.append(point)
    for number, (kind, side) in enumerate(words.split() for words in kinds):
        place: dict[str, Any] = APART if number else {}
        surface = getattr(osimlite, f"Wrap{kind}")(
            name=f"w{number}", quadrant=side, **SIZES[kind], **place
        )
        model.ground.wrap_object_set.objects.append(surface)
        force.geometry_path.path_wrap_set.objects.append(
            PathWrap(name=f"w{number}", wrap_object=surface.name)
        )
    model.add(force)
    return model


def pose(ends: Ends) -> Ends:
    """Coordinates."""
    q = np.zeros(12)
    q[MOVING] = ends
    return q


def drawn(rng: np.random.Generator, case: str) -> Ends:
    """Ends on either side."""
    far, near = rng.uniform((0.08, 0.15), (0.2, 0.3)), rng.uniform(-0.06, 0.06, 4)
    ends = [(-far[0], *near[:2]), (far[1], *near[2:])]
    return np.concatenate([np.roll(end, 2) if case == "torus" else end for end in ends])


def jumps(length: Callable[[Ends], float], one: Ends, two: Ends) -> int:
    """How often a length jumps on the way."""
    step = (two - one) / STEPS
    lengths = np.diff([length(one + k * step) for k in range(STEPS + 1)])
    return int(
        np.sum(np.abs(lengths) > 1.01 * np.linalg.norm(step[:3]) + 1.01 * np.linalg.norm(step[3:]))
    )


def slope(length: Callable[[Ends], float], ends: Ends, way: Ends, h: float) -> float:
    """The rate of a length on a way, by differences, extrapolated."""
    one, two, four = (
        (length(ends + h / k * way) - length(ends - h / k * way)) * k / (2 * h) for k in (1, 2, 4)
    )
    return (64 * four - 20 * two + one) / 45


def cost(paths: osimlite.simulation.paths.Paths, poses: list[Ends]) -> float:
    """Time of an evaluation, us."""
    still, times = np.zeros(12), []
    for _ in range(5):
        begin = time.process_time()
        for q in poses:
            paths.system.measure_paths(q, still, 0)
        times.append((time.process_time() - begin) / len(poses))
    return 1e6 * min(times)


def measured(case: str, kinds: list[str], opensim: str) -> list[str]:
    """A row of the table."""
    model, rng = made(kinds), np.random.default_rng(1)
    ways = {
        wrapping: osimlite.paths(model, wrapping=wrapping) for wrapping in ("geodesic", "opensim")
    }
    paths, (owner,) = ways["geodesic"], ways["geodesic"].names
    coordinates = [info.path for info in paths.mechanism.coordinates]

    def length(ends: Ends) -> float:
        return paths.lengths(pose(ends))[owner]

    poses, errors = [drawn(rng, case) for _ in range(POSES)], []
    for ends in poses:
        way = rng.normal(size=6) / 3.0
        arms, speed = (
            paths.moment_arms(pose(ends))[owner],
            paths.speeds(pose(ends), pose(way))[owner],
        )
        by_arms = -sum(
            arms.get(coordinates[k], 0.0) * part for k, part in zip(MOVING, way, strict=True)
        )
        error = np.inf
        for h in H:
            if error > EXACT:
                quotient = slope(length, ends, way, h)
                error = min(error, max(abs(quotient - by_arms), abs(quotient - speed)))
        errors.append(error)
    torn = sum(jumps(length, drawn(rng, case), drawn(rng, case)) for _ in range(SWEEPS))
    bent = [pose(ends) for ends in poses if len(paths.points(pose(ends))[owner]) > 2]
    straight = [pose(np.array((0.3, 0.0, 0.3, 0.3, 0.2, 0.3)))] * len(bent)
    costs = [cost(each, bent) - cost(each, straight) for each in ways.values()]
    bad = sum(error > EXACT for error in errors)
    quantiles = (f"{value:.0e}" for value in np.quantile(errors, (0.5, 0.999)))
    return [
        case,
        f"{len(bent)}",
        *quantiles,
        f"{bad}",
        f"{torn}",
        *(f"{each:.1f}" for each in costs),
        opensim,
    ]


table = Table(
    title=f"{POSES} poses and {SWEEPS} sweeps each; errors of speeds and moment arms in m/s, m; times in us"
)
for label in (
    "surfaces",
    "bent",
    "median",
    "99.9 %",
    "> 1e-9",
    "jumps",
    "geodesic",
    "as OpenSim",
    "OpenSim",
):
    table.add_column(label, justify="right")
for case, (kinds, opensim) in CASES.items():
    table.add_row(*measured(case, kinds, opensim))
Console(width=120).print(table)
