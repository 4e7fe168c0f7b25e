"""Joints: each body of MuJoCo with its hinges, slides, ball or free joint as OpenSim joints.

MuJoCo applies the joints of a body in order: a slide shifts the body along an axis that earlier
hinges have turned, a hinge turns it about an anchor. Slides followed by up to three hinges with one
anchor are one CustomJoint; its translations come before its rotations, as here. Everything else is
divided into several joints with bodies of zero mass between them.
"""

from __future__ import annotations

import math

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.text import format_count
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.custom_joint import CustomJoint, SpatialTransform, TransformAxis
from osimlite.schema.forces import CoordinateLimitForce
from osimlite.schema.frames import Body, PhysicalFrame
from osimlite.schema.functions import LinearFunction
from osimlite.schema.joints import WeldJoint
from osimlite.schema.springs import ExpressionBasedCoordinateForce, SpringGeneralizedForce
from osimlite.translate.fidelity import LEFT_OUT
from osimlite.translate.mjcf_import.draft import (
    ConversionDraft,
    angles_of,
    quaternion_matrix,
    vector,
)

FREE = 0
"""MuJoCo's ``mjJNT_FREE``."""

BALL = 1
"""MuJoCo's ``mjJNT_BALL``."""

SLIDE = 2
"""MuJoCo's ``mjJNT_SLIDE``."""

HINGE = 3
"""MuJoCo's ``mjJNT_HINGE``."""
SAME_ANCHOR_M = 1e-12
"""Distance up to which two hinges have the same anchor."""
PARALLEL_SINE = 1e-4
"""Sine of the angle below which two axes of a CustomJoint are too near to parallel for OpenSim."""
FREE_RANGE_M = 10.0
"""Range of coordinates that MuJoCo does not limit, in metres; it limits nothing."""
ROTOR_MASS_KG = 1e-9
"""Mass of the rotors that stand for armature; OpenSim ignores the inertia of a body without mass."""
LIMIT_TRANSITION = {"rotational": 0.1, "translational": 1e-4}
"""Distance (deg, m) over which a CoordinateLimitForce reaches its full stiffness."""


class JointGroup(NamedTuple):
    """Joints of MuJoCo that become one joint of OpenSim."""

    slides: tuple[int, ...]
    hinges: tuple[int, ...]
    special: int = -1  # a ball or free joint


def group_joints(draft: ConversionDraft, body: int) -> list[JointGroup]:
    """Return the joints of a body in groups of one OpenSim joint each."""
    model = draft.mj
    groups: list[JointGroup] = []
    slides: list[int] = []
    hinges: list[int] = []
    first = int(model.body_jntadr[body])
    for joint in range(first, first + int(model.body_jntnum[body])):
        joint_type = int(model.jnt_type[joint])
        if joint_type in (FREE, BALL):
            # A ball or free joint is a joint of its own.
            if slides or hinges:
                groups.append(JointGroup(tuple(slides), tuple(hinges)))
                slides, hinges = [], []
            groups.append(JointGroup((), (), joint))
            continue
        # A CustomJoint rotates first and translates in axes of the parent, so that a slide after a
        # hinge needs a new joint.
        fits = (
            not hinges and len(slides) < 3 and _is_independent(model, joint, slides)
            if joint_type == SLIDE
            else len(hinges) < 3
            and _is_independent(model, joint, hinges)
            and (not hinges or _same_anchor(model, joint, hinges[0]))
        )
        if not fits:
            groups.append(JointGroup(tuple(slides), tuple(hinges)))
            slides, hinges = [], []
        (slides if joint_type == SLIDE else hinges).append(joint)
    if slides or hinges:
        groups.append(JointGroup(tuple(slides), tuple(hinges)))
    return groups


