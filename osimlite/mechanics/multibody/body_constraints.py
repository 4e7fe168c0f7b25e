"""Constraints between points and directions of two bodies.

Stations and axes are in the frames of the bodies. The body index -1 stands for ground. The
equations are in :mod:`osimlite.mechanics.kernels.constraint_equations`.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Generic, TypeVar

import numpy as np

from osimlite.base.records import dataclass
from osimlite.mechanics.multibody.constraints import ConstraintEquations
from osimlite.mechanics.multibody.parts import FramePlacement, StationPlacement
from osimlite.mechanics.multibody.spatial import Array, cross

if TYPE_CHECKING:
    from osimlite.mechanics.multibody.mechanism import Mechanism


def find_carrier(mechanism: Mechanism, bodies: Iterable[int]) -> int:
    """Return the outermost body that carries some bodies, or is one of them; -1 for ground.

    It is the nearest common ancestor in the tree of bodies.

    Args:
        mechanism: mechanism.
        bodies: indices of bodies, or -1.
    """
    result = set(bodies)
    while len(result) > 1:
        # Bodies have larger indices than the bodies that carry them.
        outer = max(result)
        result = result - {outer} | {mechanism.bodies[outer].parent}
    return result.pop()


P = TypeVar("P", StationPlacement, FramePlacement)


@dataclass(frozen=True, eq=False)
class _Between(ConstraintEquations, Generic[P]):
    first: P
    second: P

    @property
    def bodies(self) -> tuple[int, ...]:
        """Indices of the two bodies.

        Returns:
            Indices in the mechanism, -1 for ground.
        """
        return self.first.body, self.second.body


@dataclass(frozen=True, eq=False)
class PointEquations(_Between[StationPlacement]):
    """Constraint that holds two stations together, as a ball joint does."""

    name: str = "point constraint"


@dataclass(frozen=True, eq=False)
class DistanceConstraint(_Between[StationPlacement]):
    """Constraint that keeps two stations at a distance, as a rod between ball joints does."""

    distance: float  # m
    name: str = "distance constraint"


@dataclass(frozen=True, eq=False)
class PointOnLineEquations(ConstraintEquations):
    """Constraint that keeps a station of a follower body on a line of another body."""

    line: StationPlacement  # point of the line
    along: Array  # direction (3,) of the line in the frame of its body
    follower: StationPlacement  # station that stays on the line
    name: str = "point on line constraint"

    @property
    def bodies(self) -> tuple[int, ...]:
        """Indices of the body of the line and of the follower.

        Returns:
            Indices in the mechanism, -1 for ground.
        """
        return self.line.body, self.follower.body

    def find_normal_directions(self) -> list[Array]:
        """Return two unit directions (3,) perpendicular to the line, in the frame of its body."""
        # The axis that deviates most from the line gives the longest, and so most exact, product.
        start = np.eye(3)[int(np.argmin(np.abs(self.along)))]
        across = cross(self.along, start)
        return _make_unit_vectors(across, cross(self.along, across))


@dataclass(frozen=True, eq=False)
class WeldEquations(_Between[FramePlacement]):
    """Constraint that holds two frames together.

    The equations are three scalar products that vanish, of each axis of one frame with the next
    axis of the other, and the distance of the origins.
    """

    name: str = "weld constraint"


@dataclass(frozen=True, eq=False)
class RollingConstraint(ConstraintEquations):
    """OpenSim's RollingOnSurfaceConstraint: a roller on a plane, without slip and without spin.

    The roller's origin stays at `height` along the normal of the surface's frame, and its Z axis
    perpendicular to the surface's X axis. Along the surface's X and Z axes the two bodies have the
    same velocity at the origin of the surface frame, where OpenSim assumes the point of contact
    wherever the roller is.

    The equations of accelerations are the exact derivatives of these. Simbody's are not, because it
    compares the accelerations of material points, although another material point is in contact at
    each moment.
    """

    surface: int  # index of the body of the surface
    roller: int  # index of the rolling body
    normal: Array  # normal (3,) in the frame of the surface
    height: float  # distance of the roller's origin from the surface frame along the normal, m
    name: str = "rolling constraint"

    @property
    def bodies(self) -> tuple[int, ...]:
        """Indices of the surface and of the roller.

        Returns:
            Indices in the mechanism, -1 for ground.
        """
        return self.surface, self.roller


def _make_unit_vectors(*vectors: Array) -> list[Array]:
    return [vector / np.linalg.norm(vector) for vector in vectors]
