"""A sphere and a half space that touch smoothly, at any distance."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from osimlite.errors import ModelError
from osimlite.mechanics.kernels.pointers import Floats, Ints
from osimlite.mechanics.kernels.points import apply_force, direction, station, velocity
from osimlite.mechanics.laws.vectors import Vector, along, dot, minus, put, times, vector
from osimlite.mechanics.multibody.links import Places
from osimlite.schema.contact import ContactHalfSpace, ContactSphere
from osimlite.simulation.elements.builder import ElementBuilder, kind_of
from osimlite.simulation.elements.contact import ContactSurface, surface_of
from osimlite.simulation.elements.geometries.geometry import Geometry

NO_MATERIAL = (0.0, 0.0, 0.0, 0.0, 0.0)


def sphere_depth(
    model: Ints, data: Floats, g: Ints, gp: Floats, room: Floats
) -> tuple[float, float, Vector]:
    """Depth, radius and normal; the point of contact goes into the record."""
    o, n = station(model, data, g[0], vector(gp, 0)), direction(model, data, g[0], vector(gp, 3))
    center = station(model, data, g[1], vector(gp, 6))
    d = gp[9] - dot(minus(center, o), n)
    # Half the depth is either surface's.
    put(room, 3, along(center, 0.5 * d - gp[9], n))
    return d, gp[9], n


def approach(model: Ints, data: Floats, g: Ints, room: Floats) -> Vector:
    """Velocity of the half space relative to the sphere, at the point of contact."""
    return minus(
        velocity(model, data, g[0], vector(room, 3)), velocity(model, data, g[1], vector(room, 3))
    )


def push_both(model: Ints, data: Floats, g: Ints, room: Floats, force: Vector) -> None:
    """Push the sphere and, the other way, the half space at the point of contact; the force goes into the record."""
    put(room, 0, force)
    apply_force(model, data, g[1], vector(room, 3), force)
    apply_force(model, data, g[0], vector(room, 3), times(-1.0, force))


class SphereOnPlane(Geometry):
    """A half space and a sphere: depth and radius (m), normal, and velocity of the half space relative to the sphere.

    The outputs fx, fy, fz (N) push the sphere.
    """

    inputs = ("d", "radius", "n", "v")
    before = (
        "d, radius, n = sphere_depth(model, data, g, gp, room)",
        "v = approach(model, data, g, room)",
    )
    after = ("push_both(model, data, g, room, (fx, fy, fz))",)
    calls = (sphere_depth, approach, push_both)

    def read(self, builder: ElementBuilder, force: Any) -> tuple[ContactSurface, ContactSurface]:
        """The half space and the sphere that a force names."""
        surfaces = []
        for field, wanted in (
            ("socket_half_space", ContactHalfSpace),
            ("socket_sphere", ContactSphere),
        ):
            geometry = builder.target(force, field, getattr(force, field))
            if not isinstance(geometry, wanted):
                raise ModelError(
                    f"the '{field}' of '{builder.path(force)}' is a {kind_of(geometry)}; name a {wanted.__name__}"
                )
            surfaces.append(surface_of(builder, force, geometry, NO_MATERIAL))
        return surfaces[0], surfaces[1]

    def pack(
        self, place: tuple[ContactSurface, ContactSurface], places: Places
    ) -> tuple[Sequence[int], Sequence[float]]:
        """Links; a point of the plane and its normal, centre and radius of the sphere, each in its link."""
        one, two = place
        first, on_plane = places.station(one.body, one.center)
        second, center = places.station(two.body, two.center)
        return (first, second), (
            *on_plane,
            *places.direction(one.body, one.normal),
            *center,
            two.radius,
        )

    def room(self, place: Any) -> int:
        """Force and point."""
        return 6

    def columns(self, force: Any) -> tuple[str, ...]:
        """Force and torque on the body of the sphere, then on that of the half space."""
        labels = [f"{kind}.{axis}" for kind in ("force", "torque") for axis in "XYZ"]
        return tuple(
            f"{force.name}.{surface}.{label}"
            for surface in ("Sphere", "HalfSpace")
            for label in labels
        )

    def report(
        self, force: Any, record: Sequence[float], origins: Sequence[Sequence[float]]
    ) -> list[float]:
        """Forces, and torques about the origins of the bodies, in ground."""
        half_space, sphere = force.place
        pushed, point = np.array(record[:3], dtype=float), np.array(record[3:6], dtype=float)
        row: list[float] = []
        for sign, body in ((1.0, sphere.body), (-1.0, half_space.body)):
            row += [
                *(sign * pushed).tolist(),
                *np.cross(point - np.array(origins[body]), sign * pushed).tolist(),
            ]
        return row


SPHERE_ON_PLANE = SphereOnPlane()
