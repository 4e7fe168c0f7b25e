"""Springs between points, on coordinates and between frames, and stops of coordinates."""

from typing import Annotated, ClassVar

from osimlite.schema.base import make_default
from osimlite.schema.facts import Facts
from osimlite.schema.fields import Number, Optional, Text, Value, Vec2, Vec3, maybe, real, vec3
from osimlite.schema.forces import Force, ForceProducer
from osimlite.schema.frames import TwoFrameLinker
from osimlite.schema.functions import Constant, Function
from osimlite.schema.references import (
    CoordinateName,
    CoordinateSocket,
    MaybeCoordinateName,
    MaybeFrameName,
    PhysicalFrameSocket,
)


class PointToPointSpring(Force):
    """A straight spring between a point of one body and a point of another."""

    socket_body1: PhysicalFrameSocket = ""
    """The frame of the first end."""
    socket_body2: PhysicalFrameSocket = ""
    """The frame of the second end."""
    point1: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    """Position of the first end in its frame."""
    point2: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    """Position of the second end in its frame."""
    stiffness: Annotated[float, real("N/m", ">= 0")] = 1.0
    """Force per change of the distance; a spring that is too short pushes."""
    rest_length: Annotated[float, real("m", ">= 0")] = 0.0
    """Distance of the ends at which there is no force."""


class SpringGeneralizedForce(ForceProducer):
    """A damped spring on one coordinate: -`stiffness` (q - `rest_length`) - `viscosity` u."""

    coordinate: MaybeCoordinateName = None
    """Name of the coordinate on which the spring acts."""
    # No unit: it follows from the coordinate, which is an angle or a length.
    stiffness: Annotated[float, real(domain=">= 0")] = 0.0
    """Generalized force per value of the coordinate."""
    rest_length: Number = 0.0
    """Value of the coordinate at which the spring is slack."""
    viscosity: Annotated[float, real(domain=">= 0")] = 0.0
    """Generalized force per speed of the coordinate, against the motion."""


class ExpressionBasedCoordinateForce(ForceProducer):
    """A force on one coordinate by a formula in its value `q` and its speed `qdot`."""

    facts = Facts(outputs="force_magnitude")

    coordinate: CoordinateName = "UNASSIGNED"
    """Name of the coordinate on which the force acts."""
    expression: Text = "0.0"
    """Formula of the generalized force in `q` and `qdot`; positive increases the coordinate."""


class ExpressionBasedPointToPointForce(ForceProducer):
    """A force along the line between two points by a formula in their distance `d` and its rate `ddot`."""

    facts = Facts(outputs="force_magnitude")

    body1: MaybeFrameName = None
    """The frame of the first point."""
    body2: MaybeFrameName = None
    """The frame of the second point."""
    point1: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    """Position of the first point in its frame."""
    point2: Annotated[Vec3, vec3("m")] = (0.0, 0.0, 0.0)
    """Position of the second point in its frame."""
    expression: Text = "0.0"
    """Formula of the force in `d` and `ddot`; positive pulls the points together."""


class BushingForce(TwoFrameLinker, Force):
    """A linear spring and damper for each of the six deviations of frame 2 from frame 1.

    The rotations are body-fixed X-Y-Z angles.
    """

    facts = Facts(
        states="dissipated_energy",
        outputs="statebounds_dissipated_energy:Vec2",
        domains={
            "rotational_stiffness": ">= 0",
            "rotational_damping": ">= 0",
            "translational_stiffness": ">= 0",
            "translational_damping": ">= 0",
        },
        refused="rotational_stiffness translational_stiffness rotational_damping translational_damping",
    )

    rotational_stiffness: Annotated[Vec3, vec3("N*m/rad", ">= 0")] = (0.0, 0.0, 0.0)
    """Moment against each of the three angles."""
    translational_stiffness: Annotated[Vec3, vec3("N/m", ">= 0")] = (0.0, 0.0, 0.0)
    """Force against each displacement along the axes of frame 1."""
    rotational_damping: Annotated[Vec3, vec3("N*m/(rad/s)", ">= 0")] = (0.0, 0.0, 0.0)
    """Moment against the rate of each of the three angles."""
    translational_damping: Annotated[Vec3, vec3("N/(m/s)", ">= 0")] = (0.0, 0.0, 0.0)
    """Force against the velocity along each axis of frame 1."""


