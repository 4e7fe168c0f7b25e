"""Exact Hessian of the Lagrangian of a nonlinear program."""

from __future__ import annotations

import numpy as np

from osimlite.derivatives.symbols import casadi, postpone_interrupts, raise_interrupt
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

    @postpone_interrupts()
    def __init__(self, program: Program) -> None:
        self.program = program
        width = len(program.layout.lower)
        for group in program.groups:
            raise_interrupt()
            group.make_hessian()
        rows, columns = program._list_entries("hessian_rows", "hessian_columns")
        # E depends on the variables at both ends (`direct` of them), then on the integrals.
        direct = len(program.end_columns)
        pattern = program._end_hessian_pattern
        # The product of two integrals depends on each pair of points: a dense Hessian.
        if pattern[direct:, direct:].any():
            raise program.problem.make_unsupported_error(
                program.problem.solver,
                "a goal is not linear in its integral; set optim_hessian_approximation to limited-memory",
            )
        end_rows, end_columns = np.nonzero(np.triu(pattern[:direct, :direct]))
        end_rows, end_columns = np.sort(
            [program.end_columns[end_rows], program.end_columns[end_columns]], axis=0
        )
        self._ends = np.nonzero(np.triu(pattern[:direct, :direct]))
        # A term that depends on both an end and an integral couples that end with all points.
        self._mixed = [tuple(entry_pair) for entry_pair in np.argwhere(pattern[:direct, direct:])]
        integral_columns = [
            np.unique(program._jacobian_columns[program._jacobian_rows == program._row_count + k])
            for _, k in self._mixed
        ]
        self._integral_columns = integral_columns
        # Each pair is sorted, as an entry of the upper triangle has its row before its column.
        mixed_entries = [
            np.sort([np.full(len(column_indices), program.end_columns[i]), column_indices], axis=0)
            for (i, _), column_indices in zip(self._mixed, integral_columns, strict=True)
        ]
        entry_groups = [
            (rows, columns),
            (end_rows, end_columns),
            *((entry_pair[0], entry_pair[1]) for entry_pair in mixed_entries),
        ]
        # One integer per place, column by column as in CasADi's patterns: equal places of several
        # parts are added.
        keys = np.concatenate([c.astype(np.int64) * width + r for r, c in entry_groups])
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
        end_arguments = program._make_end_arguments(w, totals)
        multipliers_of_points = multipliers[: program._row_count]
        at_ends = multipliers[program._row_count :]
        cost, end_slopes = (array.T for array in program._end_slope(*end_arguments))
        # E is linear in the integrals: its derivative by an integral acts like the multiplier of
        # its row.
        of_integrals = factor * cost.ravel()[direct:] + at_ends @ end_slopes[:, direct:]
        row_multipliers = program._b.multiply_transpose(
            np.concatenate([multipliers_of_points, of_integrals])
        )
        entry_groups = []
        for group, first_row in zip(program.groups, program._offsets, strict=False):
            count = group.rows * len(group.numbers)
            entry_groups.append(
                group.curvature(
                    *program._make_point_arguments(group, w),
                    row_multipliers[first_row : first_row + count],
                )[0].ravel()
            )
        # The Hessian is symmetric, so that its upper triangle is enough.
        (end_hessian,) = program._end_curvature(*end_arguments, np.array(factor), at_ends)
        entry_groups.append(end_hessian[self._ends])
        if self._mixed:
            integrals = program._compute_slopes(w)[3]
            for (end_index, integral_index), integral_columns in zip(
                self._mixed, self._integral_columns, strict=True
            ):
                # The product rule gives both (i, j) and (j, i); on the diagonal both are one entry.
                factor_of_diagonal = np.where(
                    integral_columns == program.end_columns[end_index], 2.0, 1.0
                )
                entry_groups.append(
                    end_hessian[end_index, direct + integral_index]
                    * integrals[integral_index, integral_columns]
                    * factor_of_diagonal
                )
        return self._map @ np.concatenate(entry_groups)
