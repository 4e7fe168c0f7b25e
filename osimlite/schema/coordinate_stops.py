"""Forces that keep a coordinate within limits, of OpenSim after 4.6."""

from typing import Annotated, ClassVar

from osimlite.schema.fields import Number, Value, Vec2, real
from osimlite.schema.forces import Force, ForceProducer
from osimlite.schema.references import CoordinateSocket


class CoordinateLinearStopForce(Force):
    """A stop that a coordinate runs into: a linear spring with damping that grows with its compression."""

    since: ClassVar[str] = "4.6.1"

    socket_coordinate: CoordinateSocket = ""
    """The coordinate that is stopped."""
    stiffness: Annotated[float, real("N*m/rad (rotational) | N/m", ">= 0")] = 0.0
    """Generalized force per distance beyond a limit."""
    damping: Annotated[float, real("s/rad (rotational) | s/m", ">= 0")] = 0.0
    """The d of 1 + d v, by which running on at v raises the force and running back lowers it, down to none."""
    upper_limit: Annotated[float, real("rad (rotational) | m")] = 0.0
    """Value above which the stop pushes back."""
    lower_limit: Annotated[float, real("rad (rotational) | m")] = 0.0
    """Value below which the stop pushes back; not above the upper limit."""


class ExponentialCoordinateLimitForce(ForceProducer):
    """What ligaments do to a coordinate near its limits: an exponential at either, felt before it is reached."""

    since: ClassVar[str] = "4.6.1"

    socket_coordinate: CoordinateSocket = ""
    """The coordinate that is limited."""
    lower_limit: Number = 0.0
    """Value at which the lower exponential has its first shape parameter."""
    upper_limit: Number = 0.0
    """Value at which the upper exponential has its first shape parameter."""
    lower_shape_parameters: Annotated[Vec2, Value("double", "Vec2", domain="> 0")] = (0.0, 0.0)
    """Generalized force at the lower limit, and how steeply it grows below (per value of the coordinate)."""
    upper_shape_parameters: Annotated[Vec2, Value("double", "Vec2", domain="> 0")] = (0.0, 0.0)
    """Generalized force at the upper limit, and how steeply it grows above (per value of the coordinate)."""
