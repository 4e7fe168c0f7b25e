"""Forces on one coordinate: actuators on its joint, springs as tendons whose length is the coordinate.

Such a tendon is exact, has the force's own name, and leaves room for several springs on one joint.
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
from osimlite.translate.mjcf.draft import Draft, Lead, Unsayable, Value, add

FAR = 1e6
"""A value that no coordinate reaches, for the side of a spring where it does nothing."""


def actuator(draft: Draft, force: CoordinateActuator, path: str, **dynamics: Value) -> str:
    """A force on the joint in proportion to the control."""
    lead, _ = _lead(draft, force)
    return scale_actuator(
        draft, force, path, joint=lead.joint, gear=force.optimal_force / lead.line.slope, **dynamics
    )


def scale_actuator(
    draft: Draft, force: CoordinateActuator | PathActuator, path: str, **on: Value
) -> str:
    """An actuator whose force is its control times its gear."""
    name, ends = draft.name("actuator", path), (force.min_control, force.max_control)
    finite = all(map(math.isfinite, ends)) and ends[0] < ends[1]
    # Only tools keep to these limits in OpenSim.
    limits: dict[str, Value] = {"ctrllimited": False, "ctrlrange": ends} if finite else {}
    add(draft.section("actuator"), "general", name=name, **on, **limits)
    return f"actuator {name}"


def lagging_actuator(draft: Draft, force: ActivationCoordinateActuator, path: str) -> str:
    """The same with an activation that follows the control."""
    made = actuator(
        draft, force, path, dyntype="filterexact", dynprm=force.activation_time_constant
    )
    draft.activations[made.removeprefix("actuator ")] = force.default_activation
    return made


def spring(draft: Draft, force: SpringGeneralizedForce, path: str) -> str:
    """A spring and damper in the tendon that is the coordinate."""
    lead, _ = _lead(draft, force)
    rest = force.rest_length
    return _tendon(
        draft, lead, path, (rest, rest), stiffness=force.stiffness, damping=force.viscosity
    )


def limit(draft: Draft, force: CoordinateLimitForce, path: str) -> str:
    """A spring beyond each limit: a tendon that is slack up to it."""
    lead, place = _lead(draft, force)
    info = draft.mechanism.coordinates[place]
    Ku, qu, Kl, ql, D, t = read_limit_constants(force, info)
    if ql > qu:
        raise Unsayable("its lower limit lies above its upper one")
    if Ku == Kl:
        made = _tendon(draft, lead, path, (ql, qu), stiffness=Ku)
    else:
        made = _tendon(draft, lead, f"{path}_upper", (-FAR, qu), stiffness=Ku)
        made += " " + _tendon(draft, lead, f"{path}_lower", (ql, FAR), stiffness=Kl).removeprefix(
            "tendon "
        )
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
        {"force": Error.of(off, unit), "damping": Error(D, D, f"{unit} s")},
    )
    return made


def _tendon(draft: Draft, lead: Lead, path: str, slack: tuple[float, float], **law: Value) -> str:
    """A tendon whose length is the coordinate but for a constant, with no tension between two of its values."""
    slope, start = lead.line
    ends = [end + start / slope for end in slack]
    name = draft.name("tendon", path)
    tendon = add(draft.section("tendon"), "fixed", name=name, springlength=ends, **law)
    add(tendon, "joint", joint=lead.joint, coef=1.0 / slope)
    return f"tendon {name}"


def _lead(
    draft: Draft, force: CoordinateActuator | SpringGeneralizedForce | CoordinateLimitForce
) -> tuple[Lead, int]:
    """The joint of the coordinate that a force names, and the place of the coordinate."""
    if not force.coordinate:
        raise Unsayable("it names no coordinate")
    path = draft.tree.path_of(draft.tree.target(force, "coordinate", force.coordinate)) or ""
    place = draft.mechanism.coordinate_index(path)
    if draft.mechanism.coordinates[place].locked:
        raise Unsayable("its coordinate is locked, so that it moves nothing")
    if place not in draft.leads:
        raise Unsayable("its coordinate has no joint of its own, being a function of another")
    return draft.leads[place], place
