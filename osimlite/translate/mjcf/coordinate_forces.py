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
from osimlite.simulation.elements.force_types.coordinate_forces import read_limit_constants
from osimlite.translate.fidelity import Error
from osimlite.translate.mjcf.draft import Lead, MjcfDraft, Untranslatable, Value, add_element

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
    lead, _ = _find_lead(draft, force)
    return add_scaled_actuator(
        draft, force, path, joint=lead.joint, gear=force.optimal_force / lead.line.slope, **dynamics
    )


def add_scaled_actuator(
    draft: MjcfDraft, force: CoordinateActuator | PathActuator, path: str, **on: Value
) -> str:
    """Add an actuator whose force is its control times its gear.

    Args:
        draft: MJCF under construction.
        force: actuator of the model, for the limits of its control.
        path: absolute path of the actuator.
        on: attributes of the transmission, with the gear.

    Returns:
        Kind and name of the element.
    """
    name = draft.make_name("actuator", path)
    ends = (force.min_control, force.max_control)
    finite = all(map(math.isfinite, ends)) and ends[0] < ends[1]
    # In OpenSim only some tools enforce these limits; the range is written for information.
    limits: dict[str, Value] = {"ctrllimited": False, "ctrlrange": ends} if finite else {}
    add_element(draft.get_section("actuator"), "general", name=name, **on, **limits)
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
    made = add_actuator(
        draft, force, path, dyntype="filterexact", dynprm=force.activation_time_constant
    )
    draft.activations[made.removeprefix("actuator ")] = force.default_activation
    return made


def add_spring(draft: MjcfDraft, force: SpringGeneralizedForce, path: str) -> str:
    """Add a spring and damper on the tendon of a coordinate.

    Args:
        draft: MJCF under construction.
        force: spring of the model.
        path: absolute path of the spring.

    Returns:
        Kind and name of the element.
    """
    lead, _ = _find_lead(draft, force)
    rest = force.rest_length
    return _add_tendon(
        draft, lead, path, (rest, rest), stiffness=force.stiffness, damping=force.viscosity
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
    lead, place = _find_lead(draft, force)
    info = draft.mechanism.coordinates[place]
    Ku, qu, Kl, ql, D, t = read_limit_constants(force, info)
    if ql > qu:
        raise Untranslatable("its lower limit lies above its upper one")
    # One tendon has one stiffness; two stiffnesses need a tendon for each side.
    if Ku == Kl:
        made = _add_tendon(draft, lead, path, (ql, qu), stiffness=Ku)
    else:
        made = _add_tendon(draft, lead, f"{path}_upper", (-UNREACHABLE_VALUE, qu), stiffness=Ku)
        made += " " + _add_tendon(
            draft, lead, f"{path}_lower", (ql, UNREACHABLE_VALUE), stiffness=Kl
        ).removeprefix("tendon ")
    # The difference to OpenSim's smooth limit is in the transition of width t.
    beyond = np.linspace(0.0, 3.0 * t, 200)
    off = [limit_force(qu + d, 0.0, Ku, qu, Kl, ql, D, t) + Ku * d for d in beyond]
    off += [limit_force(ql - d, 0.0, Ku, qu, Kl, ql, D, t) - Kl * d for d in beyond]
    unit = "N m" if info.motion_type == "rotational" else "N"
    draft.fidelity.add(
        "limit-force",
        path,
        "a limit whose stiffness grows smoothly, and which damps beyond it",
        "a spring of its stiffness from the limit on, without damping",
        made,
        {"force": Error.measure(off, unit), "damping": Error(D, D, f"{unit} s")},
    )
    return made


def _add_tendon(
    draft: MjcfDraft, lead: Lead, path: str, slack: tuple[float, float], **law: Value
) -> str:
    """Add a tendon whose length is the coordinate plus a constant.

    It is slack between two values of the coordinate.
    """
    slope, start = lead.line
    # The length of the tendon is the coordinate plus start / slope.
    ends = [end + start / slope for end in slack]
    name = draft.make_name("tendon", path)
    tendon = add_element(draft.get_section("tendon"), "fixed", name=name, springlength=ends, **law)
    add_element(tendon, "joint", joint=lead.joint, coef=1.0 / slope)
    return f"tendon {name}"


def _find_lead(
    draft: MjcfDraft, force: CoordinateActuator | SpringGeneralizedForce | CoordinateLimitForce
) -> tuple[Lead, int]:
    """Return the joint of the coordinate of a force, and the index of the coordinate."""
    if not force.coordinate:
        raise Untranslatable("it names no coordinate")
    path = draft.tree.path_of(draft.tree.target(force, "coordinate", force.coordinate)) or ""
    place = draft.mechanism.coordinate_index(path)
    if draft.mechanism.coordinates[place].locked:
        raise Untranslatable("its coordinate is locked, so that it moves nothing")
    if place not in draft.leads:
        raise Untranslatable("its coordinate has no joint of its own, being a function of another")
    return draft.leads[place], place
