"""Where a half space and an ellipsoid touch; the force is that of :mod:`osimlite.forces.hunt_crossley`.

Source: Simbody's collision detection. Its effective radius comes from the curvatures of the section through the centre
of the ellipsoid parallel to the plane, and is that of the sphere for three equal half axes.
"""

from __future__ import annotations

from math import sqrt


def half_space_ellipsoid(
    ox: float,
    oy: float,
    oz: float,
    nx: float,
    ny: float,
    nz: float,
    x: float,
    y: float,
    z: float,
    xx: float,
    xy: float,
    xz: float,
    yx: float,
    yy: float,
    yz: float,
    zx: float,
    zy: float,
    zz: float,
    rx: float,
    ry: float,
    rz: float,
    a: float,
) -> tuple[float, float, float, float, float]:
    """Depth, effective radius and point of application of an ellipsoid (surface 2) in a half space (surface 1).

    Args:
        ox: point o = (ox, oy, oz) on the plane, m.
        nx: unit normal n = (nx, ny, nz) of the plane, out of the half space, 1.
        x: centre (x, y, z) of the ellipsoid, m.
        xx: rotation matrix of the ellipsoid's axes, by rows (xx, xy, xz), (yx, yy, yz), (zx, zy, zz).
        rx: half axes (rx, ry, rz), m.
        a: part of the depth that is the half space's, 1.

    Returns:
        (d, R, px, py, pz), m. They touch where d > 0; otherwise -d is the gap and the rest means nothing.
    """
    # The normal along the axes of the ellipsoid, times the half axes.
    ux = (nx * xx + ny * yx + nz * zx) * rx
    uy = (nx * xy + ny * yy + nz * zy) * ry
    uz = (nx * xz + ny * yz + nz * zz) * rz
    reach = sqrt(ux * ux + uy * uy + uz * uz)
    d = reach - ((x - ox) * nx + (y - oy) * ny + (z - oz) * nz)
    if d <= 0.0:
        return d, 0.0, 0.0, 0.0, 0.0
    # The product of the curvatures of the section is (reach / (rx ry rz))^2.
    R = sqrt(rx * ry * rz / reach)
    lx = -ux * rx / reach
    ly = -uy * ry / reach
    lz = -uz * rz / reach
    s = d * (1.0 - a)
    return (
        d,
        R,
        x + xx * lx + xy * ly + xz * lz + s * nx,
        y + yx * lx + yy * ly + yz * lz + s * ny,
        z + zx * lx + zy * ly + zz * lz + s * nz,
    )
