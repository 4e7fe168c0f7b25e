"""Forces on one coordinate: actuators on its joint, and springs as tendons.

The length of such a tendon is the coordinate.

Such a tendon is exact, has the name of the force, and allows several springs on one joint.
"""

from __future__ import annotations

import math

import numpy as np

from osimlite.mechanics.laws.coordinate_limit import limit_force
from osimlite.schema.actuators import ActivationCoordinateActuator, CoordinateActuator
from osimlite.schema.forces import CoordinateLimitForce
from osimlite.schema.muscles import PathActuator
from osimlite.schema.springs import SpringGeneralizedForce
from osimlite.simulation.elements.force_types.coordinate_limit import read_limit_constants
from osimlite.translate.fidelity import Error
from osimlite.translate.mjcf.draft import (
    Lead,
    MjcfDraft,
    Untranslatable,
    Value,
    add_element,
    format_spring_length,
)

UNREACHABLE_VALUE = 1e6
"""Value (rad or m) that no coordinate reaches, for the side on which a one-sided spring is slack."""


def add_actuator(draft: MjcfDraft, force: CoordinateActuator, path: str, **dynamics: Value) -> str:
    """Add an actuator on a joint, whose force is proportional to its control.

    Args:
        draft: MJCF under construction.
        force: actuator of the model.
        path: absolute path of the actuator.
        dynamics: attributes of activation dynamics.

    Returns:
        Kind and name of the element.
    """
    leader, _ = _find_lead(draft, force)
    return add_scaled_actuator(
        draft,
        force,
        path,
        joint=leader.joint,
        gear=force.optimal_force / leader.line.slope,
        **dynamics,
    )


def add_scaled_actuator(
    draft: MjcfDraft, force: CoordinateActuator | PathActuator, path: str, **target: Value
) -> str:
    """Add an actuator whose force is its control times its gear.

    Args:
        draft: MJCF under construction.
        force: actuator of the model, for the limits of its control.
        path: absolute path of the actuator.
        target: attributes of the transmission, with the gear.

    Returns:
        Kind and name of the element.
    """
    name = draft.make_name("actuator", path)
    control_range = (force.min_control, force.max_control)
    has_range = all(map(math.isfinite, control_range)) and control_range[0] < control_range[1]
    # In OpenSim only some tools enforce these limits; the range is written for information.
    limits: dict[str, Value] = (
        {"ctrllimited": False, "ctrlrange": control_range} if has_range else {}
    )
    add_element(draft.get_section("actuator"), "general", name=name, **target, **limits)
    return f"actuator {name}"


def add_lagging_actuator(draft: MjcfDraft, force: ActivationCoordinateActuator, path: str) -> str:
    """Add an actuator whose activation follows its control by first-order dynamics.

    Args:
        draft: MJCF under construction.
        force: actuator of the model.
        path: absolute path of the actuator.

    Returns:
        Kind and name of the element.
    """
    actuator = add_actuator(
        draft, force, path, dyntype="filterexact", dynprm=force.activation_time_constant
    )
    draft.activations[actuator.removeprefix("actuator ")] = force.default_activation
    return actuator


def add_spring(draft: MjcfDraft, force: SpringGeneralizedForce, path: str) -> str:
    """Add a spring and damper on the tendon of a coordinate.

    Args:
        draft: MJCF under construction.
        force: spring of the model.
        path: absolute path of the spring.

    Returns:
        Kind and name of the element.
    """
    leader, _ = _find_lead(draft, force)
    rest_length = force.rest_length
    return _add_tendon(
        draft,
        leader,
        path,
        (rest_length, rest_length),
        stiffness=force.stiffness,
        damping=force.viscosity,
    )


def add_limit(draft: MjcfDraft, force: CoordinateLimitForce, path: str) -> str:
    """Add a spring beyond each limit: a tendon that is slack between them.

    Args:
        draft: MJCF under construction.
        force: limit force of the model.
        path: absolute path of the force.

    Returns:
        Kind and names of the elements.

    Raises:
        Untranslatable: the lower limit is above the upper one.
    """
    leader, index = _find_lead(draft, force)
    coordinate = draft.mechanism.coordinates[index]
    Ku, qu, Kl, ql, D, t = read_limit_constants(force, coordinate)
    if ql > qu:
        raise Untranslatable("its lower limit lies above its upper one")
    # One tendon has one stiffness; two stiffnesses need a tendon for each side.
    if Ku == Kl:
        tendons = _add_tendon(draft, leader, path, (ql, qu), stiffness=Ku)
    else:
        tendons = _add_tendon(
            draft, leader, f"{path}_upper", (-UNREACHABLE_VALUE, qu), stiffness=Ku
        )
        tendons += " " + _add_tendon(
            draft, leader, f"{path}_lower", (ql, UNREACHABLE_VALUE), stiffness=Kl
        ).removeprefix("tendon ")
    # The difference to OpenSim's smooth limit is in the transition of width t.
    excesses = np.linspace(0.0, 3.0 * t, 200)
    force_errors = [
        limit_force(qu + excess, 0.0, Ku, qu, Kl, ql, D, t) + Ku * excess for excess in excesses
    ]
    force_errors += [
        limit_force(ql - excess, 0.0, Ku, qu, Kl, ql, D, t) - Kl * excess for excess in excesses
    ]
    unit = "N m" if coordinate.motion_type == "rotational" else "N"
    draft.fidelity.add(
        "limit-force",
        path,
        "a limit force with a smooth transition and damping",
        "a spring with the same stiffness beyond the limit, without damping",
        tendons,
        {"force": Error.measure(force_errors, unit), "damping": Error(D, D, f"{unit} s")},
    )
    return tendons


def _add_tendon(
    draft: MjcfDraft, leader: Lead, path: str, slack: tuple[float, float], **law: Value
) -> str:
    """Add a tendon whose length is the coordinate plus a constant.

    It is slack between two values of the coordinate.

    Returns:
        Kind and name of the element.
    """
    slope, start = leader.line
    # The length of the tendon is the coordinate plus start / slope.
    spring_length = format_spring_length(*(end + start / slope for end in slack))
    name = draft.make_name("tendon", path)
    tendon = add_element(
        draft.get_section("tendon"), "fixed", name=name, springlength=spring_length, **law
    )
    add_element(tendon, "joint", joint=leader.joint, coef=1.0 / slope)
    return f"tendon {name}"


def _find_lead(
    draft: MjcfDraft, force: CoordinateActuator | SpringGeneralizedForce | CoordinateLimitForce
) -> tuple[Lead, int]:
    """Return the joint of the coordinate of a force, and the index of the coordinate.

    Raises:
        Untranslatable: the force names no coordinate, or one that is locked or has no separate
            joint.
    """
    if not force.coordinate:
        raise Untranslatable("it names no coordinate")
    path = draft.tree.path_of(draft.tree.target(force, "coordinate", force.coordinate)) or ""
    index = draft.mechanism.coordinate_index(path)
    if draft.mechanism.coordinates[index].locked:
        raise Untranslatable("its coordinate is locked, so the force has no effect")
    if index not in draft.leads:
        raise Untranslatable(
            "its coordinate is a function of another coordinate, and has no separate joint"
        )
    return draft.leads[index], index
