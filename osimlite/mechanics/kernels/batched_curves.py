"""Evaluation of many Bezier curves at once, bit-identical to :mod:`osimlite.mechanics.laws.bezier`.

Each request has a lane, and the numbers of all lanes are stored side by side: the search takes the
same steps in all lanes, so that compilers use vector instructions.
"""

from __future__ import annotations

from typing import Any

from osimlite.mechanics.kernels.layout import Record
from osimlite.mechanics.kernels.pointers import Floats, at
from osimlite.mechanics.laws.bezier import (
    FIRST,
    LAST,
    MAX_HALLEY_STEPS,
    STARTS,
    X,
    Y,
    end_beyond_sum,
    evaluate_section,
    extrapolate_sum,
    find_section,
    find_section_of_sum,
    search_residual,
    search_section,
    take_halley_step,
)

LANES = 64
"""Largest number of requests at once."""
COEFFICIENTS = STARTS - X
"""Number of coefficients of a section."""


class CURVE_ROW(metaclass=Record):
    """Rows of the workspace, each of LANES numbers."""

    VALUE = 0
    """Results."""
    INSIDE = 1
    """0.0 for an argument beyond the curve, whose result is known at once, else 1.0."""
    CONTINUES = 2
    """1.0 while the search continues, else 0.0."""
    REMAINDER = 3
    """The distances of the arguments from the start of their sections."""
    U = 4
    """The parameters u."""
    OF_X = 5
    """First row of the coefficients of the sections."""
    SIZE = 5 + COEFFICIENTS
    """Number of rows, each of LANES numbers."""


def request_value(x: Floats, lanes: Floats, number: int, offset: int, z: float) -> None:
    """Request the value of a curve.

    Args:
        x: numbers of the model.
        lanes: workspace of the requests.
        number: number of the request.
        offset: offset of the curve in `x`.
        z: argument x of the curve.
    """
    # The result of a linear end needs no search, but the lane must take part in it without harm.
    c: Any = at(x, offset)
    lane = at(lanes, number)
    end = FIRST if not z >= c[FIRST] else LAST
    if end == FIRST or z > c[LAST]:
        lane[LANES * CURVE_ROW.VALUE] = c[end + 1] + c[end + 2] * (z - c[end])
        # A linear section whose search converges at once.
        lane[LANES * CURVE_ROW.INSIDE] = lane[LANES * CURVE_ROW.REMAINDER] = lane[
            LANES * CURVE_ROW.U
        ] = 0.0
        lane[LANES * CURVE_ROW.OF_X] = 1.0
        return
    section, remainder, u = find_section(c, z)
    lane[LANES * CURVE_ROW.INSIDE], lane[LANES * CURVE_ROW.REMAINDER], lane[LANES * CURVE_ROW.U] = (
        1.0,
        remainder,
        u,
    )
    for k in range(COEFFICIENTS):
        lane[LANES * (CURVE_ROW.OF_X + k)] = c[section + X + k]


def request_sum(
    x: Floats, lanes: Floats, number: int, offset: int, of_y: float, of_x: float, total: float
) -> None:
    """Request the value of a curve where ``of_y * y + of_x * x`` has a total, see `bezier.solve_sum`.

    Args:
        x: numbers of the model.
        lanes: workspace of the requests.
        number: number of the request.
        offset: offset of the curve in `x`.
        of_y: factor of the value y of the curve.
        of_x: factor of the argument x of the curve.
        total: value of the sum.
    """
    c: Any = at(x, offset)
    lane = at(lanes, number)
    end = end_beyond_sum(c, of_y, of_x, total)
    if end > 0:
        lane[LANES * CURVE_ROW.VALUE] = extrapolate_sum(c, of_y, of_x, total, end)
        lane[LANES * CURVE_ROW.INSIDE] = lane[LANES * CURVE_ROW.U] = 0.0
        # total - total is 0, or NaN for an undefined total, which must show in the result.
        lane[LANES * CURVE_ROW.REMAINDER], lane[LANES * CURVE_ROW.OF_X] = total - total, 1.0
        for k in range(1, COEFFICIENTS):
            lane[LANES * (CURVE_ROW.OF_X + k)] = 0.0
        return
    section, remainder, u = find_section_of_sum(c, of_y, of_x, total)
    lane[LANES * CURVE_ROW.INSIDE], lane[LANES * CURVE_ROW.REMAINDER], lane[LANES * CURVE_ROW.U] = (
        1.0,
        remainder,
        u,
    )
    # The polynomial in u that the lane solves is that of the sum instead of that of x.
    for k in range(Y - X):
        lane[LANES * (CURVE_ROW.OF_X + k)] = (
            of_y * c[section + Y + 1 + k] + of_x * c[section + X + k]
        )
    for k in range(Y - X, COEFFICIENTS):
        lane[LANES * (CURVE_ROW.OF_X + k)] = c[section + X + k]