def add_joints(draft: ConversionDraft, body: int, frame: Body, parent: PhysicalFrame) -> None:
    """Connect a body to its parent.

    Args:
        draft: OpenSim model under construction.
        body: index of the body.
        frame: OpenSim body of `body`, already in the model.
        parent: frame of the parent body.
    """
    model = draft.mj
    groups = group_joints(draft, body)
    position = np.array(model.body_pos[body])
    rotation = quaternion_matrix(model.body_quat[body])
    if not groups:
        weld = WeldJoint(name=draft.unique("joint", f"{frame.name}_joint"))
        angles = angles_of(rotation)
        draft.model.add(weld.between(parent, frame, at=vector(position), turned=angles))
        return
    for number, group in enumerate(groups):
        is_last = number == len(groups) - 1
        if is_last:
            # Bodies between the groups carry no mass.
            child, suffix = frame, ""
        else:
            name = draft.unique("body", f"{frame.name}_{number + 1}")
            child = Body(name=name, mass=0.0)
            suffix = f"_{number + 1}"
            draft.model.add(child)
        name = draft.unique("joint", f"{frame.name}_joint{suffix}")
        if group.special >= 0:
            joint = _make_special_joint(draft, group.special, name, position, rotation)
            anchor = np.array(model.jnt_pos[group.special])
            if int(model.jnt_type[group.special]) == FREE:
                # MuJoCo's coordinates of a free joint are the pose in the world, not relative to
                # `body_pos`. The child frame is turned, so that the angles are 0 at the default.
                joint.between(parent, child, child_turned=angles_of(rotation.T))
            else:
                joint.between(
                    parent,
                    child,
                    at=vector(position + rotation @ anchor),
                    turned=angles_of(rotation),
                    child_at=vector(anchor),
                )
        else:
            anchor = np.array(model.jnt_pos[(group.hinges or group.slides)[0]])
            joint = _make_custom_joint(draft, group, name)
            joint.between(
                parent,
                child,
                at=vector(position + rotation @ anchor),
                turned=angles_of(rotation),
                child_at=vector(anchor),
            )
        draft.model.add(joint)
        # The following groups begin in the frame of the helper body.
        parent = child
        position = np.zeros(3)
        rotation = np.eye(3)
    if len(groups) > 1:
        draft.record(
            "body",
            body,
            "joints with different anchors, or a slide after a hinge",
            "several joints, connected by bodies without mass; the motion is the same",
            format_count(len(groups) - 1, "helper body"),
        )


def _make_custom_joint(draft: ConversionDraft, group: JointGroup, name: str) -> CustomJoint:
    model = draft.mj
    axes: dict[str, TransformAxis] = {}
    coordinates = []
    for motion, members in (("rotation", group.hinges), ("translation", group.slides)):
        directions = _complete_axes([np.array(model.jnt_axis[joint]) for joint in members])
        for number, direction in enumerate(directions):
            axis = TransformAxis(name=f"{motion}{number + 1}", axis=vector(direction))
            if number < len(members):
                joint = members[number]
                reference = float(model.qpos0[model.jnt_qposadr[joint]])
                coordinate = _make_coordinate(draft, joint, reference)
                axis.coordinates = (coordinate.name,)
                # MuJoCo's hinge is 0 at its reference, where the coordinate has that value.
                axis.function = LinearFunction(name="function", coefficients=(1.0, -reference))
                coordinates.append(coordinate)
            axes[axis.name] = axis
    return _make_joint(name, coordinates, axes)


def _make_coordinate(draft: ConversionDraft, joint: int, value: float) -> Coordinate:
    """Make the coordinate of a hinge or slide.

    Returns:
        Coordinate with its default value and range (rad or m).
    """
    model = draft.mj
    name = draft.unique("coordinate", draft.source.name_of("joint", joint))
    is_rotational = int(model.jnt_type[joint]) == HINGE
    is_limited = bool(model.jnt_limited[joint])
    half_range = math.pi if is_rotational else FREE_RANGE_M
    lower, upper = map(float, model.jnt_range[joint])
    # A range that is not set is 0 to 0.
    if not lower < upper:
        lower = value - half_range
        upper = value + half_range
    if not lower <= value <= upper:
        # OpenSim moves a default value into the range of a clamped coordinate.
        draft.record(
            "joint",
            joint,
            "a default value outside of the range",
            "the range is widened to contain the default",
            f"range {lower:g} to {upper:g}, default {value:g}",
        )
        lower, upper = min(lower, value), max(upper, value)
    coordinate = Coordinate(
        name=name, default_value=value, range=(lower, upper), clamped=is_limited
    )
    draft.coordinates[joint] = (name,)
    draft.made[name] = coordinate
    draft.note_result("joint", joint, f"coordinate {name}")
    return coordinate


