"""Hunt-Crossley contact with friction: half space against sphere, sphere against sphere.

Every contact has a surface 1 and a surface 2 (of a half space and a sphere, the half space is
surface 1). The unit normal n points from 1 to 2, d is the depth of the overlap, v = v1 - v2 the
velocity of the material of surface 1 relative to that of surface 2 at the point of application P.
The laws return the force on surface 2 at P; its opposite acts on surface 1 at P. All vectors are in
one frame of the caller's choice, ground as a rule.

Sources: K. H. Hunt and F. R. E. Crossley, "Coefficient of restitution interpreted as damping in
vibroimpact", Journal of Applied Mechanics 42 (1975) 440-445 (dissipation proportional to the
elastic force); H. Hertz (1881) for the elastic force; M. Hollars' friction curve in the form that
Simbody's HuntCrossleyForce gives it (friction proportional to slip below the transition velocity,
Stribeck fall from static to dynamic friction above it, and a viscous part).
"""

from __future__ import annotations

from math import sqrt

from osimlite.mechanics.laws.vectors import (
    ZERO,
    Vector,
    add_scaled,
    divide,
    dot,
    minus,
    norm,
    times,
)


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
    """Return the effective parameters of a pair of surfaces, to be computed once per pair.

    With k_i = K_i^(2/3), the part a = k2 / (k1 + k2) of the depth is in surface 1: the softer surface
    yields more. A surface of stiffness 0 (the default of the property) yields without resistance, so
    that k = 0 and the pair exerts no force; that holds for two such surfaces also, where OpenSim 4.6
    divides 0 by 0.

    Args:
        K1: stiffness property of surface 1 (a plane-strain modulus), not negative (Pa).
        c1: dissipation (s/m).
        us1: coefficient of static friction.
        ud1: coefficient of dynamic friction.
        uv1: coefficient of viscous friction (s/m).
        K2: stiffness property of surface 2, not negative (Pa).
        c2: dissipation (s/m).
        us2: coefficient of static friction.
        ud2: coefficient of dynamic friction.
        uv2: coefficient of viscous friction (s/m).

    Returns:
        (k, a, c, us, ud, uv): k as `contact_force` takes it (Pa^(2/3)), a, c (s/m), us, ud, uv (s/m).
        The coefficients of friction are harmonic means, so that one frictionless surface makes the
        pair frictionless.

    Raises:
        ValueError: a stiffness is negative. The caller adds the component's name to the message.
    """
    if K1 < 0.0 or K2 < 0.0:
        raise ValueError("a contact stiffness must not be negative")
    # Simbody combines springs in series in this form, because Hertz' force scales with K d^(3/2).
    k1 = K1 ** (2.0 / 3.0)
    k2 = K2 ** (2.0 / 3.0)
    # Without any stiffness the split of the depth does not matter.
    a = k2 / (k1 + k2) if k1 + k2 > 0.0 else 0.5
    # Harmonic means; the sum is tested because 0 / 0 must give 0.
    us = 2.0 * us1 * us2 / (us1 + us2) if us1 + us2 != 0.0 else 0.0
    ud = 2.0 * ud1 * ud2 / (ud1 + ud2) if ud1 + ud2 != 0.0 else 0.0
    uv = 2.0 * uv1 * uv2 / (uv1 + uv2) if uv1 + uv2 != 0.0 else 0.0
    return k1 * a, a, c1 * a + c2 * (1.0 - a), us, ud, uv


def half_space_sphere(
    o: Vector, n: Vector, center: Vector, r: float, a: float
) -> tuple[float, Vector]:
    """Compute the contact of a sphere (surface 2) with a half space (surface 1).

    The half space has no bottom: a centre far below its plane gives a depth greater than 2 r. The
    effective radius of the pair is r.

    Args:
        o: point on the plane (m).
        n: outward unit normal of the half space.
        center: centre of the sphere (m).
        r: radius of the sphere (m).
        a: part of the depth in the half space, from `combine_materials`.

    Returns:
        Depth d and point of application (m). The surfaces touch where d > 0; otherwise -d is the gap
        and the point is undefined.
    """
    s = dot(minus(center, o), n)
    d = r - s
    # Both surfaces are deformed to the same point, which lies between the sphere's lowest point and
    # the plane: by a d below the plane.
    return (d, add_scaled(center, -(s + a * d), n)) if d > 0.0 else (d, ZERO)


def sphere_sphere(
    c1: Vector, r1: float, c2: Vector, r2: float, a: float
) -> tuple[float, float, Vector, Vector]:
    """Compute the contact of two spheres.

    Spheres with the same centre have no normal and do not touch, as in Simbody.

    Args:
        c1: centre of the sphere that is surface 1 (m).
        r1: radius of surface 1 (m).
        c2: centre of the sphere that is surface 2 (m).
        r2: radius of surface 2 (m).
        a: part of the depth in surface 1, from `combine_materials`.

    Returns:
        Depth d (m), effective radius r1 r2 / (r1 + r2) (m), normal from surface 1 to 2, and point of
        application (m). The surfaces touch where d > 0; otherwise -d is the gap (0 for one centre) and
        the rest is undefined.
    """
    centre_line = minus(c2, c1)
    distance = norm(centre_line)
    d = r1 + r2 - distance
    if d <= 0.0 or distance == 0.0:
        # Concentric spheres report depth 0, because there is no normal to push along.
        return min(d, 0.0), 0.0, ZERO, ZERO
    n = divide(centre_line, distance)
    return d, r1 * r2 / (r1 + r2), n, add_scaled(c1, r1 - a * d, n)


