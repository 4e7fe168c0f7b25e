"""Principal axes of inertia, so that no reader has to find them (Bullet does, to 1e-6 only)."""

from __future__ import annotations

from itertools import permutations

import numpy as np

from osimlite.mechanics.multibody.spatial import Array


def principal_axes(inertia: Array) -> tuple[Array, Array]:
    """Moments (3,) and axes (3, 3), as columns of a rotation matrix, with axes @ diag(moments) @ axes.T = inertia.

    A tensor that is diagonal already keeps its axes; otherwise they are numbered so that they turn
    least.
    """
    if not np.any(inertia - np.diag(np.diag(inertia))):
        return np.diag(inertia).copy(), np.eye(3)
    moments, axes = np.linalg.eigh(inertia)
    weights = np.abs(axes).tolist()
    order = list(
        max(
            permutations(range(3)),
            key=lambda p: sum(weights[row][place] for row, place in enumerate(p)),
        )
    )
    moments, axes = moments[order], axes[:, order]
    axes = axes * np.where(np.diag(axes) < 0.0, -1.0, 1.0)
    if np.linalg.det(axes) < 0.0:
        weakest = int(np.argmin(np.abs(np.diag(axes))))
        axes[:, weakest] *= -1.0
    return moments, axes


def breaks_triangle_rule(moments: Array) -> bool:
    """Whether one principal moment exceeds the sum of the others, or is negative: no body has such an inertia.

    Readers react differently (Bullet takes zero instead). A thin rod or plate, for which the rule
    holds with equality, passes up to rounding.
    """
    small, middle, large = np.sort(moments).tolist()
    return bool(small < 0.0 or large > (small + middle) * (1.0 + 1e-12))
