"""Lengths, lengthening speeds and moment arms of the paths of a model."""

from __future__ import annotations

from collections.abc import Container, Iterable, Sequence
from functools import cached_property
from pathlib import Path

import numpy as np

from osimlite.base.lazy import make_notebook_repr
from osimlite.mechanics.kernels.paths import LENGTH, SPEED
from osimlite.mechanics.kernels.projection import REDUNDANT
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.constraints import Constraint, Lock
from osimlite.mechanics.multibody.extremes import any_numbers, methods_of_any_numbers
from osimlite.mechanics.multibody.kinematics import Kinematics
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
from osimlite.simulation.polylines import Course, Polylines

ROUNDING = 1e-12
"""What is left of a moment arm, or a speed, of 0."""


@any_numbers
def paths(model: Model, wrapping: str = OPENSIM, mechanism: Mechanism | None = None) -> Paths:
    """The paths of a model: of its muscles, ligaments, springs and actuators, whether these act or not.

    Args:
        model: whose paths.
        wrapping: "opensim", or "geodesic": see :class:`osimlite.simulation.Options`.
        mechanism: of the model, if somebody has it.

    Raises:
        SettingError: there is no such wrapping.
        UnsupportedError: a path, a joint or a constraint of an unknown class.
        ModelError: something makes no sense.
    """
    return Paths(model, wrapping, mechanism=mechanism)


