"""Coordinate limit force: a spring and a damper that act beyond the limits of a coordinate.

Stiffness and damping grow from zero at the limit to their full value a transition zone beyond it,
along the quintic S(x) = 10 x^3 - 15 x^4 + 6 x^5. q is the coordinate, u its speed, Q the
generalized force on it. Source of the formulas: OpenSim's CoordinateLimitForce and Simbody's step
function; the energy is the integral of the spring force.
"""

from __future__ import annotations

from math import pi


def limit_constants(
    upper_stiffness: float,
    upper_limit: float,
    lower_stiffness: float,
    lower_limit: float,
    damping: float,
    transition: float,
    rotational: bool,
) -> tuple[float, float, float, float, float, float]:
    """Return the parameters of the law in SI units from the properties in a file.

    Args:
        upper_stiffness: stiffness beyond the upper limit, N m/deg for a rotational coordinate, else
            N/m (N m/rad for a coupled one).
        upper_limit: upper limit, deg for a rotational coordinate, else m (rad).
        lower_stiffness: stiffness beyond the lower limit, in the unit of `upper_stiffness`.
        lower_limit: lower limit, in the unit of `upper_limit`.
        damping: damping, N m/(deg/s) for a rotational coordinate, else N/(m/s) (N m/(rad/s)).
        transition: width of the transition zone, deg for a rotational coordinate, else m (rad).
        rotational: whether the motion type of the coordinate is Rotational; Translational and Coupled
            are not converted.

    Returns:
        (Ku, qu, Kl, ql, D, t) in rad and N m, or m and N, as the functions below take them.
    """
    # Stiffness and damping are per degree in the file, so they are divided by the factor that
    # limits are multiplied with.
    w = pi / 180.0 if rotational else 1.0
    return (
        upper_stiffness / w,
        w * upper_limit,
        lower_stiffness / w,
        w * lower_limit,
        damping / w,
        w * transition,
    )


def limit_force(
    q: float, u: float, Ku: float, qu: float, Kl: float, ql: float, D: float, t: float
) -> float:
    """Return the generalized force Q on the coordinate, in N m (N for a translation).

    Q = -su (Ku (q - qu) + D u) + sl (Kl (ql - q) - D u), with su = S((q - qu) / t) and sl = S((ql - q)
    / t). While the coordinate moves back inwards fast, the damper may outweigh the spring and pull
    outwards.

    Args:
        q: coordinate, rad (m).
        u: speed of the coordinate, rad/s (m/s).
        Ku: stiffness beyond the upper limit, N m/rad (N/m). With stiffness 0 the damper still acts;
            OpenSim 4.6 divides 0 by 0 there.
        qu: upper limit, rad (m).
        Kl: stiffness beyond the lower limit, N m/rad (N/m).
        ql: lower limit, rad (m). Where ql > qu, both sides act between them.
        D: damping, N m/(rad/s) (N/(m/s)).
        t: width of the transition zone, rad (m). Where it is 0 or less, S jumps from 0 to 1 at the
            limit.
    """
    if ql <= q <= qu:
        return 0.0
    # With crossed limits (ql > qu) both sides can act at once, hence two separate conditions.
    Q = 0.0
    if q > qu:
        delta = q - qu
        # S(x) = x^3 (10 - 15 x + 6 x^2) in Horner form; it starts and ends with zero slope and
        # curvature.
        if delta < t:
            x = delta / t
            Q -= x * x * x * (10.0 + x * (6.0 * x - 15.0)) * (Ku * delta + D * u)
        else:
            Q -= Ku * delta + D * u
    if q < ql:
        delta = ql - q
        if delta < t:
            x = delta / t
            Q += x * x * x * (10.0 + x * (6.0 * x - 15.0)) * (Kl * delta - D * u)
        else:
            Q += Kl * delta - D * u
    return Q


def limit_dissipation(q: float, u: float, qu: float, ql: float, D: float, t: float) -> float:
    """Return the power (su + sl) D u^2 that the damper dissipates (W).

    The factors su and sl are those of `limit_force`.

    Args:
        q: coordinate, rad (m).
        u: speed of the coordinate, rad/s (m/s).
        qu: upper limit, rad (m).
        ql: lower limit, rad (m).
        D: damping, N m/(rad/s) (N/(m/s)).
        t: width of the transition zone, rad (m).
    """
    # Without stiffness the law leaves only the damper, whose power on the coordinate is u Q.
    return -u * limit_force(q, u, 0.0, qu, 0.0, ql, D, t)


def limit_energy(q: float, Ku: float, qu: float, Kl: float, ql: float, t: float) -> float:
    """Return the potential energy of the spring (J).

    It is K (delta^2 / 2 - t^2 / 7) at a distance delta >= t beyond the limit, and K delta^2 x^3 (2
    - 5 x / 2 + 6 x^2 / 7) with x = delta / t before. Where ql > qu, both springs act between the
    limits, but the energy is that of the upper one alone, as OpenSim reports it.

    Args:
        q: coordinate, rad (m).
        Ku: stiffness beyond the upper limit, N m/rad (N/m).
        qu: upper limit, rad (m).
        Kl: stiffness beyond the lower limit, N m/rad (N/m).
        ql: lower limit, rad (m).
        t: width of the transition zone, rad (m).
    """
    if q > qu:
        K = Ku
        delta = q - qu
    elif q < ql:
        K = Kl
        delta = ql - q
    else:
        return 0.0
    if delta < t:
        x = delta / t
        return K * delta * delta * x * x * x * (2.0 + x * (6.0 / 7.0 * x - 2.5))
    # Beyond the zone the spring is linear; t^2 / 7 is what the weaker zone stores less.
    if t > 0.0:
        return K * (0.5 * delta * delta - t * t / 7.0)
    return K * 0.5 * delta * delta
