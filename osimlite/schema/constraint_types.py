"""Constraints between bodies or coordinates."""

import math
from typing import Annotated

from osimlite.schema.constraints import Constraint
from osimlite.schema.fields import Number, Optional, Vec3, real, vec3
from osimlite.schema.frames import TwoFrameLinker
from osimlite.schema.functions import Function
from osimlite.schema.references import CoordinateName, CoordinateNames, PhysicalFrameSocket


class ConstantDistanceConstraint(Constraint):
    """Keeps a point of one frame at a distance from a point of another, as a rod with ball joints would."""

    socket_body_1: PhysicalFrameSocket = ""
    socket_body_2: PhysicalFrameSocket = ""
    location_body_1: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    location_body_2: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    constant_distance: Annotated[float, real("m", "> 0")] = math.nan


class CoordinateCouplerConstraint(Constraint):
    """Makes one coordinate a function of others: dependent = `scale_factor` f(independent ones)."""

    coupled_coordinates_function: Optional[Function] = None
    independent_coordinate_names: CoordinateNames = ()
    dependent_coordinate_name: CoordinateName = ""
    scale_factor: Number = 1.0


class PointConstraint(Constraint):
    """Keeps a point of one frame on a point of another, as a ball joint would."""

    socket_body_1: PhysicalFrameSocket = ""
    socket_body_2: PhysicalFrameSocket = ""
    location_body_1: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    location_body_2: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)


class PointOnLineConstraint(Constraint):
    """Keeps a point of the follower on a line fixed in the line's body."""

    socket_line_body: PhysicalFrameSocket = ""
    socket_follower_body: PhysicalFrameSocket = ""
    line_direction_vec: Annotated[Vec3, vec3()] = (0.0, 0.0, 0.0)
    point_on_line: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    point_on_follower: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)


class UnilateralConstraint(Constraint, abstract=True):
    """A constraint that can let go."""


class RollingOnSurfaceConstraint(UnilateralConstraint):
    """A round body that rolls on a plane of another, and may lift off or slip.

    The plane is `surface_height` along `surface_normal` from the origin of the surface's body.
    """

    socket_rolling_body: PhysicalFrameSocket = ""
    socket_surface_body: PhysicalFrameSocket = ""
    surface_normal: Annotated[Vec3, vec3()] = (0.0, 1.0, 0.0)
    surface_height: Number = 0.0
    friction_coefficient: Annotated[float, real(domain=">= 0")] = 0.5
    contact_radius: Annotated[float, real(domain="> 0")] = 0.01


class WeldConstraint(TwoFrameLinker, Constraint):
    """Keeps two frames on each other; this is how loops are closed."""
