"""Actuators, and springs of tendons, on coordinates, paths and bodies."""

from __future__ import annotations

from typing import Any

import numpy as np

from osimlite.base.progress import report_progress
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.actuators import (
    ActivationCoordinateActuator,
    CoordinateActuator,
    PointActuator,
    TorqueActuator,
)
from osimlite.schema.forces import ScalarActuator
from osimlite.schema.functions import LinearFunction
from osimlite.schema.muscles import PathActuator
from osimlite.schema.path_forces import ExpressionBasedPathForce, PathSpring
from osimlite.schema.paths import FunctionBasedPath
from osimlite.schema.springs import ExpressionBasedCoordinateForce, SpringGeneralizedForce
from osimlite.translate.fidelity import LEFT_OUT
from osimlite.translate.mjcf_import.draft import (
    ConversionDraft,
    TendonPath,
    quaternion_matrix,
    vector,
)
from osimlite.translate.mjcf_import.joints import BALL, FREE
from osimlite.translate.mjcf_import.muscles import make_muscle
from osimlite.translate.mjcf_import.poses import compute_poses, sample_qpos
from osimlite.translate.mjcf_import.tendon_lengths import read_tendon, tendon_lengths

LENGTH_POSES = 60
"""Number of poses in which forces of muscles are compared."""


def add_actuators(draft: ConversionDraft) -> None:
    """Add all actuators, and the springs of tendons."""
    model, mujoco = draft.mj, draft.source.mujoco
    lengths = _sample_lengths(draft)
    transmissions = mujoco.mjtTrn
    count = len(model.actuator_trntype)
    for actuator in range(count):
        report_progress("converting actuators", actuator, count)
        transmission = int(model.actuator_trntype[actuator])
        target = int(model.actuator_trnid[actuator, 0])
        is_muscle = int(model.actuator_gaintype[actuator]) == int(mujoco.mjtGain.mjGAIN_MUSCLE)
        if not draft.has_one_control(actuator):
            draft.drop("actuator", actuator, "an actuator with several controls or outputs")
        elif transmission in (
            int(transmissions.mjTRN_JOINT),
            int(transmissions.mjTRN_JOINTINPARENT),
        ):
            if int(model.jnt_type[target]) in (FREE, BALL):
                draft.drop("actuator", actuator, "an actuator of a ball or free joint")
            elif is_muscle:
                _add_joint_muscle(draft, actuator, target)
            else:
                _add_joint_actuator(draft, actuator, target)
        elif transmission == int(transmissions.mjTRN_TENDON):
            path = draft.paths[target]
            # The gear of a tendon has one number that counts.
            gear = float(model.actuator_gear[draft.get_output_index(actuator), 0])
            if is_muscle:
                muscle = make_muscle(
                    draft, actuator, _copy(path), gear, lengths[target] + path.shift
                )
                if muscle is not None:
                    draft.model.add(muscle)
            else:
                _add_path_actuator(draft, actuator, path, gear)
        elif transmission == int(transmissions.mjTRN_SITE) and not is_muscle:
            _add_site_actuator(draft, actuator, target)
        else:
            draft.drop(
                "actuator",
                actuator,
                "an actuator that acts through adhesion, a slider-crank or another unsupported transmission",
            )
    _add_tendon_springs(draft)


def _sample_lengths(draft: ConversionDraft) -> Array:
    """Return lengths (T, P) of all tendons in sampled poses, m."""
    source = draft.source
    tendons = [read_tendon(source, index) for index in range(draft.mj.ntendon)]
    poses = compute_poses(source, sample_qpos(source, LENGTH_POSES, 3))
    return tendon_lengths(source, tendons, poses, draft.version)


# A component has one owner.
def _copy(path: TendonPath) -> TendonPath:
    """Return a copy of a path: several actuators may pull at one tendon."""
    return TendonPath(path.path.copy_deep(), path.shift)


