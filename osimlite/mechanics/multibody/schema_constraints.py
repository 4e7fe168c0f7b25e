"""Conversion of the constraints of a model to constraints of a mechanism."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from osimlite.base.records import dataclass
from osimlite.base.text import join_words
from osimlite.errors import ModelError, UnsupportedError
from osimlite.mechanics.multibody import body_constraints as b
from osimlite.mechanics.multibody.constraints import ConstraintEquations, Coupler
from osimlite.mechanics.multibody.functions import ScaledFunction
from osimlite.mechanics.multibody.parts import FramePlacement, StationPlacement
from osimlite.mechanics.multibody.schema_frames import Placements
from osimlite.mechanics.multibody.schema_functions import convert_function
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema import constraint_types as schema
from osimlite.schema.base import Component
from osimlite.schema.sets import Constraint as SchemaConstraint


@dataclass(frozen=True, eq=False)
class ConstraintReader:
    """Converter of constraints of a model."""

    placements: Placements  # frames of the model
    bodies: Mapping[str, int]  # index in the mechanism of every body and ground, by absolute path
    coordinates: Mapping[str, int]  # index in the mechanism of every coordinate, by absolute path
    opensim_derivatives: bool  # see `build_mechanism`

    def build_constraint(self, constraint: SchemaConstraint) -> ConstraintEquations:
        """Return the constraint of the mechanism for an enforced constraint of the model.

        Raises:
            ModelError: a reference has no target, or a function, a direction or a distance is
                impossible.
            UnsupportedError: the constraint is of an unknown class.
        """  # noqa: DOC501 - a function makes the UnsupportedError
        make = _READERS.get(type(constraint))
        path = self.placements.path(constraint)
        if make is None:
            raise unknown_constraint(path, type(constraint).__name__)
        return make(self, constraint, path)

    def _find_base(self, owner: Component, socket: str) -> int:
        return self.bodies[
            self.placements.resolve_frame(self.placements.follow_socket(owner, socket))[0]
        ]

    def _read_station(self, owner: Component, socket: str, location: str) -> StationPlacement:
        """Return the point of a constraint on a body.

        Args:
            owner: constraint of the model.
            socket: name of the constraint's socket that refers to the body.
            location: name of the constraint's property with the location of the point in the body
                (m).
        """
        # OpenSim applies the location to the body itself, even where the socket refers to an offset
        # frame.
        return StationPlacement(
            self._find_base(owner, socket), np.array(getattr(owner, location), dtype=float)
        )

    def _find_frame(self, owner: Component, socket: str) -> FramePlacement:
        """Return the body of the frame that a socket refers to, and the frame in this body.

        Args:
            owner: component with the socket.
            socket: name of the socket.
        """
        base, matrix = self.placements.resolve_frame(self.placements.follow_socket(owner, socket))
        return FramePlacement(self.bodies[base], matrix)

    def _find_coordinate(self, owner: Component, field: str, value: str | Component) -> int:
        """Return the index in the mechanism of a coordinate that a constraint refers to.

        Args:
            owner: constraint of the model.
            field: name of the property, for messages.
            value: value of the property: name or path of a coordinate, or the coordinate itself.

        Raises:
            ModelError: no joint moves by the coordinate.
        """
        path = self.placements.path(self.placements.tree.target(owner, field, value))
        if path not in self.coordinates:
            # If a coordinate occurs several times in a joint, only the first one moves the joint.
            raise ModelError(
                f"the {field} of '{self.placements.path(owner)}' is '{path}', which moves no joint; "
                "name a coordinate that moves a joint"
            )
        return self.coordinates[path]

    def build_coupler(
        self, item: schema.CoordinateCouplerConstraint, path: str
    ) -> ConstraintEquations:
        """Return the constraint of one coordinate by a function of others.

        Args:
            item: constraint of the model.
            path: path of the constraint in the model.
        """
        names = item.independent_coordinate_names
        function = convert_function(
            item.coupled_coordinates_function,
            len(names),
            f"the function of '{path}'",
            opensim_derivatives=self.opensim_derivatives,
        )
        return Coupler(
            self._find_coordinate(
                item, "dependent_coordinate_name", item.dependent_coordinate_name
            ),
            tuple(
                self._find_coordinate(item, "independent_coordinate_names", name) for name in names
            ),
            function if item.scale_factor == 1.0 else ScaledFunction(item.scale_factor, function),
            path,
        )

    def build_point_constraint(
        self, item: schema.PointConstraint, path: str
    ) -> ConstraintEquations:
        """Return the constraint that holds two stations together.

        Args:
            item: constraint of the model.
            path: path of the constraint in the model.
        """
        return b.PointEquations(
            self._read_station(item, "socket_body_1", "location_body_1"),
            self._read_station(item, "socket_body_2", "location_body_2"),
            path,
        )

    def build_distance_constraint(
        self, item: schema.ConstantDistanceConstraint, path: str
    ) -> ConstraintEquations:
        """Return the constraint that keeps two stations at a distance.

        Args:
            item: constraint of the model.
            path: path of the constraint in the model.

        Raises:
            ModelError: the distance is not positive, or not finite.
        """
        if not 0.0 < item.constant_distance < np.inf:
            raise ModelError(
                f"'{path}' has a distance of {item.constant_distance:g}; give a positive length in m"
            )
        return b.DistanceConstraint(
            self._read_station(item, "socket_body_1", "location_body_1"),
            self._read_station(item, "socket_body_2", "location_body_2"),
            item.constant_distance,
            path,
        )

    def build_point_on_line(
        self, item: schema.PointOnLineConstraint, path: str
    ) -> ConstraintEquations:
        """Return the constraint that keeps a station on a line.

        Args:
            item: constraint of the model.
            path: path of the constraint in the model.
        """
        return b.PointOnLineEquations(
            self._read_station(item, "socket_line_body", "point_on_line"),
            _parse_direction(item.line_direction_vec, f"the line of '{path}'"),
            self._read_station(item, "socket_follower_body", "point_on_follower"),
            path,
        )

    def build_rolling_constraint(
        self, item: schema.RollingOnSurfaceConstraint, path: str
    ) -> ConstraintEquations:
        """Return the constraint of a roller on a plane.

        Args:
            item: constraint of the model.
            path: path of the constraint in the model.
        """
        return b.RollingConstraint(
            self._find_base(item, "socket_surface_body"),
            self._find_base(item, "socket_rolling_body"),
            _parse_direction(item.surface_normal, f"the surface of '{path}'"),
            item.surface_height,
            path,
        )

    def build_weld_constraint(self, item: schema.WeldConstraint, path: str) -> ConstraintEquations:
        """Return the constraint that holds two frames together.

        Args:
            item: constraint of the model.
            path: path of the constraint in the model.
        """
        return b.WeldEquations(
            self._find_frame(item, "socket_frame1"), self._find_frame(item, "socket_frame2"), path
        )


def unknown_constraint(path: str, class_name: str) -> UnsupportedError:
    """Return the error for a constraint of an unknown class.

    Args:
        path: path of the constraint.
        class_name: name of its class.
    """
    return UnsupportedError(
        f"the constraint '{path}' ({class_name}) cannot be computed; set its isEnforced to false or remove it; "
        f"osimlite supports {join_words([item.__name__ for item in _READERS], max_count=len(_READERS))}"
    )


def _parse_direction(vector: tuple[float, float, float], description: str) -> Array:
    direction = np.array(vector, dtype=float)
    length = float(np.linalg.norm(direction))
    if not 0.0 < length < np.inf:
        raise ModelError(f"{description} has no direction; give a vector that is not zero")
    return direction / length


_READERS: dict[type[SchemaConstraint], Callable[..., ConstraintEquations]] = {
    schema.CoordinateCouplerConstraint: ConstraintReader.build_coupler,
    schema.PointConstraint: ConstraintReader.build_point_constraint,
    schema.ConstantDistanceConstraint: ConstraintReader.build_distance_constraint,
    schema.PointOnLineConstraint: ConstraintReader.build_point_on_line,
    schema.RollingOnSurfaceConstraint: ConstraintReader.build_rolling_constraint,
    schema.WeldConstraint: ConstraintReader.build_weld_constraint,
}
