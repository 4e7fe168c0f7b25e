"""Actuators: forces that a control sets."""

import math
from typing import Annotated

from osimlite.schema.fields import Flag, Number, Vec3, real, vec3
from osimlite.schema.forces import ForceProducer
from osimlite.schema.references import BodySocket, MaybeBodyName, MaybeCoordinateName, MaybeFrameName


class Actuator(ForceProducer, abstract=True):
    """A force with one or several controls."""


class ScalarActuator(Actuator, abstract=True):
    """A force with one control, kept between two limits."""

    min_control: Number = -math.inf
    max_control: Number = math.inf


class CoordinateActuator(ScalarActuator):
    """Pushes one coordinate with `optimal_force` times the control."""

    coordinate: MaybeCoordinateName = None
    optimal_force: Annotated[float, real("N | N*m")] = 1.0


class ActivationCoordinateActuator(CoordinateActuator):
    """A coordinate actuator whose activation follows the control with a delay of first order."""

    activation_time_constant: Annotated[float, real("s", "> 0")] = 0.01
    default_activation: Number = 0.5


class PointActuator(ScalarActuator):
    """Pushes one point of a body along a fixed direction."""

    body: MaybeBodyName = None
    point: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    point_is_global: Flag = False
    direction: Annotated[Vec3, vec3()] = (1.0, 0.0, 0.0)
    force_is_global: Flag = False
    optimal_force: Annotated[float, real("N")] = 1.0


class PointToPointActuator(ScalarActuator):
    """Pushes two points apart along the line between them."""

    bodyA: MaybeBodyName = None
    bodyB: MaybeBodyName = None
    points_are_global: Flag = False
    pointA: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    pointB: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    optimal_force: Annotated[float, real("N")] = 1.0


class TorqueActuator(ScalarActuator):
    """Turns body A about an axis, and body B the other way."""

    bodyA: MaybeFrameName = None
    bodyB: MaybeFrameName = None
    torque_is_global: Flag = True
    axis: Annotated[Vec3, vec3()] = (0.0, 0.0, 1.0)
    optimal_force: Annotated[float, real("N*m")] = 1.0


class BodyActuator(Actuator):
    """Pushes a body with six controls: a torque, then a force at `point`."""

    socket_body: BodySocket = ""
    point: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    point_is_global: Flag = False
    spatial_force_is_global: Flag = True