def friction_coefficient(w: float, us: float, ud: float, uv: float, vt: float) -> float:
    """Return the coefficient of friction at a slip velocity.

    It is min(r, 1) (ud + 2 (us - ud) / (1 + r^2)) + uv w, with r = w / vt. At w = vt it is us + uv
    vt and has a kink. With us < ud / 2 it is negative for small r: friction then drives the slip
    instead of opposing it.

    Args:
        w: slip velocity, greater than 0 (m/s).
        us: coefficient of static friction.
        ud: coefficient of dynamic friction.
        uv: coefficient of viscous friction (s/m).
        vt: transition velocity (m/s). Where it is 0 or less, the coefficient is ud + uv w, the
            limit for vt -> 0.
    """
    if not vt > 0.0:
        return ud + uv * w
    r = w / vt
    mu = ud + 2.0 * (us - ud) / (1.0 + r * r)
    return (r * mu if r < 1.0 else mu) + uv * w


def contact_force(
    d: float,
    R: float,
    k: float,
    c: float,
    us: float,
    ud: float,
    uv: float,
    vt: float,
    n: Vector,
    v: Vector,
) -> Vector:
    """Return the force on surface 2 at the point of application.

    f = (4/3) k d sqrt(R k d) (1 + (3/2) c vn) along n, zero where that is not positive (no contact
    pulls); and f mu along the slip of surface 1 over surface 2, where mu is its `friction_coefficient`.

    Args:
        d: depth (m); no force where d <= 0.
        R: effective radius of curvature (m).
        k: effective stiffness from `combine_materials` (Pa^(2/3)); no force where it is 0.
        c: effective dissipation (s/m).
        us: effective coefficient of static friction.
        ud: effective coefficient of dynamic friction.
        uv: effective coefficient of viscous friction (s/m).
        vt: transition velocity (m/s).
        n: unit normal from surface 1 to surface 2.
        v: velocity of surface 1 relative to surface 2 at the point of application (m/s).

    Returns:
        Force (N). A depth or velocity that is not a number gives a force that is not a number.
    """
    # Written without `not`: NaN passes and shows in the force, instead of silently giving none.
    if d <= 0.0:
        return ZERO
    vn = dot(v, n)
    f = (4.0 / 3.0) * k * d * sqrt(R * k * d) * (1.0 + 1.5 * c * vn)
    if f <= 0.0:
        return ZERO
    # v = v1 - v2 is the slip of surface 1; friction drags surface 2 along with it, hence no minus
    # sign.
    slip = add_scaled(v, -vn, n)
    w = norm(slip)
    if w == 0.0:
        return times(f, n)
    return add_scaled(times(f, n), f * friction_coefficient(w, us, ud, uv, vt) / w, slip)


def contact_derivatives(
    d: float,
    R: float,
    k: float,
    c: float,
    us: float,
    ud: float,
    uv: float,
    vt: float,
    n: Vector,
    v: Vector,
) -> tuple[float, float, float]:
    """Return the derivatives of the force of `contact_force`, which has the same arguments.

    Args:
        d: depth (m).
        R: effective radius of curvature (m).
        k: effective stiffness from `combine_materials` (Pa^(2/3)).
        c: effective dissipation (s/m).
        us: effective coefficient of static friction.
        ud: effective coefficient of dynamic friction.
        uv: effective coefficient of viscous friction (s/m).
        vt: transition velocity (m/s).
        n: unit normal from surface 1 to surface 2.
        v: velocity of surface 1 relative to surface 2 at the point of application (m/s).

    Returns:
        Derivatives of the normal force by the depth (N/m) and by the approach velocity v n (N s/m),
        and tangential force over slip (N s/m); all 0 where there is no force.
    """
    if d <= 0.0:
        return 0.0, 0.0, 0.0
    vn = dot(v, n)
    elastic = (4.0 / 3.0) * k * d * sqrt(R * k * d)
    f = elastic * (1.0 + 1.5 * c * vn)
    if f <= 0.0:
        return 0.0, 0.0, 0.0
    # Without slip use the limit, as the coefficient is proportional to small slip.
    w = max(norm(add_scaled(v, -vn, n)), 1e-6 * vt, 1e-12)
    # The elastic force grows with d^(3/2), so that its derivative is 3/2 of force over depth.
    return 1.5 * f / d, 1.5 * c * elastic, f * friction_coefficient(w, us, ud, uv, vt) / w


def contact_energy(d: float, R: float, k: float) -> float:
    """Return the potential energy of the elastic part, (8/15) k d^2 sqrt(R k d) (J).

    Its derivative by d is the elastic force of Hertz, (4/3) k d sqrt(R k d).

    Args:
        d: depth (m); no energy where d <= 0.
        R: effective radius of curvature (m).
        k: effective stiffness from `combine_materials` (Pa^(2/3)).
    """
    if d <= 0.0:
        return 0.0
    return (8.0 / 15.0) * k * d * d * sqrt(R * k * d)