@methods_of_any_numbers
class Paths:
    """The paths of a model, see :func:`paths`.

    Values of coordinates are an array (n,) in the order of the mechanism, or numbers by name or
    path; those that are left out have their defaults.

    Args:
        model: whose paths.
        wrapping: how they bend around surfaces.
        code: what runs the kernels; the best that is installed if left out.
        left_out: paths of owners whose paths are not wanted.
        mechanism: of the model; made if left out.

    Attributes:
        system: that computes them.
        names: component paths of their owners, in the order of the model.
        routes: what each runs through, in terms of the mechanism, by these names.
        mechanism: of the model.
    """

    _repr_html_ = make_notebook_repr("paths")

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
        owners = filter(_has_path, builder.tree.components)
        self._gather(
            builder, [owner for owner in owners if builder.path(owner) not in left_out], code
        )

    def _gather(
        self, builder: ElementBuilder, owners: Sequence[Component], code: Code | None
    ) -> None:
        self.mechanism = builder.mechanism
        self.names = tuple(builder.path(owner) for owner in owners)
        self._coordinates = [info.path for info in self.mechanism.coordinates]
        pairs = zip(self.names, owners, strict=True)
        elements = [MeasuredPath(name, PATH.read(builder, owner)) for name, owner in pairs]
        self._coupled = np.array([element.along.coupled for element in elements], dtype=bool)
        # A locked coordinate has a moment arm too, which is that of the coordinate once it is not
        # locked.
        self.routes = {element.path: element.along for element in elements}
        self.system = PathSystem(
            self.mechanism.without_constraints(), Forces(tuple(elements)), code=code
        )

    def around_surfaces(self, model: Model, wrapping: str, code: Code | None = None) -> Paths:
        """Those of the paths that have surfaces to wrap around, wrapped otherwise; the mechanism is shared.

        Args:
            model: whose paths these are.
            wrapping: how they bend around surfaces.
            code: what runs the kernels; the best that is installed if left out.
        """
        builder = ElementBuilder(model, self.mechanism, Path(), wrapping=wrapping)
        routes = self.routes.items()
        names = [
            name for name, route in routes if isinstance(route, ThroughPoints) and route.surfaces
        ]
        other = object.__new__(Paths)
        other._gather(builder, [builder.tree.at(name) for name in names], code)
        return other

    def lengths(self, q: Values) -> dict[str, float]:
        """Length of each path (m)."""
        lengths = self.system.measured(
            self.mechanism.values(q), np.zeros(len(self._coordinates)), LENGTH
        )
        return dict(zip(self.names, lengths.tolist(), strict=True))

    def speeds(self, q: Values, u: Values) -> dict[str, float]:
        """Lengthening speed of each path (m/s) for generalized speeds u, given as the values are.

        As in OpenSim it is the sum over all pairs of neighbouring points, tangent points moving
        with their bodies: the rate of the length only where no point comes or goes, and where the
        path on a surface is the shortest. Along geodesics it is.
        """
        speeds = self.system.measured(self.mechanism.values(q), self.mechanism.speeds(u), SPEED)
        return dict(zip(self.names, speeds.tolist(), strict=True))

    def points(self, q: Values) -> dict[str, list[tuple[int, Array]]]:
        """What each path through points runs through, from end to end: numbers, and places (3,) in ground (m).

        Of n points the i-th has number i; the two tangent points of its k-th PathWrap have n + 2 k
        and n + 2 k + 1. Along geodesics k counts the surfaces of its route, of which there is one
        for each piece that may be bent.
        """
        return self.system.nodes(self.mechanism.values(q), self.routes)

    def lengths_on_surfaces(self, q: Values) -> dict[str, dict[str, float]]:
        """Length of each path through points on each of its surfaces, by their names (m); 0 where it passes by.

        NaN where OpenSim has the path wrap, finds no points for it, and goes straight through the
        surface.
        """
        return self.system.on_surfaces(self.mechanism.values(q), self.routes)

    def polylines(self, q: Values) -> dict[str, Array]:
        """Corners (k, 3) in ground (m) of each path, from end to end, round its surfaces.

        A path that is a function of coordinates has none. With OpenSim's wrapping there are a helix
        on a cylinder, a great circle on a sphere, the section of a plane with an ellipsoid, a helix
        about the tube of a torus; corners there are 0.15 rad apart.
        """
        state = self.mechanism.at(self.mechanism.values(q))
        corners = self._polylines.at(state.q, state.rotations[:-1], state.origins[:-1])
        return dict(zip(self._traced, corners, strict=True))

    @cached_property
    def _traced(self) -> dict[str, Course]:
        return {name: route for name, route in self.routes.items() if isinstance(route, Course)}

    @cached_property
    def _polylines(self) -> Polylines:
        return Polylines(self.mechanism, list(self._traced.values()))

    def moment_arms(self, q: Values) -> dict[str, dict[str, float]]:
        """Moment arms of each path about the coordinates by their paths (m, or 1 for a coordinate in m), but for zeros.

        As OpenSim's computeMomentArm has them: what a tension of 1 N does at the coordinate, and at
        those that must move with it; NaN at one that cannot move. That is the derivative of the
        length times -1 only where the speed is its rate.
        """
        (arms,) = self.all_moment_arms(self.mechanism.values(q)[None])
        return {
            name: {
                path: arm for path, arm in zip(self._coordinates, row, strict=True) if arm != 0.0
            }
            for name, row in zip(self.names, arms.tolist(), strict=True)
        }

    def all_moment_arms(self, poses: Array, couplings: Iterable[Array] | None = None) -> Array:
        """The same (k, p, n) of all paths about all coordinates, in poses (k, n) in the order of the mechanism.

        `couplings` are the :meth:`coupling` (n, n) of each pose, where they are known.
        """
        arms = self.system.pulled(poses)
        if not all(isinstance(item, Lock) for item in self.mechanism.constraints):
            each = map(self.coupling, poses) if couplings is None else couplings
            for row, coupling in zip(arms, each, strict=True):
                row[self._coupled] = row[self._coupled] @ coupling
        arms[np.abs(arms) <= ROUNDING] = 0.0
        return arms

    def coupling(self, q: Values) -> Array:
        """The generalized speeds (n, n) that go with a speed of 1 of each coordinate, in its column.

        NaN where a coordinate cannot move.
        """
        q = self.mechanism.values(q)
        constraints = self.mechanism.constraints
        if all(isinstance(item, Lock) for item in constraints):
            return np.eye(len(q))
        state = self.mechanism.at(q)
        coupling = self.coupling_of_free(state)
        for place, lock in self._locks.items():
            others = [item for item in constraints if item is not lock]
            coupling[:, [place]] = _coupled(others, state, [place])[:, [place]]
        return coupling

    def coupling_of_free(self, state: Kinematics) -> Array:
        """The same (n, n) in a pose at rest; a locked coordinate has the column of one that nothing goes with."""
        constraints = self.mechanism.constraints
        free = [index for index in range(len(state.q)) if index not in self._locks]
        return _coupled(constraints, state, free if len(constraints) > len(self._locks) else [])

    @cached_property
    def _locks(self) -> dict[int, Lock]:
        return {
            item.coordinate: item for item in self.mechanism.constraints if isinstance(item, Lock)
        }


def _coupled(constraints: Sequence[Constraint], state: Kinematics, places: Sequence[int]) -> Array:
    """The speeds nearest to 1 for a coordinate and 0 for all others, divided by its own, in the columns of `places`."""
    coupling = np.eye(len(state.q))
    if constraints and places:
        rows, wanted = stack_equations([item.velocity_equations(state) for item in constraints])
        speeds = coupling[:, places] - solve_least_norm(
            rows, rows[:, places] - wanted[:, None], REDUNDANT * len(rows)
        )
        own = speeds[places, range(len(places))]
        coupling[:, places] = speeds / np.where(np.abs(own) > ROUNDING, own, np.nan)
    return coupling


def _has_path(owner: Component) -> bool:
    # To ask an object for what it does not have is dear: the answer says what it has.
    return "geometry_path" in type(owner).model_fields and isinstance(
        owner.geometry_path, AbstractGeometryPath
    )
