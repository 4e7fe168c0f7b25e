"""Compare the time of one evaluation of a model by osimlite and by MuJoCo.

    python benchmarks/beside_mujoco.py [--rounds N] [FILE ...]

osimlite uses its compiled engine. MuJoCo (``mj_forward``) evaluates the MJCF that osimlite writes
for the model. Without FILEs, the built-in walker and jumper are measured, and models of the shared
folder where that exists.

Both programs evaluate several states in turn, 1,000 evaluations in each round. The table gives the
processor time of an evaluation (us) and the ratio osimlite / MuJoCo of the pairs of rounds. The
muscle parameters of the MJCF are not fitted, which does not change the time. An evaluation by
osimlite is a call from Python that returns all rates. One by MuJoCo includes collision detection
and the solver of its constraints.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

import mujoco
import numpy as np
from rich.console import Console
from rich.table import Table

import osimlite
from _corpus import CORPUS, unpack_file
from osimlite.models.source import make_model
from osimlite.simulation import Simulation

BUILT_IN = ("dynamic-walker", "jumper")
"""Built-in models that are compared."""

SHARED = {
    "m0001": "arm26",
    "m0005": "gait10dof18musc",
    "m0013": "gait2392",
    "m0954": "Rajagopal2016",
}
"""Names of models of the shared folder, by the names of their files."""

CALLS = 1000
"""Evaluations in each round, so that the clock's resolution does not matter."""

STATE_COUNT = 20
"""Number of states that are evaluated one after the other.

With a single state, results that an engine saves for the last state would make it too fast.
"""

MAX_CHANGE = 0.02
"""Largest random change of coordinates (rad, m) and speeds (rad/s, m/s)."""

MUJOCO_CONTROL = 0.1
"""Control of all actuators of the MJCF."""


def prepare_osimlite(model: osimlite.Model) -> Callable[[int], None]:
    """Return a function that evaluates a model with osimlite at the state of a number."""
    simulation = Simulation(model, "compiled", skip_unsupported=True)
    engine: Any = simulation.engine
    start = np.array(simulation.initial_state({}, {}))
    generator = np.random.default_rng(0)
    states = np.tile(start, (STATE_COUNT, 1))
    # Only coordinates and speeds vary; states of muscles stay.
    moving = 2 * len(engine.order)
    states[:, :moving] += generator.uniform(-MAX_CHANGE, MAX_CHANGE, (STATE_COUNT, moving))
    rows = [row.tolist() for row in states]

    def evaluate(number: int) -> None:
        engine.compute_derivative(0.0, rows[number % STATE_COUNT])

    return evaluate


def prepare_mujoco(model: osimlite.Model, folder: Path) -> Callable[[int], None]:
    """Return a function that evaluates a model with MuJoCo at the state of a number.

    Args:
        model: model to translate.
        folder: folder for the MJCF.
    """
    # Neither meshes nor fitted muscles change the time of an evaluation.
    path = osimlite.to_mjcf(model, visuals=False, fit="none").write(folder)[0]
    compiled = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(compiled)
    if compiled.nkey:
        mujoco.mj_resetDataKeyframe(compiled, data, 0)
    generator = np.random.default_rng(0)
    start = data.qpos.copy()
    values = start + generator.uniform(-MAX_CHANGE, MAX_CHANGE, (STATE_COUNT, len(start)))
    speeds = generator.uniform(-MAX_CHANGE, MAX_CHANGE, (STATE_COUNT, compiled.nv))
    data.ctrl[:] = MUJOCO_CONTROL

    def evaluate(number: int) -> None:
        data.qpos[:] = values[number % STATE_COUNT]
        data.qvel[:] = speeds[number % STATE_COUNT]
        mujoco.mj_forward(compiled, data)

    return evaluate


def measure_round(evaluate: Callable[[int], None]) -> float:
    """Return the processor time of one evaluation (us), the mean of a round."""
    start = time.process_time()
    for number in range(CALLS):
        evaluate(number)
    return 1e6 * (time.process_time() - start) / CALLS


def find_models(files: list[Path], folder: Path) -> dict[str, osimlite.Model]:
    """Read the models to compare.

    Args:
        files: model files; built-in and shared models if the list is empty.
        folder: folder for unpacked files.

    Returns:
        The models by name.
    """
    if files:
        return {file.stem: osimlite.read(file) for file in files}
    models = {name: make_model(name) for name in BUILT_IN}
    for key, name in SHARED.items():
        packed = CORPUS / f"{key}.osim.gz"
        if packed.exists():
            models[name] = osimlite.read(unpack_file(packed, folder / f"{name}.osim"))
    return models


def compare_model(model: osimlite.Model, folder: Path, rounds: int) -> list[str]:
    """Measure a model with both programs in turn.

    Args:
        model: model to evaluate.
        folder: folder for its MJCF.
        rounds: number of pairs of rounds that count.

    Returns:
        Cells of the table: times of osimlite and MuJoCo, and the median, least and greatest ratio.
    """
    ours = prepare_osimlite(model)
    theirs = prepare_mujoco(model, folder)
    # Both programs run in turn, so that they meet the same machine.
    pairs = [(measure_round(ours), measure_round(theirs)) for _ in range(1 + rounds)]
    # The first pair is the warm-up.
    del pairs[0]
    ratios = [one / other for one, other in pairs]
    numbers = (
        median(one for one, _ in pairs),
        median(other for _, other in pairs),
        median(ratios),
        min(ratios),
        max(ratios),
    )
    return [f"{number:.3g}" for number in numbers]


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("files", nargs="*", type=Path, metavar="FILE", help="model file")
    parser.add_argument(
        "--rounds", type=int, default=9, metavar="N", help="number of rounds, 9 by default"
    )
    options = parser.parse_args()
    table = Table(
        title=f"One evaluation, by osimlite and by MuJoCo {mujoco.__version__}",
        caption="median processor times; ratio = osimlite / MuJoCo of the pairs of rounds",
    )
    table.add_column("model")
    for heading in ("osimlite, us", "MuJoCo, us", "ratio", "least", "greatest"):
        table.add_column(heading, justify="right")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for label, model in find_models(options.files, folder).items():
            table.add_row(label, *compare_model(model, folder / label, options.rounds))
    Console(width=100).print(table)


if __name__ == "__main__":
    main()
