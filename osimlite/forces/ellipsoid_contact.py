"""Where an ellipsoid touches a half space or another ellipsoid; the force is that of
:mod:`osimlite.forces.hunt_crossley`.

Source: Simbody's collision detection. Its effective radius in a half space comes from the curvatures of the section
through the centre of the ellipsoid parallel to the plane, and is that of the sphere for three equal half axes.
"""

from __future__ import annotations

from math import inf, sqrt


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


def ellipsoid_ellipsoid(
    x1: float,
    y1: float,
    z1: float,
    xx1: float,
    xy1: float,
    xz1: float,
    yx1: float,
    yy1: float,
    yz1: float,
    zx1: float,
    zy1: float,
    zz1: float,
    rx1: float,
    ry1: float,
    rz1: float,
    x2: float,
    y2: float,
    z2: float,
    xx2: float,
    xy2: float,
    xz2: float,
    yx2: float,
    yy2: float,
    yz2: float,
    zx2: float,
    zy2: float,
    zz2: float,
    rx2: float,
    ry2: float,
    rz2: float,
    a: float,
) -> tuple[float, float, float, float, float, float, float, float]:
    """Depth, effective radius, normal and point of application of two ellipsoids, of which one may be a sphere.

    The normal n is the direction in which the overlap h(n) = s1 + s2 - n (c2 - c1) is least, with c the centres and s
    the distances from them to the planes that touch the ellipsoids across n. It is found by Newton's method from the
    line of the centres. Ellipsoids with one centre have no normal and do not touch. The effective radius is
    1 / sqrt(k k'), with k and k' the principal curvatures of one surface relative to the other.

    Args:
        x1: centre (x1, y1, z1) of the ellipsoid that is surface 1, m; (x2, y2, z2) likewise.
        xx1: rotation matrix of its axes, by rows (xx1, xy1, xz1), (yx1, yy1, yz1), (zx1, zy1, zz1); likewise of 2.
        rx1: half axes (rx1, ry1, rz1), m; likewise of 2.
        a: part of the depth that is surface 1's, 1.

    Returns:
        (d, R, nx, ny, nz, px, py, pz): d, R and the point in m; n, 1. They touch where d > 0; otherwise there is a
        gap, and the rest means nothing.
    """
    dx = x2 - x1
    dy = y2 - y1
    dz = z2 - z1
    distance = sqrt(dx * dx + dy * dy + dz * dz)
    if distance == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    nx = dx / distance
    ny = dy / distance
    nz = dz / distance
    bxx1, byy1, bzz1, bxy1, bxz1, byz1 = _squares(
        xx1, xy1, xz1, yx1, yy1, yz1, zx1, zy1, zz1, rx1 * rx1, ry1 * ry1, rz1 * rz1
    )
    bxx2, byy2, bzz2, bxy2, bxz2, byz2 = _squares(
        xx2, xy2, xz2, yx2, yy2, yz2, zx2, zy2, zz2, rx2 * rx2, ry2 * ry2, rz2 * rz2
    )
    tries = 0
    least = inf
    kx, ky, kz, sx, sy, sz = nx, ny, nz, 0.0, 0.0, 0.0
    while True:
        gx1, gy1, gz1 = _times(bxx1, byy1, bzz1, bxy1, bxz1, byz1, nx, ny, nz)
        gx2, gy2, gz2 = _times(bxx2, byy2, bzz2, bxy2, bxz2, byz2, nx, ny, nz)
        s1 = sqrt(gx1 * nx + gy1 * ny + gz1 * nz)
        s2 = sqrt(gx2 * nx + gy2 * ny + gz2 * nz)
        h = s1 + s2 - (nx * dx + ny * dy + nz * dz)
        if h <= 0.0:
            # A plane across n parts the two.
            return h, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        tries += 1
        if h > least * (1.0 + 1e-12) and tries < 100:
            # Too long a step: half of it.
            sx *= 0.5
            sy *= 0.5
            sz *= 0.5
            nx, ny, nz = _unit(kx + sx, ky + sy, kz + sz)
            continue
        least = h
        kx, ky, kz = nx, ny, nz
        gx1, gy1, gz1 = gx1 / s1, gy1 / s1, gz1 / s1
        gx2, gy2, gz2 = gx2 / s2, gy2 / s2, gz2 / s2
        ux, uy, uz, vx, vy, vz = _across(nx, ny, nz)
        gu1, gv1, huu1, huv1, hvv1 = _slopes(
            bxx1, byy1, bzz1, bxy1, bxz1, byz1, gx1, gy1, gz1, s1, ux, uy, uz, vx, vy, vz
        )
        gu2, gv2, huu2, huv2, hvv2 = _slopes(
            bxx2, byy2, bzz2, bxy2, bxz2, byz2, gx2, gy2, gz2, s2, ux, uy, uz, vx, vy, vz
        )
        # How fast the overlap grows along u and v.
        fu = gu1 + gu2 - (dx * ux + dy * uy + dz * uz)
        fv = gv1 + gv2 - (dx * vx + dy * vy + dz * vz)
        if fu * fu + fv * fv <= 1e-26 * (s1 + s2) * (s1 + s2) or tries >= 100:
            break
        huu = huu1 + huu2 - h
        huv = huv1 + huv2
        hvv = hvv1 + hvv2 - h
        if huu <= 0.0 or huu * hvv - huv * huv <= 0.0:
            # Deep within each other the overlap is no bowl; without what bends it down it is.
            huu += h
            hvv += h
        determinant = huu * hvv - huv * huv
        su = (huv * fv - hvv * fu) / determinant
        sv = (huv * fu - huu * fv) / determinant
        sx = su * ux + sv * vx
        sy = su * uy + sv * vy
        sz = su * uz + sv * vz
        nx, ny, nz = _unit(kx + sx, ky + sy, kz + sz)
    one = huu1 * hvv1 - huv1 * huv1
    two = huu2 * hvv2 - huv2 * huv2
    huu = huu1 + huu2
    huv = huv1 + huv2
    R = sqrt(one * two / (huu * (hvv1 + hvv2) - huv * huv))
    return h, R, nx, ny, nz, x1 + gx1 - a * h * nx, y1 + gy1 - a * h * ny, z1 + gz1 - a * h * nz


