"""Geometry of smooth contact of a sphere and a half space, at any distance."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from osimlite.base.text import add_article
from osimlite.errors import ModelError
from osimlite.mechanics.kernels.pointers import Floats, Ints
from osimlite.mechanics.kernels.points import apply_force, direction, station, velocity
from osimlite.mechanics.laws.vectors import (
    Vector,
    add_scaled,
    dot,
    minus,
    store_vector,
    times,
    vector,
)
from osimlite.mechanics.multibody.links import LinkMap
from osimlite.schema.contact_types import ContactHalfSpace, ContactSphere
from osimlite.simulation.elements.builder import ElementBuilder, get_class_name
from osimlite.simulation.elements.contact import ContactSurface, read_surface
from osimlite.simulation.elements.geometries.geometry import ForceGeometry

NO_MATERIAL = (0.0, 0.0, 0.0, 0.0, 0.0)
"""Material of surfaces whose law has its own parameters."""


def compute_sphere_depth(
    model: Ints, data: Floats, g: Ints, gp: Floats, work: Floats
) -> tuple[float, float, Vector]:
    """Compute the depth of a sphere in a half space.

    Args:
        model: integers of the model.
        data: work vector.
        g: links of the half space and of the sphere.
        gp: point (3,) and normal (3,) of the plane, centre (3,) and radius of the sphere, in these
            links.
        work: receives the point of contact in ground (offset 3), m.

    Returns:
        Depth (m, negative if they are apart), radius (m), and outward unit normal of the half space
        in ground.
    """
    o, n = station(model, data, g[0], vector(gp, 0)), direction(model, data, g[0], vector(gp, 3))
    center = station(model, data, g[1], vector(gp, 6))
    # Depth of the sphere below the plane: positive in contact. n points out of the half space.
    d = gp[9] - dot(minus(center, o), n)
    # The point of contact is midway between the surfaces.
    store_vector(work, 3, add_scaled(center, 0.5 * d - gp[9], n))
    return d, gp[9], n


def compute_approach_velocity(model: Ints, data: Floats, g: Ints, work: Floats) -> Vector:
    """Return the velocity of the half space relative to the sphere at the point of contact.

    Args:
        model: integers of the model.
        data: work vector.
        g: links of the half space and of the sphere.
        work: record with the point of contact.

    Returns:
        Velocity in ground (3,), m/s.
    """
    return minus(
        velocity(model, data, g[0], vector(work, 3)), velocity(model, data, g[1], vector(work, 3))
    )


def push_both(model: Ints, data: Floats, g: Ints, work: Floats, force: Vector) -> None:
    """Apply a force to the sphere and its opposite to the half space at the point of contact.

    Args:
        model: integers of the model.
        data: work vector.
        g: links of the half space and of the sphere.
        work: record with the point of contact; receives the force.
        force: force on the sphere in ground, N.
    """
    store_vector(work, 0, force)
    apply_force(model, data, g[1], vector(work, 3), force)
    apply_force(model, data, g[0], vector(work, 3), times(-1.0, force))


class SphereOnPlane(ForceGeometry):
    """Half space and sphere, at any distance.

    Inputs of the law are depth and radius (m), normal, and velocity of the half space relative to
    the sphere (m/s). The outputs fx, fy, fz (N) push the sphere.
    """

    inputs = ("d", "radius", "n", "v")
    setup_code = (
        "d, radius, n = compute_sphere_depth(model, data, g, gp, work)",
        "v = compute_approach_velocity(model, data, g, work)",
    )
    apply_code = ("push_both(model, data, g, work, (fx, fy, fz))",)
    called_functions = (compute_sphere_depth, compute_approach_velocity, push_both)

    def read(self, builder: ElementBuilder, force: Any) -> tuple[ContactSurface, ContactSurface]:
        """Return the half space and the sphere that a force names.

        Returns:
            The surfaces of the half space and of the sphere.

        Raises:
            ModelError: a socket names another class.
        """
        surfaces = []
        for field, expected in (
            ("socket_half_space", ContactHalfSpace),
            ("socket_sphere", ContactSphere),
        ):
            geometry = builder.resolve_target(force, field, getattr(force, field))
            if not isinstance(geometry, expected):
                raise ModelError(
                    f"the '{field}' of '{builder.path(force)}' is {add_article(get_class_name(geometry))}; "
                    f"name {add_article(expected.__name__)}"
                )
            surfaces.append(read_surface(builder, force, geometry, NO_MATERIAL))
        return surfaces[0], surfaces[1]

    def pack(
        self, location: tuple[ContactSurface, ContactSurface], link_map: LinkMap
    ) -> tuple[Sequence[int], Sequence[float]]:
        """Return the links, a point of the plane and its normal, and centre and radius of the sphere.

        Returns:
            Integers and numbers of the geometry.
        """
        one, two = location
        first, on_plane = link_map.station(one.body, one.center)
        second, center = link_map.station(two.body, two.center)
        return (first, second), (
            *on_plane,
            *link_map.direction(one.body, one.normal),
            *center,
            two.radius,
        )

    def record_size(self, location: Any) -> int:
        """Return the size of force and point."""
        return 6

    def list_columns(self, force: Any) -> tuple[str, ...]:
        """Return the labels of force and torque on the body of the sphere, then on that of the half space.

        Returns:
            Labels of the columns.
        """
        labels = [f"{kind}.{axis}" for kind in ("force", "torque") for axis in "XYZ"]
        return tuple(
            f"{force.name}.{surface}.{label}"
            for surface in ("Sphere", "HalfSpace")
            for label in labels
        )

    def report(
        self, force: Any, record: Sequence[float], origins: Sequence[Sequence[float]]
    ) -> list[float]:
        """Return the loads on both bodies.

        Args:
            force: the element.
            record: force (N) and point of contact (m) in ground.
            origins: origin of each body in ground, m; ground's origin is the last.

        Returns:
            Force (N) and torque (N.m) about the body's origin in ground, of the sphere's body, then
            of the half space's.
        """
        half_space, sphere = force.location
        force_on_sphere = np.array(record[:3], dtype=float)
        point = np.array(record[3:6], dtype=float)
        row: list[float] = []
        for sign, body in ((1.0, sphere.body), (-1.0, half_space.body)):
            row += [
                *(sign * force_on_sphere).tolist(),
                *np.cross(point - np.array(origins[body]), sign * force_on_sphere).tolist(),
            ]
        return row


SPHERE_ON_PLANE = SphereOnPlane()
"""Half space and sphere that a force names."""
