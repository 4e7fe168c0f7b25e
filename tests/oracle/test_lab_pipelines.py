"""Compare complete pipelines of setups, as laboratories have them, with a live OpenSim.

Whatever OpenSim runs must run, with the same numbers.
"""

from __future__ import annotations

import re
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
# Replacement in the model that adds a second muscle.
MUSCLES = {
    # The second muscle has an equilibrium at all times.
    "one fails": ("</objects></ForceSet>\n<MarkerSet>", SECOND_MUSCLE.format(slack="0.35")),
    # The second muscle has no equilibrium at some times, other than those of the first muscle.
    "both fail": ("</objects></ForceSet>\n<MarkerSet>", SECOND_MUSCLE.format(slack="0.51")),
}
REST = """<ForceReporter name="F"/><Actuation name="A"/><Kinematics name="K"/><StatesReporter name="S"/>
<JointReaction name="J"/><MuscleAnalysis name="M"/><BodyKinematics name="B"/></objects>"""


@pytest.mark.parametrize("which", [*MUSCLES])
def test_a_muscle_without_equilibrium(tmp_path: Path, which: str) -> None:
    """Results that do not depend on the muscle agree with OpenSim; the others are NaN.

    OpenSim computes the others with arbitrary states of the fibers.
    """
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
        # OpenSim stops at 1e-10 of a force in the equilibrium, and at 1e-4 in static optimization.
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
    words = [said for name, said in result.messages if name == "no equilibrium"]
    for name, rows in (("calf", calf), ("quad", quad)):
        assert any(
            f"/forceset/{name}'" in said and f" {rows.sum()} of 51 times" in said for said in words
        ) == (rows.any())


def compare_runs(folder: Path, setup: str, tolerance: float = 2e-6) -> None:
    """Run a setup with osimlite and OpenSim and compare every table.

    Args:
        folder: folder of the setup; results are written to its subfolders ``ours`` and ``theirs``.
        setup: name of the setup file.
        tolerance: largest difference relative to the largest number of the column.
    """
    ran, log = run_opensim(folder / setup, folder / "theirs")
    assert ran, log
    result = osimlite.run(folder / setup, folder / "ours")
    assert result.done, result.messages
    assert result.tables
    for name, table in result.tables.items():
        if name.endswith("_states.sto"):
            # OpenSim writes the states with another function, whose header its own reader does not
            # accept.
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
# Replacements in the model of the closed loop.
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


# The X axes of the frames are the Z axes of their bases. The first rotation of every joint is
# therefore in the plane of the bars.
JOINT = """<{kind} name="{name}"><socket_parent_frame>{name}_p</socket_parent_frame>
<socket_child_frame>{name}_c</socket_child_frame><coordinates>{coordinates}</coordinates><frames>
<PhysicalOffsetFrame name="{name}_p"><socket_parent>/bodyset/{upper}</socket_parent><translation>0 -0.3 0</translation>
<orientation>0 {turn} 0</orientation></PhysicalOffsetFrame><PhysicalOffsetFrame name="{name}_c">
<socket_parent>/bodyset/{bar}</socket_parent><orientation>0 {turn} 0</orientation></PhysicalOffsetFrame>
</frames></{kind}>"""
COUNTS = {"PinJoint": 1, "UniversalJoint": 2, "BallJoint": 3}
BAR = """<Body name="{0}"><mass>0.5</mass><mass_center>{1} 0 0</mass_center>
<inertia>0.001 0.007 0.007 0 0 0</inertia></Body>"""
POINT = """<PointConstraint name="end"><socket_body_1>/bodyset/b</socket_body_1><socket_body_2>/bodyset/c</socket_body_2>
<location_body_1>0 -0.3 0</location_body_1><location_body_2>0.4 0 0</location_body_2></PointConstraint>"""
WELD = """<WeldConstraint name="cut"><socket_frame1>/bodyset/c</socket_frame1><socket_frame2>other</socket_frame2>
<frames><PhysicalOffsetFrame name="other"><socket_parent>/bodyset/d</socket_parent><translation>-0.4 0 0</translation>
</PhysicalOffsetFrame></frames></WeldConstraint>"""
FUNCTIONS = {
    "a coupler": "<LinearFunction><coefficients>1 0</coefficients></LinearFunction>",
    "a coupler of higher degree": "<PolynomialFunction><coefficients>0.3 1 0</coefficients></PolynomialFunction>",
}


BARS = {
    "a point": (POINT, [("jc", "a", "c", "0.2", "UniversalJoint")]),
    "a weld": (
        WELD,
        [("jc", "a", "c", "0.2", "BallJoint"), ("jd", "b", "d", "-0.2", "UniversalJoint")],
    ),
}
"""Constraints that close a loop with a third bar, or with two halves of it, and the additional joints.

The joints leave enough freedom that no equation is redundant.
"""


