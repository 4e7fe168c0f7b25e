"""How long it takes until the machine code of a model is ready: compiled, from files, and after a law was edited.

Each number is of a new Python process with a folder of its own for the code. What counts is the time from asking for
the model's laws until all can be called, the loading of the compiler included; processor time adds up all processes
that compile side by side. "One law edited" has files of all laws but one, which stands for one whose sources have
changed. "Everything" is every law that there is: what a model with every kind of joint, constraint and force needs.
The real models are of the corpus.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from rich.console import Console
from rich.table import Table

CORPUS = Path(__file__).resolve().parents[2] / "shared" / "corpus" / "converted"
MODELS = {
    "Dynamic Walker": "simulated(dynamic_walker())",
    "block on balls": "simulated(block())",
    "gait10dof18musc": "simulated(real('m0005'))",
    "gait2392": "simulated(real('m0013'))",
    "Rajagopal": "simulated(real('m0954'))",
    "everything": "machine_code.make_ready(all_laws())",
}
PROGRAM = """
import gzip, json, os, sys, time
sys.path.insert(0, {here!r})
import osimlite
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.simulation import Simulation
from osimlite.simulation.elements.kind import kinds
from osimlite.simulation.engines import machine_code, sources
from osimlite.kernels.table import LAW_MODULES

def block():
    from motions import block
    return block()

def simulated(model):
    Simulation(model, 'compiled', skip_unsupported=True).close()

def real(name):
    text = gzip.open(os.path.join({corpus!r}, name + ".osim.gz")).read().decode()
    return osimlite.read_text(text)

def all_laws():
    declared = [kind.name for kind in kinds() if hasattr(kind, "kernel")]
    return [*LAW_MODULES, *declared]

spent, asked, plain, digest_of = [0.0, 0.0], [], machine_code.make_ready, machine_code.digest_of
edited = os.environ.get("EDITED_LAW")
if edited:
    machine_code.digest_of = lambda law: digest_of(law) + ("e" if law.__name__ == edited else "")

def used():
    return sum(os.times()[:4])

def timed(names):
    start, before = time.perf_counter(), used()
    plain(names)
    spent[0] += time.perf_counter() - start
    spent[1] += used() - before
    asked.extend(name for name in names if name not in asked)

machine_code.make_ready = timed
{make}
print(json.dumps([*spent, asked]))
"""


def main() -> None:
    console = Console(width=100)
    table = Table(title="Seconds until the code of a model is ready", caption="processor time in brackets")
    table.add_column("")
    for heading in ("laws", "compiled", "from files", "one law edited"):
        table.add_column(heading, justify="right")
    for name, make in MODELS.items():
        if "real(" in make and not CORPUS.is_dir():
            continue
        with tempfile.TemporaryDirectory() as folder:
            cold, laws = measured(make, folder)
            cached, _ = measured(make, folder)
            edited, _ = measured(make, folder, laws[-1])
        table.add_row(name, str(len(laws)), cold, cached, f"{laws[-1]}: {edited}")
    console.print(table)


def measured(make: str, folder: str, edited: str = "") -> tuple[str, list[str]]:
    """What a new process takes, and the laws it asked for."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM.format(make=make, corpus=str(CORPUS), here=str(Path(__file__).parent))],
        env={**os.environ, "NUMBA_CACHE_DIR": folder, "EDITED_LAW": edited},
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    seconds, processor, laws = json.loads(done.stdout.splitlines()[-1])
    return f"{seconds:.2f} ({processor:.1f})", laws


if __name__ == "__main__":
    main()
