"""Forces on bodies: between two points, at a point, about an axis, and between two frames."""

from __future__ import annotations

import numpy as np

from osimlite.mechanics.multibody.mechanism import GROUND, FramePlacement
from osimlite.mechanics.multibody.spatial import Array, angles_xyz, invert_transform
from osimlite.schema.actuators import (
    BodyActuator,
    PointActuator,
    PointToPointActuator,
    TorqueActuator,
)
from osimlite.schema.base import Component
from osimlite.schema.fields import Vec3
from osimlite.schema.springs import BushingForce, PointToPointSpring
from osimlite.translate.mjcf.draft import (
    SPECK_MASS_KG,
    MjcfDraft,
    Untranslatable,
    Value,
    add_element,
    format_spring_length,
)

GROUND_FRAME = FramePlacement(GROUND, np.eye(4))
"""Frame of ground."""
AXIS_NAMES = ("rx", "ry", "rz", "tx", "ty", "tz")
"""Names of rotations and translations, in the order of OpenSim's six numbers."""


def add_point_spring(draft: MjcfDraft, force: PointToPointSpring, path: str) -> str:
    """Add a tendon with a spring between two sites.

    Args:
        draft: MJCF under construction.
        force: spring of the model.
        path: absolute path of the spring.

    Returns:
        Kind and name of the element.
    """
    # OpenSim takes both points in the bodies, whatever frames are named.
    site_names = [
        _add_point_site(draft, force, path, "socket_body1", force.point1),
        _add_point_site(draft, force, path, "socket_body2", force.point2),
    ]
    tendon = add_straight_tendon(
        draft,
        path,
        site_names,
        stiffness=force.stiffness,
        springlength=format_spring_length(force.rest_length, force.rest_length),
    )
    return f"tendon {tendon}"


def add_point_to_point_actuator(draft: MjcfDraft, force: PointToPointActuator, path: str) -> str:
    """Add an actuator on a tendon between two sites; in MuJoCo, too, a positive force lengthens it.

    Args:
        draft: MJCF under construction.
        force: actuator of the model.
        path: absolute path of the actuator.

    Returns:
        Kind and name of the element.

    Raises:
        Untranslatable: its points are fixed in ground.
    """
    if force.points_are_global:
        raise Untranslatable("its points are fixed in ground, so they move relative to the bodies")
    site_names = [
        _add_point_site(draft, force, path, "bodyA", force.pointA),
        _add_point_site(draft, force, path, "bodyB", force.pointB),
    ]
    # The gear scales the control to a force.
    name = draft.make_name("actuator", path)
    add_element(
        draft.get_section("actuator"),
        "motor",
        name=name,
        tendon=add_straight_tendon(draft, path, site_names),
        gear=force.optimal_force,
    )
    return f"actuator {name}"


def add_torque_actuator(draft: MjcfDraft, force: TorqueActuator, path: str) -> str:
    """Add a torque on a site, with axes of a second site, whose body takes the reaction.

    Args:
        draft: MJCF under construction.
        force: actuator of the model.
        path: absolute path of the actuator.

    Returns:
        Kind and name of the element.

    Raises:
        Untranslatable: its axis is fixed in ground while both bodies move.
    """
    first = draft.find_placement(force, "bodyA")
    # Without body B the reaction acts on ground.
    second = draft.find_placement(force, "bodyB") if force.bodyB else GROUND_FRAME
    gear = np.append(np.zeros(3), _normalize_axis(force.axis) * force.optimal_force)
    first_site = draft.add_site(path, *first)
    # The axis is fixed in body B; MuJoCo applies the torque in the axes of the reference site.
    if not force.torque_is_global:
        # The opposite torque on the other body, with the sign reversed, is the same.
        return _add_site_motor(draft, path, -gear, draft.add_site(path, *second), first_site)
    if second.body != GROUND:
        raise Untranslatable("its axis is fixed in ground while both its bodies move")
    return _add_site_motor(draft, path, gear, first_site, draft.add_site(path, *GROUND_FRAME))


def add_point_actuator(draft: MjcfDraft, force: PointActuator, path: str) -> str:
    """Add a force on a site, with the axes of its body or of a site in ground.

    Args:
        draft: MJCF under construction.
        force: actuator of the model.
        path: absolute path of the actuator.

    Returns:
        Kind and name of the element.

    Raises:
        Untranslatable: its point is fixed in ground.
    """
    if force.point_is_global:
        # A direction in ground needs a site there as the reference.
        raise Untranslatable("its point is fixed in ground, so it moves relative to the body")
    gear = np.append(_normalize_axis(force.direction) * force.optimal_force, np.zeros(3))
    site = _add_point_site(draft, force, path, "body", force.point)
    return _add_site_motor(
        draft,
        path,
        gear,
        site,
        draft.add_site(path, *GROUND_FRAME) if force.force_is_global else None,
    )


