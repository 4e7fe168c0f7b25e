"""Outputs of components along a motion, as OpenSim defines them.

An output is a number (t, 1), a vector (t, 3) or a spatial vector (t, 6), angular part first, along
the axes of ground.
"""

from __future__ import annotations

from collections.abc import Callable
from operator import itemgetter
from typing import Any

import numpy as np

from osimlite.errors import UnsupportedError
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.base import Component
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.forces import Force, ScalarActuator
from osimlite.schema.frames import Body, Frame
from osimlite.schema.joints import Joint
from osimlite.schema.markers import Station
from osimlite.schema.millard_muscles import Millard2012AccelerationMuscle
from osimlite.schema.model import Model
from osimlite.schema.muscles import Muscle, PathActuator
from osimlite.schema.paths import GeometryPath, PathPoint
from osimlite.simulation.elements.muscle import SPRING
from osimlite.tools.motion import Motion
from osimlite.tools.muscle_quantities import CORRECTIONS, LAW_RECORDS, compute_quantities
from osimlite.tools.reaction_forces import JointWrenches

Reader = Callable[[Motion, Any, str], Array]
"""Function that computes an output (t, k) from the motion, the component and its path."""


def find_reader(motion: Motion, component: Component, name: str) -> Reader | None:
    """Return the function that computes an output; None if osimlite does not support the output.

    Args:
        motion: motion along which the output is computed.
        component: component of the motion's model.
        name: name of the output.
    """
    for cls in type(component).__mro__:
        reader = READERS.get(cls, {}).get(name)
        if reader is not None:
            return reader
    path = motion.model.tree().path_of(component) or ""
    is_supported = name not in LAW_OUTPUTS or (
        isinstance(component, Muscle) and motion.system.has_quantity(path, LAW_OUTPUTS[name])
    )
    is_supported &= name not in UNSUPPORTED_OUTPUTS.get(type(component), ())
    if (
        isinstance(component, Muscle)
        and type(component) in CORRECTIONS
        and name in MUSCLE_OUTPUTS
        and is_supported
    ):
        return lambda motion, muscle, path: _read_muscle_output(
            motion, muscle, path, MUSCLE_OUTPUTS[name]
        )
    # In OpenSim every state is an output of its component, too.
    if f"{path}/{name}" in motion.histories:
        return lambda motion, _, path: motion.histories[f"{path}/{name}"][:, None]
    return None


def _create_frame_reader(quantity: str) -> Reader:
    """Return a reader of the position, velocity or acceleration of a frame."""

    def read_frame(motion: Motion, frame: Frame, path: str) -> Array:
        """Return the quantity of a frame (t, k) in ground."""
        body, frame_in_body = motion.mechanism.placement(path)
        turning = motion.links.get_angular_motion(body)
        moving = motion.links.compute_point_motion(body, frame_in_body[:3, 3])
        return {
            "position": lambda: moving[0],
            "angular_velocity": lambda: turning[0],
            "linear_velocity": lambda: moving[1],
            "velocity": lambda: np.hstack((turning[0], moving[1])),
            "angular_acceleration": lambda: turning[1],
            "linear_acceleration": lambda: moving[2],
            "acceleration": lambda: np.hstack((turning[1], moving[2])),
        }[quantity]()

    return read_frame


def _create_station_reader(derivative_order: int) -> Reader:
    """Return a reader of a point that is fixed in a frame.

    Args:
        derivative_order: 0 for the position, 1 for the velocity, 2 for the acceleration.
    """

    def read_station(motion: Motion, station: Station | PathPoint, path: str) -> Array:
        tree = motion.model.tree()
        holder = tree.parent_of(station)
        if isinstance(holder, PathPoint):
            # In OpenSim the location of a path point belongs to a station inside it.
            station = holder
        frame = tree.target(station, "socket_parent_frame", station.socket_parent_frame)
        body, frame_in_body = motion.mechanism.placement(tree.path_of(frame) or "")
        point = (
            frame_in_body[:3, :3] @ np.array(station.location, dtype=float) + frame_in_body[:3, 3]
        )
        return motion.links.compute_point_motion(body, point)[derivative_order]

    return read_station


