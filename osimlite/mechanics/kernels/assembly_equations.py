"""Equations of the assembly of poses: their integers and numbers, errors, rows and factor."""

from __future__ import annotations

from math import inf, sqrt
from typing import NamedTuple

from osimlite.mechanics.kernels.constrained_dynamics import evaluate_constraints
from osimlite.mechanics.kernels.layout import CONSTRAINED, MODEL, STAGE, Record
from osimlite.mechanics.kernels.linear_algebra import (
    REDUNDANCY_TOLERANCE,
    ROUNDING,
    factorise_equations,
)
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, call, copy_numbers, is_finite
from osimlite.mechanics.kernels.projection import collect_position_errors, write_position_jacobian

# Integers: the head; three arrays (n,) about the degrees of freedom; workspace for a list of free
# ones (n,); per coupler the dependent degree of freedom and the number of its equation.


class ASSEMBLY(metaclass=Record):
    """Head of the integers of an assembly."""

    MOVES_LINKS = 0
    """1 if the equations need positions of links, 0 if they need coordinates only."""
    COUPLERS = 1
    """Number of couplers."""
    HEAD = 2
    """Length of the head."""


class ASSEMBLY_ARRAY(metaclass=Record):
    """Indices of the integer arrays with one entry per degree of freedom."""

    HOLDS = 0
    """FREED, HELD_BY_USER or HELD_AT_END of `HOLD`."""
    IS_COUNTED = 1
    """1 where a change of the coordinate adds to the cost, else 0."""
    CLAMPED = 2
    """1 where the coordinate has a range, else 0."""
    FREE = 3
    """Workspace for the list of free degrees of freedom."""
    COUPLER_AT = 4
    """Records of the couplers."""


class HOLD(metaclass=Record):
    """Ways in which the value of a degree of freedom is determined."""

    FREED = 0
    """Degree of freedom that the search moves."""
    HELD_BY_USER = 1
    """Degree of freedom that the caller fixed, such as a locked coordinate."""
    HELD_AT_END = 2
    """Degree of freedom that the search fixed at an end of its range."""


# Numbers: the tolerance of the equations, and the range of each degree of freedom.


class ASSEMBLY_NUMBERS(metaclass=Record):
    """Numbers of an assembly."""

    TOLERANCE = 0
    """Tolerance of the equations (m or rad)."""
    RANGES = 1
    """Ranges (n, 2) in m or rad."""


UNCOUNTED_MOBILITY = 100.0
"""Factor by which coordinates that do not count move more easily."""


class Assembly(NamedTuple):
    """The mechanism with its work vectors, and the integers, numbers and work of the assembly.

    Sections of the work vector w, with n degrees of freedom and m equations: values of fixed
    coordinates (n,), step (n,), step of a projection (n,), two trial poses (n,), gradient (n,),
    components of the step in the null space (n,), errors (m,), lengths of the equations (m,), right
    sides or multipliers (m,), rows (m, n), the factor, unit rows (m, n), normal equations (m, m),
    basis of the null space, Hessian, and workspace.
    """

    model: Ints  # integers of the mechanism
    reals: Floats  # numbers of the mechanism
    data: Floats  # workspace of an evaluation
    y: Floats  # workspace of a state
    f: Floats  # workspace of the rates of a state
    p: Ints  # integers of the assembly, see `ASSEMBLY`
    c: Floats  # numbers of the assembly, see `ASSEMBLY_NUMBERS`
    w: Floats  # workspace, see `assembly_work_size`


def list_freed(a: Assembly) -> int:
    """List the degrees of freedom that may change.

    Args:
        a: mechanism and assembly; the list of freed degrees of freedom is filled.

    Returns:
        Number of these degrees of freedom.
    """
    size = a.model[MODEL.DOFS]
    status = at(a.p, ASSEMBLY.HEAD)
    count = 0
    free = at(status, ASSEMBLY_ARRAY.FREE * size)
    for k in range(size):
        if status[k] == HOLD.FREED:
            free[count] = k
            count += 1
    return count


def evaluate_equations(a: Assembly, q: Floats) -> float:
    """Evaluate errors and rows of the equations of a pose.

    Args:
        a: mechanism and assembly; the work vector is filled with errors and rows.
        q: pose (n,).

    Returns:
        The largest error, infinite if undefined.
    """
    model = a.model
    size = a.model[MODEL.DOFS]
    copy_numbers(size, q, a.y)
    # Equations between coordinates only do not need the links, whose evaluation costs most.
    if a.p[ASSEMBLY.MOVES_LINKS] > 0:
        call(model[MODEL.LAWS], model, a.reals, a.data, a.y, a.f, STAGE.VELOCITY)
    evaluate_constraints(model, a.reals, a.data, a.y, a.f)
    count = count_equations(a)
    errors = at(a.w, 7 * size)
    collect_position_errors(model, a.data, errors)
    write_position_jacobian(model, a.data, a.y, equation_rows(a))
    if not is_finite(count, errors):
        return inf
    largest = 0.0
    for k in range(count):
        largest = max(largest, abs(errors[k]))
    return largest


def count_equations(a: Assembly) -> int:
    """Return the number of equations that constrain positions."""
    return a.model[a.model[MODEL.CONSTRAINED] + CONSTRAINED.POSITIONS]


def equation_rows(a: Assembly) -> Floats:
    """Return the derivatives of the errors by the coordinates (m, n)."""
    return at(a.w, 7 * a.model[MODEL.DOFS] + 3 * count_equations(a))


def equation_factor(a: Assembly) -> Floats:
    """Return the factor of the equations of the free coordinates."""
    return at(equation_rows(a), count_equations(a) * a.model[MODEL.DOFS])


def factorise_rows(a: Assembly, free: int, is_eased: bool) -> int:
    """Factorise the equations of the free coordinates, each with a left side of unit length.

    Unit lengths make the threshold of independence the same for metres and radians.

    Args:
        a: the assembly, whose rows are known.
        free: number of free degrees of freedom.
        is_eased: whether coordinates that do not count move more easily, by UNCOUNTED_MOBILITY.

    Returns:
        Rank of the equations.
    """
    size = a.model[MODEL.DOFS]
    count = count_equations(a)
    status = at(a.p, ASSEMBLY.HEAD)
    rows = equation_rows(a)
    factor = equation_factor(a)
    is_counted = at(status, ASSEMBLY_ARRAY.IS_COUNTED * size)
    free_list = at(status, ASSEMBLY_ARRAY.FREE * size)
    lengths = at(a.w, 7 * size + count)
    longest = 1.0
    for i in range(count):
        total = 0.0
        for k in range(free):
            entry = rows[size * i + free_list[k]]
            if is_eased and is_counted[free_list[k]] == 0:
                entry *= UNCOUNTED_MOBILITY
            factor[free * i + k] = entry
            total += entry * entry
        lengths[i] = sqrt(total)
        longest = max(longest, lengths[i])
    # An equation that hardly depends on the free coordinates is not enlarged to one of rounding
    # errors.
    for i in range(count):
        if lengths[i] <= ROUNDING * longest:
            lengths[i] = longest
        for k in range(free):
            factor[free * i + k] /= lengths[i]
    return factorise_equations(count, free, factor, REDUNDANCY_TOLERANCE)
