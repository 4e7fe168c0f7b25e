"""Studies of Moco, solved: time, iterations and objective beside what Moco 4.6 took (../shared/oracle/moco).

    python benchmarks/optimal.py [STUDY ...]

``benchmarks/refinement.py`` shows what meshes save that are refined where it is needed.

Each study is solved in a process of its own; seconds are those of the processor, with importing and making of all.
"""

from __future__ import annotations

import gzip
import json
import subprocess
import sys
import tempfile
from pathlib import Path

MOCO = Path(__file__).resolve().parents[2] / "shared/oracle/moco"
INVERSE = "squat_inverse-20"
"""By the tool: its study has six digits of the motion alone."""
STUDIES = "sliding-100", "pendulum-50", "squat-25", INVERSE
ONE = """
import json, sys, time
import osimlite
study = osimlite.read_document(sys.argv[1])
def more(study):
    study.solver.optim_hessian_approximation = sys.argv[2]
if len(sys.argv) > 3:
    model = study.problem.phases.model.model
    for motion in list(model.components(osimlite.PositionMotion)):
        model.remove(motion)
    lowpass = osimlite.TabOpLowPassFilter(cutoff_frequency=6.0)
    found = osimlite.moco.inverse(
        osimlite.MocoInverse(
            model=osimlite.ModelProcessor(model=model),
            kinematics=osimlite.TableProcessor(filepath=sys.argv[3], operators=[lowpass]),
            kinematics_allow_extra_columns=True, initial_time=0.0, final_time=1.0, mesh_interval=0.05,
            convergence_tolerance=1e-4, constraint_tolerance=1e-4, minimize_sum_squared_activations=True,
        ),
        more=more,
    )
else:
    more(study)
    found = osimlite.moco.solve(study)
worst = found.violations[0].size if found.violations else 0.0
print(json.dumps([found.status, found.iterations, found.objective, found.duration, time.process_time(), worst]))
"""


def main(names: list[str]) -> None:
    """Print a table in Markdown."""
    print("| study | | iterations | objective | largest violation | search, s | all, s | times as fast |")
    print("|---|---|---|---|---|---|---|---|")
    for name in names or STUDIES:
        said = json.loads(gzip.decompress((MOCO / f"{name}.json.gz").read_bytes()))
        print(f"| {name} | Moco | {said['iterations']} | {said['objective']:.7g} | | {said['cpu']:.3g} | | |")
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / f"{name}.omoco"
            file.write_bytes(gzip.decompress((MOCO / f"{name}.omoco.gz").read_bytes()))
            more = []
            if name == INVERSE:
                more = [str(Path(folder) / "squat-25.sto")]
                Path(more[0]).write_bytes(gzip.decompress((MOCO / "squat-25.sto.gz").read_bytes()))
            for hessian in ("limited-memory", "exact"):
                done = subprocess.run(
                    [sys.executable, "-c", ONE, str(file), hessian, *more], capture_output=True, text=True, check=True
                )
                status, iterations, objective, search, whole, worst = json.loads(done.stdout.splitlines()[-1])
                note = "" if status == "Solve_Succeeded" else f" ({status})"
                print(
                    f"| | {hessian}{note} | {iterations} | {objective:.7g} | {worst:.1e} | {search:.3g} | {whole:.3g} "
                    f"| {said['cpu'] / search:.0f} ({said['cpu'] / whole:.1f} with all) |"
                )


if __name__ == "__main__":
    main(sys.argv[1:])
