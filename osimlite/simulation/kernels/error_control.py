"""How large the error of a step is, and where constraints hold: what all integrators judge a step by."""

from __future__ import annotations

from math import inf, isfinite, sqrt

from osimlite.simulation.integrators import weight
from osimlite.simulation.kernels.layout import CONSTRAINED, FREEDOMS, LAWS, OK, PROJECT, SCRATCH, STATE_SIZE, TIME
from osimlite.simulation.kernels.pointers import Floats, Ints, call


def projected(
    s: Ints, x: Floats, w: Floats, t: float, y: Floats, off: Floats, has_errors: int, tolerance: float, limit: float
) -> bool:
    """Move a state to where the constraints hold, and tell whether they do; see `projection.project`."""
    w[TIME], w[SCRATCH], w[SCRATCH + 1] = t, tolerance, limit
    return call(s[LAWS + s[s[CONSTRAINED] + PROJECT]], s, x, w, y, off, has_errors) == OK


def projected_error(
    s: Ints,
    x: Floats,
    w: Floats,
    t: float,
    y0: Floats,
    y1: Floats,
    errors: Floats,
    accuracy: float,
    count_q: int,
    count_u: int,
    is_strict: int,
) -> float:
    """Move the end of a step to where the constraints hold; the norm of the error there."""
    tolerance = accuracy / 10.0
    for k in range(s[STATE_SIZE]):
        errors[k] = abs(errors[k])
    if not projected(s, x, w, t, y1, errors, 1, tolerance, max(2.0 * tolerance, sqrt(tolerance))):
        return inf
    return error_norm(s, y0, errors, count_q, count_u, is_strict)


def error_norm(s: Ints, y0: Floats, errors: Floats, count_q: int, count_u: int, is_strict: int) -> float:
    """Largest of three root mean squares: errors of q as they are, of u and z relative to y0 where |y0| > 1.

    That is Simbody's norm. A fiber among those of many muscles can err much in it. An explicit method brings such a one
    back, since it has to take short steps; implicit ones may not, and are strict: of z, the largest error counts.

    Args:
        s: the mechanism.
        y0: state at the start of the step.
        errors: of its end.
        count_q: what the sum of the squares of q is divided by.
        count_u: what that of u is divided by.
        is_strict: whether the largest error of z counts.
    """
    n, size = s[FREEDOMS], s[STATE_SIZE]
    of_q = of_u = of_z = 0.0
    for k in range(n):
        of_q += errors[k] * errors[k]
    for k in range(n, 2 * n):
        weighted = weight(y0[k]) * errors[k]
        of_u += weighted * weighted
    for k in range(2 * n, size):
        weighted = weight(y0[k]) * errors[k]
        square = weighted * weighted
        of_z = max(of_z, square) if is_strict else of_z + square
    of_q /= max(count_q, 1)
    of_u /= max(count_u, 1)
    if not is_strict:
        of_z /= max(size - 2 * n, 1)
    return sqrt(max(of_q, of_u, of_z)) if isfinite(of_q + of_u + of_z) else inf
