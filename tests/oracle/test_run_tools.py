"""Compare setups of tools with a live OpenSim: files, headers, columns and numbers."""

from __future__ import annotations

import gzip
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import osimlite
from osimlite.io.tables.storage import read_sto, write_sto
from osimlite.models.jumper import jumper
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.joint_types import ScapulothoracicJoint
from osimlite.schema.muscles import Muscle
from tests.oracle.support import both, compare, real
from tests.scripts import run_script

pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

ANALYSES = """
        <output_precision>16</output_precision>
        <initial_time>{start}</initial_time>
        <final_time>0.2</final_time>
        <solve_for_equilibrium_for_auxiliary_states>{equilibrium}</solve_for_equilibrium_for_auxiliary_states>
        <AnalysisSet>
            <objects>
                <Kinematics name="K"/>
                <BodyKinematics name="B"><in_degrees>false</in_degrees></BodyKinematics>
                <BodyKinematics name="L">
                    <express_results_in_body_local_frame>true</express_results_in_body_local_frame>
                </BodyKinematics>
                <PointKinematics name="P">
                    <body_name>{body}</body_name>
                    <point_name>tip</point_name>
                    <point>0.1 0.02 0.03</point>
                </PointKinematics>
                <PointKinematics name="R">
                    <body_name>ground</body_name>
                    <relative_to_body_name>/bodyset/{body}</relative_to_body_name>
                    <point_name>tip</point_name>
                    <point>0.1 0.02 0.03</point>
                </PointKinematics>
                <PointKinematics name="Q.1">
                    <body_name>{body}</body_name>
                    <relative_to_body_name>{frame}</relative_to_body_name>
                    <point_name>tip</point_name>
                    <point>0.1 0.02 0.03</point>
                </PointKinematics>
                <MuscleAnalysis name="M"/>
                <ForceReporter name="F"/>
            </objects>
        </AnalysisSet>
"""


