"""Hunt-Crossley contact with friction: half space against sphere, sphere against sphere.

Every contact has a surface 1 and a surface 2 (of a half space and a sphere, the half space is surface 1). The
unit normal n points from 1 to 2, d is the depth of the overlap, v = v1 - v2 the velocity of the material of
surface 1 relative to that of surface 2 at the point of application P. The laws return the force on surface 2
at P; its opposite acts on surface 1 at P. All vectors are in one frame of the caller's choice, ground as a
rule.

Sources: K. H. Hunt and F. R. E. Crossley, "Coefficient of restitution interpreted as damping in vibroimpact",
Journal of Applied Mechanics 42 (1975) 440-445 (dissipation proportional to the elastic force); H. Hertz
(1881) for the elastic force; M. Hollars' friction curve in the form that Simbody's HuntCrossleyForce gives it
(friction proportional to slip below the transition velocity, Stribeck fall from static to dynamic friction
above it, and a viscous part).
"""

from __future__ import annotations

from math import sqrt


def combine_materials(
    K1: float,
    c1: float,
    us1: float,
    ud1: float,
    uv1: float,
    K2: float,
    c2: float,
    us2: float,
    ud2: float,
    uv2: float,
) -> tuple[float, float, float, float, float, float]:
    """Effective parameters of a pair of surfaces, to be computed once per pair.

    With k_i = K_i^(2/3), a = k2 / (k1 + k2) of the depth is surface 1's: the softer surface yields more. A
    surface of stiffness 0 (the default of the property) yields without resistance, so that k = 0 and the
    pair exerts no force; that holds for two such surfaces also, where OpenSim 4.6 divides 0 by 0.

    Args:
        K1: stiffness property of surface 1 (a plane-strain modulus), Pa; K2 likewise. Not negative.
        c1: dissipation, s/m; c2 likewise.
        us1: coefficient of static friction, 1; us2 likewise.
        ud1: coefficient of dynamic friction, 1; ud2 likewise.
        uv1: coefficient of viscous friction, s/m; uv2 likewise.

    Returns:
        (k, a, c, us, ud, uv): k as `contact_force` takes it, Pa^(2/3); a, 1; c, s/m; us and ud, 1; uv, s/m.
        The coefficients of friction are harmonic means, so that one frictionless surface makes the pair
        frictionless.

    Raises:
        ValueError: a stiffness is negative. The caller knows the component's name and says so in its own
            words.
    """
    if K1 < 0.0 or K2 < 0.0:
        raise ValueError("a contact stiffness must not be negative")
    k1 = K1 ** (2.0 / 3.0)
    k2 = K2 ** (2.0 / 3.0)
    a = k2 / (k1 + k2) if k1 + k2 > 0.0 else 0.5
    us = 2.0 * us1 * us2 / (us1 + us2) if us1 + us2 != 0.0 else 0.0
    ud = 2.0 * ud1 * ud2 / (ud1 + ud2) if ud1 + ud2 != 0.0 else 0.0
    uv = 2.0 * uv1 * uv2 / (uv1 + uv2) if uv1 + uv2 != 0.0 else 0.0
    return k1 * a, a, c1 * a + c2 * (1.0 - a), us, ud, uv


def half_space_sphere(
    ox: float,
    oy: float,
    oz: float,
    nx: float,
    ny: float,
    nz: float,
    x: float,
    y: float,
    z: float,
    r: float,
    a: float,
) -> tuple[float, float, float, float]:
    """Depth and point of application of a sphere (surface 2) in a half space (surface 1).

    The half space has no bottom: a centre far below its plane gives a depth greater than 2 r. R of the pair
    is r.

    Args:
        ox: point o = (ox, oy, oz) on the plane, m.
        nx: unit normal n = (nx, ny, nz) of the plane, out of the half space, 1.
        x: centre (x, y, z) of the sphere, m.
        r: radius of the sphere, m.
        a: part of the depth that is the half space's, from `combine_materials`, 1.

    Returns:
        (d, px, py, pz), m. They touch where d > 0; otherwise -d is the gap and the point means nothing.
    """
    s = (x - ox) * nx + (y - oy) * ny + (z - oz) * nz
    d = r - s
    if d <= 0.0:
        return d, 0.0, 0.0, 0.0
    s += a * d
    return d, x - s * nx, y - s * ny, z - s * nz


