"""What OpenSim 4.6 makes of a number outside the domain of its property.

Each entry was measured: the number was put into a sound model, which was loaded, initialised and asked for
accelerations. Where nothing is said, OpenSim computes with the number.
"""

from __future__ import annotations

from typing import Final

from osimlite.schema.base import Object

REFUSED: Final = "OpenSim refuses the model"
TOUCHING: Final = "forces and motion become NaN as soon as the surfaces touch"
NAN: Final = "accelerations become NaN, without a message"
STOPS: Final = "OpenSim cannot take one step"
STUCK: Final = "OpenSim finds no equilibrium for the muscle and fails when it computes accelerations"

_REFUSED_OUTSIDE: Final = {
    "ActiveForceLengthCurve": "min_norm_active_fiber_length transition_norm_fiber_length max_norm_active_fiber_length "
    "shallow_ascending_slope minimum_value",
    "Body": "mass",
    "BushingForce": "rotational_stiffness translational_stiffness rotational_damping translational_damping",
    "ClutchedPathSpring": "stiffness dissipation relaxation_time_constant initial_stretch",
    "ConstantDistanceConstraint": "constant_distance",
    "DeGrooteFregly2016Muscle": "pennation_angle_at_optimal activation_time_constant deactivation_time_constant "
    "default_activation default_normalized_tendon_force fiber_damping passive_fiber_strain_at_one_norm_force "
    "tendon_strain_at_one_norm_force activation_dynamics_smoothing active_force_width_scale",
    "FiberForceLengthCurve": "strain_at_one_norm_force stiffness_at_low_force stiffness_at_one_norm_force curviness",
    "ForceVelocityCurve": "concentric_slope_at_vmax concentric_slope_near_vmax isometric_slope eccentric_slope_at_vmax "
    "eccentric_slope_near_vmax max_eccentric_velocity_force_multiplier concentric_curviness eccentric_curviness",
    "MocoControlGoal": "exponent",
    "MocoDirectCollocationSolver": "num_mesh_intervals optim_max_iterations optim_convergence_tolerance "
    "optim_constraint_tolerance",
    "Millard2012EquilibriumMuscle": "optimal_fiber_length pennation_angle_at_optimal activation_time_constant "
    "deactivation_time_constant minimum_activation maximum_pennation_angle",
    "MeyerFregly2016Muscle": "pennation_angle_at_optimal",
    "MultivariatePolynomialFunction": "dimension order",
    "MuscleFixedWidthPennationModel": "optimal_fiber_length pennation_angle_at_optimal maximum_pennation_angle",
    "PathSpring": "resting_length stiffness dissipation",
    "TendonForceLengthCurve": "strain_at_one_norm_force stiffness_at_one_norm_force norm_force_at_toe_end curviness",
    "Thelen2003Muscle": "optimal_fiber_length pennation_angle_at_optimal FmaxTendonStrain FmaxMuscleStrain "
    "KshapeActive KshapePassive Af Flen fv_linear_extrap_threshold maximum_pennation_angle activation_time_constant "
    "deactivation_time_constant minimum_activation",
    "WrapCylinder": "radius length",
    "WrapEllipsoid": "dimensions",
    "WrapSphere": "radius",
    "WrapTorus": "inner_radius outer_radius",
}

_COMPUTED_WITH_ZERO: Final = {
    "ActiveForceLengthCurve": "min_norm_active_fiber_length",
    "WrapCylinder": "radius length",
    "WrapSphere": "radius",
}
"""Of what else is refused outside its domain."""

_NAN_AT_ZERO: Final = {
    "CoordinateLimitForce": "upper_stiffness lower_stiffness",
    "DeGrooteFregly2016Muscle": "max_isometric_force optimal_fiber_length tendon_slack_length max_contraction_velocity",
    "Ligament": "resting_length",
    "RigidTendonMuscle": "optimal_fiber_length max_contraction_velocity",
    "Schutte1993Muscle_Deprecated": "optimal_fiber_length tendon_slack_length",
    "Thelen2003Muscle": "tendon_slack_length",
}

_STOPS_AT_ZERO: Final = {
    "ActivationCoordinateActuator": "activation_time_constant",
    "ClutchedPathSpring": "relaxation_time_constant",
}

