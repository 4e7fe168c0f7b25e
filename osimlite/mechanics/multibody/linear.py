"""Linear equations that may repeat or contradict each other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from osimlite.mechanics.kernels.linear_algebra import REDUNDANT, ROUNDING
from osimlite.mechanics.multibody.spatial import Array


def stack_equations(equations: Sequence[tuple[Array, Array]]) -> tuple[Array, Array]:
    """G (m, n) and b (m,) of several sets of equations in one."""
    return np.concatenate([rows for rows, _ in equations]), np.concatenate(
        [values for _, values in equations]
    )


def solve_with_null_space(rows: Array, values: Array) -> tuple[Array, Array]:
    """The shortest solution (n,) of `rows` (m, n) x = `values` (m,), and the directions (n, f) left free.

    Where equations contradict each other, the solution has the least squares of their errors, each
    equation counted with a left side of unit length; those that are rounding errors are left out.
    The directions are orthonormal.
    """
    count, size = rows.shape
    if not (count and size):
        return np.zeros(size), np.eye(size)
    lengths = np.linalg.norm(rows, axis=1)
    lengths[lengths <= ROUNDING * max(lengths.max(), 1.0)] = max(1.0, lengths.max())
    rows, values = rows / lengths[:, None], values / lengths
    if count <= size:
        basis, triangle = np.linalg.qr(rows.T, mode="complete")
        triangle = triangle[:count]
        if np.abs(triangle.diagonal()).min() > REDUNDANT:
            return basis[:, :count] @ np.linalg.solve(triangle.T, values), basis[:, count:]
    left, strengths, right = np.linalg.svd(rows)
    rank = int(np.sum(strengths > REDUNDANT * max(strengths[0], 1.0)))
    return right[:rank].T @ (left[:, :rank].T @ values / strengths[:rank]), right[rank:].T


def solve_least_norm(rows: Array, values: Array, tolerance: float) -> Array:
    """The shortest x (n,) for which `rows` (m, n) x comes nearest to `values` (m,).

    What the rows say in directions weaker than `tolerance` times the strongest counts for nothing.
    """
    return np.asarray(np.linalg.lstsq(rows, values, rcond=tolerance)[0], dtype=np.float64)
