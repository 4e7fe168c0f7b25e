"""Constraints between points and directions of two bodies.

Stations and axes are given in the frames of the bodies; -1 stands for ground.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Generic, TypeVar

import numpy as np

from osimlite.base.records import dataclass
from osimlite.mechanics.multibody.constraints import Constraint
from osimlite.mechanics.multibody.parts import FramePlacement, StationPlacement
from osimlite.mechanics.multibody.spatial import Array, cross

if TYPE_CHECKING:
    from osimlite.mechanics.multibody.mechanism import Mechanism


def find_carrier(mechanism: Mechanism, bodies: Iterable[int]) -> int:
    """The outermost body that carries bodies, or is one of them; -1 for ground."""
    result = set(bodies)
    while len(result) > 1:
        # Bodies follow what carries them.
        outer = max(result)
        result = result - {outer} | {mechanism.bodies[outer].parent}
    return result.pop()


P = TypeVar("P", StationPlacement, FramePlacement)


@dataclass(frozen=True, eq=False)
class _Between(Constraint, Generic[P]):
    first: P
    second: P

    @property
    def bodies(self) -> tuple[int, ...]:
        """The two bodies."""
        return self.first.body, self.second.body


@dataclass(frozen=True, eq=False)
class PointConstraint(_Between[StationPlacement]):
    """Keeps two stations on each other, as a ball joint would."""

    name: str = "point constraint"


@dataclass(frozen=True, eq=False)
class DistanceConstraint(_Between[StationPlacement]):
    """Keeps two stations at a distance (m), as a rod between ball joints would."""

    distance: float
    name: str = "distance constraint"


@dataclass(frozen=True, eq=False)
class PointOnLineConstraint(Constraint):
    """Keeps a station of the follower on a line fixed in a body."""

    line: StationPlacement  # a point of the line
    along: Array  # direction (3,) of the line in the frame of its body
    follower: StationPlacement  # the station on the line
    name: str = "point on line constraint"

    @property
    def bodies(self) -> tuple[int, ...]:
        """The two bodies."""
        return self.line.body, self.follower.body

    def find_normal_directions(self) -> list[Array]:
        """Two unit directions (3,) across the line, in the frame of its body."""
        start = np.eye(3)[int(np.argmin(np.abs(self.along)))]
        across = cross(self.along, start)
        return _make_unit_vectors(across, cross(self.along, across))


@dataclass(frozen=True, eq=False)
class WeldConstraint(_Between[FramePlacement]):
    """Keeps two frames on each other: each axis of one square to the next axis of the other, and the origins."""

    name: str = "weld constraint"


@dataclass(frozen=True, eq=False)
class RollingConstraint(Constraint):
    """OpenSim's RollingOnSurfaceConstraint: a roller on a plane that neither slips nor turns about the normal.

    The roller's origin stays at `height` along `normal` (3,) of the surface's frame, its Z axis
    square to the surface's X axis; and along the surface's X and Z axes the two bodies have the
    same velocity at the origin of the surface (which is where OpenSim puts the point of contact,
    wherever the roller is). The accelerations are those that keep all this up; Simbody's do not,
    because it compares material points and leaves out that the roller has another one at the
    contact every moment.
    """

    surface: int
    roller: int
    normal: Array
    height: float
    name: str = "rolling constraint"

    @property
    def bodies(self) -> tuple[int, ...]:
        """Surface and roller."""
        return self.surface, self.roller


def _make_unit_vectors(*vectors: Array) -> list[Array]:
    return [vector / np.linalg.norm(vector) for vector in vectors]