def _create_momentum_reader(about_origin: bool, components: slice) -> Reader:
    """Return a reader of the momentum of a body.

    Args:
        about_origin: whether the angular momentum is about the body's origin, not its mass centre.
        components: components to return, angular part first.
    """

    def read_momentum(motion: Motion, body: Body, path: str) -> Array:
        """Return the momentum of a body (t, k), N m s and N s."""
        index, _ = motion.mechanism.placement(path)
        mass = motion.mechanism.bodies[index].mass_properties
        rotation, origin = motion.links.locate_frame(index, np.eye(4))
        center, velocity, _ = motion.links.compute_point_motion(index, mass.center)
        # Inertia is constant in the frame of the body, so that the spin is transformed there and
        # back.
        spin = rotation @ (
            mass.inertia
            @ (rotation.transpose(0, 2, 1) @ motion.links.get_angular_motion(index)[0][..., None])
        )
        angular = spin[..., 0]
        linear = mass.mass * velocity
        if about_origin:
            angular = angular + np.cross(center - origin, linear)
        return np.hstack((angular, linear))[:, components]

    return read_momentum


def _create_system_reader(name: str) -> Reader:
    """Return a reader of a quantity of the system of all bodies, such as its momentum.

    Args:
        name: key of `SYSTEM_OUTPUTS`.
    """

    def read_rows(motion: Motion, model: Model, path: str) -> Array:
        mechanism = motion.mechanism
        rows = []
        for q, u, udot in zip(motion.values, motion.speeds, motion.accelerations, strict=True):
            rows.append(np.atleast_1d(SYSTEM_OUTPUTS[name](mechanism, q, u, udot)))
        return np.array(rows)

    return read_rows


def _compute_central_momentum(mechanism: Any, q: Array, u: Array) -> Array:
    """Return the momentum of all bodies about their mass centre (6,), angular part first."""
    linear, angular = mechanism.momentum(q, u)
    return np.concatenate((angular - np.cross(mechanism.center_of_mass(q), linear), linear))


def _compute_com_acceleration(mechanism: Any, q: Array, u: Array, udot: Array) -> Array:
    """Return the acceleration of the mass centre of all bodies (3,), m/s²."""
    accelerations = mechanism.at(q, u).accelerations(udot)
    rows = []
    state = mechanism.at(q, u)
    for index, body in enumerate(mechanism.bodies):
        arm = state.rotations[index] @ body.mass_properties.center
        omega = state.velocities[index][:3]
        acceleration = accelerations[index]
        rows.append(
            body.mass_properties.mass
            * (
                acceleration[3:]
                + np.cross(acceleration[:3], arm)
                + np.cross(omega, np.cross(omega, arm))
            )
        )
    # Without mass the sum is zero, and so is the result.
    return np.asarray(np.sum(rows, axis=0) / (mechanism.total_mass or 1.0))


SYSTEM_OUTPUTS: dict[str, Callable[..., Any]] = {
    "com_position": lambda mechanism, q, u, udot: mechanism.center_of_mass(q),
    "com_velocity": lambda mechanism, q, u, udot: mechanism.center_of_mass_velocity(q, u),
    "com_acceleration": _compute_com_acceleration,
    "kinetic_energy": lambda mechanism, q, u, udot: mechanism.kinetic_energy(q, u),
    "momentum": lambda mechanism, q, u, udot: _compute_central_momentum(mechanism, q, u),
    "angular_momentum": lambda mechanism, q, u, udot: _compute_central_momentum(mechanism, q, u)[
        :3
    ],
    "linear_momentum": lambda mechanism, q, u, udot: _compute_central_momentum(mechanism, q, u)[3:],
}
"""Functions of mechanism, q, u and u̇ for outputs of the model, by name."""


def _read_potential_energy(motion: Motion, model: Model, path: str) -> Array:
    """Return the potential energy of gravity and of all forces, J."""
    return motion.compute_balanced(
        lambda part_motion: np.array(
            [sum(part_motion.system.compute_energies(t, y)[1:]) for t, y in part_motion.moments]
        ).reshape(-1, 1)
    )


def _read_force_energy(motion: Motion, force: Force, path: str) -> Array:
    """Return the potential energy of a force, J."""

    def compute_energies(part_motion: Motion) -> Array:
        # A muscle without equilibrium stores an unknown energy.
        if path in part_motion.left_out:
            return np.full((len(part_motion.times), 1), np.nan)
        return np.array(
            [part_motion.system.compute_stored_energy(path, t, y) for t, y in part_motion.moments]
        ).reshape(-1, 1)

    return motion.compute_by_parts(compute_energies)


def _create_record_reader(name: str) -> Reader:
    """Return a reader of a quantity that the law of a force records."""
    return lambda motion, force, path: motion.read_records([path], name)[name]


