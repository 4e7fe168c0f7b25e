"""Other starts of the search for a better pose than the one that a descent found."""

from __future__ import annotations

from math import floor, inf, pi

from osimlite.mechanics.kernels.layout import LINK, MODEL, REALS
from osimlite.mechanics.kernels.pointers import Floats, at, copy_numbers
from osimlite.mechanics.kernels.points import link_ints
from osimlite.mechanics.kernels.pose_constraints import fulfil_constraints
from osimlite.mechanics.kernels.pose_cost import evaluate_cost, evaluate_pose
from osimlite.mechanics.kernels.pose_record import FIT, FREEDOM, Fit
from osimlite.mechanics.laws.vectors import dot, vector

RANGE_MARGIN = 0.3
"""Distance of coordinates from the ends of their ranges at another start (rad or m)."""
START_ROTATION_RAD = 0.75 * pi
"""Angle by which the first pose is turned in ground, either way (rad).

A range may end just before half a turn.
"""
RANGE_END_TOLERANCE = 1e-9
"""Distance from an end of a range below which a coordinate counts as at the end (rad or m)."""


def start_away_from_ends(m: Fit, from_pose: Floats, start: Floats, inwards: float) -> None:
    """Write a start in which no coordinate with a range is near an end of it.

    Args:
        m: inputs and workspace of the fit.
        from_pose: pose from which the start is made (n,).
        start: filled with the start (n,).
        inwards: distance from the ends, at most half of the range (rad or m).
    """
    ranges = at(m.c, m.p[FIT.RANGES_AT])
    for k in range(m.model[MODEL.DOFS]):
        low, high, start[k] = ranges[2 * k], ranges[2 * k + 1], from_pose[k]
        if low < high:
            # A range narrower than twice the distance leaves its middle only.
            inner = min(inwards, 0.5 * (high - low))
            start[k] = min(max(start[k], low + inner), high - inner)


def start_rotated_subtree(
    m: Fit, from_pose: Floats, start: Floats, freedom: int, angle: float
) -> bool:
    """Write a start in which the subtree of a joint to ground is turned about the vertical.

    Subjects walk in both directions, and a descent from half a turn away may end elsewhere.

    Args:
        m: inputs and workspace of the fit.
        from_pose: pose to start from.
        start: filled with the start (n,).
        freedom: degree of freedom of the turn.
        angle: angle of the turn (rad).

    Returns:
        Whether the degree of freedom is such a coordinate.
    """
    model = m.model
    p = m.p
    ranges = at(m.c, m.p[FIT.RANGES_AT])
    start_away_from_ends(m, from_pose, start, 2.0 * RANGE_MARGIN)
    start[freedom] += angle
    is_inside = ranges[2 * freedom] <= start[freedom] <= ranges[2 * freedom + 1]
    if not (
        joint_to_ground(m, freedom) >= 0
        and is_inside
        and p[p[FIT.RESOLVED_AT] + freedom] in (FREEDOM.VARIABLE, FREEDOM.AT_END)
    ):
        return False
    # The axis of the turn depends on the pose, unless it is the first of its joint.
    evaluate_pose(m, from_pose)
    down = vector(m.reals, REALS.GRAVITY)
    turn = vector(at(m.data, model[MODEL.WORK_COLUMN]), 6 * freedom)
    # The axis is within 45 degrees of the vertical.
    return dot(turn, turn) > 0.0 and 2.0 * dot(turn, down) ** 2 >= dot(turn, turn) * dot(down, down)


def joint_to_ground(m: Fit, freedom: int) -> int:
    """Return the link whose joint to ground has a degree of freedom, or -1.

    Args:
        m: inputs and workspace of the fit.
        freedom: degree of freedom.
    """
    model, result = m.model, -1
    for link in range(model[MODEL.LINKS]):
        j = link_ints(model, link)
        if j[LINK.PARENT] < 0 and j[LINK.FIRST_DOF] <= freedom < j[LINK.END_DOF]:
            result = link
    return result


def is_angle(m: Fit, freedom: int) -> bool:
    """Return whether a free degree of freedom turns anything in the pose that was evaluated last.

    Args:
        m: inputs and workspace of the fit.
        freedom: degree of freedom.
    """
    # The first half of the column is the angular velocity of the bodies per unit speed; it is 0 for
    # a translation.
    turn = vector(at(m.data, m.model[MODEL.WORK_COLUMN]), 6 * freedom)
    mark = m.p[m.p[FIT.RESOLVED_AT] + freedom]
    return dot(turn, turn) > 0.0 and mark in (FREEDOM.VARIABLE, FREEDOM.AT_END)


def is_at_end(m: Fit, y: Floats, freedom: int) -> bool:
    """Return whether a coordinate is at exactly one end of a finite range.

    Args:
        m: inputs and workspace of the fit.
        y: state.
        freedom: degree of freedom.
    """
    ranges = at(m.c, m.p[FIT.RANGES_AT])
    low = ranges[2 * freedom]
    high = ranges[2 * freedom + 1]
    # A coordinate whose range is a single value is at both ends, and has no other start.
    return high - low < inf and (y[freedom] <= low + RANGE_END_TOLERANCE) != (
        y[freedom] >= high - RANGE_END_TOLERANCE
    )


