"""Path actuators and muscles of Hill's type, which have fiber and tendon in series along a path.

Forces are normalised by `max_isometric_force`, fiber lengths by `optimal_fiber_length`, tendon
lengths by `tendon_slack_length`.
"""

import math
from collections.abc import Iterator
from functools import partial
from typing import Annotated, Any

from pydantic import Field

from osimlite.schema.actuators import ScalarActuator
from osimlite.schema.base import ModelComponent, make_default
from osimlite.schema.default_curves import (
    make_active_force_length,
    make_force_velocity,
    make_passive_force_length,
)
from osimlite.schema.facts import (
    BELOW_QUARTER_TURN,
    IDLE,
    LEAST_TIME_CONSTANT,
    NAN,
    NO_EQUILIBRIUM,
    PATH,
    STOPS,
    STUCK,
    UP_TO_QUARTER_TURN,
    Contradiction,
    Facts,
)
from osimlite.schema.fields import Flag, Number, Single, Tag, Unnamed, real, word
from osimlite.schema.functions import Function
from osimlite.schema.geometry import Appearance
from osimlite.schema.muscle_curves import (
    ActiveForceLengthCurve,
    FiberCompressiveForceCosPennationCurve,
    FiberCompressiveForceLengthCurve,
    FiberForceLengthCurve,
    ForceVelocityCurve,
    TendonForceLengthCurve,
)
from osimlite.schema.paths import AbstractGeometryPath, GeometryPath

MAXIMUM_PENNATION = 1.4706289056333368
"""The default of the largest pennation angle, arccos 0.1."""


class MuscleFirstOrderActivationDynamicModel(ModelComponent):
    """Activation that follows excitation with one time constant up and one down."""

    activation_time_constant: Annotated[float, real("s", "> 0")] = 0.01
    """Time constant of rising activation; a muscle that owns the part puts in its own."""
    deactivation_time_constant: Annotated[float, real("s", "> 0")] = 0.04
    """Time constant of falling activation; a muscle that owns the part puts in its own."""
    # OpenSim clamps only the use of the activation, not the state: with an excitation below this
    # minimum the state falls linearly for ever.
    minimum_activation: Annotated[float, real(domain="0 to 1")] = 0.01
    """Activation below which the muscle does not go, whatever its control."""


class MuscleFixedWidthPennationModel(ModelComponent):
    """Fibers that keep the width of the muscle: length times sine of pennation stays what it is at optimal length."""

    facts = Facts(
        domains={
            "pennation_angle_at_optimal": BELOW_QUARTER_TURN,
            "maximum_pennation_angle": UP_TO_QUARTER_TURN,
        },
        refused="optimal_fiber_length pennation_angle_at_optimal maximum_pennation_angle",
    )

    optimal_fiber_length: Annotated[float, real("m", "> 0")] = 1.0
    """Fiber length at which `pennation_angle_at_optimal` is measured."""
    pennation_angle_at_optimal: Annotated[float, real("rad", ">= 0")] = 0.0
    """Angle between fibers and tendon at optimal fiber length; 0 is parallel."""
    # Fibers across the tendon would need an infinite force, since equilibrium divides by the
    # cosine.
    maximum_pennation_angle: Annotated[float, real("rad", ">= 0")] = MAXIMUM_PENNATION
    """Angle that the fibers do not go beyond; it bounds their length from below."""


class PathActuator(ScalarActuator):
    """Pulls along its path with `optimal_force` times the control."""

    facts = Facts(
        outputs="tension", domains={"optimal_force": "!= 0"}, doubts={"optimal_force": IDLE}
    )

    geometry_path: Annotated[Single[AbstractGeometryPath], Tag("path")] = make_default(
        GeometryPath, name="path"
    )
    """The line along which the actuator pulls."""
    optimal_force: Annotated[float, real("N")] = 1.0
    """Tension at a control of 1; classes with a law of their own do without it."""


