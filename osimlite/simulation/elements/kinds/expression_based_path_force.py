"""A tension along a path by a formula in stretch and lengthening speed; its energy is not known."""

from osimlite.mechanics.kernels.pointers import Floats, Ints
from osimlite.mechanics.kernels.programs import of_two
from osimlite.mechanics.laws.springs import stretch
from osimlite.schema.path_forces import ExpressionBasedPathForce
from osimlite.simulation.elements.geometries.path import PATH
from osimlite.simulation.elements.kind import Kind
from osimlite.simulation.elements.parameters import Expression


def tension(
    length: float,
    rate: float,
    l0: float,
    clamped: float,
    steps: Ints,
    constants: Floats,
    registers: Floats,
) -> float:
    """Tension."""
    return of_two(stretch(length, l0, clamped > 0.0), rate, steps, constants, registers)


KIND = Kind(
    ExpressionBasedPathForce,
    PATH,
    tension,
    outputs=("tension",),
    parameters=("resting_length", "clamp_stretch", Expression("expression", ("s", "ldot"))),
    labels={"{name}_tension": "tension"},
)
