"""Tendons, and their lengths and moment arms in many poses by MuJoCo's formulas.

A tendon is a sequence of sites with at most one surface between two of them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval

from osimlite.base.records import dataclass, replace
from osimlite.mechanics.multibody.spatial import Array
from osimlite.translate.mjcf.poses import Poses, multiply_each_pose
from osimlite.translate.mjcf.wrapping import bend_tendon, norm, unit


@dataclass(frozen=True, eq=False)
class TendonSite:
    """Site of a tendon.

    Attributes:
        body: index of the body.
        place: position in the body (3,) (m).
        coordinate: index of the coordinate that moves the site, or -1.
        drive: polynomial of the coordinate (5,), constant first, whose value a helper joint has;
            None for a fixed site.
        slides: polynomials of the helper (3, 5), constant first, which are added to the position
            (m); None for a fixed site.
        name: name of the path point; "" for a site that the path does not have.
    """

    body: int
    place: Array
    coordinate: int = -1
    drive: Array | None = None
    slides: Array | None = None
    name: str = ""


@dataclass(frozen=True, eq=False)
class WrapGeom:
    """Surface that a tendon wraps around.

    Attributes:
        body: index of the body.
        frame: frame of the surface in the body (4, 4); the axis of a cylinder is z.
        kind: "sphere" or "cylinder".
        radius: radius (m).
        side: side site, or None.
        length: length of the cylinder as it is drawn (m); MuJoCo wraps around an infinite one.
        name: name of the wrap object; "" for a surface that the path does not have.
    """

    body: int
    frame: Array
    kind: str
    radius: float
    side: TendonSite | None = None
    length: float = 0.0
    name: str = ""

    def replace_side(self, direction: Array | None) -> WrapGeom:
        """Return a copy with the side site in a direction (3,) in the frame of the surface.

        The site is two radii from the centre.

        Without a direction, or with a zero one, the copy has no side site.
        """
        if direction is None or not direction.any():
            return replace(self, side=None)
        place = (
            self.frame[:3, :3] @ (direction * (2.0 * self.radius / np.linalg.norm(direction)))
            + self.frame[:3, 3]
        )
        return replace(self, side=TendonSite(self.body, place))

    def move_to(self, frame: Array, radius: float) -> WrapGeom:
        """Return a copy with another frame and radius; the side site moves along.

        Args:
            frame: frame in the body (4, 4).
            radius: radius (m).
        """
        if self.side is None:
            return replace(self, frame=frame, radius=radius)
        # The direction of the side site in the frame of the surface; its distance grows with the
        # radius.
        seen = self.frame[:3, :3].T @ (self.side.place - self.frame[:3, 3])
        side = replace(
            self.side, place=frame[:3, :3] @ (seen * (radius / self.radius)) + frame[:3, 3]
        )
        return replace(self, frame=frame, radius=radius, side=side)


Tendon = tuple[TendonSite | WrapGeom, ...]
"""Sites and surfaces of a tendon, in its order."""


def measure_tendon(tendon: Tendon, poses: Poses, version: int) -> tuple[Array, Array]:
    """Measure a tendon with MuJoCo's formulas.

    Args:
        tendon: tendon to measure.
        poses: P poses with m free coordinates.
        version: major version of MuJoCo.

    Returns:
        Lengths (P,) (m) and moment arms (P, m).
    """
    lengths, arms = measure_tendons((tendon,), poses, version)
    return lengths[0], arms[0]


def measure_tendons(tendons: Sequence[Tendon], poses: Poses, version: int) -> tuple[Array, Array]:
    """Measure several tendons; sections that they share are computed once.

    Args:
        tendons: tendons to measure (T).
        poses: P poses with m free coordinates.
        version: major version of MuJoCo.

    Returns:
        Lengths (T, P) (m) and moment arms (T, P, m).
    """
    lengths = np.zeros((len(tendons), len(poses.q)))
    arms = np.zeros((*lengths.shape, len(poses.moving)))
    alike: dict[Any, list[tuple[int, WrapGeom | None]]] = {}
    for place, tendon in enumerate(tendons):
        for first, around, second in iterate_sections(tendon):
            # Sections with equal sites and the same kind of surface are measured in one call.
            side = around and around.side and (around.side.body, around.side.slides is None)
            kind = around and (around.body, around.kind, side)
            alike.setdefault((first, second, kind), []).append((place, around))
    for (first, second, kind), uses in alike.items():
        numbers = {
            around: k for k, around in enumerate(dict.fromkeys(around for _, around in uses))
        }
        arounds = () if kind is None else [around for around in numbers if around is not None]
        length, arm = _measure_section(first, arounds, second, poses, version)
        for place, around in uses:
            # A tendon is as long as its sections together.
            lengths[place] += length[numbers[around]]
            arms[place] += arm[numbers[around]]
    return lengths, arms


def _measure_section(
    first: TendonSite, arounds: Sequence[WrapGeom], second: TendonSite, poses: Poses, version: int
) -> tuple[Array, Array]:
    """Measure a section between two sites, straight or around each of k surfaces of one kind.

    Surfaces that differ only in their side sites are computed once, for each way around them.

    Args:
        first: first site.
        arounds: surfaces (k), all of one kind and in one body; none for a straight section.
        second: second site.
        poses: P poses with m free coordinates.
        version: major version of MuJoCo.

    Returns:
        Lengths (k, P) (m) and moment arms (k, P, m).
    """
    one, two = (_locate_in_ground(spot, poses)[None] for spot in (first, second))
    # Directions in which the tension pulls at either end.
    way, back = two - one, one - two
    lengths, arms = np.zeros(()), np.zeros(())
    chosen: Any = ...
    if arounds:
        body, kind = arounds[0].body, arounds[0].kind
        numbers: dict[Any, int] = {}
        keys = [(around.radius, around.frame.tobytes()) for around in arounds]
        # Surfaces of equal geometry share one computation.
        owners = np.array([numbers.setdefault(key, len(numbers)) for key in keys])
        of_each = np.unique(owners, return_index=True)[1]
        frames = np.stack([arounds[place].frame for place in of_each])
        radii = np.array([[arounds[place].radius] for place in of_each])
        rotations = frames[:, :3, :3]
        middles = frames[:, None, :3, 3]
        start, end = ((poses.express(body, at) - middles) @ rotations for at in (one, two))
        sides = [
            _locate_in_body(around.side, body, poses)
            for around in arounds
            if around.side is not None
        ]
        sites = (np.stack(sides) - middles[owners]) @ rotations[owners] if sides else None
        result = bend_tendon(kind, radii, start, end, sites, owners, version)
        # The first axis has all combinations of way and surface; `choice` selects from them below.
        touches = result.touches.reshape(-1, len(poses.q))
        leaves, returns = (
            poses.locate(body, (middles + at @ rotations.swapaxes(1, 2)).reshape(*touches.shape, 3))
            for at in (result.first, result.second)
        )
        way, back = leaves - one, returns - two
        # Where the tendon does not touch the surface, it is straight, and only `way` counts.
        lengths = np.where(touches, result.length.reshape(touches.shape) + norm(back), 0.0)
        for place, pull in ((leaves, way), (returns, back)):
            # At the surface the tendon pulls the opposite way. Virtual work makes the generalized
            # force of a unit tension the moment arm.
            arms = arms - _compute_generalized_forces(
                body, place, np.where(touches[..., None], unit(pull), 0.0), poses
            )
        chosen = result.choice * len(frames) + owners[:, None], np.arange(len(poses.q))
    for spot, place, pull in ((first, one, unit(way)), (second, two, unit(back))):
        arms = arms + _compute_generalized_forces(spot.body, place, pull, poses)
        # A sliding site does work by its own motion, too.
        if spot.slides is not None:
            arms = arms + _compute_sliding_forces(spot, pull, poses)
    return (lengths + norm(way))[chosen], arms[chosen]


def iterate_sections(tendon: Tendon) -> Iterator[tuple[TendonSite, WrapGeom | None, TendonSite]]:
    """Yield first site, surface or None, and second site of each section of a tendon."""
    last, around = None, None
    for part in tendon:
        if isinstance(part, WrapGeom):
            around = part
        else:
            if last is not None:
                yield last, around, part
            # A surface belongs to one section only.
            last, around = part, None


def _locate_in_ground(spot: TendonSite, poses: Poses) -> Array:
    """Return the position of a site in ground (P, 3) (m)."""
    if spot.slides is None:
        return poses.locate(spot.body, spot.place)
    assert spot.drive is not None
    helper = polyval(poses.q[:, spot.coordinate], spot.drive)
    return poses.locate(spot.body, spot.place + polyval(helper, spot.slides.T).T)


def _locate_in_body(spot: TendonSite, body: int, poses: Poses) -> Array:
    """Return the position of a site in a body: (1, 3) if it is fixed there, else (P, 3) (m)."""
    if spot.body == body and spot.slides is None:
        return spot.place[None]
    return poses.express(body, _locate_in_ground(spot, poses))


def _compute_generalized_forces(body: int, places: Array, force: Array, poses: Poses) -> Array:
    """Return the generalized forces (k, P, m) of forces (k, P, 3) on a body at positions in ground."""
    moments = np.cross(places - poses.origins[body], force)
    return multiply_each_pose(np.concatenate((moments, force), axis=-1), poses.jacobians[body])


def _compute_sliding_forces(spot: TendonSite, force: Array, poses: Poses) -> Array:
    """Return generalized forces (k, P, m) of forces (k, P, 3) from a site's motion in its body."""
    assert spot.slides is not None and spot.drive is not None
    value = poses.q[:, spot.coordinate]
    helper = polyval(value, spot.drive)
    rate = polyval(value, polyder(spot.drive))
    rates = np.einsum(
        "pij,jp->pi", poses.rotations[spot.body], polyval(helper, polyder(spot.slides.T)) * rate
    )
    return np.einsum("kpi,pi->kp", force, rates)[..., None] * poses.rates[:, spot.coordinate]