def _read_gain(
    draft: ConversionDraft, actuator: int
) -> tuple[float, tuple[float, float, float]] | None:
    """Return gain and bias of an actuator; None if the force is no linear function of the control."""
    model, mujoco = draft.mj, draft.source.mujoco
    gain, bias = int(model.actuator_gaintype[actuator]), int(model.actuator_biastype[actuator])
    numbers = [float(value) for value in model.actuator_gainprm[actuator, :3]]
    # An affine gain without slopes is a fixed gain.
    if gain == int(mujoco.mjtGain.mjGAIN_AFFINE) and not any(numbers[1:]):
        gain = int(mujoco.mjtGain.mjGAIN_FIXED)
    if gain != int(mujoco.mjtGain.mjGAIN_FIXED) or not numbers[0]:
        return None
    if bias == int(mujoco.mjtBias.mjBIAS_NONE):
        return numbers[0], (0.0, 0.0, 0.0)
    if bias != int(mujoco.mjtBias.mjBIAS_AFFINE):
        return None
    constant, by_length, by_speed = map(float, model.actuator_biasprm[actuator, :3])
    return numbers[0], (constant, by_length, by_speed)


def _read_dynamics(draft: ConversionDraft, actuator: int) -> float | None:
    """Return the time constant (s) of an actuator, 0 without dynamics; None if it has others."""
    model, dynamics_types = draft.mj, draft.source.mujoco.mjtDyn
    dynamics = int(model.actuator_dyntype[actuator])
    if dynamics == int(dynamics_types.mjDYN_NONE):
        return 0.0
    if dynamics in (int(dynamics_types.mjDYN_FILTER), int(dynamics_types.mjDYN_FILTEREXACT)):
        return float(model.actuator_dynprm[actuator, 0])
    return None


def _read_linear_law(
    draft: ConversionDraft, actuator: int, gear: float
) -> tuple[float, tuple[float, float, float], float] | None:
    """Return gain, bias and time constant (s) of a force that is a linear function of the control.

    The bias has a constant and factors of length and speed. For any other actuator it
    returns None, and the draft has a record of it.

    Args:
        draft: draft of the model.
        actuator: index of the actuator.
        gear: gear of the actuator; with 0 it has no force, and is left out.
    """
    gain_and_bias, delay = _read_gain(draft, actuator), _read_dynamics(draft, actuator)
    if gain_and_bias is None or delay is None or not gear:
        draft.drop(
            "actuator",
            actuator,
            "a force that is not a linear function of the control, or other dynamics",
        )
        return None
    return *gain_and_bias, delay


def _set_limits(
    draft: ConversionDraft, actuator: int, force: ScalarActuator, gain: float, biased: bool
) -> None:
    """Set the range of the control, and record what a limit of the force becomes."""
    model = draft.mj
    lower, upper = -np.inf, np.inf
    if model.actuator_ctrllimited[draft.get_control_index(actuator)]:
        # No limit is infinite in OpenSim.
        lower, upper = map(float, model.actuator_ctrlrange[draft.get_control_index(actuator)])
    if model.actuator_forcelimited[actuator]:
        limits = [float(value) for value in model.actuator_forcerange[actuator]]
        text = f"{limits[0]:g} to {limits[1]:g}"
        if biased:
            draft.record(
                "actuator", actuator, "a limit of a force that depends on motion", LEFT_OUT, text
            )
        else:
            # Gains may be negative, which exchanges the limits.
            control_limits = sorted(limit / gain for limit in limits)
            lower, upper = max(lower, control_limits[0]), min(upper, control_limits[1])
            draft.record(
                "actuator", actuator, "a limit of the force", "a limit of the control", text
            )
    force.min_control, force.max_control = lower, upper


