"""Contact geometry of an ellipsoid with a half space or another ellipsoid.

The force is that of :mod:`osimlite.mechanics.laws.hunt_crossley`. Source: Simbody's collision
detection. Its effective radius in a half space comes from the curvatures of the section through the
centre of the ellipsoid parallel to the plane, and is that of the sphere for three equal half axes.
"""

from __future__ import annotations

from math import inf, sqrt

from osimlite.mechanics.laws.rotations import Axes
from osimlite.mechanics.laws.vectors import (
    ZERO,
    Vector,
    add_scaled,
    cross,
    divide,
    dot,
    minus,
    multiply_elementwise,
    norm,
    plus,
    times,
)


def half_space_ellipsoid(
    o: Vector, n: Vector, center: Vector, axes: Axes, radii: Vector, a: float
) -> tuple[float, float, Vector]:
    """Compute the contact of an ellipsoid (surface 2) with a half space (surface 1).

    Args:
        o: point on the plane (m).
        n: outward unit normal of the half space.
        center: centre of the ellipsoid (m).
        axes: axes of the ellipsoid.
        radii: half axes (m).
        a: part of the depth in the half space.

    Returns:
        Depth d, effective radius and point of application (m). The surfaces touch where d > 0;
        otherwise -d is the gap and the rest is undefined.
    """
    x_axis, y_axis, z_axis = axes
    rx, ry, rz = radii
    # The normal along the axes of the ellipsoid, times the half axes.
    u = dot(n, x_axis) * rx, dot(n, y_axis) * ry, dot(n, z_axis) * rz
    # Support function: the distance from the centre to the tangent plane that is perpendicular to
    # n.
    reach = norm(u)
    d = reach - dot(minus(center, o), n)
    if d <= 0.0:
        return d, 0.0, ZERO
    # Lowest point of the ellipsoid, along its axes: -B n / reach.
    lx, ly, lz = divide(times(-1.0, multiply_elementwise(u, radii)), reach)
    point = add_scaled(add_scaled(add_scaled(center, lx, x_axis), ly, y_axis), lz, z_axis)
    # The product of the curvatures of the section is (reach / (rx ry rz))^2; for a sphere the
    # effective radius is its radius.
    return d, sqrt(rx * ry * rz / reach), add_scaled(point, d * (1.0 - a), n)


