"""Outputs of components along a motion, as OpenSim defines them: one function for each, by class and name.

A number, a vector or a spatial vector (angular part first) for each time: (t, 1), (t, 3) or (t, 6),
along the axes of ground.
"""

from __future__ import annotations

from collections.abc import Callable
from operator import itemgetter
from typing import Any

import numpy as np

from osimlite.errors import UnsupportedError
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.actuators import ScalarActuator
from osimlite.schema.base import Component
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.forces import Force
from osimlite.schema.frames import Body, Frame
from osimlite.schema.joints import Joint
from osimlite.schema.markers import Station
from osimlite.schema.model import Model
from osimlite.schema.muscles import Millard2012AccelerationMuscle, Muscle, PathActuator
from osimlite.schema.paths import GeometryPath, PathPoint
from osimlite.simulation.elements.muscle import SPRING
from osimlite.tools.motion import Motion
from osimlite.tools.muscle_quantities import CHECKED, KNOWN, quantities
from osimlite.tools.reaction_forces import JointWrenches

Reader = Callable[[Motion, Any, str], Array]
"""The rows (t, k) of an output of a component along a motion; the path of the component is the last argument."""


def reader_of(motion: Motion, component: Component, name: str) -> Reader | None:
    """What computes an output of a component; None if nothing here does."""
    for cls in type(component).__mro__:
        found = READERS.get(cls, {}).get(name)
        if found is not None:
            return found
    path = motion.model.tree().path_of(component) or ""
    known = name not in LAWS or (
        isinstance(component, Muscle) and motion.system.knows(path, LAWS[name])
    )
    known &= name not in OTHERWISE.get(type(component), ())
    if isinstance(component, Muscle) and type(component) in CHECKED and name in MUSCLES and known:
        return lambda motion, muscle, path: _of_muscle(motion, muscle, path, MUSCLES[name])
    if f"{path}/{name}" in motion.histories:
        return lambda motion, _, path: motion.histories[f"{path}/{name}"][:, None]
    return None


def _linked(part: str) -> Reader:
    """Where a frame is and how it moves."""

    def read(motion: Motion, frame: Frame, path: str) -> Array:
        body, placed = motion.mechanism.placement(path)
        turning, moving = motion.links.turning(body), motion.links.point(body, placed[:3, 3])
        return {
            "position": lambda: moving[0],
            "angular_velocity": lambda: turning[0],
            "linear_velocity": lambda: moving[1],
            "velocity": lambda: np.hstack((turning[0], moving[1])),
            "angular_acceleration": lambda: turning[1],
            "linear_acceleration": lambda: moving[2],
            "acceleration": lambda: np.hstack((turning[1], moving[2])),
        }[part]()

    return read


def _station(which: int) -> Reader:
    """Place, velocity or acceleration of a point fixed in a frame."""

    def read(motion: Motion, station: Station | PathPoint, path: str) -> Array:
        tree = motion.model.tree()
        holder = tree.parent_of(station)
        if isinstance(holder, PathPoint):
            # OpenSim keeps the place of a path point in a station of its own.
            station = holder
        frame = tree.target(station, "socket_parent_frame", station.socket_parent_frame)
        body, placed = motion.mechanism.placement(tree.path_of(frame) or "")
        point = placed[:3, :3] @ np.array(station.location, dtype=float) + placed[:3, 3]
        return motion.links.point(body, point)[which]

    return read


def _momentum(about_origin: bool, part: slice) -> Reader:
    """Angular and linear momentum of a body."""

    def read(motion: Motion, body: Body, path: str) -> Array:
        place, _ = motion.mechanism.placement(path)
        mass = motion.mechanism.bodies[place].mass_properties
        rotation, origin = motion.links.placed(place, np.eye(4))
        center, velocity, _ = motion.links.point(place, mass.center)
        spin = rotation @ (
            mass.inertia @ (rotation.transpose(0, 2, 1) @ motion.links.turning(place)[0][..., None])
        )
        angular, linear = spin[..., 0], mass.mass * velocity
        if about_origin:
            angular = angular + np.cross(center - origin, linear)
        return np.hstack((angular, linear))[:, part]

    return read


def _of_system(name: str) -> Reader:
    """What is said of all bodies."""

    def read(motion: Motion, model: Model, path: str) -> Array:
        mechanism, rows = motion.mechanism, []
        for q, u, udot in zip(motion.values, motion.speeds, motion.accelerations, strict=True):
            rows.append(np.atleast_1d(SYSTEM[name](mechanism, q, u, udot)))
        return np.array(rows)

    return read


def _central(mechanism: Any, q: Array, u: Array) -> Array:
    """Momentum of all bodies about their mass centre."""
    linear, angular = mechanism.momentum(q, u)
    return np.concatenate((angular - np.cross(mechanism.center_of_mass(q), linear), linear))