def _make_special_joint(
    draft: ConversionDraft, joint: int, name: str, position: Array, rotation: Array
) -> CustomJoint:
    """Make a ball or free joint as a CustomJoint of body-fixed X-Y-Z angles.

    Returns:
        Joint with three coordinates for a ball joint, six for a free joint.
    """
    model = draft.mj
    is_free = int(model.jnt_type[joint]) == FREE
    base = draft.source.name_of("joint", joint)
    suffixes = ("rx", "ry", "rz", "tx", "ty", "tz") if is_free else ("rx", "ry", "rz")
    values = (0.0, 0.0, 0.0, *map(float, position))
    axes = {}
    coordinates = []
    for number, suffix in enumerate(suffixes):
        half_range = math.pi if number < 3 else FREE_RANGE_M
        value = values[number]
        coordinate = Coordinate(
            name=draft.unique("coordinate", f"{base}_{suffix}"),
            default_value=value,
            range=(value - half_range, value + half_range),
        )
        coordinates.append(coordinate)
        draft.made[coordinate.name] = coordinate
        motion = "rotation" if number < 3 else "translation"
        axis_name = f"{motion}{number % 3 + 1}"
        axes[axis_name] = TransformAxis(
            name=axis_name,
            axis=vector(np.eye(3)[number % 3]),
            coordinates=(coordinate.name,),
            function=LinearFunction(name="function", coefficients=(1.0, 0.0)),
        )
    draft.coordinates[joint] = tuple(each_coordinate.name for each_coordinate in coordinates)
    draft.note_result("joint", joint, f"joint {name}")
    draft.record(
        "joint",
        joint,
        "a quaternion, with the components of the angular velocity as speeds",
        "three body-fixed X-Y-Z angles, which are 0 at the default orientation; poses are the "
        "same, but the angles are singular where the second is 90 degrees",
        "coordinates " + " ".join(draft.coordinates[joint]),
    )
    if bool(model.jnt_limited[joint]):
        draft.record(
            "joint",
            joint,
            "a limit of the total angle of a ball joint",
            LEFT_OUT,
            f"at most {float(model.jnt_range[joint, 1]):g} rad",
        )
    return _make_joint(name, coordinates, axes)


def _make_joint(
    name: str, coordinates: list[Coordinate], axes: dict[str, TransformAxis]
) -> CustomJoint:
    transform = SpatialTransform()
    for axis_name, axis in axes.items():
        setattr(transform, axis_name, axis)
    return CustomJoint(name=name, coordinates=coordinates, spatial_transform=transform)


def add_joint_forces(draft: ConversionDraft) -> None:
    """Add springs, dampers, limits and armature of joints, and record friction."""
    # Joints that an equality determines have no limit of their own.
    model = draft.mj
    dependent = _find_dependent_joints(draft)
    for joint in range(model.njnt):
        joint_type = int(model.jnt_type[joint])
        if joint_type in (FREE, BALL):
            _record_special_forces(draft, joint)
            continue
        (name,) = draft.coordinates[joint]
        _add_spring(draft, joint, name)
        _add_armature(draft, joint, name)
        dof = int(model.jnt_dofadr[joint])
        if model.dof_frictionloss[dof]:
            draft.record(
                "joint",
                joint,
                "dry friction of a joint",
                LEFT_OUT,
                f"frictionloss {float(model.dof_frictionloss[dof]):g}",
            )
        if bool(model.jnt_limited[joint]) and joint not in dependent:
            _add_limit(draft, joint, name)
        if bool(model.jnt_actfrclimited[joint]):
            lower, upper = map(float, model.jnt_actfrcrange[joint])
            draft.record(
                "joint",
                joint,
                "a limit of the total force of the actuators of a joint",
                LEFT_OUT,
                f"{lower:g} to {upper:g}",
            )


def _add_spring(draft: ConversionDraft, joint: int, name: str) -> None:
    model = draft.mj
    address, dof = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
    stiffness, rest_position = float(model.jnt_stiffness[joint]), float(model.qpos_spring[address])
    damping = float(model.dof_damping[dof])
    spring_coefficients = _polynomial(model, "jnt_stiffnesspoly", joint)
    damper_coefficients = _polynomial(model, "dof_dampingpoly", dof)
    # SpringGeneralizedForce has a linear spring and damper, of positive numbers.
    if any(spring_coefficients) or any(damper_coefficients) or min(stiffness, damping) < 0.0:
        # MuJoCo: force = -x (k + k1 |x| + k2 x^2), and the same for the speed.
        terms = _force_expression(
            stiffness, spring_coefficients, f"(q-({rest_position!r}))"
        ) + _force_expression(damping, damper_coefficients, "qdot")
        force = ExpressionBasedCoordinateForce(
            name=draft.unique("force", f"{name}_spring"), coordinate=name, expression=terms
        )
        draft.model.add(force)
    elif stiffness or damping:
        draft.model.add(
            SpringGeneralizedForce(
                name=draft.unique("force", f"{name}_spring"),
                coordinate=name,
                stiffness=stiffness,
                rest_length=rest_position if stiffness else 0.0,
                viscosity=damping,
            )
        )


