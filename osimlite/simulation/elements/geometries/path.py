"""A path of straight lines through points that are fixed in bodies."""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from typing import Any

from osimlite.errors import ModelError
from osimlite.schema.paths import GeometryPath, PathPoint
from osimlite.simulation.elements.gather import ElementBuilder, Triple, kind_of, triple
from osimlite.simulation.elements.geometries.geometry import Geometry
from osimlite.simulation.elements.items import Places
from osimlite.simulation.kernels.pointers import Floats, Ints, at
from osimlite.simulation.kernels.points import apply_force, station, velocity

Point = tuple[int, Triple]
"""A body, and a station in it (m)."""


def path_length(s: Ints, w: Floats, g: Ints, gp: Floats) -> tuple[float, float]:
    """Length and rate."""
    count, links = g[0], at(g, 1)
    length = rate = 0.0
    ax, ay, az = station(s, w, links[0], gp[0], gp[1], gp[2])
    for k in range(1, count):
        bx, by, bz = station(s, w, links[k], gp[3 * k], gp[3 * k + 1], gp[3 * k + 2])
        dx, dy, dz = bx - ax, by - ay, bz - az
        part = sqrt(dx * dx + dy * dy + dz * dz)
        if part > 0.0:
            ux, uy, uz = velocity(s, w, links[k - 1], ax, ay, az)
            vx, vy, vz = velocity(s, w, links[k], bx, by, bz)
            rate += ((vx - ux) * dx + (vy - uy) * dy + (vz - uz) * dz) / part
        length += part
        ax, ay, az = bx, by, bz
    return length, rate


def pull_path(s: Ints, w: Floats, g: Ints, gp: Floats, tension: float) -> None:
    """Pull at all points along the lines."""
    if tension == 0.0:
        return
    count, links = g[0], at(g, 1)
    ax, ay, az = station(s, w, links[0], gp[0], gp[1], gp[2])
    for k in range(1, count):
        bx, by, bz = station(s, w, links[k], gp[3 * k], gp[3 * k + 1], gp[3 * k + 2])
        dx, dy, dz = bx - ax, by - ay, bz - az
        part = sqrt(dx * dx + dy * dy + dz * dz)
        if part > 0.0:
            by_length = tension / part
            fx, fy, fz = by_length * dx, by_length * dy, by_length * dz
            apply_force(s, w, links[k - 1], ax, ay, az, fx, fy, fz)
            apply_force(s, w, links[k], bx, by, bz, -fx, -fy, -fz)
        ax, ay, az = bx, by, bz


class AlongPath(Geometry):
    """A path: length (m) and rate (m/s); the output `tension` (N) pulls at its points along it."""

    inputs = ("length", "rate")
    before = ("length, rate = path_length(s, w, g, gp)",)
    after = ("pull_path(s, w, g, gp, tension)",)
    calls = (path_length, pull_path)

    def read(self, builder: ElementBuilder, force: Any) -> tuple[Point, ...]:
        """The points of a force's path.

        Raises:
            UnsupportedError: a point moves or comes and goes, or the path wraps around a surface.
            ModelError: there are less than two points.
        """
        path = force.geometry_path
        if type(path) is not GeometryPath:
            raise builder.unsupported(force, f" on a {kind_of(path)}")
        if path.path_wrap_set.objects:
            raise builder.unsupported(force, f" that wraps around '{_wrapped(path)}'")
        found = []
        for point in path.path_point_set.objects:
            if type(point) is not PathPoint:
                raise builder.unsupported(force, f" with the {kind_of(point)} '{point.name}'")
            body, placed = builder.placement(builder.target(point, "socket_parent_frame", point.socket_parent_frame))
            builder.check(point, point.location)
            found.append((body, triple(placed[:3, :3] @ point.location + placed[:3, 3])))
        if len(found) < 2:
            raise ModelError(f"the path of '{builder.path(force)}' has {len(found)} points; give it at least two")
        return tuple(found)

    def pack(self, place: tuple[Point, ...], places: Places) -> tuple[Sequence[int], Sequence[float]]:
        """Count and links of the points; the points in these."""
        stations = [places.station(body, point) for body, point in place]
        return [len(stations), *(link for link, _ in stations)], [x for _, point in stations for x in point]


PATH = AlongPath()


def _wrapped(path: GeometryPath) -> str:
    named = path.path_wrap_set.objects[0].wrap_object
    return named if isinstance(named, str) else named.name
