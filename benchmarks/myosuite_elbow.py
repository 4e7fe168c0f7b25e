"""Inverse dynamics, static optimization and Moco with MyoSuite's elbow model.

    python benchmarks/myosuite_elbow.py FOLDER

FOLDER is a clone of MyoHub/myo_sim. The model is converted from MuJoCo's format. Its elbow flexes
from 0.3 to 1.6 rad and back in 2 s. The results are those of docs/from-mjcf.md: inverse dynamics
compared with MuJoCo's mj_inverse, the largest activations of static optimization, and MocoInverse
with several kinds of muscles.
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

MODEL = "elbow/myoelbow_2dof6muscles.xml"
"""Model file in the clone."""

COORDINATES = ("r_shoulder_elev", "r_elbow_flex")
"""Coordinates of the model; the shoulder does not move."""

AMPLITUDE = 0.65
"""Amplitude of the elbow angle (rad)."""

MEAN_ANGLE = 0.95
"""Mean of the elbow angle (rad)."""


def main(folder: Path) -> None:
    """Compute inverse dynamics, static optimization and MocoInverse, and print their results."""
    times = np.linspace(0.0, 2.0, 201)
    angles = MEAN_ANGLE - AMPLITUDE * np.cos(math.pi * times)
    motion = {COORDINATES[0]: 0.0 * times, COORDINATES[1]: angles}
    # OpenSim has no armature of joints, so it is left out here and in the comparison with MuJoCo.
    model = osimlite.from_mjcf(folder / MODEL, armature="none").model
    print_inverse_dynamics(
        model, motion, times, compute_mujoco_moments(folder / MODEL, times, angles)
    )
    print_static_optimization(model, motion, times)
    # MocoInverse reads its model and its motion from files.
    with tempfile.TemporaryDirectory() as temporary:
        rows = np.column_stack(list(motion.values()))
        write_sto(Path(temporary, "flexion.mot"), "flexion", times, COORDINATES, rows)
        osimlite.write(model, Path(temporary, "elbow.osim"))
        for title, operators in {
            "Millard": [],
            "Millard without activation dynamics": [osimlite.ModOpIgnoreActivationDynamics()],
            "De Groote and Fregly": [osimlite.ModOpReplaceMusclesWithDeGrooteFregly2016()],
        }.items():
            print_moco_solution(title, operators, temporary)


def compute_mujoco_moments(file: Path, times: Any, angles: Any) -> Any:
    """Return MuJoCo's inverse dynamics without armature and limits, N m.

    Args:
        file: MuJoCo model.
        times: times (n,), s.
        angles: elbow angles (n,), rad.

    Returns:
        Moments (n, 2) of shoulder and elbow.
    """
    model = mujoco.MjModel.from_xml_path(str(file))
    model.dof_armature[:] = 0.0
    # This flag also disables the limits of joints.
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    data = mujoco.MjData(model)
    moments = []
    for instant, angle in zip(times, angles, strict=True):
        data.qpos[:] = 0.0, angle
        # These are the derivatives of the angle of `main`.
        data.qvel[:] = 0.0, AMPLITUDE * math.pi * math.sin(math.pi * instant)
        data.qacc[:] = 0.0, AMPLITUDE * math.pi**2 * math.cos(math.pi * instant)
        mujoco.mj_inverse(model, data)
        moments.append(data.qfrc_inverse.copy())
    return np.array(moments)


def print_inverse_dynamics(
    model: osimlite.Model, motion: dict[str, Any], times: Any, mujoco_moments: Any
) -> None:
    """Print the largest moment of each coordinate and its difference from MuJoCo's.

    Args:
        model: converted model.
        motion: values (n,) by coordinate, rad.
        times: times (n,), s.
        mujoco_moments: moments (n, 2), N m.
    """
    moments = osimlite.inverse_dynamics(model, motion, times=times)
    names = [name for name in moments.columns if name.endswith("_moment")]
    for index, name in enumerate(names):
        difference = np.abs(moments[name] - mujoco_moments[:, index])
        # Accelerations come from splines, which are less accurate near the ends of the motion.
        print(
            f"ID {name}: at most {np.abs(moments[name]).max():.3f} N m; "
            f"mj_inverse differs by {difference[10:-10].max():.1e}, at the ends {difference.max():.1e}"
        )


def print_static_optimization(model: osimlite.Model, motion: dict[str, Any], times: Any) -> None:
    """Print the largest activations of static optimization with reserve actuators.

    Args:
        model: converted model.
        motion: values (n,) by coordinate, rad.
        times: times (n,), s.
    """
    # Reserve actuators make the problem feasible where muscles are too weak.
    reserves = [
        osimlite.CoordinateActuator(name=f"{name}_reserve", coordinate=name, optimal_force=1.0)
        for name in COORDINATES
    ]
    static = osimlite.static_optimization(model, motion, times=times, forces=reserves)
    largest = ", ".join(f"{name} {np.abs(static[name]).max():.3g}" for name in static.columns)
    print(f"SO, largest activations: {largest}")


def print_moco_solution(title: str, operators: list[Any], folder: str) -> None:
    """Solve MocoInverse, and print the result and the largest controls.

    Args:
        title: kind of the muscles.
        operators: operators of the model processor that change the muscles.
        folder: folder with `elbow.osim` and `flexion.mot`.
    """
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
    start = time.process_time()
    solution = osimlite.moco.solve_inverse(tool, folder=folder)
    print(
        f"Moco, {title}: {solution.status}, {solution.iterations} iterations, objective "
        f"{solution.objective:.6g}, {time.process_time() - start:.1f} s"
    )
    controls = solution.controls
    largest = ", ".join(
        f"{name.rpartition('/')[2]} {np.abs(controls[name]).max():.3f}" for name in controls.columns
    )
    print(f"   largest controls: {largest}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path, help="clone of MyoHub/myo_sim")
    main(parser.parse_args().folder)
