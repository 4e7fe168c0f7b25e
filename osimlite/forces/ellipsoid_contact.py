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
    # The squares of the half axes, turned: s = sqrt(n B n), and B n / s leads to the point where the plane touches.
    p, q, r = rx1 * rx1, ry1 * ry1, rz1 * rz1
    bxx1 = p * xx1 * xx1 + q * xy1 * xy1 + r * xz1 * xz1
    byy1 = p * yx1 * yx1 + q * yy1 * yy1 + r * yz1 * yz1
    bzz1 = p * zx1 * zx1 + q * zy1 * zy1 + r * zz1 * zz1
    bxy1 = p * xx1 * yx1 + q * xy1 * yy1 + r * xz1 * yz1
    bxz1 = p * xx1 * zx1 + q * xy1 * zy1 + r * xz1 * zz1
    byz1 = p * yx1 * zx1 + q * yy1 * zy1 + r * yz1 * zz1
    p, q, r = rx2 * rx2, ry2 * ry2, rz2 * rz2
    bxx2 = p * xx2 * xx2 + q * xy2 * xy2 + r * xz2 * xz2
    byy2 = p * yx2 * yx2 + q * yy2 * yy2 + r * yz2 * yz2
    bzz2 = p * zx2 * zx2 + q * zy2 * zy2 + r * zz2 * zz2
    bxy2 = p * xx2 * yx2 + q * xy2 * yy2 + r * xz2 * yz2
    bxz2 = p * xx2 * zx2 + q * xy2 * zy2 + r * xz2 * zz2
    byz2 = p * yx2 * zx2 + q * yy2 * zy2 + r * yz2 * zz2
    tries = 0
    least = inf
    kx, ky, kz, sx, sy, sz = nx, ny, nz, 0.0, 0.0, 0.0
    while True:
        gx1 = bxx1 * nx + bxy1 * ny + bxz1 * nz
        gy1 = bxy1 * nx + byy1 * ny + byz1 * nz
        gz1 = bxz1 * nx + byz1 * ny + bzz1 * nz
        gx2 = bxx2 * nx + bxy2 * ny + bxz2 * nz
        gy2 = bxy2 * nx + byy2 * ny + byz2 * nz
        gz2 = bxz2 * nx + byz2 * ny + bzz2 * nz
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
            nx = kx + sx
            ny = ky + sy
            nz = kz + sz
            size = sqrt(nx * nx + ny * ny + nz * nz)
            nx /= size
            ny /= size
            nz /= size
            continue
        least = h
        kx, ky, kz = nx, ny, nz
        gx1 /= s1
        gy1 /= s1
        gz1 /= s1
        gx2 /= s2
        gy2 /= s2
        gz2 /= s2
        # Directions u and v across n.
        if abs(nx) < 0.6:
            size = sqrt(ny * ny + nz * nz)
            ux, uy, uz = 0.0, nz / size, -ny / size
        else:
            size = sqrt(nx * nx + nz * nz)
            ux, uy, uz = -nz / size, 0.0, nx / size
        vx = ny * uz - nz * uy
        vy = nz * ux - nx * uz
        vz = nx * uy - ny * ux
        gu1 = gx1 * ux + gy1 * uy + gz1 * uz
        gv1 = gx1 * vx + gy1 * vy + gz1 * vz
        gu2 = gx2 * ux + gy2 * uy + gz2 * uz
        gv2 = gx2 * vx + gy2 * vy + gz2 * vz
        wx = bxx1 * ux + bxy1 * uy + bxz1 * uz
        wy = bxy1 * ux + byy1 * uy + byz1 * uz
        wz = bxz1 * ux + byz1 * uy + bzz1 * uz
        huu1 = (wx * ux + wy * uy + wz * uz - gu1 * gu1) / s1
        huv1 = (wx * vx + wy * vy + wz * vz - gu1 * gv1) / s1
        wx = bxx1 * vx + bxy1 * vy + bxz1 * vz
        wy = bxy1 * vx + byy1 * vy + byz1 * vz
        wz = bxz1 * vx + byz1 * vy + bzz1 * vz
        hvv1 = (wx * vx + wy * vy + wz * vz - gv1 * gv1) / s1
        wx = bxx2 * ux + bxy2 * uy + bxz2 * uz
        wy = bxy2 * ux + byy2 * uy + byz2 * uz
        wz = bxz2 * ux + byz2 * uy + bzz2 * uz
        huu2 = (wx * ux + wy * uy + wz * uz - gu2 * gu2) / s2
        huv2 = (wx * vx + wy * vy + wz * vz - gu2 * gv2) / s2
        wx = bxx2 * vx + bxy2 * vy + bxz2 * vz
        wy = bxy2 * vx + byy2 * vy + byz2 * vz
        wz = bxz2 * vx + byz2 * vy + bzz2 * vz
        hvv2 = (wx * vx + wy * vy + wz * vz - gv2 * gv2) / s2
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
        nx = kx + sx
        ny = ky + sy
        nz = kz + sz
        size = sqrt(nx * nx + ny * ny + nz * nz)
        nx /= size
        ny /= size
        nz /= size
    one = huu1 * hvv1 - huv1 * huv1
    two = huu2 * hvv2 - huv2 * huv2
    huu = huu1 + huu2
    huv = huv1 + huv2
    R = sqrt(one * two / (huu * (hvv1 + hvv2) - huv * huv))
    return h, R, nx, ny, nz, x1 + gx1 - a * h * nx, y1 + gy1 - a * h * ny, z1 + gz1 - a * h * nz