def _com_acceleration(mechanism: Any, q: Array, u: Array, udot: Array) -> Array:
    accelerations, rows = mechanism.at(q, u).accelerations(udot), []
    state = mechanism.at(q, u)
    for index, body in enumerate(mechanism.bodies):
        arm = state.rotations[index] @ body.mass_properties.center
        w, own = state.velocities[index][:3], accelerations[index]
        rows.append(
            body.mass_properties.mass
            * (own[3:] + np.cross(own[:3], arm) + np.cross(w, np.cross(w, arm)))
        )
    return np.asarray(np.sum(rows, axis=0) / (mechanism.total_mass or 1.0))


SYSTEM: dict[str, Callable[..., Any]] = {
    "com_position": lambda mechanism, q, u, udot: mechanism.center_of_mass(q),
    "com_velocity": lambda mechanism, q, u, udot: mechanism.center_of_mass_velocity(q, u),
    "com_acceleration": _com_acceleration,
    "kinetic_energy": lambda mechanism, q, u, udot: mechanism.kinetic_energy(q, u),
    "momentum": lambda mechanism, q, u, udot: _central(mechanism, q, u),
    "angular_momentum": lambda mechanism, q, u, udot: _central(mechanism, q, u)[:3],
    "linear_momentum": lambda mechanism, q, u, udot: _central(mechanism, q, u)[3:],
}


def _potential_energy(motion: Motion, model: Model, path: str) -> Array:
    """Of gravity and of all forces."""
    return motion.compute_balanced(
        lambda part: np.array(
            [sum(part.system.energies(t, y)[1:]) for t, y in part.moments]
        ).reshape(-1, 1)
    )


def _stored(motion: Motion, force: Force, path: str) -> Array:
    """The potential energy of a force."""

    def compute(part: Motion) -> Array:
        if path in part.left_out:
            return np.full((len(part.times), 1), np.nan)
        return np.array([part.system.energy_of(path, t, y) for t, y in part.moments]).reshape(-1, 1)

    return motion.compute_by_parts(compute)


def _known(name: str) -> Reader:
    """What the law of a force records."""
    return lambda motion, force, path: motion.known([path], name)[name]


def _of_path(name: str) -> Reader:
    """Length (m) or lengthening speed of the path of an actuator."""

    def read(motion: Motion, geometry: GeometryPath, path: str) -> Array:
        return motion.known([path.rpartition("/")[0]], name)[name]

    return read


def _power(motion: Motion, actuator: ScalarActuator, path: str) -> Array:
    sense = -1.0 if isinstance(actuator, PathActuator) else 1.0
    known = motion.known([path], "actuation", "speed")
    return sense * known["actuation"] * known["speed"]


def _excitation(motion: Motion, muscle: Muscle, path: str) -> Array:
    def compute(part: Motion) -> Array:
        names = part.simulation.forces.controls.names
        if path not in names:
            return np.full((len(part.times), 1), np.nan)
        return part.looked([part.system.places_of_controls[names.index(path)]])

    return motion.compute_by_parts(compute)


def _reaction(side: str) -> Reader:
    """Moment and force on a side of a joint at the joint's frame there."""

    def read(motion: Motion, joint: Joint, path: str) -> Array:
        force, moment, _ = JointWrenches.along(motion).of(joint, side)
        return np.hstack((moment, force))

    return read


def _joint_power(motion: Motion, joint: Joint, path: str) -> Array:
    """That of what prescribes coordinates."""
    tree = motion.model.tree()
    if any(
        info.prescribed is not None and info.path.startswith(f"{path}/")
        for info in motion.mechanism.coordinates
    ):
        raise UnsupportedError(
            f"the power of '{tree.path_of(joint)}', which has prescribed coordinates, is not known"
        )
    return np.zeros((len(motion.times), 1))


def _of_muscle(
    motion: Motion, muscle: Any, path: str, of: Callable[[dict[str, Array]], Array]
) -> Array:
    """What is made of the tables of MuscleAnalysis, and of what the law records."""
    extra = [name for name in dict.fromkeys(LAWS.values()) if motion.system.knows(path, name)]
    known = motion.known([path], *KNOWN, *extra)
    with np.errstate(invalid="ignore", divide="ignore"):
        found = known | quantities(known, [muscle])
        turning = (
            found["FiberLength"]
            * np.sin(found["PennationAngle"])
            * found["PennationAngularVelocity"]
        )
        found["along"] = found["FiberVelocity"] * np.cos(found["PennationAngle"]) - turning
        found["slack"] = np.full_like(found["along"], muscle.tendon_slack_length)
        return of(found)


