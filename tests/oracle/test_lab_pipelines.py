"""Pipelines of labs here and by OpenSim, live: what OpenSim runs is run, with the same numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import osimlite
from osimlite.io.tables.storage import read_sto, write_sto
from tests.labs import change, copy_lab, difference, run_opensim

pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

SECOND_MUSCLE = """<DeGrooteFregly2016Muscle name="quad"><max_isometric_force>900</max_isometric_force>
<optimal_fiber_length>0.1</optimal_fiber_length><tendon_slack_length>{slack}</tendon_slack_length>
<path><GeometryPath name="path"><PathPointSet><objects>
<PathPoint name="a"><socket_parent_frame>/bodyset/pelvis</socket_parent_frame><location>0.05 0 0</location></PathPoint>
<PathPoint name="b"><socket_parent_frame>/bodyset/shank</socket_parent_frame><location>0.05 -0.05 0</location>
</PathPoint></objects></PathPointSet></GeometryPath></path></DeGrooteFregly2016Muscle></objects></ForceSet>
<MarkerSet>"""
MUSCLES = {
    # A second muscle that always has an equilibrium.
    "one fails": ("</objects></ForceSet>\n<MarkerSet>", SECOND_MUSCLE.format(slack="0.35")),
    # One that has none at other times than the first.
    "both fail": ("</objects></ForceSet>\n<MarkerSet>", SECOND_MUSCLE.format(slack="0.51")),
}
REST = """<ForceReporter name="F"/><Actuation name="A"/><Kinematics name="K"/><StatesReporter name="S"/>
<JointReaction name="J"/><MuscleAnalysis name="M"/><BodyKinematics name="B"/></objects>"""


@pytest.mark.parametrize("which", [*MUSCLES])
def test_a_muscle_without_equilibrium(tmp_path: Path, which: str) -> None:
    """What does not depend on it is as in OpenSim; what does is NaN, where OpenSim takes any state of the fibers."""
    folder = copy_lab("unbalanced", tmp_path)
    change(folder / "leg.osim", MUSCLES[which])
    change(folder / "so.xml", ("</objects>", REST))
    ran, log = run_opensim(folder / "so.xml", folder / "theirs")
    assert ran
    assert "unable to equilibrate" in log
    result = osimlite.run(folder / "so.xml", folder / "ours")
    assert result.done
    gaps = {}
    for name, table in result.tables.items():
        theirs = read_sto(folder / "theirs" / name)
        assert table.columns == theirs.columns
        scale = max(1.0, float(np.abs(theirs.rows).max()))
        tolerance = 5e-3 if "StaticOptimization" in name else 1e-6
        # OpenSim's equilibria end at 1e-10 of a force, and its static optimization at 1e-4.
        assert difference(table, theirs) <= tolerance * scale, name
        gaps[name] = np.isnan(table.rows)
    missing = result.summary["without_equilibrium"]
    assert len(missing) == (2 if which == "both fail" else 1)
    calf = np.isin(np.round(table.times, 8), np.round(missing["/forceset/calf"], 8))
    quad = np.isin(np.round(table.times, 8), np.round(missing.get("/forceset/quad", []), 8))
    assert 0 < calf.sum() < len(calf)
    fibers = gaps["so_M_FiberLength.sto"]
    assert (fibers == np.stack([calf, quad], axis=1)).all()
    for name in ("so_M_Length.sto", "so_M_MomentArm_knee_angle.sto", "so_B_pos_global.sto", "so_B_vel_global.sto",
                 "so_K_q.sto", "so_K_u.sto", "so_A_speed.sto", "so_StaticOptimization_force.sto"):  # fmt: skip
        assert not gaps[name].any(), name
    either = (calf | quad)[:, None]
    for name in ("so_K_dudt.sto", "so_B_acc_global.sto"):
        assert (gaps[name] == either).all(), name
    forces = result.tables["so_F_forces.sto"]
    for column, rows in (
        ("calf", calf),
        ("quad", quad),
        ("hip_flexion_reserve", np.zeros_like(calf)),
    ):
        assert (np.isnan(forces[column]) == rows).all(), column
    words = [said for name, said in result.told if name == "no equilibrium"]
    for name, rows in (("calf", calf), ("quad", quad)):
        assert any(
            f"/forceset/{name}'" in said and f"at {rows.sum()} of 51 moments" in said
            for said in words
        ) == (rows.any())


def compare_runs(folder: Path, setup: str, tolerance: float = 2e-6) -> None:
    """Run a setup here and by OpenSim; every table is the same to parts of the largest number of a column."""
    ran, log = run_opensim(folder / setup, folder / "theirs")
    assert ran, log
    result = osimlite.run(folder / setup, folder / "ours")
    assert result.done, result.told
    assert result.tables
    for name, table in result.tables.items():
        if name.endswith("_states.sto"):
            # OpenSim prints these by another route whose header its own reader does not take.
            continue
        theirs = read_sto(folder / "theirs" / name)
        assert table.columns == theirs.columns
        assert np.allclose(table.times, theirs.times, atol=1e-8)
        scale = np.abs(theirs.rows).max(axis=0)
        assert (np.abs(table.rows - theirs.rows) <= tolerance * scale + 2e-6).all(), name


ROD = "</ConstantDistanceConstraint>"
COUPLER = (
    ROD
    + """<CoordinateCouplerConstraint name="both"><coupled_coordinates_function>