def ellipsoid_ellipsoid(
    c1: Vector, axes1: Axes, radii1: Vector, c2: Vector, axes2: Axes, radii2: Vector, a: float
) -> tuple[float, float, Vector, Vector]:
    """Compute the contact of two ellipsoids; both may be spheres as well.

    The normal n minimizes the overlap h(n) = s1 + s2 - n (c2 - c1), where c are the centres and s the
    distances from them to the planes perpendicular to n that touch the ellipsoids. It is found by
    Newton's method from the line of the centres. Ellipsoids with one centre have no normal and do not
    touch. The effective radius is 1 / sqrt(k k'), where k and k' are the principal curvatures of one
    surface relative to the other.

    Args:
        c1: centre of the ellipsoid that is surface 1 (m).
        axes1: directions of the half axes of surface 1.
        radii1: lengths of the half axes of surface 1 (m).
        c2: centre of the ellipsoid that is surface 2 (m).
        axes2: directions of the half axes of surface 2.
        radii2: lengths of the half axes of surface 2 (m).
        a: part of the depth in surface 1.

    Returns:
        Depth d (m), effective radius (m), normal from surface 1 to 2, and point of application (m).
        The surfaces touch where d > 0; otherwise there is a gap, and the rest is undefined.
    """
    centre_line = minus(c2, c1)
    distance = norm(centre_line)
    if distance == 0.0:
        return 0.0, 0.0, ZERO, ZERO
    n = divide(centre_line, distance)
    squares1, squares2 = multiply_elementwise(radii1, radii1), multiply_elementwise(radii2, radii2)
    tries, least, best_normal, step = 0, inf, n, ZERO
    while True:
        g1, g2 = stretch_by_squares(axes1, squares1, n), stretch_by_squares(axes2, squares2, n)
        s1, s2 = sqrt(dot(g1, n)), sqrt(dot(g2, n))
        h = s1 + s2 - dot(n, centre_line)
        if h <= 0.0:
            # A plane perpendicular to n separates the ellipsoids.
            return h, 0.0, ZERO, ZERO
        tries += 1
        # The tolerance of 1e-12 lets rounding near the minimum pass. 100 evaluations bound the
        # search.
        if h > least * (1.0 + 1e-12) and tries < 100:
            # The step is too long: halve it.
            step = times(0.5, step)
            n = plus(best_normal, step)
            n = divide(n, norm(n))
            continue
        least, best_normal = h, n
        g1, g2 = divide(g1, s1), divide(g2, s2)
        u, v = make_perpendiculars(n)
        gu1, gv1, huu1, huv1, hvv1 = differentiate_support(axes1, squares1, g1, s1, u, v)
        gu2, gv2, huu2, huv2, hvv2 = differentiate_support(axes2, squares2, g2, s2, u, v)
        # Gradient of the overlap along u and v.
        fu, fv = gu1 + gu2 - dot(centre_line, u), gv1 + gv2 - dot(centre_line, v)
        if fu * fu + fv * fv <= 1e-26 * (s1 + s2) * (s1 + s2) or tries >= 100:
            break
        # Second derivatives on the unit sphere: n turns, so h itself is subtracted on the diagonal.
        huu = huu1 + huu2 - h
        huv = huv1 + huv2
        hvv = hvv1 + hvv2 - h
        if huu <= 0.0 or huu * hvv - huv * huv <= 0.0:
            # At deep overlap the Hessian is indefinite; without its negative part it is positive.
            huu += h
            hvv += h
        determinant = huu * hvv - huv * huv
        # Newton's step along u and v: the inverse of a symmetric 2 x 2 matrix by its determinant.
        step = add_scaled(
            times((huv * fv - hvv * fu) / determinant, u), (huv * fu - huu * fv) / determinant, v
        )
        n = plus(best_normal, step)
        n = divide(n, norm(n))
    # The determinants are the inverse Gaussian curvatures of both surfaces; the relative curvature
    # follows from their sum.
    first_determinant, second_determinant = huu1 * hvv1 - huv1 * huv1, huu2 * hvv2 - huv2 * huv2
    huv = huv1 + huv2
    R = sqrt(first_determinant * second_determinant / ((huu1 + huu2) * (hvv1 + hvv2) - huv * huv))
    return h, R, n, add_scaled(plus(c1, g1), -a * h, n)


def stretch_by_squares(axes: Axes, squares: Vector, x: Vector) -> Vector:
    """Return B x, where the matrix B has the axes of an ellipsoid and the squares of its half axes.

    s = sqrt(n B n) is the distance to the tangent plane perpendicular to n, and B n / s leads to the
    point where it touches.

    Args:
        axes: axes of the ellipsoid.
        squares: squares of the half axes (m²).
        x: vector.
    """
    x_axis, y_axis, z_axis = axes
    p, q, r = squares
    return add_scaled(
        add_scaled(times(p * dot(x_axis, x), x_axis), q * dot(y_axis, x), y_axis),
        r * dot(z_axis, x),
        z_axis,
    )


def make_perpendiculars(n: Vector) -> tuple[Vector, Vector]:
    """Return unit vectors u and v that are perpendicular to the unit vector n and each other.

    Returns:
        u and v.
    """
    nx, ny, nz = n
    # Cross n with the axis from which it deviates clearly; 0.6 is above 1 / sqrt(3).
    u = (0.0, nz, -ny) if abs(nx) < 0.6 else (-nz, 0.0, nx)
    u = divide(u, norm(u))
    return u, cross(n, u)


def differentiate_support(
    axes: Axes, squares: Vector, g: Vector, s: float, u: Vector, v: Vector
) -> tuple[float, float, float, float, float]:
    """Return first and second derivatives of s = sqrt(n B n) as n turns towards u and v.

    Args:
        axes: axes of the ellipsoid, whose B is that of `stretch_by_squares`.
        squares: squares of the half axes (m²).
        g: gradient of s, B n / s (m).
        s: distance (m).
        u: unit vector perpendicular to n.
        v: unit vector perpendicular to n and u.

    Returns:
        (gu, gv, huu, huv, hvv), m.
    """
    gu, gv = dot(g, u), dot(g, v)
    bu, bv = stretch_by_squares(axes, squares, u), stretch_by_squares(axes, squares, v)
    return (
        gu,
        gv,
        (dot(bu, u) - gu * gu) / s,
        (dot(bu, v) - gu * gv) / s,
        (dot(bv, v) - gv * gv) / s,
    )
