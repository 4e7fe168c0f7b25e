"""Simulation speed in MuJoCo, with osimlite's plain file and its driver, compared with OpenSim.

    python benchmarks/motion_in_mujoco.py
    python benchmarks/motion_in_mujoco.py FILE.osim...

The models are the Dynamic Walker and the given files, for example gait10dof18musc.osim and
Rajagopal2016.osim of opensim-models. The *plain file* is the translated MuJoCo model, whose force
laws differ from OpenSim's (see docs/mujoco.md). The *driver* computes OpenSim's forces in each step
of MuJoCo. Both use fixed steps; OpenSim selects steps by its accuracy.

Each line is one model and one program with its step (s) or accuracy. The number is the simulated
time per processor time (s/s) from the default pose; the shortest time of three rounds counts.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import mujoco
import opensim

import osimlite
import osimlite.mjcf
from _corpus import WALKER

TO = 0.1
"""End of the simulation (s)."""

STEPS = (1e-3, 2e-4)
"""Step lengths in MuJoCo (s)."""

ACCURACIES = (1e-3, 1e-5)
"""Relative accuracies in OpenSim."""

# Other work on the machine only makes a run slower, so the shortest time is the most reliable.
ROUNDS = 3
"""Number of rounds; the programs run in turn in each."""


def main() -> None:
    opensim.Logger.setLevelString("off")
    for path in (WALKER, *map(Path, sys.argv[1:])):
        model = osimlite.read(path)
        runs = {f"plain file, {step:g} s": prepare_plain_file(model, step) for step in STEPS}
        runs |= {f"driver, {step:g} s": prepare_driver(model, step) for step in STEPS}
        runs |= {
            f"OpenSim, {accuracy:g}": prepare_opensim(path, accuracy) for accuracy in ACCURACIES
        }
        rounds = [time_runs(runs) for _ in range(ROUNDS)]
        for name in runs:
            seconds = min(times[name] for times in rounds)
            print(f"{path.stem:24} {name:20} {TO / seconds:8.2f} s/s")


def time_runs(runs: dict[str, Callable[[], None]]) -> dict[str, float]:
    """Do each run once.

    Args:
        runs: functions by name.

    Returns:
        Processor time of each (s).
    """
    times = {}
    for name, run in runs.items():
        start = time.process_time()
        run()
        times[name] = time.process_time() - start
    return times


def prepare_plain_file(model: osimlite.Model, step: float) -> Callable[[], None]:
    """Return a function that simulates the translated model in MuJoCo with a fixed step (s)."""
    # Visual meshes take time to load, and do not change the motion.
    mjcf = osimlite.to_mjcf(model, visuals=False)
    mujoco_model = mujoco.MjModel.from_xml_string(mjcf.text)
    mujoco_model.opt.timestep = step
    data = mujoco.MjData(mujoco_model)

    def run() -> None:
        # The key frame has the default pose.
        mujoco.mj_resetDataKeyframe(mujoco_model, data, 0)
        for _ in range(round(TO / step)):
            mujoco.mj_step(mujoco_model, data)

    return run


def prepare_driver(model: osimlite.Model, step: float) -> Callable[[], None]:
    """Return a function that simulates in MuJoCo with OpenSim's forces and a fixed step (s)."""
    driver = osimlite.mjcf.Driver(model, timestep=step, equilibrate=True)

    def run() -> None:
        driver.reset()
        driver.step(round(TO / step))

    return run


def prepare_opensim(path: Path, accuracy: float) -> Callable[[], None]:
    """Return a function that simulates a model file in OpenSim with a relative accuracy."""
    model = opensim.Model(str(path))
    model.initSystem()

    def run() -> None:
        # As the driver, OpenSim begins from the equilibrium of the muscles.
        state = model.initSystem()
        model.equilibrateMuscles(state)
        manager = opensim.Manager(model)
        manager.setIntegratorAccuracy(accuracy)
        manager.initialize(state)
        manager.integrate(TO)

    return run


if __name__ == "__main__":
    main()
