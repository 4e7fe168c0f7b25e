"""Exact Hessian of the Lagrangian of a nonlinear program."""

from __future__ import annotations

import numpy as np

from osimlite.derivatives.symbols import casadi
from osimlite.mechanics.multibody.spatial import Array
from osimlite.optimal.program import Program
from osimlite.optimal.sparse import SparseMatrix


class Hessian:
    """Upper triangle of the second derivatives of ``factor f + multipliers · g``, which CasADi's Ipopt reads.

    Args:
        program: nonlinear program.

    Attributes:
        program: nonlinear program.
        sparsity: sparsity pattern of the result of `compute_entries`.

    Raises:
        UnsupportedError: a goal is not linear in its integral, which would couple all points.
    """

    def __init__(self, program: Program) -> None:
        self.program = program
        width = len(program.layout.lower)
        for group in program.groups:
            group.make_hessian()
        rows, columns = program._entries("hessian_rows", "hessian_columns")
        # E depends on the variables at both ends (`direct` of them), then on the integrals.
        direct = len(program.end_columns)
        pattern = program._end_hessian_pattern
        # The product of two integrals depends on each pair of points: a dense Hessian.
        if pattern[direct:, direct:].any():
            raise program.problem.unsupported_error(
                program.problem.solver,
                "a goal is not linear in its integral; set optim_hessian_approximation to limited-memory",
            )
        inner, outer = np.nonzero(np.triu(pattern[:direct, :direct]))
        inner, outer = np.sort([program.end_columns[inner], program.end_columns[outer]], axis=0)
        self._ends = np.nonzero(np.triu(pattern[:direct, :direct]))
        # A term that depends on both an end and an integral couples that end with all points.
        self._mixed = [tuple(pair) for pair in np.argwhere(pattern[:direct, direct:])]
        far = [
            np.unique(program._jacobian_columns[program._jacobian_rows == program._row_count + k])
            for _, k in self._mixed
        ]
        self._far = far
        # Each pair is sorted, as an entry of the upper triangle has its row before its column.
        near = [
            np.sort([np.full(len(each), program.end_columns[i]), each], axis=0)
            for (i, _), each in zip(self._mixed, far, strict=True)
        ]
        parts = [(rows, columns), (inner, outer), *((pair[0], pair[1]) for pair in near)]
        # One integer per place, column by column as in CasADi's patterns: equal places of several
        # parts are added.
        keys = np.concatenate([c.astype(np.int64) * width + r for r, c in parts])
        unique, inverse = np.unique(keys, return_inverse=True)
        self._map = SparseMatrix.from_entries(
            inverse, np.arange(len(keys)), np.ones(len(keys)), (len(unique), len(keys))
        )
        self.sparsity = casadi.Sparsity.triplet(
            width, width, (unique % width).tolist(), (unique // width).tolist()
        )

    def compute_entries(self, w: Array, factor: float, multipliers: Array) -> Array:
        """Compute the entries of the upper triangle.

        Args:
            w: variables (n,).
            factor: factor of the objective.
            multipliers: multipliers of the constraints (m,).

        Returns:
            Entries in the order of `sparsity`.
        """
        program = self.program
        direct = len(self.program.end_columns)
        totals = program._compute_rows(w)[program._row_count :]
        end_arguments = program._end_arguments(w, totals)
        multipliers_of_points = multipliers[: program._row_count]
        at_ends = multipliers[program._row_count :]
        cost, end_slopes = (part.T for part in program._end_slope(*end_arguments))
        # E is linear in the integrals: its derivative by an integral acts like the multiplier of
        # its row.
        of_integrals = factor * cost.ravel()[direct:] + at_ends @ end_slopes[:, direct:]
        row_multipliers = program._b.multiply_transpose(
            np.concatenate([multipliers_of_points, of_integrals])
        )
        parts = []
        for group, first in zip(program.groups, program._offsets, strict=False):
            count = group.rows * len(group.numbers)
            parts.append(
                group.curvature(
                    *program._point_arguments(group, w), row_multipliers[first : first + count]
                )[0].ravel()
            )
        # The Hessian is symmetric, so that its upper triangle is enough.
        (ends,) = program._end_curvature(*end_arguments, np.array(factor), at_ends)
        parts.append(ends[self._ends])
        if self._mixed:
            integrals = program._compute_slopes(w)[3]
            for (i, k), far in zip(self._mixed, self._far, strict=True):
                # The product rule gives both (i, j) and (j, i); on the diagonal both are one entry.
                twice = np.where(far == program.end_columns[i], 2.0, 1.0)
                parts.append(ends[i, direct + k] * integrals[k, far] * twice)
        return self._map @ np.concatenate(parts)
