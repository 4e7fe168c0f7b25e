"""Muscles with the curves of Millard 2012."""

from collections.abc import Iterator
from functools import partial
from typing import Annotated, Any

from pydantic import Field

from osimlite.schema.base import make_default
from osimlite.schema.default_curves import (
    make_active_force_length,
    make_force_velocity,
    make_passive_force_length,
)
from osimlite.schema.facts import (
    BELOW_QUARTER_TURN,
    LEAST_TIME_CONSTANT,
    NAN,
    NO_EQUILIBRIUM,
    STUCK,
    UP_TO_QUARTER_TURN,
    Contradiction,
    Facts,
)
from osimlite.schema.fields import Number, Single, Unnamed, real
from osimlite.schema.functions import Function
from osimlite.schema.muscle_curves import (
    ActiveForceLengthCurve,
    FiberCompressiveForceCosPennationCurve,
    FiberCompressiveForceLengthCurve,
    FiberForceLengthCurve,
    ForceVelocityCurve,
    TendonForceLengthCurve,
)
from osimlite.schema.muscles import (
    MAXIMUM_PENNATION,
    MODEL_MINIMUM,
    Muscle,
    MuscleFirstOrderActivationDynamicModel,
    MuscleFixedWidthPennationModel,
    check_minimum_activation,
)


