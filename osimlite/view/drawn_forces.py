"""Contact forces of a motion, with the points where they are drawn."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from osimlite.base.records import dataclass
from osimlite.mechanics.multibody.spatial import Array
from osimlite.view.motion import DrawableMotion, contact_forces, interpolate_columns
from osimlite.view.scene import Bodies, ForceAnchor, Scene

LONGEST_ARROW = 0.4
"""Length of the arrow of the largest force, relative to the model's size."""


@dataclass(frozen=True, eq=False)
class DrawnForce:
    """Contact force at n times on a body of the scene."""

    anchor: ForceAnchor  # contact element and body
    forces: Array  # forces on the body (n, 3) in ground, N
    # moments (n, 3) in ground about the body's origin, N·m; None if they are not recorded
    torques: Array | None

    def locate_point(self, number: int, bodies: Bodies) -> Array:
        """Return the point (3,) in ground where the force is drawn.

        It is the point of the line of action nearest to the middle of the contact surface. A force
        F with the moment M about the origin acts along the line through F × M / F². Without a
        moment, or without a force, it is the middle of the surface.
        """
        surface_point: Array = bodies.transform_points(self.anchor.body, self.anchor.near[None, :])[
            0
        ]
        force = self.forces[number]
        squared_force = float(force @ force)
        if self.torques is None or squared_force == 0.0:
            return surface_point
        line_point: Array = (
            bodies.origins[self.anchor.body] + np.cross(force, self.torques[number]) / squared_force
        )
        result: Array = line_point + force * (
            float(force @ (surface_point - line_point)) / squared_force
        )
        return result


@dataclass(frozen=True, eq=False)
class DrawnForces:
    """All contact forces of a motion."""

    forces: Sequence[DrawnForce]

    @classmethod
    def from_motion(cls, scene: Scene, motion: DrawableMotion, times: Array) -> DrawnForces:
        """Return the recorded forces of a motion, interpolated at times (n,), s.

        Surfaces of one element on one body share a record, and have one force.
        """
        forces = {(force.element, force.frame): force for force in contact_forces(motion)}
        result: dict[tuple[str, str], DrawnForce] = {}
        for anchor in scene.force_anchors:
            key = next(
                (
                    key
                    for key in ((anchor.element, label) for label in anchor.labels)
                    if key in forces
                ),
                None,
            )
            if key is not None and key not in result:
                force = forces[key]
                torques = (
                    None
                    if force.torques is None
                    else interpolate_columns(motion, force.torques, times)
                )
                result[key] = DrawnForce(
                    anchor, interpolate_columns(motion, force.vectors, times), torques
                )
        return cls(list(result.values()))

    @property
    def largest(self) -> float:
        """Largest absolute component of any force, N; 0 without forces."""
        return max(
            (float(np.abs(drawn_force.forces).max(initial=0.0)) for drawn_force in self.forces),
            default=0.0,
        )

    def locate_forces(self, number: int, bodies: Bodies) -> list[tuple[ForceAnchor, Array, Array]]:
        """Return anchor, point (3,), m, and vector (3,), N, in ground of each force at an index."""
        return [
            (
                drawn_force.anchor,
                drawn_force.locate_point(number, bodies),
                drawn_force.forces[number],
            )
            for drawn_force in self.forces
        ]
