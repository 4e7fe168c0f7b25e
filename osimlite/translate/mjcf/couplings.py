"""Joints that are functions of coordinates, and coupled coordinates, as equalities of joints."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.polynomial import Polynomial

from osimlite.mechanics.multibody.functions import IDENTITY, Linear
from osimlite.mechanics.multibody.mechanism import GROUND
from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.robot.couplings import (
    Composition,
    CouplingDriver,
    StraightLine,
    coordinate_drivers,
    couplers,
    joint_driver,
    leaders,
)
from osimlite.simulation.robot.names import joint_names
from osimlite.simulation.robot.robot import RobotJoint
from osimlite.translate.fidelity import Error
from osimlite.translate.mjcf.bodies import MIN_MASS
from osimlite.translate.mjcf.draft import SPECK_MASS_KG, Follower, Lead, MjcfDraft, add_element
from osimlite.translate.mjcf.ellipsoids import add_ellipsoids
from osimlite.translate.mjcf.moving import fit_composition
from osimlite.translate.mjcf.polynomials import (
    PolynomialFit,
    fit_quartic,
    sample_function,
    select_span,
)

HELPER_INERTIA = 0.1
"""Mass (kg) and inertia (kg·m²) of helper bodies.

Muscles may pull at them, and MuJoCo's equalities are soft: lighter helpers give way more.
"""
ARGUMENT_INERTIA_PART = 0.01
"""Inertia of a joint that is only the argument of functions, over the inertia that its coordinate
moves.

