"""One evaluation of a model: the compiled engine beside MuJoCo's mj_forward on the MJCF that osimlite writes of it.

    python benchmarks/beside_mujoco.py [--rounds N] [FILE ...]

Without files: the built-in walker and jumper, and models of the shared folder where it is there. Both evaluate
the same coordinates and speeds in turn, 1,000 times a round; the time is that of the processor, and the
ratio that of each pair. Nothing of the MJCF is fitted, which does not change the time. An evaluation of ours is a
call of Python that gives all rates; MuJoCo's includes collision detection and its constraint solver.
"""

from __future__ import annotations

import argparse
import gzip
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
from _corpus import CORPUS
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
"""Models of the shared folder by the names of their files."""
CALLS = 1000
"""Evaluations in each round."""
POSES = 20
"""States that are evaluated one after the other."""


def make_ours(model: Any) -> tuple[Callable[[int], None], Any]:
    """Return a function that evaluates a model at one of several states, and these values of its coordinates."""
    simulation = Simulation(model, "compiled", skip_unsupported=True)
    engine: Any = simulation.engine
    start = np.array(engine.get_derivative())
    generator = np.random.default_rng(0)
    states = np.tile(start, (POSES, 1))
    moving = 2 * len(engine.order)
    states[:, :moving] += generator.uniform(-0.02, 0.02, (POSES, moving))
    rows = [row.tolist() for row in states]

    def evaluate(number: int) -> None:
        engine.compute_derivative(0.0, rows[number % POSES])

    return evaluate, states


def make_theirs(model: Any, folder: Path) -> Callable[[int], None]:
    """Return a function that evaluates the MJCF of a model at one of several states."""
    path = osimlite.to_mjcf(model, visuals=False, fit="none").write(folder)[0]
    compiled = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(compiled)
    mujoco.mj_resetDataKeyframe(compiled, data, 0) if compiled.nkey else None
    generator = np.random.default_rng(0)
    start = data.qpos.copy()
    places = start + generator.uniform(-0.02, 0.02, (POSES, len(start)))
    speeds = generator.uniform(-0.02, 0.02, (POSES, compiled.nv))
    data.ctrl[:] = 0.1

    def evaluate(number: int) -> None:
        data.qpos[:] = places[number % POSES]
        data.qvel[:] = speeds[number % POSES]
        mujoco.mj_forward(compiled, data)

    return evaluate


def measure_round(evaluate: Callable[[int], None]) -> float:
    """Return the processor time of one evaluation, us."""
    start = time.process_time()
    for number in range(CALLS):
        evaluate(number)
    return 1e6 * (time.process_time() - start) / CALLS


def find_models(files: list[Path], folder: Path) -> dict[str, Any]:
    """Return the models by name."""
    if files:
        return {file.stem: osimlite.read(file) for file in files}
    models = {name: make_model(name) for name in BUILT_IN}
    for key, name in SHARED.items():
        packed = CORPUS / f"{key}.osim.gz"
        if packed.exists():
            file = folder / f"{name}.osim"
            file.write_bytes(gzip.decompress(packed.read_bytes()))
            models[name] = osimlite.read(file)
    return models


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("files", nargs="*", type=Path, metavar="FILE")
    parser.add_argument("--rounds", type=int, default=9, metavar="N", help="9 by default")
    options = parser.parse_args()
    table = Table(
        title=f"One evaluation, beside MuJoCo {mujoco.__version__}",
        caption="us of the processor, medians; ratio = osimlite / MuJoCo, median of the pairs",
    )
    table.add_column("")
    for heading in ("osimlite", "MuJoCo", "ratio", "least", "greatest"):
        table.add_column(heading, justify="right")
    with tempfile.TemporaryDirectory() as name:
        for label, model in find_models(options.files, Path(name)).items():
            ours, _ = make_ours(model)
            theirs = make_theirs(model, Path(name) / label)
            pairs = [
                (measure_round(ours), measure_round(theirs)) for _ in range(1 + options.rounds)
            ][1:]
            ratios = [one / other for one, other in pairs]
            numbers = (*(median(times) for times in zip(*pairs, strict=True)), median(ratios))
            cells = [f"{number:.3g}" for number in (*numbers, min(ratios), max(ratios))]
            table.add_row(label, *cells)
    Console(width=100).print(table)


if __name__ == "__main__":
    main()
