"""The outputs of components: what each class adds to those of its bases, as OpenSim 4.6 lists them.

A word is the name of an output; ``[]`` marks one with channels, and a type follows unless it is a number.
"""

from __future__ import annotations

from functools import cache
from typing import Final, NamedTuple

from osimlite.schema.base import Component

_OUTPUTS: Final = {
    "AbstractGeometryPath": "length lengthening_speed",
    "ActivationCoordinateActuator": "statebounds_activation:Vec2",
    "Actuator": "power",
    "Bhargava2004SmoothedMuscleMetabolics": (
        "muscle_metabolic_rate[] total_activation_rate total_maintenance_rate total_mechanical_work_rate "
        "total_metabolic_rate total_shortening_rate"
    ),
    "Blankevoort1991Ligament": ("damping_force length lengthening_speed spring_force strain strain_rate total_force"),
    "Body": (
        "angular_momentum_about_mass_center:Vec3 angular_momentum_about_origin:Vec3 "
        "linear_momentum_about_mass_center:Vec3 linear_momentum_about_origin:Vec3 "
        "momentum_about_mass_center:SpatialVec momentum_about_origin:SpatialVec"
    ),
    "BushingForce": "statebounds_dissipated_energy:Vec2",
    "ControlDistributor": "controls[]",
    "Coordinate": "acceleration speed value",
    "DeGrooteFregly2016Muscle": (
        "implicitenabled_normalized_tendon_force:bool implicitresidual_normalized_tendon_force "
        "passive_fiber_damping_force passive_fiber_damping_force_along_tendon passive_fiber_elastic_force "
        "passive_fiber_elastic_force_along_tendon statebounds_normalized_tendon_force:Vec2"
    ),
    "ExpressionBasedBushingForce": "bushing_force:Vec6",
    "ExpressionBasedCoordinateForce": "force_magnitude",
    "ExpressionBasedPathForce": "length lengthening_speed stretch tension",
    "ExpressionBasedPointToPointForce": "force_magnitude",
    "Force": "potential_energy",
    "Frame": (
        "acceleration:SpatialVec angular_acceleration:Vec3 angular_velocity:Vec3 linear_acceleration:Vec3 "
        "linear_velocity:Vec3 position:Vec3 rotation:Rotation transform:Transform velocity:SpatialVec"
    ),
    "HopperDevice": "com_height height length power speed tension",
    "IMU": "accelerometer_signal:Vec3 gyroscope_signal:Vec3 orientation_as_quaternion:Quaternion",
    "Joint": "power reaction_on_child:SpatialVec reaction_on_parent:SpatialVec",
    "MeyerFregly2016Force": "force_on_station:Vec3",
    "MeyerFregly2016Muscle": (
        "passive_fiber_damping_force passive_fiber_damping_force_along_tendon passive_fiber_elastic_force "
        "passive_fiber_elastic_force_along_tendon"
    ),
    "Millard2012EquilibriumMuscle": (
        "passive_fiber_damping_force passive_fiber_damping_force_along_tendon passive_fiber_elastic_force "
        "passive_fiber_elastic_force_along_tendon"
    ),
    "Model": (
        "angular_momentum:Vec3 com_acceleration:Vec3 com_position:Vec3 com_velocity:Vec3 kinetic_energy "
        "linear_momentum:Vec3 momentum:SpatialVec potential_energy"
    ),
    "MovingPathPoint": "acceleration:Vec3 location:Vec3 velocity:Vec3",
    "Muscle": (
        "activation active_fiber_force active_fiber_force_along_tendon active_force_length_multiplier "
        "cos_pennation_angle excitation fiber_active_power fiber_force fiber_force_along_tendon fiber_length "
        "fiber_length_along_tendon fiber_passive_power fiber_stiffness fiber_stiffness_along_tendon "
        "fiber_velocity fiber_velocity_along_tendon force_velocity_multiplier muscle_power muscle_stiffness "
        "normalized_fiber_length normalized_fiber_velocity passive_fiber_force "
        "passive_fiber_force_along_tendon passive_force_multiplier pennation_angle pennation_angular_velocity "
        "tendon_force tendon_length tendon_power tendon_stiffness tendon_strain tendon_velocity"
    ),
    "PathActuator": "tension",
    "PathPoint": "acceleration:Vec3 location:Vec3 velocity:Vec3",
    "PathSpring": "length lengthening_speed stretch tension",
    "PrescribedForce": "force_applied:Vec3 point_of_application:Vec3 torque_applied:Vec3",
    "Probe": "probe_outputs:Vector",
    "ScalarActuator": "actuation speed",
    "SignalGenerator": "signal",
    "SmoothSphereHalfSpaceForce": "half_space_force:SpatialVec sphere_force:SpatialVec",
    "Station": "acceleration:Vec3 location:Vec3 velocity:Vec3",
    "TableSource__Vec3_": "all_columns:Vector_<Vec3> column[]:Vec3",
    "TableSource__double_": "all_columns:Vector column[]",
    "ToyPropMyoController": "myo_control",
}


class Output(NamedTuple):
    """The type of an output, and whether it has channels."""

    type: str
    channels: bool


@cache
def outputs_of(cls: type[Component]) -> dict[str, Output]:
    """The outputs of a class by name."""
    found: dict[str, Output] = {}
    for base in cls.__mro__:
        for word in _OUTPUTS.get(base.__name__, base.__dict__.get("declared_outputs", "")).split():
            name, _, kind = word.partition(":")
            found[name.removesuffix("[]")] = Output(kind or "double", name.endswith("[]"))
    return found
