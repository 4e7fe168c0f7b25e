"""Forces of 18 muscles in a measured gait: MocoInverse compared with StaticOptimization.

    python benchmarks/muscles_of_gait.py [--core FOLDER] [--picture FILE.png]

FOLDER contains the sources of opensim-core, or is its git directory, as for benchmarks/optimal.py.
Both methods are osimlite's and use one model, with muscles of De Groote and Fregly. OpenSim's
StaticOptimization does not support these muscles; for a check of ours, both programs also solve
with the original muscles of the file, and the largest difference of an activation is printed.

The table in Markdown has, for each muscle, the mean activation and the largest force of MocoInverse
and then of StaticOptimization, the root mean square of the difference of the forces, and their
correlation. The picture shows the forces of the right leg.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

import osimlite
from _moco_studies import CORE, GAIT, TESTS, copy_sources, make_gait_inverse
from osimlite.fitting.modifying.operators import process_model
from osimlite.io.tables.storage import StoTable, read_sto, write_sto
from osimlite.moco import MocoSolution

OPENSIM_SCRIPT = (
    "import opensim; opensim.Logger.setLevelString('Off'); opensim.AnalyzeTool('setup.xml').run()"
)

# These are the times of the solution of MocoInverse.
START = 0.45
"""Start of the analyses (s)."""

END = 1.0
"""End of the analyses (s)."""


def main(core: Path, picture: str) -> None:
    """Solve with both methods, print the table, and draw the picture if its name is not empty."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        copy_sources(core, TESTS, GAIT, folder)
        solution = solve_moco_inverse(folder)
        states = solution.states
        write_sto(folder / "states.sto", "", states.times, states.columns, states.rows)
        muscles = write_models(folder)
        # The solution has activations and states; the analysis computes forces from them.
        (forces,) = run_analysis(
            folder,
            "moco.osim",
            osimlite.MuscleAnalysis(name="MuscleAnalysis", start_time=START, end_time=END),
            "states.sto",
            ("TendonForce",),
        )
        static = osimlite.StaticOptimization(
            name="StaticOptimization", start_time=START, end_time=END
        )
        static_activations, static_forces = run_analysis(
            folder, "moco.osim", static, "", ("activation", "force")
        )
        difference = compare_with_opensim(folder, static, muscles)
    print(
        "StaticOptimization with the muscles of the file: activations differ from OpenSim's by at "
        f"most {difference:.2g}"
    )
    print_table(muscles, solution, forces, static_activations, static_forces)
    if picture:
        right_muscles = [name for name in muscles if name.endswith("_r")]
        draw_forces(right_muscles, forces, static_forces, picture)


def solve_moco_inverse(folder: Path) -> MocoSolution:
    """Solve MocoInverse with the files of a folder, and print how the solver ended."""
    solution = osimlite.moco.solve_inverse(make_gait_inverse(), folder=folder)
    print(
        f"MocoInverse: {solution.status}, {solution.iterations} iterations, "
        f"objective {solution.objective:.6g}"
    )
    return solution


def write_models(folder: Path) -> list[str]:
    """Write the models of MocoInverse and with the original muscles.

    Args:
        folder: folder with the source files, to which `moco.osim` and `millard.osim` are added.

    Returns:
        Names of the muscles.
    """
    operators = make_gait_inverse().model.operators
    # The last operator adds external loads, which the analyses take from their setup file.
    for file, file_operators in (("moco.osim", operators[:-1]), ("millard.osim", operators[:1])):
        model = process_model(
            osimlite.ModelProcessor(filepath=GAIT[0], operators=file_operators), folder
        )
        osimlite.write(model, folder / file)
    return [muscle.name for muscle in model.components(osimlite.Millard2012EquilibriumMuscle)]


def compare_with_opensim(
    folder: Path, static: osimlite.StaticOptimization, muscles: list[str]
) -> float:
    """Return the largest difference of an activation from OpenSim's, with the original muscles.

    Args:
        folder: folder with the model files.
        static: static optimization.
        muscles: names of the muscles.
    """
    (ours,) = run_analysis(folder, "millard.osim", static, "", ("activation",))
    (theirs,) = run_analysis(folder, "millard.osim", static, "", ("activation",), by_opensim=True)
    # The programs may write different times; compare with the nearest ones.
    nearest = np.abs(ours.times[:, None] - theirs.times).argmin(axis=1)
    return max(float(np.abs(ours[name] - theirs[name][nearest]).max()) for name in muscles)


