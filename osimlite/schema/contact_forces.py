"""Contact forces other than HuntCrossleyForce: elastic foundation, smooth sphere and half space, single stations."""

from typing import Annotated, ClassVar

from osimlite.schema.base import Object, make_default, make_empty_list
from osimlite.schema.facts import NAN, TOUCHING, Facts
from osimlite.schema.fields import LegacyMany, Single, Value, Vec3, Vec6, maybe, real, vec3
from osimlite.schema.forces import Force, ForceProducer
from osimlite.schema.markers import Station
from osimlite.schema.references import (
    ContactGeometryNames,
    ContactHalfSpaceSocket,
    ContactSphereSocket,
    StationSocket,
)
from osimlite.schema.sets import Set


# OpenSim writes C++ names as tags. Parsers with XML namespaces reject their colons.
class ElasticFoundationContactParameters(Object, tag="ElasticFoundationForce::ContactParameters"):
    """The layer of springs on some contact meshes.

    Only the meshes of a contact need parameters.
    """

    facts = Facts(outside={TOUCHING: "stiffness"})

    geometry: ContactGeometryNames = ()
    """Contact surfaces of this material; a mesh carries the springs, others are rigid."""
    stiffness: Annotated[float, real("N/m^3", "> 0")] = 0.0
    """Pressure of the springs on the mesh per depth."""
    dissipation: Annotated[float, real("s/m", ">= 0")] = 0.0
    """Coefficient c of the factor 1 + c v of the pressure, at the approach velocity v."""
    static_friction: Annotated[float, real(domain=">= 0")] = 0.0
    """Ratio of friction to normal force at the transition velocity."""
    dynamic_friction: Annotated[float, real(domain=">= 0")] = 0.0
    """Ratio of friction to normal force at fast slip."""
    viscous_friction: Annotated[float, real(domain=">= 0")] = 0.0
    """Ratio of friction to normal force per slip velocity (s/m), added to the others."""


class ElasticFoundationContactParametersSet(
    Set, tag="ElasticFoundationForce::ContactParametersSet"
):
    """The layers of one elastic foundation force."""

    objects: LegacyMany[ElasticFoundationContactParameters] = make_empty_list()
    """The materials, each with the surfaces that are made of it."""


class ElasticFoundationForce(Force):
    """Contact of meshes through a layer of springs, one for every face."""

    ContactParameters: ClassVar = ElasticFoundationContactParameters
    ContactParametersSet: ClassVar = ElasticFoundationContactParametersSet

    contact_parameters: Single[ElasticFoundationContactParametersSet] = make_default(
        ElasticFoundationContactParametersSet, name="contact_parameters"
    )
    """The surfaces that touch each other by this force, and their materials."""
    transition_velocity: Annotated[float, real("m/s", "> 0")] = 0.01
    """Slip velocity of static friction; slower slip has proportionally less and never sticks."""


class SmoothSphereHalfSpaceForce(Force):
    """Contact of one ball with one half-space by the Hunt-Crossley law, made smooth for optimisation."""

    facts = Facts(
        outputs="half_space_force:SpatialVec sphere_force:SpatialVec",
        outside={NAN: "stiffness constant_contact_force"},
        zero={NAN: "hunt_crossley_smoothing"},
    )

    socket_sphere: ContactSphereSocket = ""
    """The ball that touches the plane."""
    socket_half_space: ContactHalfSpaceSocket = ""
    """The half space that is touched."""
    stiffness: Annotated[float, real("N/m^2", "> 0")] = 1.0
    """Plane-strain modulus of both surfaces."""
    dissipation: Annotated[float, real("s/m", ">= 0")] = 0.0
    """Coefficient c of the factor 1 + 1.5 c v of the force, at the approach velocity v."""
    static_friction: Annotated[float, real(domain=">= 0")] = 0.0
    """Ratio of friction to normal force at the transition velocity."""
    dynamic_friction: Annotated[float, real(domain=">= 0")] = 0.0
    """Ratio of friction to normal force at fast slip."""
    viscous_friction: Annotated[float, real(domain=">= 0")] = 0.0
    """Ratio of friction to normal force per slip velocity (s/m), added to the others."""
    transition_velocity: Annotated[float, real("m/s", "> 0")] = 0.01
    """Slip velocity of static friction; slower slip has proportionally less and never sticks."""
    constant_contact_force: Annotated[float, real("N", ">= 0")] = 1e-5
    """Small number under the roots of depth and slip, which keeps derivatives from vanishing."""
    hertz_smoothing: Annotated[float, real(domain="> 0")] = 300.0
    """Sharpness of the onset of the force where the surfaces meet; higher is sharper."""
    hunt_crossley_smoothing: Annotated[float, real(domain="> 0")] = 50.0
    """Sharpness of the end of the force where surfaces part too fast to push; higher is sharper."""
    force_visualization_radius: Annotated[float, real("m", ">= 0")] = 0.01
    """Radius of the cylinder that shows the force."""
    force_visualization_scale_factor: Annotated[float | None, maybe()] = None
    """Force that viewers draw one metre long; left out, the weight of the model."""