def _add_joint_actuator(draft: ConversionDraft, actuator: int, joint: int) -> None:
    gear = float(draft.mj.actuator_gear[draft.get_output_index(actuator), 0])
    law = _read_linear_law(draft, actuator, gear)
    if law is None:
        return
    gain, (constant, by_length, by_speed), delay = law
    coordinate = draft.coordinates[joint][0]
    name = draft.unique("force", draft.source.name_of("actuator", actuator))
    force: CoordinateActuator
    if delay:
        force = ActivationCoordinateActuator(
            name=name,
            coordinate=coordinate,
            optimal_force=gain * gear,
            activation_time_constant=delay,
            default_activation=0.0,
        )
    else:
        force = CoordinateActuator(name=name, coordinate=coordinate, optimal_force=gain * gear)
    biased = any((constant, by_length, by_speed))
    _set_limits(draft, actuator, force, gain, biased)
    draft.model.add(force)
    result = f"{type(force).__name__} {name}"
    if biased:
        # The force is gear (constant + by_length gear q + by_speed gear u).
        stiffness, viscosity = -by_length * gear * gear, -by_speed * gear * gear
        spring = draft.unique("force", f"{name}_bias")
        # A negative stiffness or a constant force is not what SpringGeneralizedForce means.
        if (stiffness > 0.0 and viscosity >= 0.0) or not (stiffness or constant):
            draft.model.add(
                SpringGeneralizedForce(
                    name=spring,
                    coordinate=coordinate,
                    stiffness=stiffness,
                    rest_length=gear * constant / stiffness if stiffness else 0.0,
                    viscosity=viscosity,
                )
            )
        else:
            draft.model.add(
                ExpressionBasedCoordinateForce(
                    name=spring,
                    coordinate=coordinate,
                    expression=(f"({gear * constant!r})-({stiffness!r})*q-({viscosity!r})*qdot"),
                )
            )
        result += f" and {spring}: a servo as an actuator and a passive spring"
    draft.note_result("actuator", actuator, result)


def _add_joint_muscle(draft: ConversionDraft, actuator: int, joint: int) -> None:
    """Add a muscle whose length is a multiple of a joint position."""
    model = draft.mj
    gear = float(model.actuator_gear[draft.get_output_index(actuator), 0])
    lower, upper = draft.made[draft.coordinates[joint][0]].range
    shortest = min(gear * lower, gear * upper)
    # OpenSim's paths have positive lengths: 1 cm at least.
    shift = max(0.0, 0.01 - shortest)
    path = FunctionBasedPath(
        name="path",
        coordinate_paths=(draft.coordinate_path(joint),),
        length_function=LinearFunction(name="length_function", coefficients=(gear, shift)),
    )
    lengths = np.linspace(gear * lower, gear * upper, LENGTH_POSES) + shift
    muscle = make_muscle(draft, actuator, TendonPath(path, shift), 1.0, lengths)
    if muscle is not None:
        draft.model.add(muscle)
        draft.record(
            "actuator",
            actuator,
            "a muscle that acts directly on a joint, without a path",
            "a FunctionBasedPath: a linear function of the coordinate",
        )


def _add_path_actuator(
    draft: ConversionDraft, actuator: int, path: TendonPath, gear: float
) -> None:
    """Add an actuator of a tendon; a positive force of MuJoCo lengthens it, OpenSim's shortens it."""
    law = _read_linear_law(draft, actuator, gear)
    if law is None:
        return
    gain, (constant, by_length, by_speed), delay = law
    name = draft.unique("force", draft.source.name_of("actuator", actuator))
    force = PathActuator(name=name, geometry_path=_copy(path).path, optimal_force=-gain * gear)
    biased = any((constant, by_length, by_speed))
    _set_limits(draft, actuator, force, gain, biased)
    draft.model.add(force)
    result = f"PathActuator {name}"
    if biased:
        spring = draft.unique("force", f"{name}_bias")
        draft.model.add(
            ExpressionBasedPathForce(
                name=spring,
                geometry_path=_copy(path).path,
                resting_length=path.shift,
                # MuJoCo's spring also pushes.
                clamp_stretch=False,
                expression=(
                    f"({-gear * constant!r})-({by_length * gear * gear!r})*s"
                    f"-({by_speed * gear * gear!r})*ldot"
                ),
            )
        )
        result += f" and {spring}"
    if delay:
        draft.record(
            "actuator", actuator, "a delay of the control of a tendon", LEFT_OUT, f"{delay:g} s"
        )
    draft.note_result("actuator", actuator, result)


