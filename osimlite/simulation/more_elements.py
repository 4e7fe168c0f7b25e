"""Which class of force has which element, but for those of :mod:`osimlite.simulation.elements` itself."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from osimlite.schema.springs import (
    ExpressionBasedCoordinateForce,
    ExpressionBasedPointToPointForce,
    PointToPointSpring,
    SpringGeneralizedForce,
)
from osimlite.simulation.elements import ElementBuilder, ForceElement
from osimlite.simulation.spring_elements import CoordinateFormula, CoordinateSpring, PointSpring

MAKERS: dict[type, Callable[[ElementBuilder, Any], ForceElement]] = {
    ExpressionBasedCoordinateForce: CoordinateFormula.of,
    ExpressionBasedPointToPointForce: PointSpring.of_formula,
    PointToPointSpring: PointSpring.of,
    SpringGeneralizedForce: CoordinateSpring.of,
}
