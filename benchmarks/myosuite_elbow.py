"""Inverse dynamics, static optimization and Moco of MyoSuite's elbow: the numbers of docs/from-mjcf.md.

    python benchmarks/myosuite_elbow.py FOLDER

FOLDER: a clone of MyoHub/myo_sim, called myo_sim. The elbow bends from 0.3 to 1.6 rad and back in 2 s.
"""

from __future__ import annotations

import argparse
import math
import tempfile
import time
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

import osimlite
from osimlite.io.tables.storage import write_sto

FILE = "elbow/myoelbow_2dof6muscles.xml"
COORDINATES = ("r_shoulder_elev", "r_elbow_flex")


def main(folder: Path) -> None:
    """Print the numbers."""
    times = np.linspace(0.0, 2.0, 201)
    angle = 0.95 - 0.65 * np.cos(math.pi * times)
    motion = {COORDINATES[0]: 0.0 * times, COORDINATES[1]: angle}
    model = osimlite.from_mjcf(folder / FILE, armature="none").model
    moments = osimlite.inverse_dynamics(model, motion, times=times)
    names = [name for name in moments.columns if name.endswith("_moment")]
    exact = compute_mujoco_moments(folder / FILE, times, angle)
    for index, name in enumerate(names):
        difference = np.abs(moments[name] - exact[:, index])
        print(
            f"ID {name}: at most {np.abs(moments[name]).max():.3f} N m; "
            f"mj_inverse differs by {difference[10:-10].max():.1e}, at the ends {difference.max():.1e}"
        )
    reserves = [
        osimlite.CoordinateActuator(name=f"{name}_reserve", coordinate=name, optimal_force=1.0)
        for name in COORDINATES
    ]
    static = osimlite.static_optimization(model, motion, times=times, forces=reserves)
    largest = ", ".join(f"{name} {np.abs(static[name]).max():.3g}" for name in static.columns)
    print(f"SO, activations: {largest}")
    with tempfile.TemporaryDirectory() as place:
        rows = np.column_stack(list(motion.values()))
        write_sto(Path(place, "flexion.mot"), "flexion", times, COORDINATES, rows)
        osimlite.write(model, Path(place, "elbow.osim"))
        for title, operators in {
            "Millard": [],
            "Millard without activation dynamics": [osimlite.ModOpIgnoreActivationDynamics()],
            "De Groote and Fregly": [osimlite.ModOpReplaceMusclesWithDeGrooteFregly2016()],
        }.items():
            solve(title, operators, place)


def compute_mujoco_moments(file: Path, times: Any, angle: Any) -> Any:
    """Return MuJoCo's inverse dynamics (frames, 2) without armature and limits, N m."""
    model = mujoco.MjModel.from_xml_path(str(file))
    model.dof_armature[:] = 0.0
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    data, result = mujoco.MjData(model), []
    for instant, value in zip(times, angle, strict=True):
        data.qpos[:] = 0.0, value
        data.qvel[:] = 0.0, 0.65 * math.pi * math.sin(math.pi * instant)
        data.qacc[:] = 0.0, 0.65 * math.pi**2 * math.cos(math.pi * instant)
        mujoco.mj_inverse(model, data)
        result.append(data.qfrc_inverse.copy())
    return np.array(result)


def solve(title: str, operators: list[Any], folder: str) -> None:
    """Print the solution of MocoInverse with other muscles."""
    tool = osimlite.MocoInverse(
        model=osimlite.ModelProcessor(
            filepath="elbow.osim",
            operators=[*operators, osimlite.ModOpAddReserves(optimal_force=1.0)],
        ),
        kinematics=osimlite.TableProcessor(filepath="flexion.mot"),
        kinematics_allow_extra_columns=True,
        initial_time=0.1,
        final_time=1.9,
        mesh_interval=0.1,
        max_iterations=300,
    )
    begin = time.process_time()
    solution = osimlite.moco.solve_inverse(tool, folder=folder)
    print(
        f"Moco, {title}: {solution.status}, {solution.iterations} iterations, objective "
        f"{solution.objective:.6g}, {time.process_time() - begin:.1f} s"
    )
    controls = solution.controls
    print(
        "   "
        + ", ".join(
            f"{name.rpartition('/')[2]} {np.abs(controls[name]).max():.3f}"
            for name in controls.columns
        )
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, add_help=True)
    parser.add_argument("folder", type=Path)
    main(parser.parse_args().folder)