def _add_site_actuator(draft: ConversionDraft, actuator: int, site: int) -> None:
    """Add a force or a torque at a site."""
    model = draft.mj
    gain_and_bias, delay = _read_gain(draft, actuator), _read_dynamics(draft, actuator)
    gear = np.array(model.actuator_gear[draft.get_output_index(actuator)])
    force = gear[:3]
    torque = gear[3:]
    body = int(model.site_bodyid[site])
    if (
        gain_and_bias is None
        or delay != 0.0
        or any(gain_and_bias[1])
        # A reference site, or a force together with a torque, has no counterpart in one actuator.
        or int(model.actuator_trnid[actuator, 1]) >= 0
        or force.any() == torque.any()
        or body == 0
    ):
        draft.drop(
            "actuator",
            actuator,
            "a force and a torque at a site together, or relative to another site",
        )
        return
    name = draft.unique("force", draft.source.name_of("actuator", actuator))
    rotation = quaternion_matrix(model.site_quat[site])
    frame = draft.frames[body].name
    actuator_force: PointActuator | TorqueActuator
    if force.any():
        size = float(np.linalg.norm(force))
        actuator_force = PointActuator(
            name=name,
            body=frame,
            point=vector(model.site_pos[site]),
            direction=vector(rotation @ force / size),
            optimal_force=gain_and_bias[0] * size,
        )
    else:
        size = float(np.linalg.norm(torque))
        actuator_force = TorqueActuator(
            name=name,
            bodyA=frame,
            bodyB="ground",
            torque_is_global=False,
            axis=vector(rotation @ torque / size),
            optimal_force=gain_and_bias[0] * size,
        )
    _set_limits(draft, actuator, actuator_force, gain_and_bias[0], biased=False)
    draft.model.add(actuator_force)
    draft.note_result("actuator", actuator, f"{type(actuator_force).__name__} {name}")


def _add_tendon_springs(draft: ConversionDraft) -> None:
    """Add the springs and dampers of tendons; a tendon without any force keeps its path."""
    model = draft.mj
    driven_tendons = {
        int(model.actuator_trnid[actuator, 0])
        for actuator in range(len(model.actuator_trntype))
        if int(model.actuator_trntype[actuator]) == int(draft.source.mujoco.mjtTrn.mjTRN_TENDON)
    }
    for tendon in range(model.ntendon):
        path = draft.paths[tendon]
        name = draft.source.name_of("tendon", tendon)
        stiffness = float(model.tendon_stiffness[tendon])
        damping = float(model.tendon_damping[tendon])
        if stiffness or damping:
            # MuJoCo's spring has a dead band between two lengths, and pushes below it.
            shorter_limit, longer_limit = (
                float(value) for value in np.atleast_1d(model.tendon_lengthspring[tendon])
            )
            terms = []
            if stiffness:
                terms += [
                    f"{stiffness!r}*(s-({longer_limit!r}))*step(s-({longer_limit!r}))",
                    f"{stiffness!r}*(s-({shorter_limit!r}))*step(({shorter_limit!r})-s)",
                ]
            if damping:
                terms.append(f"{damping!r}*ldot")
            draft.model.add(
                ExpressionBasedPathForce(
                    name=draft.unique("force", f"{name}_spring"),
                    geometry_path=_copy(path).path,
                    resting_length=path.shift,
                    clamp_stretch=False,
                    expression="+".join(terms),
                )
            )
        # A PathSpring keeps the path, so that its length can be read.
        elif tendon not in driven_tendons:
            draft.model.add(
                PathSpring(
                    name=draft.unique("force", name),
                    geometry_path=_copy(path).path,
                    resting_length=max(float(model.tendon_length0[tendon]) + path.shift, 0.0),
                    stiffness=0.0,
                    dissipation=0.0,
                )
            )
            draft.record(
                "tendon",
                tendon,
                "a tendon without a force",
                "a PathSpring without stiffness, so that its length can be read",
            )
        for description, value in (
            ("a limit of the length of a tendon", model.tendon_limited[tendon]),
            ("dry friction of a tendon", model.tendon_frictionloss[tendon]),
            ("armature of a tendon", _optional(model, "tendon_armature", tendon)),
            ("a nonlinear spring of a tendon", _optional(model, "tendon_stiffnesspoly", tendon)),
            ("a nonlinear damper of a tendon", _optional(model, "tendon_dampingpoly", tendon)),
        ):
            if np.any(value):
                draft.drop("tendon", tendon, description)


def _optional(model: Any, name: str, index: int) -> Any:
    """Return a number of the compiled model that older versions of MuJoCo do not have."""
    rows = getattr(model, name, None)
    return 0.0 if rows is None else rows[index]
