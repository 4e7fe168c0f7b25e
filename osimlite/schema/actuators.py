"""Actuators: forces that a control sets."""

from typing import Annotated, ClassVar

from osimlite.schema.facts import IDLE, STOPS, Facts
from osimlite.schema.fields import Flag, Number, Vec3, real, vec3
from osimlite.schema.forces import Actuator, ScalarActuator
from osimlite.schema.references import (
    BodySocket,
    MaybeBodyName,
    MaybeCoordinateName,
    MaybeFrameName,
)


class CoordinateActuator(ScalarActuator):
    """Pushes one coordinate with `optimal_force` times the control."""

    facts = Facts(domains={"optimal_force": "!= 0"}, doubtful={"optimal_force": IDLE})

    coordinate: MaybeCoordinateName = None
    """Name of the coordinate that is pushed."""
    optimal_force: Annotated[float, real("N | N*m")] = 1.0
    """Generalized force at a control of 1."""


class ActivationCoordinateActuator(CoordinateActuator):
    """A coordinate actuator whose activation follows the control with a delay of first order."""

    facts = Facts(
        states="activation",
        outputs="statebounds_activation:Vec2",
        domains={"optimal_force": "!= 0"},
        zero={STOPS: "activation_time_constant"},
        doubtful={"optimal_force": IDLE},
    )

    activation_time_constant: Annotated[float, real("s", "> 0")] = 0.01
    """Time constant with which the activation follows the control."""
    default_activation: Number = 0.5
    """Activation at the start of a simulation."""


class PointActuator(ScalarActuator):
    """Pushes one point of a body along a fixed direction."""

    facts = Facts(domains={"optimal_force": "!= 0"}, doubtful={"optimal_force": IDLE})

    body: MaybeBodyName = None
    """Name of the body that is pushed."""
    point: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    """Point at which the force acts."""
    point_is_global: Flag = False
    """Whether `point` is in ground rather than in the body."""
    direction: Annotated[Vec3, vec3()] = (1.0, 0.0, 0.0)
    """Direction of a positive force; its length does not matter."""
    force_is_global: Flag = False
    """Whether `direction` is along the axes of ground rather than of the body."""
    optimal_force: Annotated[float, real("N")] = 1.0
    """Force at a control of 1."""


class PointToPointActuator(ScalarActuator):
    """Pushes two points apart along the line between them."""

    facts = Facts(domains={"optimal_force": "!= 0"}, doubtful={"optimal_force": IDLE})

    bodyA: MaybeBodyName = None
    """Name of the first body, which a positive force pushes away from B."""
    bodyB: MaybeBodyName = None
    """Name of the second body, which is pushed in the opposite direction."""
    points_are_global: Flag = False
    """Whether both points are in ground rather than in their bodies."""
    pointA: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    """Point of body A at which the force acts."""
    pointB: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    """Point of body B at which the force acts."""
    optimal_force: Annotated[float, real("N")] = 1.0
    """Force at a control of 1."""


class TorqueActuator(ScalarActuator):
    """Applies a torque about an axis to body A, and the opposite torque to body B."""

    facts = Facts(domains={"optimal_force": "!= 0"}, doubtful={"optimal_force": IDLE})

    bodyA: MaybeFrameName = None
    """Frame that a positive torque turns about the axis."""
    bodyB: MaybeFrameName = None
    """Frame that gets the opposite torque; left out, there is none."""
    torque_is_global: Flag = True
    """Whether `axis` is along the axes of ground rather than of A."""
    axis: Annotated[Vec3, vec3()] = (0.0, 0.0, 1.0)
    """Direction of a positive torque; its length does not matter."""
    optimal_force: Annotated[float, real("N*m")] = 1.0
    """Torque at a control of 1."""


class BodyActuator(Actuator):
    """Pushes a body with six controls: a torque, then a force at `point`."""

    control_count: ClassVar[int] = 6

    socket_body: BodySocket = ""
    """The body that is pushed."""
    point: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    """Point at which the force acts; the torque has no point of application."""
    point_is_global: Flag = False
    """Whether `point` is in ground rather than in the body."""
    spatial_force_is_global: Flag = True
    """Whether torque and force are along the axes of ground rather than of the body."""
