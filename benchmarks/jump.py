"""How the jumper of the library was taught to jump, and what OpenSim makes of its jump.

Three searches by cma, each from where the one before ended. They look for the excitations of eight
muscles, equal in both legs, at some moments: the mass center is to rise as high as it can; then the
feet are to come back under it as well; then, with the excitations of the landing, it is to stand.
OpenSim makes the jump that was found, at the same accuracies, and some runs of the searches, in
turn with osimlite.

    python benchmarks/jump.py                     # the search that the shipped excitations are from
    python benchmarks/jump.py --seed 2 -o other   # another one
"""

from __future__ import annotations

import argparse
import time
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table

import osimlite
from _pair import pair, report
from osimlite.io.tables.storage import write_sto
from osimlite.models.jumper import CONTROLS_FILE, MUSCLES, add_jump_controller, jumper
from osimlite.simulation import Simulation
from osimlite.studies.sweep.optimize import Objective, optimize
from osimlite.studies.sweep.plan import plan

FOOT = "(pelvis_tilt + hip_flexion_r + knee_angle_r + ankle_angle_r)"
AHEAD = "(center_of_mass_X - foot_r_X)"
FLY = (
    "-max(center_of_mass_Y)"
    f" + 3*end({AHEAD} + 0.05 + 0.1*center_of_mass_X/speed)^2 + 0.1*end(center_of_mass_X/speed)^2"
    " + 0.2*end(pelvis_tilt + 0.35)^2 + 0.01*end(pelvis_tilt/speed)^2"
    f" + 0.1*end(knee_angle_r + 0.4)^2 + 0.1*end{FOOT}^2"
)
LAND = (
    f"20*mean({AHEAD}^2) + mean((pelvis_tilt + 0.35)^2) + end(center_of_mass_Y - 0.95)^2 + end{FOOT}^2"
    " + 2*end(center_of_mass_X/speed)^2 + 2*end(center_of_mass_Y/speed)^2"
    " + 0.05*end(pelvis_tilt/speed^2 + hip_flexion_r/speed^2 + knee_angle_r/speed^2 + ankle_angle_r/speed^2)"
)
STANDING = 1.5
"""When it is to stand (s)."""


class Lesson(NamedTuple):
    """A search.

    Attributes: name: of its folder. objective: what is made small. to: when a run ends (s). nodes:
        when the excitations have nodes that are looked for (s); between nodes are lines, and the
        last one holds. budget: how many runs. keeps: whether the nodes of earlier lessons stay as
        they are.
    """

    name: str
    objective: str
    to: float
    nodes: tuple[float, ...]
    budget: int
    keeps: bool = False


LESSONS = (
    Lesson("rise", "-max(center_of_mass_Y)", 0.6, (0.0, 0.1, 0.2, 0.3, 0.4), 2000),
    Lesson("flight", FLY, 0.72, (0.55, 0.7), 3500),
    Lesson("landing", LAND, STANDING, (0.8, 0.9, 1.0, 1.15, 1.35), 2500, keeps=True),
)
NODES = tuple(t for lesson in LESSONS for t in lesson.nodes)


def variable(muscle: str, t: float) -> str:
    """The name of the excitation at a time, of both legs."""
    return f"{muscle}_?/control@{t:g}"


def learn(folder: Path, seed: int) -> tuple[dict[str, float], int]:
    """The excitations that are found, and how many runs that took."""
    model, found, runs = jumper(driven=False), dict[str, float](), 0
    for lesson in LESSONS:
        # What is new begins low, but for the first lesson, which begins in the middle.
        new = {variable(muscle, t): 0.2 for muscle in MUSCLES for t in lesson.nodes}
        ranges: dict[str, Any] = dict.fromkeys({**found, **new}, (0.01, 1.0))
        if lesson.keeps:
            ranges |= found
        end = optimize(
            plan(model, ranges, to=lesson.to),
            Objective(lesson.objective),
            folder / lesson.name,
            seed=seed,
            budget=lesson.budget,
            popsize=16,
            sigma=0.15 if found else 0.25,
            start={**new, **found} if found else None,
        )
        found, runs = dict(end.values), runs + end.evaluations
        print(f"{lesson.name}: {end.value:.5g} after {end.evaluations} runs")
    return found, runs


def write_table(found: dict[str, float], file: Path) -> None:
    """The excitations with three digits, for both legs; two equal rows at the end hold the last one."""
    rows = [[round(found[variable(muscle, t)], 3) for muscle in MUSCLES] * 2 for t in NODES]
    labels = [f"{muscle}_{side}" for side in "rl" for muscle in MUSCLES]
    write_sto(file, "controls", (*NODES, STANDING + 0.5), labels, [*rows, rows[-1]])


def opensim_motion(file: Path, to: float, accuracy: float) -> np.ndarray:
    """The mass center (m) in ground every hundredth of a second."""
    import opensim

    opensim.Logger.setLevelString("off")
    model = opensim.Model(str(file))
    state = model.initSystem()
    manager = opensim.Manager(model)
    manager.setIntegratorAccuracy(accuracy)
    manager.initialize(state)
    found = []
    for t in np.arange(0.01, to + 1e-9, 0.01):
        state = manager.integrate(t)
        model.realizePosition(state)
        found.append(model.calcMassCenterPosition(state).to_numpy())
    return np.array(found)


def confirm(file: Path) -> Table:
    """The jump of a file in both programs."""
    table = Table(title="The jump, by both programs", title_justify="left")
    for column in (
        "accuracy",
        "highest, osimlite, m",
        "OpenSim, m",
        "mass center apart at most, m",
    ):
        table.add_column(column, justify="right")
    with Simulation(osimlite.read(file), "compiled") as simulation:
        for accuracy in (1e-3, 1e-5, 1e-7):
            motion = simulation.run(STANDING, accuracy=accuracy)
            ours = np.array([simulation.mechanism.center_of_mass(q) for q in motion.values[1:]])
            theirs = opensim_motion(file, STANDING, accuracy)
            apart = np.abs(ours - theirs).max()
            table.add_row(
                f"{accuracy:g}",
                f"{ours[:, 1].max():.7f}",
                f"{theirs[:, 1].max():.7f}",
                f"{apart:.1e}",
            )
    return table


def main() -> None:
    words = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    words.add_argument("--seed", type=int, default=1)
    words.add_argument("-o", type=Path, default=Path("jump"), help="folder of the results")
    given = words.parse_args()
    console = Console(width=120)
    started, before = time.perf_counter(), time.process_time()
    found, runs = learn(given.o, given.seed)
    wall, busy = time.perf_counter() - started, time.process_time() - before
    write_table(found, given.o / CONTROLS_FILE.name)
    model = jumper(driven=False)
    add_jump_controller(model, given.o / CONTROLS_FILE.name)
    file = given.o / "jumper.osim"
    osimlite.write(model, file)
    console.print(
        f"{runs} runs, {wall:.0f} s by the clock, {busy:.0f} s of processors: {runs / busy:.1f} runs/s per core"
    )
    console.print(confirm(file))
    with Simulation(model, "compiled") as simulation:

        def ours(to: float, accuracy: float) -> None:
            simulation.run(to, accuracy=accuracy)

        pairs = []
        for to, accuracy in product((0.72, STANDING), (1e-3, 1e-5)):
            run, other = partial(ours, to, accuracy), partial(opensim_motion, file, to, accuracy)
            name = f"to {to:g} s, accuracy {accuracy:g}"
            pairs.append(pair(name, ours=run, theirs=other, rounds=5, clock=time.process_time))
    report("One run, time of its processor", pairs, console=console)


if __name__ == "__main__":
    main()
