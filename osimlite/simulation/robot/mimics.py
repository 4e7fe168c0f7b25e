"""Joints that follow another in a straight line: formats for robots can say that much of a law between joints."""

from __future__ import annotations

from typing import NamedTuple

from osimlite.mechanics.multibody.constraints import Coupler
from osimlite.simulation.robot.lines import Line, as_line
from osimlite.simulation.robot.robot import Robot, RobotJoint


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