def run_analysis(
    folder: Path,
    model: str,
    analysis: object,
    states: str,
    suffixes: tuple[str, ...],
    *,
    by_opensim: bool = False,
) -> list[StoTable]:
    """Run an analysis along the states of a file, or along the measured motion.

    Args:
        folder: folder with the input files.
        model: name of the model file.
        analysis: analysis to run.
        states: name of the file of states; empty for the measured motion.
        suffixes: last parts of the names of the result tables.
        by_opensim: whether OpenSim runs it instead of osimlite.

    Raises:
        SystemExit: a result file is missing; the message ends with the output of the program.
    """
    tool = osimlite.AnalyzeTool(
        name="gait",
        model_file=model,
        results_directory="results",
        initial_time=START,
        final_time=END,
        states_file=states,
        coordinates_file="" if states else GAIT[1],
        # This is the filter that MocoInverse applies to the measured motion.
        lowpass_cutoff_frequency_for_coordinates=-1.0 if states else 6.0,
        external_loads_file=GAIT[2],
    )
    tool.AnalysisSet.objects.append(analysis)
    osimlite.write(tool, folder / "setup.xml")
    arguments = ["-c", OPENSIM_SCRIPT] if by_opensim else ["-m", "osimlite", "run", "setup.xml"]
    done = subprocess.run(
        [sys.executable, *arguments], cwd=folder, capture_output=True, text=True, check=False
    )
    files = [folder / f"results/gait_{type(analysis).__name__}_{end}.sto" for end in suffixes]
    if not all(file.exists() for file in files):
        raise SystemExit(f"{arguments}: {(done.stdout + done.stderr)[-2000:]}")
    tables = [read_sto(file) for file in files]
    # osimlite does not overwrite results, and another analysis has files of the same names.
    for file in files:
        file.unlink()
    return tables


def print_table(
    muscles: list[str],
    solution: MocoSolution,
    forces: StoTable,
    static_activations: StoTable,
    static_forces: StoTable,
) -> None:
    """Print a row for each muscle, at the times of MocoInverse.

    Args:
        muscles: names of the muscles.
        solution: solution of MocoInverse.
        forces: its tendon forces (N).
        static_activations: activations of StaticOptimization.
        static_forces: its forces (N).
    """
    print(
        "| muscle | mean activation: MocoInverse | StaticOptimization "
        "| largest force, N: MocoInverse | StaticOptimization "
        "| rms of the difference, N | correlation |"
    )
    print("|---|---|---|---|---|---|---|")
    states = solution.states
    for name in muscles:
        activation = states[f"/forceset/{name}/activation"]
        force = np.interp(states.times, forces.times, forces[name])
        static_activation = np.interp(
            states.times, static_activations.times, static_activations[name]
        )
        static_force = np.interp(states.times, static_forces.times, static_forces[name])
        rms = np.sqrt(np.mean((force - static_force) ** 2))
        correlation = np.corrcoef(force, static_force)[0, 1]
        print(
            f"| {name} | {activation.mean():.3f} | {static_activation.mean():.3f} "
            f"| {force.max():.0f} | {static_force.max():.0f} | {rms:.0f} | {correlation:.2f} |"
        )


def draw_forces(names: list[str], forces: StoTable, static_forces: StoTable, picture: str) -> None:
    """Draw the forces of nine muscles (N) over time.

    Args:
        names: names of the muscles.
        forces: forces of MocoInverse.
        static_forces: forces of StaticOptimization.
        picture: file to write.
    """
    import matplotlib.pyplot as plt

    # The right leg has nine muscles.
    figure, axes = plt.subplots(3, 3, figsize=(9.0, 6.5), sharex=True, layout="constrained")
    for name, panel in zip(names, axes.flat, strict=True):
        panel.plot(forces.times, forces[name], color="#c0392b", label="MocoInverse")
        panel.plot(
            static_forces.times,
            static_forces[name],
            color="#2c3e50",
            ls="--",
            label="StaticOptimization",
        )
        panel.set_title(name, fontsize=9)
    axes[0, 0].legend(fontsize=8, frameon=False)
    figure.supxlabel("time, s")
    figure.supylabel("force, N")
    figure.savefig(picture, dpi=110)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--core", type=Path, default=CORE, help="sources or git directory of opensim-core"
    )
    parser.add_argument("--picture", default="", help="file of the picture to draw")
    options = parser.parse_args()
    main(options.core, options.picture)