# OpenSim's equilibrium at the start ignores the speed of the path: fibers begin at rest.
class Millard2012EquilibriumMuscle(Muscle):
    """The muscle of Millard et al. (2013), tendon and fiber in equilibrium, with curves one can replace."""

    facts = Facts(
        states="activation?!ignore_activation_dynamics fiber_length?!ignore_tendon_compliance",
        outputs="passive_fiber_damping_force passive_fiber_damping_force_along_tendon passive_fiber_elastic_force "
        "passive_fiber_elastic_force_along_tendon",
        domains={
            "pennation_angle_at_optimal": BELOW_QUARTER_TURN,
            "maximum_pennation_angle": UP_TO_QUARTER_TURN,
            "activation_time_constant": LEAST_TIME_CONSTANT,
            "deactivation_time_constant": LEAST_TIME_CONSTANT,
        },
        refused="optimal_fiber_length pennation_angle_at_optimal activation_time_constant "
        "deactivation_time_constant minimum_activation maximum_pennation_angle",
        zero={STUCK: "tendon_slack_length"},
        doubtful={"tendon_slack_length": NO_EQUILIBRIUM},
    )

    internal = (
        ("penMdl", MuscleFixedWidthPennationModel),
        ("actMdl", MuscleFirstOrderActivationDynamicModel),
    )

    min_control: Number = 0.01
    fiber_damping: Annotated[float, real(domain=">= 0")] = 0.1
    """Damping force of the fiber over `max_isometric_force`, per normalised velocity; none below 0.001."""
    default_activation: Annotated[float, real(domain="0 to 1")] = 0.05
    """Activation at the start of a simulation."""
    default_fiber_length: Annotated[float, real("m", "> 0")] = 0.1
    """Fiber length at the start, unless a tool brings fiber and tendon into equilibrium."""
    activation_time_constant: Annotated[float, real("s", "> 0")] = 0.01
    """Time constant of rising activation; high activation slows it down."""
    deactivation_time_constant: Annotated[float, real("s", "> 0")] = 0.04
    """Time constant of falling activation; high activation speeds it up."""
    minimum_activation: Annotated[float, real(domain="0 to 1")] = 0.01
    """Smallest activation of the muscle; below 0.01 only with fiber damping or a rigid tendon."""
    maximum_pennation_angle: Annotated[float, real("rad", ">= 0")] = MAXIMUM_PENNATION
    """Largest pennation angle; it bounds the fiber length from below."""
    active_force_length_curve: Unnamed[ActiveForceLengthCurve] = make_default(
        ActiveForceLengthCurve, name="ActiveForceLengthCurve"
    )
    """Active force over fiber length."""
    force_velocity_curve: Unnamed[ForceVelocityCurve] = make_default(
        ForceVelocityCurve, name="ForceVelocityCurve"
    )
    """Factor of the active force over fiber velocity."""
    fiber_force_length_curve: Unnamed[FiberForceLengthCurve] = make_default(
        FiberForceLengthCurve, name="FiberForceLengthCurve"
    )
    """Passive force of the fiber over its length."""
    tendon_force_length_curve: Unnamed[TendonForceLengthCurve] = make_default(
        TendonForceLengthCurve, name="TendonForceLengthCurve"
    )
    """Force of the tendon over its length."""

    def __setattr__(self, name: str, value: Any) -> None:
        had_dynamics = not self.ignore_activation_dynamics
        super().__setattr__(name, value)
        if had_dynamics and self.ignore_activation_dynamics:
            self.__dict__[MODEL_MINIMUM] = self.minimum_activation

    @property
    def least_activation(self) -> float:
        """Activation below which OpenSim computes no force.

        It belongs to the activation model inside the muscle, to which OpenSim passes
        `minimum_activation` on only while the muscle has activation dynamics. Hence a muscle that is
        read without dynamics has the model's default of 0.01, and one that loses them later, by
        ModOpIgnoreActivationDynamics for example, keeps its value until it is written to a file.
        """
        if not self.ignore_activation_dynamics:
            return self.minimum_activation
        value: float | None = self.__dict__.get(MODEL_MINIMUM)
        return (
            MuscleFirstOrderActivationDynamicModel().minimum_activation if value is None else value
        )

    @property
    def is_classic(self) -> bool:
        """True if the tendon is elastic and fibers have no damping, so that the equations are singular without active force."""
        # OpenSim counts a damping below 0.001 as none (measured with 4.6).
        return not self.ignore_tendon_compliance and self.fiber_damping < 0.001

    @property
    def overwritten(self) -> dict[str, float]:
        """Properties of the curves that OpenSim overrides, depending on whether equations can be singular.

        Returns:
            Values that OpenSim uses instead, by the name of the property.
        """
        if self.is_classic:
            # The fiber velocity is then the inverse force-velocity curve of force / (activation x
            # active force), so that the active force must not reach 0.
            return {"minimum_value": max(self.active_force_length_curve.minimum_value, 0.1)}
        # With damping or a rigid tendon nothing is divided by the active force, and OpenSim sets
        # these numbers to 0 even if the file has others.
        return dict.fromkeys(
            ("minimum_value", "concentric_slope_at_vmax", "eccentric_slope_at_vmax"), 0.0
        )

    def find_contradictions(self) -> Iterator[Contradiction]:
        """Yield combinations that OpenSim rejects: too little activation without damping, a curve without inverse."""
        # The same quotient is infinite at an activation of 0.
        if self.is_classic and self.minimum_activation < 0.01:
            yield (
                "minimum_activation",
                f"its minimum_activation, {self.minimum_activation:.6g}, is below 0.01, which an elastic tendon "
                "without fiber damping needs",
            )
        if self.force_velocity_curve.concentric_slope_near_vmax == 1:
            yield (
                None,
                "the concentric_slope_near_vmax of its ForceVelocityCurve is not less than 1",
            )
        yield from check_minimum_activation(self.minimum_activation)