<LinearFunction name="f"><coefficients>1 0</coefficients></LinearFunction></coupled_coordinates_function>
<independent_coordinate_names>ja_q</independent_coordinate_names>
<dependent_coordinate_name>jb_q</dependent_coordinate_name></CoordinateCouplerConstraint>"""
)
LOOPS = {
    "as it is": [],
    "a longer rod": [
        ("<location_body_2>0 -0.3 0", "<location_body_2>0.1 -0.3 0"),
        ("<constant_distance>0.4", "<constant_distance>0.5"),
    ],
    "bars of two lengths": [
        ("<location_body_1>0 -0.3 0", "<location_body_1>0 -0.25 0"),
        ("<constant_distance>0.4", "<constant_distance>0.403112887414927"),
    ],
}


@pytest.mark.parametrize("loop", [*LOOPS])
@pytest.mark.full
def test_closed_loops_are_tracked(tmp_path: Path, loop: str) -> None:
    folder = copy_lab("loop", tmp_path)
    change(folder / "bars.osim", *LOOPS[loop])
    compare_runs(folder, "rra.xml" if loop != "as it is" else "rra2.xml")
    compare_runs(folder, "cmc.xml")


@pytest.mark.full
@pytest.mark.parametrize("setup", ["rra2.xml", "cmc.xml"])
def test_a_redundant_constraint_changes_nothing(tmp_path: Path, setup: str) -> None:
    """A coupler that the rod implies leaves the tables as they are without it.

    OpenSim's assembly of redundant constraints depends on the processor: with the same wheel it
    started at 13 degrees on one machine and at 0 on another.
    """
    tables = []
    for name, edits in (("rod", []), ("both", [(ROD, COUPLER)])):
        (tmp_path / name).mkdir()
        folder = copy_lab("loop", tmp_path / name)
        change(folder / "bars.osim", *edits)
        tables.append(osimlite.run(folder / setup, folder / "ours").tables)
    one, two = tables
    assert one
    assert one.keys() == two.keys()
    for name, table in one.items():
        assert np.allclose(table.rows, two[name].rows, rtol=0.0, atol=1e-6), name


@pytest.mark.parametrize("setup", ["rra.xml", "cmc.xml"])
def test_a_motion_off_the_constraints_is_tracked(tmp_path: Path, setup: str) -> None:
    """The first controls are those of the desired speeds, before the start is projected onto the constraints."""
    folder = copy_lab("loop", tmp_path)
    table = read_sto(folder / "walk.mot")
    rows = table.rows.copy()
    rows[:, 1] += 3.0 * np.sin(5.0 * table.times + 1.0)
    (folder / "walk.mot").unlink()
    write_sto(
        folder / "walk.mot",
        "m",
        table.times.tolist(),
        table.columns,
        rows.tolist(),
        in_degrees=True,
    )
    compare_runs(folder, setup)


LOCK = "<locked>true</locked>"
HELD = {
    "lock off the motion": [],
    "another lock": [
        (f'<Coordinate name="pelvis_tx">{LOCK}', '<Coordinate name="pelvis_tx">'),
        (
            '<Coordinate name="knee_angle"><default_value>0<',
            f'<Coordinate name="knee_angle">{LOCK}<default_value>-0.5<',
        ),
    ],
    "two locks": [('<Coordinate name="pelvis_tilt">', f'<Coordinate name="pelvis_tilt">{LOCK}')],
    "prescribed": [
        (
            f'<Coordinate name="pelvis_tx">{LOCK}',
            '<Coordinate name="pelvis_tx"><prescribed_function><LinearFunction name="f"><coefficients>0.3 0.2'
            "</coefficients></LinearFunction></prescribed_function><prescribed>true</prescribed>",
        )
    ],
}


@pytest.mark.parametrize("held", [*HELD])
def test_tasks_of_coordinates_that_are_held(tmp_path: Path, held: str) -> None:
    """Locks win over the file, and so does the function of a prescribed coordinate, at the time 0."""
    folder = copy_lab("locked", tmp_path)
    change(folder / "leg.osim", *HELD[held])
    change(folder / "rra.xml", ("<final_time>0.3<", "<final_time>0.22<"))
    compare_runs(folder, "rra.xml")


UNSEEN = {"in some frames": None, "in all frames": "ANK", "another in all": "KNE"}


@pytest.mark.parametrize("which", [*UNSEEN])
def test_marker_errors_where_a_marker_is_unseen(tmp_path: Path, which: str) -> None:
    """Sums and largest errors are of the markers that are seen, means of all."""
    folder = copy_lab("unseen", tmp_path)
    if marker := UNSEEN[which]:
        lines = (folder / "walk.trc").read_text().splitlines()
        place = 2 + 3 * [word for word in lines[3].split("\t")[2:] if word].index(marker)
        for number, line in enumerate(lines[5:], 5):
            cells = line.split("\t")
            if len(cells) > place:
                cells[place : place + 3] = [""] * 3
                lines[number] = "\t".join(cells)
        (folder / "walk.trc").write_text("\n".join(lines) + "\n")
    ran, log = run_opensim(folder / "ik.xml", folder / "theirs")
    assert ran, log
    ours = osimlite.run(folder / "ik.xml", folder / "ours").tables["ik_ik_marker_errors.sto"]
    assert np.isfinite(ours.rows).all()
    assert difference(ours, folder / "theirs" / "ik_ik_marker_errors.sto") < 2e-5
