"""Bushings between two frames: loads that are linear, functions, or expressions of the deviations."""

from collections.abc import Sequence

from osimlite.mechanics.kernels.functions import evaluate_function
from osimlite.mechanics.kernels.pointers import Floats, Ints, at
from osimlite.mechanics.kernels.programs import run_program
from osimlite.mechanics.laws.bushing import bushing_dissipation, bushing_load
from osimlite.mechanics.laws.springs import spring_energy
from osimlite.schema.springs import (
    BushingForce,
    ExpressionBasedBushingForce,
    FunctionBasedBushingForce,
)
from osimlite.simulation.elements.force_type import DeclaredForce, ForceType, State
from osimlite.simulation.elements.geometries.frames import (
    DEVIATIONS,
    BetweenFrames,
    add_damping,
    mask_undamped_rate,
)
from osimlite.simulation.elements.integral import integrate_function
from osimlite.simulation.elements.parameters import Curve, Expressions, Vector
from osimlite.simulation.elements.registry import register_force_type


def compute_linear_bushing(
    deviations: Floats, rates: Floats, loads: Floats, stiffness: Floats, damping: Floats
) -> tuple[float, float]:
    """Fill the loads k x + d v of the six deviations x with rates v.

    Args:
        deviations: three angles (rad) and a translation (m) (6,).
        rates: rates of the deviations, rad/s and m/s (6,).
        loads: receives moments (N.m) and forces (N) (6,).
        stiffness: k of each deviation (6,), N.m/rad and N/m.
        damping: d of each deviation (6,), N.m.s/rad and N.s/m.

    Returns:
        Energy (J), and the power that the dampers dissipate (W).
    """
    energy = power = 0.0
    for k in range(6):
        # The rates of angles are infinite at gimbal lock, where zero damping times infinity would
        # be NaN.
        rate = mask_undamped_rate(rates[k], damping[k])
        loads[k] = bushing_load(deviations[k], rate, stiffness[k], damping[k])
        energy += spring_energy(deviations[k], stiffness[k])
        power += bushing_dissipation(rate, damping[k])
    return energy, power


register_force_type(
    ForceType(
        BushingForce,
        BetweenFrames(about_bodies=True),
        compute_linear_bushing,
        outputs=("energy", "dissipated_energy_rate"),
        parameters=(
            Vector(
                6,
                lambda builder, force: (
                    *force.rotational_stiffness,
                    *force.translational_stiffness,
                ),
            ),
            Vector(
                6, lambda builder, force: (*force.rotational_damping, *force.translational_damping)
            ),
        ),
        states=(State("dissipated_energy", is_argument=False, is_simbody=True),),
        states_change_when_off=True,
    )
)


def compute_function_bushing(
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
    """Fill the loads by one function of each deviation, and add damping.

    Args:
        deviations: three angles (rad) and a translation (m) (6,).
        rates: rates of the deviations, rad/s and m/s (6,).
        loads: receives moments (N.m) and forces (N) (6,).
        damping: damping of each deviation (6,), N.m.s/rad and N.s/m.
        mx: table of the resisting moment over the first angle.
        my: table over the second angle.
        mz: table over the third angle.
        fx: table of the resisting force over the translation along x.
        fy: table over the translation along y.
        fz: table over the translation along z.
    """
    # One line per function, as kernels have no lists of tables.
    loads[0], _, _ = evaluate_function(mx, deviations[0])
    loads[1], _, _ = evaluate_function(my, deviations[1])
    loads[2], _, _ = evaluate_function(mz, deviations[2])
    loads[3], _, _ = evaluate_function(fx, deviations[3])
    loads[4], _, _ = evaluate_function(fy, deviations[4])
    loads[5], _, _ = evaluate_function(fz, deviations[5])
    add_damping(loads, rates, damping)


def _compute_function_energy(force: DeclaredForce, record: Sequence[float]) -> float:
    _, *functions = force.values
    deviations = record[DEVIATIONS : DEVIATIONS + 6]
    return sum(
        integrate_function(function, 0.0, value)
        for function, value in zip(functions, deviations, strict=True)
    )


register_force_type(
    ForceType(
        FunctionBasedBushingForce,
        BetweenFrames(),
        compute_function_bushing,
        parameters=(
            Vector(
                6, lambda builder, force: (*force.rotational_damping, *force.translational_damping)
            ),
            Curve("m_x_theta_x_function"),
            Curve("m_y_theta_y_function"),
            Curve("m_z_theta_z_function"),
            Curve("f_x_delta_x_function"),
            Curve("f_y_delta_y_function"),
            Curve("f_z_delta_z_function"),
        ),
        compute_energy=_compute_function_energy,
    )
)


DEVIATION_NAMES = ("theta_x", "theta_y", "theta_z", "delta_x", "delta_y", "delta_z")
"""Names of the deviations in the expressions: angles (rad) and translations (m)."""


def compute_expression_bushing(
    deviations: Floats,
    rates: Floats,
    loads: Floats,
    damping: Floats,
    steps: Ints,
    constants: Floats,
    registers: Floats,
) -> None:
    """Fill the loads by expressions of all six deviations, and add damping; the energy is unknown.

    Args:
        deviations: three angles (rad) and a translation (m) (6,).
        rates: rates of the deviations, rad/s and m/s (6,).
        loads: receives moments (N.m) and forces (N) (6,).
        damping: damping of each deviation (6,), N.m.s/rad and N.s/m.
        steps: steps of the six expressions.
        constants: constants of the six expressions.
        registers: registers of the expressions; the first six are the deviations.
    """
    for k in range(6):
        registers[k] = deviations[k]
    for k in range(6):
        # Each expression is preceded by its number of steps and the offset of its constants.
        loads[k] = run_program(at(steps, 2), steps[0], at(constants, steps[1]), registers, 6)
        steps = at(steps, 2 + 3 * steps[0])
    add_damping(loads, rates, damping)


register_force_type(
    ForceType(
        ExpressionBasedBushingForce,
        BetweenFrames(),
        compute_expression_bushing,
        parameters=(
            Vector(
                6, lambda builder, force: (*force.rotational_damping, *force.translational_damping)
            ),
            Expressions(
                tuple(f"{load}_expression" for load in ("Mx", "My", "Mz", "Fx", "Fy", "Fz")),
                DEVIATION_NAMES,
            ),
        ),
    )
)
