"""Check tables in the format that OpenSim's tools print."""

from __future__ import annotations

import numpy as np
import pytest

from osimlite.io.tables.old_storage import format_old_table
from osimlite.io.tables.storage import StoTable

RNG = np.random.default_rng(7)
PLAIN = RNG.normal(0.0, 100.0, (300, 7))
# Numbers at the limits of rounding and of the width of a column.
ODD = np.array(
    [[0.0, -0.0, -1e-9, 1e-320, 0.99999999499999, 9998.999999999, np.nextafter(9999.0, 0.0)]]
)
TABLES = {
    "plain": PLAIN,
    "of all sizes": PLAIN * 10.0 ** RNG.uniform(-13.0, 4.9, PLAIN.shape),
    "ties in binary": RNG.integers(-(10**6), 10**6, PLAIN.shape) / 512.0,
    "ties behind": RNG.integers(-(2**40), 2**40, PLAIN.shape) / 2.0**17,
    "carried far": 1.0 - 2.0 ** RNG.uniform(-55.0, -40.0, PLAIN.shape),
    "whole eights": np.round(RNG.uniform(0.0, 1.0, PLAIN.shape), 8),
    "nearly ties": np.round(PLAIN, 8) + 5e-9,
    "edges": np.vstack([ODD, -ODD]),
    "no numbers": np.array([[np.nan, np.inf, -np.inf, 1.0, -2.0, 12345.678, -9999.0]]),
    "wide": PLAIN * 1e6,
    "long": np.tile(PLAIN, (10, 1)),
    "no rows": PLAIN[:0],
    "no columns": PLAIN[:, :0],
}


@pytest.mark.parametrize("precision", [16, 8, 5])
@pytest.mark.parametrize("name", TABLES)
def test_every_number_is_as_its_format_writes_it(name: str, precision: int) -> None:
    rows = TABLES[name]
    table = StoTable(
        "a table", np.arange(len(rows)) / 60.0, tuple("abcdefg"[: rows.shape[1]]), rows
    )
    text = "".join(format_old_table(table, precision=precision))
    line = "\t".join([f"%{8 + precision}.{precision}f"] * (1 + rows.shape[1])) + "\n"
    expected = "".join(
        line % (time, *row) for time, row in zip(table.times.tolist(), rows.tolist(), strict=True)
    )
    assert text.partition("endheader\n")[2].partition("\n")[2] == expected


def test_the_header_counts_rows_and_columns() -> None:
    table = StoTable("a table", np.zeros(1), ("a", "b"), np.zeros((1, 2)), in_degrees=True)
    head = "a table\nversion=1\nnRows=1\nnColumns=3\ninDegrees=yes\nwords\nendheader\ntime\ta\tb\n"
    assert "".join(format_old_table(table, "words")).startswith(head)
