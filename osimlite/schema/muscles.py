"""Path actuators and muscles of Hill's type, which have fiber and tendon in series along a path.

Forces are normalised by `max_isometric_force`, fiber lengths by `optimal_fiber_length`, tendon
lengths by `tendon_slack_length`.
"""

from collections.abc import Iterator
from typing import Annotated

from osimlite.base.text import add_article
from osimlite.schema.base import ModelComponent, make_default
from osimlite.schema.facts import (
    BELOW_QUARTER_TURN,
    IDLE,
    LEAST_TIME_CONSTANT,
    NAN,
    NO_EQUILIBRIUM,
    PATH,
    UP_TO_QUARTER_TURN,
    Contradiction,
    Facts,
)
from osimlite.schema.fields import Flag, Number, Single, Tag, real
from osimlite.schema.forces import ScalarActuator
from osimlite.schema.geometry import Appearance
from osimlite.schema.paths import AbstractGeometryPath, GeometryPath

MAXIMUM_PENNATION = 1.4706289056333368
"""The default of the largest pennation angle, arccos 0.1."""


class MuscleFirstOrderActivationDynamicModel(ModelComponent):
    """Activation that follows excitation with one time constant up and one down."""

    activation_time_constant: Annotated[float, real("s", "> 0")] = 0.01
    """Time constant of rising activation; a muscle that owns this object replaces it."""
    deactivation_time_constant: Annotated[float, real("s", "> 0")] = 0.04
    """Time constant of falling activation; a muscle that owns this object replaces it."""
    # OpenSim clamps only the use of the activation, not the state: with an excitation below this
    # minimum the state falls linearly for ever.
    minimum_activation: Annotated[float, real(domain="0 to 1")] = 0.01
    """Smallest activation of the muscle, for any control."""


class MuscleFixedWidthPennationModel(ModelComponent):
    """Fibers of a muscle of constant width: fiber length times the sine of the pennation angle."""

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
    """Largest pennation angle; it bounds the fiber length from below."""


class PathActuator(ScalarActuator):
    """Pulls along its path with `optimal_force` times the control."""

    facts = Facts(
        outputs="tension", domains={"optimal_force": "!= 0"}, doubtful={"optimal_force": IDLE}
    )

    geometry_path: Annotated[Single[AbstractGeometryPath], Tag("path")] = make_default(
        GeometryPath, name="path"
    )
    """The line along which the actuator pulls."""
    optimal_force: Annotated[float, real("N")] = 1.0
    """Tension at a control of 1; classes with another law do not use it."""


class Muscle(PathActuator, abstract=True):
    """Base class of muscles: strength, lengths, and options of the computation."""

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
    """Force of fully active fibers at optimal length and rest; the unit of normalized forces."""
    optimal_fiber_length: Annotated[float, real("m", "> 0")] = 0.1
    """Fiber length at which the active force is largest; the unit of normalized fiber lengths."""
    tendon_slack_length: Annotated[float, real("m", "> 0")] = 0.2
    """Length up to which the tendon is slack; the unit of normalized tendon lengths."""
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
    impossible_muscles = {
        "ignore_tendon_compliance": "have a rigid tendon",
        "ignore_activation_dynamics": "be without activation dynamics",
    }
    for flag, impossible_muscle in impossible_muscles.items():
        if getattr(muscle, flag):
            class_name = add_article(type(muscle).__name__)
            yield flag, f"{flag} is true, but {class_name} cannot {impossible_muscle}"


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
        doubtful={"tendon_slack_length": NO_EQUILIBRIUM},
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
    """Largest pennation angle; it bounds the fiber length from below."""
    activation_time_constant: Annotated[float, real("s", "> 0")] = 0.015
    """Time constant of rising activation; high activation slows it down."""
    deactivation_time_constant: Annotated[float, real("s", "> 0")] = 0.05
    """Time constant of falling activation; high activation speeds it up."""
    minimum_activation: Annotated[float, real(domain="0 to 1")] = 0.01
    """Smallest activation of the muscle; `min_control` must not be less."""

    def find_contradictions(self) -> Iterator[Contradiction]:
        """Yield combinations that OpenSim rejects: simplified dynamics, a force-velocity threshold of at most 1/Flen."""
        yield from check_complete_dynamics(self)
        if self.fv_linear_extrap_threshold <= (min_threshold := 1 / self.Flen):
            yield (
                "fv_linear_extrap_threshold",
                f"its fv_linear_extrap_threshold is not above 1/Flen, {min_threshold:.4g}",
            )
        yield from check_minimum_activation(self.minimum_activation)


MODEL_MINIMUM = "_model_minimum"
"""Key in the state of a muscle for the minimum of its activation model, which no file holds."""


def check_minimum_activation(minimum_activation: float) -> Iterator[Contradiction]:
    """Yield the contradiction of a muscle whose activation cannot be less than 1."""
    if minimum_activation == 1:
        yield "minimum_activation", "its minimum_activation is not less than 1"
