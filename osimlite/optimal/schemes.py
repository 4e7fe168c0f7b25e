"""Schemes of transcription: how states, their rates and controls hang together within an interval of the mesh.

Moco's, as its ``CasOCTranscription`` has them; T. Betts, Practical Methods for Optimal Control,
2010, and for those of Legendre D. Garg et al., Automatica 46, 2010.
"""

from __future__ import annotations

import numpy as np

from osimlite.base.records import dataclass
from osimlite.derivatives.symbols import casadi
from osimlite.mechanics.multibody.spatial import Array


@dataclass(frozen=True, eq=False)
class Scheme:
    """What must hold within an interval that has n points, both of its ends included.

    Attributes:
        name: as in ``transcription_scheme``.
        fractions: of the points (n,), from 0 to 1.
        weights: (n,) with which values at the points make up the mean over the interval.
        states: (k, n) of k equations that are zero, each for every state.
        rates: (k, n) likewise, of the rates times the duration of the interval.
        controls: (j, n) of j equations that put controls on the line between those at both ends.
    """

    name: str
    fractions: Array
    weights: Array
    states: Array
    rates: Array
    controls: Array


def make_scheme(name: str) -> Scheme:
    """The scheme of a name that the schema allows."""
    if name == "trapezoidal":
        half = np.array([0.5, 0.5])
        return Scheme(
            name, np.array([0.0, 1.0]), half, np.array([[-1.0, 1.0]]), -half[None], np.zeros((0, 2))
        )
    if name == "hermite-simpson":
        between = [-0.5, 1.0, -0.5]
        simpson = np.array([1.0, 4.0, 1.0]) / 6.0
        states = np.array([between, [-1.0, 0.0, 1.0]])
        rates = np.array([[-0.125, 0.0, 0.125], -simpson])
        return Scheme(name, np.array([0.0, 0.5, 1.0]), simpson, states, rates, np.array([between]))
    family, _, degree = name.rpartition("-")
    return _make_legendre_scheme(name, int(degree), is_radau=family == "legendre-gauss-radau")


def _make_legendre_scheme(name: str, degree: int, is_radau: bool) -> Scheme:
    """Collocation at the roots of a polynomial of Legendre; Radau's has the end of the interval among them."""
    roots = casadi.collocation_points(degree, "radau" if is_radau else "legendre")
    slopes, end, weights = (np.array(part) for part in casadi.collocation_coeff(roots))
    count = degree + (1 if is_radau else 2)
    fractions = np.array([0.0, *roots] if is_radau else [0.0, *roots, 1.0])
    states, rates = np.zeros((degree, count)), np.zeros((degree, count))
    states[:, : degree + 1] = -slopes.T
    rates[:, 1 : degree + 1] = np.eye(degree)
    if not is_radau:
        last = np.zeros((1, count))
        last[0, : degree + 1], last[0, -1] = -end.ravel(), 1.0
        states, rates = np.vstack([states, last]), np.vstack([rates, np.zeros((1, count))])
    mean = np.zeros(count)
    mean[1 : degree + 1] = weights.ravel()
    inner = fractions[1:-1]
    controls = np.zeros((len(inner), count))
    controls[:, 0], controls[:, -1] = inner - 1.0, -inner
    controls[:, 1:-1] += np.eye(len(inner))
    return Scheme(name, fractions, mean, states, rates, controls)


@dataclass(frozen=True, eq=False)
class Grid:
    """All points of a motion.

    Attributes:
        scheme: of each interval.
        fractions: of the points (n,), from 0 at the start to 1 at the end.
        lengths: of the intervals (m,), which are one together.
        is_mesh: (n,) whether a point is an end of an interval.
        weights: (n,) with which values at the points make up the mean over the motion.
    """

    scheme: Scheme
    fractions: Array
    lengths: Array
    is_mesh: Array
    weights: Array

    @classmethod
    def from_mesh(cls, scheme: Scheme, mesh: Array) -> Grid:
        """The grid of a mesh, which begins with 0 and ends with 1."""
        lengths, steps = np.diff(mesh), len(scheme.fractions) - 1
        fractions = np.append(
            (mesh[:-1, None] + lengths[:, None] * scheme.fractions[:-1]).ravel(), 1.0
        )
        weights = np.zeros(len(fractions))
        for number, length in enumerate(lengths):
            weights[number * steps : (number + 1) * steps + 1] += length * scheme.weights
        return cls(scheme, fractions, lengths, np.arange(len(fractions)) % steps == 0, weights)

    def get_points(self, interval: int) -> range:
        """Numbers of the points of an interval."""
        steps = len(self.scheme.fractions) - 1
        return range(interval * steps, (interval + 1) * steps + 1)
