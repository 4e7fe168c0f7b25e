"""A ligament by Blankevoort and Huiskes."""

from osimlite.mechanics.laws.springs import blankevoort_energy, blankevoort_tension
from osimlite.schema.path_forces import Blankevoort1991Ligament
from osimlite.simulation.elements.geometries.path import PATH
from osimlite.simulation.elements.kind import Kind
from osimlite.simulation.elements.parameters import positive


def ligament(
    length: float, rate: float, l0: float, k: float, e1: float, c: float
) -> tuple[float, float, float, float, float, float, float, float]:
    """Tension and its two parts, length and strain with their rates, energy."""
    tension = blankevoort_tension(length, rate, l0, k, e1, c)
    elastic = blankevoort_tension(length, 0.0, l0, k, e1, c)
    energy = blankevoort_energy(length, l0, k, e1)
    return tension, elastic, tension - elastic, length, rate, length / l0 - 1.0, rate / l0, energy


KIND = Kind(
    Blankevoort1991Ligament,
    PATH,
    ligament,
    outputs=("tension", "elastic", "damping", "length", "rate", "strain", "strain_rate", "energy"),
    parameters=(
        positive("slack_length"),
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