MUSCLES: dict[str, Callable[[dict[str, Array]], Array]] = {
    # What MuscleAnalysis has tables of, whose names are the same in other letters.
    **{
        name: itemgetter("".join(map(str.capitalize, name.split("_"))))
        for name in (
            "active_fiber_force", "active_fiber_force_along_tendon", "fiber_active_power", "fiber_force",
            "fiber_length", "fiber_passive_power", "fiber_velocity", "normalized_fiber_length", "passive_fiber_force",
            "passive_fiber_force_along_tendon", "pennation_angle", "pennation_angular_velocity", "tendon_force",
            "tendon_length", "tendon_power",
        )
    },
    "active_force_length_multiplier": itemgetter("active_force_length"),
    "cos_pennation_angle": lambda found: np.cos(found["PennationAngle"]),
    "fiber_force_along_tendon": lambda found: found["FiberForce"] * np.cos(found["PennationAngle"]),
    "fiber_length_along_tendon": lambda found: found["FiberLength"] * np.cos(found["PennationAngle"]),
    "fiber_velocity_along_tendon": itemgetter("along"),
    "force_velocity_multiplier": itemgetter("force_velocity"),
    "muscle_power": itemgetter("MuscleActuatorPower"),
    "normalized_fiber_velocity": itemgetter("NormFiberVelocity"),
    "passive_fiber_damping_force": lambda found: found["PassiveFiberForce"] - found[SPRING],
    "passive_fiber_damping_force_along_tendon": lambda found: (
        (found["PassiveFiberForce"] - found[SPRING]) * np.cos(found["PennationAngle"])
    ),
    "passive_fiber_elastic_force": itemgetter(SPRING),
    "passive_fiber_elastic_force_along_tendon": lambda found: found[SPRING] * np.cos(found["PennationAngle"]),
    "tendon_strain": lambda found: found["TendonLength"] / found["slack"] - 1.0,
    "tendon_velocity": lambda found: found["rate"] - found["along"],
}  # fmt: skip
"""The outputs of muscles whose classes were held to OpenSim's."""
LAWS = {
    "active_force_length_multiplier": "active_force_length",
    "force_velocity_multiplier": "force_velocity",
    "passive_fiber_damping_force": SPRING,
    "passive_fiber_damping_force_along_tendon": SPRING,
    "passive_fiber_elastic_force": SPRING,
    "passive_fiber_elastic_force_along_tendon": SPRING,
}
"""What the law of a muscle must record for some of them."""

OTHERWISE: dict[type[Component], tuple[str, ...]] = {
    Millard2012AccelerationMuscle: ("fiber_force_along_tendon", "tendon_force"),
}
"""Those that a class computes in another way, which is not known here: with a mass, the tendon's is without damping."""

READERS: dict[type[Component], dict[str, Reader]] = {
    Model: {name: _of_system(name) for name in SYSTEM} | {"potential_energy": _potential_energy},
    Force: {"potential_energy": _stored},
    Coordinate: {
        "acceleration": lambda motion, coordinate, path: _coordinate(motion, motion.accelerations, path),
        "speed": lambda motion, coordinate, path: _coordinate(motion, motion.speeds, path),
        "value": lambda motion, coordinate, path: _coordinate(motion, motion.values, path),
    },
    Frame: {
        name: _linked(name)
        for name in (
            "position", "angular_velocity", "linear_velocity", "velocity",
            "angular_acceleration", "linear_acceleration", "acceleration",
        )
    },
    Body: {
        f"{what}_about_{where}": _momentum(where == "origin", part)
        for where in ("mass_center", "origin")
        for what, part in (
            ("angular_momentum", slice(0, 3)), ("linear_momentum", slice(3, 6)), ("momentum", slice(0, 6)),
        )
    },
    Station: {"location": _station(0), "velocity": _station(1), "acceleration": _station(2)},
    PathPoint: {"location": _station(0), "velocity": _station(1), "acceleration": _station(2)},
    ScalarActuator: {"actuation": _known("actuation"), "speed": _known("speed"), "power": _power},
    PathActuator: {"tension": _known("tension")},
    Muscle: {"activation": _known("activation"), "excitation": _excitation},
    GeometryPath: {"length": _of_path("length"), "lengthening_speed": _of_path("rate")},
    Joint: {
        "power": _joint_power, "reaction_on_child": _reaction("child"), "reaction_on_parent": _reaction("parent"),
    },
}  # fmt: skip
"""By class: OpenSim's names of its outputs. Those of bases hold, too."""


def _coordinate(motion: Motion, rows: Array, path: str) -> Array:
    return rows[:, [motion.mechanism.coordinate_index(path)]]