def start_full_turn(m: Fit, y: Floats, start: Floats, freedom: int) -> bool:
    """Write a start in which an angle at an end of its range is a full turn further.

    If the range does not contain that, it is at the other end.

    A subject that turns on the spot makes full turns. Other joints than those to ground do so only if
    their ranges omit little.

    Args:
        m: inputs and workspace of the fit.
        y: state of the best pose so far.
        start: filled with the start (n,).
        freedom: degree of freedom.

    Returns:
        Whether the degree of freedom is such an angle.
    """
    ranges = at(m.c, m.p[FIT.RANGES_AT])
    low = ranges[2 * freedom]
    high = ranges[2 * freedom + 1]
    if not is_at_end(m, y, freedom) or not (
        high - low > pi + RANGE_END_TOLERANCE or joint_to_ground(m, freedom) >= 0
    ):
        return False
    copy_numbers(m.model[MODEL.DOFS], y, start)
    start[freedom] = (
        min(high, low + 2.0 * pi)
        if y[freedom] <= low + RANGE_END_TOLERANCE
        else max(low, high - 2.0 * pi)
    )
    evaluate_pose(m, y)
    return is_angle(m, freedom)


def start_upside_down(m: Fit, y: Floats, start: Floats, freedom: int) -> bool:
    """Write a start with the two other angles of a joint to ground half a turn further.

    Where the second of three angles is a right angle this is the same pose, and the continuation of a
    motion head over heels: the second angle goes back from there.

    Args:
        m: inputs and workspace of the fit.
        y: state of the best pose so far.
        start: filled with the start (n,).
        freedom: degree of freedom of the second angle.

    Returns:
        Whether the degree of freedom is at an end of its range and such angles exist.
    """
    link = joint_to_ground(m, freedom)
    other_angles = 0
    if link < 0 or not is_at_end(m, y, freedom):
        return False
    copy_numbers(m.model[MODEL.DOFS], y, start)
    evaluate_pose(m, y)
    j = link_ints(m.model, link)
    ranges = at(m.c, m.p[FIT.RANGES_AT])
    for k in range(j[LINK.FIRST_DOF], j[LINK.END_DOF]):
        if k != freedom and is_angle(m, k):
            other_angles += 1
            # Half a turn in either direction; ranges may allow only one of them.
            start[k] = y[k] - pi if y[k] - pi >= ranges[2 * k] else y[k] + pi
            if start[k] > ranges[2 * k + 1]:
                return False
    return other_angles == 2 and is_angle(m, freedom)


def start_inside_ranges(m: Fit, y: Floats, start: Floats) -> bool:
    """Write a start in which coordinates at ends of their ranges are inside.

    Args:
        m: inputs and workspace of the fit.
        y: state of the best pose so far.
        start: filled with the start (n,).

    Returns:
        Whether there are such coordinates.
    """
    ranges = at(m.c, m.p[FIT.RANGES_AT])
    result = False
    for k in range(m.model[MODEL.DOFS]):
        low, high, start[k] = ranges[2 * k], ranges[2 * k + 1], y[k]
        # The descent marks coordinates that it stopped at an end of their range.
        if m.p[m.p[FIT.RESOLVED_AT] + k] == FREEDOM.AT_END and low < high:
            inwards = min(RANGE_MARGIN, 0.5 * (high - low))
            start[k], result = low + inwards if y[k] <= low else high - inwards, True
    return result


def remove_full_turns(m: Fit, y: Floats, first: Floats, start: Floats, value: float) -> bool:
    """Write a pose without the full turns that were made from the first one, if it costs no more.

    Args:
        m: inputs and workspace of the fit.
        y: state of the best pose.
        first: pose that the search started from (n,).
        start: filled with the pose (n,).
        value: cost of the best pose.

    Returns:
        Whether a full turn was removed.
    """
    size = m.model[MODEL.DOFS]
    ranges = at(m.c, m.p[FIT.RANGES_AT])
    trial = at(m.v, m.p[FIT.TRIAL])
    result = False
    copy_numbers(size, y, start)
    for k in range(size):
        # Rounding to the nearest integer by floor is the same in all languages of the kernels.
        turn_count = floor((y[k] - first[k]) / (2.0 * pi) + 0.5)
        reduced_value = y[k] - 2.0 * pi * turn_count
        if turn_count != 0.0 and ranges[2 * k] <= reduced_value <= ranges[2 * k + 1]:
            copy_numbers(size, start, trial)
            trial[k] = reduced_value
            # Only rounding may raise the cost, by a relative amount or, if it is almost 0, an
            # absolute one.
            if (
                fulfil_constraints(m, trial)
                and evaluate_cost(m, trial) <= value * (1.0 + 1e-9) + 1e-20
            ):
                copy_numbers(size, trial, start)
                result = True
    return result
