"""Functions of coordinates that are straight lines, and what drives the joints of a robot.

Formats of robots can express a joint that is a multiple of another one, but no other function.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from osimlite.base.records import dataclass, replace
from osimlite.mechanics.multibody import functions as f
from osimlite.mechanics.multibody.constraints import Coupler
from osimlite.mechanics.multibody.smoothing_spline import PiecewisePolynomial
from osimlite.simulation.robot.robot import Robot, RobotJoint


class StraightLine(NamedTuple):
    """Straight line ``slope * x + start``.

    Attributes:
        slope: slope of the line.
        start: value at x = 0.
    """

    slope: float
    start: float

    def compose(self, inner: StraightLine) -> StraightLine:
        """Return the composition of this line with an inner one.

        Args:
            inner: line whose value is the argument of this one.
        """
        return StraightLine(self.slope * inner.slope, self.slope * inner.start + self.start)

    def inverse(self) -> StraightLine:
        """Return the line that gives x for its value; the slope must not be zero."""
        # The identity keeps its exact numbers: -0.0 would be written as an offset.
        return (
            self if self == (1.0, 0.0) else StraightLine(1.0 / self.slope, -self.start / self.slope)
        )


def find_line(function: f.SmoothFunction) -> StraightLine | None:
    """Return the straight line that a function of one argument is.

    Splines count if they are straight to the last digit, as one through two points is, or one
    through points of equal height.

    Args:
        function: the function.

    Returns:
        The line; None if the function is not straight.
    """
    match function:
        case f.Linear(rate, start):
            return StraightLine(rate, start)
        case f.WeightedSum((weight,), start):
            return StraightLine(weight, start)
        # The highest power comes first, as in OpenSim.
        case f.Polynomial((*high, slope, start)) if not any(high):
            return StraightLine(slope, start)
        case f.MultivariatePolynomial(coefficients, powers) if all(
            len(item) == 1 for item in powers
        ):
            factors = {
                power: coefficient
                for coefficient, (power,) in zip(coefficients, powers, strict=True)
            }
            if not any(factor for power, factor in factors.items() if power > 1):
                return StraightLine(factors.get(1, 0.0), factors.get(0, 0.0))
        case f.ScaledFunction(scale, inner):
            line = find_line(inner)
            return None if line is None else StraightLine(scale, 0.0).compose(line)
        case f.PiecewiseLinear((_, _)):
            return _evaluate_line(function)
        case f.SimmCubicSpline() if _is_straight_spline(function):
            return _evaluate_line(function)
    return None


def _evaluate_line(function: f.SmoothFunction) -> StraightLine:
    """Return the line through value and slope at 0 of a function that is straight everywhere."""
    start, slopes, _ = function.evaluate(np.zeros(1))
    return StraightLine(float(slopes[0]), start)


def _is_straight_spline(spline: f.SimmCubicSpline) -> bool:
    """Return whether a spline is one straight line: equal slopes at all knots, and no curvature between.

    The comparison is exact, because the line replaces the spline in other programs' files, which
    must not change the motion silently.
    """
    # Intervals narrower than 1e-7 count as 1e-7 wide, as in OpenSim: the value may jump there.
    if any(right - left <= 1e-7 for left, right in pairwise(spline.x)):
        return False
    # A piece has value, slope, and coefficients of the second and third power. The last piece is
    # only the final knot: the spline continues there with its slope, whatever its coefficients.
    return len({slope for _, slope, _, _ in spline.pieces}) == 1 and not any(
        coefficient for piece in spline.pieces[:-1] for coefficient in piece[2:]
    )


class Mimic(NamedTuple):
    """Dependence of a joint on another one by a straight line.

    Attributes:
        leader: name of the other joint.
        line: value of the joint as a function of the value of the leader.
    """

    leader: str
    line: StraightLine


def couplers(robot: Robot) -> list[Coupler]:
    """Return the constraints of a robot's mechanism that make one coordinate a function of others."""
    return [
        constraint for constraint in robot.mechanism.constraints if isinstance(constraint, Coupler)
    ]


