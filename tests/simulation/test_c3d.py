"""Tests of forces from .c3d files: measurements of force plates, and external loads from them."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import osimlite
from osimlite.errors import DocumentError, MissingFileError
from osimlite.io.tables.c3d import read_c3d_forces
from osimlite.io.tables.storage import StoTable, write_sto
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.simulation.elements import external_loads
from osimlite.simulation.elements.external_loads import read_external_loads

pytest.importorskip("ezc3d", reason="needs ezc3d (extra 'c3d')")

TRIALS = Path(__file__).parents[2] / "fixtures" / "trials"
"""Trials of one marker over 5 frames at 100 Hz, with force plates at 1 kHz."""
LOADS = """<OpenSimDocument Version="40600">
    <ExternalLoads name="loads">
        <objects>
            <ExternalForce name="right">
                <applied_to_body>RightShank</applied_to_body>
                <force_expressed_in_body>ground</force_expressed_in_body>
                <point_expressed_in_body>ground</point_expressed_in_body>
                <force_identifier>f1_</force_identifier>
                <point_identifier>p1_</point_identifier>
                <torque_identifier>m1_</torque_identifier>
            </ExternalForce>
        </objects>
        <datafile>{file}</datafile>
    </ExternalLoads>
</OpenSimDocument>
"""


def measured() -> Any:
    """Return the measurements (6, 50) of the channels of the plate in `force_plate.c3d` (N and N·mm)."""
    steps = np.arange(50)
    return np.array(
        [10.0 + steps, 20.0 - steps, -700.0 - steps, 1e3 + steps, 2e3 - steps, 3e3 + 2 * steps]
    )


def test_forces_are_those_of_the_plate() -> None:
    """The plate faces downwards, 4 cm above its origin; moments are about the centre of its surface."""
    x, y, z, mx, my, mz = measured()
    table = read_c3d_forces(TRIALS / "force_plate.c3d")
    assert table.columns == tuple(f"{letter}1_{axis}" for letter in "fpm" for axis in "xyz")
    assert np.diff(table.times) == pytest.approx(0.001) and len(table.times) == 50
    assert table.rows[:, :3] == pytest.approx(np.stack((x, -y, -z), axis=1), rel=1e-6)
    assert table.rows[:, 3:6] == pytest.approx(np.tile((0.25, 0.2, 0.0), (50, 1)))
    about = np.stack((mx - 40.0 * y, -(my + 40.0 * x), -mz), axis=1) / 1000.0
    assert table.rows[:, 6:] == pytest.approx(about, rel=1e-5, abs=1e-5)


def test_loads_of_a_c3d_file_are_those_of_a_table(tmp_path: Path) -> None:
    shutil.copy(TRIALS / "force_plate.c3d", tmp_path / "trial.c3d")
    table = read_c3d_forces(tmp_path / "trial.c3d")
    write_sto(
        tmp_path / "trial.sto", "forces", table.times.tolist(), table.columns, table.rows.tolist()
    )
    mechanism, result = osimlite.mechanism(dynamic_walker()), []
    for file in ("trial.c3d", "trial.sto"):
        (tmp_path / "loads.xml").write_text(LOADS.format(file=file))
        (force,) = read_external_loads(mechanism, tmp_path / "loads.xml")
        load: Any = force.location
        result.append([f.derivatives(0.0123)[0] for f in (*load.force, *load.point, *load.torque)])
    assert result[0] == pytest.approx(result[1], rel=1e-12) and len(result[0]) == 9


def test_what_has_no_forces_is_told(tmp_path: Path) -> None:
    with pytest.raises(DocumentError, match="has no force plates"):
        read_c3d_forces(TRIALS / "no_plate.c3d")
    with pytest.raises(MissingFileError):
        read_c3d_forces(tmp_path / "none.c3d")
    (tmp_path / "torn.c3d").write_bytes(b"no file of motion capture")
    with pytest.raises(DocumentError, match="cannot be read"):
        read_c3d_forces(tmp_path / "torn.c3d")


def test_a_c3d_file_is_read_once_for_all_loads(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copy(TRIALS / "force_plate.c3d", tmp_path / "trial.c3d")
    paths = []

    def read(path: str) -> StoTable:
        paths.append(path)
        return read_c3d_forces(path)

    monkeypatch.setattr(external_loads, "read_c3d_forces", read)
    first, second = (external_loads.read_measured_times(tmp_path / "trial.c3d") for _ in range(2))
    assert len(paths) == 1
    assert first is second