def add_straight_tendon(draft: MjcfDraft, path: str, sites: list[str], **law: Value) -> str:
    """Add a tendon through sites.

    Args:
        draft: MJCF under construction.
        path: absolute path of the component after which it is named.
        sites: names of the sites.
        law: attributes of its spring.

    Returns:
        Name of the tendon.
    """
    name = draft.make_name("tendon", path)
    tendon = add_element(draft.get_section("tendon"), "spatial", name=name, **law)
    for site in sites:
        add_element(tendon, "site", site=site)
    return name


def _add_site_motor(
    draft: MjcfDraft, path: str, gear: Array, site: str, axes: str | None = None
) -> str:
    """Add a motor at a site with a gear (6,), along the axes of another site if one is named.

    Returns:
        Kind and name of the element.
    """
    name = draft.make_name("actuator", path)
    add_element(
        draft.get_section("actuator"), "motor", name=name, site=site, refsite=axes, gear=gear
    )
    return f"actuator {name}"


def _add_point_site(draft: MjcfDraft, owner: Component, path: str, socket: str, point: Vec3) -> str:
    """Add a site at a point of a body.

    OpenSim uses the body even where the socket names a frame on it.

    Returns:
        Name of the site.
    """
    return draft.add_site(path, draft.find_placement(owner, socket).body, np.array(point))


def _normalize_axis(axis: tuple[float, float, float]) -> Array:
    """Return a direction as a unit vector (3,).

    Raises:
        Untranslatable: the direction is zero.
    """
    length = float(np.linalg.norm(axis))
    if length == 0.0:
        raise Untranslatable("its direction is zero")
    return np.array(axis) / length


def add_body_actuator(draft: MjcfDraft, force: BodyActuator, path: str) -> str:
    """Add six actuators in the order of the controls: torques, then forces.

    Args:
        draft: MJCF under construction.
        force: actuator of the model.
        path: absolute path of the actuator.

    Returns:
        Kinds and names of the elements.

    Raises:
        Untranslatable: its point is fixed in ground.
    """
    if force.point_is_global:
        raise Untranslatable("its point is fixed in ground, so it moves relative to the body")
    site = _add_point_site(draft, force, path, "socket_body", force.point)
    axes = draft.add_site(path, *GROUND_FRAME) if force.spatial_force_is_global else None
    # MuJoCo's gear has the force first, and then the torque.
    unit_gears = np.eye(6)[[3, 4, 5, 0, 1, 2]]
    actuators = [
        _add_site_motor(draft, f"{path}_{axis_name}", unit, site, axes)
        for axis_name, unit in zip(AXIS_NAMES, unit_gears, strict=True)
    ]
    return " ".join(actuators)


def add_bushing(draft: MjcfDraft, force: BushingForce, path: str) -> str:
    """Add a small body on six springs in the first frame, welded to the second.

    The joints are the six deviations of OpenSim's law, so that it is exact except for the
    compliance of the weld.

    Args:
        draft: MJCF under construction.
        force: bushing of the model.
        path: absolute path of the bushing.

    Returns:
        Kind and name of the element.
    """
    (first_body, first_frame), second = (
        draft.find_placement(force, "socket_frame1"),
        draft.find_placement(force, "socket_frame2"),
    )
    name = draft.make_name("bushing", path)
    carrier = draft.add_speck(name, draft.bodies[first_body], first_frame)
    state = draft.mechanism.at(draft.default_state[0])
    # Deviations in the default pose, at which the joints start.
    deviation = (
        invert_transform(state.transform(first_body) @ first_frame)
        @ state.transform(second[0])
        @ second[1]
    )
    starts = (*angles_xyz(deviation[:3, :3]), *deviation[:3, 3])
    stiffness = (*force.rotational_stiffness, *force.translational_stiffness)
    damping = (*force.rotational_damping, *force.translational_damping)
    # OpenSim measures translations along the axes of the first frame, so that they come first.
    for k in (3, 4, 5, 0, 1, 2):
        joint = draft.make_name("joint", f"{name}_{AXIS_NAMES[k]}")
        draft.starts[joint] = starts[k]
        joint_type = ("hinge", "slide")[k // 3]
        axis = np.eye(3)[k % 3]
        add_element(
            carrier,
            "joint",
            name=joint,
            type=joint_type,
            axis=axis,
            stiffness=stiffness[k],
            damping=damping[k],
        )
    add_element(carrier, "site", name=draft.make_name("site", f"{name}_speck"))
    weld = draft.make_name("equality", path)
    weld_sites = {"site1": f"{name}_speck", "site2": draft.add_site(path, *second)}
    add_element(draft.get_section("equality"), "weld", name=weld, **weld_sites)
    draft.fidelity.add(
        "bushing",
        path,
        "a spring and damper between two frames",
        f"a body of {SPECK_MASS_KG:g} kg on six springs, welded to the second frame",
        f"equality {weld}",
    )
    return f"equality {weld}"
