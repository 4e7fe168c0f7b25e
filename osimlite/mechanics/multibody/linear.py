"""Linear equations that may be redundant or contradictory."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from osimlite.mechanics.kernels.linear_algebra import REDUNDANCY_TOLERANCE, ROUNDING
from osimlite.mechanics.multibody.spatial import Array


def stack_equations(equations: Sequence[tuple[Array, Array]]) -> tuple[Array, Array]:
    """Stack several sets of equations.

    Args:
        equations: left and right sides of each set.

    Returns:
        Matrix G (m, n) and right sides b (m,) of all equations.
    """
    return np.concatenate([rows for rows, _ in equations]), np.concatenate(
        [values for _, values in equations]
    )


def solve_with_null_space(rows: Array, values: Array) -> tuple[Array, Array]:
    """Solve equations by the shortest least-squares solution.

    Each equation is weighted to a left side of unit length; equations that are rounding errors are
    omitted.

    Args:
        rows: left sides (m, n).
        values: right sides (m,).

    Returns:
        The solution (n,), and an orthonormal basis of the null space (n, f).
    """
    count, size = rows.shape
    if not (count and size):
        return np.zeros(size), np.eye(size)
    lengths = np.linalg.norm(rows, axis=1)
    # An equation of rounding errors is scaled down instead of up, so that it does not count.
    lengths[lengths <= ROUNDING * max(lengths.max(), 1.0)] = max(1.0, lengths.max())
    rows = rows / lengths[:, None]
    values = values / lengths
    # Independent equations are solved by a QR factorization, which is faster than the SVD.
    if count <= size:
        basis, triangle = np.linalg.qr(rows.T, mode="complete")
        triangle = triangle[:count]
        if np.abs(triangle.diagonal()).min() > REDUNDANCY_TOLERANCE:
            return basis[:, :count] @ np.linalg.solve(triangle.T, values), basis[:, count:]
    left_vectors, singular_values, right_vectors = np.linalg.svd(rows)
    rank = int(np.sum(singular_values > REDUNDANCY_TOLERANCE * max(singular_values[0], 1.0)))
    return right_vectors[:rank].T @ (
        left_vectors[:, :rank].T @ values / singular_values[:rank]
    ), right_vectors[rank:].T


def solve_least_norm(rows: Array, values: Array, tolerance: float) -> Array:
    """Return the shortest x (n,) for which `rows` x comes nearest to `values`.

    Args:
        rows: matrix (m, n).
        values: right-hand sides (m,).
        tolerance: singular values below this part of the largest one count as zero.
    """
    return np.asarray(np.linalg.lstsq(rows, values, rcond=tolerance)[0], dtype=np.float64)
