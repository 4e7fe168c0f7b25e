"""Projection of an impossible inertia onto the nearest possible one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations

Inertia = tuple[float, float, float, float, float, float]
_EDGES = ((0.0, 1.0, 1.0), (1.0, 0.0, 1.0), (1.0, 1.0, 0.0))
"""Principal moments of mass that lies on one principal axis: every possible inertia is a mixture of these."""


def find_possible_inertia(inertia: Sequence[float]) -> Inertia:
    """Return the nearest inertia (xx yy zz xy xz yz) whose principal moments obey the triangle inequality.

    Nearest in the Frobenius norm: the principal axes stay, and the principal moments are projected
    onto the cone of those that some distribution of mass has.
    """
    moments, axes = compute_principal_axes(inertia)
    nearest = _project_onto_cone(moments)

    def entry(row: int, column: int) -> float:
        return sum(nearest[k] * axes[row][k] * axes[column][k] for k in range(3))

    return entry(0, 0), entry(1, 1), entry(2, 2), entry(0, 1), entry(0, 2), entry(1, 2)


def compute_principal_axes(inertia: Sequence[float]) -> tuple[list[float], list[list[float]]]:
    """Compute principal moments and axes by Jacobi rotations (J. reine angew. Math. 30).

    Returns:
        The three moments, and a matrix whose columns are their axes.
    """
    xx, yy, zz, xy, xz, yz = inertia
    a = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
    v = [[float(row == column) for column in range(3)] for row in range(3)]
    size = max(abs(number) for row in a for number in row)
    for _ in range(50):
        p, q = max(((0, 1), (0, 2), (1, 2)), key=lambda pair: abs(a[pair[0]][pair[1]]))
        if abs(a[p][q]) <= 1e-17 * size:
            break
        angle = 0.5 * math.atan2(2 * a[p][q], a[q][q] - a[p][p])
        c, s = math.cos(angle), math.sin(angle)
        for row in range(3):
            a[row][p], a[row][q] = c * a[row][p] - s * a[row][q], s * a[row][p] + c * a[row][q]
        for column in range(3):
            a[p][column], a[q][column] = (
                c * a[p][column] - s * a[q][column],
                s * a[p][column] + c * a[q][column],
            )
        for row in range(3):
            v[row][p], v[row][q] = c * v[row][p] - s * v[row][q], s * v[row][p] + c * v[row][q]
    return [a[k][k] for k in range(3)], v


def _project_onto_cone(moments: Sequence[float]) -> list[float]:
    """Return the point of the cone nearest to `moments`, by trying every face."""
    best = [0.0, 0.0, 0.0]
    least_distance = math.inf
    faces = [face for count in range(4) for face in combinations(_EDGES, count)]
    for face in faces:
        weights = _solve_weights(face, moments)
        if min(weights, default=0.0) < -1e-15 * max(map(abs, moments)):
            continue
        point = [
            sum(weight * edge[k] for weight, edge in zip(weights, face, strict=True))
            for k in range(3)
        ]
        distance = math.dist(point, moments)
        if distance < least_distance:
            best, least_distance = point, distance
    return best


def _solve_weights(face: Sequence[Sequence[float]], moments: Sequence[float]) -> list[float]:
    """Return the weights of the edges whose combination is nearest to `moments`; they may be negative."""
    # Any two edges have the scalar product 1, and each has 2 with itself: the normal equations are
    # solved at once.
    products = [sum(a * b for a, b in zip(edge, moments, strict=True)) for edge in face]
    correction = sum(products) / (len(face) + 1) if face else 0.0
    return [product - correction for product in products]
