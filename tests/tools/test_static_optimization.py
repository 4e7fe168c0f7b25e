"""Tests of StaticOptimization: exact solutions of the reference data, OpenSim's forces, and unsolvable problems."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest

import osimlite
from osimlite.io.tables.storage import StoTable, read_sto
from osimlite.tools.job import NotRunnable

ACTIVATION, FORCE = "walk_StaticOptimization_activation.sto", "walk_StaticOptimization_force.sto"


@pytest.fixture(scope="module")
def reference(shared: Path) -> Path:
    """Return the folder with setups, OpenSim's results, and exact solutions of the same quadratic problems."""
    return shared / "oracle" / "tools" / "reference"


@pytest.fixture
def walk(reference: Path, tmp_path: Path) -> Path:
    """Write the setup of a model with eighteen muscles, three residuals and seven reserves."""
    for name, source in {
        "subject01.osim": "models/gait10_subject01.osim.gz",
        "ExperimentalData/subject01_walk_grf.xml": "id_gait10/subject01_walk_grf.xml",
        "ExperimentalData/subject01_walk_grf.mot": "id_gait10/subject01_walk_grf.mot.gz",
        "IK/subject01_walk_IK.mot": "ik_gait10/subject01_walk_IK.mot",
        "gait10dof_Reserve_Actuators.xml": "so_gait10/gait10dof_Reserve_Actuators.xml",
        "SO/walk_Setup_SO.xml": "so_gait10/walk_Setup_SO.xml",
    }.items():
        content = (reference / source).read_bytes()
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(
            gzip.decompress(content) if source.endswith(".gz") else content
        )
    return tmp_path / "SO" / "walk_Setup_SO.xml"


def written(file: Path, tmp_path: Path) -> tuple[StoTable, list[str]]:
    """Read a compressed table of OpenSim.

    Args:
        file: the table.
        tmp_path: folder for the decompressed file.

    Returns:
        Table, and the lines before the numbers.
    """
    plain = tmp_path / file.name.removesuffix(".gz")
    plain.write_bytes(gzip.decompress(file.read_bytes()))
    table, lines = read_sto(plain), plain.read_text().splitlines()
    return table, lines[: lines.index("endheader") + 2]


def test_a_walk_is_solved_exactly(walk: Path, reference: Path, tmp_path: Path) -> None:
    exact = np.load(reference / "so_gait10" / "qp.npz")
    result = osimlite.run(walk)
    assert result.done
    x = result.tables[ACTIVATION].rows
    assert result.tables[ACTIVATION].columns == tuple(exact["names"])
    assert x == pytest.approx(exact["x"], abs=2e-5)
    assert x[:, :18] == pytest.approx(exact["x"][:, :18], abs=1e-6)
    assert (exact["lo"] <= x).all()
    assert (x <= exact["hi"]).all()
    # The equations are those of OpenSim's matrices, for accelerations of up to 9000 /s².
    assert np.einsum("tmn,tn->tm", exact["A"], x) == pytest.approx(exact["b"], abs=1e-9)
    theirs, head = written(reference / "so_gait10" / "activation.sto.gz", tmp_path)
    assert (np.sum(x**2, axis=1) <= np.sum(theirs.rows**2, axis=1)).all()
    assert (walk.parent / "Results" / ACTIVATION).read_text().splitlines()[: len(head)] == head
    forces, head = written(reference / "so_gait10" / "force.sto.gz", tmp_path)
    ours = result.tables[FORCE]
    assert (walk.parent / "Results" / FORCE).read_text().splitlines()[: len(head)] == head
    # Forces are proportional to activations, so they can be compared at OpenSim's activations.
    assert ours.rows[:, :18] / x[:, :18] * theirs.rows[:, :18] == pytest.approx(
        forces.rows[:, :18], abs=1e-8
    )
    assert ours.rows[:, 18:28] / x[:, 18:] * theirs.rows[:, 18:] == pytest.approx(
        forces.rows[:, 18:28], abs=1e-8
    )
    assert ours.rows[:, 28:] == pytest.approx(forces.rows[:, 28:], abs=1e-9)


def test_controls_are_those_that_a_controller_reads(walk: Path) -> None:
    result = osimlite.run(walk)
    document = osimlite.read_document(
        walk.parent / "Results" / "walk_StaticOptimization_controls.xml"
    )
    curves = {
        curve.name: [(node.t, node.value) for node in curve.x_nodes] for curve in document.objects
    }
    table = result.tables[ACTIVATION]
    assert list(curves) == list(table.columns)
    for name, nodes in curves.items():
        assert nodes == list(zip(table.times, table[name], strict=True))


def test_what_has_no_solution_is_told_and_not_written(walk: Path) -> None:
    reserves = walk.parents[1] / "gait10dof_Reserve_Actuators.xml"
    document = osimlite.read_document(reserves)
    for actuator in document.objects:
        if actuator.name == "knee_angle_r_reserve":
            actuator.min_control, actuator.max_control = -0.001, 0.001
    osimlite.write(document, reserves)
    model = osimlite.read(walk.parents[1] / "subject01.osim")
    for muscle in model.force_set.objects:
        if muscle.name in ("vasti_r", "rect_fem_r"):
            muscle.max_isometric_force = 1.0
    osimlite.write(model, walk.parents[1] / "subject01.osim")
    result = osimlite.run(walk, check=False)
    table, forces = result.tables[ACTIVATION], result.tables[FORCE]
    failed = np.isnan(table.rows).all(axis=1)
    assert not result.done
    assert 0 < np.count_nonzero(failed) < failed.size
    assert result.summary["StaticOptimization_unsolved"] == np.count_nonzero(failed)
    assert np.isnan(table.rows).any(axis=1).tolist() == failed.tolist()
    assert np.isnan(forces.rows[failed, :28]).all()
    assert "the actuators lack" in (said := dict(result.messages)["StaticOptimization"])
    assert "knee_angle_r" in said
    document = osimlite.read_document(
        walk.parent / "Results" / "walk_StaticOptimization_controls.xml"
    )
    assert {len(curve.x_nodes) for curve in document.objects} == {np.count_nonzero(~failed)}


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("<use_model_force_set>true", "<use_model_force_set>false", "OpenSim crashes without"),
        ("<activation_exponent>2", "<activation_exponent>1", "does not determine the activations"),
    ],
)
def test_what_cannot_be_asked(walk: Path, old: str, new: str, said: str) -> None:
    walk.write_text(walk.read_text().replace(old, new))
    with pytest.raises(osimlite.OsimliteError, match=said):
        osimlite.run(walk, check=False)
    assert not (walk.parent / "Results").exists()


def test_fewer_actuators_than_coordinates(walk: Path) -> None:
    text = walk.read_text().replace("<replace_force_set>false", "<replace_force_set>true")
    reserves = walk.parents[1] / "gait10dof_Reserve_Actuators.xml"
    document = osimlite.read_document(reserves)
    del document.objects[3:]
    osimlite.write(document, reserves)
    walk.write_text(text)
    with pytest.raises(osimlite.OsimliteError, match="3 actuators for 10 coordinates"):
        osimlite.run(walk, check=False)


def test_not_in_a_forward_tool(walk: Path) -> None:
    text = walk.read_text().replace("AnalyzeTool", "ForwardTool").replace("1.5", "0.501")
    walk.write_text(text)
    with pytest.raises(NotRunnable, match="needs a measured motion"):
        osimlite.run(walk, check=False)
