"""What 18 muscles do in a measured gait: MocoInverse beside StaticOptimization.

    python benchmarks/muscles_of_gait.py [--core FOLDER] [--picture FILE.png]

FOLDER: as of ``benchmarks/optimal.py``. Both are of one model, whose muscles are those of De Groote
and Fregly. OpenSim's StaticOptimization cannot begin with these; it is asked about the muscles of
the file, and so is ours then.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

import osimlite
from _moco_studies import CORE, GAIT, TESTS, gait_tool, sources
from osimlite.fitting.modifying.operators import process_model
from osimlite.io.tables.storage import StoTable, read_sto, write_sto

THEIRS = (
    "import opensim; opensim.Logger.setLevelString('Off'); opensim.AnalyzeTool('setup.xml').run()"
)
START, END = 0.45, 1.0


def main(core: Path, picture: str) -> None:
    """Print what both find, and draw it."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        sources(core, TESTS, GAIT, folder)
        tool = gait_tool()
        found = osimlite.moco.solve_inverse(tool, folder=folder)
        print(
            f"MocoInverse: {found.status}, {found.iterations} iterations, objective {found.objective:.6g}"
        )
        states, operators = found.states, tool.model.operators
        write_sto(folder / "states.sto", "", states.times, states.columns, states.rows)
        # Loads come from the setup of a tool.
        for file, own in (("moco.osim", operators[:-1]), ("millard.osim", operators[:1])):
            model = process_model(osimlite.ModelProcessor(filepath=GAIT[0], operators=own), folder)
            osimlite.write(model, folder / file)
        muscles = [
            muscle.name for muscle in model.components(osimlite.Millard2012EquilibriumMuscle)
        ]
        reported = osimlite.MuscleAnalysis(name="MuscleAnalysis", start_time=START, end_time=END)
        (forces,) = _run(folder, "moco.osim", reported, "states.sto", ("TendonForce",))
        static = osimlite.StaticOptimization(
            name="StaticOptimization", start_time=START, end_time=END
        )
        activations, shared = _run(folder, "moco.osim", static, "", ("activation", "force"))
        ours, theirs = (
            _run(folder, "millard.osim", static, "", ("activation",), by_opensim=by_opensim)[0]
            for by_opensim in (False, True)
        )
    at = np.abs(ours.times[:, None] - theirs.times).argmin(axis=1)
    off = max(float(np.abs(ours[name] - theirs[name][at]).max()) for name in muscles)
    print(f"StaticOptimization of the muscles of the file: activations are OpenSim's to {off:.2g}")
    print(
        "| muscle | activation, mean | | largest force, N | | rms of the difference, N | correlation |"
    )
    print("|---|---|---|---|---|---|---|")
    for name in muscles:
        a, f = (
            found.states[f"/forceset/{name}/activation"],
            np.interp(states.times, forces.times, forces[name]),
        )
        b, g = (
            np.interp(states.times, table.times, table[name]) for table in (activations, shared)
        )
        rms, alike = np.sqrt(np.mean((f - g) ** 2)), np.corrcoef(f, g)[0, 1]
        print(
            f"| {name} | {a.mean():.3f} | {b.mean():.3f} | {f.max():.0f} | {g.max():.0f} | {rms:.0f} | {alike:.2f} |"
        )
    if picture:
        _draw([name for name in muscles if name.endswith("_r")], forces, shared, picture)


def _run(
    folder: Path,
    model: str,
    analysis: object,
    states: str,
    ends: tuple[str, ...],
    *,
    by_opensim: bool = False,
) -> list[StoTable]:
    """Tables of an analysis along the states of a file, or along the measured motion."""
    tool = osimlite.AnalyzeTool(
        name="gait",
        model_file=model,
        results_directory="results",
        initial_time=START,
        final_time=END,
        states_file=states,
        coordinates_file="" if states else GAIT[1],
        lowpass_cutoff_frequency_for_coordinates=-1.0 if states else 6.0,
        external_loads_file=GAIT[2],
    )
    tool.AnalysisSet.objects.append(analysis)
    osimlite.write(tool, folder / "setup.xml")
    command = ["-c", THEIRS] if by_opensim else ["-m", "osimlite", "run", "setup.xml"]
    done = subprocess.run(
        [sys.executable, *command], cwd=folder, capture_output=True, text=True, check=False
    )
    files = [folder / f"results/gait_{type(analysis).__name__}_{end}.sto" for end in ends]
    if not all(file.exists() for file in files):
        raise SystemExit(f"{command}: {(done.stdout + done.stderr)[-2000:]}")
    found = [read_sto(file) for file in files]
    for file in files:
        file.unlink()
    return found


def _draw(names: list[str], forces: StoTable, shared: StoTable, picture: str) -> None:
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(3, 3, figsize=(9.0, 6.5), sharex=True, layout="constrained")
    for name, own in zip(names, axes.flat, strict=True):
        own.plot(forces.times, forces[name], color="#c0392b", label="MocoInverse")
        own.plot(shared.times, shared[name], color="#2c3e50", ls="--", label="StaticOptimization")
        own.set_title(name, fontsize=9)
    axes[0, 0].legend(fontsize=8, frameon=False)
    figure.supxlabel("time, s")
    figure.supylabel("force, N")
    figure.savefig(picture, dpi=110)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--core", type=Path, default=CORE)
    parser.add_argument("--picture", default="")
    chosen = parser.parse_args()
    main(chosen.core, chosen.picture)