def sphere_sphere(
    x1: float,
    y1: float,
    z1: float,
    r1: float,
    x2: float,
    y2: float,
    z2: float,
    r2: float,
    a: float,
) -> tuple[float, float, float, float, float, float, float, float]:
    """Depth, effective radius, normal and point of application of two spheres.

    Spheres with one and the same centre have no normal and, as in Simbody, do not touch.

    Args:
        x1: centre (x1, y1, z1) of the sphere that is surface 1, m; (x2, y2, z2) likewise.
        r1: its radius, m; r2 likewise.
        a: part of the depth that is surface 1's, from `combine_materials`, 1.

    Returns:
        (d, R, nx, ny, nz, px, py, pz): d, R = r1 r2 / (r1 + r2) and the point in m; n, 1. They touch where
        d > 0; otherwise -d is the gap (0 for one centre) and the rest means nothing.
    """
    nx = x2 - x1
    ny = y2 - y1
    nz = z2 - z1
    distance = sqrt(nx * nx + ny * ny + nz * nz)
    d = r1 + r2 - distance
    if d <= 0.0:
        return d, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if distance == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    nx /= distance
    ny /= distance
    nz /= distance
    s = r1 - a * d
    return d, r1 * r2 / (r1 + r2), nx, ny, nz, x1 + s * nx, y1 + s * ny, z1 + s * nz


def contact_force(
    d: float,
    R: float,
    k: float,
    c: float,
    us: float,
    ud: float,
    uv: float,
    vt: float,
    nx: float,
    ny: float,
    nz: float,
    vx: float,
    vy: float,
    vz: float,
) -> tuple[float, float, float]:
    """Force on surface 2 at the point of application.

    f = (4/3) k d sqrt(R k d) (1 + (3/2) c vn) along n, nothing where that is not positive (no contact pulls);
    and f mu along the slip vT of surface 1 over surface 2, with w = |vT|, r = w / vt and
    mu = min(r, 1) (ud + 2 (us - ud) / (1 + r^2)) + uv w. At w = vt, mu is us + uv vt and has a kink.
    With us < ud / 2 the curve is negative for small r: friction then drives the slip instead of opposing it.

    Args:
        d: depth, m; no force where d <= 0.
        R: effective radius of curvature, m.
        k: effective stiffness from `combine_materials`, Pa^(2/3); no force where it is 0.
        c: effective dissipation, s/m.
        us: effective coefficient of static friction, 1.
        ud: effective coefficient of dynamic friction, 1.
        uv: effective coefficient of viscous friction, s/m.
        vt: transition velocity, m/s. Where it is 0 (or less), mu = ud + uv w for every w > 0, the limit for
            vt -> 0.
        nx: unit normal (nx, ny, nz) from surface 1 to surface 2, 1.
        vx: velocity (vx, vy, vz) of surface 1 relative to surface 2 at the point of application, m/s.

    Returns:
        (fx, fy, fz), N. A depth or velocity that is not a number gives a force that is not a number.
    """
    if d <= 0.0:
        return 0.0, 0.0, 0.0
    vn = vx * nx + vy * ny + vz * nz
    f = (4.0 / 3.0) * k * d * sqrt(R * k * d) * (1.0 + 1.5 * c * vn)
    if f <= 0.0:
        return 0.0, 0.0, 0.0
    tx = vx - vn * nx
    ty = vy - vn * ny
    tz = vz - vn * nz
    w = sqrt(tx * tx + ty * ty + tz * tz)
    if w == 0.0:
        return f * nx, f * ny, f * nz
    if w < vt:
        r = w / vt
        mu = r * (ud + 2.0 * (us - ud) / (1.0 + r * r)) + uv * w
    elif vt > 0.0:
        r = w / vt
        mu = ud + 2.0 * (us - ud) / (1.0 + r * r) + uv * w
    else:
        mu = ud + uv * w
    g = f * mu / w
    return f * nx + g * tx, f * ny + g * ty, f * nz + g * tz


def contact_energy(d: float, R: float, k: float) -> float:
    """Potential energy of the elastic part, (8/15) k d^2 sqrt(R k d), in J.

    Its derivative with respect to d is the elastic force of Hertz, (4/3) k d sqrt(R k d).

    Args:
        d: depth, m; no energy where d <= 0.
        R: effective radius of curvature, m.
        k: effective stiffness from `combine_materials`, Pa^(2/3).
    """
    if d <= 0.0:
        return 0.0
    return (8.0 / 15.0) * k * d * d * sqrt(R * k * d)