class ClutchedPathSpring(PathActuator):
    """A spring along a path that its control engages, with the length it has then as rest length."""

    facts = Facts(
        states="stretch",
        domains={"initial_stretch": ">= 0"},
        refused="stiffness dissipation relaxation_time_constant initial_stretch",
        zero={STOPS: "relaxation_time_constant"},
    )

    min_control: Number = 0.0
    max_control: Number = 1.0
    stiffness: Annotated[float, real("N/m", ">= 0")] = math.nan
    """Tension per stretch at a control of 1; less control pulls proportionally less."""
    dissipation: Annotated[float, real("s/m", ">= 0")] = math.nan
    """The c of 1 + c v, by which the lengthening speed v raises the tension."""
    relaxation_time_constant: Annotated[float, real("s", "> 0")] = 0.001
    """Time constant with which the stretch fades while the control is 0."""
    initial_stretch: Annotated[float, real("m")] = 0.0
    """Stretch at the start of a simulation."""


class McKibbenActuator(PathActuator):
    """A pneumatic muscle: a tube in a braid, whose control is the pressure in it."""

    number_of_turns: Annotated[float, real(domain="> 0")] = 1.5
    """Turns of a thread around the tube, from end to end."""
    thread_length: Annotated[float, real(domain="> 0")] = 200.0
    """Length of one thread of the braid, unwound."""
    cord_length: Annotated[float, real(domain=">= 0")] = 0.0
    """Length of the path that is cord and does not shorten; the tube is the rest."""


class Muscle(PathActuator, abstract=True):
    """What every muscle has: its strength, its lengths, and what of it may be left out of the computation."""

    facts = Facts(
        outputs="activation active_fiber_force active_fiber_force_along_tendon active_force_length_multiplier "
        "cos_pennation_angle excitation fiber_active_power fiber_force fiber_force_along_tendon fiber_length "
        "fiber_length_along_tendon fiber_passive_power fiber_stiffness fiber_stiffness_along_tendon "
        "fiber_velocity fiber_velocity_along_tendon force_velocity_multiplier muscle_power muscle_stiffness "
        "normalized_fiber_length normalized_fiber_velocity passive_fiber_force passive_fiber_force_along_tendon "
        "passive_force_multiplier pennation_angle pennation_angular_velocity tendon_force tendon_length "
        "tendon_power tendon_stiffness tendon_strain tendon_velocity",
        mujoco={
            "vmax": "max_contraction_velocity",
            "fvmax": "force_velocity_curve.max_eccentric_velocity_force_multiplier",
            "rise": "activation_time_constant",
            "fall": "deactivation_time_constant",
        },
        # With the ratio of path lengths, a scaled muscle works in the same range of its curves as
        # before.
        scales={"optimal_fiber_length": PATH, "tendon_slack_length": PATH},
    )

    min_control: Number = 0.0
    max_control: Number = 1.0
    geometry_path: Annotated[Single[AbstractGeometryPath], Tag("path")] = make_default(
        GeometryPath,
        name="path",
        appearance=lambda: Appearance.build({"color": (0.8, 0.1, 0.1)}, set()),
    )
    max_isometric_force: Annotated[float, real("N", "> 0")] = 1000.0
    """Force of fully active fibers at optimal length and rest; all forces are measured by it."""
    optimal_fiber_length: Annotated[float, real("m", "> 0")] = 0.1
    """Fiber length at which the active force is greatest; all fiber lengths are measured by it."""
    tendon_slack_length: Annotated[float, real("m", "> 0")] = 0.2
    """Length up to which the tendon is slack; all tendon lengths are measured by it."""
    pennation_angle_at_optimal: Annotated[float, real("rad", ">= 0")] = 0.0
    """Angle between fibers and tendon at optimal fiber length; 0 is parallel."""
    max_contraction_velocity: Annotated[float, real("optimal_fiber_length/s", "> 0")] = 10.0
    """Shortening velocity at which fully active fibers bear no force."""
    ignore_tendon_compliance: Flag = False
    """Whether the tendon is rigid, always at its slack length, so that fiber length is no state."""
    ignore_activation_dynamics: Flag = False
    """Whether activation is the control at every moment, and no state."""

    @property
    def overwritten(self) -> dict[str, float]:
        """Properties of the curves that OpenSim overrides.

        Returns:
            Values that OpenSim uses instead, by the name of the property.
        """
        return {}


