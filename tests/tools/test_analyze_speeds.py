"""Tests of AnalyzeTool with a file of speeds, whose states count at the times of the coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

import osimlite
from osimlite.errors import DocumentError
from osimlite.io.tables.storage import StoTable, write_sto
from osimlite.tools.analyze_tool import TIME_TOLERANCE_S
from tests.simple_models import make_single_body

TIMES = np.linspace(0.0, 0.4, 21)
SETUP = """<OpenSimDocument Version="40600"><AnalyzeTool name="it"><model_file>model.osim</model_file>
<initial_time>0.1</initial_time><final_time>0.3</final_time>
<AnalysisSet><objects><Kinematics name="K"/><StatesReporter name="S"/></objects></AnalysisSet>
<coordinates_file>motion.sto</coordinates_file><speeds_file>speeds.sto</speeds_file>
</AnalyzeTool></OpenSimDocument>"""


def slide_and_turn() -> osimlite.Model:
    """Return a body that slides and turns, with a muscle along the slide."""
    names = ("turn", "lift", "slide")
    joint = osimlite.PlanarJoint(
        name="joint", coordinates=[osimlite.Coordinate(name=name) for name in names]
    )
    muscle = osimlite.Millard2012EquilibriumMuscle(
        name="muscle", max_isometric_force=100.0, optimal_fiber_length=0.1, tendon_slack_length=0.2
    )
    for number, (frame, place) in enumerate((("/ground", -0.3), ("/bodyset/body", 0.0))):
        point = osimlite.PathPoint(
            name=f"p{number}", socket_parent_frame=frame, location=(place, 0.0, 0.0)
        )
        muscle.geometry_path.path_point_set.objects.append(point)
    model = make_single_body(joint, muscle)
    model["/jointset/joint/lift"].default_speed_value = 0.25
    return model


def analyze(
    folder: Path, columns: Sequence[str], rows: np.ndarray, times: np.ndarray = TIMES
) -> dict[str, StoTable]:
    """Run an analysis with a file of speeds.

    Args:
        folder: folder of the files.
        columns: columns of the file of speeds.
        rows: its rows.
        times: its times.

    Returns:
        Tables by the ends of their names.
    """
    osimlite.write(slide_and_turn(), folder / "model.osim")
    values = 0.02 * np.sin(3.0 * TIMES[:, None] + np.arange(3.0))
    write_sto(
        folder / "motion.sto", "motion", TIMES.tolist(), ["turn", "lift", "slide"], values.tolist()
    )
    write_sto(folder / "speeds.sto", "speeds", times.tolist(), columns, rows.tolist())
    (folder / "it.xml").write_text(SETUP)
    tables = osimlite.run(folder / "it.xml").tables
    return {name.removeprefix("it_").removesuffix(".sto"): table for name, table in tables.items()}


def make_rows(count: int) -> np.ndarray:
    return 0.5 + 0.1 * np.cos(5.0 * TIMES[:, None] + np.arange(count))


@pytest.mark.parametrize("labels", [("slide_u", "turn_u"), ("/jointset/joint/{}/speed",) * 2])
def test_speeds_are_those_of_the_file(tmp_path: Path, labels: tuple[str, str]) -> None:
    """Columns may have any order and new or old names; a missing column means the default speed."""
    names = [label.format(name) for label, name in zip(labels, ("slide", "turn"), strict=True)]
    rows = make_rows(2)
    tables = analyze(tmp_path, names, rows)
    inside = (TIMES > 0.099) & (TIMES < 0.301)
    for name, expected in (
        ("slide", rows[inside, 0]),
        ("turn", np.rad2deg(rows[inside, 1])),
        ("lift", np.full(int(inside.sum()), 0.25)),
    ):
        assert tables["K_u"][name] == pytest.approx(expected, rel=1e-7)


def test_other_states_of_the_file_count(tmp_path: Path) -> None:
    rows = make_rows(3)
    rows[:, 2] = 0.1 + 0.01 * rows[:, 0]
    labels = ["turn_u", "muscle.activation", "/forceset/muscle/fiber_length"]
    states = analyze(tmp_path, labels, rows)["S_states"]
    inside = (TIMES > 0.099) & (TIMES < 0.301)
    for name, number in (("turn/speed", 0), ("muscle/activation", 1), ("muscle/fiber_length", 2)):
        (column,) = [column for column in states.columns if column.endswith(name)]
        assert states[column] == pytest.approx(rows[inside, number], rel=1e-7)


def test_times_may_differ_by_rounding_alone(tmp_path: Path) -> None:
    rows = make_rows(1)
    expected = analyze(tmp_path, ["slide_u"], rows)["K_u"]["slide"]
    for shift in (-0.9 * TIME_TOLERANCE_S, 0.9 * TIME_TOLERANCE_S):
        moved = analyze(tmp_path, ["slide_u"], rows, TIMES + shift)
        assert moved["K_u"]["slide"] == pytest.approx(expected, rel=1e-12)
    with pytest.raises(DocumentError, match=r"no row at 0\.1 s, unlike the coordinates"):
        analyze(tmp_path, ["slide_u"], rows, TIMES + 1e-9)
    with pytest.raises(DocumentError, match=r"no row at 0\.28 s"):
        analyze(tmp_path, ["slide_u"], rows[:14], TIMES[:14])


def test_a_file_without_speeds_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(DocumentError, match="no column with a speed of the model"):
        analyze(tmp_path, ["slide", "muscle.activation"], make_rows(2))
