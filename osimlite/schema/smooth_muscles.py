"""Muscles of De Groote and Fregly 2016 and of Meyer and Fregly 2016, whose curves are smooth formulas."""

from collections.abc import Iterator
from typing import Annotated

from osimlite.schema.facts import (
    BELOW_QUARTER_TURN,
    NAN,
    Contradiction,
    Facts,
)
from osimlite.schema.fields import Flag, real, word
from osimlite.schema.muscles import Muscle


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
    """Sharpness of the transition from rise to fall; about 10 keeps the time constants true."""

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
    """Sharpness of the transition from rise to fall; about 10 keeps the time constants true."""

    find_contradictions = DeGrooteFregly2016Muscle.find_contradictions