_FAILURES: Final = (
    (NAN, "missing", {"EllipsoidJoint": "radii_x_y_z", "ScapulothoracicJoint": "thoracic_ellipsoid_radii_x_y_z"}),
    ("", "zero", _COMPUTED_WITH_ZERO),
    (STOPS, "zero", _STOPS_AT_ZERO),
    (REFUSED, "", _REFUSED_OUTSIDE),
    (REFUSED, "zero", {"CoordinateLimitForce": "transition"}),
    (TOUCHING, "", {"ElasticFoundationContactParameters": "stiffness", "HuntCrossleyContactParameters": "stiffness"}),
    (NAN, "", {"SmoothSphereHalfSpaceForce": "stiffness constant_contact_force"}),
    (NAN, "zero", _NAN_AT_ZERO),
    (STUCK, "zero", {"Millard2012EquilibriumMuscle": "tendon_slack_length"}),
)
"""What happens, whether with zero alone, without a number, or with any, and to which properties; the first fits."""

_PUSHING: Final = (
    "ActivationCoordinateActuator CoordinateActuator PathActuator PointActuator PointToPointActuator TorqueActuator"
)
"""Actuators whose force is their control times their optimal force."""

_FLAT: Final = "OpenSim computes with it, on a flat or mirrored surface"
_DOUBTS: Final = {
    ("CoordinateLimitForce", "damping"): "the limit adds energy",
    ("ContactSphere", "radius"): "it touches nothing",
    ("EllipsoidJoint", "radii_x_y_z"): _FLAT,
    ("HuntCrossleyContactParameters", "dissipation"): "each impact adds energy",
    ("HuntCrossleyForce", "transition_velocity"): "friction no longer passes from rest to sliding",
    ("Millard2012EquilibriumMuscle", "tendon_slack_length"): "OpenSim finds no equilibrium for the muscle",
    ("ScapulothoracicJoint", "thoracic_ellipsoid_radii_x_y_z"): _FLAT,
    ("Thelen2003Muscle", "tendon_slack_length"): "OpenSim finds no equilibrium for the muscle",
    **{(name, "optimal_force"): "the actuator does nothing, whatever its control" for name in _PUSHING.split()},
}

_STEEPEST: Final = "0 to 1.5707963267948866"
"""In radians: a little less than a quarter turn, as OpenSim asks."""

STRICTER: Final = {
    **{
        (muscle, "pennation_angle_at_optimal"): _STEEPEST
        for muscle in (
            "DeGrooteFregly2016Muscle",
            "MeyerFregly2016Muscle",
            "Millard2012EquilibriumMuscle",
            "MuscleFixedWidthPennationModel",
            "Thelen2003Muscle",
        )
    },
    **{
        (muscle, "maximum_pennation_angle"): "0 to 1.5707963267948966"
        for muscle in ("Millard2012EquilibriumMuscle", "MuscleFixedWidthPennationModel", "Thelen2003Muscle")
    },
    **{
        ("BushingForce", f"{kind}_{what}"): ">= 0"
        for kind in ("rotational", "translational")
        for what in ("stiffness", "damping")
    },
    ("DeGrooteFregly2016Muscle", "default_activation"): "> 0",
    ("DeGrooteFregly2016Muscle", "default_normalized_tendon_force"): "0 to 5",
    ("ForceVelocityCurve", "concentric_slope_near_vmax"): "> 1.49e-8",
    ("ForceVelocityCurve", "eccentric_slope_near_vmax"): "> 1.49e-8",
    ("ClutchedPathSpring", "initial_stretch"): ">= 0",
    ("Ligament", "resting_length"): "> 0",
    **{(name, "optimal_force"): "!= 0" for name in _PUSHING.split()},
    ("Thelen2003Muscle", "minimum_activation"): "0.01 to 1",
}
"""Domains that are narrower for one class than for others that share the property, or than its declaration says."""


def consequence(cls: type[Object], name: str, number: float, *, rigid_tendon: bool = False) -> tuple[str, bool]:
    """What happens with `number`, outside its domain, in a property; and whether that is a failure.

    A rigid tendon may have no length, where an elastic one needs some.
    """
    is_allowed = rigid_tendon and name == "tendon_slack_length"
    cases = {"", "missing" if number != number else "zero" if number == 0 and not is_allowed else ""}
    for base in cls.__mro__:
        known = base.__name__
        for fate, case, properties in _FAILURES:
            if case in cases and name in properties.get(known, "").split():
                return fate, bool(fate)
        if (known, name) in _DOUBTS:
            return _DOUBTS[known, name], False
    return "", False
