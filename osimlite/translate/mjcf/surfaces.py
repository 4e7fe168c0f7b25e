"""Wrap geoms that can replace a surface around which a path wraps."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from osimlite.base.records import replace
from osimlite.mechanics.multibody.spatial import Array, make_transform
from osimlite.simulation.elements.geometries.paths.geometry_path import Surface
from osimlite.translate.mjcf.tendons import TendonSite, WrapGeom


def make_substitutes(surface: Surface, touched_points: Array) -> Iterator[WrapGeom]:
    """Yield spheres and cylinders that can replace a surface; none if it has no size.

    Args:
        surface: surface of the path.
        touched_points: points at which the path touches it (k, 3), in the frame of the surface (m).
    """
    if min(surface.numbers[4:]) <= 0.0:
        return
    base_geom = WrapGeom(
        surface.tangent.body, surface.tangent.frame, "sphere", 0.0, name=surface.tangent.name
    )
    sizes = surface.numbers[4:]
    match surface.law:
        case "wrap_sphere":
            yield replace(base_geom, radius=sizes[0])
        case "wrap_cylinder":
            yield replace(base_geom, kind="cylinder", radius=sizes[0], length=sizes[1])
        case "wrap_ellipsoid":
            # Candidates are the semi-axes and the mean distance of the touched points.
            for radius in {*sizes, float(np.linalg.norm(touched_points, axis=1).mean())}:
                yield replace(base_geom, radius=radius)
            for axis in range(3):
                projected = np.delete(touched_points, axis, axis=1)
                rotated_frame = base_geom.frame @ make_transform(rotate_z_to(np.eye(3)[axis]))
                for radius in {
                    *np.delete(sizes, axis).tolist(),
                    float(np.linalg.norm(projected, axis=1).mean()),
                }:
                    yield replace(
                        base_geom,
                        kind="cylinder",
                        frame=rotated_frame,
                        radius=radius,
                        length=2.0 * sizes[axis],
                    )
        case "wrap_torus":
            # OpenSim's path bends around the tube at the nearest point of the ring, where the torus is
            # locally a cylinder.
            tube_radius, ring_radius = sizes
            x, y, _ = touched_points.mean(0)
            outward = np.array((x, y, 0.0)) / np.hypot(x, y)
            rotated_frame = make_transform(
                rotate_z_to(np.cross((0.0, 0.0, 1.0), outward)), ring_radius * outward
            )
            yield replace(
                base_geom,
                kind="cylinder",
                frame=base_geom.frame @ rotated_frame,
                radius=tube_radius,
                length=2.0 * tube_radius,
            )
            # Alternatively it passes through a sphere in the hole: MuJoCo does so if the side site is
            # inside the sphere.
            yield replace(
                base_geom,
                radius=ring_radius - tube_radius,
                side=TendonSite(base_geom.body, base_geom.frame[:3, 3]),
            )


def rotate_z_to(axis: Array) -> Array:
    """Return a rotation (3, 3) that takes the z axis to a direction."""
    z = axis / np.linalg.norm(axis)
    x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
    x /= np.linalg.norm(x)
    return np.stack((x, np.cross(z, x), z), axis=1)
