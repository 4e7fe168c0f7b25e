"""Lengths, lengthening speeds and moment arms of the paths of a model."""

from __future__ import annotations

from collections.abc import Container, Iterable, Sequence
from functools import cached_property
from pathlib import Path

import numpy as np

from osimlite.base.lazy import make_notebook_repr
from osimlite.mechanics.kernels.paths import PATH_WORK
from osimlite.mechanics.kernels.projection import INDEPENDENCE
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.constraints import ConstraintEquations, Lock
from osimlite.mechanics.multibody.extremes import any_numbers, methods_of_any_numbers
from osimlite.mechanics.multibody.kinematics import MechanismKinematics
from osimlite.mechanics.multibody.linear import solve_least_norm, stack_equations
from osimlite.mechanics.multibody.mechanism import Mechanism, Values
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.base import Component
from osimlite.schema.model import Model
from osimlite.schema.paths import AbstractGeometryPath
from osimlite.simulation.elements import ElementBuilder, Forces
from osimlite.simulation.elements.builder import OPENSIM
from osimlite.simulation.elements.geometries.path import PATH
from osimlite.simulation.elements.geometries.paths.geometry_path import ThroughPoints
from osimlite.simulation.engines.linking import Code
from osimlite.simulation.path_system import MeasuredPath, PathSystem
from osimlite.simulation.polylines import Polylines, TraceablePath

ARM_ROUNDING = 1e-12
"""Moment arms and speeds up to this size are rounding errors of 0."""


@any_numbers
def paths(model: Model, wrapping: str = OPENSIM, mechanism: Mechanism | None = None) -> Paths:
    """Return the paths of a model: of its muscles, ligaments, springs and actuators.

    Paths of forces that are switched off are included.

    Args:
        model: model with the paths.
        wrapping: "opensim" or "geodesic", see :class:`osimlite.simulation.Options`.
        mechanism: mechanism of the model; built if None.

    Returns:
        The paths, ready to be measured in any pose.

    Raises:
        SettingError: there is no such wrapping.
        UnsupportedError: osimlite does not support a path, joint or constraint.
        ModelError: the model is not a mechanism.
    """
    return Paths(model, wrapping, mechanism=mechanism)


MAX_LISTED = 6
"""Names that the text of paths lists."""


