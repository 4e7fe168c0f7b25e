"""Laws between joints: which follow another in a straight line, and every law as data for other programs."""

from __future__ import annotations

from typing import Any, NamedTuple

from osimlite.errors import UnsupportedError
from osimlite.multibody import functions as f
from osimlite.multibody.arc import ArcPoint
from osimlite.multibody.constraints import Coupler
from osimlite.multibody.motions import EllipsoidPoint
from osimlite.multibody.smoothing_spline import PiecewisePolynomial
from osimlite.translate.lines import Line, as_line
from osimlite.translate.robot import Robot, RobotJoint


class Mimic(NamedTuple):
    """What a joint follows: the value of the joint named `leader`, by a straight line."""

    leader: str
    line: Line


def couplers(robot: Robot) -> list[Coupler]:
    """The constraints that make one coordinate a function of others."""
    return [constraint for constraint in robot.mechanism.constraints if isinstance(constraint, Coupler)]


def mimics(robot: Robot) -> dict[str, Mimic]:
    """The joints whose value is a straight line of another's, by name.

    That is so where several motions of a joint are driven by one coordinate, and where a coupler makes a coordinate a
    straight line of another. A leader never follows another joint itself: most readers do not look further.
    """
    leaders = _leaders(robot)
    follows: dict[int, tuple[int, Line]] = {}
    for coupler in couplers(robot):
        line = as_line(coupler.function)
        if len(coupler.independent) == 1 and line is not None:
            follows.setdefault(coupler.dependent, (coupler.independent[0], line))

    def origin(place: int) -> tuple[int, Line]:
        """The coordinate farthest up that has a leader, and the line from it to this one."""
        found = place, Line(1.0, 0.0)
        line, seen = found[1], {place}
        while place in follows:
            place, step = follows[place]
            if place in seen:
                # Couplers in a circle: each coordinate keeps its own joint.
                return min(seen), Line(1.0, 0.0)
            seen.add(place)
            line = line.after(step)
            if place in leaders:
                found = place, line
        return found

    result: dict[str, Mimic] = {}
    for joint in robot.moving:
        line = as_line(joint.function)
        if len(joint.coordinates) != 1 or line is None:
            continue
        place, way = origin(joint.coordinates[0])
        if place not in leaders or leaders[place][0] is joint:
            continue
        leader, own = leaders[place]
        result[joint.name] = Mimic(leader.name, line.after(way).after(own.inverse()))
    return result


def _leaders(robot: Robot) -> dict[int, tuple[RobotJoint, Line]]:
    """For coordinates the joint that others follow: the one that is the coordinate, else one that is a line of it."""
    found: dict[int, tuple[RobotJoint, Line]] = {}
    for joint in robot.moving:
        line = as_line(joint.function)
        if len(joint.coordinates) == 1 and line is not None and line.slope:
            found.setdefault(joint.coordinates[0], (joint, line))
    return found | {place: (joint, Line(1.0, 0.0)) for place, joint in robot.joint_of.items()}


def as_data(function: f.Function) -> dict[str, Any]:
    """A function as JSON-ready data, exact: ``type`` and what that type needs (see docs/urdf.md).

    Raises:
        UnsupportedError: a function of another class.
    """
    match function:
        case f.Constant(value):
            return {"type": "constant", "value": value}
        case f.Linear(rate, start):
            return {"type": "linear", "slope": rate, "start": start}
        case f.WeightedSum(weights, start):
            return {"type": "weighted-sum", "weights": weights, "start": start}
        case f.Polynomial(coefficients):
            return {"type": "polynomial", "coefficients": coefficients[::-1]}
        case f.Sine(amplitude, omega, phase, offset):
            return {"type": "sine", "amplitude": amplitude, "omega": omega, "phase": phase, "offset": offset}
        case f.Step():
            return {
                "type": "step",
                "x": (function.start, function.end),
                "y": (function.start_value, function.end_value),
            }
        case f.MultivariatePolynomial(coefficients, powers):
            return {"type": "multivariate-polynomial", "coefficients": coefficients, "powers": powers}
        case f.Scaled(scale, inner):
            return {"type": "scaled", "scale": scale, "function": as_data(inner)}
        case f.PiecewiseLinear(x, y):
            return {"type": "piecewise-linear", "x": x, "y": y}
        case f.PiecewiseConstant(x, y):
            return {"type": "piecewise-constant", "x": x, "y": y}
        case EllipsoidPoint(component, radius):
            return {"type": "ellipsoid-point", "component": component, "radius": radius}
        case ArcPoint(component, length, neutral):
            return {"type": "arc-point", "component": component, "length": length, "neutral": neutral}
        case f.SimmSpline():
            # The first and the last point go on in straight lines.
            first, *_, last = function.pieces
            return {
                "type": "piecewise-polynomial",
                "of": "SimmSpline",
                "y": function.y,
                "x": function.x,
                "pieces": [first[:2], *function.pieces[:-1], last[:2]],
            }
        case PiecewisePolynomial():
            return {
                "type": "piecewise-polynomial",
                "of": "GCVSpline",
                "x": function.knots[1:].tolist(),
                "pieces": function.pieces.tolist(),
            }
    raise UnsupportedError(f"a function of class {type(function).__name__} cannot be written as data")
