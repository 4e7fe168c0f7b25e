"""Compare the numbers in findings about paths and muscles with OpenSim's."""

from __future__ import annotations

import pytest

pytestmark = pytest.mark.oracle
pytest.importorskip("opensim")


@pytest.mark.parametrize("code", ["OSIM631", "OSIM632", "OSIM633", "OSIM634", "OSIM635", "OSIM636"])
def test_what_is_told_is_what_opensim_gives(code, fixtures):
    from tests.oracle.opensim_measures import Beside

    (file,) = (fixtures / "lint" / code).glob("fail-02-*")
    rows = [(told, result) for of, _, told, result in Beside(file).findings() if of == code]
    assert rows
    assert [told for told, _ in rows] == pytest.approx(
        [result for _, result in rows], rel=1e-9, abs=1e-12
    )