def _create_path_reader(name: str) -> Reader:
    """Return a reader of the length (m) or lengthening speed (m/s) of an actuator's path."""

    def read_path(motion: Motion, geometry: GeometryPath, path: str) -> Array:
        return motion.read_records([path.rpartition("/")[0]], name)[name]

    return read_path


def _read_power(motion: Motion, actuator: ScalarActuator, path: str) -> Array:
    """Return the power of an actuator, W; a tension does work against the lengthening speed."""
    # A positive actuation of a path is a tension, which shortens it.
    sense = -1.0 if isinstance(actuator, PathActuator) else 1.0
    records = motion.read_records([path], "actuation", "speed")
    return sense * records["actuation"] * records["speed"]


def _read_excitation(motion: Motion, muscle: Muscle, path: str) -> Array:
    """Return the excitation of a muscle; NaN while the muscle is off."""

    def compute_excitations(part_motion: Motion) -> Array:
        names = part_motion.simulation.forces.controls.names
        # A muscle that is off has no control.
        if path not in names:
            return np.full((len(part_motion.times), 1), np.nan)
        return part_motion.evaluate_kernels([part_motion.system.control_offsets[names.index(path)]])

    return motion.compute_by_parts(compute_excitations)


def _create_reaction_reader(side: str) -> Reader:
    """Return a reader of moment and force on one side of a joint, at the joint's frame there."""

    def read_reaction(motion: Motion, joint: Joint, path: str) -> Array:
        force, moment, _ = JointWrenches.compute_along(motion).get_reaction(joint, side)
        # OpenSim's SpatialVec has the moment first.
        return np.hstack((moment, force))

    return read_reaction


def _read_joint_power(motion: Motion, joint: Joint, path: str) -> Array:
    """Return the power of a joint, which is zero without prescribed coordinates.

    Raises:
        UnsupportedError: a coordinate of the joint is prescribed.
    """
    tree = motion.model.tree()
    if any(
        info.prescribed is not None and info.path.startswith(f"{path}/")
        for info in motion.mechanism.coordinates
    ):
        raise UnsupportedError(
            f"osimlite cannot compute the power of '{tree.path_of(joint)}', which has prescribed "
            "coordinates"
        )
    # In OpenSim the power of a joint is that of the constraints that prescribe its coordinates.
    return np.zeros((len(motion.times), 1))


def _read_muscle_output(
    motion: Motion, muscle: Any, path: str, compute_output: Callable[[dict[str, Array]], Array]
) -> Array:
    """Return an output of a muscle from the quantities of MuscleAnalysis and of its law.

    Args:
        motion: motion along which the output is computed.
        muscle: muscle of the motion's model.
        path: path of the muscle.
        compute_output: function that computes the output (t, 1) from these quantities.
    """
    extra = [
        name
        for name in dict.fromkeys(LAW_OUTPUTS.values())
        if motion.system.has_quantity(path, name)
    ]
    records = motion.read_records([path], *LAW_RECORDS, *extra)
    # Fibers without equilibrium have NaN, and numpy would warn.
    with np.errstate(invalid="ignore", divide="ignore"):
        quantities = records | compute_quantities(records, [muscle])
        speed_of_rotation = (
            quantities["FiberLength"]
            * np.sin(quantities["PennationAngle"])
            * quantities["PennationAngularVelocity"]
        )
        # The fiber's length along the tendon is l cos(α); this is its derivative.
        quantities["along"] = (
            quantities["FiberVelocity"] * np.cos(quantities["PennationAngle"]) - speed_of_rotation
        )
        quantities["slack"] = np.full_like(quantities["along"], muscle.tendon_slack_length)
        return compute_output(quantities)


