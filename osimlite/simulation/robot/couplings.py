"""Linear functions of coordinates, and what drives the joints of a robot.

Formats of robots can express a joint that is a multiple of another one, but no other function.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import dataclass, replace
from osimlite.mechanics.multibody import functions as f
from osimlite.mechanics.multibody.constraints import Coupler
from osimlite.mechanics.multibody.smoothing_spline import PiecewisePolynomial
from osimlite.simulation.robot.robot import Robot, RobotJoint


class StraightLine(NamedTuple):
    """Straight line ``slope * x + offset``.

    Attributes:
        slope: slope of the line.
        offset: value at x = 0.
    """

    slope: float
    offset: float

    def compose(self, inner: StraightLine) -> StraightLine:
        """Return the composition of this line with an inner one.

        Args:
            inner: line whose value is the argument of this one.
        """
        return StraightLine(self.slope * inner.slope, self.slope * inner.offset + self.offset)

    def inverse(self) -> StraightLine:
        """Return the line that gives x for its value; the slope must not be zero."""
        # The identity keeps its exact numbers: -0.0 would be written as an offset.
        return (
            self
            if self == (1.0, 0.0)
            else StraightLine(1.0 / self.slope, -self.offset / self.slope)
        )


def find_line(function: f.SmoothFunction) -> StraightLine | None:
    """Return a function of one argument as a straight line if it is linear.

    Splines count if they are straight to the last digit, as one through two points is, or one
    through points of equal height.

    Args:
        function: the function.

    Returns:
        The line; None if the function is not straight.
    """
    match function:
        case f.Linear(rate, offset):
            return StraightLine(rate, offset)
        case f.WeightedSum((weight,), offset):
            return StraightLine(weight, offset)
        # The highest power comes first, as in OpenSim.
        case f.Polynomial((*high, slope, offset)) if not any(high):
            return StraightLine(slope, offset)
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
    offset, slopes, _ = function.evaluate(np.zeros(1))
    return StraightLine(float(slopes[0]), offset)


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
    """Linear dependence of a joint on another one, as the `mimic` of URDF.

    Attributes:
        leader: name of the other joint.
        line: value of the joint as a function of the value of the leader.
    """

    leader: str
    line: StraightLine


def list_couplers(robot: Robot) -> list[Coupler]:
    """Return the constraints of a robot's mechanism that make one coordinate a function of others."""
    return [
        constraint for constraint in robot.mechanism.constraints if isinstance(constraint, Coupler)
    ]


def find_mimics(robot: Robot) -> dict[str, Mimic]:
    """Find the joints whose value is a linear function of the value of another joint.

    Such joints exist where one coordinate drives several motions of a joint, and where a coupler
    makes a coordinate a linear function of another one. A leader never follows another joint
    itself, because most programs do not resolve chains.

    Args:
        robot: the robot.

    Returns:
        Leader and linear function by the name of the following joint.
    """
    leaders = find_leaders(robot)
    # The coordinate on which each dependent coordinate depends, and the linear function.
    couplings: dict[int, tuple[int, StraightLine]] = {}
    for coupler in list_couplers(robot):
        line = find_line(coupler.function)
        if len(coupler.independent) == 1 and line is not None:
            # Of two couplers of a coordinate the first one counts; both must agree anyway.
            couplings.setdefault(coupler.dependent, (coupler.independent[0], line))

    def find_driving_coordinate(dependent: int) -> tuple[int, StraightLine]:
        """Follow the couplers from a coordinate to the last one that has a leader.

        Args:
            dependent: index of the coordinate.

        Returns:
            Index of the last coordinate with a leader, or of the coordinate itself, and the value of
            the dependent coordinate as a linear function of it.
        """
        # The value of the dependent coordinate as a linear function of each visited one.
        lines = {dependent: StraightLine(1.0, 0.0)}
        index = driving_index = dependent
        while index in couplings:
            line = lines[index]
            index, coupling_line = couplings[index]
            if index in lines:
                # Couplers in a circle have no end. Each coordinate that leads into it selects the
                # same one, so that all of them have the same leader.
                visited = list(lines)
                driving_index = min(visited[visited.index(index) :])
                break
            lines[index] = line.compose(coupling_line)
            # A coordinate without a joint that is linear in it cannot lead others in the file.
            if index in leaders:
                driving_index = index
        return driving_index, lines[driving_index]

    result: dict[str, Mimic] = {}
    for joint in robot.moving:
        line = find_line(joint.function)
        if len(joint.coordinates) != 1 or line is None:
            continue
        driving_index, driving_line = find_driving_coordinate(joint.coordinates[0])
        # The leader of a coordinate mimics none, and is not its own follower.
        if driving_index not in leaders or leaders[driving_index][0] is joint:
            continue
        leader, leader_line = leaders[driving_index]
        # From the leader's value to the driving coordinate, to the joint's coordinate, to its value.
        result[joint.name] = Mimic(
            leader.name, line.compose(driving_line).compose(leader_line.inverse())
        )
    return result


