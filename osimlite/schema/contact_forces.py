"""Contact by other laws than that of Hunt and Crossley for any surfaces: meshes, single balls, single points."""

from typing import Annotated, ClassVar

from osimlite.schema.base import Object, made, none
from osimlite.schema.fields import LegacyMany, Single, Value, Vec3, Vec6, maybe, real, vec3
from osimlite.schema.forces import Force, ForceProducer
from osimlite.schema.markers import Station
from osimlite.schema.references import (
    ContactGeometryNames,
    ContactHalfSpaceSocket,
    ContactSphereSocket,
    StationSocket,
)
from osimlite.schema.sets import ObjectGroup


class ElasticFoundationContactParameters(Object, tag="ElasticFoundationForce::ContactParameters"):
    """The layer of springs on some contact meshes.

    `stiffness` is pressure per depth. Only the meshes of a contact need parameters.
    """

    geometry: ContactGeometryNames = ()
    stiffness: Annotated[float, real("N/m^3", "> 0")] = 0.0
    dissipation: Annotated[float, real("s/m", ">= 0")] = 0.0
    static_friction: Annotated[float, real(domain=">= 0")] = 0.0
    dynamic_friction: Annotated[float, real(domain=">= 0")] = 0.0
    viscous_friction: Annotated[float, real(domain=">= 0")] = 0.0


class ElasticFoundationContactParametersSet(Object, tag="ElasticFoundationForce::ContactParametersSet"):
    """The layers of one elastic foundation force."""

    objects: LegacyMany[ElasticFoundationContactParameters] = none()
    groups: LegacyMany[ObjectGroup] = none()


class ElasticFoundationForce(Force):
    """Contact of meshes through a layer of springs, one for every face."""

    ContactParameters: ClassVar = ElasticFoundationContactParameters
    ContactParametersSet: ClassVar = ElasticFoundationContactParametersSet

    contact_parameters: Single[ElasticFoundationContactParametersSet] = made(
        ElasticFoundationContactParametersSet, name="contact_parameters"
    )
    transition_velocity: Annotated[float, real("m/s", "> 0")] = 0.01


class SmoothSphereHalfSpaceForce(Force):
    """Contact of one ball with one half-space by the Hunt-Crossley law, made smooth for optimisation.

    The two smoothing numbers say how sharp the transitions into and out of contact are; `constant_contact_force` is
    there without contact too.
    """

    socket_sphere: ContactSphereSocket = ""
    socket_half_space: ContactHalfSpaceSocket = ""
    stiffness: Annotated[float, real("N/m^2", "> 0")] = 1.0
    dissipation: Annotated[float, real("s/m", ">= 0")] = 0.0
    static_friction: Annotated[float, real(domain=">= 0")] = 0.0
    dynamic_friction: Annotated[float, real(domain=">= 0")] = 0.0
    viscous_friction: Annotated[float, real(domain=">= 0")] = 0.0
    transition_velocity: Annotated[float, real("m/s", "> 0")] = 0.01
    constant_contact_force: Annotated[float, real("N", ">= 0")] = 1e-5
    hertz_smoothing: Annotated[float, real(domain="> 0")] = 300.0
    hunt_crossley_smoothing: Annotated[float, real(domain="> 0")] = 50.0
    force_visualization_radius: Annotated[float, real("m", ">= 0")] = 0.01
    force_visualization_scale_factor: Annotated[float | None, maybe()] = None


class ExponentialContactForce(Force):
    """Contact of one station with a plane by a force that grows exponentially with depth.

    `contact_plane_transform` places the plane in ground: body-fixed X-Y-Z angles (rad), then the origin (m).
    `exponential_shape_parameters` are d0, d1, d2 of d1 exp(-d2 (height - d0)). Friction is a spring that slips.
    """

    contact_plane_transform: Annotated[Vec6, Value("double", "Transform")] = (-0.0, 0.0, -0.0, 0.0, 0.0, 0.0)
    exponential_shape_parameters: Annotated[Vec3, vec3("m, N, 1/m")] = (0.0065905, 0.5336, 1150.0)
    normal_viscosity: Annotated[float, real("s/m", ">= 0")] = 0.5
    max_normal_force: Annotated[float, real("N", "> 0")] = 100000.0
    friction_elasticity: Annotated[float, real("N/m", "> 0")] = 20000.0
    friction_viscosity: Annotated[float, real("N*s/m", ">= 0")] = 282.842712474619
    settle_velocity: Annotated[float, real("m/s", "> 0")] = 0.01
    initial_mu_static: Annotated[float, real(domain=">= 0")] = 0.7
    initial_mu_kinetic: Annotated[float, real(domain=">= 0")] = 0.5
    station: Single[Station] = made(Station, name="station")


class MeyerFregly2016Force(ForceProducer):
    """Contact of one station with the plane y = 0 of ground: a damped spring with smooth onset (Meyer et al. 2016)."""

    socket_station: StationSocket = ""
    stiffness: Annotated[float, real("N/m", "> 0")] = 10000.0
    dissipation: Annotated[float, real("s/m", ">= 0")] = 0.01
    spring_resting_length: Annotated[float, real("m")] = 0.0
    dynamic_friction: Annotated[float, real(domain=">= 0")] = 0.0
    viscous_friction: Annotated[float, real(domain=">= 0")] = 5.0
    latch_velocity: Annotated[float, real("m/s", "> 0")] = 0.05
