"""Does the walk that optimal control finds go on in OpenSim, driven with nothing but the excitations that were found?

    python benchmarks/predicted_walk.py

The study is solved on the mesh that it has, and refined to 1e-2 and 1e-3; then OpenSim integrates
the model from the first state, stride after stride. A walk without reflexes falls in the end: what
the mesh was too coarse for grows with each step.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
ACCURACY = 1e-8
STRIDES = 3
LIMITS = 1e-3, 1e-2, 1e-1
"""Of how far a coordinate is off, rad or m."""


def forward(osim: Any, model_file: Path, table: Any, to: float, strides: int = 1) -> Any:
    """Where OpenSim's coordinates are at the times of a stride, and of those after it, up to a time.

    Args:
        osim: OpenSim's module.
        model_file: of the model.
        table: of a whole stride: states and controls.
        to: until when, s.
        strides: how many there are controls for.

    Returns:
        Times (n,), and by paths of values (n,).
    """
    model = osim.Model(str(model_file))
    brain = osim.PrescribedController()
    model.addController(brain)
    period, muscles = float(table.times[-1]), model.getMuscles()
    for k in range(muscles.getSize()):
        lines, column = (
            osim.PiecewiseLinearFunction(),
            table[f"/forceset/{muscles.get(k).getName()}"],
        )
        known = np.isfinite(column)
        for stride in range(strides):
            for time, value in zip(
                table.times[known][stride > 0 :], column[known][stride > 0 :], strict=True
            ):
                lines.addPoint(float(stride * period + time), float(value))
        brain.addActuator(muscles.get(k))
        brain.prescribeControlForActuator(muscles.get(k).getName(), lines)
    state = model.initSystem()
    for name in (
        name for name in table.columns if name.endswith(("/value", "/speed", "/activation"))
    ):
        model.setStateVariableValue(state, name, float(table[name][0]))
    manager = osim.Manager(model)
    manager.setIntegratorAccuracy(ACCURACY)
    manager.initialize(state)
    all_times = np.concatenate(
        [[0.0], *(stride * period + table.times[1:] for stride in range(strides))]
    )
    times = all_times[all_times <= to]
    found: dict[str, list[float]] = {name: [] for name in table.columns if name.endswith("/value")}
    for time in times.tolist():
        if time:
            state = manager.integrate(time)
        for name, column in found.items():
            column.append(model.getStateVariableValue(state, name))
    return times, {name: np.array(column) for name, column in found.items()}


def main() -> None:
    """Print a table in Markdown."""
    from osimlite.io.tables.storage import read_sto

    print(
        "| mesh | intervals | all, s | after a step, off by | off by 0.001, at | 0.01 | 0.1 | falls |"
    )
    print("|---|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        model = folder / "human-walks.osim"
        _run("build", "human-walks", "-o", str(model))
        found_of = {
            refine: _solved(model.with_suffix(".omoco"), folder, refine)
            for refine in ("", "1e-2", "1e-3")
        }
        # It changes where programs that are started look for libraries.
        import opensim as osim

        osim.Logger.setLevelString("Error")
        for refine, (seconds, file) in found_of.items():
            table = read_sto(file)
            period = float(table.times[-1])
            times, found = forward(osim, model, table, STRIDES * period, STRIDES)
            many = len(table.times) - 1
            row = np.concatenate([[0], *(np.arange(1, many + 1) for _ in range(STRIDES))])
            strides = np.concatenate([[0], *(np.full(many, stride) for stride in range(STRIDES))])
            off = np.zeros(len(times))
            for path, column in found.items():
                way = strides * (table[path][-1] - table[path][0])
                off = np.maximum(off, np.abs(column - table[path][row] - way))
            passed = [times[np.argmax(off > limit)] for limit in LIMITS]
            height = found["/jointset/ground_pelvis/pelvis_ty/value"]
            falls = f"{times[np.argmax(height < 0.7)]:.2f} s" if (height < 0.7).any() else "not"
            print(
                f"| {f'refined to {refine}' if refine else 'as it is'} | {many // 4} | {seconds:.3g} | "
                f"{off[many // 2]:.2g} | "
                + " | ".join(f"{time:.2f} s" for time in passed)
                + f" | {falls} |",
                flush=True,
            )


def _solved(study: Path, folder: Path, refine: str) -> tuple[float, Path]:
    """Processor seconds of the whole command, and the file of the stride; CasADi and OpenSim share no process."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    own = folder / f"out{refine}"
    _run("run", str(study), *(["--refine", refine] if refine else []), "-o", str(own))
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return (
        after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime,
        own / "human-walks_stride.sto",
    )


def _run(*words: str) -> None:
    subprocess.run(
        [sys.executable, "-m", "osimlite", *words], cwd=ROOT, capture_output=True, check=True
    )


if __name__ == "__main__":
    main()
