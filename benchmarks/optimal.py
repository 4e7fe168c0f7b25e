"""Studies of Moco, solved: time, iterations and objective beside what Moco 4.6 took (../shared/oracle/moco).

    python benchmarks/optimal.py [STUDY ...]

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
STUDIES = "sliding-100", "pendulum-50", "squat-25"
ONE = """
import json, sys, time
import osimlite
study = osimlite.read_document(sys.argv[1])
study.solver.optim_hessian_approximation = sys.argv[2]
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
            for hessian in ("limited-memory", "exact"):
                done = subprocess.run(
                    [sys.executable, "-c", ONE, str(file), hessian], capture_output=True, text=True, check=True
                )
                status, iterations, objective, search, whole, worst = json.loads(done.stdout.splitlines()[-1])
                note = "" if status == "Solve_Succeeded" else f" ({status})"
                print(
                    f"| | {hessian}{note} | {iterations} | {objective:.7g} | {worst:.1e} | {search:.3g} | {whole:.3g} "
                    f"| {said['cpu'] / search:.0f} ({said['cpu'] / whole:.1f} with all) |"
                )


if __name__ == "__main__":
    main(sys.argv[1:])
