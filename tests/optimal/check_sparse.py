"""Tests of constant sparse matrices: they multiply as dense ones do."""

from __future__ import annotations

import numpy as np
import pytest

from osimlite.optimal.sparse import SparseMatrix


@pytest.mark.parametrize(
    ("count", "shape"), [(0, (3, 4)), (30, (7, 5)), (200, (40, 60)), (5, (6, 1))]
)
def test_products(count: int, shape: tuple[int, int]) -> None:
    rng = np.random.default_rng(count)
    rows, columns = (rng.integers(0, size, count) for size in shape)
    values = rng.normal(size=count)
    full = np.zeros(shape)
    np.add.at(full, (rows, columns), values)
    matrix = SparseMatrix.from_entries(rows, columns, values, shape)
    x, y = rng.normal(size=shape[1]), rng.normal(size=shape[0])
    assert matrix @ x == pytest.approx(full @ x, abs=1e-13)
    assert matrix.multiply_transpose(y) == pytest.approx(full.T @ y, abs=1e-13)
    # Each entry occurs once, and entries are ordered by rows.
    places = matrix.rows * shape[1] + matrix.columns
    assert (np.diff(places) > 0).all()
    chosen = rng.integers(0, shape[1], 9)
    selected = matrix.select_columns(chosen)
    assert selected.shape == (shape[0], 9)
    z = rng.normal(size=9)
    assert selected @ z == pytest.approx(full[:, chosen] @ z, abs=1e-13)
