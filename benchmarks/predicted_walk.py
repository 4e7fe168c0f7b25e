"""Predicted walking, checked in OpenSim by forward simulation with the predicted excitations.

    python benchmarks/predicted_walk.py

The study `human-walks` is solved on its own mesh, and with meshes refined to errors of 1e-2 and
1e-3. OpenSim then integrates the model from the first state for three strides. It has no reflexes,
so that it falls in the end: the error of the mesh grows with every step.

The table in Markdown has for each mesh: the number of intervals, the processor time of the complete
command, the difference between OpenSim and the solution after one step (the largest of all
coordinates, rad or m), the times at which this difference exceeds 0.001, 0.01 and 0.1, and the time
at which the pelvis is lower than 0.7 m.
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

# The integrator must be more accurate than the finest mesh, whose error is measured.
ACCURACY = 1e-8
"""Relative accuracy of OpenSim's integrator."""

STRIDES = 3
"""Number of simulated strides."""

LIMITS = (1e-3, 1e-2, 1e-1)
"""Differences of a coordinate (rad or m) whose times are reported."""

FALL_HEIGHT = 0.7
"""Height of the pelvis (m) below which the model has fallen."""

PELVIS_HEIGHT = "/jointset/ground_pelvis/pelvis_ty/value"


def simulate_in_opensim(
    osim: Any, model_file: Path, stride: Any, to: float, strides: int = 1
) -> Any:
    """Simulate a model in OpenSim with the excitations of a solution.

    Args:
        osim: OpenSim's module.
        model_file: file of the model.
        stride: table of states and controls of a complete stride.
        to: end of the simulation (s).
        strides: how often the controls are repeated.

    Returns:
        Times (n,), those of the table in each stride, and values (n,) by path of the coordinate.
    """
    model = osim.Model(str(model_file))
    model.addController(create_controller(osim, model, stride, strides))
    state = model.initSystem()
    for name in stride.columns:
        if name.endswith(("/value", "/speed", "/activation")):
            model.setStateVariableValue(state, name, float(stride[name][0]))
    manager = osim.Manager(model)
    manager.setIntegratorAccuracy(ACCURACY)
    manager.initialize(state)
    period = float(stride.times[-1])
    all_times = np.concatenate(
        [[0.0], *(number * period + stride.times[1:] for number in range(strides))]
    )
    times = all_times[all_times <= to]
    values: dict[str, list[float]] = {
        name: [] for name in stride.columns if name.endswith("/value")
    }
    for time in times.tolist():
        # The first time is that of the initial state.
        if time:
            state = manager.integrate(time)
        for name, column in values.items():
            column.append(model.getStateVariableValue(state, name))
    return times, {name: np.array(column) for name, column in values.items()}


def create_controller(osim: Any, model: Any, stride: Any, strides: int) -> Any:
    """Return a controller with the excitations of a solution.

    Args:
        osim: OpenSim's module.
        model: OpenSim model.
        stride: table of states and controls of a complete stride.
        strides: how often the controls are repeated.
    """
    controller = osim.PrescribedController()
    period = float(stride.times[-1])
    muscles = model.getMuscles()
    for index in range(muscles.getSize()):
        muscle = muscles.get(index)
        column = stride[f"/forceset/{muscle.getName()}"]
        # Some points of a mesh have no controls.
        is_known = np.isfinite(column)
        function = osim.PiecewiseLinearFunction()
        for number in range(strides):
            # A stride ends with the point where the next one begins.
            first = 1 if number else 0
            for time, value in zip(
                stride.times[is_known][first:], column[is_known][first:], strict=True
            ):
                function.addPoint(float(number * period + time), float(value))
        controller.addActuator(muscle)
        controller.prescribeControlForActuator(muscle.getName(), function)
    return controller


def main() -> None:
    """Print a table in Markdown."""
    print(
        "| mesh | intervals | processor time, s | difference after a step | differs by 0.001 at "
        "| by 0.01 at | by 0.1 at | falls at |"
    )
    print("|---|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        model = folder / "human-walks.osim"
        _run_command("build", "human-walks", "-o", str(model))
        solutions = {
            refine: solve_study(model.with_suffix(".omoco"), folder, refine)
            for refine in ("", "1e-2", "1e-3")
        }
        # OpenSim changes where child processes find libraries, so it is imported after they ran.
        import opensim as osim

        osim.Logger.setLevelString("Error")
        for refine, (seconds, file) in solutions.items():
            print_row(osim, model, f"refined to {refine}" if refine else "own mesh", seconds, file)


def print_row(osim: Any, model: Path, mesh: str, seconds: float, file: Path) -> None:
    """Simulate a solution in OpenSim, and print a row of the table.

    Args:
        osim: OpenSim's module.
        model: model file.
        mesh: name of the mesh.
        seconds: processor time of the solution (s).
        file: table of the stride.
    """
    from osimlite.io.tables.storage import read_sto

    stride = read_sto(file)
    period = float(stride.times[-1])
    times, values = simulate_in_opensim(osim, model, stride, STRIDES * period, STRIDES)
    point_count = len(stride.times) - 1
    differences = compute_differences(stride, values, len(times))
    exceeded = [times[np.argmax(differences > limit)] for limit in LIMITS]
    has_fallen = values[PELVIS_HEIGHT] < FALL_HEIGHT
    fall = f"{times[np.argmax(has_fallen)]:.2f} s" if has_fallen.any() else "not"
    # The stride is the solved step twice, and each interval of the mesh has two points.
    print(
        f"| {mesh} | {point_count // 4} | {seconds:.3g} | {differences[point_count // 2]:.2g} | "
        + " | ".join(f"{time:.2f} s" for time in exceeded)
        + f" | {fall} |",
        flush=True,
    )


def compute_differences(stride: Any, values: dict[str, Any], count: int) -> Any:
    """Return the largest difference of a coordinate from the repeated stride at each time.

    Args:
        stride: table of the stride.
        values: simulated values (count,) by path of the coordinate, rad or m.
        count: number of times.

    Returns:
        Differences (count,), rad or m.
    """
    point_count = len(stride.times) - 1
    rows = np.concatenate([[0], *(np.arange(1, point_count + 1) for _ in range(STRIDES))])
    stride_numbers = np.concatenate(
        [[0], *(np.full(point_count, number) for number in range(STRIDES))]
    )
    differences = np.zeros(count)
    for path, column in values.items():
        # The model moves forward by the same distance in each stride.
        displacement = stride_numbers * (stride[path][-1] - stride[path][0])
        expected = stride[path][rows] + displacement
        differences = np.maximum(differences, np.abs(column - expected))
    return differences


def solve_study(study: Path, folder: Path, refine: str) -> tuple[float, Path]:
    """Solve a study with a command of its own, as CasADi and OpenSim must not share a process.

    Args:
        study: file of the study.
        folder: folder for the results.
        refine: error to which the mesh is refined; empty for the mesh of the study.

    Returns:
        Processor time of the command (s), and the file of the stride.
    """
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    output = folder / f"out{refine}"
    options = ["--refine", refine] if refine else []
    _run_command("run", str(study), *options, "-o", str(output))
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return seconds, output / "human-walks_stride.sto"


def _run_command(*words: str) -> None:
    subprocess.run(
        [sys.executable, "-m", "osimlite", *words], cwd=ROOT, capture_output=True, check=True
    )


if __name__ == "__main__":
    main()
