"""A bushing whose loads are functions of its deviations, one by one."""

from collections.abc import Sequence

from osimlite.mechanics.kernels.functions import value_at
from osimlite.mechanics.kernels.pointers import Floats
from osimlite.schema.springs import FunctionBasedBushingForce
from osimlite.simulation.elements.geometries.frames import DEVIATIONS, BetweenFrames, damp
from osimlite.simulation.elements.integral import integral
from osimlite.simulation.elements.kind import DeclaredForce, Kind
from osimlite.simulation.elements.parameters import Curve, Vector


def bushing(
    deviations: Floats,
    rates: Floats,
    loads: Floats,
    damping: Floats,
    mx: Floats,
    my: Floats,
    mz: Floats,
    fx: Floats,
    fy: Floats,
    fz: Floats,
) -> None:
    """Fill the loads."""
    loads[0], _, _ = value_at(mx, deviations[0])
    loads[1], _, _ = value_at(my, deviations[1])
    loads[2], _, _ = value_at(mz, deviations[2])
    loads[3], _, _ = value_at(fx, deviations[3])
    loads[4], _, _ = value_at(fy, deviations[4])
    loads[5], _, _ = value_at(fz, deviations[5])
    damp(loads, rates, damping)


def _energy(force: DeclaredForce, record: Sequence[float]) -> float:
    _, *functions = force.values
    deviations = record[DEVIATIONS : DEVIATIONS + 6]
    return sum(
        integral(function, 0.0, value)
        for function, value in zip(functions, deviations, strict=True)
    )


KIND = Kind(
    FunctionBasedBushingForce,
    BetweenFrames(),
    bushing,
    parameters=(
        Vector(6, lambda builder, force: (*force.rotational_damping, *force.translational_damping)),
        Curve("m_x_theta_x_function"),
        Curve("m_y_theta_y_function"),
        Curve("m_z_theta_z_function"),
        Curve("f_x_delta_x_function"),
        Curve("f_y_delta_y_function"),
        Curve("f_z_delta_z_function"),
    ),
    stored=_energy,
)
