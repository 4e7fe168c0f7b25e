"""How fast models move in MuJoCo, by the plain file and by the driver, beside OpenSim: simulated seconds per second.

From the default pose, in processor time, in turn; the least of three. OpenSim takes the steps that
its accuracy asks for; the plain file has other laws (see docs/mujoco.md). Give the model files; the
walker is always among them:

    python benchmarks/motion_in_mujoco.py
    opensim-models/Models/*/{gait10dof18musc,Rajagopal2016}.osim
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

WALKER = Path(__file__).resolve().parent.parent / "fixtures" / "walker" / "DynamicWalkerModel.osim"
TO, STEPS, ACCURACIES, ROUNDS = 0.1, (1e-3, 2e-4), (1e-3, 1e-5), 3


def main() -> None:
    opensim.Logger.setLevelString("off")
    for path in (WALKER, *map(Path, sys.argv[1:])):
        model = osimlite.read(path)
        runs = {f"plain file, {step:g} s": plain(model, step) for step in STEPS}
        runs |= {f"driver, {step:g} s": driven(model, step) for step in STEPS}
        runs |= {f"OpenSim, {accuracy:g}": in_opensim(path, accuracy) for accuracy in ACCURACIES}
        times = {
            name: min(turn[name] for turn in [timed(runs) for _ in range(ROUNDS)]) for name in runs
        }
        for name, seconds in times.items():
            print(f"{path.stem:24} {name:20} {TO / seconds:8.2f} s/s")


def timed(runs: dict[str, Callable[[], None]]) -> dict[str, float]:
    """Processor time (s) of each."""
    found = {}
    for name, run in runs.items():
        start = time.process_time()
        run()
        found[name] = time.process_time() - start
    return found


def plain(model: osimlite.Model, step: float) -> Callable[[], None]:
    mjcf = osimlite.to_mjcf(model, visuals=False)
    compiled = mujoco.MjModel.from_xml_string(mjcf.text)
    compiled.opt.timestep = step
    data = mujoco.MjData(compiled)

    def run() -> None:
        mujoco.mj_resetDataKeyframe(compiled, data, 0)
        for _ in range(round(TO / step)):
            mujoco.mj_step(compiled, data)

    return run


def driven(model: osimlite.Model, step: float) -> Callable[[], None]:
    driver = osimlite.mjcf.Driver(model, timestep=step, equilibrate=True)

    def run() -> None:
        driver.reset()
        driver.step(round(TO / step))

    return run


def in_opensim(path: Path, accuracy: float) -> Callable[[], None]:
    model = opensim.Model(str(path))
    model.initSystem()

    def run() -> None:
        state = model.initSystem()
        model.equilibrateMuscles(state)
        manager = opensim.Manager(model)
        manager.setIntegratorAccuracy(accuracy)
        manager.initialize(state)
        manager.integrate(TO)

    return run


if __name__ == "__main__":
    main()
