"""How large steps are: Simbody's rules for the error of a step and the size of the next one."""

from __future__ import annotations

from math import inf, isfinite

PATIENCE = 10_000
"""Steps that may be tried before a motion that gets nowhere is given up."""


def shortest_step(t: float, tried: float) -> float:
    """The shortest step to take at a time t (s) after so many that were tried.

    As in Simbody, the first steps from 0 may be of any length. OpenSim goes on with such steps for
    ever; here they end.
    """
    return max(2.0**-52 * abs(t), 1e-300) if tried < PATIENCE else 4.0 * 2.0**-52 * max(1.0, abs(t))


def weight(value: float) -> float:
    """What the error of a speed or an auxiliary state counts that has this value at the start of the step."""
    return 1.0 / abs(value) if abs(value) > 1.0 else 1.0


def next_step_size(h: float, error: float, accuracy: float, cut: bool, order: float) -> float:
    """Step to try after one of size h, as Simbody chooses it; less than h if and only if error > accuracy.

    The estimated error goes with a power of h, so 0.9 h (accuracy / error)^(1/order) should just
    do. That is taken if it is at least a fifth more or, after a failure, a tenth less; never more
    than five times or less than a tenth of h.

    Args:
        h: step just tried, s.
        error: norm of its estimated error; infinite or not a number after a failed evaluation.
        accuracy: what the error may be.
        cut: whether the step was cut short by a limit, so that it is no ground for a larger one.
        order: of the error.
    """
    if not isfinite(error):
        return 0.1 * h
    if error > accuracy:
        wanted: float = 0.9 * h * (accuracy / error) ** (1.0 / order)
        return max(min(wanted, 0.9 * h), 0.1 * h)
    wanted = 0.9 * h * (accuracy / error) ** (1.0 / order) if error > 0.0 else inf
    return h if cut or wanted < 1.2 * h else min(wanted, 5.0 * h)
