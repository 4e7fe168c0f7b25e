"""What MuJoCo has in the place of a surface that a path wraps around."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from osimlite.base.records import replace
from osimlite.mechanics.multibody.spatial import Array, make_transform
from osimlite.simulation.elements.geometries.paths.geometry_path import Surface
from osimlite.translate.mjcf.tendons import TendonSite, WrapGeom


def make_substitutes(surface: Surface, touched: Array) -> Iterator[WrapGeom]:
    """Spheres and cylinders in the place of a surface; none if it has no size.

    Args:
        surface: the surface.
        touched: points (k, 3) where the path touches it, in its own frame, m.
    """
    if min(surface.numbers[4:]) <= 0.0:
        return
    own = WrapGeom(
        surface.tangent.body, surface.tangent.frame, "sphere", 0.0, name=surface.tangent.name
    )
    sizes = surface.numbers[4:]
    match surface.law:
        case "wrap_sphere":
            yield replace(own, radius=sizes[0])
        case "wrap_cylinder":
            yield replace(own, kind="cylinder", radius=sizes[0], length=sizes[1])
        case "wrap_ellipsoid":
            for radius in {*sizes, float(np.linalg.norm(touched, axis=1).mean())}:
                yield replace(own, radius=radius)
            for axis in range(3):
                across = np.delete(touched, axis, axis=1)
                turned = own.frame @ make_transform(rotate_z_to(np.eye(3)[axis]))
                for radius in {
                    *np.delete(sizes, axis).tolist(),
                    float(np.linalg.norm(across, axis=1).mean()),
                }:
                    yield replace(
                        own, kind="cylinder", frame=turned, radius=radius, length=2.0 * sizes[axis]
                    )
        case "wrap_torus":
            # OpenSim's path bends around the tube where that is nearest.
            tube, ring = sizes
            x, y, _ = touched.mean(0)
            out = np.array((x, y, 0.0)) / np.hypot(x, y)
            turned = make_transform(rotate_z_to(np.cross((0.0, 0.0, 1.0), out)), ring * out)
            yield replace(
                own, kind="cylinder", frame=own.frame @ turned, radius=tube, length=2.0 * tube
            )
            # Or it runs through a ball in the hole, whose side site is inside.
            yield replace(own, radius=ring - tube, side=TendonSite(own.body, own.frame[:3, 3]))


def rotate_z_to(axis: Array) -> Array:
    """A rotation that takes z to a direction."""
    z = axis / np.linalg.norm(axis)
    x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
    x /= np.linalg.norm(x)
    return np.stack((x, np.cross(z, x), z), axis=1)