class ExpressionBasedBushingForce(TwoFrameLinker, ForceProducer):
    """A bushing whose moments and forces are formulas in `theta_x` ... `delta_z`; damping stays linear."""

    facts = Facts(outputs="bushing_force:Vec6")

    Mx_expression: Text = "0.0"
    """Formula of the moment against the first angle, positive where it drives `theta_x` down."""
    My_expression: Text = "0.0"
    """Formula of the moment against the second angle, positive where it drives `theta_y` down."""
    Mz_expression: Text = "0.0"
    """Formula of the moment against the third angle, positive where it drives `theta_z` down."""
    Fx_expression: Text = "0.0"
    """Formula of the force against displacement along x, positive where it drives `delta_x` down."""
    Fy_expression: Text = "0.0"
    """Formula of the force against displacement along y, positive where it drives `delta_y` down."""
    Fz_expression: Text = "0.0"
    """Formula of the force against displacement along z, positive where it drives `delta_z` down."""
    rotational_damping: Annotated[Vec3, vec3(domain=">= 0")] = (0.0, 0.0, 0.0)
    """Moment against the rate of each of the three angles."""
    translational_damping: Annotated[Vec3, vec3(domain=">= 0")] = (0.0, 0.0, 0.0)
    """Force against the velocity along each axis of frame 1."""
    moment_visual_scale: Annotated[float | None, maybe()] = 1.0
    """Length drawn per moment."""
    force_visual_scale: Annotated[float | None, maybe()] = 1.0
    """Length drawn per force."""
    visual_aspect_ratio: Annotated[float | None, maybe()] = 1.0
    """Ratio of length to diameter of the drawn forces and moments."""


class FunctionBasedBushingForce(TwoFrameLinker, ForceProducer):
    """Bushing whose moments and forces are functions of one deviation each, with linear damping."""

    m_x_theta_x_function: Optional[Function] = make_default(Constant)
    """Moment against the first angle, as a function of it (rad)."""
    m_y_theta_y_function: Optional[Function] = make_default(Constant)
    """Moment against the second angle, as a function of it (rad)."""
    m_z_theta_z_function: Optional[Function] = make_default(Constant)
    """Moment against the third angle, as a function of it (rad)."""
    f_x_delta_x_function: Optional[Function] = make_default(Constant)
    """Force against displacement along x of frame 1, as a function of it (m)."""
    f_y_delta_y_function: Optional[Function] = make_default(Constant)
    """Force against displacement along y of frame 1, as a function of it (m)."""
    f_z_delta_z_function: Optional[Function] = make_default(Constant)
    """Force against displacement along z of frame 1, as a function of it (m)."""
    rotational_damping: Annotated[Vec3, vec3(domain=">= 0")] = (0.0, 0.0, 0.0)
    """Moment against the rate of each of the three angles."""
    translational_damping: Annotated[Vec3, vec3(domain=">= 0")] = (0.0, 0.0, 0.0)
    """Force against the velocity along each axis of frame 1."""
    moment_visual_scale: Annotated[float | None, maybe()] = 1.0
    """Length drawn per moment."""
    force_visual_scale: Annotated[float | None, maybe()] = 1.0
    """Length drawn per force."""
    visual_aspect_ratio: Annotated[float | None, maybe()] = 1.0
    """Ratio of length to diameter of the drawn forces and moments."""


class CoordinateLinearStopForce(Force):
    """Stop of a coordinate: a linear spring with damping in proportion to its compression."""

    # OpenSim 4.6 rejects a ForceSet with a class that it does not know.
    since: ClassVar[str] = "4.6.1"

    socket_coordinate: CoordinateSocket = ""
    """Coordinate that is stopped."""
    stiffness: Annotated[float, real("N*m/rad (rotational) | N/m", ">= 0")] = 0.0
    """Generalized force per distance beyond a limit."""
    damping: Annotated[float, real("s/rad (rotational) | s/m", ">= 0")] = 0.0
    """Coefficient d of the factor 1 + d v of the force, at velocity v into the stop, which never pulls."""
    upper_limit: Annotated[float, real("rad (rotational) | m")] = 0.0
    """Value above which the stop pushes back."""
    lower_limit: Annotated[float, real("rad (rotational) | m")] = 0.0
    """Value below which the stop pushes back; not above the upper limit."""


class ExponentialCoordinateLimitForce(ForceProducer):
    """Exponential force of ligaments near both limits of a coordinate, which begins before them."""

    since: ClassVar[str] = "4.6.1"

    socket_coordinate: CoordinateSocket = ""
    """The coordinate that is limited."""
    lower_limit: Number = 0.0
    """Value at which the lower exponential has its first shape parameter."""
    upper_limit: Number = 0.0
    """Value at which the upper exponential has its first shape parameter."""
    lower_shape_parameters: Annotated[Vec2, Value("double", "Vec2", domain="> 0")] = (0.0, 0.0)
    """Generalized force at the lower limit, and its rate of growth below (per unit of value)."""
    upper_shape_parameters: Annotated[Vec2, Value("double", "Vec2", domain="> 0")] = (0.0, 0.0)
    """Generalized force at the upper limit, and its rate of growth above (per unit of value)."""
