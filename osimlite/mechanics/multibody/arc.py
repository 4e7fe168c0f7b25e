"""A rod that bends evenly, as OpenSim's ConstantCurvatureJoint needs it."""

from __future__ import annotations

import math
from collections.abc import Sequence

from osimlite.base.records import dataclass
from osimlite.mechanics.kernels.constant_curvature import evaluate_arc
from osimlite.mechanics.kernels.functions import ARC
from osimlite.mechanics.multibody.functions import Arguments, Evaluated, Function, make_floats

_SERIES = [(-1.0) ** n / math.factorial(2 * n + first) for first in (1, 2) for n in range(16)]
"""Coefficients of the powers of θ² in (sin θ) / θ, then in (1 - cos θ) / θ²."""


@dataclass(frozen=True)
class ArcPoint(Function):
    """One component of the end of a rod that starts upright and bends evenly, as a function of its two end angles.

    The rod stands along Y; its end points along the Y axis that is turned first about X by one
    angle, then about the new Z by the other. Bent by θ in all, it is an arc of radius length / θ.
    """

    component: int  # 0 to 2
    length: float  # m
    neutral: tuple[float, float]  # what is added to the two arguments (rad)

    @property
    def table(self) -> Sequence[float]:
        """A bent rod."""
        return [
            ARC,
            1.0,
            float(self.component),
            self.length,
            *self.neutral,
            len(_SERIES) / 2.0,
            *_SERIES,
        ]

    def evaluate(self, arguments: Arguments) -> Evaluated:
        """Value, gradient (2,) and Hessian (2, 2) at the two angles."""
        one, two = (float(own + start) for own, start in zip(arguments, self.neutral, strict=True))
        value, a, b, aa, ab, bb = evaluate_arc(make_floats(self.table), one, two)
        return value, [a, b], [[aa, ab], [ab, bb]]
