"""Forces: what all have in common, contact by the Hunt-Crossley law, and the limits of joints."""

from typing import Annotated, ClassVar

from osimlite.schema.base import ModelComponent, Object, made, none
from osimlite.schema.fields import Flag, LegacyMany, Single, real
from osimlite.schema.references import ContactGeometryNames, CoordinateName
from osimlite.schema.sets import ModelComponentSet, ObjectGroup


class Force(ModelComponent, abstract=True):
    """Anything that pushes bodies or coordinates; `appliesForce` switches it."""

    appliesForce: Flag = True


class ForceProducer(Force, abstract=True):
    """A force that can report what it applies."""


class HuntCrossleyContactParameters(Object, tag="HuntCrossleyForce::ContactParameters"):
    """The material of some contact surfaces.

    `stiffness` is that of the plane-strain material in N/m^2, `dissipation` in s/m, the friction coefficients have
    no unit but for `viscous_friction` in s/m.
    """

    geometry: ContactGeometryNames = ()
    stiffness: Annotated[float, real("N/m^2", "> 0")] = 0.0
    dissipation: Annotated[float, real("s/m", ">= 0")] = 0.0
    static_friction: Annotated[float, real(domain=">= 0")] = 0.0
    dynamic_friction: Annotated[float, real(domain=">= 0")] = 0.0
    viscous_friction: Annotated[float, real(domain=">= 0")] = 0.0


class HuntCrossleyContactParametersSet(Object, tag="HuntCrossleyForce::ContactParametersSet"):
    """The materials of one Hunt-Crossley force."""

    objects: LegacyMany[HuntCrossleyContactParameters] = none()
    groups: LegacyMany[ObjectGroup] = none()


class HuntCrossleyForce(Force):
    """Contact between all surfaces it lists: Hertz stiffness, Hunt-Crossley dissipation, Stribeck friction.

    `transition_velocity` is the slip velocity at which friction reaches its static value.
    """

    ContactParameters: ClassVar = HuntCrossleyContactParameters
    ContactParametersSet: ClassVar = HuntCrossleyContactParametersSet

    contact_parameters: Single[HuntCrossleyContactParametersSet] = made(
        HuntCrossleyContactParametersSet, name="contact_parameters"
    )
    transition_velocity: Annotated[float, real("m/s", "> 0")] = 0.01


class CoordinateLimitForce(ForceProducer):
    """A spring-damper that acts once a coordinate has left its limits.

    For a rotational coordinate everything is in degrees. Stiffness and damping rise smoothly over `transition` beyond
    the limit.
    """

    coordinate: CoordinateName = "UNASSIGNED"
    upper_stiffness: Annotated[float, real("N*m/deg (rotational)", "> 0")] = 1.0
    upper_limit: Annotated[float, real("deg (rotational)")] = 0.0
    lower_stiffness: Annotated[float, real("N*m/deg (rotational)", "> 0")] = 1.0
    lower_limit: Annotated[float, real("deg (rotational)")] = 0.0
    damping: Annotated[float, real("N/(m/s) | N*m/(deg/s)", ">= 0")] = 0.001
    transition: Annotated[float, real("deg (rotational)", "> 0")] = 0.1
    compute_dissipation_energy: Flag = False


class ForceSet(ModelComponentSet):
    """The forces, actuators and muscles of a model."""

    objects: LegacyMany[Force] = none()
    groups: LegacyMany[ObjectGroup] = none()
