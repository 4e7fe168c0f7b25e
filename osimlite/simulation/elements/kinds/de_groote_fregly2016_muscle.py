"""The muscle by De Groote and Fregly."""

from osimlite.mechanics.laws.smooth_muscles import (
    LARGEST_FORCE,
    SmoothTendon,
    degroote,
    degroote_equilibrium,
    degroote_rigid,
    tendon_growth,
)
from osimlite.schema.muscles import DeGrooteFregly2016Muscle
from osimlite.simulation.elements.gather import ElementBuilder
from osimlite.simulation.elements.kind import State
from osimlite.simulation.elements.muscle import SPRING, muscle
from osimlite.simulation.elements.parameters import Fields, Number, positive
from osimlite.simulation.elements.smooth_muscle import ACTIVATION, check_smooth, smooth_fields


def _first(builder: ElementBuilder, force: DeGrooteFregly2016Muscle) -> DeGrooteFregly2016Muscle:
    """The muscle whose constants of activation count.

    OpenSim keeps them in variables of the process, so that those of the first muscle that it
    computes are those of all: of the first in the model, if the process computes no other.
    """
    muscles = [] if builder.own_times else builder.model.components(DeGrooteFregly2016Muscle)
    return next((muscle for muscle in muscles if not muscle.ignore_activation_dynamics), force)


def _check(builder: ElementBuilder, force: DeGrooteFregly2016Muscle) -> None:
    check_smooth(builder, force)
    positive("tendon_strain_at_one_norm_force").read(builder, force)
    words = f"is not from 0 to {LARGEST_FORCE:g}"
    Number("default_normalized_tendon_force", lambda x: 0.0 <= x <= LARGEST_FORCE, words).read(
        builder, force
    )


def _tendon(builder: ElementBuilder, force: DeGrooteFregly2016Muscle) -> tuple[float, ...]:
    is_explicit = force.tendon_compliance_dynamics_mode == "explicit"
    return (
        tendon_growth(force.tendon_strain_at_one_norm_force),
        not force.ignore_tendon_compliance,
        is_explicit,
    )


KIND = muscle(
    DeGrooteFregly2016Muscle,
    degroote,
    ("activation_rate", "normalized_tendon_force_rate", "fiber_velocity", SPRING, "energy"),
    smooth_fields(_first),
    Fields(SmoothTendon, (positive("passive_fiber_strain_at_one_norm_force"),), _tendon),
    states=(
        ACTIVATION,
        State("normalized_tendon_force"),
    ),
    equilibrium=degroote_equilibrium,
    settled=("normalized_tendon_force",),
    rigid=degroote_rigid,
    check=_check,
    shares=True,
    goes_on=True,
)
