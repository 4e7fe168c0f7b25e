"""Tools of OpenSim whose setups name a time range, with the files that they read."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from osimlite.io.tables.storage import read_sto, write_sto
from tests.labs import change, copy_lab

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