def check_complete_dynamics(muscle: Muscle) -> Iterator[Contradiction]:
    """Yield the flags that OpenSim rejects in a class whose tendon is elastic and whose activation has dynamics."""
    for flag in ("ignore_tendon_compliance", "ignore_activation_dynamics"):
        if getattr(muscle, flag):
            yield flag, f"{flag} is true, which this class does not have"


class ActivationFiberLengthMuscle(Muscle, abstract=True):
    """A muscle with two states: activation and fiber length."""

    facts = Facts(states="activation fiber_length")

    default_activation: Annotated[float, real(domain="0 to 1")] = 0.05
    """Activation at the start of a simulation."""
    # OpenSim has this length in metres for every muscle, whatever its optimal_fiber_length: without
    # equilibrium at the start, short fibers begin far outside of their range.
    default_fiber_length: Annotated[float, real("m", "> 0")] = 0.1
    """Fiber length at the start, unless a tool brings fiber and tendon into equilibrium."""


# OpenSim's potential energy of these fibers is 0 below a length of 1 m: it takes metres for optimal
# fiber lengths.
class Thelen2003Muscle(ActivationFiberLengthMuscle):
    """The muscle of Thelen (2003), with tendon and fiber strains at full force and shape factors of its curves."""

    facts = Facts(
        domains={
            "pennation_angle_at_optimal": BELOW_QUARTER_TURN,
            "maximum_pennation_angle": UP_TO_QUARTER_TURN,
            "minimum_activation": "0.01 to 1",
            "activation_time_constant": LEAST_TIME_CONSTANT,
            "deactivation_time_constant": LEAST_TIME_CONSTANT,
        },
        refused="optimal_fiber_length pennation_angle_at_optimal FmaxTendonStrain FmaxMuscleStrain KshapeActive "
        "KshapePassive Af Flen fv_linear_extrap_threshold maximum_pennation_angle activation_time_constant "
        "deactivation_time_constant minimum_activation",
        zero={NAN: "tendon_slack_length"},
        doubts={"tendon_slack_length": NO_EQUILIBRIUM},
        mujoco={"fvmax": "Flen"},
    )

    internal = (
        ("pennMdl", MuscleFixedWidthPennationModel),
        ("actMdl", MuscleFirstOrderActivationDynamicModel),
    )

    # OpenSim rejects a model whose min_control is below the minimum_activation of this class.
    min_control: Number = 0.01
    FmaxTendonStrain: Annotated[float, real(domain="> 0")] = 0.04
    """Strain at which the tendon bears `max_isometric_force`."""
    FmaxMuscleStrain: Annotated[float, real(domain="> 0")] = 0.6
    """Strain at which the passive fiber bears `max_isometric_force`."""
    KshapeActive: Annotated[float, real(domain="> 0")] = 0.45
    """Width of the active force over fiber length l, exp(-(l - 1)^2 / KshapeActive)."""
    KshapePassive: Annotated[float, real(domain="> 0")] = 5.0
    """Exponent of the passive force at full strain; more makes a softer toe."""
    Af: Annotated[float, real(domain="> 0")] = 0.25
    """Shape of force over velocity (Hill's a / F0); less is more curved."""
    Flen: Annotated[float, real(domain="> 1")] = 1.4
    """Force that lengthening fibers approach, of the isometric one."""
    # The velocity grows without bound as the force approaches `Flen`, so that it needs a tangent.
    fv_linear_extrap_threshold: Annotated[float, real(domain="> 0")] = 0.95
    """Part of `Flen` from which force over velocity continues as a line; more than 1 / `Flen`."""
    maximum_pennation_angle: Annotated[float, real("rad", ">= 0")] = MAXIMUM_PENNATION
    """Angle that the fibers do not go beyond; it bounds their length from below."""
    activation_time_constant: Annotated[float, real("s", "> 0")] = 0.015
    """Time constant of rising activation; high activation slows it down."""
    deactivation_time_constant: Annotated[float, real("s", "> 0")] = 0.05
    """Time constant of falling activation; high activation speeds it up."""
    minimum_activation: Annotated[float, real(domain="0 to 1")] = 0.01
    """Activation below which the muscle does not go; `min_control` must not be less."""

    def find_contradictions(self) -> Iterator[Contradiction]:
        """Yield combinations that OpenSim rejects: simplified dynamics, a force-velocity threshold of at most 1/Flen."""
        yield from check_complete_dynamics(self)
        if self.fv_linear_extrap_threshold <= (min_threshold := 1 / self.Flen):
            yield (
                "fv_linear_extrap_threshold",
                f"its fv_linear_extrap_threshold is not above 1/Flen, {min_threshold:.4g}",
            )
        yield from _check_minimum_activation(self.minimum_activation)


