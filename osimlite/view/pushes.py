"""The contact forces of a motion, where they act."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from osimlite.base.records import dataclass
from osimlite.mechanics.multibody.spatial import Array
from osimlite.view.motion import ShownMotion, at_times, contact_forces
from osimlite.view.scene import Bodies, Pushed, Scene

LONGEST_ARROW = 0.4
"""Length of the largest force's arrow as a part of the model's size."""


@dataclass(frozen=True, eq=False)
class Push:
    """A contact force at n moments, on a body of the scene."""

    on: Pushed  # the element, and the body
    forces: Array  # (n, 3) in ground, N
    # (n, 3) in ground about the body's origin, N·m, or None if they are not on record
    torques: Array | None

    def point(self, number: int, bodies: Bodies) -> Array:
        """Return the point (3,) in ground where the force is drawn.

        It is the point of the line of action that is nearest to the middle of the contact surface.

        A force F with the moment M about the origin acts along the line through F × M / F².
        """
        near: Array = bodies.points(self.on.body, self.on.near[None, :])[0]
        force = self.forces[number]
        square = float(force @ force)
        if self.torques is None or square == 0.0:
            return near
        on_line: Array = (
            bodies.origins[self.on.body] + np.cross(force, self.torques[number]) / square
        )
        result: Array = on_line + force * (float(force @ (near - on_line)) / square)
        return result


@dataclass(frozen=True, eq=False)
class Pushes:
    """All contact forces of a motion."""

    pushes: Sequence[Push]

    @classmethod
    def of(cls, scene: Scene, motion: ShownMotion, times: Array) -> Pushes:
        """Return the recorded forces of a motion at other times (n,).

        Surfaces of one element on one body share a record, and are shown once.
        """
        forces = {(force.element, force.frame): force for force in contact_forces(motion)}
        result: dict[tuple[str, str], Push] = {}
        for pushed in scene.pushed:
            key = next(
                (
                    key
                    for key in ((pushed.element, label) for label in pushed.labels)
                    if key in forces
                ),
                None,
            )
            if key is not None and key not in result:
                force = forces[key]
                torques = None if force.torques is None else at_times(motion, force.torques, times)
                result[key] = Push(pushed, at_times(motion, force.vectors, times), torques)
        return cls(list(result.values()))

    @property
    def largest(self) -> float:
        """The largest component of any force, N."""
        return max(
            (float(np.abs(push.forces).max(initial=0.0)) for push in self.pushes), default=0.0
        )

    def at(self, number: int, bodies: Bodies) -> list[tuple[Pushed, Array, Array]]:
        """Return for each force at a moment where it acts, its point (3,) in ground and the force (3,), N."""
        return [(push.on, push.point(number, bodies), push.forces[number]) for push in self.pushes]