@methods_of_any_numbers
class Paths:
    """The paths of a model, see :func:`paths`.

    Methods take values of coordinates as an array (n,) in the order of the mechanism, or as numbers
    by name or path; missing ones have their defaults.

    Args:
        model: model with the paths.
        wrapping: method of wrapping, see :class:`osimlite.simulation.Options`.
        code: backend that runs the kernels; None for the fastest that is installed.
        left_out: paths of owners that are ignored.
        mechanism: mechanism of the model; built if None.

    Attributes:
        system: system that computes the paths.
        names: component paths of the owners, in the order of the model.
        routes: points and surfaces of each path in the mechanism, by these names.
        mechanism: mechanism of the model.
    """

    _repr_html_ = make_notebook_repr("paths")

    def __repr__(self) -> str:
        listed = ", ".join(name.rpartition("/")[2] for name in self.names[:MAX_LISTED])
        unlisted_count = len(self.names) - MAX_LISTED
        ending = f" and {unlisted_count} more" if unlisted_count > 0 else ""
        return f"Paths of '{self.mechanism.name}': {listed or 'none'}{ending}"

    def __init__(
        self,
        model: Model,
        wrapping: str = OPENSIM,
        code: Code | None = None,
        left_out: Container[str] = (),
        mechanism: Mechanism | None = None,
    ) -> None:
        mechanism = build_mechanism(model) if mechanism is None else mechanism
        builder = ElementBuilder(model, mechanism, Path(), wrapping=wrapping)
        # The lazy filter tests each component once.
        owners = filter(_has_path, builder.tree.components)
        self._build_system(
            builder, [owner for owner in owners if builder.path(owner) not in left_out], code
        )

    def _build_system(
        self, builder: ElementBuilder, owners: Sequence[Component], code: Code | None
    ) -> None:
        self.mechanism = builder.mechanism
        self.names = tuple(builder.path(owner) for owner in owners)
        self._coordinates = [info.path for info in self.mechanism.coordinates]
        pairs = zip(self.names, owners, strict=True)
        elements = [MeasuredPath(name, PATH.read(builder, owner)) for name, owner in pairs]
        self._coupled = np.array([element.along.coupled for element in elements], dtype=bool)
        # OpenSim gives a locked coordinate the moment arm that it has when it is unlocked.
        # The coupling is applied to moment arms afterwards.
        self.routes = {element.path: element.along for element in elements}
        self.system = PathSystem(
            self.mechanism.without_constraints(), Forces(tuple(elements)), code=code
        )

    def rewrap_paths(self, model: Model, wrapping: str, code: Code | None = None) -> Paths:
        """Return the paths with wrap surfaces, with another wrapping; the mechanism is shared.

        Args:
            model: the model of the paths.
            wrapping: method of wrapping, see :class:`osimlite.simulation.Options`.
            code: backend that runs the kernels; None for the fastest that is installed.
        """
        builder = ElementBuilder(model, self.mechanism, Path(), wrapping=wrapping)
        routes = self.routes.items()
        names = [
            name for name, route in routes if isinstance(route, ThroughPoints) and route.surfaces
        ]
        # No constructor: the mechanism is that of this object.
        result = object.__new__(Paths)
        result._build_system(builder, [builder.tree.find(name) for name in names], code)
        return result

    def lengths(self, q: Values) -> dict[str, float]:
        """Return the length of each path.

        Args:
            q: values of coordinates.

        Returns:
            Lengths (m) by owner.
        """
        lengths = self.system.measure_paths(
            self.mechanism.values(q), np.zeros(len(self._coordinates)), PATH_WORK.LENGTH
        )
        return dict(zip(self.names, lengths.tolist(), strict=True))

    def speeds(self, q: Values, u: Values) -> dict[str, float]:
        """Return the lengthening speed of each path.

        As in OpenSim it is the sum over all pairs of neighbouring points, and tangent points move
        with their bodies. It equals the rate of the length only where no point appears or
        disappears, and where the path on a surface is the shortest one. Geodesic paths fulfil that.

        Args:
            q: values of coordinates.
            u: generalized speeds, in the same form.

        Returns:
            Speeds (m/s) by owner.
        """
        speeds = self.system.measure_paths(
            self.mechanism.values(q), self.mechanism.speeds(u), PATH_WORK.SPEED
        )
        return dict(zip(self.names, speeds.tolist(), strict=True))

    def points(self, q: Values) -> dict[str, list[tuple[int, Array]]]:
        """Return the nodes of each path through points, from end to end.

        Of n points the i-th has index i; the two tangent points of its k-th PathWrap have the
        indices n + 2 k and n + 2 k + 1. For geodesic wrapping, k counts the surfaces of the route:
        one for each segment that may wrap.

        Args:
            q: values of coordinates.

        Returns:
            Index and position (3,) in ground (m) of each node, by the path of the owner.
        """
        return self.system.locate_nodes(self.mechanism.values(q), self.routes)

    def lengths_on_surfaces(self, q: Values) -> dict[str, dict[str, float]]:
        """Return the length of each path through points on each of its surfaces; 0 where it does not touch.

        NaN stands for a path that OpenSim wraps, finds no tangent points for, and leads straight
        through the surface.

        Args:
            q: values of coordinates.

        Returns:
            Lengths (m) by owner and surface.
        """
        return self.system.measure_on_surfaces(self.mechanism.values(q), self.routes)

    def polylines(self, q: Values) -> dict[str, Array]:
        """Return the corners of each path around its surfaces, from end to end, for drawing.

        A path that is a function of coordinates has none. With OpenSim's wrapping a path follows a
        helix on a cylinder, a great circle on a sphere, a plane section of an ellipsoid, and a
        helix about the tube of a torus; corners there are 0.15 rad apart.

        Args:
            q: values of coordinates.

        Returns:
            Corners (k, 3) in ground (m) by owner.
        """
        state = self.mechanism.at(self.mechanism.values(q))
        corners = self._polylines.trace(state.q, state.rotations[:-1], state.origins[:-1])
        return dict(zip(self._traced, corners, strict=True))

    @cached_property
    def _traced(self) -> dict[str, TraceablePath]:
        return {
            name: route for name, route in self.routes.items() if isinstance(route, TraceablePath)
        }

    @cached_property
    def _polylines(self) -> Polylines:
        return Polylines(self.mechanism, list(self._traced.values()))

    def moment_arms(self, q: Values) -> dict[str, dict[str, float]]:
        """Return the moment arms of each path, without zeros, by the paths of the coordinates.

        They are defined as in OpenSim's computeMomentArm: the generalized force of a tension of 1 N
        at the coordinate and at those that move with it; NaN at a coordinate that cannot move. They
        equal minus the derivative of the length only where the speed is the rate of the length.

        Args:
            q: values of coordinates.

        Returns:
            Moment arms (m, or 1 for a coordinate in m) by owner and coordinate.
        """
        (arms,) = self.compute_moment_arms(self.mechanism.values(q)[None])
        return {
            name: {
                path: arm for path, arm in zip(self._coordinates, row, strict=True) if arm != 0.0
            }
            for name, row in zip(self.names, arms.tolist(), strict=True)
        }

    def compute_moment_arms(self, poses: Array, couplings: Iterable[Array] | None = None) -> Array:
        """Return the moment arms of all paths about all coordinates in many poses.

        Args:
            poses: values of all coordinates (k, n).
            couplings: result of :meth:`compute_coupling` (n, n) for each pose, if known.

        Returns:
            Moment arms (k, p, n), m, or 1 for a coordinate in m; NaN at a coordinate that cannot
            move.
        """
        arms = self.system.compute_pulls(poses)
        # Without constraints other than locks, the coupling is the identity.
        if not all(isinstance(item, Lock) for item in self.mechanism.constraints):
            pose_couplings = map(self.compute_coupling, poses) if couplings is None else couplings
            for row, coupling in zip(arms, pose_couplings, strict=True):
                # OpenSim's moment arm includes what a coupled coordinate contributes, except for
                # paths that are functions.
                row[self._coupled] = row[self._coupled] @ coupling
        # Rounding would make a path cross coordinates that it does not cross.
        arms[np.abs(arms) <= ARM_ROUNDING] = 0.0
        return arms

    def compute_coupling(self, q: Values) -> Array:
        """Return the generalized speeds that the constraints couple to each coordinate.

        Args:
            q: values of coordinates.

        Returns:
            Matrix (n, n), whose column i has the speeds that go with a speed of 1 of coordinate i.
            Columns of coordinates that cannot move are NaN.
        """
        q = self.mechanism.values(q)
        constraints = self.mechanism.constraints
        if all(isinstance(item, Lock) for item in constraints):
            return np.eye(len(q))
        state = self.mechanism.at(q)
        coupling = self.compute_free_coupling(state)
        # OpenSim unlocks a coordinate before it computes its moment arm.
        for index, lock in self._locks.items():
            # Without its lock a coordinate moves, with all others that constraints couple.
            other_constraints = [item for item in constraints if item is not lock]
            coupling[:, [index]] = _compute_coupled_speeds(other_constraints, state, [index])[
                :, [index]
            ]
        return coupling

    def compute_free_coupling(self, state: MechanismKinematics) -> Array:
        """Return the coupling of the coordinates that are not locked.

        Args:
            state: a pose at rest.

        Returns:
            Matrix (n, n) as in :meth:`compute_coupling`; columns of locked coordinates have a
            single 1.
        """
        constraints = self.mechanism.constraints
        free = [index for index in range(len(state.q)) if index not in self._locks]
        return _compute_coupled_speeds(
            constraints, state, free if len(constraints) > len(self._locks) else []
        )

    @cached_property
    def _locks(self) -> dict[int, Lock]:
        return {
            item.coordinate: item for item in self.mechanism.constraints if isinstance(item, Lock)
        }


