"""Springs, ligaments and expressions whose tension acts along a path."""

from collections.abc import Sequence

from osimlite.mechanics.kernels.functions import evaluate_function
from osimlite.mechanics.kernels.pointers import Floats, Ints
from osimlite.mechanics.kernels.programs import run_binary_program
from osimlite.mechanics.laws.springs import (
    blankevoort_energy,
    blankevoort_tension,
    path_spring_energy,
    path_spring_tension,
    path_stretch,
)
from osimlite.schema.path_forces import (
    Blankevoort1991Ligament,
    ClutchedPathSpring,
    ExpressionBasedPathForce,
    Ligament,
    PathSpring,
)
from osimlite.simulation.elements.force_type import DeclaredForce, ForceType, State
from osimlite.simulation.elements.geometries.path import PATH
from osimlite.simulation.elements.integral import integrate_function
from osimlite.simulation.elements.parameters import Curve, Expression, Number, require_positive
from osimlite.simulation.elements.registry import register_force_type


def compute_path_spring(
    length: float, rate: float, l0: float, k: float, d: float
) -> tuple[float, float]:
    """Return tension and energy of a spring along a path.

    Args:
        length: length of the path, m.
        rate: lengthening speed, m/s.
        l0: resting length, m.
        k: stiffness, N/m.
        d: dissipation, s/m.

    Returns:
        Tension (N) and energy (J).
    """
    return path_spring_tension(length, rate, l0, k, d), path_spring_energy(length, l0, k)


register_force_type(
    ForceType(
        PathSpring,
        PATH,
        compute_path_spring,
        outputs=("tension", "energy"),
        parameters=("resting_length", "stiffness", "dissipation"),
        labels={"{name}_tension": "tension"},
    )
)


MIN_ENGAGING_CONTROL = 2.0 ** (-52.0 * 7.0 / 8.0)
"""Controls up to this value do not engage the spring: Simbody's SignificantReal."""


def compute_clutched_spring(
    rate: float, control: float, stretch: float, k: float, d: float, relaxation: float
) -> tuple[float, float]:
    """Return the tension c k z (1 + d v) and the rate of the stretch z of a clutched spring.

    The rate is v while the clutch is engaged, and -z / relaxation otherwise.

    Args:
        rate: lengthening speed v of the path, m/s.
        control: c, limited to 0 to 1.
        stretch: z, m.
        k: stiffness, N/m.
        d: dissipation, s/m.
        relaxation: time constant, s.

    Returns:
        Tension (N) and rate of the stretch (m/s).
    """
    # OpenSim clamps the control of the clutch, and the stretch decays while the clutch is open.
    tension = min(max(control, 0.0), 1.0) * k * stretch * (1.0 + d * rate)
    return tension, rate if control > MIN_ENGAGING_CONTROL else -stretch / relaxation


def _require_nonnegative(name: str) -> Number:
    return Number(name, lambda value: value >= 0.0, "is negative; give it a value of at least 0")


register_force_type(
    ForceType(
        ClutchedPathSpring,
        PATH,
        compute_clutched_spring,
        inputs=("rate",),
        outputs=("tension", "stretch_rate"),
        parameters=(
            _require_nonnegative("stiffness"),
            _require_nonnegative("dissipation"),
            require_positive("relaxation_time_constant"),
        ),
        has_control=True,
        states=(State("stretch", lambda spring: spring.initial_stretch),),
        labels={"{name}": "tension"},
        states_change_when_off=True,
    )
)


def compute_ligament(length: float, l0: float, force: float, curve: Floats) -> tuple[float, float]:
    """Return the tension of a ligament, which is a force times a curve of the normalized length.

    Args:
        length: length of the path, m.
        l0: resting length, m.
        force: PCSA force, N.
        curve: factor over length / resting length.

    Returns:
        Tension (N), which is 0 up to the resting length, and length over resting length.
    """
    ratio = length / l0
    # `not >` also catches NaN.
    if not length > l0:
        return 0.0, ratio
    value, _, _ = evaluate_function(curve, ratio)
    return force * value, ratio


def _compute_ligament_energy(force: DeclaredForce, record: Sequence[float]) -> float:
    l0, largest, curve = force.values
    ratio = record[1]
    return float(largest * l0 * integrate_function(curve, 1.0, ratio)) if ratio > 1.0 else 0.0


register_force_type(
    ForceType(
        Ligament,
        PATH,
        compute_ligament,
        inputs=("length",),
        outputs=("tension", "ratio"),
        parameters=(require_positive("resting_length"), "pcsa_force", Curve("force_length_curve")),
        labels={"{name}": "tension"},
        compute_energy=_compute_ligament_energy,
    )
)


def compute_blankevoort_ligament(
    length: float, rate: float, l0: float, k: float, e1: float, c: float
) -> tuple[float, float, float, float, float, float, float, float]:
    """Return the tension of a ligament by Blankevoort and Huiskes, with its parts.

    Args:
        length: length of the path, m.
        rate: lengthening speed, m/s.
        l0: slack length, m.
        k: linear stiffness, N.
        e1: transition strain.
        c: damping coefficient, N.s (per strain rate).

    Returns:
        Tension and its elastic and damping parts (N), length (m) and rate (m/s), strain and its rate
        (1/s), energy (J).
    """
    tension = blankevoort_tension(length, rate, l0, k, e1, c)
    # The record reports the spring apart from the damper, whose part is the rest.
    elastic = blankevoort_tension(length, 0.0, l0, k, e1, c)
    energy = blankevoort_energy(length, l0, k, e1)
    return tension, elastic, tension - elastic, length, rate, length / l0 - 1.0, rate / l0, energy


register_force_type(
    ForceType(
        Blankevoort1991Ligament,
        PATH,
        compute_blankevoort_ligament,
        outputs=(
            "tension",
            "elastic",
            "damping",
            "length",
            "rate",
            "strain",
            "strain_rate",
            "energy",
        ),
        parameters=(
            require_positive("slack_length"),
            "linear_stiffness",
            "transition_strain",
            "damping_coefficient",
        ),
        labels={
            "{name}.force_spring": "elastic",
            "{name}.force_damping": "damping",
            "{name}.force_total": "tension",
            "{name}.length": "length",
            "{name}.lengthening_speed": "rate",
            "{name}.strain": "strain",
            "{name}.strain_rate": "strain_rate",
        },
    )
)


def compute_expression_tension(
    length: float,
    rate: float,
    l0: float,
    clamped: float,
    steps: Ints,
    constants: Floats,
    registers: Floats,
) -> float:
    """Return the tension by an expression of stretch and lengthening speed; the energy is unknown.

    Args:
        length: length of the path, m.
        rate: lengthening speed, m/s.
        l0: resting length, m.
        clamped: above 0 if a negative stretch counts as 0.
        steps: steps of the expression.
        constants: constants of the expression.
        registers: workspace of the expression: two variables and the result of each step.

    Returns:
        Tension, N.
    """
    return run_binary_program(
        path_stretch(length, l0, clamped > 0.0), rate, steps, constants, registers
    )


register_force_type(
    ForceType(
        ExpressionBasedPathForce,
        PATH,
        compute_expression_tension,
        outputs=("tension",),
        parameters=("resting_length", "clamp_stretch", Expression("expression", ("s", "ldot"))),
        labels={"{name}_tension": "tension"},
    )
)
