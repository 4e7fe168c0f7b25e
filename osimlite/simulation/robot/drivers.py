"""What decides the value of each joint once couplers are taken into account: one coordinate, by one function."""

from __future__ import annotations

from typing import NamedTuple

from osimlite.base.records import dataclass
from osimlite.mechanics.multibody import functions as f
from osimlite.mechanics.multibody.smoothing_spline import PiecewisePolynomial
from osimlite.simulation.robot.lines import as_line
from osimlite.simulation.robot.mimics import couplers
from osimlite.simulation.robot.robot import Robot, RobotJoint


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
        return _after(step.function, drive(step.independent[0], above | {place}))

    for place in steps:
        if place not in result and (driver := drive(place, frozenset())).coordinate != place:
            result[place] = driver
    return result


def joint_driver(joint: RobotJoint, drivers: dict[int, Driver]) -> Driver | None:
    """What decides the value of a moving joint; None where its function is of several coordinates."""
    if len(joint.coordinates) != 1:
        return None
    (place,) = joint.coordinates
    return _after(joint.function, drivers.get(place, Driver(place, f.IDENTITY)))


def knots(function: f.Function) -> tuple[float, ...]:
    """Arguments at which the pieces of a function meet; empty for a function of one piece."""
    match function:
        case f.SimmSpline() | f.PiecewiseLinear() | f.PiecewiseConstant():
            return tuple(function.x)
        case PiecewisePolynomial():
            return tuple(function.knots[1:].tolist())
        case f.Scaled(_, inner) | Composed(_, inner):
            own = knots(inner)
            line = as_line(inner)
            if isinstance(function, Composed) and line is not None and line.slope:
                own = tuple((x - line.start) / line.slope for x in knots(function.outer))
            return own
    return ()


def _after(outer: f.Function, driver: Driver) -> Driver:
    if driver.coordinate is None:
        return Driver(None, f.Constant(outer.evaluate((driver.function.evaluate((0.0,))[0],))[0]))
    first, second = as_line(driver.function), as_line(outer)
    if first == (1.0, 0.0):
        return Driver(driver.coordinate, outer)
    if first is not None and second is not None:
        return Driver(driver.coordinate, f.Linear(*second.after(first)))
    return Driver(driver.coordinate, Composed(outer, driver.function))