def _polynomial(model: object, name: str, index: int) -> tuple[float, ...]:
    """Return the higher coefficients of a spring or damper; versions before 3.6 have none."""
    rows = getattr(model, name, None)
    if rows is None:
        return ()
    return tuple(float(value) for value in np.atleast_1d(rows[index]))


def _force_expression(linear: float, nonlinear: tuple[float, ...], x: str) -> str:
    """Return the formula -(linear x + nonlinear[0] |x| x + nonlinear[1] x^3 + ...)."""
    text = ""
    for power, value in enumerate((linear, *nonlinear)):
        if value:
            # Even powers need the absolute value, so that the force always resists.
            size = f"abs({x})" if power % 2 else ""
            factor = f"*{x}^{power - power % 2}" if power > 1 else ""
            text += f"-({value!r})*{x}{factor}" + (f"*{size}" if size else "")
    return text


def _add_armature(draft: ConversionDraft, joint: int, name: str) -> None:
    """Add a rotor that has the armature as its inertia and turns as the coordinate does."""
    from osimlite.schema.constraint_types import CoordinateCouplerConstraint
    from osimlite.schema.joints import PinJoint

    model = draft.mj
    armature = float(model.dof_armature[int(model.jnt_dofadr[joint])])
    if not armature:
        return
    is_rotational = int(model.jnt_type[joint]) == HINGE
    unit = "kg m^2" if is_rotational else "kg"
    if draft.options.armature == "none":
        draft.record(
            "joint", joint, "armature", f"{LEFT_OUT}, as requested", f"armature {armature:g} {unit}"
        )
        return
    rotor = Body(
        # The rotor stands in ground, where its inertia acts on the coordinate alone.
        name=draft.unique("body", f"{name}_rotor"),
        mass=ROTOR_MASS_KG,
        inertia=(armature, armature, armature, 0.0, 0.0, 0.0),
    )
    draft.model.add(rotor)
    rotor_coordinate = Coordinate(
        name=draft.unique("coordinate", f"{name}_rotor"),
        default_value=draft.made[name].default_value,
        range=draft.made[name].range,
        is_free_to_satisfy_constraints=True,
    )
    draft.made[rotor_coordinate.name] = rotor_coordinate
    draft.rotors[rotor_coordinate.name] = name
    pin = PinJoint(
        name=draft.unique("joint", f"{name}_rotor_joint"), coordinates=[rotor_coordinate]
    )
    draft.model.add(pin.between(draft.model.ground, rotor))
    draft.model.add(
        CoordinateCouplerConstraint(
            name=draft.unique("constraint", f"{name}_rotor_coupler"),
            coupled_coordinates_function=LinearFunction(
                name="coupled_coordinates_function", coefficients=(1.0, 0.0)
            ),
            independent_coordinate_names=(name,),
            dependent_coordinate_name=rotor_coordinate.name,
        )
    )
    draft.record(
        "joint",
        joint,
        "armature",
        "an additional body (rotor) with this inertia, which a coupler turns with the coordinate (exact)",
        f"armature {armature:g} {unit}, body {rotor.name}",
    )


def _add_limit(draft: ConversionDraft, joint: int, name: str) -> None:
    """Add a stiff spring beyond the range of a joint."""
    model = draft.mj
    lower, upper = map(float, model.jnt_range[joint])
    text = f"range {lower:g} to {upper:g}"
    if draft.options.limits == "range":
        draft.record(
            "joint",
            joint,
            "a soft joint limit",
            "only the range of the coordinate is written",
            text,
        )
        return
    dof = int(model.jnt_dofadr[joint])
    stiffness, damping = compute_softness(
        model.jnt_solref[joint], model.jnt_solimp[joint], float(model.dof_invweight0[dof])
    )
    is_rotational = int(model.jnt_type[joint]) == HINGE
    # CoordinateLimitForce has degrees for rotations.
    scale = math.pi / 180.0 if is_rotational else 1.0
    draft.model.add(
        CoordinateLimitForce(
            name=draft.unique("force", f"{name}_limit"),
            coordinate=name,
            upper_stiffness=stiffness * scale,
            upper_limit=upper / scale,
            lower_stiffness=stiffness * scale,
            lower_limit=lower / scale,
            damping=damping * scale,
            transition=LIMIT_TRANSITION["rotational" if is_rotational else "translational"],
        )
    )
    units = ("N m/rad", "N m s/rad") if is_rotational else ("N/m", "N s/m")
    draft.record(
        "joint",
        joint,
        "a soft joint limit",
        "a CoordinateLimitForce with the stiffness of MuJoCo's limit at rest in the default pose",
        f"{text}, stiffness {stiffness:.4g} {units[0]}, damping {damping:.4g} {units[1]}",
    )


