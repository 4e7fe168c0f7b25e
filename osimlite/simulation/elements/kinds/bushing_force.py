"""A bushing whose loads are linear in its deviations."""

from osimlite.mechanics.kernels.pointers import Floats
from osimlite.mechanics.laws.bushing import bushing_dissipation, bushing_load
from osimlite.mechanics.laws.springs import spring_energy
from osimlite.schema.springs import BushingForce
from osimlite.simulation.elements.geometries.frames import BetweenFrames, damped
from osimlite.simulation.elements.kind import Kind, State
from osimlite.simulation.elements.parameters import Vector


def bushing(
    deviations: Floats, rates: Floats, loads: Floats, stiffness: Floats, damping: Floats
) -> tuple[float, float]:
    """Energy, and the power that the dampers take up; fills the loads."""
    energy = power = 0.0
    for k in range(6):
        rate = damped(rates[k], damping[k])
        loads[k] = bushing_load(deviations[k], rate, stiffness[k], damping[k])
        energy += spring_energy(deviations[k], stiffness[k])
        power += bushing_dissipation(rate, damping[k])
    return energy, power


KIND = Kind(
    BushingForce,
    BetweenFrames(about_bodies=True),
    bushing,
    outputs=("energy", "dissipated_energy_rate"),
    parameters=(
        Vector(
            6, lambda builder, force: (*force.rotational_stiffness, *force.translational_stiffness)
        ),
        Vector(6, lambda builder, force: (*force.rotational_damping, *force.translational_damping)),
    ),
    states=(State("dissipated_energy", given=False, is_simbody=True),),
    goes_on=True,
)