def mimics(robot: Robot) -> dict[str, Mimic]:
    """Return the joints whose value is a straight line of another's.

    Such joints exist where one coordinate drives several motions of a joint, and where a coupler
    makes a coordinate a straight line of another. A leader never follows another joint itself,
    because most programs do not resolve chains.

    Args:
        robot: the robot.

    Returns:
        Leader and line by the name of the joint.
    """
    leads = leaders(robot)
    follows: dict[int, tuple[int, StraightLine]] = {}
    for coupler in couplers(robot):
        line = find_line(coupler.function)
        if len(coupler.independent) == 1 and line is not None:
            # Of two couplers of a coordinate the first one counts; both must agree anyway.
            follows.setdefault(coupler.dependent, (coupler.independent[0], line))

    def find_origin(place: int) -> tuple[int, StraightLine]:
        """Return the most remote coordinate that has a leader, and the line from it to this one.

        Args:
            place: index of the coordinate.

        Returns:
            Index of that coordinate, and this coordinate as a line of it.
        """
        results = place, StraightLine(1.0, 0.0)
        line, seen = results[1], {place}
        while place in follows:
            place, step = follows[place]
            if place in seen:
                # Couplers in a circle: each coordinate keeps its own joint.
                return min(seen), StraightLine(1.0, 0.0)
            seen.add(place)
            line = line.compose(step)
            # Only a coordinate that a joint follows as a line can lead others in the file.
            if place in leads:
                results = place, line
        return results

    result: dict[str, Mimic] = {}
    for joint in robot.moving:
        line = find_line(joint.function)
        if len(joint.coordinates) != 1 or line is None:
            continue
        place, way = find_origin(joint.coordinates[0])
        # The leader of a coordinate mimics none, and is not its own follower.
        if place not in leads or leads[place][0] is joint:
            continue
        leader, own = leads[place]
        result[joint.name] = Mimic(leader.name, line.compose(way).compose(own.inverse()))
    return result


def leaders(robot: Robot) -> dict[int, tuple[RobotJoint, StraightLine]]:
    """Return the joint that others follow for each coordinate.

    It is the joint that equals the coordinate, else the first one that is a line of it.

    Args:
        robot: the robot.

    Returns:
        The joint, and its value as a line of the coordinate, by index of the coordinate.
    """
    result: dict[int, tuple[RobotJoint, StraightLine]] = {}
    for joint in robot.moving:
        line = find_line(joint.function)
        if len(joint.coordinates) == 1 and line is not None and line.slope:
            # A joint whose value is the coordinate itself is the better leader: it replaces these
            # below.
            result.setdefault(joint.coordinates[0], (joint, line))
    return result | {
        place: (joint, StraightLine(1.0, 0.0)) for place, joint in robot.joint_of.items()
    }


class CouplingDriver(NamedTuple):
    """Value as a function of a coordinate that moves freely.

    Attributes:
        coordinate: index of the coordinate; None if the value is constant.
        function: the function of it.
    """

    coordinate: int | None
    function: f.SmoothFunction


@dataclass(frozen=True)
class Composition(f.SmoothFunction):
    """Composition of two functions.

    Attributes:
        outer: function of one argument, the value of `inner`.
        inner: inner function.
    """

    outer: f.SmoothFunction
    inner: f.SmoothFunction

    def evaluate(self, arguments: f.Arguments) -> f.Evaluated:
        """Return value, gradient and Hessian, by the chain rule.

        Args:
            arguments: arguments of the inner function.

        Returns:
            Value g(h(x)), gradient g' h_i, and Hessian g' h_ij + g'' h_i h_j.
        """
        inner, gradient, hessian = self.inner.evaluate(arguments)
        value, (first,), ((second,),) = self.outer.evaluate((inner,))
        bends = [
            # Second derivative of a composition: f'(g) g'' + f''(g) g' g'.
            [first * bend + second * one * two for bend, two in zip(row, gradient, strict=True)]
            for row, one in zip(hessian, gradient, strict=True)
        ]
        return value, [first * slope for slope in gradient], bends


