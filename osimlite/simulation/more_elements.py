"""Which class of force has which element, but for those of :mod:`osimlite.simulation.elements` itself."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from osimlite.schema.springs import (
    BushingForce,
    ExpressionBasedBushingForce,
    ExpressionBasedCoordinateForce,
    ExpressionBasedPointToPointForce,
    FunctionBasedBushingForce,
    PointToPointSpring,
    SpringGeneralizedForce,
)
from osimlite.simulation.bushing_elements import Bushing
from osimlite.simulation.elements import ElementBuilder, ForceElement
from osimlite.simulation.spring_elements import CoordinateFormula, CoordinateSpring, PointSpring

MAKERS: dict[type, Callable[[ElementBuilder, Any], ForceElement]] = {
    BushingForce: Bushing.linear,
    ExpressionBasedBushingForce: Bushing.by_formulas,
    ExpressionBasedCoordinateForce: CoordinateFormula.of,
    ExpressionBasedPointToPointForce: PointSpring.of_formula,
    FunctionBasedBushingForce: Bushing.by_functions,
    PointToPointSpring: PointSpring.of,
    SpringGeneralizedForce: CoordinateSpring.of,
}
