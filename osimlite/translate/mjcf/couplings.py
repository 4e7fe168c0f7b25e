"""Joints that are functions of coordinates, and coupled coordinates, as equalities of joints."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial

from osimlite.mechanics.multibody.constraints import Coupler
from osimlite.mechanics.multibody.functions import IDENTITY, Linear
from osimlite.mechanics.multibody.mechanism import GROUND
from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.robot.couplings import (
    Composition,
    CouplingDriver,
    StraightLine,
    find_coordinate_drivers,
    find_joint_driver,
    find_leaders,
    list_couplers,
)
from osimlite.simulation.robot.names import joint_names
from osimlite.simulation.robot.robot import RobotJoint
from osimlite.translate.fidelity import LEFT_OUT, Error
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
        index: Lead(joint.name, line) for index, (joint, line) in find_leaders(robot).items()
    }
    # The driver computes ellipsoid joints exactly, without the mechanism.
    if not draft.options.driver:
        add_ellipsoids(draft)
    drivers = find_coordinate_drivers(robot)
    coupler_by_coordinate = {
        coupler.dependent: coupler.name
        for coupler in list_couplers(robot)
        if coupler.dependent in drivers
    }
    for joint in robot.moving:
        driver = find_joint_driver(joint, drivers)
        # The mechanism of an ellipsoid joint already moves this joint.
        if joint.name in draft.followers:
            continue
        if driver is None:
            _hold_joint(draft, joint)
        elif (
            driver.coordinate is None
            or draft.leads.get(driver.coordinate, (None,))[0] != joint.name
        ):
            coupler_path = (
                coupler_by_coordinate.get(joint.coordinates[0])
                if joint.function == IDENTITY
                else None
            )
            _add_follower(draft, joint, driver, coupler_path or joint.source)
    for index, path in coupler_by_coordinate.items():
        if not draft.mechanism.coordinates[index].locked:
            names = " ".join(joint.name for joint in robot.moving if index in joint.coordinates)
            draft.fidelity.translated[path] = (
                f"equality {names}" if names else "nothing: the coordinate moves no body"
            )
    for coupler in list_couplers(robot):
        if draft.mechanism.coordinates[coupler.dependent].locked:
            _hold_arguments(draft, coupler, drivers)
    for coupler in list_couplers(robot):
        if coupler.dependent not in drivers:
            description = "a coordinate that is a function of several others, or of itself"
            draft.fidelity.add(
                "coupler", coupler.name, description, "left out: the coordinate is free"
            )


def _add_follower(
    draft: MjcfDraft, joint: RobotJoint, driver: CouplingDriver, component_path: str
) -> None:
    """Let a joint follow the coordinate that drives it, exactly or by a fitted polynomial."""
    unit = "rad" if joint.kind == "revolute" else "m"
    if driver.coordinate is None:
        draft.add_follower(joint.name, Follower(None, (driver.function.evaluate(np.zeros(1))[0],)))
        return
    coordinate = draft.mechanism.coordinates[driver.coordinate]
    leader = draft.leads.get(driver.coordinate) or _add_argument_joint(draft, driver.coordinate)
    coordinate_line = leader.line.inverse()
    function = driver.function
    lower, upper = select_span(function, coordinate.range, coordinate.default_value)
    first, last = sorted(leader.line.slope * end + leader.line.offset for end in (lower, upper))
    exact = (
        function
        if coordinate_line == (1.0, 0.0)
        else Composition(function, Linear(*coordinate_line))
    )
    fit = fit_quartic(exact, (first, last), unit)
    follower = Follower(leader.joint, fit.coefficients)
    replacement = "a fitted polynomial of degree four"
    # The driver replaces the quartic by the exact function, and needs no helper.
    if fit.error is not None and draft.options.spline == "series" and not draft.options.driver:
        inner, (outer,) = fit_composition([function], (lower, upper))
        helper = add_helper(draft, driver.coordinate, inner)
        assert helper is not None
        follower = Follower(helper.joint, compose_with_line(helper.line, outer))
        replacement = "two quartics in series, fitted"
        # The error is measured between the points of the fit as well.
        x = np.linspace(lower, upper, 400)
        fit = PolynomialFit(
            (),
            Error.measure(
                Polynomial(outer)(Polynomial(inner)(x)) - sample_function(function, x), unit
            ),
        )
    if fit.error is not None and draft.options.driver:
        follower = follower._replace(function=exact)
    elif fit.error is not None:
        draft.fidelity.add(
            "function",
            component_path,
            "a joint that follows a coordinate by a function other than a polynomial of degree four",
            replacement,
            f"joint {joint.name} over {coordinate.name} from {lower:g} to {upper:g}",
            {"value": fit.error},
        )
    draft.add_follower(joint.name, follower)


def _add_argument_joint(draft: MjcfDraft, coordinate_index: int) -> Lead:
    """Add a joint for a coordinate that is only the argument of functions.

    It turns a small body about its centre.

    Returns:
        The new joint, whose position is the value of the coordinate.
    """
    coordinate = draft.mechanism.coordinates[coordinate_index]
    name = joint_names(draft.mechanism)[coordinate_index]
    # The driver sets the positions of joints exactly, so that equalities do not matter.
    inertia = (
        SPECK_MASS_KG * SPECK_MASS_KG
        if draft.options.driver
        else max(
            ARGUMENT_INERTIA_PART * _compute_inertia(draft, coordinate_index),
            SPECK_MASS_KG * SPECK_MASS_KG,
        )
    )
    carrier = draft.add_speck(name, draft.bodies[GROUND], np.eye(4), inertia)
    add_element(carrier, "joint", name=name, type="hinge", axis="0 0 1")
    draft.fidelity.add(
        "argument",
        coordinate.path,
        "a coordinate that moves axes only through functions",
        "a separate joint, which turns a small body",
        f"joint {name}, {inertia:.3g} kg m^2",
    )
    draft.leads[coordinate_index] = Lead(name, StraightLine(1.0, 0.0))
    return draft.leads[coordinate_index]


def _compute_inertia(draft: MjcfDraft, coordinate_index: int) -> float:
    """Return the inertia that a coordinate moves in the default pose (kg·m²).

    Coordinates that couplers move along are included.
    """
    q = draft.default_state[0]
    rates = np.zeros(len(q))
    rates[coordinate_index] = 1.0
    for follower_index, driver in find_coordinate_drivers(draft.robot).items():
        if driver.coordinate == coordinate_index:
            rates[follower_index] = driver.function.evaluate(q[[coordinate_index]])[1][0]
    # Kinetic energy at unit rate: twice of it is the inertia.
    speeds = draft.mechanism.speeds_from_rates(q, rates)
    return float(speeds @ draft.mechanism.mass_matrix(q) @ speeds)


def add_helper(draft: MjcfDraft, coordinate_index: int, inner: Array) -> Lead | None:
    """Add a joint whose value is a polynomial of a coordinate, or return an existing one.

    Args:
        draft: MJCF under construction.
        coordinate_index: index of the coordinate in the mechanism.
        inner: coefficients of the polynomial (5,), constant first.

    Returns:
        Joint, and the line from its value to that of the polynomial; None if the coordinate is
        locked.
    """
    coordinate = draft.mechanism.coordinates[coordinate_index]
    if coordinate.locked:
        return None
    leader = draft.leads.get(coordinate_index) or _add_argument_joint(draft, coordinate_index)
    coordinate_line = leader.line.inverse()
    # The identity needs no helper.
    if np.array_equal(inner, (0.0, 1.0, 0.0, 0.0, 0.0)):
        return Lead(leader.joint, coordinate_line)
    follower = Follower(leader.joint, compose_with_line(coordinate_line, inner))
    # Paths with equal polynomials share a helper.
    name = next(
        (
            name
            for name, existing in draft.followers.items()
            if existing == follower and name in draft.helpers
        ),
        None,
    )
    if name is None:
        name = draft.make_name("joint", f"{coordinate.name}_helper")
        draft.helpers.add(name)
        carrier = add_element(draft.bodies[GROUND], "body", name=draft.make_name("body", name))
        add_element(
            carrier,
            "inertial",
            pos=np.zeros(3),
            mass=MIN_MASS,
            diaginertia=np.full(3, HELPER_INERTIA),
        )
        add_element(carrier, "joint", name=name, type="hinge", axis=(1.0, 0.0, 0.0))
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
    composed: Any = Polynomial(polynomial)(Polynomial((line.offset, line.slope)))
    return tuple(composed.coef.tolist())


def _hold_arguments(
    draft: MjcfDraft, coupler: Coupler, drivers: Mapping[int, CouplingDriver]
) -> None:
    """Hold the coordinate on which a locked coordinate depends, where it gives the locked value.

    Args:
        draft: MJCF under construction.
        coupler: coupler whose dependent coordinate is locked.
        drivers: drivers of the coordinates that do not move freely.
    """
    free_indices = {
        driving_index
        for index in coupler.independent
        if (driving_index := drivers.get(index, CouplingDriver(index, IDENTITY)).coordinate)
        is not None
    }
    arguments = draft.default_state[0][list(coupler.independent)]
    _, gradient, hessian = coupler.function.evaluate(arguments)
    # A constant function is fulfilled by any motion.
    if not free_indices or not (np.any(gradient) or np.any(hessian)):
        draft.fidelity.translated[coupler.name] = "nothing: it holds no coordinate that can move"
        return
    if len(free_indices) > 1:
        description = "a locked coordinate that is a function of several others"
        done = f"{LEFT_OUT}: the other coordinates are free"
        draft.fidelity.add("coupler", coupler.name, description, done)
        return
    (index,) = free_indices
    leader = draft.leads.get(index) or _add_argument_joint(draft, index)
    draft.fidelity.translated[coupler.name] = f"equality {leader.joint}"
    # Several locked coordinates may depend on one that is free.
    if leader.joint not in draft.followers:
        value = float(draft.default_state[0][index])
        held_value = leader.line.slope * value + leader.line.offset
        draft.add_follower(leader.joint, Follower(None, (held_value,)))


def _hold_joint(draft: MjcfDraft, joint: RobotJoint) -> None:
    """Hold a joint that is a function of several coordinates at its default value.

    The driver moves it exactly.
    """
    value = joint.value(draft.default_state[0])
    leaders = [
        leader
        for index in joint.coordinates
        if (leader := draft.leads.get(index)) and leader.line == (1.0, 0.0)
    ]
    if draft.options.driver and len(leaders) == len(joint.coordinates):
        names = tuple(leader.joint for leader in leaders)
        draft.add_follower(joint.name, Follower(None, (value,), joint.function, names))
        return
    draft.add_follower(joint.name, Follower(None, (value,)))
    indices = list(joint.coordinates)
    generator = np.random.default_rng(0)
    lower, upper = np.array([draft.mechanism.coordinates[index].range for index in indices]).T
    value_errors = [
        joint.function.evaluate(generator.uniform(lower, upper))[0] - value for _ in range(500)
    ]
    unit = "rad" if joint.kind == "revolute" else "m"
    draft.fidelity.add(
        "function",
        joint.source,
        "a joint that is a function of several coordinates",
        "fixed at its value in the default pose",
        f"joint {joint.name}",
        {"value": Error.measure(value_errors, unit)},
    )
