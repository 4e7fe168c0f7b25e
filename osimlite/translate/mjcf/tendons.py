"""Tendons: what MuJoCo pulls along, and what their lengths and moment arms are in many poses.

A tendon runs from site to site, around a surface between two of them at most.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval

from osimlite.multibody.spatial import Array
from osimlite.translate.mjcf.poses import Poses
from osimlite.translate.mjcf.wrapping import bend, norm, unit


@dataclass(frozen=True, eq=False)
class Spot:
    """A site.

    Attributes:
        body: that it is in.
        place: in the body (3,), m.
        coordinate: place in the mechanism of that which moves it, or -1.
        drive: if it moves: polynomial (5,) of the coordinate, constant first, which gives the value of a helper.
        slides: if it moves: polynomials (3, 5) of the helper that are added to the place, constant first, m.
        name: of the path point; empty for one that OpenSim does not know.
    """

    body: int
    place: Array
    coordinate: int = -1
    drive: Array | None = None
    slides: Array | None = None
    name: str = ""


@dataclass(frozen=True, eq=False)
class Around:
    """A surface that a tendon goes around.

    Attributes:
        body: that it is in.
        frame: of the surface (4, 4) in the body; a cylinder is about z.
        kind: ``"sphere"`` or ``"cylinder"``.
        radius: m.
        side: the side site, or None.
        length: of the cylinder as it is drawn, m.
        name: of the wrap object; empty for one that OpenSim does not know.
    """

    body: int
    frame: Array
    kind: str
    radius: float
    side: Spot | None = None
    length: float = 0.0
    name: str = ""

    def sided(self, direction: Array | None) -> Around:
        """The same with the side site in a direction (3,), in the frame of the surface, well outside; or without."""
        if direction is None or not direction.any():
            return replace(self, side=None)
        place = self.frame[:3, :3] @ (direction * (2.0 * self.radius / np.linalg.norm(direction))) + self.frame[:3, 3]
        return replace(self, side=Spot(self.body, place))

    def moved(self, frame: Array, radius: float) -> Around:
        """The same elsewhere (4, 4) and of another radius (m), with the side site where it is as seen from there."""
        if self.side is None:
            return replace(self, frame=frame, radius=radius)
        seen = self.frame[:3, :3].T @ (self.side.place - self.frame[:3, 3])
        side = replace(self.side, place=frame[:3, :3] @ (seen * (radius / self.radius)) + frame[:3, 3])
        return replace(self, frame=frame, radius=radius, side=side)


Tendon = tuple[Spot | Around, ...]


def measured(tendon: Tendon, poses: Poses, version: int) -> tuple[Array, Array]:
    """Lengths (P,) of a tendon (m) and its moment arms (P, m), as MuJoCo computes them.

    Args:
        tendon: the tendon.
        poses: P poses of m coordinates that move.
        version: of MuJoCo, 3 or 4.
    """
    lengths, arms = np.zeros(len(poses.q)), np.zeros((len(poses.q), len(poses.moving)))
    for first, around, second in sections(tendon):
        one, two = (_placed(spot, poses) for spot in (first, second))
        if around is None:
            way, back = two - one, one - two
        else:
            rotation = poses.rotations[around.body] @ around.frame[:3, :3]
            middle = poses.points(around.body, around.frame[:3, 3])
            given = (one, two) if around.side is None else (one, two, _placed(around.side, poses))
            first_end, second_end, *side = (np.einsum("pji,pj->pi", rotation, at - middle) for at in given)
            found = bend(around.kind, around.radius, first_end, second_end, side[0] if side else None, version)
            leaves, returns = (middle + np.einsum("pij,pj->pi", rotation, at) for at in (found.first, found.second))
            way, back = leaves - one, returns - two
            lengths += np.where(found.touches, found.length + norm(back), 0.0)
            touched = found.touches[:, None]
            arms -= _worked(around.body, leaves, np.where(touched, unit(way), 0.0), poses)
            arms -= _worked(around.body, returns, np.where(touched, unit(back), 0.0), poses)
        lengths += norm(way)
        for spot, place, pull in ((first, one, unit(way)), (second, two, unit(back))):
            arms += _worked(spot.body, place, pull, poses)
            if spot.slides is not None:
                arms += _slid(spot, pull, poses)
    return lengths, arms


def sections(tendon: Tendon) -> Iterator[tuple[Spot, Around | None, Spot]]:
    """From site to site, with the surface between the two if there is one."""
    last, around = None, None
    for part in tendon:
        if isinstance(part, Around):
            around = part
        else:
            if last is not None:
                yield last, around, part
            last, around = part, None


def _placed(spot: Spot, poses: Poses) -> Array:
    """Where a site is in ground (P, 3)."""
    if spot.slides is None:
        return poses.points(spot.body, spot.place)
    assert spot.drive is not None
    helper = polyval(poses.q[:, spot.coordinate], spot.drive)
    return poses.points(spot.body, spot.place + polyval(helper, spot.slides.T).T)


def _worked(body: int, places: Array, force: Array, poses: Poses) -> Array:
    """What a force (P, 3) on a body at a place in ground (P, 3) does at the moving coordinates (P, m)."""
    (x, y, z), (fx, fy, fz) = (places - poses.origins[body]).T, force.T
    wrench = np.stack((y * fz - z * fy, z * fx - x * fz, x * fy - y * fx, fx, fy, fz), axis=1)
    found: Array = (wrench[:, None] @ poses.jacobians[body])[:, 0]
    return found


def _slid(spot: Spot, force: Array, poses: Poses) -> Array:
    """What a force (P, 3) on a site does at the moving coordinates (P, m) since the site moves in its body."""
    assert spot.slides is not None and spot.drive is not None
    value = poses.q[:, spot.coordinate]
    helper, rate = polyval(value, spot.drive), polyval(value, polyder(spot.drive))
    rates = polyval(helper, polyder(spot.slides.T)) * rate
    along = np.einsum("pi,pij,jp->p", force, poses.rotations[spot.body], rates)
    found: Array = along[:, None] * poses.rates[:, spot.coordinate]
    return found
