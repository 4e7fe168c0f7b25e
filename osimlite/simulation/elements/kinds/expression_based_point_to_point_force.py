"""A force between two points by a formula, positive where it pulls; its energy is not known."""

from osimlite.mechanics.kernels.programs import of_two
from osimlite.schema.springs import ExpressionBasedPointToPointForce
from osimlite.simulation.elements.geometries.line import BetweenPoints
from osimlite.simulation.elements.kind import Kind
from osimlite.simulation.elements.parameters import Expression

KIND = Kind(
    ExpressionBasedPointToPointForce,
    BetweenPoints(("body1", "body2"), as_written=True),
    of_two,
    outputs=("tension",),
    parameters=(Expression("expression", ("d", "ddot")),),
)
