"""Transcription schemes: equations between states, rates and controls within a mesh interval.

The schemes are those of Moco's ``CasOCTranscription``; see J. T. Betts, Practical Methods for
Optimal Control, 2010, and for Legendre's D. Garg et al., Automatica 46, 2010.
"""

from __future__ import annotations

import numpy as np

from osimlite.base.records import dataclass
from osimlite.derivatives.symbols import casadi
from osimlite.mechanics.multibody.spatial import Array


@dataclass(frozen=True, eq=False)
class Scheme:
    """Equations within an interval of n points, both ends included.

    Attributes:
        name: value of ``transcription_scheme``.
        fractions: positions of the points within the interval (n,), from 0 to 1.
        weights: quadrature weights of the points (n,), whose sum is 1.
        states: factors (k, n) of the states in the k equations that hold for each state.
        rates: factors (k, n) of the rates, times the duration of the interval, in these equations.
        controls: factors (j, n) of j equations that make controls linear between both ends.
    """

    name: str
    fractions: Array
    weights: Array
    states: Array
    rates: Array
    controls: Array


def make_scheme(name: str) -> Scheme:
    """Return the scheme with a name that the schema allows.

    Args:
        name: "trapezoidal", "hermite-simpson", or "legendre-gauss-3" and "legendre-gauss-radau-3"
            with any degree.
    """
    if name == "trapezoidal":
        # x1 - x0 = h (f0 + f1) / 2.
        weights = np.array([0.5, 0.5])
        return Scheme(
            name,
            np.array([0.0, 1.0]),
            weights,
            np.array([[-1.0, 1.0]]),
            -weights[None],
            np.zeros((0, 2)),
        )
    if name == "hermite-simpson":
        # Rows: the midpoint on Hermite's interpolant, and Simpson's rule over the interval.
        midpoint_row = [-0.5, 1.0, -0.5]
        simpson = np.array([1.0, 4.0, 1.0]) / 6.0
        states = np.array([midpoint_row, [-1.0, 0.0, 1.0]])
        rates = np.array([[-0.125, 0.0, 0.125], -simpson])
        return Scheme(
            name, np.array([0.0, 0.5, 1.0]), simpson, states, rates, np.array([midpoint_row])
        )
    family, _, degree = name.rpartition("-")
    return _make_legendre_scheme(name, int(degree), is_radau=family == "legendre-gauss-radau")


def _make_legendre_scheme(name: str, degree: int, is_radau: bool) -> Scheme:
    """Return the collocation at the roots of a Legendre polynomial.

    Args:
        name: value of ``transcription_scheme``.
        degree: degree of the polynomial: number of collocation points.
        is_radau: whether the end of the interval is a collocation point (Radau).
    """
    roots = casadi.collocation_points(degree, "radau" if is_radau else "legendre")
    slopes, end, weights = (
        np.array(coefficients) for coefficients in casadi.collocation_coeff(roots)
    )
    count = degree + (1 if is_radau else 2)
    fractions = np.array([0.0, *roots] if is_radau else [0.0, *roots, 1.0])
    states = np.zeros((degree, count))
    rates = np.zeros((degree, count))
    # At each collocation point the rate equals the slope of the polynomial through the start and
    # these points.
    states[:, : degree + 1] = -slopes.T
    rates[:, 1 : degree + 1] = np.eye(degree)
    if not is_radau:
        # Gauss points exclude the end, whose state is that of the polynomial there.
        end_row = np.zeros((1, count))
        end_row[0, : degree + 1] = -end.ravel()
        end_row[0, -1] = 1.0
        states = np.vstack([states, end_row])
        rates = np.vstack([rates, np.zeros((1, count))])
    # The quadrature is over the collocation points; the start of the interval has no weight.
    mean = np.zeros(count)
    mean[1 : degree + 1] = weights.ravel()
    inner_fractions = fractions[1:-1]
    controls = np.zeros((len(inner_fractions), count))
    # control(x) = (1 - x) first + x last at each inner point.
    controls[:, 0] = inner_fractions - 1.0
    controls[:, -1] = -inner_fractions
    controls[:, 1:-1] += np.eye(len(inner_fractions))
    return Scheme(name, fractions, mean, states, rates, controls)


@dataclass(frozen=True, eq=False)
class Grid:
    """All points of a motion.

    Attributes:
        scheme: transcription scheme of each interval.
        fractions: positions of the points in time (n,), from 0 at the start to 1 at the end.
        lengths: lengths of the intervals (m,), whose sum is 1.
        is_mesh: whether each point is an end of an interval (n,).
        weights: quadrature weights of the points over the motion (n,), whose sum is 1.
    """

    scheme: Scheme
    fractions: Array
    lengths: Array
    is_mesh: Array
    weights: Array

    @classmethod
    def from_mesh(cls, scheme: Scheme, mesh: Array) -> Grid:
        """Return the grid of a mesh.

        Args:
            scheme: transcription scheme.
            mesh: ends of the intervals (m + 1,), from 0 to 1.

        Returns:
            Grid, in which neighbouring intervals share the point between them.
        """
        lengths = np.diff(mesh)
        steps = len(scheme.fractions) - 1
        fractions = np.append(
            (mesh[:-1, None] + lengths[:, None] * scheme.fractions[:-1]).ravel(), 1.0
        )
        weights = np.zeros(len(fractions))
        for number, length in enumerate(lengths):
            # Added, as a point between two intervals has weights of both.
            weights[number * steps : (number + 1) * steps + 1] += length * scheme.weights
        return cls(scheme, fractions, lengths, np.arange(len(fractions)) % steps == 0, weights)

    def get_points(self, interval: int) -> range:
        """Return the indices of the points of an interval."""
        steps = len(self.scheme.fractions) - 1
        return range(interval * steps, (interval + 1) * steps + 1)