class Millard2012AccelerationMuscle(Muscle):
    """Muscle of Millard et al. (2013) with a mass between fiber and tendon, whose position and speed are states."""

    facts = Facts(
        states="activation fiber_length fiber_velocity",
        mujoco={
            "rise": "muscle_first_order_activation_dynamic_model.activation_time_constant",
            "fall": "muscle_first_order_activation_dynamic_model.deactivation_time_constant",
        },
    )

    default_activation: Annotated[float, real(domain="0 to 1")] = 0.0
    """Activation at the start of a simulation."""
    default_fiber_length: Annotated[float, real("m", "> 0")] = 0.1
    """Fiber length at the start, unless a tool brings fiber and tendon into equilibrium."""
    default_fiber_velocity: Number = 0.0
    """Fiber velocity at the start of a simulation; lengthening is positive."""
    # No least activation: the equation of motion of a mass never divides by the activation.
    muscle_first_order_activation_dynamic_model: Unnamed[MuscleFirstOrderActivationDynamicModel] = (
        make_default(
            MuscleFirstOrderActivationDynamicModel, name="_activation", minimum_activation=0.0
        )
    )
    """Dynamics by which the activation follows the control."""
    active_force_length_curve: Unnamed[ActiveForceLengthCurve] = make_default(
        ActiveForceLengthCurve, name="ActiveForceLengthCurve", minimum_value=0.0
    )
    """Active force over fiber length."""
    force_velocity_curve: Unnamed[ForceVelocityCurve] = make_default(
        ForceVelocityCurve, name="ForceVelocityCurve"
    )
    """Factor of the active force over fiber velocity."""
    fiber_force_length_curve: Unnamed[FiberForceLengthCurve] = make_default(
        FiberForceLengthCurve, name="FiberForceLengthCurve"
    )
    """Passive force of the fiber over its length."""
    tendon_force_length_curve: Unnamed[TendonForceLengthCurve] = make_default(
        TendonForceLengthCurve, name="TendonForceLengthCurve"
    )
    """Force of the tendon over its length."""
    fiber_compressive_force_length_curve: Unnamed[FiberCompressiveForceLengthCurve] = make_default(
        FiberCompressiveForceLengthCurve, name="default_FiberCompressiveForceLengthCurve"
    )
    """Force along the fiber that keeps it from becoming too short."""
    fiber_compressive_force_cos_pennation_curve: Unnamed[FiberCompressiveForceCosPennationCurve] = (
        make_default(
            FiberCompressiveForceCosPennationCurve,
            name="default_FiberCompressiveForceCosPennationCurve",
        )
    )
    """Force along the tendon that keeps fibers from standing across it."""
    tendon_force_length_damping: Annotated[float, real(domain=">= 0")] = 0.1
    """Coefficient c of the factor 1 + c v of the tendon force, at the normalised velocity v."""
    fiber_compressive_force_length_damping: Annotated[float, real(domain=">= 0")] = 1.0
    """Coefficient c of the factor 1 - c v of the force against short fibers, at velocity v."""
    fiber_force_length_damping: Annotated[float, real(domain=">= 0")] = 0.01
    """Coefficient c of the factor 1 + c v of the passive force, at the normalised velocity v."""
    fiber_compressive_force_cos_pennation_damping: Annotated[float, real(domain=">= 0")] = 1.0
    """Coefficient c of the factor 1 - c v of the force against steep fibers, at velocity v."""
    fiber_damping: Annotated[float, real(domain=">= 0")] = 0.01
    """Damping force of the fiber over `max_isometric_force`, per normalised velocity."""
    mass: Annotated[float, real(domain="> 0")] = 0.1
    """Mass that moves between fiber and tendon."""


# OpenSim takes the lengthening speed of the path as fiber velocity, whatever the pennation.
class RigidTendonMuscle(Muscle):
    """A muscle whose tendon keeps its slack length, with splines as curves."""

    facts = Facts(
        zero={NAN: "optimal_fiber_length max_contraction_velocity"},
        scales={"optimal_fiber_length": "", "tendon_slack_length": ""},
    )

    active_force_length_curve: Single[Function] = Field(
        default_factory=partial(make_active_force_length, "active_force_length_curve")
    )
    """Active force over fiber length, both normalised."""
    passive_force_length_curve: Single[Function] = Field(
        default_factory=partial(make_passive_force_length, "passive_force_length_curve")
    )
    """Passive force over fiber length, both normalised; kept between 0 and 10."""
    force_velocity_curve: Single[Function] = Field(
        default_factory=partial(make_force_velocity, "force_velocity_curve")
    )
    """Factor of the active force over fiber velocity, normalised."""
