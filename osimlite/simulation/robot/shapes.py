"""Shapes of the neutral robot: what readers of robot formats know how to draw."""

from __future__ import annotations

from typing import NamedTuple

from osimlite.base.records import dataclass
from osimlite.mechanics.multibody.spatial import Array


class Box(NamedTuple):
    """A box centred on its origin, by whole edge lengths (m)."""

    size: tuple[float, float, float]


class Ball(NamedTuple):
    """A sphere centred on its origin, by radius (m)."""

    radius: float


class Tube(NamedTuple):
    """A cylinder along the Z axis, centred on its origin, by radius and whole length (m)."""

    radius: float
    length: float


class MeshFile(NamedTuple):
    """A surface in a file; `file` is relative to the file of the robot, `scale` multiplies its coordinates."""

    file: str
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)


Shape = Box | Ball | Tube | MeshFile


@dataclass(frozen=True, eq=False)
class Visual:
    """A shape at `origin` (4, 4) in the frame of what it belongs to.

    `source` is the absolute path of the model's geometry, `color` red, green, blue and opacity from
    0 to 1.
    """

    shape: Shape
    origin: Array
    color: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    source: str = ""