The smaller it is, the closer is the motion to the model's, but the softer are the equalities that
follow the joint.
"""


def add_couplings(draft: MjcfDraft) -> None:
    """Add an equality for every joint that follows a function or a coupler."""
    robot = draft.robot
    draft.leads |= {
        place: Lead(joint.name, line) for place, (joint, line) in leaders(robot).items()
    }
    # The driver computes ellipsoid joints exactly, without the mechanism.
    if not draft.options.driver:
        add_ellipsoids(draft)
    drivers = coordinate_drivers(robot)
    by_coupler = {
        item.dependent: item.name for item in couplers(robot) if item.dependent in drivers
    }
    for joint in robot.moving:
        driver = joint_driver(joint, drivers)
        # The mechanism of an ellipsoid joint already moves this joint.
        if joint.name in draft.followers:
            continue
        if driver is None:
            _hold_joint(draft, joint)
        elif (
            driver.coordinate is None
            or draft.leads.get(driver.coordinate, (None,))[0] != joint.name
        ):
            whose = by_coupler.get(joint.coordinates[0]) if joint.function == IDENTITY else None
            _add_follower(draft, joint, driver, whose or joint.source)
    for place, path in by_coupler.items():
        names = " ".join(joint.name for joint in robot.moving if place in joint.coordinates)
        draft.fidelity.translated[path] = (
            f"equality {names}" if names else "what it binds is locked"
        )
    for item in couplers(robot):
        if item.dependent not in drivers:
            several = "a coordinate that is a function of several others, or of itself"
            draft.fidelity.add("coupler", item.name, several, "left out: the coordinate is free")


def _add_follower(draft: MjcfDraft, joint: RobotJoint, driver: CouplingDriver, whose: str) -> None:
    """Let a joint follow the coordinate that drives it, exactly or by a fitted polynomial."""
    unit = "rad" if joint.kind == "revolute" else "m"
    if driver.coordinate is None:
        draft.add_follower(joint.name, Follower(None, (driver.function.evaluate(np.zeros(1))[0],)))
        return
    info = draft.mechanism.coordinates[driver.coordinate]
    lead = draft.leads.get(driver.coordinate) or _add_argument_joint(draft, driver.coordinate)
    own, function = lead.line.inverse(), driver.function
    low, high = select_span(function, info.range, info.default_value)
    first, last = sorted(lead.line.slope * end + lead.line.start for end in (low, high))
    exact = function if own == (1.0, 0.0) else Composition(function, Linear(*own))
    fit = fit_quartic(exact, (first, last), unit)
    follower = Follower(lead.joint, fit.coefficients)
    done = "a quartic, fitted"
    # The driver replaces the quartic by the exact function, and needs no helper.
    if fit.error is not None and draft.options.spline == "series" and not draft.options.driver:
        drive, (outer,) = fit_composition([function], (low, high))
        led = add_helper(draft, driver.coordinate, drive)
        assert led is not None
        follower = Follower(led.joint, compose_with_line(led.line, outer))
        done = "a quartic of a quartic, fitted"
        # The error is measured between the points of the fit as well.
        x = np.linspace(low, high, 400)
        fit = PolynomialFit(
            (),
            Error.measure(
                Polynomial(outer)(Polynomial(drive)(x)) - sample_function(function, x), unit
            ),
        )
    if fit.error is not None and draft.options.driver:
        follower = follower._replace(function=exact)
    elif fit.error is not None:
        draft.fidelity.add(
            "function",
            whose,
            "a joint that follows a coordinate by another function than a polynomial of degree four",
            done,
            f"joint {joint.name} over {info.name} from {low:g} to {high:g}",
            {"value": fit.error},
        )
    draft.add_follower(joint.name, follower)


def _add_argument_joint(draft: MjcfDraft, place: int) -> Lead:
    """Add a joint for a coordinate that is only the argument of functions.

    It turns a small body about its centre.
    """
    info = draft.mechanism.coordinates[place]
    name = joint_names(draft.mechanism)[place]
    # The driver moves joints exactly, whatever equalities make of them.
    inertia = (
        SPECK_MASS_KG * SPECK_MASS_KG
        if draft.options.driver
        else max(
            ARGUMENT_INERTIA_PART * _compute_inertia(draft, place), SPECK_MASS_KG * SPECK_MASS_KG
        )
    )
    speck = draft.add_speck(name, draft.bodies[GROUND], np.eye(4), inertia)
    add_element(speck, "joint", name=name, type="hinge", axis="0 0 1")
    draft.fidelity.add(
        "argument",
        info.path,
        "a coordinate that no axis moves by, but only functions of it",
        "a joint of its own, which turns a small body",
        f"joint {name}, {inertia:.3g} kg m^2",
    )
    draft.leads[place] = Lead(name, StraightLine(1.0, 0.0))
    return draft.leads[place]


def _compute_inertia(draft: MjcfDraft, place: int) -> float:
    """Return the inertia that a coordinate moves in the default pose (kg·m²).

    Coordinates that couplers move along are included.
    """
    q = draft.default_state[0]
    rates = np.zeros(len(q))
    rates[place] = 1.0
    for other, driver in coordinate_drivers(draft.robot).items():
        if driver.coordinate == place:
            rates[other] = driver.function.evaluate(q[[place]])[1][0]
    # Kinetic energy at unit rate: twice of it is the inertia.
    speeds = draft.mechanism.speeds_from_rates(q, rates)
    return float(speeds @ draft.mechanism.mass_matrix(q) @ speeds)


def add_helper(draft: MjcfDraft, place: int, drive: Array) -> Lead | None:
    """Add a joint whose value is a polynomial of a coordinate, or return an existing one.

    Args:
        draft: MJCF under construction.
        place: index of the coordinate in the mechanism.
        drive: coefficients of the polynomial (5,), constant first.

    Returns:
        Joint, and the line from its value to that of the polynomial; None if the coordinate is
        locked.
    """
    info = draft.mechanism.coordinates[place]
    if info.locked:
        return None
    lead = draft.leads.get(place) or _add_argument_joint(draft, place)
    own = lead.line.inverse()
    # The identity needs no helper.
    if np.array_equal(drive, (0.0, 1.0, 0.0, 0.0, 0.0)):
        return Lead(lead.joint, own)
    follower = Follower(lead.joint, compose_with_line(own, drive))
    # Paths with equal polynomials share a helper.
    name = next(
        (
            name
            for name, each in draft.followers.items()
            if each == follower and name in draft.helpers
        ),
        None,
    )
    if name is None:
        name = draft.make_name("joint", f"{info.name}_helper")
        draft.helpers.add(name)
        speck = add_element(draft.bodies[GROUND], "body", name=draft.make_name("body", name))
        add_element(
            speck,
            "inertial",
            pos=np.zeros(3),
            mass=MIN_MASS,
            diaginertia=np.full(3, HELPER_INERTIA),
        )
        add_element(speck, "joint", name=name, type="hinge", axis=(1.0, 0.0, 0.0))
        draft.add_follower(name, follower)
    return Lead(name, StraightLine(1.0, 0.0))


def compose_with_line(line: StraightLine, polynomial: Array) -> tuple[float, ...]:
    """Compose a polynomial with a line.

    Args:
        line: inner function.
        polynomial: coefficients of the outer function, constant first.

    Returns:
        Coefficients of the composition, constant first.
    """
    whole: Any = Polynomial(polynomial)(Polynomial((line.start, line.slope)))
    return tuple(whole.coef.tolist())


def _hold_joint(draft: MjcfDraft, joint: RobotJoint) -> None:
    """Hold a joint that is a function of several coordinates at its default value.

    The driver moves it exactly.
    """
    value = joint.value(draft.default_state[0])
    leads = [
        lead
        for place in joint.coordinates
        if (lead := draft.leads.get(place)) and lead.line == (1.0, 0.0)
    ]
    if draft.options.driver and len(leads) == len(joint.coordinates):
        names = tuple(lead.joint for lead in leads)
        draft.add_follower(joint.name, Follower(None, (value,), joint.function, names))
        return
    draft.add_follower(joint.name, Follower(None, (value,)))
    places = list(joint.coordinates)
    random = np.random.default_rng(0)
    low, high = np.array([draft.mechanism.coordinates[place].range for place in places]).T
    off = [joint.function.evaluate(random.uniform(low, high))[0] - value for _ in range(500)]
    unit = "rad" if joint.kind == "revolute" else "m"
    draft.fidelity.add(
        "function",
        joint.source,
        "a joint that is a function of several coordinates",
        "held where it is in the default pose",
        f"joint {joint.name}",
        {"value": Error.measure(off, unit)},
    )
