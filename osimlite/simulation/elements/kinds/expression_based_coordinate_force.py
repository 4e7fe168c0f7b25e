"""A force on a coordinate by a formula; its energy is not known."""

from osimlite.mechanics.kernels.programs import of_two
from osimlite.schema.springs import ExpressionBasedCoordinateForce
from osimlite.simulation.elements.geometries.coordinate import COORDINATE
from osimlite.simulation.elements.kind import Kind
from osimlite.simulation.elements.parameters import Expression

KIND = Kind(
    ExpressionBasedCoordinateForce,
    COORDINATE,
    of_two,
    outputs=("force",),
    parameters=(Expression("expression", ("q", "qdot")),),
    labels={"{name}": "force"},
)
