"""Forces: their base classes, contact by the Hunt-Crossley law, and limits of coordinates."""

import math
from typing import Annotated, ClassVar

from osimlite.schema.base import ModelComponent, Object, make_default, make_empty_list
from osimlite.schema.facts import NAN, REFUSED, TOUCHING, Facts
from osimlite.schema.fields import Flag, LegacyMany, Number, Single, real
from osimlite.schema.references import (
    ContactGeometryNames,
    CoordinateName,
)
from osimlite.schema.sets import ModelComponentSet, ObjectGroup, Set


class Force(ModelComponent, abstract=True):
    """Base class of everything that pushes bodies or coordinates."""

    facts = Facts(outputs="potential_energy")

    appliesForce: Flag = True
    """Whether the force acts; a disabled one stays in the tree and reports zeros."""


class ForceProducer(Force, abstract=True):
    """A force that can report what it applies."""


class HuntCrossleyContactParameters(Object, tag="HuntCrossleyForce::ContactParameters"):
    """The material of some contact surfaces."""

    facts = Facts(
        outside={TOUCHING: "stiffness"}, doubtful={"dissipation": "each impact adds energy"}
    )

    # OpenSim counts a surface that is named twice as two, which doubles the force. A surface
    # without a partner touches nothing. Both are silent.
    geometry: ContactGeometryNames = ()
    """Contact surfaces of this material; all surfaces of one force touch each other."""
    # OpenSim's default of 0 divides 0 by 0 as soon as surfaces touch: a misspelt tag makes the
    # motion NaN, without a message.
    stiffness: Annotated[float, real("N/m^2", "> 0")] = 0.0
    """Plane-strain modulus: of two surfaces the softer one yields more; with 0 on both, OpenSim's force is NaN."""
    dissipation: Annotated[float, real("s/m", ">= 0")] = 0.0
    """Coefficient c of the factor 1 + 1.5 c v of the force, at the approach velocity v."""
    static_friction: Annotated[float, real(domain=">= 0")] = 0.0
    """Ratio of friction to normal force at the transition velocity; of two, the harmonic mean."""
    dynamic_friction: Annotated[float, real(domain=">= 0")] = 0.0
    """Ratio of friction to normal force at fast slip; of two surfaces, the harmonic mean."""
    viscous_friction: Annotated[float, real(domain=">= 0")] = 0.0
    """Ratio of friction to normal force per slip velocity (s/m), added to the others."""


class HuntCrossleyContactParametersSet(Set, tag="HuntCrossleyForce::ContactParametersSet"):
    """The materials of one Hunt-Crossley force."""

    objects: LegacyMany[HuntCrossleyContactParameters] = make_empty_list()
    """The materials, each with the surfaces that are made of it."""


# Several spheres of one force also touch each other, and Simbody omits the contacts after one that
# separates too fast to push. One force for each pair of surfaces avoids both.
class HuntCrossleyForce(Force):
    """Contact between all surfaces it lists: Hertz stiffness, Hunt-Crossley dissipation, Stribeck friction."""

    facts = Facts(
        doubtful={"transition_velocity": "friction has no transition between rest and sliding"}
    )

    ContactParameters: ClassVar = HuntCrossleyContactParameters
    ContactParametersSet: ClassVar = HuntCrossleyContactParametersSet

    contact_parameters: Single[HuntCrossleyContactParametersSet] = make_default(
        HuntCrossleyContactParametersSet, name="contact_parameters"
    )
    """The surfaces that touch each other by this force, and their materials."""
    transition_velocity: Annotated[float, real("m/s", "> 0")] = 0.01
    """Slip velocity of static friction; slower slip has proportionally less and never sticks."""


class CoordinateLimitForce(ForceProducer):
    """A spring-damper that acts once a coordinate has left its limits.

    For a rotational coordinate everything is in degrees.
    """

    facts = Facts(
        states="dissipatedEnergy?compute_dissipation_energy",
        zero={REFUSED: "transition", NAN: "upper_stiffness lower_stiffness"},
        doubtful={"damping": "the limit adds energy"},
    )

    # OpenSim compares it with plain names of coordinates and rejects paths.
    coordinate: CoordinateName = "UNASSIGNED"
    """Name of the limited coordinate; its own `range` has no effect here."""
    upper_stiffness: Annotated[float, real("N*m/deg (rotational)", "> 0")] = 1.0
    """Stiffness against values above the upper limit, beyond the transition."""
    # A limit that is left out, or misspelt, is 0 degrees, where the force acts from the start.
    upper_limit: Annotated[float, real("deg (rotational)")] = 0.0
    """Value above which the spring begins to push back."""
    lower_stiffness: Annotated[float, real("N*m/deg (rotational)", "> 0")] = 1.0
    """Stiffness against values below the lower limit, beyond the transition."""
    lower_limit: Annotated[float, real("deg (rotational)")] = 0.0
    """Value below which the spring begins to push back."""
    damping: Annotated[float, real("N/(m/s) | N*m/(deg/s)", ">= 0")] = 0.001
    """Damping beyond a limit; it sets in smoothly as the stiffness does."""
    transition: Annotated[float, real("deg (rotational)", "> 0")] = 0.1
    """Distance beyond a limit over which stiffness and damping rise smoothly from 0 to all."""
    compute_dissipation_energy: Flag = False
    """Whether the energy dissipated by damping is a state of the simulation."""


class ForceSet(ModelComponentSet):
    """The forces, actuators and muscles of a model."""

    objects: LegacyMany[Force] = make_empty_list()
    """The forces; actuators and muscles are forces with controls."""
    groups: LegacyMany[ObjectGroup] = make_empty_list()
    """Named selections of the forces, which tools can leave out; the mechanics ignore them."""


class Actuator(ForceProducer, abstract=True):
    """A force with one or several controls."""

    facts = Facts(outputs="power")

    control_count: ClassVar[int] = 1


class ScalarActuator(Actuator, abstract=True):
    """Force with one control between two limits."""

    facts = Facts(outputs="actuation speed")

    min_control: Number = -math.inf
    """Smallest control that tools choose; a simulation does not clip to it."""
    max_control: Number = math.inf
    """Largest control that tools choose; a simulation does not clip to it."""
