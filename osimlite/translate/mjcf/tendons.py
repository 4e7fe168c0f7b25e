"""Tendons: what MuJoCo pulls along, and what their lengths and moment arms are in many poses.

A tendon runs from site to site, around a surface between two of them at most.
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
    """A site."""

    body: int  # that it is in
    place: Array  # in the body (3,), m
    coordinate: int = -1  # place in the mechanism of that which moves it, or -1
    # if it moves: polynomial (5,) of the coordinate, constant first, which gives the value of a
    # helper
    drive: Array | None = None
    # if it moves: polynomials (3, 5) of the helper that are added to the place, constant first, m
    slides: Array | None = None
    name: str = ""  # of the path point; empty for one that OpenSim does not know


@dataclass(frozen=True, eq=False)
class WrapGeom:
    """A surface that a tendon goes around."""

    body: int  # that it is in
    frame: Array  # of the surface (4, 4) in the body; a cylinder is about z
    kind: str  # `"sphere"` or `"cylinder"`
    radius: float  # m
    side: TendonSite | None = None  # the side site, or None
    length: float = 0.0  # of the cylinder as it is drawn, m
    name: str = ""  # of the wrap object; empty for one that OpenSim does not know

    def replace_side(self, direction: Array | None) -> WrapGeom:
        """The same with the side site in a direction (3,), in the frame of the surface, well outside; or without."""
        if direction is None or not direction.any():
            return replace(self, side=None)
        place = (
            self.frame[:3, :3] @ (direction * (2.0 * self.radius / np.linalg.norm(direction)))
            + self.frame[:3, 3]
        )
        return replace(self, side=TendonSite(self.body, place))

    def move_to(self, frame: Array, radius: float) -> WrapGeom:
        """The same elsewhere (4, 4) and of another radius (m), with the side site where it is as seen from there."""
        if self.side is None:
            return replace(self, frame=frame, radius=radius)
        seen = self.frame[:3, :3].T @ (self.side.place - self.frame[:3, 3])
        side = replace(
            self.side, place=frame[:3, :3] @ (seen * (radius / self.radius)) + frame[:3, 3]
        )
        return replace(self, frame=frame, radius=radius, side=side)


Tendon = tuple[TendonSite | WrapGeom, ...]


def measure_tendon(tendon: Tendon, poses: Poses, version: int) -> tuple[Array, Array]:
    """Lengths (P,) of a tendon (m) and its moment arms (P, m), as MuJoCo computes them.

    Args:
        tendon: the tendon.
        poses: P poses of m coordinates that move.
        version: of MuJoCo, 3 or 4.
    """
    lengths, arms = measure_tendons((tendon,), poses, version)
    return lengths[0], arms[0]


def measure_tendons(tendons: Sequence[Tendon], poses: Poses, version: int) -> tuple[Array, Array]:
    """The same of T tendons, (T, P) and (T, P, m): what they do between the same two sites is computed at once."""
    lengths = np.zeros((len(tendons), len(poses.q)))
    arms = np.zeros((*lengths.shape, len(poses.moving)))
    alike: dict[Any, list[tuple[int, WrapGeom | None]]] = {}
    for place, tendon in enumerate(tendons):
        for first, around, second in iterate_sections(tendon):
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
            lengths[place] += length[numbers[around]]
            arms[place] += arm[numbers[around]]
    return lengths, arms


def _measure_section(
    first: TendonSite, arounds: Sequence[WrapGeom], second: TendonSite, poses: Poses, version: int
) -> tuple[Array, Array]:
    """Lengths (k, P) and moment arms (k, P, m) from site to site: straight, or around each of k surfaces of a kind.

    Surfaces that differ in their side sites only are computed once, in each way that the tendon can
    go around them.
    """
    one, two = (_locate_in_ground(spot, poses)[None] for spot in (first, second))
    way, back = two - one, one - two
    lengths, arms = np.zeros(()), np.zeros(())
    chosen: Any = ...
    if arounds:
        body, kind = arounds[0].body, arounds[0].kind
        numbers: dict[Any, int] = {}
        keys = [(around.radius, around.frame.tobytes()) for around in arounds]
        owners = np.array([numbers.setdefault(key, len(numbers)) for key in keys])
        of_each = np.unique(owners, return_index=True)[1]
        frames = np.stack([arounds[place].frame for place in of_each])
        radii = np.array([[arounds[place].radius] for place in of_each])
        rotations, middles = frames[:, :3, :3], frames[:, None, :3, 3]
        start, end = ((poses.express(body, at) - middles) @ rotations for at in (one, two))
        sides = [
            _locate_in_body(around.side, body, poses)
            for around in arounds
            if around.side is not None
        ]
        sites = (np.stack(sides) - middles[owners]) @ rotations[owners] if sides else None
        result = bend_tendon(kind, radii, start, end, sites, owners, version)
        # Each way around each surface is one of the k, until they are chosen.
        touches = result.touches.reshape(-1, len(poses.q))
        leaves, returns = (
            poses.locate(body, (middles + at @ rotations.swapaxes(1, 2)).reshape(*touches.shape, 3))
            for at in (result.first, result.second)
        )
        way, back = leaves - one, returns - two
        lengths = np.where(touches, result.length.reshape(touches.shape) + norm(back), 0.0)
        for place, pull in ((leaves, way), (returns, back)):
            arms = arms - _compute_generalized_forces(
                body, place, np.where(touches[..., None], unit(pull), 0.0), poses
            )
        chosen = result.choice * len(frames) + owners[:, None], np.arange(len(poses.q))
    for spot, place, pull in ((first, one, unit(way)), (second, two, unit(back))):
        arms = arms + _compute_generalized_forces(spot.body, place, pull, poses)
        if spot.slides is not None:
            arms = arms + _compute_sliding_forces(spot, pull, poses)
    return (lengths + norm(way))[chosen], arms[chosen]


def iterate_sections(tendon: Tendon) -> Iterator[tuple[TendonSite, WrapGeom | None, TendonSite]]:
    """From site to site, with the surface between the two if there is one."""
    last, around = None, None
    for part in tendon:
        if isinstance(part, WrapGeom):
            around = part
        else:
            if last is not None:
                yield last, around, part
            last, around = part, None


def _locate_in_ground(spot: TendonSite, poses: Poses) -> Array:
    """Where a site is in ground (P, 3)."""
    if spot.slides is None:
        return poses.locate(spot.body, spot.place)
    assert spot.drive is not None
    helper = polyval(poses.q[:, spot.coordinate], spot.drive)
    return poses.locate(spot.body, spot.place + polyval(helper, spot.slides.T).T)


def _locate_in_body(spot: TendonSite, body: int, poses: Poses) -> Array:
    """Where a site is in a body: (1, 3) if it is fixed there, else (P, 3)."""
    if spot.body == body and spot.slides is None:
        return spot.place[None]
    return poses.express(body, _locate_in_ground(spot, poses))


def _compute_generalized_forces(body: int, places: Array, force: Array, poses: Poses) -> Array:
    """What forces (k, P, 3) on a body at places in ground do at the moving coordinates (k, P, m)."""
    moments = np.cross(places - poses.origins[body], force)
    return multiply_each_pose(np.concatenate((moments, force), axis=-1), poses.jacobians[body])


def _compute_sliding_forces(spot: TendonSite, force: Array, poses: Poses) -> Array:
    """What forces (k, P, 3) on a site do at the moving coordinates (k, P, m) since the site moves in its body."""
    assert spot.slides is not None and spot.drive is not None
    value = poses.q[:, spot.coordinate]
    helper, rate = polyval(value, spot.drive), polyval(value, polyder(spot.drive))
    rates = np.einsum(
        "pij,jp->pi", poses.rotations[spot.body], polyval(helper, polyder(spot.slides.T)) * rate
    )
    return np.einsum("kpi,pi->kp", force, rates)[..., None] * poses.rates[:, spot.coordinate]
