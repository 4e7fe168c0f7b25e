"""Parts of a mechanism: mass properties, coordinates, bodies, and frames and stations of bodies."""

from __future__ import annotations

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import dataclass, field
from osimlite.mechanics.multibody.functions import SmoothFunction
from osimlite.mechanics.multibody.joints import Mobilizer
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.joints import MotionType

GROUND = -1
"""Index of ground, wherever a body is referred to."""


@dataclass(frozen=True, eq=False)
class MassProperties:
    """Mass, mass centre and inertia of a body."""

    mass: float  # mass, kg
    center: Array = field(default_factory=lambda: np.zeros(3))  # mass centre in the body (3,), m
    inertia: Array = field(default_factory=lambda: np.zeros((3, 3)))  # about the mass centre, kg m²

    def about_origin(self) -> Array:
        """Return the inertia about the origin of the body (3, 3), kg m²."""
        # Parallel axis theorem.
        c = self.center
        return self.inertia + self.mass * (c @ c * np.eye(3) - np.outer(c, c))

    def divide(self, count: int) -> MassProperties:
        """Return one of `count` equal parts in the same position."""
        return MassProperties(self.mass / count, self.center, self.inertia / count)


@dataclass(frozen=True)
class CoordinateInfo:
    """Properties of one coordinate in the model (rad or m, and per second)."""

    name: str
    path: str
    joint: str  # path of its joint
    motion_type: MotionType
    default_value: float = 0.0
    default_speed: float = 0.0
    range: tuple[float, float] = (-10.0, 10.0)
    clamped: bool = False
    locked: bool = False
    prescribed: SmoothFunction | None = (
        None  # value as a function of time (s); without effect if locked
    )
    yielding: bool = False  # whether assembly may move it freely, without counting the change

    @property
    def unit(self) -> str:
        """Unit of its values: rad or m, or empty if it is neither an angle nor a distance."""
        return {"rotational": "rad", "translational": "m"}.get(self.motion_type, "")


@dataclass(frozen=True, eq=False)
class MobileBody:
    """Body with the body that carries it, and the mobilizer between them."""

    name: str
    path: str  # absolute path
    parent: int  # index of the body that carries it, -1 for ground
    mass_properties: MassProperties
    mobilizer: Mobilizer


class FramePlacement(NamedTuple):
    """Frame that is fixed to a body."""

    body: int  # index of the body, -1 for ground
    transform: Array  # frame in the body (4, 4)


class StationPlacement(NamedTuple):
    """Point that is fixed to a body."""

    body: int  # index of the body, -1 for ground
    location: Array  # point in the body's frame (3,), m
