"""Smooth contact of a sphere and a half space, as a force element."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from osimlite.errors import ModelError
from osimlite.schema.contact import ContactHalfSpace, ContactSphere
from osimlite.schema.contact_forces import SmoothSphereHalfSpaceForce
from osimlite.simulation.contact_elements import ContactSurface, surface_of
from osimlite.simulation.elements import ElementBuilder, Triple, kind_of
from osimlite.simulation.field import Writer
from osimlite.simulation.script import Scalar

NO_MATERIAL = (0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class SmoothContact:
    """One SmoothSphereHalfSpaceForce.

    Attributes:
        half_space: surface 1.
        sphere: surface 2.
        hertz: E, cf, bd of the law of the elastic force.
        others: c, us, ud, uv, vt, cf, bv of the law of the whole.
    """

    path: str
    name: str
    half_space: ContactSurface
    sphere: ContactSurface
    hertz: Triple
    others: tuple[float, ...]

    @classmethod
    def of(cls, builder: ElementBuilder, force: SmoothSphereHalfSpaceForce) -> SmoothContact:
        """The element of a force."""
        surfaces = []
        for field, wanted in (("socket_half_space", ContactHalfSpace), ("socket_sphere", ContactSphere)):
            geometry = builder.target(force, field, getattr(force, field))
            if not isinstance(geometry, wanted):
                raise ModelError(
                    f"the '{field}' of '{builder.path(force)}' is a {kind_of(geometry)}; name a {wanted.__name__}"
                )
            surfaces.append(surface_of(builder, force, geometry, NO_MATERIAL))
        cf = force.constant_contact_force
        hertz = force.stiffness, cf, force.hertz_smoothing
        friction = force.static_friction, force.dynamic_friction, force.viscous_friction
        others = force.dissipation, *friction, force.transition_velocity, cf, force.hunt_crossley_smoothing
        builder.check(force, (*hertz, *others))
        if force.stiffness < 0.0 or cf < 0.0 or force.transition_velocity <= 0.0:
            raise ModelError(
                f"'{builder.path(force)}' needs a stiffness and a constant_contact_force that are not negative, "
                "and a positive transition_velocity"
            )
        return cls(builder.path(force), force.name, surfaces[0], surfaces[1], hertz, others)

    def write(self, writer: Writer) -> None:
        """Write depth, point, velocity and force."""
        script, chain, one, two = writer.script, writer.chain, self.half_space, self.sphere
        center = chain.point(script, two.body, two.center)
        on_plane = chain.point(script, one.body, one.center)
        normal = chain.direction(script, one.body, one.normal)
        height = script.dot(script.combine((1.0, center), (-1.0, on_plane)), normal)
        depth = script.sum((two.radius,), (-1.0, height))
        hertz = writer.call("smooth_hertz", depth, two.radius, *self.hertz)
        # Half the depth is either surface's: r - d / 2 below the centre.
        below = script.sum((-two.radius,), (0.5, depth))
        point = script.combine((1.0, center), (below, normal))
        columns = chain.columns(script, one.body, two.body, point)
        velocity = script.combine((-1.0, chain.velocity(script, columns)))
        fx, fy, fz = writer.call("smooth_contact_force", hertz, *self.others, *normal, *velocity, results=3)
        writer.push(columns, (fx, fy, fz))
        if writer.reporting:
            energy: Scalar = writer.call("smooth_contact_energy", hertz, depth)
            writer.keep(0, fx, fy, fz, *point, energy)

    @property
    def columns(self) -> tuple[str, ...]:
        """Force and torque on the body of the sphere, then on that of the half space."""
        labels = [f"{kind}.{axis}" for kind in ("force", "torque") for axis in "XYZ"]
        return tuple(f"{self.name}.{surface}.{label}" for surface in ("Sphere", "HalfSpace") for label in labels)

    def record(self, values: Sequence[Any], origins: Sequence[Triple]) -> list[float]:
        """Forces, and torques about the origins of the bodies, in ground."""
        (value,) = values
        force, point = np.array(value[:3], dtype=float), np.array(value[3:6], dtype=float)
        row: list[float] = []
        for sign, body in ((1.0, self.sphere.body), (-1.0, self.half_space.body)):
            pushed = sign * force
            row += [*pushed.tolist(), *np.cross(point - np.array(origins[body]), pushed).tolist()]
        return row