MUSCLE_OUTPUTS: dict[str, Callable[[dict[str, Array]], Array]] = {
    # Tables of MuscleAnalysis have the same names in camel case.
    **{
        name: itemgetter("".join(map(str.capitalize, name.split("_"))))
        for name in (
            "active_fiber_force",
            "active_fiber_force_along_tendon",
            "fiber_active_power",
            "fiber_force",
            "fiber_length",
            "fiber_passive_power",
            "fiber_velocity",
            "normalized_fiber_length",
            "passive_fiber_force",
            "passive_fiber_force_along_tendon",
            "pennation_angle",
            "pennation_angular_velocity",
            "tendon_force",
            "tendon_length",
            "tendon_power",
        )
    },
    "active_force_length_multiplier": itemgetter("active_force_length"),
    "cos_pennation_angle": lambda quantities: np.cos(quantities["PennationAngle"]),
    "fiber_force_along_tendon": lambda quantities: (
        quantities["FiberForce"] * np.cos(quantities["PennationAngle"])
    ),
    "fiber_length_along_tendon": lambda quantities: (
        quantities["FiberLength"] * np.cos(quantities["PennationAngle"])
    ),
    "fiber_velocity_along_tendon": itemgetter("along"),
    "force_velocity_multiplier": itemgetter("force_velocity"),
    "muscle_power": itemgetter("MuscleActuatorPower"),
    "normalized_fiber_velocity": itemgetter("NormFiberVelocity"),
    "passive_fiber_damping_force": lambda quantities: (
        quantities["PassiveFiberForce"] - quantities[SPRING]
    ),
    "passive_fiber_damping_force_along_tendon": lambda quantities: (
        (quantities["PassiveFiberForce"] - quantities[SPRING])
        * np.cos(quantities["PennationAngle"])
    ),
    "passive_fiber_elastic_force": itemgetter(SPRING),
    "passive_fiber_elastic_force_along_tendon": lambda quantities: (
        quantities[SPRING] * np.cos(quantities["PennationAngle"])
    ),
    "tendon_strain": lambda quantities: quantities["TendonLength"] / quantities["slack"] - 1.0,
    "tendon_velocity": lambda quantities: quantities["rate"] - quantities["along"],
}
"""Outputs of muscles whose classes are compared with OpenSim in the tests."""
LAW_OUTPUTS = {
    "active_force_length_multiplier": "active_force_length",
    "force_velocity_multiplier": "force_velocity",
    "passive_fiber_damping_force": SPRING,
    "passive_fiber_damping_force_along_tendon": SPRING,
    "passive_fiber_elastic_force": SPRING,
    "passive_fiber_elastic_force_along_tendon": SPRING,
}
"""Record of a muscle's law that an output needs, by output."""

UNSUPPORTED_OUTPUTS: dict[type[Component], tuple[str, ...]] = {
    Millard2012AccelerationMuscle: ("fiber_force_along_tendon", "tendon_force"),
}
"""Outputs that a class computes in a way that osimlite does not support.

With a mass at the fiber, the tendon force of OpenSim is without damping.
"""

READERS: dict[type[Component], dict[str, Reader]] = {
    Model: {name: _create_system_reader(name) for name in SYSTEM_OUTPUTS}
    | {"potential_energy": _read_potential_energy},
    Force: {"potential_energy": _read_force_energy},
    Coordinate: {
        "acceleration": lambda motion, coordinate, path: _select_coordinate(
            motion, motion.accelerations, path
        ),
        "speed": lambda motion, coordinate, path: _select_coordinate(motion, motion.speeds, path),
        "value": lambda motion, coordinate, path: _select_coordinate(motion, motion.values, path),
    },
    Frame: {
        name: _create_frame_reader(name)
        for name in (
            "position",
            "angular_velocity",
            "linear_velocity",
            "velocity",
            "angular_acceleration",
            "linear_acceleration",
            "acceleration",
        )
    },
    Body: {
        f"{what}_about_{where}": _create_momentum_reader(where == "origin", part)
        for where in ("mass_center", "origin")
        for what, part in (
            ("angular_momentum", slice(0, 3)),
            ("linear_momentum", slice(3, 6)),
            ("momentum", slice(0, 6)),
        )
    },
    Station: {
        "location": _create_station_reader(0),
        "velocity": _create_station_reader(1),
        "acceleration": _create_station_reader(2),
    },
    PathPoint: {
        "location": _create_station_reader(0),
        "velocity": _create_station_reader(1),
        "acceleration": _create_station_reader(2),
    },
    ScalarActuator: {
        "actuation": _create_record_reader("actuation"),
        "speed": _create_record_reader("speed"),
        "power": _read_power,
    },
    PathActuator: {"tension": _create_record_reader("tension")},
    Muscle: {"activation": _create_record_reader("activation"), "excitation": _read_excitation},
    GeometryPath: {
        "length": _create_path_reader("length"),
        "lengthening_speed": _create_path_reader("rate"),
    },
    Joint: {
        "power": _read_joint_power,
        "reaction_on_child": _create_reaction_reader("child"),
        "reaction_on_parent": _create_reaction_reader("parent"),
    },
}
"""Readers by class and OpenSim's name of the output; those of base classes hold as well."""


def _select_coordinate(motion: Motion, rows: Array, path: str) -> Array:
    """Return the column (t, 1) of a coordinate."""
    return rows[:, [motion.mechanism.coordinate_index(path)]]