_MODEL_MINIMUM = "_model_minimum"
"""Key in the state of a muscle for the minimum of its activation model, which no file holds."""


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
        doubts={"tendon_slack_length": NO_EQUILIBRIUM},
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
    """Activation below which the muscle does not go; below 0.01 only with fiber damping or a rigid tendon."""
    maximum_pennation_angle: Annotated[float, real("rad", ">= 0")] = MAXIMUM_PENNATION
    """Angle that the fibers do not go beyond; it bounds their length from below."""
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
            self.__dict__[_MODEL_MINIMUM] = self.minimum_activation

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
        value: float | None = self.__dict__.get(_MODEL_MINIMUM)
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
        yield from _check_minimum_activation(self.minimum_activation)


def _check_minimum_activation(minimum_activation: float) -> Iterator[Contradiction]:
    if minimum_activation == 1:
        yield "minimum_activation", "its minimum_activation is not less than 1"


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
    """How activation follows the control."""
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
    """The c of 1 + c v, by which the normalised velocity v raises the tendon's force."""
    fiber_compressive_force_length_damping: Annotated[float, real(domain=">= 0")] = 1.0
    """The c of 1 - c v, by which shortening raises the force against short fibers."""
    fiber_force_length_damping: Annotated[float, real(domain=">= 0")] = 0.01
    """The c of 1 + c v, by which the normalised velocity v raises the passive force."""
    fiber_compressive_force_cos_pennation_damping: Annotated[float, real(domain=">= 0")] = 1.0
    """The c of 1 - c v, by which shortening raises the force against steep fibers."""
    fiber_damping: Annotated[float, real(domain=">= 0")] = 0.01
    """Damping force of the fiber over `max_isometric_force`, per normalised velocity."""
    mass: Annotated[float, real(domain="> 0")] = 0.1
    """Mass that moves between fiber and tendon."""


