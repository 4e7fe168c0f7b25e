"""M x = b for the mass matrix of a tree, written as straight-line code.

Two joints of which neither carries the other do not couple, and a factorisation M = Lᵀ D L that starts at the leaves
keeps those zeros (R. Featherstone, "Efficient factorization of the joint-space inertia matrix for branched kinematic
trees", International Journal of Robotics Research 24 (2005) 487-500). The code names no entry that is zero, and runs
on the nested tuples that an engine returns.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

Solver = Callable[[Sequence[Sequence[float]], Sequence[float], Sequence[float]], list[float]]

LARGEST_CODE = 20
"""Joints up to which code is written; its length grows with their cube, where no branch shortens it."""


class SingularMassError(ArithmeticError):
    """The mass matrix is not positive definite: `joint` moves no mass, or the matrix is not a number."""

    def __init__(self, joint: int) -> None:
        super().__init__(f"degree of freedom {joint} moves no mass")
        self.joint = joint


def tree_solver(parents: Sequence[int]) -> Solver:
    """The function of M (n, n), bias h (n) and forces t (n, or more) that returns M⁻¹ (t - h).

    Args:
        parents: for each of n joints the joint that carries it, which stands before it; -1 if none does.

    Raises:
        SingularMassError: (the function) M is not positive definite, or not a number.
    """
    size = len(parents)
    if size > LARGEST_CODE:
        return _solve_dense
    above = [list(_ancestors(parents, joint)) for joint in range(size)]
    lines = ["def solve(M, h, t):"]
    for row in range(size):
        lines.append(f"M{row} = M[{row}]")
        for column in (*above[row], row):
            lines.append(f"m{row}_{column} = M{row}[{column}]")
        lines.append(f"x{row} = t[{row}] - h[{row}]")
    for k in reversed(range(size)):
        lines.append(f"if not m{k}_{k} > 0.0: raise SingularMassError({k})")
        for place, i in enumerate(above[k]):
            lines.append(f"a = m{k}_{i} / m{k}_{k}")
            for j in (i, *above[k][place + 1 :]):
                lines.append(f"m{i}_{j} -= a*m{k}_{j}")
            lines.append(f"x{i} -= a*x{k}")
            lines.append(f"m{k}_{i} = a")
        lines.append(f"x{k} /= m{k}_{k}")
    for k in range(size):
        if above[k]:
            lines.append(f"x{k} -= {' + '.join(f'm{k}_{i}*x{i}' for i in above[k])}")
    lines.append(f"return [{', '.join(f'x{joint}' for joint in range(size))}]")
    scope: dict[str, Any] = {"SingularMassError": SingularMassError}
    exec("\n    ".join(lines), scope)
    solve: Solver = scope["solve"]
    return solve


def _solve_dense(M: Sequence[Sequence[float]], h: Sequence[float], t: Sequence[float]) -> list[float]:
    matrix, size = np.array(M), len(h)
    right = np.array(t[:size]) - np.array(h)
    try:
        np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError:
        raise SingularMassError(int(np.argmin(np.diag(matrix)))) from None
    solution: list[float] = np.linalg.solve(matrix, right).tolist()
    return solution


def _ancestors(parents: Sequence[int], joint: int) -> Sequence[int]:
    """The joints that carry a joint, the nearest first."""
    found = []
    while (joint := parents[joint]) >= 0:
        found.append(joint)
    return found
