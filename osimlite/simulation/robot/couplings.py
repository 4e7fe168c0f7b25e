"""Functions that are straight lines, whatever their class: formats for robots can say these."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from osimlite.base.records import dataclass, replace
from osimlite.mechanics.multibody import functions as f
from osimlite.mechanics.multibody.constraints import Coupler
from osimlite.mechanics.multibody.smoothing_spline import PiecewisePolynomial
from osimlite.simulation.robot.robot import Robot, RobotJoint


class Line(NamedTuple):
    """``slope * x + start``."""

    slope: float
    start: float

    def after(self, inner: Line) -> Line:
        """This line of the inner one."""
        return Line(self.slope * inner.slope, self.slope * inner.start + self.start)

    def inverse(self) -> Line:
        """The line that gives x for its value; the slope must not be zero."""
        return self if self == (1.0, 0.0) else Line(1.0 / self.slope, -self.start / self.slope)


def as_line(function: f.Function) -> Line | None:
    """The straight line that a function of one argument is, or None.

    Splines count if they are straight to the last digit, as one through two points is, or one
    through points of equal height.
    """
    match function:
        case f.Linear(rate, start):
            return Line(rate, start)
        case f.WeightedSum((weight,), start):
            return Line(weight, start)
        case f.Polynomial((*high, slope, start)) if not any(high):
            return Line(slope, start)
        case f.MultivariatePolynomial(coefficients, powers) if all(
            len(item) == 1 for item in powers
        ):
            factors = {
                power: coefficient
                for coefficient, (power,) in zip(coefficients, powers, strict=True)
            }
            if not any(factor for power, factor in factors.items() if power > 1):
                return Line(factors.get(1, 0.0), factors.get(0, 0.0))
        case f.ScaledFunction(scale, inner):
            line = as_line(inner)
            return None if line is None else Line(scale, 0.0).after(line)
        case f.PiecewiseLinear((_, _)) | f.SimmSpline() if _is_straight(function):
            start, slopes, _ = function.evaluate(np.zeros(1))
            return Line(float(slopes[0]), start)
    return None


def _is_straight(function: f.Function) -> bool:
    if not isinstance(function, f.SimmSpline):
        return True
    # Where points lie on each other, the curve may jump.
    if any(right - left <= 1e-7 for left, right in pairwise(function.x)):
        return False
    return len({slope for _, slope, _, _ in function.pieces}) == 1 and not any(
        bend for piece in function.pieces[:-1] for bend in piece[2:]
    )


class Mimic(NamedTuple):
    """What a joint follows: the value of the joint named `leader`, by a straight line."""

    leader: str
    line: Line


def couplers(robot: Robot) -> list[Coupler]:
    """The constraints that make one coordinate a function of others."""
    return [
        constraint for constraint in robot.mechanism.constraints if isinstance(constraint, Coupler)
    ]


def mimics(robot: Robot) -> dict[str, Mimic]:
    """The joints whose value is a straight line of another's, by name.

    That is so where several motions of a joint are driven by one coordinate, and where a coupler
    makes a coordinate a straight line of another. A leader never follows another joint itself: most
    readers do not look further.
    """
    leads = leaders(robot)
    follows: dict[int, tuple[int, Line]] = {}
    for coupler in couplers(robot):
        line = as_line(coupler.function)
        if len(coupler.independent) == 1 and line is not None:
            follows.setdefault(coupler.dependent, (coupler.independent[0], line))

    def origin(place: int) -> tuple[int, Line]:
        """The coordinate farthest up that has a leader, and the line from it to this one."""
        results = place, Line(1.0, 0.0)
        line, seen = results[1], {place}
        while place in follows:
            place, step = follows[place]
            if place in seen:
                # Couplers in a circle: each coordinate keeps its own joint.
                return min(seen), Line(1.0, 0.0)
            seen.add(place)
            line = line.after(step)
            if place in leads:
                results = place, line
        return results

    result: dict[str, Mimic] = {}
    for joint in robot.moving:
        line = as_line(joint.function)
        if len(joint.coordinates) != 1 or line is None:
            continue
        place, way = origin(joint.coordinates[0])
        if place not in leads or leads[place][0] is joint:
            continue
        leader, own = leads[place]
        result[joint.name] = Mimic(leader.name, line.after(way).after(own.inverse()))
    return result


def leaders(robot: Robot) -> dict[int, tuple[RobotJoint, Line]]:
    """For coordinates the joint that others follow: the one that is the coordinate, else one that is a line of it."""
    result: dict[int, tuple[RobotJoint, Line]] = {}
    for joint in robot.moving:
        line = as_line(joint.function)
        if len(joint.coordinates) == 1 and line is not None and line.slope:
            result.setdefault(joint.coordinates[0], (joint, line))
    return result | {place: (joint, Line(1.0, 0.0)) for place, joint in robot.joint_of.items()}


class Driver(NamedTuple):
    """A value is `function` of the coordinate at the place `coordinate`, or constant if that is None."""

    coordinate: int | None
    function: f.Function


@dataclass(frozen=True)
class Composed(f.Function):
    """The `outer` function, of one argument, of the value of the `inner`."""

    outer: f.Function
    inner: f.Function

    def evaluate(self, arguments: f.Arguments) -> f.Evaluated:
        """Value, gradient and Hessian, by the chain rule."""
        inner, gradient, hessian = self.inner.evaluate(arguments)
        value, (first,), ((second,),) = self.outer.evaluate((inner,))
        bends = [
            [first * bend + second * one * two for bend, two in zip(row, gradient, strict=True)]
            for row, one in zip(hessian, gradient, strict=True)
        ]
        return value, [first * slope for slope in gradient], bends


def coordinate_drivers(robot: Robot) -> dict[int, Driver]:
    """For every coordinate that does not move freely, what decides it: a lock, or couplers of one coordinate.

    A coupler of several coordinates is not followed, and couplers in a circle leave the first
    coordinate free.
    """
    infos, values = robot.mechanism.coordinates, robot.mechanism.values({})
    result = {
        place: Driver(None, f.Constant(float(values[place])))
        for place, info in enumerate(infos)
        if info.locked
    }
    steps = {item.dependent: item for item in couplers(robot) if len(item.independent) == 1}

    def drive(place: int, above: frozenset[int]) -> Driver:
        if place in result:
            return result[place]
        step = steps.get(place)
        if step is None or step.independent[0] in above | {place}:
            return Driver(place, f.IDENTITY)
        return _substitute(step.function, drive(step.independent[0], above | {place}))

    for place in steps:
        if place not in result and (driver := drive(place, frozenset())).coordinate != place:
            result[place] = driver
    return result


def joint_driver(joint: RobotJoint, drivers: dict[int, Driver]) -> Driver | None:
    """What decides the value of a moving joint; None where its function is of several coordinates."""
    if len(joint.coordinates) != 1:
        return None
    (place,) = joint.coordinates
    return _substitute(joint.function, drivers.get(place, Driver(place, f.IDENTITY)))


def knots(function: f.Function) -> tuple[float, ...]:
    """Arguments at which the pieces of a function meet; empty for a function of one piece."""
    match function:
        case f.SimmSpline() | f.PiecewiseLinear() | f.PiecewiseConstant():
            return tuple(function.x)
        case PiecewisePolynomial():
            return tuple(function.knots[1:].tolist())
        case f.ScaledFunction(_, inner) | Composed(_, inner):
            own = knots(inner)
            line = as_line(inner)
            if isinstance(function, Composed) and line is not None and line.slope:
                own = tuple((x - line.start) / line.slope for x in knots(function.outer))
            return own
    return ()


def _substitute(outer: f.Function, driver: Driver) -> Driver:
    if driver.coordinate is None:
        return Driver(None, f.Constant(outer.evaluate((driver.function.evaluate((0.0,))[0],))[0]))
    first, second = as_line(driver.function), as_line(outer)
    if first == (1.0, 0.0):
        return Driver(driver.coordinate, outer)
    if first is not None and second is not None:
        return Driver(driver.coordinate, f.Linear(*second.after(first)))
    return Driver(driver.coordinate, Composed(outer, driver.function))


def range_limits(robot: Robot) -> Robot:
    """The same robot, with every joint that is a straight line of one coordinate limited to the coordinate's range."""

    def limited(joint: RobotJoint) -> RobotJoint:
        line = as_line(joint.function)
        if joint.kind == "fixed" or len(joint.coordinates) != 1 or line is None:
            return joint
        low, high = (
            line.slope * end + line.start
            for end in robot.mechanism.coordinates[joint.coordinates[0]].range
        )
        return replace(joint, limits=(min(low, high), max(low, high)))

    return replace(robot, joints=tuple(limited(joint) for joint in robot.joints))