@pytest.mark.parametrize(
    ("start", "cutoff", "equilibrium"), [(0.1, -1.0, "false"), (-0.05, 6.0, "true")]
)
@pytest.mark.parametrize("name", ["arm26", "jumper"])
def test_analyses(
    corpus: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, start: float, cutoff: float,
    equilibrium: str,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    model = jumper() if name == "jumper" else osimlite.read(real(corpus, "m0001"))
    body, frame = (
        model.body_set.objects[-1].name,
        model.tree().path_of(model.joint_set.objects[-1].frames[0]),
    )
    more = ANALYSES.format(start=start, equilibrium=equilibrium, body=body, frame=frame)
    # Fibers hardly move when muscles are in equilibrium. OpenSim's iteration leaves an error of
    # 1e-10 of a force, which is large compared to their velocity.
    compare(*both(tmp_path, model, "AnalyzeTool", more, cutoff), 1e-8, 1e-6)


def other_columns(folder: Path) -> None:
    """Name the columns of the motion as state files of several versions do, and drop the last column."""
    table = read_sto(folder / "motion.mot")
    first, second, *others = (
        info.path for info in osimlite.mechanism(osimlite.read(folder / "model.osim")).coordinates
    )
    names = [
        f"{first}/value".removeprefix("/jointset/"),
        f"{second}/value",
        *(path.split("/")[-1] for path in others),
    ]
    rows = table.rows[:, :-1].tolist()
    write_sto(
        folder / "motion.mot", "motion", table.times, names[:-1], rows, in_degrees=table.in_degrees
    )


@pytest.mark.parametrize("held", ["free", "locked", "prescribed"])
def test_coordinates_that_a_motion_lacks_or_names_in_old_ways(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, held: str
) -> None:
    monkeypatch.chdir(tmp_path)
    model = jumper()
    first, *_, last = model.components(Coordinate)
    last.default_value, last.locked = 0.4, held == "locked"
    if held == "prescribed":
        first.prescribed_function, first.prescribed = (
            osimlite.LinearFunction(coefficients=(0.3, 0.2)),
            True,
        )
    body, frame = (
        model.body_set.objects[-1].name,
        model.tree().path_of(model.joint_set.objects[-1].frames[0]),
    )
    more = ANALYSES.format(start=0.1, equilibrium="true", body=body, frame=frame)
    compare(*both(tmp_path, model, "AnalyzeTool", more, change=other_columns), 1e-8, 1e-6)


SPEEDS = """<initial_time>0.1</initial_time><final_time>0.2</final_time><output_precision>16</output_precision>
    <speeds_file>speeds.sto</speeds_file>
    <AnalysisSet><objects><Kinematics name="K"/><BodyKinematics name="B"/></objects></AnalysisSet>"""


@pytest.mark.parametrize(
    ("label", "count", "in_degrees"),
    [("{}/speed", 2, False), ("{}_u", 2, True), ("{}_u", 1, False)],
)
def test_speeds_of_a_file(
    corpus: Any,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    label: str,
    count: int,
    in_degrees: bool,
) -> None:
    """Speeds are found under new and old names, and are in rad/s whatever the file says.

    The speed is zero without a column.
    """
    monkeypatch.chdir(tmp_path)
    model = osimlite.read(real(corpus, "m0001"))
    infos = osimlite.mechanism(model).coordinates[:count]
    times = np.linspace(0.0, 0.5, 26)
    names = [label.format(info.path if "/" in label else info.name) for info in infos]
    rows = np.stack([np.cos(3.0 * times + k) for k in range(count)], axis=1)
    write_sto(
        tmp_path / "speeds.sto",
        "speeds",
        times.tolist(),
        names,
        rows.tolist(),
        in_degrees=in_degrees,
    )
    compare(*both(tmp_path, model, "AnalyzeTool", SPEEDS), 1e-8, 1e-8)


def test_other_states_beside_speeds_count(
    corpus: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Other states in the speeds file are used, except for values of coordinates.

    A speed without a column has its default value.
    """
    monkeypatch.chdir(tmp_path)
    model = osimlite.read(real(corpus, "m0001"))
    first, second = model.components(Coordinate)
    first.default_speed_value = 0.5
    muscle = next(iter(model.components(Muscle))).name
    labels = [
        f"{second.name}_u",
        first.name,
        f"{muscle}.activation",
        f"/forceset/{muscle}/fiber_length",
    ]
    times = np.linspace(0.0, 0.5, 26)
    rows = np.array([0.1, 0.3, 0.4, 0.1]) + 0.05 * np.sin(7.0 * times[:, None] + np.arange(4))
    write_sto(tmp_path / "speeds.sto", "speeds", times.tolist(), labels, rows.tolist())
    more = SPEEDS.replace("<objects>", '<objects><StatesReporter name="S"/>')
    ours, theirs = both(tmp_path, model, "AnalyzeTool", more)
    compare(ours, theirs, 1e-8, 1e-8)
    assert read_sto(theirs / "it_S_states.sto")[f"/forceset/{muscle}/activation"].min() > 0.3


def test_speeds_of_other_times_are_told(
    corpus: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """OpenSim and osimlite reject a speeds file without a row at a requested time."""
    monkeypatch.chdir(tmp_path)
    write_sto(
        tmp_path / "speeds.sto", "speeds", [0.0, 0.11, 0.5], ["r_shoulder_elev_u"], [[1.0]] * 3
    )
    with pytest.raises(subprocess.CalledProcessError):
        both(tmp_path, osimlite.read(real(corpus, "m0001")), "AnalyzeTool", SPEEDS)
    with pytest.raises(osimlite.OsimliteError, match=r"no row at 0\.1 s"):
        osimlite.run(tmp_path / "ours.xml")
    assert not (tmp_path / "ours").exists()


@pytest.mark.parametrize("cutoff", [-1.0, 6.0, 30.0])
def test_inverse_dynamics(
    corpus: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cutoff: float
) -> None:
    monkeypatch.chdir(tmp_path)
    model = osimlite.read(real(corpus, "m0001"))
    more = "<forces_to_exclude>Muscles</forces_to_exclude>"
    compare(*both(tmp_path, model, "InverseDynamicsTool", more, cutoff), 1e-8, 1.5e-8)


LOADS = """<forces_to_exclude>Muscles</forces_to_exclude>
    <joints_to_report_body_forces>{joints}</joints_to_report_body_forces>
    <output_gen_force_file>not/here/forces</output_gen_force_file>
    <output_body_forces_file>loads.1</output_body_forces_file>"""


@pytest.mark.parametrize(
    ("name", "joints"),
    [
        ("m0001", "r_shoulder nowhere r_shoulder"),
        ("m0954", "ALL"),
        ("m0013", "all"),
        ("jumper", "ALL"),
        ("m0163", "ALL"),
    ],
)
def test_loads_at_joints(
    corpus: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, joints: str
) -> None:
    monkeypatch.chdir(tmp_path)
    model = jumper() if name == "jumper" else osimlite.read(real(corpus, name))
    if any(isinstance(joint, ScapulothoracicJoint) for joint in model.joint_set.objects):
        # The joint is at rest, because OpenSim uses the rates of its angles as speeds. Locked
        # coordinates do not move in these motions.
        for coordinate in model.components(Coordinate):
            coordinate.locked, coordinate.default_value = True, coordinate.default_value + 0.1
    ours, theirs = both(tmp_path, model, "InverseDynamicsTool", LOADS.format(joints=joints))
    assert sorted(path.name for path in theirs.iterdir()) == ["forces.sto", "loads.1"]
    largest = max(np.abs(read_sto(file).rows).max() for file in theirs.iterdir())
    compare(ours, theirs, 1e-8, 1.5e-8 + 1e-12 * largest)


MORE = """<Kinematics name="K"/><BodyKinematics name="B"/>
    <MuscleAnalysis name="M"><step_interval>3</step_interval></MuscleAnalysis>
    <ForceReporter name="F"><start_time>0.01</start_time><end_time>0.012</end_time><step_interval>4</step_interval>
    </ForceReporter>"""
STARTED = ("arm_init.sto", "start/arm26_states.sto")
# Replacements in the setup of a forward simulation.
CHANGES: dict[str, list[tuple[str, str]]] = {
    "longest step": [("size>       1.0", "size> 0.001")],
    "equilibrium": [("auxiliary_states> false", "auxiliary_states> true"), (" 0.02 ", " 0.1 ")],
    "start beside the row": [
        ("<initial_time>       0.0", "<initial_time> 0.013"),
        (" 0.02 ", " 0.1 "),
    ],
    "no states": [("arm_init.sto", ""), (" 0.02 ", " 0.1 ")],
    "in the midst": [
        STARTED,
        ("<initial_time>       0.0", "<initial_time> 0.0052"),
        (" 0.02 ", " 0.1 "),
    ],
    "no controls": [],
    "analyses": [("<objects/>", f"<objects>{MORE}</objects>")],
    "known states": [
        STARTED,
        ("ForwardTool", "AnalyzeTool"),
        ("<objects/>", f"<objects>{MORE}</objects>"),
    ],
}


@pytest.mark.parametrize("changes", CHANGES.values(), ids=CHANGES)
def test_forward_with_opensims_steps(
    shared: Path, tmp_path: Path, changes: list[tuple[str, str]]
) -> None:
    """OpenSim takes the same number of steps at the same times.

    Muscles far from equilibrium amplify rounding errors in the steps.
    """
    case = shared / "oracle" / "tools" / "reference" / "forward_arm26"
    (tmp_path / "start").mkdir()
    (tmp_path / "start" / "arm26_states.sto").write_bytes((case / "arm26_states.sto").read_bytes())
    for file in case.glob("*.gz"):
        (tmp_path / file.name.removesuffix(".gz")).write_bytes(gzip.decompress(file.read_bytes()))
    text = (case / "fwd.xml").read_text().replace("> 8 <", "> 16 <")
    if not changes:
        start, end = text.index("<ControlSetController"), text.index("</ControlSetController>")
        text = text[:start] + text[end + len("</ControlSetController>") :]
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    for results in ("ours", "theirs"):
        (tmp_path / f"{results}.xml").write_text(text.replace(" Results ", results))
    tool = "AnalyzeTool" if "AnalyzeTool" in text else "ForwardTool"
    script = f"import opensim; opensim.Logger.setLevelString('Error'); assert opensim.{tool}('theirs.xml').run()"
    run_script(script, folder=tmp_path)
    osimlite.run(tmp_path / "ours.xml")
    ours, theirs = tmp_path / "ours", tmp_path / "theirs"
    assert sorted(path.name for path in ours.iterdir()) == sorted(
        path.name for path in theirs.iterdir()
    )
    for file in ours.iterdir():
        heads = [
            (folder / file.name).read_text().partition("endheader\n")[0]
            for folder in (ours, theirs)
        ]
        assert heads[0] == heads[1]
        mine, known = read_sto(file), read_sto(theirs / file.name)
        assert mine.columns == known.columns and mine.times == pytest.approx(known.times, abs=1e-6)
        largest = np.abs(known.rows).max(axis=0)
        assert (np.abs(mine.rows - known.rows).max(axis=0) <= 2e-5 * largest + 1e-9).all(), (
            file.name
        )
        assert (np.abs(mine.rows[0] - known.rows[0]) <= 1e-9 * largest + 1e-9).all(), file.name
