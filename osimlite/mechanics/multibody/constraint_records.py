"""Conversion of constraints to records of the kernels: a law with integers and numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from osimlite.base.named_tuples import NamedTuple
from osimlite.errors import UnsupportedError
from osimlite.mechanics.kernels.constraint_equations import EQUATION_TYPE, VECTOR_TYPE
from osimlite.mechanics.kernels.layout import COORDINATE
from osimlite.mechanics.kernels.linear_algebra import factor_size
from osimlite.mechanics.multibody import body_constraints as b
from osimlite.mechanics.multibody.constraints import (
    ConstraintEquations,
    Coupler,
    Lock,
    PrescribedCoordinate,
)
from osimlite.mechanics.multibody.function_tables import function_table, table_of_one
from osimlite.mechanics.multibody.functions import ConstantValue
from osimlite.mechanics.multibody.parts import GROUND, FramePlacement, StationPlacement
from osimlite.mechanics.multibody.spatial import Array

if TYPE_CHECKING:
    from osimlite.mechanics.multibody.links import LinkMap

Balls = Mapping[tuple[int, ...], int]
"""Offset of the arguments of each ball, by its degrees of freedom."""


class ConstraintRecord(NamedTuple):
    """Record of one constraint, before it has a position in the vectors."""

    law: str  # name of the law
    ints: list[int]  # integers of the constraint behind those of `CONSTRAINT`
    numbers: list[float]  # numbers of the constraint
    equations: int = 1  # number of equations
    positions: int = 1  # number of equations, from the first on, that constrain positions
    work_size: int = 0  # length of the workspace of the law
    work_offset_index: int = -1  # index in `ints` of the offset of the workspace


class _Vector(NamedTuple):
    """Axis in a link, or arm from a point of one link to a point of another."""

    ints: list[int]
    numbers: list[float]


class _Equation(NamedTuple):
    kind: int  # PRODUCT, DISTANCE or SLIP of `EQUATION_TYPE`
    first: _Vector
    second: _Vector
    target_value: float = 0.0  # value of the scalar product (m²) or length (m)


def constraint_record(
    constraint: ConstraintEquations, link_map: LinkMap, balls: Balls
) -> ConstraintRecord:
    """Return the record of a constraint.

    Args:
        constraint: constraint of the mechanism.
        link_map: degrees of freedom and links of the mechanism.
        balls: offsets of the arguments of balls.

    Raises:
        UnsupportedError: there is no law for the constraint or for its function.
    """
    match constraint:
        case Lock():
            # A lock is a prescribed speed of zero without a position equation: any value is right.
            ints = _encode_coordinate(constraint.coordinate, link_map, balls)
            return ConstraintRecord(
                "prescribe", ints, table_of_one(ConstantValue(0.0), constraint.name), positions=0
            )
        case PrescribedCoordinate():
            table = table_of_one(constraint.function, f"the function of '{constraint.name}'")
            return ConstraintRecord(
                "prescribe", _encode_coordinate(constraint.coordinate, link_map, balls), table
            )
        case Coupler():
            return _encode_coupler(constraint, link_map, balls)
        case b.RollingConstraint():
            equations = _make_rolling_equations(constraint, link_map)
            return _record_between_bodies(
                equations, sum(item.kind != EQUATION_TYPE.SLIP for item in equations)
            )
        case b.DistanceConstraint():
            arm = _make_arm(link_map, constraint.first, constraint.second)
            return _record_between_bodies(
                [_Equation(EQUATION_TYPE.DISTANCE, arm, arm, constraint.distance)]
            )
        case b.PointEquations():
            return _record_between_bodies(
                _make_point_equations(link_map, constraint.first, constraint.second)
            )
        case b.PointOnLineEquations():
            arm = _make_arm(link_map, constraint.line, constraint.follower)
            axes = (
                _make_axis(link_map, constraint.line.body, axis)
                for axis in constraint.find_normal_directions()
            )
            return _record_between_bodies(
                [_Equation(EQUATION_TYPE.PRODUCT, axis, arm) for axis in axes]
            )
        case b.WeldEquations():
            return _record_between_bodies(_make_weld_equations(constraint, link_map))
    raise UnsupportedError(
        f"'{constraint.name}' ({type(constraint).__name__}) cannot be enforced; set its isEnforced to false"
    )


def count_constraint_work(equations: int, size: int, entries: int) -> dict[str, int]:
    """Return the lengths of the workspaces of all constraints together.

    Args:
        equations: number m of equations.
        size: number n of degrees of freedom.
        entries: number of stored entries of the mass matrix.

    Returns:
        Length of each workspace, by the name of its field in `CONSTRAINED`.
    """
    rows = equations * size
    # The larger of both solvers' needs: by multipliers, and in the null space.
    by_multipliers = 2 * (equations + size)
    by_directions = 2 * (equations + size + size * size)
    return {
        "WORK_ROWS": rows,
        "WORK_ERRORS": equations,
        "WORK_RATES": equations,
        "WORK_DRIFTS": equations,
        "WORK_COPY": rows,
        "WORK_FACTOR": factor_size(equations, size),
        "WORK_SYSTEM": entries + size + max(by_multipliers, by_directions),
        "WORK_TRIAL": 6 * size,
    }


def _encode_coordinate(index: int, link_map: LinkMap, balls: Balls) -> list[int]:
    """Return the record of a coordinate, with its part of a ball joint if it has one.

    Args:
        index: index of the coordinate in the mechanism.
        link_map: degrees of freedom and links of the mechanism.
        balls: offset of the arguments of each ball joint, by its degrees of freedom.
    """
    freedom = link_map.freedom(index)
    for freedoms, arguments in balls.items():
        if freedom in freedoms:
            return COORDINATE.record(DOF=freedom, BALL=arguments, PART=freedoms.index(freedom))
    return COORDINATE.record(DOF=freedom, BALL=-1, PART=0)


def _encode_coupler(constraint: Coupler, link_map: LinkMap, balls: Balls) -> ConstraintRecord:
    """Return the record of a coordinate that is a function of others.

    Args:
        constraint: coupler.
        link_map: degrees of freedom and links of the mechanism.
        balls: offset of the arguments of each ball joint, by its degrees of freedom.
    """
    independent = constraint.independent
    table = function_table(constraint.function, f"the function of '{constraint.name}'")
    dependent = _encode_coordinate(constraint.dependent, link_map, balls)
    # The 0 is replaced by the offset of the workspace for the gradient.
    ints = [*dependent, 0, len(independent), *map(link_map.freedom, independent)]
    for index in independent:
        ints += _encode_coordinate(index, link_map, balls)
    numbers = [link_map.get_locked_value(index) for index in (constraint.dependent, *independent)]
    return ConstraintRecord(
        "couple",
        ints,
        [*numbers, *table],
        work_size=max(len(independent), 1),
        work_offset_index=len(dependent),
    )


def _record_between_bodies(
    equations: Sequence[_Equation], positions: int | None = None
) -> ConstraintRecord:
    """Return the record of a constraint between bodies.

    Args:
        equations: equations; those of positions come first.
        positions: number of equations of positions; None if all are.
    """
    ints: list[int] = []
    numbers: list[float] = []
    for item in equations:
        ints += [item.kind, *item.first.ints, *item.second.ints]
        numbers += [*item.first.numbers, *item.second.numbers, item.target_value]
    count = len(equations)
    return ConstraintRecord(
        "bind_bodies", ints, numbers, count, count if positions is None else positions
    )


def _make_axis(link_map: LinkMap, body: int, axis: ArrayLike) -> _Vector:
    """Return an axis that is fixed in a body, in the link of the body.

    Args:
        link_map: degrees of freedom and links of the mechanism.
        body: index of the body.
        axis: direction in the frame of the body (3,).
    """
    direction = link_map.direction(body, np.asarray(axis, dtype=float).tolist())
    return _Vector(
        [VECTOR_TYPE.AXIS, link_map.placement(body).link, GROUND], [*direction, 0.0, 0.0, 0.0]
    )


def _make_arm(link_map: LinkMap, first: StationPlacement, second: StationPlacement) -> _Vector:
    """Return the vector from a point of one body to a point of another.

    Args:
        link_map: degrees of freedom and links of the mechanism.
        first: point at its start.
        second: point at its end.
    """
    (first_link, start), (second_link, end) = (
        link_map.station(body, point.tolist()) for body, point in (first, second)
    )
    return _Vector([VECTOR_TYPE.ARM, first_link, second_link], [*start, *end])


def _make_point_equations(
    link_map: LinkMap, first: StationPlacement, second: StationPlacement
) -> list[_Equation]:
    """Return three equations: the arm between two points vanishes along each axis of ground.

    Args:
        link_map: degrees of freedom and links of the mechanism.
        first: first point.
        second: second point.
    """
    arm = _make_arm(link_map, first, second)
    # Rates relative to the coincident point keep the equations exact while a small error remains.
    arm.ints[0] = VECTOR_TYPE.MEETING
    axes = (
        _Vector([VECTOR_TYPE.AXIS, GROUND, GROUND], [*axis, 0.0, 0.0, 0.0])
        for axis in np.eye(3).tolist()
    )
    return [_Equation(EQUATION_TYPE.PRODUCT, axis, arm) for axis in axes]


def _make_weld_equations(constraint: b.WeldEquations, link_map: LinkMap) -> list[_Equation]:
    """Return the six equations of a weld: three of orientation, then three of position.

    Args:
        constraint: weld.
        link_map: degrees of freedom and links of the mechanism.
    """
    (first_body, inner), (second_body, outer) = constraint.first, constraint.second
    # Two frames have the same orientation if each axis of one is perpendicular to the next axis of
    # the other.
    orientations = [
        _Equation(
            EQUATION_TYPE.PRODUCT,
            _make_axis(link_map, second_body, outer[:3, axis]),
            _make_axis(link_map, first_body, inner[:3, (axis + 1) % 3]),
        )
        for axis in range(3)
    ]
    return [
        *orientations,
        *_make_point_equations(
            link_map, _get_origin(constraint.first), _get_origin(constraint.second)
        ),
    ]


def _make_rolling_equations(constraint: b.RollingConstraint, link_map: LinkMap) -> list[_Equation]:
    """Return the four equations of a body that rolls on a plane.

    They are the height, the direction of the z axis, and the two slips along x and z, see
    `body_constraints.RollingConstraint`.

    Args:
        constraint: rolling constraint.
        link_map: degrees of freedom and links of the mechanism.
    """
    surface, roller = constraint.surface, constraint.roller
    arm = _make_arm(
        link_map, StationPlacement(surface, np.zeros(3)), StationPlacement(roller, np.zeros(3))
    )
    x, _, z = np.eye(3)
    normal: Array = constraint.normal / np.linalg.norm(constraint.normal)
    square = _Equation(
        EQUATION_TYPE.PRODUCT, _make_axis(link_map, surface, x), _make_axis(link_map, roller, z)
    )
    slips = [
        _Equation(EQUATION_TYPE.SLIP, _make_axis(link_map, surface, axis), arm) for axis in (x, z)
    ]
    return [
        _Equation(
            EQUATION_TYPE.PRODUCT, _make_axis(link_map, surface, normal), arm, constraint.height
        ),
        square,
        *slips,
    ]


def _get_origin(placement: FramePlacement) -> StationPlacement:
    """Return the origin of a frame as a point of its body."""
    return StationPlacement(placement.body, placement.transform[:3, 3])
