"""Springs between points, on coordinates and between frames."""

from typing import Annotated

from osimlite.schema.base import made
from osimlite.schema.fields import Number, Optional, Text, Vec3, maybe, real, vec3
from osimlite.schema.forces import Force, ForceProducer
from osimlite.schema.frames import TwoFrameLinker
from osimlite.schema.functions import Constant, Function
from osimlite.schema.references import (
    CoordinateName,
    MaybeCoordinateName,
    MaybeFrameName,
    PhysicalFrameSocket,
)


class PointToPointSpring(Force):
    """A straight spring between a point of one body and a point of another."""

    socket_body1: PhysicalFrameSocket = ""
    socket_body2: PhysicalFrameSocket = ""
    point1: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    point2: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    stiffness: Annotated[float, real("N/m", ">= 0")] = 1.0
    rest_length: Annotated[float, real("m", ">= 0")] = 0.0


class SpringGeneralizedForce(ForceProducer):
    """A damped spring on one coordinate: -`stiffness` (q - `rest_length`) - `viscosity` u."""

    coordinate: MaybeCoordinateName = None
    stiffness: Annotated[float, real(domain=">= 0")] = 0.0
    rest_length: Number = 0.0
    viscosity: Annotated[float, real(domain=">= 0")] = 0.0


class ExpressionBasedCoordinateForce(ForceProducer):
    """A force on one coordinate by a formula in its value `q` and its speed `qdot`."""

    coordinate: CoordinateName = "UNASSIGNED"
    expression: Text = "0.0"


class ExpressionBasedPointToPointForce(ForceProducer):
    """A force along the line between two points by a formula in their distance `d` and its rate `ddot`."""

    body1: MaybeFrameName = None
    body2: MaybeFrameName = None
    point1: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    point2: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    expression: Text = "0.0"


class BushingForce(TwoFrameLinker, Force):
    """A linear spring and damper for each of the six deviations of frame 2 from frame 1.

    The rotations are body-fixed X-Y-Z angles.
    """

    rotational_stiffness: Annotated[Vec3, vec3("N*m/rad", ">= 0")] = (0.0, 0.0, 0.0)
    translational_stiffness: Annotated[Vec3, vec3("N/m", ">= 0")] = (0.0, 0.0, 0.0)
    rotational_damping: Annotated[Vec3, vec3("N*m/(rad/s)", ">= 0")] = (0.0, 0.0, 0.0)
    translational_damping: Annotated[Vec3, vec3("N/(m/s)", ">= 0")] = (0.0, 0.0, 0.0)


class ExpressionBasedBushingForce(TwoFrameLinker, ForceProducer):
    """A bushing whose moments and forces are formulas in `theta_x` ... `delta_z`; damping stays linear."""

    Mx_expression: Text = "0.0"
    My_expression: Text = "0.0"
    Mz_expression: Text = "0.0"
    Fx_expression: Text = "0.0"
    Fy_expression: Text = "0.0"
    Fz_expression: Text = "0.0"
    rotational_damping: Annotated[Vec3, vec3(domain=">= 0")] = (0.0, 0.0, 0.0)
    translational_damping: Annotated[Vec3, vec3(domain=">= 0")] = (0.0, 0.0, 0.0)
    moment_visual_scale: Annotated[float | None, maybe()] = 1.0
    force_visual_scale: Annotated[float | None, maybe()] = 1.0
    visual_aspect_ratio: Annotated[float | None, maybe()] = 1.0


class FunctionBasedBushingForce(TwoFrameLinker, ForceProducer):
    """A bushing whose every moment and force is a function of its own deviation; damping stays linear."""

    m_x_theta_x_function: Optional[Function] = made(Constant)
    m_y_theta_y_function: Optional[Function] = made(Constant)
    m_z_theta_z_function: Optional[Function] = made(Constant)
    f_x_delta_x_function: Optional[Function] = made(Constant)
    f_y_delta_y_function: Optional[Function] = made(Constant)
    f_z_delta_z_function: Optional[Function] = made(Constant)
    rotational_damping: Annotated[Vec3, vec3(domain=">= 0")] = (0.0, 0.0, 0.0)
    translational_damping: Annotated[Vec3, vec3(domain=">= 0")] = (0.0, 0.0, 0.0)
    moment_visual_scale: Annotated[float | None, maybe()] = 1.0
    force_visual_scale: Annotated[float | None, maybe()] = 1.0
    visual_aspect_ratio: Annotated[float | None, maybe()] = 1.0
