"""The muscle by Meyer and Fregly, whose tendon is rigid whatever is said of it."""

from osimlite.mechanics.laws.smooth_muscles import meyer, meyer_rigid
from osimlite.schema.muscles import MeyerFregly2016Muscle
from osimlite.simulation.elements.muscle import SPRING, muscle
from osimlite.simulation.elements.smooth_muscle import ACTIVATION, check_smooth, smooth_fields

KIND = muscle(
    MeyerFregly2016Muscle,
    meyer,
    ("activation_rate", "fiber_velocity", SPRING),
    smooth_fields(),
    states=(ACTIVATION,),
    rigid=meyer_rigid,
    check=check_smooth,
    goes_on=True,
)