def _squares(
    xx: float,
    xy: float,
    xz: float,
    yx: float,
    yy: float,
    yz: float,
    zx: float,
    zy: float,
    zz: float,
    p: float,
    q: float,
    r: float,
) -> tuple[float, float, float, float, float, float]:
    """The squares of an ellipsoid's half axes as a matrix B: s = sqrt(n B n) is the way to the plane that touches it
    across n, and B n / s leads to the point where that plane does.

    Args:
        xx: rotation matrix of the axes, by rows (xx, xy, xz), (yx, yy, yz), (zx, zy, zz).
        p: squares (p, q, r) of the half axes, m^2.

    Returns:
        (bxx, byy, bzz, bxy, bxz, byz), m^2.
    """
    return (
        p * xx * xx + q * xy * xy + r * xz * xz,
        p * yx * yx + q * yy * yy + r * yz * yz,
        p * zx * zx + q * zy * zy + r * zz * zz,
        p * xx * yx + q * xy * yy + r * xz * yz,
        p * xx * zx + q * xy * zy + r * xz * zz,
        p * yx * zx + q * yy * zy + r * yz * zz,
    )


def _times(
    bxx: float, byy: float, bzz: float, bxy: float, bxz: float, byz: float, x: float, y: float, z: float
) -> tuple[float, float, float]:
    """A symmetric matrix times a vector (x, y, z)."""
    return bxx * x + bxy * y + bxz * z, bxy * x + byy * y + byz * z, bxz * x + byz * y + bzz * z


def _unit(x: float, y: float, z: float) -> tuple[float, float, float]:
    """The unit vector along (x, y, z), which is not zero."""
    size = sqrt(x * x + y * y + z * z)
    return x / size, y / size, z / size


def _across(nx: float, ny: float, nz: float) -> tuple[float, float, float, float, float, float]:
    """Unit vectors u and v across the unit vector n and each other, as (ux, uy, uz, vx, vy, vz)."""
    if abs(nx) < 0.6:
        size = sqrt(ny * ny + nz * nz)
        ux, uy, uz = 0.0, nz / size, -ny / size
    else:
        size = sqrt(nx * nx + nz * nz)
        ux, uy, uz = -nz / size, 0.0, nx / size
    return ux, uy, uz, ny * uz - nz * uy, nz * ux - nx * uz, nx * uy - ny * ux


def _slopes(
    bxx: float,
    byy: float,
    bzz: float,
    bxy: float,
    bxz: float,
    byz: float,
    gx: float,
    gy: float,
    gz: float,
    s: float,
    ux: float,
    uy: float,
    uz: float,
    vx: float,
    vy: float,
    vz: float,
) -> tuple[float, float, float, float, float]:
    """First and second derivatives of s = sqrt(n B n) as n turns towards u and v.

    Args:
        bxx: the matrix B of `_squares`, m^2.
        gx: the gradient (gx, gy, gz) of s, B n / s, m.
        s: m.
        ux: unit vectors u = (ux, uy, uz) and v = (vx, vy, vz) across n, 1.

    Returns:
        (gu, gv, huu, huv, hvv), m.
    """
    gu = gx * ux + gy * uy + gz * uz
    gv = gx * vx + gy * vy + gz * vz
    wx, wy, wz = _times(bxx, byy, bzz, bxy, bxz, byz, ux, uy, uz)
    huu = (wx * ux + wy * uy + wz * uz - gu * gu) / s
    huv = (wx * vx + wy * vy + wz * vz - gu * gv) / s
    wx, wy, wz = _times(bxx, byy, bzz, bxy, bxz, byz, vx, vy, vz)
    hvv = (wx * vx + wy * vy + wz * vz - gv * gv) / s
    return gu, gv, huu, huv, hvv
