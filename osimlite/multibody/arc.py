"""A rod that bends evenly: where its end is, with derivatives, as OpenSim's ConstantCurvatureJoint needs it."""

from __future__ import annotations

import math

import numpy as np

from osimlite.multibody.functions import Function
from osimlite.multibody.spatial import Array
from osimlite.records import dataclass

_TERMS = np.arange(16)
SINE_TERMS = (-1.0) ** _TERMS / np.array([math.factorial(2 * n + 1) for n in _TERMS.tolist()], dtype=float)
COSINE_TERMS = (-1.0) ** _TERMS / np.array([math.factorial(2 * n + 2) for n in _TERMS.tolist()], dtype=float)
"""Coefficients of the powers of θ² in (sin θ) / θ and (1 - cos θ) / θ²."""


@dataclass(frozen=True)
class ArcPoint(Function):
    """One component of the end of a rod that starts upright and bends evenly, as a function of its two end angles.

    The rod stands along Y; its end points along the Y axis that is turned first about X by one angle, then about the
    new Z by the other. Bent by θ in all, it is an arc of radius length / θ.
    """

    component: int  # 0 to 2
    length: float  # m
    neutral: tuple[float, float]  # what is added to the two arguments (rad)

    def evaluate(self, arguments: Array) -> tuple[float, Array, Array]:
        """Value, gradient (2,) and Hessian (2, 2) at the two angles."""
        a, b = float(arguments[0]) + self.neutral[0], float(arguments[1]) + self.neutral[1]
        sa, ca, sb, cb = math.sin(a), math.cos(a), math.sin(b), math.cos(b)
        upright = (ca * cb, np.array((-sa * cb, -ca * sb)), np.array(((-ca * cb, sa * sb), (sa * sb, -ca * cb))))
        share = _up_the_arc(upright[0]) if self.component == 1 else _across_the_arc(upright[0])
        outer = _composed(share, upright)
        if self.component == 0:
            part = (-sb, np.array((0.0, -cb)), np.array(((0.0, 0.0), (0.0, sb))))
        elif self.component == 2:
            part = (sa * cb, np.array((ca * cb, -sa * sb)), np.array(((-sa * cb, -ca * sb), (-ca * sb, -sa * cb))))
        else:
            part = (1.0, np.zeros(2), np.zeros((2, 2)))
        value, gradient, hessian = _multiplied(part, outer)
        return self.length * value, self.length * gradient, self.length * hessian


_Jet = tuple[float, Array, Array]
"""Value, gradient and Hessian."""


def _multiplied(one: _Jet, other: _Jet) -> _Jet:
    cross_terms = np.outer(one[1], other[1])
    return (
        one[0] * other[0],
        one[0] * other[1] + other[0] * one[1],
        one[0] * other[2] + other[0] * one[2] + cross_terms + cross_terms.T,
    )


def _composed(outer: tuple[float, float, float], inner: _Jet) -> _Jet:
    """A function of one number, given by value and two derivatives, of a function of several."""
    value, first, second = outer
    return value, first * inner[1], first * inner[2] + second * np.outer(inner[1], inner[1])


def _up_the_arc(cosine: float) -> tuple[float, float, float]:
    """Value and two derivatives by cos θ of (sin θ) / θ."""
    sine, _ = _series(cosine)
    return _by_cosine(sine, sine)


def _across_the_arc(cosine: float) -> tuple[float, float, float]:
    """Value and two derivatives by cos θ of (1 - cos θ) / (θ sin θ)."""
    sine, rest = _series(cosine)
    (h, h1, h2), (m, m1, m2) = sine, rest
    k, k1 = 1.0 / h, -h1 / h**2
    k2 = 2.0 * h1**2 / h**3 - h2 / h**2
    return _by_cosine((m * k, m1 * k + m * k1, m2 * k + 2.0 * m1 * k1 + m * k2), sine)


def _series(cosine: float) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """(sin θ) / θ and (1 - cos θ) / θ², each with two derivatives by θ²."""
    square = math.acos(max(-1.0, min(1.0, cosine))) ** 2
    powers = square**_TERMS
    both = []
    for terms in (SINE_TERMS, COSINE_TERMS):
        once, twice = _TERMS[1:] * terms[1:], (_TERMS[2:] * _TERMS[1:-1]) * terms[2:]
        both.append((float(terms @ powers), float(once @ powers[:-1]), float(twice @ powers[:-2])))
    return both[0], both[1]


def _by_cosine(jet: tuple[float, float, float], sine: tuple[float, float, float]) -> tuple[float, float, float]:
    """From derivatives by θ² to derivatives by cos θ, whose rate is -sin θ / (2 θ)."""
    value, first, second = jet
    h, h1, _ = sine
    rate, rate1 = -2.0 / h, 2.0 * h1 / h**2
    return value, rate * first, rate * (rate1 * first + rate * second)
