"""Accelerations from the mass matrix and the bias of another program, whose joints have one axis each.

The joints follow the coordinates; with the generalized speeds u their rates are J u, and their accelerations
J udot + b. So the equations of motion of the coordinates are those of the joints, projected: the mass matrix is Jᵀ M J,
and the bias is Jᵀ of the forces that the joints need at accelerations b. An entry of J that may differ from zero is a
share.
"""

from __future__ import annotations

from osimlite.forces.vectors import ZERO, cross, dot, put, replaced, times, vector
from osimlite.simulation.kernels.ball_joint import angle_drift, angle_row, last_axis
from osimlite.simulation.kernels.layout import (
    ABOVE,
    ACCELERATION,
    AMOUNT,
    AMOUNT_OF,
    ANGLE,
    ARGUMENT_COUNT,
    ARGUMENTS,
    AXIS,
    CHAIN,
    CURVATURE,
    ELLIPSOID,
    END_ENTRY,
    ENTRY_AT,
    EXCESS_AT,
    EXCESSES,
    EXTRA,
    FIRST_SHARE,
    FREEDOM_AT,
    FREEDOM_INTS,
    FREEDOMS,
    GRADIENT,
    JOINT_AT,
    JOINT_INTS,
    JOINTS,
    KIND,
    LINE,
    LINK_WORK,
    OK,
    OPERATION_AT,
    OPERATION_INTS,
    OPERATION_WORK,
    PART,
    PRODUCT_AT,
    PRODUCTS,
    RATE,
    ROW,
    SHARE_AT,
    SHARES,
    SOURCE,
    SUPPLY,
    WORK_COLUMN,
    WORK_JOINTS,
    WORK_LINK,
    WORK_OPERATION,
    WORK_SHARES,
)
from osimlite.simulation.kernels.pointers import Floats, Ints, at, call


def chain_dynamics(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, unused: int) -> int:
    """Mass matrix, and the bias taken off the generalized forces; f has the rates and these before."""
    h, right = at(s, s[CHAIN]), at(f, s[FREEDOMS])
    move_joints(s, x, w, y, f)
    status = call(h[SUPPLY], s, x, w, y, f, 0)
    if status != OK:
        return status
    forces, shares = at(w, h[WORK_JOINTS] + 3 * h[JOINTS]), at(w, h[WORK_SHARES])
    matrix = at(forces, h[JOINTS])
    for k in range(h[SHARES]):
        joint, freedom = s[h[SHARE_AT] + 2 * k], s[h[SHARE_AT] + 2 * k + 1]
        if freedom >= 0:
            right[freedom] -= shares[k] * forces[joint]
    for k in range(h[ENTRY_AT], h[END_ENTRY]):
        w[k] = 0.0
    for k in range(h[PRODUCTS]):
        product = at(s, h[PRODUCT_AT] + 4 * k)
        w[product[3]] += shares[product[0]] * shares[product[1]] * matrix[product[2]]
    for k in range(h[EXCESSES]):
        excess = at(s, h[EXCESS_AT] + 3 * k)
        take_off(s, w, x[excess[2]], excess[1], at(w, s[WORK_LINK] + LINK_WORK * excess[0] + ACCELERATION), right)
    return OK


def take_off(s: Ints, w: Floats, moment: float, freedom: int, acceleration: Floats, right: Floats) -> None:
    """Take an inertia off that is the same about every axis, so that no speed alone makes it resist.

    Args:
        s: the mechanism.
        w: what is known of it.
        moment: the inertia.
        freedom: the last one on the way from ground to the link that has it.
        acceleration: of the link without udot.
        right: the generalized forces.
    """
    freedoms, columns = at(s, s[FREEDOM_AT]), at(w, s[WORK_COLUMN])
    while freedom >= 0:
        a, row, other, place = at(columns, 6 * freedom), at(w, freedoms[FREEDOM_INTS * freedom + ROW]), freedom, 0
        right[freedom] += moment * (a[0] * acceleration[0] + a[1] * acceleration[1] + a[2] * acceleration[2])
        while other >= 0:
            b = at(columns, 6 * other)
            row[place] -= moment * (a[0] * b[0] + a[1] * b[1] + a[2] * b[2])
            other = freedoms[FREEDOM_INTS * other + ABOVE]
            place += 1
        freedom = freedoms[FREEDOM_INTS * freedom + ABOVE]


def move_joints(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats) -> None:
    """Values, rates, and accelerations without udot of all joints, and the shares; f has the rates of coordinates."""
    h = at(s, s[CHAIN])
    count = h[JOINTS]
    for number in range(count):
        joint, moves = at(s, h[JOINT_AT] + JOINT_INTS * number), at(w, h[WORK_JOINTS] + number)
        kind, source, part, shares = joint[KIND], joint[SOURCE], joint[PART], at(w, h[WORK_SHARES] + joint[FIRST_SHARE])
        if kind == LINE:
            factor = x[part]
            shares[0] = factor
            moves[0], moves[count], moves[2 * count] = factor * y[source], factor * f[source], 0.0
            continue
        j = at(s, s[OPERATION_AT] + OPERATION_INTS * source)
        a = at(w, s[WORK_OPERATION] + OPERATION_WORK * source)
        if kind == AMOUNT_OF:
            for k in range(j[ARGUMENT_COUNT]):
                shares[k] = w[j[GRADIENT] + k]
            moves[0], moves[count], moves[2 * count] = a[AMOUNT], a[RATE], a[CURVATURE]
        elif kind == ANGLE:
            angles = at(s, j[ARGUMENTS])
            moves[0], moves[count] = y[angles[part]], f[angles[part]]
            moves[2 * count] = move_angle(angles, y, f, part, shares)
        elif kind == ELLIPSOID:
            moves[0], moves[count], moves[2 * count] = move_end(
                at(s, j[ARGUMENTS]), y, at(y, s[FREEDOMS]), part, x[j[EXTRA] + part], shares
            )
        else:
            # The joint stands still, and accelerates all the same.
            turn = at(a, AXIS + part)
            moves[0] = moves[count] = 0.0
            moves[2 * count] = turn[0] * a[AMOUNT] + turn[3] * a[RATE] + turn[6] * a[CURVATURE]


def move_angle(angles: Ints, y: Floats, f: Floats, part: int, row: Floats) -> float:
    """Acceleration of one angle of a ball without udot; fills its row."""
    put(row, 0, angle_row(y, angles, part))
    return angle_drift(y, f, angles, vector(row, 0))


def move_end(angles: Ints, y: Floats, u: Floats, part: int, radius: float, row: Floats) -> tuple[float, float, float]:
    """Value, rate and acceleration without udot of a component of r n, n the last axis of a ball; fills its row."""
    n, spin = last_axis(y, angles), (u[angles[0]], u[angles[1]], u[angles[2]])
    # n moves by u x n, and that by u x (u x n).
    put(row, 0, times(radius, cross(n, replaced(ZERO, part, 1.0))))
    own = spin[part] * dot(spin, n) - n[part] * dot(spin, spin)
    return radius * n[part], dot(vector(row, 0), spin), radius * own