class ExponentialContactForce(Force):
    """Contact of one station with a plane by a force that grows exponentially with depth.

    Friction is a spring that slips.
    """

    # The negative zeros are OpenSim's: it computes the angles from the rotation matrix of its
    # default.
    contact_plane_transform: Annotated[Vec6, Value("double", "Transform")] = (
        -0.0,
        0.0,
        -0.0,
        0.0,
        0.0,
        0.0,
    )
    """The plane in ground: body-fixed X-Y-Z angles (rad), then origin (m); its Z axis is the normal."""
    exponential_shape_parameters: Annotated[Vec3, vec3("m, N, 1/m")] = (0.0065905, 0.5336, 1150.0)
    """d0, d1, d2 of the normal force d1 exp(-d2 (z - d0)) at height z."""
    normal_viscosity: Annotated[float, real("s/m", ">= 0")] = 0.5
    """Coefficient c of the factor 1 - c v of the normal force, at velocity v along the normal."""
    max_normal_force: Annotated[float, real("N", "> 0")] = 100000.0
    """Largest normal force."""
    friction_elasticity: Annotated[float, real("N/m", "> 0")] = 20000.0
    """Stiffness of the spring between the station and its anchor in the plane."""
    friction_viscosity: Annotated[float, real("N*s/m", ">= 0")] = 282.842712474619
    """Damping of the slip, beside the spring and while sliding."""
    settle_velocity: Annotated[float, real("m/s", "> 0")] = 0.01
    """Speed of the anchor from which on the station slides; below, friction turns static."""
    initial_mu_static: Annotated[float, real(domain=">= 0")] = 0.7
    """Static coefficient at the start; it is a state that programs can change."""
    initial_mu_kinetic: Annotated[float, real(domain=">= 0")] = 0.5
    """Sliding coefficient at the start, at most the static one; also a state."""
    station: Single[Station] = make_default(Station, name="station")
    """The point of a body that touches the plane."""


class MeyerFregly2016Force(ForceProducer):
    """Contact of one station with the plane y = 0 of ground: a damped spring with smooth onset (Meyer et al. 2016)."""

    facts = Facts(outputs="force_on_station:Vec3")

    socket_station: StationSocket = ""
    """The point of a body that touches ground."""
    stiffness: Annotated[float, real("N/m", "> 0")] = 10000.0
    """Stiffness of the spring below its resting height."""
    dissipation: Annotated[float, real("s/m", ">= 0")] = 0.01
    """Coefficient c of the factor 1 - c v of the force, at the upward velocity v."""
    spring_resting_length: Annotated[float, real("m")] = 0.0
    """Height of the station above the plane y = 0 below which the spring acts."""
    dynamic_friction: Annotated[float, real(domain=">= 0")] = 0.0
    """Ratio of friction to normal force at fast slip; it rises as a hyperbolic tangent."""
    viscous_friction: Annotated[float, real(domain=">= 0")] = 5.0
    """Ratio of friction to normal force per slip velocity (s/m)."""
    latch_velocity: Annotated[float, real("m/s", "> 0")] = 0.05
    """Slip over which dynamic friction sets in."""
