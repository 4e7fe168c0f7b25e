"""Find the excitations with which the jumper of the library jumps, and check the jump with OpenSim.

    python benchmarks/jump.py                     # the search that the shipped excitations are from
    python benchmarks/jump.py --seed 2 -o other   # another search

Three searches by CMA-ES follow each other; each starts with the result of the one before. They look
for the excitations of eight muscles, equal in both legs, at certain times:

1. The mass center rises as high as possible.
2. In addition, the feet come back under the mass center during the flight.
3. With the excitations of the landing, the jumper stands at the end.

The excitations and the model are written to the output folder. Then the jump is simulated by
osimlite and by OpenSim at the same accuracies, and the script prints the height of the mass center,
the largest distance of the mass centers of both programs, and the processor time of some
simulations.
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
from _pair import print_pairs, time_pair
from osimlite.io.tables.storage import write_sto
from osimlite.models.jumper import CONTROLS_FILE, MUSCLES, add_jump_controller, jumper
from osimlite.simulation import Simulation
from osimlite.studies.sweep.optimize import Objective, optimize
from osimlite.studies.sweep.plan import plan

FOOT_ANGLE = "(pelvis_tilt + hip_flexion_r + knee_angle_r + ankle_angle_r)"
"""Angle of the foot to the ground (rad)."""

LEAN = "(center_of_mass_X - foot_r_X)"
"""Distance of the mass center ahead of the foot (m)."""

HEIGHT_OBJECTIVE = "-max(center_of_mass_Y)"

FLIGHT_OBJECTIVE = (
    f"{HEIGHT_OBJECTIVE}"
    f" + 3*end({LEAN} + 0.05 + 0.1*center_of_mass_X/speed)^2 + 0.1*end(center_of_mass_X/speed)^2"
    " + 0.2*end(pelvis_tilt + 0.35)^2 + 0.01*end(pelvis_tilt/speed)^2"
    f" + 0.1*end(knee_angle_r + 0.4)^2 + 0.1*end{FOOT_ANGLE}^2"
)
"""Height, and at the end of the flight feet under the mass center, leaning trunk and bent knees."""

LANDING_OBJECTIVE = (
    f"20*mean({LEAN}^2) + mean((pelvis_tilt + 0.35)^2) + end(center_of_mass_Y - 0.95)^2"
    f" + end{FOOT_ANGLE}^2"
    " + 2*end(center_of_mass_X/speed)^2 + 2*end(center_of_mass_Y/speed)^2"
    " + 0.05*end(pelvis_tilt/speed^2 + hip_flexion_r/speed^2 + knee_angle_r/speed^2"
    " + ankle_angle_r/speed^2)"
)
"""Balance during the landing, and a pose at rest at the end."""

STANDING_TIME_S = 1.5
"""Time at which the jumper stands (s)."""

FLIGHT_TIME_S = 0.72
"""Time at which the flight ends (s)."""

EXCITATION_RANGE = (0.01, 1.0)

NEW_EXCITATION = 0.2
"""Excitation at which a new node starts in the second and third search."""

POPULATION_SIZE = 16
"""Candidates of each generation of CMA-ES."""

FIRST_STEP_SIZE = 0.25
"""Initial step size of the first search, relative to the range of the excitations."""

LATER_STEP_SIZE = 0.15
"""Initial step size of the searches that start from a result."""

ACCURACIES = (1e-3, 1e-5, 1e-7)
"""Accuracies at which both programs simulate the jump."""

TIMED_ACCURACIES = (1e-3, 1e-5)

SAMPLE_TIME_S = 0.01


class Search(NamedTuple):
    """One of the searches.

    Attributes:
        name: name of its output folder.
        objective: expression that is minimized.
        to: final time of the simulations (s).
        nodes: times of new excitations (s); in between they are interpolated linearly, and the last
            one holds until the end.
        budget: number of simulations.
        keeps_nodes: whether the nodes of earlier searches stay as they are.
    """

    name: str
    objective: str
    to: float
    nodes: tuple[float, ...]
    budget: int
    keeps_nodes: bool = False


SEARCHES = (
    Search("rise", HEIGHT_OBJECTIVE, 0.6, (0.0, 0.1, 0.2, 0.3, 0.4), 2000),
    Search("flight", FLIGHT_OBJECTIVE, FLIGHT_TIME_S, (0.55, 0.7), 3500),
    Search(
        "landing",
        LANDING_OBJECTIVE,
        STANDING_TIME_S,
        (0.8, 0.9, 1.0, 1.15, 1.35),
        2500,
        # The flight stays as it is; only the landing is searched.
        keeps_nodes=True,
    ),
)

NODES = tuple(t for search in SEARCHES for t in search.nodes)
"""Times of all excitations (s)."""


def get_variable(muscle: str, t: float) -> str:
    """Return the name of the excitation of a muscle in both legs at a time (s)."""
    return f"{muscle}_?/control@{t:g}"


def find_excitations(folder: Path, seed: int) -> tuple[dict[str, float], int]:
    """Run all searches.

    Args:
        folder: folder for the results of the searches.
        seed: seed of the random candidates.

    Returns:
        The excitations by the names of `get_variable`, and the number of simulations.
    """
    model = jumper(driven=False)
    # The model has no controller: the excitations are parameters of the plan.
    excitations: dict[str, float] = {}
    simulation_count = 0
    for search in SEARCHES:
        new = {get_variable(muscle, t): NEW_EXCITATION for muscle in MUSCLES for t in search.nodes}
        ranges: dict[str, Any] = dict.fromkeys({**excitations, **new}, EXCITATION_RANGE)
        if search.keeps_nodes:
            # A number instead of a range is not searched.
            ranges |= excitations
        is_first = not excitations
        result = optimize(
            plan(model, ranges, to=search.to),
            Objective(search.objective),
            folder / search.name,
            seed=seed,
            budget=search.budget,
            popsize=POPULATION_SIZE,
            sigma=FIRST_STEP_SIZE if is_first else LATER_STEP_SIZE,
            # Without a start the first search begins in the middle of the ranges.
            start=None if is_first else {**new, **excitations},
        )
        excitations = dict(result.values)
        simulation_count += result.evaluations
        print(f"{search.name}: objective {result.value:.5g} after {result.evaluations} simulations")
    return excitations, simulation_count


def write_excitations(excitations: dict[str, float], file: Path) -> None:
    """Write the excitations of both legs with three digits as table of controls.

    Args:
        excitations: excitations by the names of `get_variable`.
        file: table to write.
    """
    rows = [
        [round(excitations[get_variable(muscle, t)], 3) for muscle in MUSCLES] * 2 for t in NODES
    ]
    labels = [f"{muscle}_{side}" for side in "rl" for muscle in MUSCLES]
    # Two equal rows at the end hold the last excitations.
    times = (*NODES, STANDING_TIME_S + 0.5)
    write_sto(file, "controls", times, labels, [*rows, rows[-1]])


def write_model(folder: Path, controls_file: Path) -> osimlite.Model:
    """Write jumper.osim with a controller that reads the excitations, and return the model.

    Args:
        folder: folder for the model.
        controls_file: table of controls.
    """
    model = jumper(driven=False)
    add_jump_controller(model, controls_file)
    osimlite.write(model, folder / "jumper.osim")
    return model


def simulate_opensim(file: Path, to: float, accuracy: float) -> np.ndarray:
    """Simulate a model with OpenSim.

    Args:
        file: model file.
        to: final time (s).
        accuracy: accuracy of the integrator.

    Returns:
        Positions of the mass center in ground (times, 3), m, every hundredth of a second.
    """
    import opensim

    opensim.Logger.setLevelString("off")
    model = opensim.Model(str(file))
    state = model.initSystem()
    manager = opensim.Manager(model)
    manager.setIntegratorAccuracy(accuracy)
    manager.initialize(state)
    positions = []
    # The small number keeps the last time in spite of rounding.
    for t in np.arange(SAMPLE_TIME_S, to + 1e-9, SAMPLE_TIME_S):
        state = manager.integrate(t)
        model.realizePosition(state)
        positions.append(model.calcMassCenterPosition(state).to_numpy())
    return np.array(positions)


def compare_jumps(file: Path) -> Table:
    """Simulate a model with both programs, and return the table of heights and distances."""
    table = Table(title="The jump by both programs", title_justify="left")
    headings = (
        "accuracy",
        "highest mass center, osimlite, m",
        "OpenSim, m",
        "largest distance of the mass centers, m",
    )
    for heading in headings:
        table.add_column(heading, justify="right")
    with Simulation(osimlite.read(file), "compiled") as simulation:
        for accuracy in ACCURACIES:
            motion = simulation.run(STANDING_TIME_S, accuracy=accuracy)
            # OpenSim's positions begin after the first step.
            ours = np.array([simulation.mechanism.center_of_mass(q) for q in motion.values[1:]])
            theirs = simulate_opensim(file, STANDING_TIME_S, accuracy)
            table.add_row(
                f"{accuracy:g}",
                f"{ours[:, 1].max():.7f}",
                f"{theirs[:, 1].max():.7f}",
                f"{np.abs(ours - theirs).max():.1e}",
            )
    return table


def compare_times(model: osimlite.Model, file: Path, console: Console) -> None:
    """Print the processor times of simulations of the searches, by both programs.

    Args:
        model: model with its controller.
        file: its file.
        console: where to print.
    """
    with Simulation(model, "compiled") as simulation:

        def simulate_osimlite(to: float, accuracy: float) -> None:
            simulation.run(to, accuracy=accuracy)

        pairs = []
        for to, accuracy in product((FLIGHT_TIME_S, STANDING_TIME_S), TIMED_ACCURACIES):
            pair = time_pair(
                f"to {to:g} s, accuracy {accuracy:g}",
                ours=partial(simulate_osimlite, to, accuracy),
                theirs=partial(simulate_opensim, file, to, accuracy),
                rounds=5,
                clock=time.process_time,
            )
            pairs.append(pair)
    print_pairs("One simulation, processor time", pairs, console=console)


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--seed", type=int, default=1, help="seed of the random candidates, 1 by default"
    )
    parser.add_argument(
        "-o", type=Path, default=Path("jump"), help="output folder, jump by default"
    )
    options = parser.parse_args()
    folder = options.o
    console = Console(width=120)
    wall_start = time.perf_counter()
    processor_start = time.process_time()
    excitations, simulation_count = find_excitations(folder, options.seed)
    wall_time = time.perf_counter() - wall_start
    processor_time = time.process_time() - processor_start
    console.print(
        f"{simulation_count} simulations in {wall_time:.0f} s of wall time and "
        f"{processor_time:.0f} s of processor time: {simulation_count / processor_time:.1f} "
        "simulations/s of one core"
    )
    # The files are named as those of the package, so that they can replace them.
    controls_file = folder / CONTROLS_FILE.name
    write_excitations(excitations, controls_file)
    model = write_model(folder, controls_file)
    console.print(compare_jumps(folder / "jumper.osim"))
    compare_times(model, folder / "jumper.osim", console)


if __name__ == "__main__":
    main()
