"""End of a rod that bends with constant curvature, for OpenSim's ConstantCurvatureJoint."""

from __future__ import annotations

import math
from collections.abc import Sequence

from osimlite.base.records import dataclass
from osimlite.mechanics.kernels.constant_curvature import evaluate_arc
from osimlite.mechanics.kernels.functions import FUNCTION_TYPE
from osimlite.mechanics.multibody.functions import (
    Arguments,
    FunctionDerivatives,
    SmoothFunction,
    make_floats,
)

# 16 terms are exact in double precision for angles up to half a turn.
_SERIES = [(-1.0) ** n / math.factorial(2 * n + first) for first in (1, 2) for n in range(16)]
"""Coefficients of the powers of θ² in (sin θ) / θ, then in (1 - cos θ) / θ²."""


@dataclass(frozen=True)
class ArcPoint(SmoothFunction):
    """One component of the end of a rod with constant curvature, as a function of two angles.

    The unbent rod stands along Y from the origin. Its end points along the Y axis that is rotated
    first about X by the first angle a, then about the new Z by the second angle b. With the total
    angle θ, cos θ = cos a cos b, the rod is an arc of radius length / θ.
    """

    component: int  # component of the position of the end: 0, 1 or 2
    length: float  # length of the rod, m
    neutral: tuple[float, float]  # angles that are added to the two arguments, rad

    @property
    def table(self) -> Sequence[float]:
        """Table of the function: component, length, neutral angles and the series."""
        return [
            FUNCTION_TYPE.ARC,
            1.0,
            float(self.component),
            self.length,
            *self.neutral,
            len(_SERIES) / 2.0,
            *_SERIES,
        ]

    def evaluate(self, arguments: Arguments) -> FunctionDerivatives:
        """Return the value, the gradient (2,) and the Hessian (2, 2) at the two angles (rad)."""
        first_angle, second_angle = (
            float(angle + start) for angle, start in zip(arguments, self.neutral, strict=True)
        )
        value, a, b, aa, ab, bb = evaluate_arc(make_floats(self.table), first_angle, second_angle)
        return value, [a, b], [[aa, ab], [ab, bb]]