def _compute_coupled_speeds(
    constraints: Sequence[ConstraintEquations], state: MechanismKinematics, indices: Sequence[int]
) -> Array:
    """Return the admissible speeds that go with a speed of 1 of some coordinates.

    For each such coordinate, of all admissible speeds those nearest to 1 for it and 0 for the
    others are taken, and divided by its own speed.

    Args:
        constraints: the constraints.
        state: a pose.
        indices: indices of the coordinates.

    Returns:
        Matrix (n, n) with the speeds in the columns of `indices`; the others have a single 1. NaN
        where the coordinate cannot move.
    """
    coupling = np.eye(len(state.q))
    if constraints and indices:
        # The least-norm correction is subtracted from the unit speed.
        rows, rhs = stack_equations([item.velocity_equations(state) for item in constraints])
        speeds = coupling[:, indices] - solve_least_norm(
            rows, rows[:, indices] - rhs[:, None], INDEPENDENCE * len(rows)
        )
        driving_speeds = speeds[indices, range(len(indices))]
        # A speed that constraints do not allow has no moment arm (NaN).
        coupling[:, indices] = speeds / np.where(
            np.abs(driving_speeds) > ARM_ROUNDING, driving_speeds, np.nan
        )
    return coupling


def _has_path(owner: Component) -> bool:
    # Accessing a missing attribute is slow, because the error message lists all properties.
    return "geometry_path" in type(owner).model_fields and isinstance(
        owner.geometry_path, AbstractGeometryPath
    )
