"""Constraints between bodies or coordinates."""

import math
from typing import Annotated

from osimlite.schema.facts import Facts
from osimlite.schema.fields import Number, Optional, Vec3, real, vec3
from osimlite.schema.frames import TwoFrameLinker
from osimlite.schema.functions import Function
from osimlite.schema.references import CoordinateName, CoordinateNames, PhysicalFrameSocket
from osimlite.schema.sets import Constraint


class ConstantDistanceConstraint(Constraint):
    """Keeps a point of one frame at a distance from a point of another, as a rod with ball joints would."""

    facts = Facts(refused="constant_distance")

    socket_body_1: PhysicalFrameSocket = ""
    """The frame of the first point."""
    socket_body_2: PhysicalFrameSocket = ""
    """The frame of the second point."""
    location_body_1: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    """Position of the first point in its frame."""
    location_body_2: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    """Position of the second point in its frame."""
    # OpenSim has no default and rejects a constraint without a distance.
    constant_distance: Annotated[float, real("m", "> 0")] = math.nan
    """Distance of the two points."""


class CoordinateCouplerConstraint(Constraint):
    """Makes one coordinate a function of others: dependent = `scale_factor` f(independent ones)."""

    facts = Facts(scales={"scale_factor": "dependent_coordinate_name"})

    coupled_coordinates_function: Optional[Function] = None
    """Function of the independent coordinates; its first two derivatives are used also."""
    independent_coordinate_names: CoordinateNames = ()
    """Names of the coordinates that are the arguments of the function, in this order."""
    dependent_coordinate_name: CoordinateName = ""
    """Name of the coordinate that the function determines."""
    scale_factor: Number = 1.0
    """Factor of the function; scaling a model changes it where the dependent coordinate is a length."""


class PointConstraint(Constraint):
    """Keeps a point of one frame on a point of another, as a ball joint would."""

    socket_body_1: PhysicalFrameSocket = ""
    """The frame of the first point."""
    socket_body_2: PhysicalFrameSocket = ""
    """The frame of the second point."""
    location_body_1: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    """Position of the first point in its frame."""
    location_body_2: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    """Position of the second point in its frame."""


class PointOnLineConstraint(Constraint):
    """Keeps a point of the follower on a line fixed in the line's body."""

    socket_line_body: PhysicalFrameSocket = ""
    """Frame in which the line is fixed."""
    socket_follower_body: PhysicalFrameSocket = ""
    """Frame of the point that stays on the line."""
    line_direction_vec: Annotated[Vec3, vec3()] = (0.0, 0.0, 0.0)
    """Direction of the line, along the axes of its frame; its length does not matter."""
    point_on_line: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    """Any point of the line, in its frame."""
    point_on_follower: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    """Point of the follower that stays on the line."""


class UnilateralConstraint(Constraint, abstract=True):
    """Constraint that acts in one direction only, such as a contact."""


# OpenSim leaves these constraints off until a program turns them on.
class RollingOnSurfaceConstraint(UnilateralConstraint):
    """A round body that rolls on a plane of another, and may lift off or slip."""

    socket_rolling_body: PhysicalFrameSocket = ""
    """The frame of the body that rolls."""
    socket_surface_body: PhysicalFrameSocket = ""
    """Frame in which the plane is fixed."""
    surface_normal: Annotated[Vec3, vec3()] = (0.0, 1.0, 0.0)
    """Normal of the plane, along the axes of its frame."""
    surface_height: Number = 0.0
    """Distance of the plane from the origin of its frame, along the normal (m)."""
    friction_coefficient: Annotated[float, real(domain=">= 0")] = 0.5
    """Ratio of friction to normal force above which the constraint against slip is released."""
    contact_radius: Annotated[float, real(domain="> 0")] = 0.01
    """Radius (m) of the patch whose friction bears a torque about the normal."""


class WeldConstraint(TwoFrameLinker, Constraint):
    """Holds two frames together; used to close loops."""