def close_loop(folder: Path, closed_by: str, *, is_planar: bool = False) -> None:
    """Replace the rod that closes the loop of two bars by a coupler or by a third bar.

    Args:
        folder: copy of the lab.
        closed_by: key of `FUNCTIONS` or `BARS`.
        is_planar: whether the third bar moves in the plane only, so that equations are redundant.
    """
    text = (folder / "bars.osim").read_text()
    start, end = text.index("<ConstantDistance"), text.index(ROD) + len(ROD)
    constraint = COUPLER.removeprefix(ROD)
    if closed_by in FUNCTIONS:
        function = FUNCTIONS[closed_by]
        constraint = re.sub("<LinearFunction.*</LinearFunction>", function, constraint)
    constraint, bars = BARS.get(closed_by, (constraint, []))
    text = text[:start] + constraint + text[end:]
    table = read_sto(folder / "walk.mot")
    columns, rows = table.columns, table.rows
    for name, upper, bar, center, kind in bars:
        kind = "PinJoint" if is_planar else kind
        names = [f"{name}_q", f"{name}_2", f"{name}_3"][: COUNTS[kind]]
        joint = JOINT.format(
            kind=kind,
            name=name,
            upper=upper,
            bar=bar,
            # A pin rotates about Z, so that its frames need no rotation.
            turn=0 if is_planar else -np.pi / 2.0,
            coordinates="".join(
                f'<Coordinate name="{name}"><range>-3 3</range></Coordinate>' for name in names
            ),
        )
        text = text.replace(
            "</objects></BodySet>", f"{BAR.format(bar, center)}</objects></BodySet>"
        )
        text = text.replace("</objects></JointSet>", f"{joint}</objects></JointSet>")
        # The third bar stays horizontal in the motion.
        columns = (*columns, *names)
        angles = np.outer(table.rows[:, 0], [-1.0, 0.0, 0.0][: len(names)])
        rows = np.hstack([rows, angles])
    (folder / "bars.osim").write_text(text)
    (folder / "walk.mot").unlink()
    write_sto(
        folder / "walk.mot", "m", table.times.tolist(), columns, rows.tolist(), in_degrees=True
    )


@pytest.mark.parametrize("closed_by", [*BARS, *FUNCTIONS])
@pytest.mark.parametrize("setup", ["rra.xml", "rra2.xml", "cmc.xml"])
@pytest.mark.full
def test_loops_closed_by_other_constraints_are_tracked(
    tmp_path: Path, closed_by: str, setup: str
) -> None:
    folder = copy_lab("loop", tmp_path)
    close_loop(folder, closed_by)
    compare_runs(folder, setup)


@pytest.mark.parametrize("closed_by", [*BARS])
@pytest.mark.full
def test_redundant_equations_of_a_loop_change_nothing(tmp_path: Path, closed_by: str) -> None:
    """Bars that move in the plane only have the same motion as bars that are free out of it.

    OpenSim is not compared, because its assembly may fail with redundant equations.
    """
    tables = []
    for is_planar in (False, True):
        (tmp_path / str(is_planar)).mkdir()
        folder = copy_lab("loop", tmp_path / str(is_planar))
        close_loop(folder, closed_by, is_planar=is_planar)
        result = osimlite.run(folder / "rra.xml", folder / "ours")
        tables.append(result.tables["rra_Kinematics_q.sto"])
    free, planar = tables
    assert np.ptp(planar["ja_q"]) > 0.5
    for name in planar.columns:
        assert np.allclose(planar[name], free[name], atol=1e-5), name