def compute_softness(
    reference: Array, impedance: Array, inverse_mass: float
) -> tuple[float, float]:
    """Return stiffness and damping of a spring that yields as a constraint of MuJoCo does at rest.

    MuJoCo's constraint accelerates with (1 - d) a0 + d (-b v - k r) (Computation, "Constraint
    model"), so that a load F at rest is held at r = F (1 - d) / (d k m). The impedance d is that of
    a deep violation (`dmax`).

    Args:
        reference: MuJoCo's ``solref`` (2,): time constant (s) and damping ratio, or -stiffness and
            -damping.
        impedance: MuJoCo's ``solimp`` (5,).
        inverse_mass: inverse of the effective mass in the default pose.

    Returns:
        Stiffness and damping in the units of the mass.
    """
    first, second = map(float, reference[:2])
    # MuJoCo limits impedances in this way.
    most = min(max(float(impedance[1]), 1e-4), 0.9999)
    # A positive first number is a time constant, a negative one the stiffness.
    if first > 0.0:
        k = 1.0 / max(most * most * first * first * second * second, 1e-15)
        b = 2.0 / max(most * first, 1e-15)
    else:
        k = -first / most**2
        b = -second / most
    mass = 1.0 / max(inverse_mass, 1e-9)
    factor = mass * most / (1.0 - most)
    return max(factor * k, 1e-9), max(factor * b, 0.0)


def _record_special_forces(draft: ConversionDraft, joint: int) -> None:
    """Record as left out the stiffness, damping, armature and friction of a ball or free joint."""
    model = draft.mj
    first = int(model.jnt_dofadr[joint])
    count = 6 if int(model.jnt_type[joint]) == FREE else 3
    dofs = slice(first, first + count)
    for quantity, values in (
        ("stiffness", np.atleast_1d(model.jnt_stiffness[joint])),
        ("damping", model.dof_damping[dofs]),
        ("armature", model.dof_armature[dofs]),
        ("dry friction", model.dof_frictionloss[dofs]),
    ):
        if np.any(values):
            draft.record(
                "joint",
                joint,
                f"{quantity} of a ball or free joint",
                LEFT_OUT,
                f"{quantity} " + " ".join(f"{float(value):g}" for value in dict.fromkeys(values)),
            )


def _find_dependent_joints(draft: ConversionDraft) -> set[int]:
    """Return the joints that an active equality determines."""
    model, equality_types = draft.mj, draft.source.mujoco.mjtEq
    return {
        int(model.eq_obj1id[number])
        for number in range(model.neq)
        if int(model.eq_type[number]) == int(equality_types.mjEQ_JOINT) and model.eq_active0[number]
    }


def _same_anchor(model: object, first: int, second: int) -> bool:
    positions = model.jnt_pos  # type: ignore[attr-defined]
    return bool(np.linalg.norm(positions[first] - positions[second]) <= SAME_ANCHOR_M)


def _is_independent(model: object, joint: int, other_joints: list[int]) -> bool:
    """Return whether no other axis is parallel to that of a joint."""
    axes = model.jnt_axis  # type: ignore[attr-defined]
    return all(
        float(np.linalg.norm(np.cross(axes[joint], axes[other_joint]))) > PARALLEL_SINE
        for other_joint in other_joints
    )


def _complete_axes(axes: list[Array]) -> list[Array]:
    """Return a list of axes, completed to three by axes perpendicular to them."""
    result = list(axes)
    while len(result) < 3:
        if not result:
            result.append(np.array((1.0, 0.0, 0.0)))
        elif len(result) == 1:
            # The basis vector least aligned with the axis keeps the cross product far from zero.
            basis_vector = np.eye(3)[int(np.argmin(np.abs(result[0])))]
            perpendicular = np.cross(result[0], basis_vector)
            result.append(perpendicular / np.linalg.norm(perpendicular))
        else:
            perpendicular = np.cross(result[0], result[1])
            result.append(perpendicular / np.linalg.norm(perpendicular))
    return result
