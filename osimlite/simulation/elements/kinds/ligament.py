"""A ligament: a force times a curve of the length over the resting length, beyond that."""

from collections.abc import Sequence

from osimlite.mechanics.kernels.functions import value_at
from osimlite.mechanics.kernels.pointers import Floats
from osimlite.schema.path_forces import Ligament
from osimlite.simulation.elements.geometries.path import PATH
from osimlite.simulation.elements.integral import integral
from osimlite.simulation.elements.kind import DeclaredForce, Kind
from osimlite.simulation.elements.parameters import Curve, positive


def ligament(length: float, l0: float, force: float, curve: Floats) -> tuple[float, float]:
    """Tension, and length over resting length."""
    ratio = length / l0
    if not length > l0:
        return 0.0, ratio
    value, _, _ = value_at(curve, ratio)
    return force * value, ratio


def _energy(force: DeclaredForce, record: Sequence[float]) -> float:
    l0, largest, curve = force.values
    ratio = record[1]
    return float(largest * l0 * integral(curve, 1.0, ratio)) if ratio > 1.0 else 0.0


KIND = Kind(
    Ligament,
    PATH,
    ligament,
    inputs=("length",),
    outputs=("tension", "ratio"),
    parameters=(positive("resting_length"), "pcsa_force", Curve("force_length_curve")),
    labels={"{name}": "tension"},
    stored=_energy,
)
