"""Compare unusual time ranges in each tool with a live OpenSim.

The ranges are empty, reversed, outside of the data, or not numbers.
"""

from __future__ import annotations

import re
import shutil
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

import osimlite
from osimlite.io.tables.storage import read_sto, write_sto
from osimlite.lint import validate
from tests.labs import change, copy_lab

pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

DYNAMICS = """<OpenSimDocument Version="40600"><InverseDynamicsTool name="id"><results_directory>.</results_directory>
<model_file>leg.osim</model_file><time_range>0.2 0.3</time_range><forces_to_exclude>Muscles</forces_to_exclude>
<coordinates_file>walk.mot</coordinates_file>
<lowpass_cutoff_frequency_for_coordinates>-1</lowpass_cutoff_frequency_for_coordinates>
<output_gen_force_file>id.sto</output_gen_force_file></InverseDynamicsTool></OpenSimDocument>"""
FORWARD = """<OpenSimDocument Version="40600"><ForwardTool name="fw"><model_file>bars.osim</model_file>
<results_directory>.</results_directory><initial_time>0.2</initial_time><final_time>0.3</final_time>
<states_file>states.sto</states_file><integrator_error_tolerance>0.001</integrator_error_tolerance>
</ForwardTool></OpenSimDocument>"""


class Tool(NamedTuple):
    """Tool under test: function that writes its files, setup file, class, time range, and an output table."""

    lay_out: Callable[[Path], object]
    setup: str
    name: str
    times: tuple[str, str]
    table: str
    number: int = 0  # index of the tool's time range in the setup


def lay_out_lab(name: str) -> Callable[[Path], object]:
    return lambda folder: copy_lab(name, folder)


def lay_out_dynamics(folder: Path) -> None:
    copy_lab("locked", folder)
    (folder / "id.xml").write_text(DYNAMICS)


def lay_out_scaling(folder: Path) -> None:
    """Write a static trial in which the shank grows, so that each frame gives another scale factor."""
    copy_lab("one_frame", folder)
    model = (folder / "leg.osim").read_bytes()
    copy_lab("plugin", folder)
    (folder / "leg.osim").write_bytes(model)
    lines = (folder / "static.trc").read_text().splitlines()
    for number, line in enumerate(lines[6:], 6):
        cells = line.split("\t")
        cells[21] = str(float(cells[21]) - 2.0 * number)
        lines[number] = "\t".join(cells)
    (folder / "static.trc").write_text("\n".join(lines) + "\n")


def lay_out_loop(folder: Path) -> None:
    """Write a closed loop with a motion of half a second."""
    copy_lab("loop", folder)
    table = read_sto(folder / "walk.mot")
    rows = (table.times > 4.749) & (table.times < 5.251)
    columns = table.columns
    (folder / "walk.mot").unlink()
    write_sto(
        folder / "walk.mot",
        "m",
        table.times[rows].tolist(),
        columns,
        table.rows[rows].tolist(),
        in_degrees=True,
    )


def lay_out_sensors(folder: Path) -> None:
    source = Path(__file__).parents[2] / "fixtures" / "pipelines" / "pendulum"
    for name in ("model.osim", "orientations.sto", "imu_ik.xml"):
        shutil.copy(source / name, folder)


def lay_out_states(folder: Path) -> None:
    copy_lab("loop", folder)
    table = read_sto(folder / "walk.mot")
    rows = table.times <= 1.0001
    q, still = np.radians(table.rows[rows]), np.zeros(rows.sum())
    columns = [
        f"/jointset/{name}/{name}_q/{kind}" for name in ("ja", "jb") for kind in ("value", "speed")
    ]
    values = np.column_stack([q[:, 0], still, q[:, 1], still])
    write_sto(
        folder / "states.sto", "states", table.times[rows].tolist(), tuple(columns), values.tolist()
    )
    (folder / "fw.xml").write_text(FORWARD)
    change(
        folder / "kin.xml",
        ("<states_file></states_file>", "<states_file>states.sto</states_file>"),
        ("<coordinates_file>walk.mot<", "<coordinates_file><"),
        (">5.0<", ">0.2<"),
        (">5.02<", ">0.3<"),
    )


