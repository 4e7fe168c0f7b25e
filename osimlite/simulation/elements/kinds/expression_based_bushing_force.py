"""A bushing whose loads are formulas of all its deviations; its energy is not known."""

from osimlite.mechanics.kernels.pointers import Floats, Ints, at
from osimlite.mechanics.kernels.programs import compute
from osimlite.schema.springs import ExpressionBasedBushingForce
from osimlite.simulation.elements.geometries.frames import BetweenFrames, damp
from osimlite.simulation.elements.kind import Kind
from osimlite.simulation.elements.parameters import Expressions, Vector

VARIABLES = ("theta_x", "theta_y", "theta_z", "delta_x", "delta_y", "delta_z")


def bushing(
    deviations: Floats,
    rates: Floats,
    loads: Floats,
    damping: Floats,
    steps: Ints,
    constants: Floats,
    registers: Floats,
) -> None:
    """Fill the loads."""
    for k in range(6):
        registers[k] = deviations[k]
    for k in range(6):
        # Each formula has its count of steps before it, and the place of its constants.
        loads[k] = compute(at(steps, 2), steps[0], at(constants, steps[1]), registers, 6)
        steps = at(steps, 2 + 3 * steps[0])
    damp(loads, rates, damping)


KIND = Kind(
    ExpressionBasedBushingForce,
    BetweenFrames(),
    bushing,
    parameters=(
        Vector(6, lambda builder, force: (*force.rotational_damping, *force.translational_damping)),
        Expressions(
            tuple(f"{load}_expression" for load in ("Mx", "My", "Mz", "Fx", "Fy", "Fz")), VARIABLES
        ),
    ),
)