def coordinate_drivers(robot: Robot) -> dict[int, CouplingDriver]:
    """Return what determines the coordinates that do not move freely.

    A lock makes a coordinate constant, and a coupler of one coordinate makes it a function of that
    one. Couplers of several coordinates are not followed, and couplers in a circle leave the first
    coordinate free.

    Args:
        robot: the robot.

    Returns:
        Drivers by index of the coordinate.
    """
    infos = robot.mechanism.coordinates
    values = robot.mechanism.values({})
    result = {
        place: CouplingDriver(None, f.ConstantValue(float(values[place])))
        for place, info in enumerate(infos)
        if info.locked
    }
    steps = {item.dependent: item for item in couplers(robot) if len(item.independent) == 1}

    def drive(place: int, above: frozenset[int]) -> CouplingDriver:
        if place in result:
            return result[place]
        step = steps.get(place)
        # Couplers in a circle: the coordinate at which it closes moves freely.
        if step is None or step.independent[0] in above | {place}:
            return CouplingDriver(place, f.IDENTITY)
        return _substitute(step.function, drive(step.independent[0], above | {place}))

    for place in steps:
        if place not in result and (driver := drive(place, frozenset())).coordinate != place:
            result[place] = driver
    return result


def joint_driver(joint: RobotJoint, drivers: dict[int, CouplingDriver]) -> CouplingDriver | None:
    """Return what determines the value of a moving joint.

    Args:
        joint: the joint.
        drivers: drivers of the coordinates, see :func:`coordinate_drivers`.

    Returns:
        The driver; None if the joint's function has several coordinates.
    """
    if len(joint.coordinates) != 1:
        return None
    (place,) = joint.coordinates
    return _substitute(joint.function, drivers.get(place, CouplingDriver(place, f.IDENTITY)))


def knots(function: f.SmoothFunction) -> tuple[float, ...]:
    """Return the arguments at which the pieces of a function meet.

    Args:
        function: the function.

    Returns:
        Increasing arguments; empty for a function of one piece.
    """
    match function:
        case f.SimmCubicSpline() | f.PiecewiseLinear() | f.PiecewiseConstant():
            # Between these points such functions are smooth, so that samples go there.
            return tuple(function.x)
        case PiecewisePolynomial():
            return tuple(function.knots[1:].tolist())
        case f.ScaledFunction(_, inner) | Composition(_, inner):
            own = knots(inner)
            line = find_line(inner)
            if isinstance(function, Composition) and line is not None and line.slope:
                own = tuple((x - line.start) / line.slope for x in knots(function.outer))
            return own
    return ()


def _substitute(outer: f.SmoothFunction, driver: CouplingDriver) -> CouplingDriver:
    if driver.coordinate is None:
        return CouplingDriver(
            None, f.ConstantValue(outer.evaluate((driver.function.evaluate((0.0,))[0],))[0])
        )
    first, second = find_line(driver.function), find_line(outer)
    if first == (1.0, 0.0):
        return CouplingDriver(driver.coordinate, outer)
    if first is not None and second is not None:
        return CouplingDriver(driver.coordinate, f.Linear(*second.compose(first)))
    return CouplingDriver(driver.coordinate, Composition(outer, driver.function))


def range_limits(robot: Robot) -> Robot:
    """Return a robot whose joints are limited to the ranges of their coordinates.

    Only joints that are a straight line of one coordinate are limited.

    Args:
        robot: the robot.
    """

    def limit_joint(joint: RobotJoint) -> RobotJoint:
        line = find_line(joint.function)
        if joint.kind == "fixed" or len(joint.coordinates) != 1 or line is None:
            return joint
        low, high = (
            line.slope * end + line.start
            for end in robot.mechanism.coordinates[joint.coordinates[0]].range
        )
        return replace(joint, limits=(min(low, high), max(low, high)))

    return replace(robot, joints=tuple(limit_joint(joint) for joint in robot.joints))
