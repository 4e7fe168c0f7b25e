"""The mechanism: a flat tree of bodies and mobilizers, and what can be asked of it.

Bodies stand in an order in which every body follows the one that carries it; -1 stands for ground.
Coordinates stand in the order of OpenSim's CoordinateSet, and values q, generalized speeds u, their
derivatives udot and generalized forces all use that order. The speeds are the rates of the
coordinates except for ball, free, ellipsoid and scapulothoracic joints, whose rotational speeds are
the angular velocity of the joint's child frame in its parent frame.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from osimlite.base.records import dataclass, field, replace
from osimlite.base.text import suggest_name
from osimlite.errors import ModelError
from osimlite.mechanics.multibody import dynamics
from osimlite.mechanics.multibody.assembly import assemble_pose, project_speeds
from osimlite.mechanics.multibody.constraints import Constraint, Lock, Prescribed
from osimlite.mechanics.multibody.dynamics import MassCentres, Wrench
from osimlite.mechanics.multibody.extremes import methods_of_any_numbers
from osimlite.mechanics.multibody.joints import Mobilizer
from osimlite.mechanics.multibody.kinematics import Kinematics
from osimlite.mechanics.multibody.links import tree_of
from osimlite.mechanics.multibody.parts import (
    GROUND,
    CoordinateInfo,
    FramePlacement,
    MassProperties,
    MobileBody,
    StationPlacement,
)
from osimlite.mechanics.multibody.program import Program
from osimlite.mechanics.multibody.spatial import Array

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

Values = ArrayLike | Mapping[str, float]
"""One number per coordinate: an array in coordinate order, or numbers by coordinate name."""


@methods_of_any_numbers
@dataclass(frozen=True, eq=False)
class Mechanism:
    """A tree of bodies under gravity.

    Wherever a method takes q or u, an array (n,) in the order of `coordinates` or a mapping by
    coordinate name will do; names left out take their default. A body or frame is named by its
    absolute path, a body also by its name. Every method raises ModelError for a name that does not
    exist and for values of the wrong number. A `time` (s) matters only where coordinates are
    prescribed.

    Attributes:
        bodies: carriers before the carried.
        coordinates: in the order of all arrays.
        gravity: acceleration (3,) in ground (m/s²).
        frames: every frame fixed to a body or to ground, by absolute path.
        constraints: what holds besides the joints; what locked and prescribed coordinates need is
            put before them.
        stations: every marker and other station, by absolute path.
        assembly_accuracy: ten times what position errors of constraints may be in an assembled pose
            (m or rad).
    """

    name: str
    bodies: tuple[MobileBody, ...]
    coordinates: tuple[CoordinateInfo, ...]
    gravity: Array = field(default_factory=lambda: np.array((0.0, -9.80665, 0.0)))
    frames: Mapping[str, FramePlacement] = field(default_factory=dict)
    constraints: tuple[Constraint, ...] = ()
    stations: Mapping[str, StationPlacement] = field(default_factory=dict)
    assembly_accuracy: float = 1e-9

    def __post_init__(self) -> None:
        for index, body in enumerate(self.bodies):
            if not GROUND <= body.parent < index:
                raise ModelError(
                    f"body '{body.name}' stands before the body that carries it; sort the bodies from ground outwards"
                )
        places = sorted(place for body in self.bodies for place in body.mobilizer.coordinates)
        if places != list(range(len(self.coordinates))):
            raise ModelError(
                f"the joints of '{self.name}' do not share out its coordinates one by one"
            )
        holds: list[Constraint] = []
        for index, info in enumerate(self.coordinates):
            if info.locked:
                holds.append(Lock(index, info.path))
            elif info.prescribed is not None:
                holds.append(Prescribed(index, info.prescribed, info.path))
        object.__setattr__(self, "constraints", (*holds, *self.constraints))

    # ------------------------------------------------------------------------------------ names and states
    @cached_property
    def coordinate_names(self) -> tuple[str, ...]:
        """Names in the order of all arrays; of coordinates that share a name, the paths."""
        counts = Counter(info.name for info in self.coordinates)
        return tuple(
            info.name if counts[info.name] == 1 else info.path for info in self.coordinates
        )

    def coordinate_index(self, name: str) -> int:
        """Place of a coordinate, by its absolute path, or by its name if no other has it."""
        try:
            return self._coordinate_places[name]
        except KeyError:
            alike = [info.path for info in self.coordinates if info.name == name]
            if alike:
                raise ModelError(
                    f"'{self.name}' has several coordinates '{name}'; name it {' or '.join(alike)}"
                ) from None
            near = suggest_name(name, self.coordinate_names)
            raise ModelError(f"'{self.name}' has no coordinate '{name}'{near}") from None

    def placement(self, name: str) -> FramePlacement:
        """Body index and transform of a frame by absolute path, of a body (or ground) also by name."""
        try:
            return self._placements[name]
        except KeyError:
            near = suggest_name(name, self._placements)
            raise ModelError(f"'{self.name}' has no body or frame '{name}'{near}") from None

    def default_state(self, time: float = 0.0) -> tuple[Array, Array]:
        """Default values (n,) and speeds (n,), these changed as little as the constraints demand.

        Raises:
            SimulationError: no pose near the default one fulfils the constraints.
        """
        q = self.assemble({}, time)
        return q, self.project_speeds(q, {}, time)

    def without_constraints(self) -> Mechanism:
        """The mechanism without constraints, and with no coordinate locked or prescribed: it can be in any state."""
        infos = tuple(replace(info, locked=False, prescribed=None) for info in self.coordinates)
        return replace(self, coordinates=infos, constraints=())

    def assemble(self, q: Values, time: float = 0.0, *, kept: Collection[int] = ()) -> Array:
        """The values (n,) nearest to `q` that fulfil the constraints, by the rules of OpenSim's assembly.

        Locked coordinates, and those whose places are in `kept`, keep their values, clamped ones
        their ranges; those that are `yielding` do not count.

        Raises:
            SimulationError: no pose near the given one fulfils the constraints.
        """
        values = self.values(q)
        if all(isinstance(item, Lock) for item in self.constraints):
            return values
        return assemble_pose(self, values, time, kept)

    def project_speeds(
        self, q: Values, u: Values, time: float = 0.0, *, kept: Collection[int] = ()
    ) -> Array:
        """The speeds (n,) nearest to `u` that fulfil the constraints, by the rules of OpenSim's integrator.

        The change of a speed above 1 counts relative to it; speeds of the coordinates in `kept` do
        not change.

        Raises:
            SimulationError: the constraints do not allow the speeds that are kept.
        """
        return project_speeds(self.at(q, self.speeds(u), time), kept)

    def values(self, q: Values) -> Array:
        """Coordinate values as an array (n,)."""
        return self._array(q, "value", self._default_values)

    def speeds(self, u: Values) -> Array:
        """Generalized speeds as an array (n,)."""
        return self._array(u, "speed", self._default_speeds)

    def at(self, q: Values, u: Values | None = None, time: float = 0.0) -> Kinematics:
        """Poses and velocities of all bodies (u None: at rest), from which everything else follows."""
        values = self.values(q)
        return Kinematics(
            self, values, np.zeros(len(values)) if u is None else self.speeds(u), time
        )

    # ------------------------------------------------------------------------------------------ kinematics
    def body_transforms(self, q: Values) -> dict[str, Array]:
        """Transform (4, 4) in ground of every body, by name."""
        state = self.at(q)
        return {body.name: state.transform(index) for index, body in enumerate(self.bodies)}

    def body_velocities(self, q: Values, u: Values) -> dict[str, Array]:
        """Velocity (6,) in ground of every body, by name: angular, then that of the origin."""
        velocities = self.at(q, u).velocities
        return {body.name: velocities[index] for index, body in enumerate(self.bodies)}

    def body_accelerations(self, q: Values, u: Values, udot: Values) -> dict[str, Array]:
        """Acceleration (6,) in ground of every body, by name: angular, then that of the origin."""
        accelerations = self.at(q, u).accelerations(self._array(udot, "acceleration"))
        return {body.name: accelerations[index] for index, body in enumerate(self.bodies)}

    def frame_transform(self, frame: str, q: Values) -> Array:
        """Transform (4, 4) in ground of a frame."""
        body, placed = self.placement(frame)
        return self.at(q).transform(body) @ placed

    def station_position(self, frame: str, station: ArrayLike, q: Values) -> Array:
        """Position (3,) in ground of a point given in a frame (m)."""
        return self.at(q).point(*self._station(frame, station))

    def station_positions(self, q: Values) -> dict[str, Array]:
        """Position (3,) in ground of every marker and other station, by absolute path (m)."""
        state = self.at(q)
        return {path: state.point(*placed) for path, placed in self.stations.items()}

    def station_velocity(self, frame: str, station: ArrayLike, q: Values, u: Values) -> Array:
        """Velocity (3,) in ground of a point fixed in a frame (m/s)."""
        return self.at(q, u).point_velocity(*self._station(frame, station))

    def jacobian(self, frame: str, q: Values, station: ArrayLike = (0.0, 0.0, 0.0)) -> Array:
        """Matrix (6, n) from u to a frame's angular velocity and a station's velocity, in ground."""
        return self.at(q).point_jacobian(*self._station(frame, station))

    def rate_matrix(self, q: Values) -> Array:
        """N (n, n) with qdot = N u.

        Raises:
            SimulationError: a ball, free or ellipsoid joint stands where N is singular.
        """
        if not self.turning:
            return self._unit
        values, matrix = self.values(q), np.eye(len(self.coordinates))
        for mobilizer in self.turning:
            own = list(mobilizer.coordinates)
            matrix[np.ix_(own, own)] = mobilizer.rate_matrix(values[own])
        return matrix

    def rate_bias(self, q: Values, u: Values) -> Array:
        """Ndot u (n,), so that qddot = N udot + Ndot u; raises as :meth:`rate_matrix`."""
        bias = np.zeros(len(self.coordinates))
        if not self.turning:
            return bias
        values, speeds = self.values(q), self.speeds(u)
        for mobilizer in self.turning:
            own = list(mobilizer.coordinates)
            bias[own] = mobilizer.rate_bias(values[own], speeds[own])
        return bias

    def coordinate_rates(self, q: Values, u: Values) -> Array:
        """Rates of the coordinates (n,) for given generalized speeds; raises as :meth:`rate_matrix`."""
        speeds = self.speeds(u)
        return self.rate_matrix(q) @ speeds if self.turning else speeds.copy()

    def speeds_from_rates(self, q: Values, qdot: Values) -> Array:
        """Generalized speeds (n,) for given rates of the coordinates; raises as :meth:`rate_matrix`."""
        rates = self._array(qdot, "rate")
        if not self.turning:
            return rates.copy()
        return np.asarray(np.linalg.solve(self.rate_matrix(q), rates), dtype=np.float64)

    # -------------------------------------------------------------------------------------------- dynamics
    @cached_property
    def constrained(self) -> frozenset[int]:
        """Indices of the bodies that constraints speak of."""
        return frozenset(body for item in self.constraints for body in item.bodies) - {GROUND}

    @cached_property
    def inertial(self) -> tuple[Array, Array, Array]:
        """Masses (b,), mass centres (b, 3) and inertias (b, 3, 3) of all bodies, as in `MassProperties`."""
        properties = [body.mass_properties for body in self.bodies]
        return (
            np.array([item.mass for item in properties], dtype=float),
            np.array([item.center for item in properties], dtype=float).reshape(-1, 3),
            np.array([item.inertia for item in properties], dtype=float).reshape(-1, 3, 3),
        )

    def mass_matrix(self, q: Values) -> Array:
        """M (n, n) for the generalized speeds."""
        return dynamics.mass_matrix(self.at(q))

    def bias(self, q: Values, u: Values) -> Array:
        """C (n,), the velocity-dependent part of M udot + C = gravity + applied forces."""
        return dynamics.missing_forces(self.at(q, u), self._still, np.zeros(3))

    def gravity_forces(self, q: Values) -> Array:
        """Generalized forces of gravity (n,)."""
        return -dynamics.missing_forces(self.at(q), self._still, self.gravity)

    def generalized_forces(self, q: Values, body_wrenches: Mapping[str, Wrench]) -> Array:
        """Generalized forces (n,) of wrenches at the origins of bodies or frames, along ground's axes."""
        return self._sum_applied_forces(self.at(q), {}, body_wrenches)

    def acceleration(
        self,
        q: Values,
        u: Values,
        generalized_forces: Values | None = None,
        body_wrenches: Mapping[str, Wrench] | None = None,
        time: float = 0.0,
    ) -> Array:
        """Derivatives of the generalized speeds (n,) under gravity, the given forces and the constraints.

        Args:
            q: coordinate values, which must obey the constraints already.
            u: generalized speeds, which must obey them too (that of a locked coordinate is zero).
            generalized_forces: conjugate to the generalized speeds (N, N·m); zero for names left
                out.
            body_wrenches: by body or frame, applied at its origin, along ground's axes.
            time: what prescribed coordinates go by (s).

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
        """Generalized forces (n,) that give `udot` against gravity and the wrenches, constraints left aside."""
        state = self.at(q, u)
        missing = dynamics.missing_forces(state, self._array(udot, "acceleration"), self.gravity)
        return missing - self._sum_applied_forces(state, {}, body_wrenches or {})

    @cached_property
    def total_mass(self) -> float:
        """Mass of all bodies (kg)."""
        return float(self.inertial[0].sum())

    def center_of_mass(self, q: Values) -> Array:
        """Mass centre (3,) in ground (m)."""
        return self._mean(MassCentres.of(self.at(q)).positions())

    def center_of_mass_velocity(self, q: Values, u: Values) -> Array:
        """Velocity (3,) of the mass centre in ground (m/s)."""
        return self._mean(MassCentres.of(self.at(q, u)).velocities())

    def kinetic_energy(self, q: Values, u: Values) -> float:
        """Kinetic energy (J)."""
        return MassCentres.of(self.at(q, u)).kinetic_energy()

    def potential_energy(self, q: Values) -> float:
        """Potential energy of gravity (J), zero with the mass centre at ground's origin."""
        return -self.total_mass * float(self.gravity @ self.center_of_mass(q))

    def momentum(self, q: Values, u: Values) -> tuple[Array, Array]:
        """Linear momentum (3,) in kg·m/s, and angular momentum (3,) about ground's origin in kg·m²/s."""
        return MassCentres.of(self.at(q, u)).momentum()

    # --------------------------------------------------------------------------------------------- helpers
    @cached_property
    def program(self) -> Program:
        """The mechanism in the vectors of the kernels."""
        return Program(tree_of(self, range(len(self.coordinates))), self.constraints)

    def __getstate__(self) -> dict[str, Any]:
        # The program has addresses that are good in this process only.
        return {name: value for name, value in vars(self).items() if name != "program"}

    @cached_property
    def _coordinate_places(self) -> dict[str, int]:
        places = {info.path: index for index, info in enumerate(self.coordinates)}
        places.update((name, index) for index, name in enumerate(self.coordinate_names))
        return places

    @cached_property
    def _placements(self) -> dict[str, FramePlacement]:
        still = np.eye(4)
        places = {name: FramePlacement(GROUND, still) for name in ("ground", "/ground")}
        for index, body in enumerate(self.bodies):
            places[body.name] = places[body.path] = FramePlacement(index, still)
        return places | dict(self.frames)

    @cached_property
    def _default_values(self) -> tuple[float, ...]:
        return tuple(info.default_value for info in self.coordinates)

    @cached_property
    def _default_speeds(self) -> tuple[float, ...]:
        return tuple(info.default_speed for info in self.coordinates)

    @cached_property
    def _still(self) -> Array:
        return np.zeros(len(self.coordinates))

    @cached_property
    def _unit(self) -> Array:
        """What changes speeds that are rates into rates; nobody may write into it."""
        unit = np.eye(len(self.coordinates))
        unit.flags.writeable = False
        return unit

    @cached_property
    def turning(self) -> tuple[Mobilizer, ...]:
        """The mobilizers whose speeds are not the rates of their coordinates."""
        return tuple(body.mobilizer for body in self.bodies if not body.mobilizer.speeds_are_rates)

    def _mean(self, vectors: Array) -> Array:
        """Mean of one vector per body (b, 3), weighted by mass; zero where nothing has mass."""
        return self.inertial[0] @ vectors / (self.total_mass or 1.0)

    def _station(self, frame: str, station: ArrayLike) -> tuple[int, Array]:
        body, placed = self.placement(frame)
        point: Array = placed[:3, :3] @ _make_vector(station, "station") + placed[:3, 3]
        return body, point

    def _sum_applied_forces(
        self, state: Kinematics, forces: Values, wrenches: Mapping[str, Wrench]
    ) -> Array:
        total = self._array(forces, "force")
        for name, (force, torque) in wrenches.items():
            body, placed = self.placement(name)
            load = np.concatenate((_make_vector(torque, "torque"), _make_vector(force, "force")))
            total = total + load @ state.point_jacobian(body, placed[:3, 3])
        return total

    def _array(self, values: Values, what: str, defaults: Sequence[float] = ()) -> Array:
        count = len(self.coordinates)
        if type(values) is np.ndarray and values.shape == (count,) and values.dtype == float:
            return values
        if isinstance(values, Mapping):
            result = np.array(defaults, dtype=float) if defaults else np.zeros(count)
            for name, value in values.items():
                result[self.coordinate_index(name)] = value
            return result
        result = np.asarray(values, dtype=float)
        if result.shape != (count,):
            raise ModelError(
                f"'{self.name}' takes one {what} for each of its {count} coordinates, in their order; "
                f"got {_sizes(result)}"
            )
        return result


def _make_vector(values: ArrayLike, what: str) -> Array:
    result = np.asarray(values, dtype=float)
    if result.shape != (3,):
        raise ModelError(f"a {what} has 3 numbers; got {_sizes(result)}")
    return result


def _sizes(values: Array) -> str:
    return " × ".join(str(size) for size in values.shape) or "a single one"
