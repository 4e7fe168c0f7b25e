"""Constant sparse matrices that are multiplied by vectors.

The module has the few operations that a nonlinear program needs, with NumPy alone: importing
`scipy.sparse` takes a fifth of the time in which a small study is solved.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from osimlite.base.records import dataclass
from osimlite.mechanics.multibody.spatial import Array


@dataclass(frozen=True, eq=False)
class SparseMatrix:
    """Sparse matrix as a list of its entries, each once, row by row and column by column.

    Attributes:
        rows: row of each entry (k,).
        columns: column of each entry (k,).
        values: value of each entry (k,).
        shape: number of rows and of columns.
    """

    rows: NDArray[np.int64]
    columns: NDArray[np.int64]
    values: Array
    shape: tuple[int, int]

    @classmethod
    def from_entries(
        cls, rows: ArrayLike, columns: ArrayLike, values: ArrayLike, shape: tuple[int, int]
    ) -> SparseMatrix:
        """Return the matrix of some entries; entries with the same row and column are added.

        Args:
            rows: row of each entry (k,).
            columns: column of each entry (k,).
            values: value of each entry (k,).
            shape: number of rows and of columns.
        """
        width = max(shape[1], 1)
        keys = np.asarray(rows, dtype=np.int64) * width + np.asarray(columns, dtype=np.int64)
        positions, inverse = np.unique(keys, return_inverse=True)
        totals = np.bincount(inverse, np.asarray(values, dtype=float), len(positions))
        return cls(
            positions // width, positions % width, np.asarray(totals, dtype=np.float64), shape
        )

    def __matmul__(self, vector: Array) -> Array:
        """Return the product (rows,) with a vector (columns,)."""
        products = self.values * vector[self.columns]
        return np.asarray(np.bincount(self.rows, products, self.shape[0]), dtype=np.float64)

    def multiply_transpose(self, vector: Array) -> Array:
        """Return the product (columns,) of the transpose with a vector (rows,)."""
        products = self.values * vector[self.rows]
        return np.asarray(np.bincount(self.columns, products, self.shape[1]), dtype=np.float64)

    def select_columns(self, indices: NDArray[np.int64]) -> SparseMatrix:
        """Return the matrix of some columns, in their order.

        Args:
            indices: indices of the columns (c,); an index may occur several times.
        """
        order = np.argsort(self.columns, kind="stable")
        starts = np.searchsorted(self.columns[order], np.arange(self.shape[1] + 1))
        counts = (starts[1:] - starts[:-1])[indices]
        # In this order the entries of each column are adjacent.
        offsets = np.repeat(
            starts[:-1][indices] - np.concatenate([[0], np.cumsum(counts)[:-1]]), counts
        )
        selected = order[offsets + np.arange(counts.sum())]
        columns = np.repeat(np.arange(len(indices)), counts)
        return SparseMatrix.from_entries(
            self.rows[selected], columns, self.values[selected], (self.shape[0], len(indices))
        )