@pytest.mark.parametrize("setup", ["so.xml", "rra.xml"])
def test_fewer_actuators_than_coordinates(tmp_path: Path, setup: str) -> None:
    """RRA and CMC follow their tasks; static optimization rejects the setup, as OpenSim does."""
    folder = copy_lab("loop", tmp_path)
    text = (folder / "bars.osim").read_text()
    start, end = text.index("<ConstantDistance"), text.index(ROD) + len(ROD)
    (folder / "bars.osim").write_text(text[:start] + text[end:])
    actuators = (folder / "act.xml").read_text()
    start, end = actuators.index('<CoordinateActuator name="jb'), actuators.index("</objects>")
    (folder / "act.xml").write_text(actuators[:start] + actuators[end:])
    if setup == "rra.xml":
        compare_runs(folder, setup)
        return
    ran, log = run_opensim(folder / setup, folder / "theirs")
    assert not ran
    assert "over-constrained" in log
    with pytest.raises(osimlite.OsimliteError, match="1 actuator for 2 coordinates"):
        osimlite.run(folder / setup, folder / "ours")


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
    """A coupler that follows from the rod does not change the tables.

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
    """The first controls use the desired speeds before the start is projected onto the constraints."""
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
# Replacements in a model that lock or prescribe coordinates.
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
    """A lock takes precedence over the motion file, and so does the function of a prescribed coordinate at time 0."""
    folder = copy_lab("locked", tmp_path)
    change(folder / "leg.osim", *HELD[held])
    change(folder / "rra.xml", ("<final_time>0.3<", "<final_time>0.22<"))
    compare_runs(folder, "rra.xml")


# Marker without any position in the file, None for markers with gaps only.
UNSEEN = {"in some frames": None, "in all frames": "ANK", "another in all": "KNE"}


@pytest.mark.parametrize("which", [*UNSEEN])
def test_marker_errors_where_a_marker_is_unseen(tmp_path: Path, which: str) -> None:
    """Sums and largest errors include only visible markers, means divide by the number of all markers."""
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


def prescribe(function: str) -> str:
    return f"<prescribed_function>{function}</prescribed_function><prescribed>true</prescribed>"


KNEE, HIP = '<Coordinate name="knee_angle">', '<Coordinate name="hip_flexion">'
SINE = prescribe('<Sine name="f"><amplitude>0.3</amplitude><omega>4</omega></Sine>')
STILL = prescribe('<Constant name="f"><value>-0.4</value></Constant>')
SPEED = "<default_speed_value>0.7</default_speed_value>"
FOLLOWS = f"""<ConstraintSet>{COUPLER.removeprefix(ROD)}""".replace("ja_q", "hip_flexion").replace(
    "jb_q", "knee_angle"
)
COUPLED = (
    "<ConstraintSet><objects></objects></ConstraintSet>",
    f"{FOLLOWS.replace('<ConstraintSet>', '<ConstraintSet><objects>')}</objects></ConstraintSet>",
)
FIXED = {
    "a locked knee": [(KNEE, f"{KNEE}{LOCK}")],
    "a bent locked knee": [(f"{KNEE}<default_value>0<", f"{KNEE}{LOCK}<default_value>-0.5<")],
    "a locked pelvis": [
        (f'<Coordinate name="pelvis_{name}">', f'<Coordinate name="pelvis_{name}">{LOCK}')
        for name in ("tilt", "tx", "ty")
    ],
    "a locked coordinate that a coupler drives": [(KNEE, f"{KNEE}{LOCK}"), COUPLED],
    "a locked coordinate that drives a coupler": [(HIP, f"{HIP}{LOCK}"), COUPLED],
    "a prescribed constant": [(KNEE, f"{KNEE}{STILL}")],
    "a prescribed motion": [(HIP, f"{HIP}{SINE}")],
    "all locked": [(KNEE, f"{KNEE}{LOCK}"), (HIP, f"{HIP}{LOCK}")]
    + [
        (f'<Coordinate name="pelvis_{name}">', f'<Coordinate name="pelvis_{name}">{LOCK}')
        for name in ("tilt", "tx", "ty")
    ],
}


@pytest.mark.parametrize("fixed", [*FIXED])
def test_inverse_kinematics_of_coordinates_that_are_held(tmp_path: Path, fixed: str) -> None:
    folder = copy_lab("unseen", tmp_path)
    change(folder / "leg.osim", *FIXED[fixed])
    ran, log = run_opensim(folder / "ik.xml", folder / "theirs")
    assert ran, log
    result = osimlite.run(folder / "ik.xml", folder / "ours")
    # OpenSim writes the motion beside the setup, not into the results folder.
    assert difference(result.tables["ik.mot"], folder / "ik.mot") < 0.05
    errors = "ik_ik_marker_errors.sto"
    assert difference(result.tables[errors], folder / "theirs" / errors) < 2e-5


SPEEDS = {
    "a default speed": [(KNEE, f"{KNEE}{SPEED}")],
    "a default speed of a lock": [(KNEE, f"{KNEE}{SPEED}{LOCK}")],
    "a default speed that drives a coupler": [(HIP, f"{HIP}{SPEED}"), COUPLED],
    "a prescribed motion": [(HIP, f"{HIP}{SPEED}{SINE}")],
    "a prescribed constant": [(KNEE, f"{KNEE}{SPEED}{STILL}")],
}


@pytest.mark.parametrize("which", [*SPEEDS])
def test_speeds_of_a_static_pose(tmp_path: Path, which: str) -> None:
    """OpenSim writes the speeds of the initial state at time 0 beside the fitted values."""
    folder = copy_lab("plugin", tmp_path)
    copy_lab("one_frame", tmp_path / "sound")
    (folder / "leg.osim").write_bytes((tmp_path / "sound" / "leg.osim").read_bytes())
    change(folder / "leg.osim", *SPEEDS[which])
    change(folder / "scale.xml", ("<time_range> 0 0.1<", "<time_range> 0.04 0.08<"))
    ran, log = run_opensim(folder / "scale.xml", folder / "theirs")
    assert ran, log
    osimlite.run(folder / "scale.xml", folder / "ours")
    ours, theirs = (read_sto(path / "subj_static.mot") for path in (folder / "ours", folder))
    assert ours.columns == theirs.columns
    for label in ours.columns:
        tolerance = 1e-9 if label.endswith("/speed") else 0.01
        assert ours[label] == pytest.approx(theirs[label], abs=tolerance), label