class DeGrooteFregly2016Muscle(Muscle):
    """The muscle of De Groote et al. (2016), smooth everywhere, made for direct collocation."""

    facts = Facts(
        states="activation?!ignore_activation_dynamics normalized_tendon_force?!ignore_tendon_compliance",
        outputs="implicitenabled_normalized_tendon_force:bool implicitresidual_normalized_tendon_force "
        "passive_fiber_damping_force passive_fiber_damping_force_along_tendon passive_fiber_elastic_force "
        "passive_fiber_elastic_force_along_tendon statebounds_normalized_tendon_force:Vec2",
        domains={
            "pennation_angle_at_optimal": BELOW_QUARTER_TURN,
            "default_activation": "> 0",
            # OpenSim searches the equilibrium of this muscle by bisection in this range only.
            "default_normalized_tendon_force": "0 to 5",
        },
        refused="pennation_angle_at_optimal activation_time_constant deactivation_time_constant default_activation "
        "default_normalized_tendon_force fiber_damping passive_fiber_strain_at_one_norm_force "
        "tendon_strain_at_one_norm_force activation_dynamics_smoothing active_force_width_scale",
        zero={
            NAN: "max_isometric_force optimal_fiber_length tendon_slack_length max_contraction_velocity"
        },
    )

    # OpenSim 4.6 keeps these time constants and the smoothing in C++ statics: the first muscle of
    # this class in a process decides for all others, of all models.
    activation_time_constant: Annotated[float, real("s", "> 0")] = 0.015
    """Time constant of rising activation; high activation slows it down."""
    deactivation_time_constant: Annotated[float, real("s", "> 0")] = 0.06
    """Time constant of falling activation; high activation speeds it up."""
    default_activation: Annotated[float, real(domain="0 to 1")] = 0.5
    """Activation at the start of a simulation."""
    default_normalized_tendon_force: Annotated[float, real(domain=">= 0")] = 0.5
    """Tendon force over `max_isometric_force` at the start, at most 5; it is the state."""
    active_force_width_scale: Annotated[float, real(domain=">= 1")] = 1.0
    """Factor of the width of the active force over fiber length."""
    # With an elastic tendon in explicit mode, damping changes the reported forces of this class,
    # but not the motion.
    fiber_damping: Annotated[float, real(domain=">= 0")] = 0.0
    """Damping force of the fiber over `max_isometric_force`, per normalised velocity."""
    passive_fiber_strain_at_one_norm_force: Annotated[float, real(domain="> 0")] = 0.6
    """Strain at which the passive fiber bears `max_isometric_force`."""
    tendon_strain_at_one_norm_force: Annotated[float, real(domain="> 0")] = 0.049
    """Strain at which the tendon bears `max_isometric_force`."""
    ignore_passive_fiber_force: Flag = False
    """Whether passive fibers bear no force."""
    tendon_compliance_dynamics_mode: Annotated[str, word("explicit", "implicit")] = "explicit"
    """Form of the equilibrium of fiber and tendon; implicit is for direct collocation only."""
    activation_dynamics_smoothing: Annotated[float, real(domain="> 0")] = 0.1
    """How sharply rising turns into falling activation; about 10 keeps the time constants true."""

    def find_contradictions(self) -> Iterator[Contradiction]:
        """Yield `optimal_force` if it is set: OpenSim accepts only `max_isometric_force`."""
        if "optimal_force" in self.model_fields_set:
            yield "optimal_force", "optimal_force may not be given, only max_isometric_force"


class MeyerFregly2016Muscle(Muscle):
    """A rigid-tendon muscle with the curves of Meyer et al. (2016)."""

    facts = Facts(
        states="activation?!ignore_activation_dynamics",
        outputs="passive_fiber_damping_force passive_fiber_damping_force_along_tendon passive_fiber_elastic_force "
        "passive_fiber_elastic_force_along_tendon",
        domains={"pennation_angle_at_optimal": BELOW_QUARTER_TURN},
        refused="pennation_angle_at_optimal",
    )

    activation_time_constant: Annotated[float, real("s", "> 0")] = 0.015
    """Time constant of rising activation; high activation slows it down."""
    deactivation_time_constant: Annotated[float, real("s", "> 0")] = 0.06
    """Time constant of falling activation; high activation speeds it up."""
    default_activation: Annotated[float, real(domain="0 to 1")] = 0.5
    """Activation at the start of a simulation."""
    active_force_width_scale: Annotated[float, real(domain=">= 1")] = 1.0
    """Factor of the width of the active force over fiber length."""
    fiber_damping: Annotated[float, real(domain=">= 0")] = 0.0
    """Damping force of the fiber over `max_isometric_force`, per normalised velocity."""
    ignore_passive_fiber_force: Flag = False
    """Whether passive fibers bear no force."""
    activation_dynamics_smoothing: Annotated[float, real(domain="> 0")] = 0.1
    """How sharply rising turns into falling activation; about 10 keeps the time constants true."""

    find_contradictions = DeGrooteFregly2016Muscle.find_contradictions


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
