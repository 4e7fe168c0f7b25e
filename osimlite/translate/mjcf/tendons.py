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
        position: position in the body (3,) (m).
        coordinate: index of the coordinate that moves the site, or -1.
        drive: polynomial of the coordinate (5,), constant first, whose value a helper joint has;
            None for a fixed site.
        slides: polynomials of the helper (3, 5), constant first, which are added to the position
            (m); None for a fixed site.
        name: name of the path point; "" for a site that the path does not have.
    """

    body: int
    position: Array
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
        radius: radius of the sphere or cylinder (m).
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
        position = (
            self.frame[:3, :3] @ (direction * (2.0 * self.radius / np.linalg.norm(direction)))
            + self.frame[:3, 3]
        )
        return replace(self, side=TendonSite(self.body, position))

    def move_to(self, frame: Array, radius: float) -> WrapGeom:
        """Return a copy with another frame and radius; the side site moves along.

        Args:
            frame: new frame of the surface in the body (4, 4).
            radius: new radius (m).
        """
        if self.side is None:
            return replace(self, frame=frame, radius=radius)
        # The direction of the side site in the frame of the surface; its distance grows with the
        # radius.
        local_offset = self.frame[:3, :3].T @ (self.side.position - self.frame[:3, 3])
        side = replace(
            self.side,
            position=frame[:3, :3] @ (local_offset * (radius / self.radius)) + frame[:3, 3],
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
    uses_by_section: dict[Any, list[tuple[int, WrapGeom | None]]] = {}
    for tendon_index, tendon in enumerate(tendons):
        for start_site, wrap_geom, end_site in iterate_sections(tendon):
            # Sections with equal sites and the same kind of surface are measured in one call.
            side = (
                wrap_geom
                and wrap_geom.side
                and (wrap_geom.side.body, wrap_geom.side.slides is None)
            )
            surface_key = wrap_geom and (wrap_geom.body, wrap_geom.kind, side)
            uses_by_section.setdefault((start_site, end_site, surface_key), []).append(
                (tendon_index, wrap_geom)
            )
    for (start_site, end_site, surface_key), section_uses in uses_by_section.items():
        numbers = {
            wrap_geom: k
            for k, wrap_geom in enumerate(dict.fromkeys(wrap_geom for _, wrap_geom in section_uses))
        }
        wrap_geoms = (
            ()
            if surface_key is None
            else [wrap_geom for wrap_geom in numbers if wrap_geom is not None]
        )
        length, arm = _measure_section(start_site, wrap_geoms, end_site, poses, version)
        for tendon_index, wrap_geom in section_uses:
            # A tendon is as long as its sections together.
            lengths[tendon_index] += length[numbers[wrap_geom]]
            arms[tendon_index] += arm[numbers[wrap_geom]]
    return lengths, arms


def _measure_section(
    first: TendonSite,
    wrap_geoms: Sequence[WrapGeom],
    second: TendonSite,
    poses: Poses,
    version: int,
) -> tuple[Array, Array]:
    """Measure a section between two sites, straight or around each of k surfaces of one kind.

    Surfaces that differ only in their side sites are computed once, for each way around them.

    Args:
        first: first site.
        wrap_geoms: surfaces (k), all of one kind and in one body; none for a straight section.
        second: second site.
        poses: P poses with m free coordinates.
        version: major version of MuJoCo.

    Returns:
        Lengths (k, P) (m) and moment arms (k, P, m).
    """
    first_point, second_point = (
        _locate_in_ground(tendon_site, poses)[None] for tendon_site in (first, second)
    )
    # Directions in which the tension pulls at either end.
    forward, backward = second_point - first_point, first_point - second_point
    lengths, arms = np.zeros(()), np.zeros(())
    selection: Any = ...
    if wrap_geoms:
        body, kind = wrap_geoms[0].body, wrap_geoms[0].kind
        numbers: dict[Any, int] = {}
        keys = [(wrap_geom.radius, wrap_geom.frame.tobytes()) for wrap_geom in wrap_geoms]
        # Surfaces of equal geometry share one computation.
        owners = np.array([numbers.setdefault(key, len(numbers)) for key in keys])
        unique_indices = np.unique(owners, return_index=True)[1]
        frames = np.stack([wrap_geoms[index].frame for index in unique_indices])
        radii = np.array([[wrap_geoms[index].radius] for index in unique_indices])
        rotations = frames[:, :3, :3]
        centers = frames[:, None, :3, 3]
        start, end = (
            (poses.express(body, points) - centers) @ rotations
            for points in (first_point, second_point)
        )
        sides = [
            _locate_in_body(wrap_geom.side, body, poses)
            for wrap_geom in wrap_geoms
            if wrap_geom.side is not None
        ]
        sites = (np.stack(sides) - centers[owners]) @ rotations[owners] if sides else None
        result = bend_tendon(kind, radii, start, end, sites, owners, version)
        # The first axis has all combinations of direction and surface; `choice` selects from them below.
        is_touching = result.touches.reshape(-1, len(poses.q))
        first_tangents, second_tangents = (
            poses.locate(
                body, (centers + points @ rotations.swapaxes(1, 2)).reshape(*is_touching.shape, 3)
            )
            for points in (result.first, result.second)
        )
        forward, backward = first_tangents - first_point, second_tangents - second_point
        # Where the tendon does not touch the surface, it is straight, and only `forward` counts.
        lengths = np.where(
            is_touching, result.length.reshape(is_touching.shape) + norm(backward), 0.0
        )
        for position, pull_direction in ((first_tangents, forward), (second_tangents, backward)):
            # At the surface the tendon pulls the opposite way. Virtual work makes the generalized
            # force of a unit tension the moment arm.
            arms = arms - _compute_generalized_forces(
                body, position, np.where(is_touching[..., None], unit(pull_direction), 0.0), poses
            )
        selection = result.choice * len(frames) + owners[:, None], np.arange(len(poses.q))
    for tendon_site, position, pull_direction in (
        (first, first_point, unit(forward)),
        (second, second_point, unit(backward)),
    ):
        arms = arms + _compute_generalized_forces(tendon_site.body, position, pull_direction, poses)
        # A sliding site does work by its own motion, too.
        if tendon_site.slides is not None:
            arms = arms + _compute_sliding_forces(tendon_site, pull_direction, poses)
    return (lengths + norm(forward))[selection], arms[selection]


def iterate_sections(tendon: Tendon) -> Iterator[tuple[TendonSite, WrapGeom | None, TendonSite]]:
    """Yield first site, surface or None, and second site of each section of a tendon."""
    last, wrap_geom = None, None
    for part in tendon:
        if isinstance(part, WrapGeom):
            wrap_geom = part
        else:
            if last is not None:
                yield last, wrap_geom, part
            # A surface belongs to one section only.
            last, wrap_geom = part, None


def _locate_in_ground(tendon_site: TendonSite, poses: Poses) -> Array:
    """Return the position of a site in ground (P, 3) (m)."""
    if tendon_site.slides is None:
        return poses.locate(tendon_site.body, tendon_site.position)
    assert tendon_site.drive is not None
    helper = polyval(poses.q[:, tendon_site.coordinate], tendon_site.drive)
    return poses.locate(
        tendon_site.body, tendon_site.position + polyval(helper, tendon_site.slides.T).T
    )


def _locate_in_body(tendon_site: TendonSite, body: int, poses: Poses) -> Array:
    """Return the position of a site in a body: (1, 3) if it is fixed there, else (P, 3) (m)."""
    if tendon_site.body == body and tendon_site.slides is None:
        return tendon_site.position[None]
    return poses.express(body, _locate_in_ground(tendon_site, poses))


def _compute_generalized_forces(body: int, positions: Array, force: Array, poses: Poses) -> Array:
    """Return the generalized forces (k, P, m) of forces (k, P, 3) on a body at positions in ground."""
    moments = np.cross(positions - poses.origins[body], force)
    return multiply_each_pose(np.concatenate((moments, force), axis=-1), poses.jacobians[body])


def _compute_sliding_forces(tendon_site: TendonSite, force: Array, poses: Poses) -> Array:
    """Return generalized forces (k, P, m) of forces (k, P, 3) from a site's motion in its body."""
    assert tendon_site.slides is not None and tendon_site.drive is not None
    value = poses.q[:, tendon_site.coordinate]
    helper = polyval(value, tendon_site.drive)
    rate = polyval(value, polyder(tendon_site.drive))
    rates = np.einsum(
        "pij,jp->pi",
        poses.rotations[tendon_site.body],
        polyval(helper, polyder(tendon_site.slides.T)) * rate,
    )
    return np.einsum("kpi,pi->kp", force, rates)[..., None] * poses.rates[:, tendon_site.coordinate]
