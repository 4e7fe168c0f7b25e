"""Joints that are functions of a coordinate, and coordinates that are functions of others, as equalities of joints."""

from __future__ import annotations

import numpy as np

from osimlite.multibody.functions import IDENTITY, Linear
from osimlite.multibody.mechanism import GROUND
from osimlite.robot.drivers import Composed, Driver, coordinate_drivers, joint_driver
from osimlite.robot.lines import Line, as_line
from osimlite.robot.mimics import couplers
from osimlite.robot.robot import RobotJoint
from osimlite.translate.fidelity import Error
from osimlite.translate.mjcf.draft import SPECK, Draft, Follower, Lead, add
from osimlite.translate.mjcf.ellipsoids import add_ellipsoids
from osimlite.translate.mjcf.polynomials import quartic, span


def add_couplings(draft: Draft) -> None:
    """Add an equality for every joint whose value a function of a coordinate or a coupler decides."""
    robot = draft.robot
    for joint in robot.moving:
        line = as_line(joint.function)
        if len(joint.coordinates) == 1 and line is not None and line.slope:
            draft.leads.setdefault(joint.coordinates[0], Lead(joint.name, line))
    draft.leads |= {place: Lead(joint.name, Line(1.0, 0.0)) for place, joint in robot.joint_of.items()}
    add_ellipsoids(draft)
    drivers = coordinate_drivers(robot)
    by_coupler = {item.dependent: item.name for item in couplers(robot) if item.dependent in drivers}
    for joint in robot.moving:
        driver = joint_driver(joint, drivers)
        if joint.name in draft.followers:
            continue
        if driver is None:
            _hold(draft, joint)
        elif driver.coordinate is None or draft.leads.get(driver.coordinate, (None,))[0] != joint.name:
            whose = by_coupler.get(joint.coordinates[0]) if joint.function == IDENTITY else None
            _follow(draft, joint, driver, whose or joint.source)
    for place, path in by_coupler.items():
        names = " ".join(joint.name for joint in robot.moving if place in joint.coordinates)
        draft.fidelity.translated[path] = f"equality {names}" if names else "what it binds is locked"
    for item in couplers(robot):
        if item.dependent not in drivers:
            several = "a coordinate that is a function of several others, or of itself"
            draft.fidelity.add("coupler", item.name, several, "left out: the coordinate is free")


def _follow(draft: Draft, joint: RobotJoint, driver: Driver, whose: str) -> None:
    unit = "rad" if joint.kind == "revolute" else "m"
    if driver.coordinate is None:
        draft.follow(joint.name, Follower(None, (driver.function.evaluate(np.zeros(1))[0],)))
        return
    info = draft.mechanism.coordinates[driver.coordinate]
    lead = draft.leads.get(driver.coordinate) or _argument(draft, driver.coordinate)
    own, function = lead.line.inverse(), driver.function
    low, high = span(function, info.range, info.default_value)
    first, last = sorted(lead.line.slope * end + lead.line.start for end in (low, high))
    fit = quartic(function if own == (1.0, 0.0) else Composed(function, Linear(*own)), (first, last), unit)
    draft.follow(joint.name, Follower(lead.joint, fit.coefficients))
    if fit.error is not None:
        draft.fidelity.add(
            "function",
            whose,
            "a joint that follows a coordinate by another function than a polynomial of degree four",
            "a quartic, fitted",
            f"joint {joint.name} over {info.name} from {low:g} to {high:g}",
            {"value": fit.error},
        )


def _argument(draft: Draft, place: int) -> Lead:
    """A joint for a coordinate that is nothing but the argument of functions: it turns a speck about its own middle."""
    info = draft.mechanism.coordinates[place]
    name = draft.mechanism.coordinate_names[place].strip("/").replace("/", ".")
    add(draft.speck(name, draft.bodies[GROUND], np.eye(4)), "joint", name=name, type="hinge", axis="0 0 1")
    draft.fidelity.add(
        "argument",
        info.path,
        "a coordinate that no axis moves by, but only functions of it",
        f"a joint of its own, which turns a mass of {SPECK:g} kg",
        f"joint {name}",
    )
    draft.leads[place] = Lead(name, Line(1.0, 0.0))
    return draft.leads[place]


def leading(draft: Draft, place: int) -> Lead | None:
    """The joint that a coordinate is a line of, which is made if it is not there; None if the coordinate is locked."""
    if draft.mechanism.coordinates[place].locked:
        return None
    return draft.leads.get(place) or _argument(draft, place)


def _hold(draft: Draft, joint: RobotJoint) -> None:
    """Hold a joint that is a function of several coordinates where the default pose has it."""
    value = joint.value(draft.default_state[0])
    draft.follow(joint.name, Follower(None, (value,)))
    places, random = list(joint.coordinates), np.random.default_rng(0)
    low, high = np.array([draft.mechanism.coordinates[place].range for place in places]).T
    off = [joint.function.evaluate(random.uniform(low, high))[0] - value for _ in range(500)]
    unit = "rad" if joint.kind == "revolute" else "m"
    draft.fidelity.add(
        "function",
        joint.source,
        "a joint that is a function of several coordinates",
        "held where it is in the default pose",
        f"joint {joint.name}",
        {"value": Error.of(off, unit)},
    )
