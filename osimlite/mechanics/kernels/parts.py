"""The records of a link and of an operation: their integers in the model, and what an
evaluation leaves of them in the data."""

from __future__ import annotations

from osimlite.mechanics.kernels.layout import (
    LINK,
    LINK_WORK,
    MODEL,
    MOTION,
    OPERATION,
    OPERATION_WORK,
)
from osimlite.mechanics.kernels.pointers import Floats, Ints, at
from osimlite.mechanics.laws.vectors import ZERO, Vector, cross, minus, vector


def link_ints(model: Ints, link: int) -> Ints:
    """Integers of a link, see `LINK`."""
    return at(model, model[MODEL.LINK_AT] + LINK.SIZE * link)


def link_work(model: Ints, data: Floats, link: int) -> Floats:
    """Work of a link, see `LINK_WORK`."""
    return at(data, model[MODEL.WORK_LINK] + LINK_WORK.SIZE * link)


def operation_ints(model: Ints, operation: int) -> Ints:
    """Integers of an operation, see `OPERATION`."""
    return at(model, model[MODEL.OPERATION_AT] + OPERATION.SIZE * operation)


def operation_work(model: Ints, data: Floats, operation: int) -> Floats:
    """Work of an operation, see `OPERATION_WORK`."""
    return at(data, model[MODEL.WORK_OPERATION] + OPERATION_WORK.SIZE * operation)


def screw(j: Ints, a: Floats, origin: Vector) -> tuple[Vector, Vector]:
    """What a unit of the amount of an operation turns, and shifts at an origin; not of balls."""
    axis = vector(a, OPERATION_WORK.AXIS)
    if j[OPERATION.MOTION] == MOTION.TURN:
        return axis, cross(minus(vector(a, OPERATION_WORK.POINT), origin), axis)
    return ZERO, axis