KINEMATICS = "kin_BodyKinematics_pos_global.sto"
# Tools under test.
TOOLS = {
    "IK": Tool(
        lay_out_lab("unseen"), "ik.xml", "InverseKinematicsTool", ("0.01", "0.03"), "ik.mot"
    ),
    "ID": Tool(lay_out_dynamics, "id.xml", "InverseDynamicsTool", ("0.2", "0.3"), "id.sto"),
    "scale": Tool(lay_out_scaling, "scale.xml", "ScaleTool", ("0.02", "0.06"), "subj_factors.xml"),
    "IMU": Tool(
        lay_out_sensors, "imu_ik.xml", "IMUInverseKinematicsTool", ("0.1", "0.3"), "imu_angles.sto"
    ),
    "analyze": Tool(lay_out_loop, "kin.xml", "AnalyzeTool", ("5.0", "5.02"), KINEMATICS),
    "states": Tool(lay_out_states, "kin.xml", "AnalyzeTool", ("0.2", "0.3"), KINEMATICS),
    "RRA": Tool(lay_out_loop, "rra.xml", "RRATool", ("5.0", "5.02"), "rra_Kinematics_q.sto"),
    "CMC": Tool(lay_out_loop, "cmc.xml", "CMCTool", ("5.0", "5.05"), "cmc_Kinematics_q.sto"),
    "forward": Tool(
        lay_out_states, "fw.xml", "ForwardTool", ("0.2", "0.3"), "fw_states_degrees.mot"
    ),
}
RANGES = {
    "IK": "wider:same infinite:same empty:same one:same comma:same reversed:both before:both after:both NaN:both last:both",
    "ID": "wider:same empty:ours infinite:both comma:same three:same reversed:both before:ours after:ours NaN:both one:both",
    "scale": "wider:same missing:same before:same after:same infinite:both comma:same three:same reversed:both empty:both",
    "IMU": "wider:same infinite:same empty:same NaN:same comma:same reversed:both before:both last:both",
    "analyze": "wider:same infinite:same last:same comma:same reversed:ours before:ours after:ours NaN:ours empty:both",
    "states": "wider:same infinite:same last:same before:same after:same reversed:ours NaN:ours empty:both",
    "RRA": "reversed:both before:both NaN:both last:ours empty:both",
    "CMC": "reversed:both before:both last:ours empty:both",
    "forward": "wider:same reversed:both before:both NaN:both last:ours empty:both",
}
"""Time ranges of each tool, and how both programs treat them.

``same``: both run, with the same numbers. ``both``: both reject the range. ``ours``: OpenSim writes
a useless table, without rows or with the row nearest to the range, and only osimlite rejects it.
"""
CASES = [(tool, *case.split(":")) for tool, cases in RANGES.items() for case in cases.split()]


def change_times(tool: Tool, folder: Path, case: str) -> None:
    """Write the time range of a case into the setup of a tool."""
    first, last = tool.times
    times = {
        "wider": ("-5", "500"),
        "infinite": ("-Inf", "Inf"),
        "reversed": (last, first),
        "before": ("-5", "-4"),
        "after": ("500", "600"),
        "NaN": ("NaN", last),
        "last": (first, "NaN"),
        "comma": (f"{first},", last),
        "one": (first, ""),
        "three": (first, f"{last} 0.9"),
    }.get(case, ("", ""))
    text = (folder / tool.setup).read_text()
    if "<time_range>" in text:
        new = "" if case == "missing" else f"<time_range>{' '.join(times).strip()}</time_range>"
        text = re.sub("<time_range>.*?</time_range>", new, text, count=1)
    else:
        for tag, time in zip(("initial_time", "final_time"), times, strict=True):
            text = re.sub(f"<{tag}>.*?</{tag}>", f"<{tag}>{time}</{tag}>", text, count=1)
    (folder / tool.setup).write_text(text)


@pytest.mark.parametrize(("name", "case", "fate"), CASES)
def test_a_time_range(
    tmp_path: Path, run_live: Callable[..., dict[str, Any]], name: str, case: str, fate: str
) -> None:
    tool = TOOLS[name]
    ours, theirs = tmp_path / "ours", tmp_path / "theirs"
    for folder in (ours, theirs):
        folder.mkdir()
        tool.lay_out(folder)
        change_times(tool, folder, case)
    live = run_live(theirs, tool.name, tool.setup)
    assert (live["end"] == "done") == (fate != "both"), live
    if fate != "same":
        with pytest.raises(osimlite.OsimliteError) as refused:
            osimlite.run(ours / tool.setup)
        if fate == "ours":
            # No message may say that OpenSim rejects what it runs.
            errors = [item.message for item in validate(str(ours / tool.setup)).errors]
            for message in [*errors, refused.value.message]:
                assert not re.search("OpenSim (fails|rejects|crashes)", message)
        return
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert osimlite.run(ours / tool.setup).done
    if tool.table.endswith(".xml"):
        # OpenSim writes six digits.
        ratios, expected = (
            [
                float(word)
                for item in re.findall("<scales>(.*?)<", path.read_text())
                for word in item.split()
            ]
            for path in (ours / tool.table, theirs / tool.table)
        )
        assert ratios == pytest.approx(expected, rel=1e-5)
        return
    mine, known = read_sto(ours / tool.table), read_sto(theirs / tool.table)
    assert mine.columns == known.columns
    assert mine.times == pytest.approx(known.times, abs=1e-8)
    # OpenSim stops fitting markers at its accuracy, osimlite at the minimum.
    assert np.abs(mine.rows - known.rows).max() < (0.2 if name == "IK" else 1e-4)