def find_leaders(robot: Robot) -> dict[int, tuple[RobotJoint, StraightLine]]:
    """Find the joint that others follow for each coordinate.

    It is the joint whose value is the coordinate, else the first one whose value is linear in it.

    Args:
        robot: the robot.

    Returns:
        The joint, and its value as a linear function of the coordinate, by index of the coordinate.
    """
    result: dict[int, tuple[RobotJoint, StraightLine]] = {}
    for joint in robot.moving:
        line = find_line(joint.function)
        if len(joint.coordinates) == 1 and line is not None and line.slope:
            # A joint whose value is the coordinate itself is the better leader: it replaces these
            # in the union below.
            result.setdefault(joint.coordinates[0], (joint, line))
    return result | {
        index: (joint, StraightLine(1.0, 0.0)) for index, joint in robot.joint_of.items()
    }


class CouplingDriver(NamedTuple):
    """Value as a function of a coordinate that moves freely.

    Attributes:
        coordinate: index of the coordinate; None if the value is constant.
        function: function of this coordinate.
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

    def evaluate(self, arguments: f.Arguments) -> f.FunctionDerivatives:
        """Return value, gradient and Hessian, by the chain rule.

        Args:
            arguments: arguments of the inner function.

        Returns:
            Value g(h(x)), gradient g' h_i, and Hessian g' h_ij + g'' h_i h_j.
        """
        inner, gradient, hessian = self.inner.evaluate(arguments)
        value, (first,), ((second,),) = self.outer.evaluate((inner,))
        composed_hessian = [
            [
                first * curvature + second * row_slope * column_slope
                for curvature, column_slope in zip(row, gradient, strict=True)
            ]
            for row, row_slope in zip(hessian, gradient, strict=True)
        ]
        return value, [first * slope for slope in gradient], composed_hessian


def find_coordinate_drivers(robot: Robot) -> dict[int, CouplingDriver]:
    """Find the drivers of the coordinates that do not move freely.

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
        index: CouplingDriver(None, f.ConstantValue(float(values[index])))
        for index, info in enumerate(infos)
        if info.locked
    }
    couplers = {
        coupler.dependent: coupler
        for coupler in list_couplers(robot)
        if len(coupler.independent) == 1
    }

    def find_driver(index: int, visited: frozenset[int]) -> CouplingDriver:
        """Return the driver of a coordinate; `visited` are the coordinates that depend on it."""
        if index in result:
            return result[index]
        coupler = couplers.get(index)
        # Couplers in a circle: the coordinate at which it closes moves freely.
        if coupler is None or coupler.independent[0] in visited | {index}:
            return CouplingDriver(index, f.IDENTITY)
        return _substitute(coupler.function, find_driver(coupler.independent[0], visited | {index}))

    for index in couplers:
        if index not in result and (driver := find_driver(index, frozenset())).coordinate != index:
            result[index] = driver
    return result


def find_joint_driver(
    joint: RobotJoint, drivers: dict[int, CouplingDriver]
) -> CouplingDriver | None:
    """Return the driver of the value of a moving joint.

    Args:
        joint: the joint.
        drivers: drivers of the coordinates, see :func:`find_coordinate_drivers`.

    Returns:
        The driver; None if the joint's function has several coordinates.
    """
    if len(joint.coordinates) != 1:
        return None
    (index,) = joint.coordinates
    return _substitute(joint.function, drivers.get(index, CouplingDriver(index, f.IDENTITY)))


def find_knots(function: f.SmoothFunction) -> tuple[float, ...]:
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
            result = find_knots(inner)
            line = find_line(inner)
            # The knots of the outer function are values of the inner one. Only where that is linear
            # do they belong to known arguments.
            if isinstance(function, Composition) and line is not None and line.slope:
                result = tuple((x - line.offset) / line.slope for x in find_knots(function.outer))
            return result
    return ()


def _substitute(outer: f.SmoothFunction, driver: CouplingDriver) -> CouplingDriver:
    """Return the composition of a function with a driver, simplified if both are linear."""
    if driver.coordinate is None:
        return CouplingDriver(
            None, f.ConstantValue(outer.evaluate((driver.function.evaluate((0.0,))[0],))[0])
        )
    inner_line, outer_line = find_line(driver.function), find_line(outer)
    if inner_line == (1.0, 0.0):
        return CouplingDriver(driver.coordinate, outer)
    if inner_line is not None and outer_line is not None:
        return CouplingDriver(driver.coordinate, f.Linear(*outer_line.compose(inner_line)))
    return CouplingDriver(driver.coordinate, Composition(outer, driver.function))


def limit_to_ranges(robot: Robot) -> Robot:
    """Return a robot whose joints are limited to the ranges of their coordinates.

    Only joints whose value is linear in one coordinate are limited, and only if the range is not
    infinite on both sides.

    Args:
        robot: the robot.
    """

    def limit_joint(joint: RobotJoint) -> RobotJoint:
        line = find_line(joint.function)
        if joint.kind == "fixed" or len(joint.coordinates) != 1 or line is None:
            return joint
        low, high = (
            line.slope * end + line.offset
            for end in robot.mechanism.coordinates[joint.coordinates[0]].range
        )
        limits = min(low, high), max(low, high)
        # Comparisons with NaN are false.
        is_limited = limits[0] <= limits[1] and limits != (-np.inf, np.inf)
        return replace(joint, limits=limits) if is_limited else joint

    return replace(robot, joints=tuple(limit_joint(joint) for joint in robot.joints))
