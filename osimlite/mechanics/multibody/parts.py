"""What a mechanism is made of: mass, coordinates, bodies, and what is fixed to bodies."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from osimlite.base.records import dataclass, field
from osimlite.mechanics.multibody.functions import Function
from osimlite.mechanics.multibody.joints import Mobilizer
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.joints import MotionType

GROUND = -1
"""The index that stands for ground wherever a body is meant."""


@dataclass(frozen=True, eq=False)
class MassProperties:
    """Mass (kg), mass centre (3,) in the body frame (m), inertia (3, 3) about it along body axes (kg·m²)."""

    mass: float
    center: Array = field(default_factory=lambda: np.zeros(3))
    inertia: Array = field(default_factory=lambda: np.zeros((3, 3)))

    def about_origin(self) -> Array:
        """The inertia about the origin of the body (3, 3), kg m^2."""
        c = self.center
        return self.inertia + self.mass * (c @ c * np.eye(3) - np.outer(c, c))

    def share(self, count: int) -> MassProperties:
        """One of `count` equal parts that lie on each other."""
        return MassProperties(self.mass / count, self.center, self.inertia / count)


@dataclass(frozen=True)
class CoordinateInfo:
    """What the model says of one coordinate (rad or m, and per second)."""

    name: str
    path: str
    joint: str  # path of its joint
    motion_type: MotionType
    default_value: float = 0.0
    default_speed: float = 0.0
    range: tuple[float, float] = (-10.0, 10.0)
    clamped: bool = False
    locked: bool = False
    # its value as a function of time (s), or None; a locked coordinate keeps its value all the same
    prescribed: Function | None = None
    # assembling a pose moves it as the constraints like, instead of as little as it can
    yielding: bool = False

    @property
    def unit(self) -> str:
        """Of its values: rad or m, or nothing if what it moves is neither an angle nor a distance of that size."""
        return {"rotational": "rad", "translational": "m"}.get(self.motion_type, "")


@dataclass(frozen=True, eq=False)
class MobileBody:
    """A body, the index of the body that carries it (-1: ground), and the mobilizer between them."""

    name: str
    path: str
    parent: int
    mass_properties: MassProperties
    mobilizer: Mobilizer


class FramePlacement(NamedTuple):
    """A frame fixed to a body (index, -1 for ground); `transform` (4, 4) is the frame in the body."""

    body: int
    transform: Array


class StationPlacement(NamedTuple):
    """A point fixed to a body (index, -1 for ground); `location` (3,) is the point in the body's frame (m)."""

    body: int
    location: Array
