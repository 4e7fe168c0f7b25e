"""Mechanism: a flat tree of bodies and mobilizers, with its kinematics and dynamics.

Every body follows the body that carries it; -1 stands for ground. Coordinates are in the order of
OpenSim's CoordinateSet, and so are values q, generalized speeds u, their derivatives udot and
generalized forces. The speeds are the rates of the coordinates except for ball, free, ellipsoid and
scapulothoracic joints, whose rotational speeds are the angular velocity of the joint's child frame
in its parent frame.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from osimlite.base.records import dataclass, replace
from osimlite.base.text import format_count
from osimlite.mechanics.multibody import dynamics
from osimlite.mechanics.multibody.assembly import assemble_pose, project_speeds
from osimlite.mechanics.multibody.constraints import Lock
from osimlite.mechanics.multibody.dynamics import MassCentres, Wrench
from osimlite.mechanics.multibody.extremes import methods_of_any_numbers
from osimlite.mechanics.multibody.joints import Mobilizer
from osimlite.mechanics.multibody.kinematics import MechanismKinematics
from osimlite.mechanics.multibody.links import tree_of
from osimlite.mechanics.multibody.parts import (
    GROUND,
    CoordinateInfo,
    FramePlacement,
    MassProperties,
    MobileBody,
    StationPlacement,
)
from osimlite.mechanics.multibody.program import PackedMechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.mechanics.multibody.structure import MechanismStructure, Values, make_vector

__all__ = [
    "GROUND",
    "CoordinateInfo",
    "FramePlacement",
    "MassProperties",
    "Mechanism",
    "MobileBody",
    "StationPlacement",
    "Values",
]


@methods_of_any_numbers
@dataclass(frozen=True, eq=False)
class Mechanism(MechanismStructure):
    """Tree of bodies under gravity.

    Attributes are those of :class:`osimlite.mechanics.multibody.structure.MechanismStructure`.
    Wherever a method takes q or u, it accepts an array (n,) in the order of `coordinates` or a
    mapping by coordinate name; omitted names have their default. A body or frame is named by its
    absolute path, a body also by its name. Every method raises ModelError for an unknown name and
    for a wrong number of values. A `time` (s) matters only where coordinates are prescribed.
    """

    # ------------------------------------------------------------------------------------ names and states
    def __repr__(self) -> str:
        counts = [
            format_count(len(self.bodies), "body"),
            format_count(len(self.coordinates), "coordinate"),
            format_count(len(self.constraints), "constraint"),
        ]
        return f"Mechanism of '{self.name}': {', '.join(counts)}, {self.total_mass:.4g} kg"

    def default_state(self, time: float = 0.0) -> tuple[Array, Array]:
        """Return the default state, changed as little as the constraints demand.

        Args:
            time: time of prescribed coordinates (s).

        Returns:
            Values (n,) and speeds (n,).

        Raises:
            SimulationError: no pose near the default one fulfils the constraints.
        """
        q = self.assemble({}, time)
        return q, self.project_speeds(q, {}, time)

    def without_constraints(self) -> Mechanism:
        """Return the mechanism without constraints, locked and prescribed coordinates.

        It can be in any state.
        """
        infos = tuple(replace(info, locked=False, prescribed=None) for info in self.coordinates)
        return replace(self, coordinates=infos, constraints=())

    def assemble(self, q: Values, time: float = 0.0, *, kept: Collection[int] = ()) -> Array:
        """Return the values (n,) nearest to a pose that fulfil the constraints.

        The rules are those of OpenSim's assembly. Locked coordinates keep their values, and clamped
        ones stay in their ranges; changes of coordinates that are `yielding` do not count.

        Args:
            q: coordinate values to start from.
            time: time of prescribed coordinates (s).
            kept: indices of further coordinates that keep their values.

        Raises:
            SimulationError: no pose near `q` fulfils the constraints.
        """
        values = self.values(q)
        # Locks keep any values, and therefore need no assembly.
        if all(isinstance(item, Lock) for item in self.constraints):
            return values
        return assemble_pose(self, values, time, kept)

    def project_speeds(
        self, q: Values, u: Values, time: float = 0.0, *, kept: Collection[int] = ()
    ) -> Array:
        """Return the speeds (n,) nearest to `u` that fulfil the constraints.

        The rules are those of OpenSim's integrator. A change of a speed above 1 counts relative to
        it.

        Args:
            q: coordinate values.
            u: generalized speeds.
            time: time of prescribed coordinates (s).
            kept: indices of coordinates whose speeds do not change.

        Raises:
            SimulationError: the constraints do not allow the speeds of `kept`.
        """
        return project_speeds(self.at(q, self.speeds(u), time), kept)

    def at(self, q: Values, u: Values | None = None, time: float = 0.0) -> MechanismKinematics:
        """Return the kinematics at a state, from which everything else follows.

        Args:
            q: coordinate values.
            u: generalized speeds; None for a mechanism at rest.
            time: time of prescribed coordinates (s).
        """
        values = self.values(q)
        return MechanismKinematics(
            self, values, np.zeros(len(values)) if u is None else self.speeds(u), time
        )

    # ------------------------------------------------------------------------------------------ kinematics
    def body_transforms(self, q: Values) -> dict[str, Array]:
        """Compute the transforms of all bodies in ground.

        Args:
            q: coordinate values.

        Returns:
            Transform (4, 4) by name of the body.
        """
        state = self.at(q)
        return {body.name: state.transform(index) for index, body in enumerate(self.bodies)}

    def body_velocities(self, q: Values, u: Values) -> dict[str, Array]:
        """Compute the velocities of all bodies in ground.

        Args:
            q: coordinate values.
            u: generalized speeds.

        Returns:
            Angular velocity and velocity of the origin (6,), rad/s and m/s, by name of the body.
        """
        velocities = self.at(q, u).velocities
        return {body.name: velocities[index] for index, body in enumerate(self.bodies)}

    def body_accelerations(self, q: Values, u: Values, udot: Values) -> dict[str, Array]:
        """Compute the accelerations of all bodies in ground.

        Args:
            q: coordinate values.
            u: generalized speeds.
            udot: derivatives of the speeds.

        Returns:
            Angular acceleration and acceleration of the origin (6,), rad/s² and m/s², by name of
            the body.
        """
        accelerations = self.at(q, u).accelerations(self._convert_to_array(udot, "acceleration"))
        return {body.name: accelerations[index] for index, body in enumerate(self.bodies)}

    def frame_transform(self, frame: str, q: Values) -> Array:
        """Return the transform of a frame in ground (4, 4).

        Args:
            frame: name of a frame or body.
            q: coordinate values.
        """
        body, frame_in_body = self.placement(frame)
        return self.at(q).transform(body) @ frame_in_body

    def station_position(self, frame: str, station: ArrayLike, q: Values) -> Array:
        """Return the position in ground of a point of a frame (3,), m.

        Args:
            frame: name of a frame or body.
            station: point in the frame (3,), m.
            q: coordinate values.
        """
        return self.at(q).point(*self._resolve_station(frame, station))

    def station_positions(self, q: Values) -> dict[str, Array]:
        """Compute the positions of all markers and other stations in ground.

        Args:
            q: coordinate values.

        Returns:
            Position (3,) in m, by absolute path.
        """
        state = self.at(q)
        return {path: state.point(*placement) for path, placement in self.stations.items()}

    def station_velocity(self, frame: str, station: ArrayLike, q: Values, u: Values) -> Array:
        """Return the velocity in ground of a point of a frame (3,), m/s.

        Args:
            frame: name of a frame or body.
            station: point in the frame (3,), m.
            q: coordinate values.
            u: generalized speeds.
        """
        return self.at(q, u).point_velocity(*self._resolve_station(frame, station))

    def jacobian(self, frame: str, q: Values, station: ArrayLike = (0.0, 0.0, 0.0)) -> Array:
        """Return the Jacobian (6, n) of a frame and a point of it, in ground.

        It maps the generalized speeds to the angular velocity of the frame and the velocity of the
        point.

        Args:
            frame: name of a frame or body.
            q: coordinate values.
            station: point in the frame (3,), m.
        """
        return self.at(q).point_jacobian(*self._resolve_station(frame, station))

    def rate_matrix(self, q: Values) -> Array:
        """Return N (n, n) with qdot = N u.

        Raises:
            SimulationError: a ball, free or ellipsoid joint is in a pose where N is singular.
        """
        if not self.turning:
            return self._unit
        values = self.values(q)
        matrix = np.eye(len(self.coordinates))
        for mobilizer in self.turning:
            indices = list(mobilizer.coordinates)
            matrix[np.ix_(indices, indices)] = mobilizer.rate_matrix(values[indices])
        return matrix

    def rate_bias(self, q: Values, u: Values) -> Array:
        """Return Ndot u (n,), so that qddot = N udot + Ndot u.

        Args:
            q: coordinate values.
            u: generalized speeds.

        Raises:
            SimulationError: a ball, free or ellipsoid joint is in a pose where N is singular.
        """
        bias = np.zeros(len(self.coordinates))
        if not self.turning:
            return bias
        values, speeds = self.values(q), self.speeds(u)
        for mobilizer in self.turning:
            indices = list(mobilizer.coordinates)
            bias[indices] = mobilizer.rate_bias(values[indices], speeds[indices])
        return bias

    def coordinate_rates(self, q: Values, u: Values) -> Array:
        """Return the rates of the coordinates (n,) for generalized speeds.

        Args:
            q: coordinate values.
            u: generalized speeds.

        Raises:
            SimulationError: a ball, free or ellipsoid joint is in a pose where the rates are not
                defined.
        """
        speeds = self.speeds(u)
        return self.rate_matrix(q) @ speeds if self.turning else speeds.copy()

    def speeds_from_rates(self, q: Values, qdot: Values) -> Array:
        """Return the generalized speeds (n,) for rates of the coordinates.

        Args:
            q: coordinate values.
            qdot: rates of the coordinates.

        Raises:
            SimulationError: a ball, free or ellipsoid joint is in a pose where the rates are not
                defined.
        """
        rates = self._convert_to_array(qdot, "rate")
        if not self.turning:
            return rates.copy()
        return np.asarray(np.linalg.solve(self.rate_matrix(q), rates), dtype=np.float64)

    # -------------------------------------------------------------------------------------------- dynamics
    @cached_property
    def constrained(self) -> frozenset[int]:
        """Indices of the bodies that constraints involve."""
        return frozenset(body for item in self.constraints for body in item.bodies) - {GROUND}

    @cached_property
    def inertial(self) -> tuple[Array, Array, Array]:
        """Masses (b,), mass centres (b, 3) and inertias (b, 3, 3) of all bodies.

        Returns:
            Arrays in the units and frames of `MassProperties`.
        """
        properties = [body.mass_properties for body in self.bodies]
        return (
            np.array([item.mass for item in properties], dtype=float),
            np.array([item.center for item in properties], dtype=float).reshape(-1, 3),
            np.array([item.inertia for item in properties], dtype=float).reshape(-1, 3, 3),
        )

    def mass_matrix(self, q: Values) -> Array:
        """Return the mass matrix M (n, n) for the generalized speeds."""
        return dynamics.mass_matrix(self.at(q))

    def bias(self, q: Values, u: Values) -> Array:
        """Return C (n,), the velocity-dependent part of M udot + C = gravity + applied forces.

        Args:
            q: coordinate values.
            u: generalized speeds.
        """
        # Without gravity and accelerations, the forces that are missing are the velocity-dependent
        # ones.
        return dynamics.missing_forces(self.at(q, u), self._zeros, np.zeros(3))

    def gravity_forces(self, q: Values) -> Array:
        """Return the generalized forces of gravity (n,)."""
        # At rest the forces that are missing balance gravity.
        return -dynamics.missing_forces(self.at(q), self._zeros, self.gravity)

    def generalized_forces(self, q: Values, body_wrenches: Mapping[str, Wrench]) -> Array:
        """Return the generalized forces (n,) of wrenches on bodies or frames.

        Args:
            q: coordinate values.
            body_wrenches: wrenches at the origins of bodies or frames, along the axes of ground, by
                name.
        """
        return self._sum_applied_forces(self.at(q), {}, body_wrenches)

    def acceleration(
        self,
        q: Values,
        u: Values,
        generalized_forces: Values | None = None,
        body_wrenches: Mapping[str, Wrench] | None = None,
        time: float = 0.0,
    ) -> Array:
        """Return the derivatives of the generalized speeds (n,) under forces and constraints.

        Gravity is included.

        Args:
            q: coordinate values, which must fulfil the constraints.
            u: generalized speeds, which must fulfil them, too (that of a locked coordinate is
                zero).
            generalized_forces: forces conjugate to the generalized speeds (N, N m); zero for
                omitted names; None for none.
            body_wrenches: wrenches at the origins of bodies or frames, along the axes of ground, by
                name; None for none.
            time: time of prescribed coordinates (s).

        Raises:
            SimulationError: a coordinate moves no mass, or a number is not finite.
        """
        state = self.at(q, u, time)
        applied = self._sum_applied_forces(
            state, {} if generalized_forces is None else generalized_forces, body_wrenches or {}
        )
        return dynamics.accelerations(state, applied)

    def inverse_dynamics(
        self, q: Values, u: Values, udot: Values, body_wrenches: Mapping[str, Wrench] | None = None
    ) -> Array:
        """Return the generalized forces (n,) that give `udot` against gravity and wrenches.

        Constraints are ignored.

        Args:
            q: coordinate values.
            u: generalized speeds.
            udot: derivatives of the speeds.
            body_wrenches: wrenches at the origins of bodies or frames, along the axes of ground, by
                name; None for none.
        """
        state = self.at(q, u)
        missing = dynamics.missing_forces(
            state, self._convert_to_array(udot, "acceleration"), self.gravity
        )
        return missing - self._sum_applied_forces(state, {}, body_wrenches or {})

    @cached_property
    def total_mass(self) -> float:
        """Mass of all bodies together (kg)."""
        return float(self.inertial[0].sum())

    def center_of_mass(self, q: Values) -> Array:
        """Return the mass centre in ground (3,), m."""
        return self._average_by_mass(MassCentres.compute(self.at(q)).positions())

    def center_of_mass_velocity(self, q: Values, u: Values) -> Array:
        """Return the velocity of the mass centre in ground (3,), m/s.

        Args:
            q: coordinate values.
            u: generalized speeds.
        """
        return self._average_by_mass(MassCentres.compute(self.at(q, u)).velocities())

    def kinetic_energy(self, q: Values, u: Values) -> float:
        """Return the kinetic energy of all bodies (J).

        Args:
            q: coordinate values.
            u: generalized speeds.
        """
        return MassCentres.compute(self.at(q, u)).kinetic_energy()

    def potential_energy(self, q: Values) -> float:
        """Return the potential energy of gravity (J).

        It is zero with the mass centre at the origin of ground.
        """
        return -self.total_mass * float(self.gravity @ self.center_of_mass(q))

    def momentum(self, q: Values, u: Values) -> tuple[Array, Array]:
        """Return the momentum of all bodies.

        Args:
            q: coordinate values.
            u: generalized speeds.

        Returns:
            Linear momentum (3,) in kg m/s, and angular momentum (3,) about the origin of ground in
            kg m²/s.
        """
        return MassCentres.compute(self.at(q, u)).momentum()

    # --------------------------------------------------------------------------------------------- helpers
    @cached_property
    def program(self) -> PackedMechanism:
        """Program of the mechanism: its integers and numbers for the kernels."""
        return PackedMechanism(tree_of(self, range(len(self.coordinates))), self.constraints)

    def __getstate__(self) -> dict[str, Any]:
        # The program contains addresses that are valid in this process only.
        return {name: value for name, value in vars(self).items() if name != "program"}

    @cached_property
    def turning(self) -> tuple[Mobilizer, ...]:
        """Mobilizers whose speeds are not the rates of their coordinates.

        Returns:
            Mobilizers of ball, free, ellipsoid and scapulothoracic joints.
        """
        return tuple(body.mobilizer for body in self.bodies if not body.mobilizer.speeds_are_rates)

    def _average_by_mass(self, vectors: Array) -> Array:
        """Return the mean of one vector per body (b, 3), weighted by mass.

        It is zero if no body has mass.
        """
        # A division by 1 instead of 0 leaves the sum, which is 0.
        return self.inertial[0] @ vectors / (self.total_mass or 1.0)

    def _sum_applied_forces(
        self, state: MechanismKinematics, forces: Values, wrenches: Mapping[str, Wrench]
    ) -> Array:
        """Return the generalized forces (n,) of forces and wrenches.

        Args:
            state: state.
            forces: generalized forces, zero where omitted.
            wrenches: wrenches at the origins of bodies or frames, by name.
        """
        total = self._convert_to_array(forces, "force")
        for name, (force, torque) in wrenches.items():
            body, frame_in_body = self.placement(name)
            # Spatial vectors have the angular part first.
            load = np.concatenate((make_vector(torque, "torque"), make_vector(force, "force")))
            total = total + load @ state.point_jacobian(body, frame_in_body[:3, 3])
        return total
