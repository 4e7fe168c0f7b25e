"""Where to look for a better pose than the one that the way down has led to."""

from __future__ import annotations

from math import floor, inf, pi

from osimlite.mechanics.kernels.layout import GRAVITY_AT, LINK, MODEL
from osimlite.mechanics.kernels.pointers import Floats, at, copy
from osimlite.mechanics.kernels.points import link_ints
from osimlite.mechanics.kernels.pose_constraints import settle
from osimlite.mechanics.kernels.pose_cost import cost, look
from osimlite.mechanics.kernels.pose_record import (
    AT_END,
    RANGES_AT,
    RESOLVED_AT,
    TRIAL,
    VARIABLE,
    Fit,
)
from osimlite.mechanics.laws.vectors import dot, vector

INWARDS = 0.3
"""How far from the ends of their ranges coordinates begin when a better pose is looked for (rad or m)."""
ROUND = 0.75 * pi
"""By how much the first pose is turned in ground, to either side, when a better one is looked for
(rad): a range may reach to just before half a turn.
"""
SAME = 1e-9
"""How near to an end of its range what is there may be (rad or m)."""


def move_inwards(m: Fit, from_pose: Floats, start: Floats, inwards: float) -> None:
    """A pose in which no clamped coordinate is near an end of its range."""
    ranges = at(m.c, m.p[RANGES_AT])
    for k in range(m.model[MODEL.DOFS]):
        low, high, start[k] = ranges[2 * k], ranges[2 * k + 1], from_pose[k]
        if low < high:
            inner = min(inwards, 0.5 * (high - low))
            start[k] = min(max(start[k], low + inner), high - inner)


def turn_round(m: Fit, from_pose: Floats, start: Floats, freedom: int, angle: float) -> bool:
    """A pose in which what a joint to ground carries is turned about the vertical; false if this is no such coordinate.

    Subjects walk to and fro, and the way down from half a turn away may lead elsewhere.
    """
    model, p, ranges = m.model, m.p, at(m.c, m.p[RANGES_AT])
    move_inwards(m, from_pose, start, 2.0 * INWARDS)
    start[freedom] += angle
    is_inside = ranges[2 * freedom] <= start[freedom] <= ranges[2 * freedom + 1]
    if not (
        joint_to_ground(m, freedom) >= 0
        and is_inside
        and p[p[RESOLVED_AT] + freedom] in (VARIABLE, AT_END)
    ):
        return False
    look(m, from_pose)
    down, turn = (
        vector(m.reals, GRAVITY_AT),
        vector(at(m.data, model[MODEL.WORK_COLUMN]), 6 * freedom),
    )
    return dot(turn, turn) > 0.0 and 2.0 * dot(turn, down) ** 2 >= dot(turn, turn) * dot(down, down)


def joint_to_ground(m: Fit, freedom: int) -> int:
    """The link whose joint to ground has this degree of freedom, or -1 if it is of another joint."""
    model, result = m.model, -1
    for link in range(model[MODEL.LINKS]):
        j = link_ints(model, link)
        if j[LINK.PARENT] < 0 and j[LINK.FIRST_DOF] <= freedom < j[LINK.END_DOF]:
            result = link
    return result


def is_angle(m: Fit, freedom: int) -> bool:
    """Whether a degree of freedom turns anything in the pose that was looked at last, and may change."""
    turn, mark = (
        vector(at(m.data, m.model[MODEL.WORK_COLUMN]), 6 * freedom),
        m.p[m.p[RESOLVED_AT] + freedom],
    )
    return dot(turn, turn) > 0.0 and mark in (VARIABLE, AT_END)


def is_at_end(m: Fit, y: Floats, freedom: int) -> bool:
    """Whether what may change is at one end of its range, and not at the other."""
    ranges = at(m.c, m.p[RANGES_AT])
    low, high = ranges[2 * freedom], ranges[2 * freedom + 1]
    return high - low < inf and (y[freedom] <= low + SAME) != (y[freedom] >= high - SAME)


def go_round(m: Fit, y: Floats, start: Floats, freedom: int) -> bool:
    """A pose in which an angle at one end of its range is a whole turn on, or at the other end; false if it is at none.

    Who turns on the spot comes round. Other joints than those to ground do only if their ranges
    leave out little.
    """
    ranges = at(m.c, m.p[RANGES_AT])
    low, high = ranges[2 * freedom], ranges[2 * freedom + 1]
    if not is_at_end(m, y, freedom) or not (
        high - low > pi + SAME or joint_to_ground(m, freedom) >= 0
    ):
        return False
    copy(m.model[MODEL.DOFS], y, start)
    start[freedom] = (
        min(high, low + 2.0 * pi) if y[freedom] <= low + SAME else max(low, high - 2.0 * pi)
    )
    look(m, y)
    return is_angle(m, freedom)


def turn_over(m: Fit, y: Floats, start: Floats, freedom: int) -> bool:
    """A pose in which the two other angles of a joint to ground are half a turn on, while this one is at an end.

    Where the second of three angles is at 90 degrees that is the same pose, and the way on for who
    turns head over
    heels: the second angle goes back from there.
    """
    link, others = joint_to_ground(m, freedom), 0
    if link < 0 or not is_at_end(m, y, freedom):
        return False
    copy(m.model[MODEL.DOFS], y, start)
    look(m, y)
    j, ranges = link_ints(m.model, link), at(m.c, m.p[RANGES_AT])
    for k in range(j[LINK.FIRST_DOF], j[LINK.END_DOF]):
        if k != freedom and is_angle(m, k):
            others += 1
            start[k] = y[k] - pi if y[k] - pi >= ranges[2 * k] else y[k] + pi
            if start[k] > ranges[2 * k + 1]:
                return False
    return others == 2 and is_angle(m, freedom)


def leave_ends(m: Fit, y: Floats, start: Floats) -> bool:
    """A pose in which what is at an end of its range is not; false if there is nothing."""
    ranges, result = at(m.c, m.p[RANGES_AT]), False
    for k in range(m.model[MODEL.DOFS]):
        low, high, start[k] = ranges[2 * k], ranges[2 * k + 1], y[k]
        if m.p[m.p[RESOLVED_AT] + k] == AT_END and low < high:
            inwards = min(INWARDS, 0.5 * (high - low))
            start[k], result = low + inwards if y[k] <= low else high - inwards, True
    return result


def unwind(m: Fit, y: Floats, first: Floats, start: Floats, value: float) -> bool:
    """A pose without the whole turns that the way from the first one has led to, if it costs no more."""
    size, ranges, trial, result = (
        m.model[MODEL.DOFS],
        at(m.c, m.p[RANGES_AT]),
        at(m.v, m.p[TRIAL]),
        False,
    )
    copy(size, y, start)
    for k in range(size):
        turns = floor((y[k] - first[k]) / (2.0 * pi) + 0.5)
        near = y[k] - 2.0 * pi * turns
        if turns != 0.0 and ranges[2 * k] <= near <= ranges[2 * k + 1]:
            copy(size, start, trial)
            trial[k] = near
            if settle(m, trial) and cost(m, trial) <= value * (1.0 + 1e-9) + 1e-20:
                copy(size, trial, start)
                result = True
    return result
