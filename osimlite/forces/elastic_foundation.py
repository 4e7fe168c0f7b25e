"""Elastic foundation: a mesh covered by a layer of springs, one at the middle of every triangle.

A spring acts while its middle is inside the other surface. It then pushes along the way from the middle to the nearest
point of that surface, at that point; its opposite acts on the other surface at the same point. All vectors are in one
frame of the caller's choice, ground as a rule.

Sources: K. L. Johnson, "Contact Mechanics" (1985), section 4.3, for the foundation; damping and friction in the form
that Simbody's ElasticFoundationForce gives them (the friction is that of :mod:`osimlite.forces.hunt_crossley`).
"""

from __future__ import annotations

from math import sqrt


def spring_in_half_space(
    ox: float, oy: float, oz: float, nx: float, ny: float, nz: float, x: float, y: float, z: float
) -> tuple[float, float, float, float]:
    """Depth of the middle of a spring in a half space, and the nearest point of the plane.

    Args:
        ox: point o = (ox, oy, oz) on the plane, m.
        nx: unit normal n = (nx, ny, nz) of the plane, out of the half space, 1.
        x: middle (x, y, z) of the spring, m.

    Returns:
        (d, px, py, pz), m. The spring acts where d > 0.
    """
    d = (ox - x) * nx + (oy - y) * ny + (oz - z) * nz
    return d, x + d * nx, y + d * ny, z + d * nz


def spring_in_sphere(
    cx: float, cy: float, cz: float, r: float, x: float, y: float, z: float
) -> tuple[float, float, float, float]:
    """Depth of the middle of a spring in a sphere, and the nearest point of the sphere.

    In the very centre no point is nearest, so that the spring does not act.

    Args:
        cx: centre (cx, cy, cz) of the sphere, m.
        r: its radius, m.
        x: middle (x, y, z) of the spring, m.

    Returns:
        (d, px, py, pz), m. The spring acts where d > 0.
    """
    x -= cx
    y -= cy
    z -= cz
    distance = sqrt(x * x + y * y + z * z)
    if distance == 0.0:
        return 0.0, cx, cy, cz
    s = r / distance
    return r - distance, cx + s * x, cy + s * y, cz + s * z


def spring_load(
    k: float,
    c: float,
    us: float,
    ud: float,
    uv: float,
    vt: float,
    mx: float,
    my: float,
    mz: float,
    ex: float,
    ey: float,
    ez: float,
    ax: float,
    ay: float,
    az: float,
    vx: float,
    vy: float,
    vz: float,
    wx: float,
    wy: float,
    wz: float,
) -> tuple[float, float, float, float, float, float, float]:
    """Force of one spring on the mesh at the nearest point of the other surface, its torque about a, and its energy.

    With d the way from the middle to that point and v the velocity there, of which vn is along d and vT across it:
    f = k |d| (1 + c vn) along d, nothing where that is not positive; and f mu along the slip vT, with w = |vT|,
    r = w / vt and mu = min(r, 1) (ud + 2 (us - ud) / (1 + r^2)) + uv w. The energy is k |d|^2 / 2.

    Args:
        k: stiffness of the layer times area of the triangle, N/m.
        c: dissipation, s/m.
        us: coefficient of static friction, 1.
        ud: coefficient of dynamic friction, 1.
        uv: coefficient of viscous friction, s/m.
        vt: transition velocity, m/s. Where it is 0 (or less), mu = ud + uv w for every w > 0.
        mx: middle (mx, my, mz) of the spring, m.
        ex: nearest point (ex, ey, ez) of the other surface, m.
        ax: point a = (ax, ay, az), m.
        vx: velocity (vx, vy, vz) of the other surface relative to the mesh at a, m/s.
        wx: its angular velocity (wx, wy, wz) relative to the mesh, 1/s.

    Returns:
        (fx, fy, fz, tx, ty, tz, energy), N, N·m and J.
    """
    dx = ex - mx
    dy = ey - my
    dz = ez - mz
    d = sqrt(dx * dx + dy * dy + dz * dz)
    if d == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    energy = 0.5 * k * d * d
    nx = dx / d
    ny = dy / d
    nz = dz / d
    rx = ex - ax
    ry = ey - ay
    rz = ez - az
    tx = vx + wy * rz - wz * ry
    ty = vy + wz * rx - wx * rz
    tz = vz + wx * ry - wy * rx
    vn = tx * nx + ty * ny + tz * nz
    f = k * d * (1.0 + c * vn)
    if f <= 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, energy
    tx -= vn * nx
    ty -= vn * ny
    tz -= vn * nz
    w = sqrt(tx * tx + ty * ty + tz * tz)
    g = 0.0
    if w > 0.0:
        mu = ud + uv * w
        if vt > 0.0:
            r = w / vt
            mu = ud + 2.0 * (us - ud) / (1.0 + r * r)
            if r < 1.0:
                mu *= r
            mu += uv * w
        g = f * mu / w
    fx = f * nx + g * tx
    fy = f * ny + g * ty
    fz = f * nz + g * tz
    return fx, fy, fz, ry * fz - rz * fy, rz * fx - rx * fz, rx * fy - ry * fx, energy