def request_residual(lanes: Any, number: int) -> float:
    """Return the residual of a search.

    Args:
        lanes: workspace of the requests.
        number: number of the request.
    """
    return search_residual(
        lanes,
        LANES * CURVE_ROW.OF_X + number,
        LANES,
        lanes[LANES * CURVE_ROW.U + number],
        lanes[LANES * CURVE_ROW.REMAINDER + number],
    )


def request_result(lanes: Floats, number: int) -> float:
    """Return the result of a request.

    Args:
        lanes: workspace of the requests.
        number: number of the request.
    """
    return lanes[LANES * CURVE_ROW.VALUE + number]


def compute_requests(lanes: Any, request_count: int, rounds: int) -> None:
    """Compute all requests.

    Args:
        lanes: workspace of the requests.
        request_count: number of requests.
        rounds: number of search steps that all lanes take together; it is usually enough.
    """
    # Separate loops over the lanes, so that each becomes vector instructions.
    for lane in range(request_count):
        lanes[LANES * CURVE_ROW.CONTINUES + lane] = 1.0
    for _ in range(rounds):
        for lane in range(request_count):
            step_lane(lanes, lane)
    for lane in range(request_count):
        store_result(lanes, lane)
    # Lanes that need more steps than most continue alone.
    for lane in range(request_count):
        if lanes[LANES * CURVE_ROW.CONTINUES + lane] > 0.0:
            u, remainder = (
                lanes[LANES * CURVE_ROW.U + lane],
                lanes[LANES * CURVE_ROW.REMAINDER + lane],
            )
            u, _, _, _ = search_section(
                lanes, LANES * CURVE_ROW.OF_X + lane, LANES, u, remainder, MAX_HALLEY_STEPS - rounds
            )
            lanes[LANES * CURVE_ROW.U + lane] = u
            store_result(lanes, lane)


def step_lane(lanes: Any, lane: int) -> None:
    """Take a search step in one lane.

    Args:
        lanes: workspace of the requests.
        lane: number of the lane.
    """
    previous_u = lanes[LANES * CURVE_ROW.U + lane]
    is_going = lanes[LANES * CURVE_ROW.CONTINUES + lane] > 0.0
    u, continues = take_halley_step(
        lanes,
        LANES * CURVE_ROW.OF_X + lane,
        LANES,
        previous_u,
        lanes[LANES * CURVE_ROW.REMAINDER + lane],
    )
    # Select instead of branching, since lanes of one vector instruction do the same.
    lanes[LANES * CURVE_ROW.U + lane] = u if is_going else previous_u
    lanes[LANES * CURVE_ROW.CONTINUES + lane] = 1.0 if is_going and continues else 0.0


def store_result(lanes: Any, lane: int) -> None:
    """Store the result of a search.

    Args:
        lanes: workspace of the requests.
        lane: number of the lane.
    """
    value, _ = evaluate_section(
        lanes, LANES * CURVE_ROW.OF_X + lane, LANES, lanes[LANES * CURVE_ROW.U + lane]
    )
    is_inside = lanes[LANES * CURVE_ROW.INSIDE + lane] > 0.0
    lanes[LANES * CURVE_ROW.VALUE + lane] = (
        value if is_inside else lanes[LANES * CURVE_ROW.VALUE + lane]
    )
